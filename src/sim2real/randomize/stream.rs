//! A stream of numbers for each environment, episode and parameter, which costs some nanoseconds to enter anywhere.

use crate::sim2real::Seed;
use crate::sim2real::split_mix::{mixed, open_unit, with};
use rand::Rng;

/// What is drawn for: part of what a stream depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Occasion {
    /// An environment is made; the number of its episode does not matter.
    Startup,
    /// An episode begins.
    Reset,
    /// Within an episode, for the time of this number, from 1.
    Interval(u64),
    /// The regime of this index is entered, for the time of the second number in this episode, from 1.
    Regime(usize, u64),
}

/// What all draws of a seed begin with. To find it takes longer than all else of a draw: what draws often from the same seed keeps it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DrawKey(u64);

impl DrawKey {
    /// That of a seed.
    #[must_use]
    pub fn new(seed: Seed) -> Self {
        Self(seed.stream("randomize").next_u64())
    }
}

/// The streams of a randomizer: a number in (0, 1) depends on the seed, the environment, the episode, the occasion and the name
/// of what is drawn, and on nothing else: neither on how many environments there are, nor on what else is drawn, nor on threads.
///
/// A generator with a state would have to be made anew for each environment and parameter, which for `ChaCha8Rng` takes longer
/// than all of a draw. Here a number is a hash of its coordinates, by the finalizer of SplitMix64.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Streams {
    key: u64,
}

impl Streams {
    /// The streams of `seed` for `occasion`.
    pub fn new(seed: Seed, occasion: Occasion) -> Self {
        Self::of(DrawKey::new(seed), occasion)
    }

    /// The same of a seed whose key is there already.
    pub fn of(DrawKey(key): DrawKey, occasion: Occasion) -> Self {
        let [kind, which, time] = match occasion {
            Occasion::Startup => [0, 0, 0],
            Occasion::Reset => [1, 0, 0],
            Occasion::Interval(time) => [2, 0, time],
            Occasion::Regime(index, time) => [3, index as u64, time],
        };
        Self { key: with(with(with(key, kind), which), time) }
    }

    /// The key of an environment in an episode.
    pub fn environment(self, index: u64, episode: u64) -> u64 {
        with(with(self.key, index), episode)
    }
}

/// The key of a parameter, by its name.
pub(super) fn name_key(name: &str) -> u64 {
    Seed(0).child(name).0
}

/// The number in (0, 1), neither end ever, of the environment and the parameter of these keys.
#[inline]
pub(super) fn uniform(environment: u64, name: u64) -> f64 {
    open_unit(mixed(environment.wrapping_add(name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(seed: u64, occasion: Occasion, episode: u64, name: &str, count: u64) -> Vec<f64> {
        let streams = Streams::new(Seed(seed), occasion);
        (0..count).map(|index| uniform(streams.environment(index, episode), name_key(name))).collect()
    }

    #[test]
    fn every_coordinate_makes_another_stream_and_none_beside_them_does() {
        let base = numbers(7, Occasion::Reset, 3, "mass", 100);
        assert_eq!(base[..50], numbers(7, Occasion::Reset, 3, "mass", 50));
        for other in [
            numbers(8, Occasion::Reset, 3, "mass", 100),
            numbers(7, Occasion::Startup, 3, "mass", 100),
            numbers(7, Occasion::Interval(1), 3, "mass", 100),
            numbers(7, Occasion::Regime(0, 1), 3, "mass", 100),
            numbers(7, Occasion::Reset, 4, "mass", 100),
            numbers(7, Occasion::Reset, 3, "masses", 100),
        ] {
            assert!(base.iter().zip(&other).all(|(a, b)| a != b));
        }
    }

    /// Written down once: whoever changes these bits changes every published figure.
    #[test]
    fn golden_numbers() {
        insta::assert_debug_snapshot!(numbers(7, Occasion::Reset, 0, "coulomb_friction.torque", 3));
    }

    #[test]
    fn numbers_are_even_in_every_direction() {
        // Mean, variance and the correlation of neighbours: over environments, over episodes and over names.
        let streams = Streams::new(Seed(1), Occasion::Reset);
        let count = 200_000_u64;
        let directions: [&dyn Fn(u64) -> f64; 3] = [
            &|k| uniform(streams.environment(k, 0), name_key("a")),
            &|k| uniform(streams.environment(0, k), name_key("a")),
            &|k| uniform(streams.environment(0, 0), name_key(&k.to_string())),
        ];
        for (which, draw) in directions.into_iter().enumerate() {
            let count = if which == 2 { count / 10 } else { count };
            let all: Vec<f64> = (0..count).map(draw).collect();
            let n = count as f64;
            let mean = all.iter().sum::<f64>() / n;
            let variance = all.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / n;
            let neighbours = all.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum::<f64>() / n / variance;
            // Four standard errors each.
            assert!((mean - 0.5).abs() < 4.0 / (12.0 * n).sqrt(), "{which}: mean {mean}");
            assert!((variance - 1.0 / 12.0).abs() < 4.0 / (180.0 * n).sqrt(), "{which}: variance {variance}");
            assert!(neighbours.abs() < 4.0 / n.sqrt(), "{which}: neighbours {neighbours}");
            // A chi-squared test over 64 cells: 63 +- 4 standard deviations.
            let mut cells = [0.0_f64; 64];
            all.iter().for_each(|u| cells[(u * 64.0) as usize] += 1.0);
            let expected = n / 64.0;
            let chi: f64 = cells.iter().map(|c| (c - expected).powi(2) / expected).sum();
            assert!((chi - 63.0).abs() < 4.0 * 126.0_f64.sqrt(), "{which}: chi-squared {chi}");
        }
    }
}
