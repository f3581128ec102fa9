//! From positions to what a recording says of them.

use rand::RngExt;
use rand_distr::{Distribution, Normal, StandardNormal};

use super::effect::{Effect, Foreign};
use super::motion::{Drive, Motion};
use crate::conceal::Span;
use crate::sim2real::Seed;

/// How a sensor's noise is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Noise {
    /// Each sample for itself.
    White,
    /// Each sample remembers this part of the one before.
    Coloured(f64),
    /// White, and then counted in steps of this part of its standard deviation.
    Counted(f64),
}

impl Noise {
    /// In words.
    pub fn told(self) -> String {
        match self {
            Self::White => "white".to_owned(),
            Self::Coloured(part) => format!("coloured, {part:.2} of the sample before"),
            Self::Counted(part) => format!("white, rounded to {part:.2} of its standard deviation"),
        }
    }

    /// One value a row, of standard deviation 1.
    pub fn draw(self, rows: usize, seed: Seed) -> Vec<f64> {
        let mut rng = seed.stream("noise");
        let mut last: f64 = StandardNormal.sample(&mut rng);
        (0..rows)
            .map(|_| {
                let fresh: f64 = StandardNormal.sample(&mut rng);
                last = match self {
                    Self::Coloured(part) => part * last + (1.0 - part * part).sqrt() * fresh,
                    Self::White | Self::Counted(_) => fresh,
                };
                last
            })
            .collect()
    }
}

/// All effects between a position and a number.
#[derive(Debug, Clone)]
pub(super) struct Sensor {
    effects: Vec<Effect>,
    /// Bursts in which a value is repeated: start [s], length [s], and the share at which they begin to happen.
    bursts: Vec<(f64, f64, f64)>,
    /// Standard deviation of the noise [rad].
    pub noise: f64,
    /// How it is made.
    pub kind: Noise,
}

/// Mean length of a burst of lost samples [s].
const BURST: f64 = 0.06;
/// Files show tenths of microradians.
const SHOWN: f64 = 1e-7;

impl Sensor {
    /// With those of `effects` that concern a sensor, over `duration` [s].
    pub fn new(effects: &[Effect], noise: f64, kind: Noise, duration: f64, seed: Seed) -> Self {
        let mut rng = seed.stream("bursts");
        let count = (duration / BURST) as usize;
        let bursts = (0..count)
            .map(|_| {
                let size: f64 = Normal::new(0.0, 0.5).map_or(0.0, |normal| normal.sample(&mut rng));
                (rng.random::<f64>() * duration, (BURST * size.exp()).min(0.3), rng.random::<f64>())
            })
            .collect();
        Self { effects: effects.to_vec(), bursts, noise, kind }
    }

    /// The same without counting.
    pub fn uncounted(mut self) -> Self {
        self.effects.retain(|effect| !matches!(effect, Effect::Counts { .. }));
        if matches!(self.kind, Noise::Counted(_)) {
            self.kind = Noise::White;
        }
        self
    }

    /// What is recorded of `motion`, with a noise of standard deviation 1 given.
    pub fn measure(&self, motion: &Motion, drive: &Drive, noise: &[f64]) -> Vec<f64> {
        let mut counted = None;
        let mut read: Vec<f64> = (0..drive.commands.len())
            .map(|row| {
                let time = drive.time(row);
                let value = self.value(motion.at(self.seen_at(time)), time) + self.noise * noise[row];
                self.counted(value, &mut counted)
            })
            .collect();
        self.repeat(&mut read, drive);
        read
    }

    /// The time at which what is reported at `time` was looked at [s].
    fn seen_at(&self, time: f64) -> f64 {
        self.effects.iter().fold(time, |seen, effect| match *effect {
            Effect::Late { delay } => seen - delay,
            Effect::Foreign(Foreign::Clock { size, period }) => {
                seen + size * (1.0 - (std::f64::consts::TAU * time / period).cos())
            }
            _ => seen,
        })
    }

    /// What a position looks like before noise and counting.
    fn value(&self, position: f64, time: f64) -> f64 {
        self.effects.iter().fold(position, |q, effect| match *effect {
            Effect::Offset { offset } => q + offset * (1.0 - 0.03 * (-time / 10.0).exp()),
            Effect::Creep { size, settling: Some(settling) } => q + size * (1.0 - (-time / settling).exp()),
            Effect::Creep { size, settling: None } => q + size * (time / 20.0).sqrt(),
            Effect::Stretch { excess, reach } => q + excess * q * (1.0 + 0.03 * (q / reach).powi(2).min(9.0)),
            Effect::Fold { share, rounding } => (1.0 - share) * q + share * q.hypot(rounding),
            Effect::Wobble { size, phase, harmonic } => q + size * ((q + phase).sin() + harmonic * (2.0 * q).sin()),
            _ => q,
        })
    }

    /// The step a value is counted as; with a hysteresis of a tenth of a step where that is concealed.
    fn counted(&self, value: f64, last: &mut Option<f64>) -> f64 {
        let concealed = self.effects.iter().find_map(|effect| match effect {
            Effect::Counts { step } => Some(*step),
            _ => None,
        });
        match (concealed, self.kind) {
            (Some(step), _) => {
                let kept = last.filter(|last| (value - last).abs() < 0.55 * step);
                let count = kept.unwrap_or_else(|| (value / step).round() * step);
                *last = Some(count);
                count
            }
            (None, Noise::Counted(part)) => {
                let step = part * self.noise;
                (value / step).round() * step
            }
            (None, _) => (value / SHOWN).round() * SHOWN,
        }
    }

    fn repeat(&self, read: &mut [f64], drive: &Drive) {
        for span in self.bursts() {
            let first = ((span.start / drive.sample).ceil() as usize).max(1);
            let last = ((span.end / drive.sample).ceil() as usize).min(read.len());
            for row in first..last {
                read[row] = read[first - 1];
            }
        }
    }

    /// The bursts that happen, in order and apart.
    pub fn bursts(&self) -> Vec<Span> {
        let share = self.effects.iter().find_map(|effect| match effect {
            Effect::Bursts { share } => Some(*share),
            _ => None,
        });
        let Some(share) = share else { return Vec::new() };
        let mut spans: Vec<Span> = self
            .bursts
            .iter()
            .filter(|(_, _, from)| *from < share)
            .map(|(start, length, _)| Span { start: *start, end: start + length })
            .collect();
        spans.sort_by(|a, b| a.start.total_cmp(&b.start));
        merged(spans, 0.0)
    }
}

/// Spans in order, those less than `gap` [s] apart made one.
pub(super) fn merged(spans: Vec<Span>, gap: f64) -> Vec<Span> {
    let mut out: Vec<Span> = Vec::new();
    for span in spans {
        match out.last_mut() {
            Some(last) if span.start <= last.end + gap => last.end = last.end.max(span.end),
            _ => out.push(span),
        }
    }
    out
}
