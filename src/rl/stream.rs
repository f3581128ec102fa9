//! Randomness of a lane: named streams that cost a nanosecond to enter, since an episode may last a microsecond.

use std::convert::Infallible;

use rand::TryRng;

use crate::sim2real::Seed;

/// The odd number nearest to 2^64 over the golden ratio, the increment of SplitMix64.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Mixes all bits of `z` into all bits: the finalizer of SplitMix64 with Stafford's mixing constants 13.
const fn mixed(z: u64) -> u64 {
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// `key` and one number more.
const fn with(key: u64, number: u64) -> u64 {
    mixed(key ^ mixed(number.wrapping_add(GOLDEN)).wrapping_mul(GOLDEN))
}

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
    pub const fn stream(self, name: StreamName) -> Stream {
        Stream { state: with(with(mixed(self.seed.wrapping_add(GOLDEN)), self.number), name.0) }
    }

    /// A stream that is the same in all episodes of the lane: of what is drawn when it is made.
    #[must_use]
    pub const fn lane_stream(self, name: StreamName) -> Stream {
        Self { seed: self.seed, number: u64::MAX }.stream(name)
    }

    /// The source of streams of what is not drawn from here, such as mechanisms.
    #[must_use]
    pub const fn seed(self) -> Seed {
        Seed(with(mixed(self.seed.wrapping_add(GOLDEN)), self.number))
    }
}

/// A generator of random numbers for one lane: SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number
/// generators", OOPSLA 2014), eight bytes of state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stream {
    state: u64,
}

impl Stream {
    /// 64 bits.
    #[inline]
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN);
        mixed(self.state)
    }

    /// A number in (0, 1), neither end ever, of 2^52 evenly apart.
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        const ONE: u64 = 1.0_f64.to_bits();
        const HALF_A_STEP: f64 = 0.5 / (1_u64 << 52) as f64;
        (f64::from_bits(ONE | (self.bits() >> 12)) - 1.0) + HALF_A_STEP
    }

    /// A number between `low` and `high`.
    #[inline]
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
}

impl TryRng for Stream {
    type Error = Infallible;

    #[inline]
    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok((self.bits() >> 32) as u32)
    }

    #[inline]
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(self.bits())
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        for chunk in bytes.chunks_mut(8) {
            chunk.copy_from_slice(&self.bits().to_le_bytes()[..chunk.len()]);
        }
        Ok(())
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

    #[test]
    fn bytes_are_those_of_the_bits() {
        let (mut one, mut other) = (Episode::default().stream(NOISE), Episode::default().stream(NOISE));
        let mut bytes = [0; 11];
        one.try_fill_bytes(&mut bytes).unwrap();
        assert_eq!(bytes[..8], other.bits().to_le_bytes());
        assert_eq!(bytes[8..], other.bits().to_le_bytes()[..3]);
        assert!((0.0..1.0).contains(&other.between(0.0, 1.0)));
    }
}
