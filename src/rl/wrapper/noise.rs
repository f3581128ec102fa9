//! Noise of sensors.

use rand_distr::{Distribution, StandardNormal};

use super::layer::{Layer, copy_row, refused};
use crate::rl::{About, Actions, EnvError, Episodes, Out, SplitMix64, StreamName, Which};

/// Adds Gaussian noise, drawn anew for each component and each step, to what is observed. A component that is noisy has no bounds.
#[derive(Debug, Clone)]
pub struct ObservationNoise {
    name: StreamName,
    std: Vec<f32>,
    streams: Vec<SplitMix64>,
}

impl ObservationNoise {
    /// The standard deviation of each component, in its unit; one value stands for all.
    #[must_use]
    pub fn new(std: &[f32]) -> Self {
        Self { name: StreamName::new("observation_noise"), std: std.to_vec(), streams: Vec::new() }
    }

    /// The same with draws from the stream of this name, to tell two of them apart.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        Self { name: StreamName::new(name), ..self }
    }

    #[inline]
    fn add(std: &[f32], stream: &mut SplitMix64, row: &mut [f32]) {
        let mut own = *stream;
        for (value, std) in row.iter_mut().zip(std) {
            if *std > 0.0 {
                let normal: f32 = StandardNormal.sample(&mut own);
                *value += std * normal;
            }
        }
        *stream = own;
    }
}

impl Layer for ObservationNoise {
    const NAME: &'static str = "noise of observations";

    fn prepare(&mut self, about: &mut About, lanes: usize) -> Result<(), EnvError> {
        let size = about.observation.size();
        if let [one] = self.std.as_slice() {
            self.std = vec![*one; size];
        }
        if self.std.len() != size {
            let why = format!("{} standard deviations for {size} components", self.std.len());
            return Err(refused::<Self>(about, why, "give one a component, or one for all"));
        }
        if let Some(bad) = self.std.iter().find(|std| !(**std >= 0.0 && std.is_finite())) {
            return Err(refused::<Self>(about, format!("a standard deviation is {bad}"), "give 0 or more"));
        }
        for (k, std) in self.std.iter().enumerate() {
            if *std > 0.0 {
                (about.observation.low[k], about.observation.high[k]) = (f32::NEG_INFINITY, f32::INFINITY);
            }
        }
        self.streams = vec![SplitMix64::default(); lanes];
        Ok(())
    }

    fn begin(&mut self, which: Which<'_>, episodes: &Episodes, observations: &mut [f32]) {
        for (lane, row) in observations.chunks_exact_mut(self.std.len().max(1)).enumerate() {
            if which.has(lane) {
                self.streams[lane] = episodes.lane(lane).stream(self.name);
                Self::add(&self.std, &mut self.streams[lane], row);
            }
        }
    }

    fn sense(&mut self, _: Actions<'_>, out: &mut Out<'_>) {
        for (row, stream) in out.observations.chunks_exact_mut(self.std.len().max(1)).zip(&mut self.streams) {
            Self::add(&self.std, stream, row);
        }
    }

    fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        copy_row(&mut self.streams, other.map(|other| other.streams.as_slice()), 1, from, to);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Wrap;
    use super::*;
    use crate::rl::walk::Walk;
    use crate::rl::{Buffers, Options, VecEnv};

    #[test]
    fn noise_has_the_deviation_asked_for_and_touches_no_other_component() {
        let lanes = 200;
        let mut plain = Walk::new(lanes);
        let mut noisy = Walk::new(lanes).with(ObservationNoise::new(&[0.5, 0.0])).unwrap();
        assert_eq!(noisy.about().observation.high, [f32::INFINITY; 2]);
        assert_eq!(noisy.about().observation.low, [f32::NEG_INFINITY, 0.0]);
        let (mut one, mut other) = (Buffers::of(&plain), Buffers::of(&noisy));
        let seeds: Vec<u64> = (0..lanes as u64).collect();
        plain.reset(Which::All, Some(&seeds), &Options::new(), &mut one.observations).unwrap();
        noisy.reset(Which::All, Some(&seeds), &Options::new(), &mut other.observations).unwrap();
        let mut differences = Vec::new();
        for _ in 0..200 {
            for (a, b) in one.observations.chunks(2).zip(other.observations.chunks(2)) {
                differences.push(f64::from(b[0] - a[0]));
                assert_eq!(a[1], b[1]);
            }
            plain.step(Actions::Continuous(&vec![0.0; lanes]), &mut one.out()).unwrap();
            noisy.step(Actions::Continuous(&vec![0.0; lanes]), &mut other.out()).unwrap();
            assert_eq!(one.rewards, other.rewards);
        }
        let n = differences.len() as f64;
        let mean = differences.iter().sum::<f64>() / n;
        let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n;
        let neighbours: f64 = differences.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n / variance;
        assert!(mean.abs() < 4.0 * 0.5 / n.sqrt() && neighbours.abs() < 4.0 / n.sqrt(), "{mean} {neighbours}");
        assert!((variance / 0.25 - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{variance}");
    }

    #[test]
    fn two_sources_of_noise_are_told_apart_by_their_names() {
        let first = |name: &str| {
            let mut env = Walk::new(1).with(ObservationNoise::new(&[1.0]).named(name)).unwrap();
            let mut buffers = Buffers::of(&env);
            env.reset(Which::All, Some(&[3]), &Options::new(), &mut buffers.observations).unwrap();
            buffers.observations
        };
        assert_ne!(first("encoder"), first("gyro"));
        assert_eq!(first("encoder"), first("encoder"));
    }

    #[test]
    fn what_is_no_deviation_is_refused() {
        let refused = |std: &[f32]| Walk::new(1).with(ObservationNoise::new(std)).unwrap_err().to_string();
        assert!(refused(&[-1.0]).contains("a standard deviation is -1"));
        assert!(refused(&[f32::NAN]).contains("is NaN"));
        assert!(refused(&[1.0; 3]).contains("3 standard deviations for 2 components"));
    }
}
