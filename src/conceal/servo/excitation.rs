//! How an arm is moved so that what is concealed shows.

use std::f64::consts::TAU;

use rand::RngExt;

use crate::sim2real::Seed;

/// A plan of commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Excitation {
    /// Many sines over held levels, then held levels alone: to identify from.
    SinesAndSteps,
    /// A rising frequency, then quick random levels: to test on, as it is unlike the other.
    ChirpAndSteps,
}

/// Share of a recording that the sines or the chirp take.
const MOVING: f64 = 0.6;

impl Excitation {
    /// Commands for `rows` samples of `sample` [s], at most 2.5 in size.
    #[must_use]
    pub fn commands(self, rows: usize, sample: f64, seed: Seed) -> Vec<f64> {
        let moving = (rows as f64 * MOVING) as usize;
        let wave = match self {
            Self::SinesAndSteps => sines(moving, sample, seed),
            Self::ChirpAndSteps => chirp(moving, sample),
        };
        let levels = match self {
            Self::SinesAndSteps => steps(rows, sample, (0.8, 2.2), 1.1, seed),
            Self::ChirpAndSteps => steps(rows, sample, (0.25, 1.2), 1.5, seed),
        };
        (0..rows)
            .map(|row| {
                let command = match (self, wave.get(row)) {
                    (Self::SinesAndSteps, Some(wave)) => wave + 0.6 * levels[row],
                    (Self::ChirpAndSteps, Some(wave)) => *wave,
                    (_, None) => levels[row],
                };
                (command.clamp(-2.5, 2.5) * 1e4).round() / 1e4
            })
            .collect()
    }
}

/// Ten sines of 0.1 to 4 Hz, evenly spaced in the logarithm, with random phases.
fn sines(rows: usize, sample: f64, seed: Seed) -> Vec<f64> {
    const COUNT: usize = 10;
    let mut rng = seed.stream("servo sines");
    let tones: Vec<(f64, f64, f64)> = (0..COUNT)
        .map(|k| {
            let frequency = 0.1 * 40.0_f64.powf(k as f64 / (COUNT - 1) as f64);
            (frequency, 0.38 / (1.0 + frequency / 3.0), rng.random::<f64>() * TAU)
        })
        .collect();
    (0..rows)
        .map(|row| {
            let time = row as f64 * sample;
            tones.iter().map(|(frequency, size, phase)| size * (TAU * frequency * time + phase).sin()).sum()
        })
        .collect()
}

/// A sine whose frequency rises from 0.15 to 3.5 Hz, starting from zero.
fn chirp(rows: usize, sample: f64) -> Vec<f64> {
    let duration = rows as f64 * sample;
    let (low, high) = (0.15, 3.5);
    (0..rows)
        .map(|row| {
            let time = row as f64 * sample;
            1.3 * (TAU * (low * time + 0.5 * (high - low) * time * time / duration)).sin()
        })
        .collect()
}

/// Random levels up to `size`, each held for a random time [s], every fourth of them zero: an arm with friction comes to rest.
fn steps(rows: usize, sample: f64, hold: (f64, f64), size: f64, seed: Seed) -> Vec<f64> {
    let mut rng = seed.stream("servo steps");
    let mut levels = Vec::with_capacity(rows);
    let mut count = 0_u32;
    while levels.len() < rows {
        let level = if count % 4 == 3 { 0.0 } else { rng.random_range(-size..size) };
        let length = (rng.random_range(hold.0..hold.1) / sample) as usize;
        levels.extend(std::iter::repeat_n(level, length.clamp(1, rows - levels.len())));
        count += 1;
    }
    levels
}
