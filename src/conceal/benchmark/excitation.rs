//! How an arm is moved: five kinds of commands, of which a case uses one to learn from and another to test on.

use std::f64::consts::TAU;

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::arm::{Arm, logarithmic, sign};
use super::motion::{Drive, Machine, Precision};
use crate::sim2real::Seed;

/// A plan of commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Excitation {
    Multisine,
    Chirp,
    Steps,
    Noise,
    Pulses,
}

impl Excitation {
    const ALL: [Self; 5] = [Self::Multisine, Self::Chirp, Self::Steps, Self::Noise, Self::Pulses];

    /// To learn from: mostly what engineers would use for that.
    pub fn to_learn(rng: &mut impl Rng) -> Self {
        match rng.random::<f64>() {
            x if x < 0.35 => Self::Multisine,
            x if x < 0.6 => Self::Noise,
            x if x < 0.8 => Self::Steps,
            x if x < 0.9 => Self::Chirp,
            _ => Self::Pulses,
        }
    }

    /// To test on: any other.
    pub fn other(self, rng: &mut impl Rng) -> Self {
        let others: Vec<Self> = Self::ALL.into_iter().filter(|kind| *kind != self).collect();
        others[rng.random_range(0..others.len())]
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Multisine => "multisine",
            Self::Chirp => "chirp",
            Self::Steps => "steps",
            Self::Noise => "filtered noise",
            Self::Pulses => "pulses",
        }
    }

    /// A wave of about unit size. For an arm that adds errors up, what would carry it away is filtered out.
    pub fn wave(self, rows: usize, sample: f64, adds_up: bool, rng: &mut impl Rng) -> Vec<f64> {
        let mut wave = match self {
            Self::Multisine => multisine(rows, sample, rng),
            Self::Chirp => chirp(rows, sample, rng),
            Self::Steps => steps(rows, sample, rng),
            Self::Noise => noise(rows, sample, rng),
            Self::Pulses => pulses(rows, sample, rng),
        };
        if adds_up {
            let mut slow = 0.0;
            for value in &mut wave {
                slow += (*value - slow) * sample / 1.2;
                *value -= slow;
            }
            let mean = wave.iter().sum::<f64>() / rows as f64;
            wave.iter_mut().for_each(|value| *value -= mean);
        }
        wave
    }
}

fn multisine(rows: usize, sample: f64, rng: &mut impl Rng) -> Vec<f64> {
    let count = rng.random_range(7..14);
    let (low, high) = (logarithmic(rng, 0.06, 0.15), logarithmic(rng, 2.5, 6.0));
    let tones: Vec<(f64, f64, f64)> = (0..count)
        .map(|k| {
            let frequency = low * (high / low).powf(f64::from(k) / f64::from(count - 1));
            (frequency, 1.0 / (1.0 + frequency / 2.5), rng.random::<f64>() * TAU)
        })
        .collect();
    (0..rows)
        .map(|row| {
            let time = row as f64 * sample;
            tones.iter().map(|(frequency, size, phase)| size * (TAU * frequency * time + phase).sin()).sum::<f64>() / 2.0
        })
        .collect()
}

/// A sine that rises, or rises and comes back.
fn chirp(rows: usize, sample: f64, rng: &mut impl Rng) -> Vec<f64> {
    let (low, high) = (logarithmic(rng, 0.08, 0.2), logarithmic(rng, 2.0, 5.0));
    let turns = if rng.random::<bool>() { 1.0 } else { 2.0 };
    let mut phase = 0.0;
    (0..rows)
        .map(|row| {
            let part = turns * row as f64 / rows as f64;
            let up = if part > 1.0 { 2.0 - part } else { part };
            phase += TAU * low * (high / low).powf(up) * sample;
            phase.sin()
        })
        .collect()
}

/// Levels, each held for a while, some of them zero: an arm with friction comes to rest.
fn steps(rows: usize, sample: f64, rng: &mut impl Rng) -> Vec<f64> {
    let longest = logarithmic(rng, 0.8, 2.5);
    let mut wave = Vec::with_capacity(rows);
    while wave.len() < rows {
        let level = if rng.random::<f64>() < 0.2 { 0.0 } else { rng.random_range(-1.6..1.6) };
        let length = (rng.random_range(0.2 * longest..longest) / sample) as usize;
        wave.extend(std::iter::repeat_n(level, length.clamp(1, rows - wave.len())));
    }
    wave
}

/// White noise through two poles.
fn noise(rows: usize, sample: f64, rng: &mut impl Rng) -> Vec<f64> {
    let part = 1.0 - (-TAU * logarithmic(rng, 0.5, 2.0) * sample).exp();
    let (mut first, mut second) = (0.0, 0.0);
    let mut wave: Vec<f64> = (0..rows)
        .map(|_| {
            let fresh: f64 = StandardNormal.sample(rng);
            first += part * (fresh - first);
            second += part * (first - second);
            second
        })
        .collect();
    let size = (wave.iter().map(|v| v * v).sum::<f64>() / rows as f64).sqrt();
    wave.iter_mut().for_each(|value| *value /= size.max(1e-12));
    wave
}

/// Short pushes one way and the other, with rests between them.
fn pulses(rows: usize, sample: f64, rng: &mut impl Rng) -> Vec<f64> {
    let mut wave = vec![0.0; rows];
    let mut time = 0.2;
    while time < rows as f64 * sample {
        let (size, width) = (sign(rng) * rng.random_range(0.7..2.2), rng.random_range(0.08..0.45));
        let double = rng.random::<bool>();
        for (from, to, size) in
            [(time, time + width, size), (time + width, time + 2.0 * width, if double { -size } else { 0.0 })]
        {
            let rows = (from / sample) as usize..((to / sample) as usize).min(rows);
            rows.for_each(|row| wave[row] = size);
        }
        time += 2.0 * width + rng.random_range(0.1..1.2);
    }
    wave
}

/// How far an arm is to be moved [rad]: root mean square, and at the most.
#[derive(Debug, Clone, Copy)]
pub(super) struct Swing {
    pub usual: f64,
    pub most: f64,
}

impl Swing {
    /// At random for an arm: few spin over.
    pub fn draw(arm: &Arm, rng: &mut impl Rng) -> Self {
        if arm.linear {
            return Self { usual: logarithmic(rng, 0.03, 0.3), most: f64::INFINITY };
        }
        let spins = rng.random::<f64>() < 0.06;
        if arm.adds_up() {
            return Self { usual: logarithmic(rng, 0.4, 3.0), most: f64::INFINITY };
        }
        let usual = if spins { rng.random_range(1.3..2.5) } else { logarithmic(rng, 0.2, 0.9) };
        Self { usual, most: if spins { f64::INFINITY } else { 2.1 } }
    }
}

/// `wave` made as large as it takes for `arm` to move by `swing` from `start`.
pub(super) fn driven(arm: Arm, wave: &[f64], sample: f64, start: f64, swing: Swing) -> Drive {
    let machine = Machine::new(arm, &[]);
    let drive = |size: f64| {
        // Commands in files have five digits or so.
        let digits = 10.0_f64.powi(4 - size.log10().floor() as i32);
        let commands = wave.iter().map(|value| (size * value * digits).round() / digits).collect();
        Drive { commands, sample, start, speed: 0.0 }
    };
    let moved = |size: f64| {
        let drive = drive(size);
        let motion = machine.run(&drive, Precision::Coarse, Seed(0));
        let rows = drive.commands.len();
        let (sum, square) = (0..rows).step_by(5).fold((0.0, 0.0), |(sum, square), row| {
            let q = motion.at(drive.time(row));
            (sum + q, square + q * q)
        });
        let count = rows.div_ceil(5) as f64;
        ((square / count - (sum / count).powi(2)).max(0.0).sqrt(), motion.reach())
    };
    // Nearly in proportion: a few steps come near enough, and one that goes too far is drawn back.
    let mut size = 0.3 * arm.gravity_torque.max(arm.viscous_friction) / arm.gain;
    for step in 0..12 {
        let (usual, most) = moved(size);
        let factor = (swing.usual / usual.max(1e-9)).min(swing.most / most.max(1e-9));
        if factor > 0.95 && (factor < 1.05 || step >= 5) {
            break;
        }
        size *= if step < 5 { factor.clamp(0.2, 5.0) } else { 0.85 };
    }
    drive(size)
}
