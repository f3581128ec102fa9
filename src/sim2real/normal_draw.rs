//! Normal numbers from random bits, eight at once or one by one with the same bits: one number of 64 bits makes one normal number, without
//! rejection, so that compilers turn many of them into vector instructions.

use super::randomize::normal_quantile;
use super::split_mix::open_unit;

/// How many are made at once.
pub(crate) const AT_ONCE: usize = 8;

/// Adding this to a whole number of less than 2^51, or to its bits, makes one of the other.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// Logarithms to base 2 up to which the polynomial is right. Beyond are 1 of 1,000 numbers, those farther than 3.29 from 0.
const DEEPEST: f64 = 9.0;

/// Coefficients of `log2(1 + f) / f` from `1/sqrt(2) - 1` to `sqrt(2) - 1`, right to 1.3e-9, of itself but beside 0: found with 40 digits
/// by the exchange of Remez (Cheney, *Introduction to Approximation Theory* (1966), chapter 3).
#[allow(clippy::excessive_precision, reason = "as found")]
const LOGARITHM: [f64; 10] = [
    1.442_695_041_159_045_035_4,
    -0.721_347_185_555_735_505_00,
    0.480_898_108_188_273_907_85,
    -0.360_707_365_943_768_487_08,
    0.288_579_699_205_507_888_80,
    -0.239_418_865_458_105_808_76,
    0.204_296_417_746_753_509_25,
    -0.192_186_815_180_762_658_04,
    0.188_290_127_622_213_524_89,
    -0.109_978_023_672_095_210_75,
];

/// Coefficients, in `l = -log2(1 - x^2)`, of the number below which a part `(1 + x) / 2` of a normal distribution lies, over `x`: right
/// to 5.5e-9 of it up to [`DEEPEST`]; found as above. That the logarithm is what makes it smooth is from Giles, "Approximating the erfinv
/// function", *GPU Computing Gems* (2011), chapter 10.
#[allow(clippy::excessive_precision, reason = "as found")]
const QUANTILE: [f64; 11] = [
    1.253_314_144_120_897_547_9,
    0.227_433_048_817_113_711_57,
    7.848_694_830_265_522_304_1e-3,
    -1.102_685_495_544_758_750_3e-3,
    -3.855_147_280_219_908_666_5e-5,
    8.457_024_215_072_868_087_3e-6,
    1.148_851_264_149_338_950_6e-6,
    -3.190_085_237_089_553_088_5e-7,
    2.912_097_174_808_672_372_5e-8,
    -1.282_949_878_241_483_075_5e-9,
    2.308_137_728_024_154_533_0e-11,
];

/// The normal number of these bits by the polynomials, and how deep in a tail it is.
#[inline(always)]
fn central(bits: u64) -> (f64, f64) {
    let x = 2.0 * open_unit(bits) - 1.0;
    let part = (1.0 - x) * (1.0 + x);
    // A mantissa from sqrt(1/2) to sqrt(2), and the exponent that goes with it.
    let exponent = (part.to_bits().wrapping_sub(std::f64::consts::FRAC_1_SQRT_2.to_bits()) as i64 >> 52) as u64;
    let f = f64::from_bits(part.to_bits().wrapping_sub(exponent << 52)) - 1.0;
    let whole = f64::from_bits(ROUNDING.to_bits().wrapping_add(exponent)) - ROUNDING;
    // In pairs, so that few operations wait for one another (Estrin 1960).
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9] = LOGARITHM;
    let (f2, f4) = (f * f, (f * f) * (f * f));
    let low = (c0 + c1 * f) + (c2 + c3 * f) * f2;
    let high = ((c4 + c5 * f) + (c6 + c7 * f) * f2) + (c8 + c9 * f) * f4;
    let depth = -(whole + f * (low + high * f4));
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10] = QUANTILE;
    let (l2, l4) = (depth * depth, (depth * depth) * (depth * depth));
    let low = (c0 + c1 * depth) + (c2 + c3 * depth) * l2;
    let middle = (c4 + c5 * depth) + (c6 + c7 * depth) * l2;
    let high = (c8 + c9 * depth) + c10 * l2;
    (x * (low + (middle + high * l4) * l4), depth)
}

/// The normal numbers of these bits, each right to 1e-8 of itself: below which the part of a normal distribution lies that the bits are of
/// all bits.
#[inline(always)]
pub(crate) fn normals(bits: &[u64; AT_ONCE]) -> [f64; AT_ONCE] {
    let mut drawn = [0.0; AT_ONCE];
    let mut beyond = 0;
    for k in 0..AT_ONCE {
        let (number, depth) = central(bits[k]);
        drawn[k] = number;
        // The sign of what is left is set where it is too deep.
        beyond |= (DEEPEST - depth).to_bits();
    }
    if beyond >> 63 != 0 {
        tails(bits, &mut drawn);
    }
    drawn
}

/// The normal number of these bits.
#[inline]
pub(crate) fn normal(bits: u64) -> f64 {
    let (number, depth) = central(bits);
    if DEEPEST - depth < 0.0 { normal_quantile(open_unit(bits)) } else { number }
}

#[cold]
#[inline(never)]
fn tails(bits: &[u64; AT_ONCE], drawn: &mut [f64; AT_ONCE]) {
    drawn.iter_mut().zip(bits).for_each(|(drawn, bits)| *drawn = normal(*bits));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::{Seed, SplitMix64};

    /// Bits all over, and close to both ends.
    fn bits() -> Vec<[u64; AT_ONCE]> {
        let mut draws = SplitMix64::new(Seed(3), 17);
        let mut all: Vec<u64> = (0..400_000).map(|_| draws.bits()).collect();
        all.extend((0..64).flat_map(|k| [1_u64 << k, !(1_u64 << k), (1_u64 << k) - 1, u64::MAX << k, u64::MAX >> 1 >> k]));
        all.extend((0..40_000_u64).flat_map(|k| [k << 40, !(k << 40), (1 << 63) + (k << 44), (1 << 63) - (k << 44)]));
        all.as_chunks().0.to_vec()
    }

    #[test]
    fn each_is_the_quantile_of_its_bits_one_by_one_and_at_once() {
        let mut farthest = 0.0_f64;
        for bits in bits() {
            let drawn = normals(&bits);
            for (drawn, bits) in drawn.into_iter().zip(bits) {
                assert_eq!(drawn.to_bits(), normal(bits).to_bits(), "{bits:x}");
                let right = normal_quantile(open_unit(bits));
                assert!((drawn - right).abs() <= 1e-8 * right.abs(), "{bits:x}: {drawn} and {right}");
                farthest = farthest.max(drawn.abs());
            }
        }
        assert!(farthest > 8.0, "{farthest}");
        assert_eq!(normal(u64::MAX), -normal(0));
    }

    /// Moments, neighbours, and how many lie in each of 64 equally probable parts, in the tails among them.
    #[test]
    fn they_are_normal() {
        let n = 1_000_000;
        let mut draws = SplitMix64::new(Seed(5), 1);
        let drawn: Vec<f64> = (0..n).map(|_| normal(draws.bits())).collect();
        let moment = |k: i32| drawn.iter().map(|z| z.powi(k)).sum::<f64>() / f64::from(n);
        let root = f64::from(n).sqrt();
        // Four standard errors each.
        for (k, expected, variance) in [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0), (6, 15.0, 10_170.0)] {
            assert!((moment(k) - expected).abs() < 4.0 * f64::sqrt(variance) / root, "moment {k}: {}", moment(k));
        }
        let neighbours = drawn.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / f64::from(n);
        assert!(neighbours.abs() < 4.0 / root);
        let mut parts = [0.0_f64; 64];
        drawn.iter().for_each(|z| parts[(64.0 * crate::sim2real::randomize::normal_cdf(*z)) as usize] += 1.0);
        let expected = f64::from(n) / 64.0;
        let chi: f64 = parts.iter().map(|count| (count - expected).powi(2) / expected).sum();
        assert!((chi - 63.0).abs() < 4.0 * 126.0_f64.sqrt(), "{chi}");
        let beyond = |far: f64| drawn.iter().filter(|z| z.abs() > far).count() as f64;
        for (far, part) in [(3.0, 2.699_796e-3), (3.5, 4.652_582e-4), (4.0, 6.334_248e-5)] {
            let expected = part * f64::from(n);
            assert!((beyond(far) - expected).abs() < 4.0 * expected.sqrt(), "beyond {far}: {}", beyond(far));
        }
    }
}
