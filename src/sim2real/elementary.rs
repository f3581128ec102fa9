//! Elementary functions of sums, products and quotients alone: they give the same bits on every machine, where those of the
//! platform's own library differ in the last place, and compilers turn them into vector instructions over many numbers, where a
//! library's is called number by number.

use std::f64::consts::{FRAC_PI_2, LOG2_E, SQRT_2};

/// Adding this to a number of less than 2^51 rounds it to a whole one, whose lowest bits are then the lowest of the sum.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

const ONE: u64 = 1.0_f64.to_bits();

/// The logarithm of 2 in two parts, the first short enough for exact products with a whole number of up to 11 bits (Cody & Waite,
/// *Software Manual for the Elementary Functions* (1980), chapter 6).
const LN_2_PARTS: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];

/// Below this an exponential is taken as 0: there it would have fewer digits than elsewhere.
const LEAST: f64 = -708.0;

/// Taylor's coefficients of the exponential, `1 / k!` from `k = 2` on: what is left out is below 1e-17 within half of `LN_2`.
const FACTORS: [f64; 12] = [
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
];

/// `e^x` for `x` up to 708, to within two units in the last place; 0 below -708.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    exp_less(x, 0.0)
}

/// `e^(x - less)` for a `less` of up to a thousandth, as right as `exp` where the difference itself is not a number any more: what
/// rounding takes from a large exponent, it takes from the value's last digits.
#[inline(always)]
pub(crate) fn exp_less(x: f64, less: f64) -> f64 {
    let shifted = x * LOG2_E + ROUNDING;
    let whole = shifted - ROUNDING;
    let rest = ((x - whole * LN_2_PARTS[0]) - whole * LN_2_PARTS[1]) - less;
    // In pairs, so that few operations wait for one another (Estrin 1960).
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, c11] = FACTORS;
    let (r2, r4) = (rest * rest, (rest * rest) * (rest * rest));
    let low = (c0 + c1 * rest) + (c2 + c3 * rest) * r2;
    let middle = (c4 + c5 * rest) + (c6 + c7 * rest) * r2;
    let high = (c8 + c9 * rest) + (c10 + c11 * rest) * r2;
    let small = 1.0 + (rest + r2 * (low + (middle + high * r4) * r4));
    // The whole number is added to the exponent of 1.
    let power = f64::from_bits(ONE.wrapping_add(shifted.to_bits() << 52));
    // A choice by bits, which a compiler does not take for a branch: none are kept of what is too low.
    let kept = u64::from(x < LEAST).wrapping_sub(1);
    f64::from_bits((small * power).to_bits() & kept)
}

/// Coefficients of `2 artanh(s) / s` in `s^2`, `2 / (2 k + 1)` from `k = 1` on: what is left out is below 1e-17 of it where `s` is that
/// of a number between the square roots of a half and of 2.
const ODD: [f64; 11] = [
    2.0 / 3.0,
    2.0 / 5.0,
    2.0 / 7.0,
    2.0 / 9.0,
    2.0 / 11.0,
    2.0 / 13.0,
    2.0 / 15.0,
    2.0 / 17.0,
    2.0 / 19.0,
    2.0 / 21.0,
    2.0 / 23.0,
];

/// `ln(1 + x)` for finite `x` from 0 on, to within a few units in the last place.
#[inline(always)]
pub(crate) fn ln_1p(x: f64) -> f64 {
    let sum = 1.0 + x;
    // What was lost when 1 was added, over the sum: the logarithm grows by it.
    let lost = (x - (sum - 1.0)) / sum;
    // A mantissa from sqrt(1/2) to sqrt(2), and the exponent that goes with it.
    let shifted = sum.to_bits().wrapping_sub((0.5 * SQRT_2).to_bits());
    let exponent = shifted >> 52;
    let mantissa = f64::from_bits(sum.to_bits().wrapping_sub(exponent << 52));
    let whole = f64::from_bits(ROUNDING.to_bits() | exponent) - ROUNDING;
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10] = ODD;
    let (z, z2) = (s * s, (s * s) * (s * s));
    let z4 = z2 * z2;
    let low = (c0 + c1 * z) + (c2 + c3 * z) * z2;
    let middle = (c4 + c5 * z) + (c6 + c7 * z) * z2;
    let high = (c8 + c9 * z) + c10 * z2;
    let artanh = s * z * (low + (middle + high * z4) * z4);
    whole * LN_2_PARTS[0] + (2.0 * s + (artanh + (whole * LN_2_PARTS[1] + lost)))
}

/// Coefficients of `(2^x - 1) / x`, such that `2^x` is right to 1.8e-17 of itself, at most, from -1/2 to 1/2: found with 60 digits by the
/// exchange of Remez (Cheney, *Introduction to Approximation Theory* (1966), chapter 3).
#[allow(clippy::excessive_precision, reason = "as found")]
const DOUBLING: [f64; 11] = [
    0.693_147_180_559_945_696_75,
    0.240_226_506_959_100_980_07,
    5.550_410_866_479_039_455_2e-2,
    9.618_129_107_607_002_379_6e-3,
    1.333_355_815_343_996_474_7e-3,
    1.540_353_044_157_213_033_0e-4,
    1.525_272_738_519_386_817_1e-5,
    1.321_544_267_532_982_196_7e-6,
    1.018_064_765_923_414_404_0e-7,
    7.072_570_412_814_458_837_3e-9,
    4.078_071_929_588_342_813_0e-10,
];

/// Below this a power of two is taken as 0: there it would have fewer digits than elsewhere.
const LEAST_POWER: f64 = -1_022.0;

/// `2^x` for `x` up to 1,023, to within two units in the last place; 0 below -1,022. It takes a fifth less than [`exp`].
#[inline(always)]
pub(crate) fn exp2(x: f64) -> f64 {
    let shifted = x + ROUNDING;
    let rest = x - (shifted - ROUNDING);
    // As above.
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10] = DOUBLING;
    let (r2, r4) = (rest * rest, (rest * rest) * (rest * rest));
    let low = (c0 + c1 * rest) + (c2 + c3 * rest) * r2;
    let middle = (c4 + c5 * rest) + (c6 + c7 * rest) * r2;
    let high = (c8 + c9 * rest) + c10 * r2;
    let small = 1.0 + rest * (low + (middle + high * r4) * r4);
    let power = f64::from_bits(ONE.wrapping_add(shifted.to_bits() << 52));
    let kept = u64::from(x < LEAST_POWER).wrapping_sub(1);
    f64::from_bits((small * power).to_bits() & kept)
}

/// Sine and cosine of an angle of some turns at most [rad], to some 1e-15.
pub(crate) fn sin_cos(angle: f64) -> (f64, f64) {
    let quarter = (angle / FRAC_PI_2 + 0.5).floor();
    let x = angle - quarter * FRAC_PI_2;
    let square = x * x;
    // Taylor's series; at 45 degrees and less their last terms are below 1e-17.
    let sine = x * (1..9).rev().fold(1.0, |sum, n| 1.0 - sum * square / f64::from(2 * n * (2 * n + 1)));
    let cosine = (1..9).rev().fold(1.0, |sum, n| 1.0 - sum * square / f64::from(2 * n * (2 * n - 1)));
    match (quarter as i64).rem_euclid(4) {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::LN_2;

    use super::*;

    #[test]
    fn they_agree_with_the_library() {
        for step in -4_000..4_000 {
            let x = f64::from(step) / 400.0;
            assert!((exp2(x) / x.exp2() - 1.0).abs() < 4e-15, "2^{x}");
            let (sine, cosine) = sin_cos(x);
            assert!((sine - x.sin()).abs() < 3e-15 && (cosine - x.cos()).abs() < 3e-15, "{x} rad");
        }
        assert_eq!(exp2(0.0), 1.0);
        assert_eq!(exp2(3.0), 8.0);
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }

    /// Over all their range, the ends among it, and beside the places where one power of two gives way to the next.
    #[test]
    fn exponentials_and_logarithms_are_right_to_the_last_digits() {
        let close =
            |found: f64, right: f64, least: f64| (found - right).abs() <= 3.0 * f64::EPSILON * right.abs().max(least);
        for step in 0..=200_000 {
            for x in
                [-708.0 + 1_416.0 * f64::from(step) / 200_000.0, -f64::from(step) * 1e-6, f64::from(step - 700) * LN_2 * 0.5]
            {
                if (-708.0..=708.0).contains(&x) {
                    assert!(close(exp(x), x.exp(), 0.0), "e^{x}: {} and {}", exp(x), x.exp());
                }
            }
            for x in [
                f64::from(step) * 1e-5,
                f64::from(step).exp2(),
                10.0_f64.powf(-f64::from(step) / 1e3),
                f64::from(step) * 1e290,
            ] {
                if x.is_finite() {
                    assert!(close(ln_1p(x), x.ln_1p(), 0.0), "ln(1 + {x}): {} and {}", ln_1p(x), x.ln_1p());
                }
            }
        }
        for step in 0..100_000 {
            let (x, less) = (f64::from(step - 50_000) / 128.0, 1e-8 * f64::from(step));
            assert!(close(exp_less(x, less), x.exp() * (-less).exp(), 0.0), "e^({x} - {less})");
        }
        for step in 0..=200_000 {
            for x in [-1_022.0 + 2_045.0 * f64::from(step) / 200_000.0, f64::from(step - 100_000) * 1e-5] {
                assert!(close(exp2(x), x.exp2(), 0.0), "2^{x}: {} and {}", exp2(x), x.exp2());
            }
        }
        assert_eq!(
            [exp2(0.0), exp2(-1_022.1), exp2(-5e299), exp2(f64::NEG_INFINITY), exp2(-3.0)],
            [1.0, 0.0, 0.0, 0.0, 0.125]
        );
        assert!(exp2(f64::NAN).is_nan());
        assert_eq!([exp(0.0), exp(-708.1), exp(-5e299), exp(f64::NEG_INFINITY), ln_1p(0.0)], [1.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(exp(f64::NAN).is_nan());
    }
}
