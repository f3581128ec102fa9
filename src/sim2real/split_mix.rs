//! Random numbers of eight bytes of state, which cost a nanosecond to enter anywhere: for what begins anew more often than a
//! stream of a [`Seed`] could be set up.
//!
//! Source: SplitMix64, Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014, with Stafford's
//! mixing constants 13.

use std::convert::Infallible;

use rand::TryRng;

use super::Seed;

/// The odd number nearest to 2^64 over the golden ratio.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Mixes all bits of `z` into all bits.
#[inline(always)]
pub(crate) const fn mixed(z: u64) -> u64 {
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// What is far from that of the numbers beside it.
#[inline]
pub(crate) const fn scattered(number: u64) -> u64 {
    mixed(number.wrapping_add(GOLDEN))
}

/// `key` and one number more.
#[inline]
pub(crate) const fn with(key: u64, number: u64) -> u64 {
    mixed(key ^ scattered(number).wrapping_mul(GOLDEN))
}

/// The number in (0, 1), neither end ever, of these bits: one of 2^52, evenly apart.
#[inline(always)]
pub(crate) const fn open_unit(bits: u64) -> f64 {
    // The bits become those of a number from 1 to 2, 2^-52 apart: exact, and sooner done than a conversion.
    const ONE: u64 = 1.0_f64.to_bits();
    const HALF_A_STEP: f64 = 0.5 / (1_u64 << 52) as f64;
    (f64::from_bits(ONE | (bits >> 12)) - 1.0) + HALF_A_STEP
}

/// The next bits of generators in these states, side by side.
#[inline(always)]
pub(crate) fn next_bits<const N: usize>(states: &mut [u64; N]) -> [u64; N] {
    let mut bits = [0; N];
    for k in 0..N {
        states[k] = states[k].wrapping_add(GOLDEN);
        bits[k] = mixed(states[k]);
    }
    bits
}

/// A generator whose state is a number that counts up. A copy draws the same from here on, by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// The draws of `seed` under the name whose key is `key`.
    #[must_use]
    pub const fn new(seed: Seed, key: u64) -> Self {
        Self(mixed(scattered(seed.0) ^ key))
    }

    /// The draws that begin at this state.
    #[must_use]
    pub const fn at(state: u64) -> Self {
        Self(state)
    }

    /// The state it is in.
    #[inline(always)]
    pub(crate) const fn state(self) -> u64 {
        self.0
    }

    /// The next 64 bits.
    #[inline(always)]
    pub const fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        mixed(self.0)
    }

    /// The next number from 0 to below 1, one of 2^53 evenly apart.
    #[inline]
    pub const fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// The next number in (0, 1), neither end ever, one of 2^52 evenly apart.
    #[inline]
    pub const fn uniform(&mut self) -> f64 {
        open_unit(self.bits())
    }

    /// The next number between `low` and `high`.
    #[inline]
    pub const fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
}

impl TryRng for SplitMix64 {
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
    use rand_distr::{Distribution, StandardNormal};

    /// The first numbers of the reference implementation (Vigna, <https://prng.di.unimi.it/splitmix64.c>) from the state
    /// 1234567.
    #[test]
    fn the_bits_are_those_of_the_reference() {
        let mut draws = SplitMix64::at(1_234_567);
        let bits = [draws.bits(), draws.bits(), draws.bits()];
        assert_eq!(bits, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    /// Of seeds that follow one another, as environments have them: the first draws of each, and all of one.
    #[test]
    fn draws_are_even_along_a_stream_and_across_seeds() {
        let n = 100_000;
        let along: Vec<f64> = {
            let mut draws = SplitMix64::new(Seed(3), 17);
            (0..n).map(|_| StandardNormal.sample(&mut draws)).collect()
        };
        let across: Vec<f64> = (0..n).map(|seed| StandardNormal.sample(&mut SplitMix64::new(Seed(seed), 17))).collect();
        for normal in [along, across] {
            let moment = |k: i32| normal.iter().map(|z: &f64| z.powi(k)).sum::<f64>() / n as f64;
            // Four standard errors each.
            assert!(moment(1).abs() < 4.0 / (n as f64).sqrt());
            assert!((moment(2) - 1.0).abs() < 4.0 * (2.0 / n as f64).sqrt());
            assert!((moment(4) - 3.0).abs() < 4.0 * (96.0 / n as f64).sqrt());
            let neighbours = normal.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n as f64;
            assert!(neighbours.abs() < 4.0 / (n as f64).sqrt());
        }
        let mut draws = SplitMix64::new(Seed(3), 17);
        assert!((0..1_000).all(|_| (0.0..1.0).contains(&draws.unit())));
        assert!((0..1_000).all(|_| (-2.0..3.0).contains(&draws.between(-2.0, 3.0))));
    }

    #[test]
    fn side_by_side_each_draws_what_it_draws_alone() {
        let mut alone = [3, 5, u64::MAX].map(|seed| SplitMix64::new(Seed(seed), 17));
        let mut states = alone.map(SplitMix64::state);
        for _ in 0..3 {
            assert_eq!(next_bits(&mut states), [0, 1, 2].map(|k: usize| alone[k].bits()));
        }
        assert_eq!(states, alone.map(SplitMix64::state));
    }

    #[test]
    fn neither_end_is_ever_drawn() {
        assert!(open_unit(0) > 0.0);
        assert!(open_unit(u64::MAX) < 1.0);
    }

    #[test]
    fn bytes_are_those_of_the_bits() {
        let (mut one, mut other) = (SplitMix64::at(5), SplitMix64::at(5));
        let mut bytes = [0; 11];
        one.try_fill_bytes(&mut bytes).unwrap();
        assert_eq!(bytes[..8], other.bits().to_le_bytes());
        assert_eq!(bytes[8..], other.bits().to_le_bytes()[..3]);
    }
}
