//! Normal draws by a counter: the draws of a pixel depend on the image's key and the pixel's number alone.

use std::sync::LazyLock;

use super::line::LANES;
use crate::sim2real::elementary::exp;
use crate::sim2real::split_mix::scattered;

/// 64 bits for each number under a key.
///
/// Source: wyrand of Wang Yi's wyhash (<https://github.com/wangyi-fudan/wyhash>), whose state after `n` draws is
/// `start + n * WEYL`, so that any draw can be had without those before it. Its draws from neighbouring starts go together:
/// keys, which may be neighbours, are mixed to starts as by Steele, Lea & Flood, "Fast splittable pseudorandom number
/// generators", OOPSLA (2014).
#[derive(Debug, Clone, Copy)]
pub(super) struct Counter {
    start: u64,
}

impl Counter {
    pub fn new(key: u64) -> Self {
        Self { start: scattered(key) }
    }

    #[inline(always)]
    pub fn bits(self, number: u64) -> u64 {
        const WEYL: u64 = 0xa076_1d64_78bd_642f;
        const MASK: u64 = 0xe703_7ed1_a0b4_28db;
        let state = self.start.wrapping_add(number.wrapping_mul(WEYL));
        let product = u128::from(state) * u128::from(state ^ MASK);
        (product >> 64) as u64 ^ product as u64
    }
}

/// Values that a normal draw can have, all equally probable.
const QUANTILES: usize = 4_096;

/// Quantiles of the standard normal distribution, in the middle of each 4,096th of its probability, stretched by less than
/// 0.1 % so that their variance is 1.
///
/// What such draws are: mean 0 and variance 1 exactly, all odd moments 0; a fourth moment of 2.99, not 3; no draw beyond 3.7
/// standard deviations, where the normal distribution has one in 4,600. Against the 256 values of a byte the steps between
/// them do not count.
static TABLE: LazyLock<Box<[f32; QUANTILES]>> = LazyLock::new(|| {
    let half = QUANTILES / 2;
    let mut quantiles = [0.0; QUANTILES];
    let mut x = 0.0;
    for i in half..QUANTILES {
        let target = (i as f64 + 0.5) / QUANTILES as f64;
        // Newton's method, from the quantile before.
        for _ in 0..8 {
            x -= (below(x) - target) / density(x);
        }
        (quantiles[i], quantiles[QUANTILES - 1 - i]) = (x, -x);
    }
    let variance = quantiles.iter().map(|x| x * x).sum::<f64>() / QUANTILES as f64;
    Box::new(quantiles.map(|x| (x / variance.sqrt()) as f32))
});

fn density(x: f64) -> f64 {
    exp(-0.5 * x * x) / (2.0 * std::f64::consts::PI).sqrt()
}

/// The probability of a normal draw below `x`, by the series `1/2 + density (x + x^3 / 3 + x^5 / (3 5) + ...)`; Abramowitz &
/// Stegun, "Handbook of Mathematical Functions" (1964), 26.2.11.
fn below(x: f64) -> f64 {
    let (mut term, mut sum) = (x, x);
    for n in 1..100 {
        term *= x * x / f64::from(2 * n + 1);
        sum += term;
    }
    0.5 + density(x) * sum
}

/// Normal draws under a key.
#[derive(Clone, Copy)]
pub(super) struct Normal {
    table: &'static [f32; QUANTILES],
    counter: Counter,
}

impl Normal {
    pub fn new(key: u64) -> Self {
        Self { table: &TABLE, counter: Counter::new(key) }
    }

    /// Draws for red, green and blue of the pixels whose numbers begin with `first`.
    #[inline(always)]
    pub fn draw(&self, first: u64) -> [[f32; LANES]; 3] {
        const LOW: u64 = QUANTILES as u64 - 1;
        let mut draws = [[0.0; LANES]; 3];
        for (at, number) in (first..).take(LANES).enumerate() {
            let bits = self.counter.bits(number);
            for (draws, shift) in draws.iter_mut().zip([0, 12, 24]) {
                draws[at] = self.table[(bits >> shift & LOW) as usize];
            }
        }
        draws
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moment(power: i32) -> f64 {
        TABLE.iter().map(|x| f64::from(*x).powi(power)).sum::<f64>() / QUANTILES as f64
    }

    #[test]
    fn the_table_is_what_its_docs_say() {
        assert!(TABLE.is_sorted());
        assert!(TABLE.iter().zip(TABLE.iter().rev()).all(|(a, b)| *a == -b));
        assert!((moment(2) - 1.0).abs() < 1e-7, "{}", moment(2));
        assert!((moment(4) - 2.991).abs() < 0.001, "{}", moment(4));
        assert!(TABLE[QUANTILES - 1] < 3.7 && TABLE[QUANTILES - 1] > 3.66, "{}", TABLE[QUANTILES - 1]);
        // The known quantile of 0.975, 3,993.6 of 4,096, lies between the values 3,992 and 3,994.
        assert!(TABLE[3_992] < 1.96 && TABLE[3_994] > 1.96, "{} {}", TABLE[3_992], TABLE[3_994]);
        assert!((below(1.959_963_984_540_054) - 0.975).abs() < 1e-12);
        assert!((below(-3.0) - 0.001_349_898_031_630_094_6).abs() < 1e-12);
    }

    /// Written down once: a change of these changes every image with noise.
    #[test]
    fn golden_bits() {
        let written = [(0, 0), (0, 1), (7, 0), (u64::MAX, 3)];
        let written = written.map(|(key, number)| format!("{:016x}", Counter::new(key).bits(number)));
        insta::assert_debug_snapshot!(written);
        let [red, green, blue] = Normal::new(7).draw(40).map(|channel| channel.map(f32::to_bits));
        let draws = [0, 1].map(|at| [red[at], green[at], blue[at], 0]);
        insta::assert_debug_snapshot!(draws);
    }

    /// Each bit is set half of the time and does not go with any other, of the same number or the next, under neighbouring keys.
    #[test]
    fn bits_are_even_and_independent() {
        const COUNT: u32 = 40_000;
        let bits = |key, number| Counter::new(key).bits(number);
        let deviation = |ones: u32| (f64::from(ones) - f64::from(COUNT) / 2.0) / (f64::from(COUNT).sqrt() / 2.0);
        for key in [0, 1, 0x9e37_79b9_7f4a_7c15] {
            for bit in 0..64 {
                let count = |f: &dyn Fn(u64) -> u64| (0..u64::from(COUNT)).filter(|n| f(*n) >> bit & 1 == 1).count() as u32;
                let alone = count(&|n| bits(key, n));
                let with_next = count(&|n| bits(key, n) ^ bits(key, n + 1));
                let with_key = count(&|n| bits(key, n) ^ bits(key + 1, n));
                let with_other = count(&|n| bits(key, n) ^ bits(key, n).rotate_left(12));
                for ones in [alone, with_next, with_key, with_other] {
                    assert!(deviation(ones).abs() < 5.0, "key {key}, bit {bit}: {ones} of {COUNT}");
                }
            }
        }
    }
}
