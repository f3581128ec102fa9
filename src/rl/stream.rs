//! Randomness of a lane: named streams that cost a nanosecond to enter, since an episode may last a microsecond.

use crate::sim2real::split_mix::{mixed, scattered, with};
use crate::sim2real::{Seed, SplitMix64};

/// The name of a stream, hashed (FNV-1a, 64 bits) when the program is compiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamName(u64);

impl StreamName {
    /// A name.
    #[must_use]
    pub const fn new(name: &str) -> Self {
        let bytes = name.as_bytes();
        let (mut hash, mut k) = (0xcbf2_9ce4_8422_2325_u64, 0);
        while k < bytes.len() {
            hash = (hash ^ bytes[k] as u64).wrapping_mul(0x100_0000_01b3);
            k += 1;
        }
        Self(mixed(hash))
    }
}

/// An episode of a lane: all that its randomness depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Episode {
    /// The seed its lane was given.
    pub seed: u64,
    /// How many episodes that lane has had since: 0 for the first.
    pub number: u64,
}

impl Episode {
    /// The stream of this name.
    #[must_use]
    pub const fn stream(self, name: StreamName) -> SplitMix64 {
        SplitMix64::at(with(self.key(), name.0))
    }

    /// A stream that is the same in all episodes of the lane: of what is drawn when it is made.
    #[must_use]
    pub const fn lane_stream(self, name: StreamName) -> SplitMix64 {
        Self { seed: self.seed, number: u64::MAX }.stream(name)
    }

    /// The source of streams of what is not drawn from here, such as mechanisms.
    #[must_use]
    pub const fn seed(self) -> Seed {
        Seed(self.key())
    }

    const fn key(self) -> u64 {
        with(scattered(self.seed), self.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: StreamName = StreamName::new("noise");

    #[test]
    fn seed_episode_and_name_make_another_stream() {
        let of = |seed, number, name: &str| {
            let mut stream = Episode { seed, number }.stream(StreamName::new(name));
            [stream.bits(), stream.bits(), stream.bits()]
        };
        let base = of(7, 3, "noise");
        assert_eq!(base, of(7, 3, "noise"));
        for other in [of(8, 3, "noise"), of(7, 4, "noise"), of(7, 3, "latency"), of(3, 7, "noise")] {
            assert!(base.iter().all(|bits| !other.contains(bits)));
        }
        let lane = |number| Episode { seed: 7, number }.lane_stream(NOISE).bits();
        assert_eq!(lane(0), lane(9));
        assert_ne!(Episode { seed: 7, number: 0 }.seed(), Episode { seed: 7, number: 1 }.seed());
    }

    /// Written down once: whoever changes these bits changes every published figure.
    #[test]
    fn golden_draws() {
        let mut stream = Episode { seed: 7, number: 2 }.stream(NOISE);
        let draws = [stream.bits(), stream.bits(), stream.bits()];
        assert_eq!(draws, [1_328_139_358_935_427_902, 8_069_710_704_126_323_480, 13_539_438_778_477_446_060]);
    }

    #[test]
    fn numbers_are_even_over_lanes_over_episodes_and_within_a_stream() {
        let count = 200_000_u64;
        let mut stream = Episode::default().stream(NOISE);
        let within: Vec<f64> = (0..count).map(|_| stream.uniform()).collect();
        let lanes: Vec<f64> = (0..count).map(|seed| Episode { seed, number: 0 }.stream(NOISE).uniform()).collect();
        let episodes: Vec<f64> = (0..count).map(|number| Episode { seed: 1, number }.stream(NOISE).uniform()).collect();
        for (which, all) in [within, lanes, episodes].into_iter().enumerate() {
            let n = count as f64;
            let mean = all.iter().sum::<f64>() / n;
            let variance = all.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / n;
            let neighbours = all.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum::<f64>() / n / variance;
            // Four standard errors each.
            assert!((mean - 0.5).abs() < 4.0 / (12.0 * n).sqrt(), "{which}: mean {mean}");
            assert!((variance - 1.0 / 12.0).abs() < 4.0 / (180.0 * n).sqrt(), "{which}: variance {variance}");
            assert!(neighbours.abs() < 4.0 / n.sqrt(), "{which}: neighbours {neighbours}");
        }
    }
}
