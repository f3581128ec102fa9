//! The normal distribution and its quantiles.

use std::f64::consts::SQRT_2;

use statrs::function::erf::erfc;

/// The part of a standard normal distribution that lies below `z`.
#[must_use]
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * erfc(-z / SQRT_2)
}

/// The value below which a part `u` of a standard normal distribution lies; right to about 16 digits.
///
/// Source: Wichura, "Algorithm AS 241: The percentage points of the normal distribution", Applied Statistics 37 (1988),
/// PPND16. Six draws of seven take the first branch, which costs two polynomials.
#[must_use]
pub fn normal_quantile(u: f64) -> f64 {
    let q = u - 0.5;
    if q.abs() <= REACH { centre(q) } else { tail(u) }
}

/// How many quantiles are found at once.
pub(super) const AT_ONCE: usize = 64;

/// Makes parts up to [`AT_ONCE`] their quantiles, bit by bit as one by one. First as if none were in a tail: compilers make vector
/// instructions of that.
pub(super) fn normal_quantiles(parts: &mut [f64]) {
    let mut all = [0.0; AT_ONCE];
    for (q, u) in all.iter_mut().zip(&*parts) {
        *q = u - 0.5;
    }
    let mut quantiles = [0.0; AT_ONCE];
    for k in 0..AT_ONCE {
        quantiles[k] = centre(all[k]);
    }
    for ((part, q), z) in parts.iter_mut().zip(all).zip(quantiles) {
        *part = if q.abs() <= REACH { z } else { tail(*part) };
    }
}

/// How far the centre reaches from the median.
const REACH: f64 = 0.425;

#[inline(always)]
fn centre(q: f64) -> f64 {
    q * ratio(0.180_625 - q * q, &CENTRE)
}

fn tail(u: f64) -> f64 {
    let tail = (-u.min(1.0 - u).ln()).sqrt();
    let size = if tail <= 5.0 { ratio(tail - 1.6, &TAIL) } else { ratio(tail - 5.0, &FAR_TAIL) };
    size.copysign(u - 0.5)
}

/// Coefficients of numerator and denominator, the constant first.
type Rational = [[f64; 8]; 2];

#[inline(always)]
fn ratio(x: f64, [above, below]: &Rational) -> f64 {
    let at = |coefficients: &[f64; 8]| coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c);
    at(above) / at(below)
}

#[allow(clippy::excessive_precision, reason = "as published")]
const CENTRE: Rational = [
    [
        3.387_132_872_796_366_608,
        1.331_416_678_917_843_774_5e2,
        1.971_590_950_306_551_442_7e3,
        1.373_169_376_550_946_112_5e4,
        4.592_195_393_154_987_145_7e4,
        6.726_577_092_700_870_085_3e4,
        3.343_057_558_358_812_810_5e4,
        2.509_080_928_730_122_672_7e3,
    ],
    [
        1.0,
        4.231_333_070_160_091_125_2e1,
        6.871_870_074_920_579_083e2,
        5.394_196_021_424_751_107_7e3,
        2.121_379_430_158_659_586_7e4,
        3.930_789_580_009_271_061e4,
        2.872_908_573_572_194_267_4e4,
        5.226_495_278_852_854_561e3,
    ],
];

#[allow(clippy::excessive_precision, reason = "as published")]
const TAIL: Rational = [
    [
        1.423_437_110_749_683_577_34,
        4.630_337_846_156_545_295_9,
        5.769_497_221_460_691_405_5,
        3.647_848_324_763_204_605_04,
        1.270_458_252_452_368_382_58,
        2.417_807_251_774_506_117_7e-1,
        2.272_384_498_926_918_458_33e-2,
        7.745_450_142_783_414_076_4e-4,
    ],
    [
        1.0,
        2.053_191_626_637_758_821_87,
        1.676_384_830_183_803_849_4,
        6.897_673_349_851_000_045_5e-1,
        1.481_039_764_274_800_745_9e-1,
        1.519_866_656_361_645_719_66e-2,
        5.475_938_084_995_344_946e-4,
        1.050_750_071_644_416_843_24e-9,
    ],
];

#[allow(clippy::excessive_precision, reason = "as published")]
const FAR_TAIL: Rational = [
    [
        6.657_904_643_501_103_777_2,
        5.463_784_911_164_114_369_9,
        1.784_826_539_917_291_335_8,
        2.965_605_718_285_048_912_3e-1,
        2.653_218_952_657_612_309_3e-2,
        1.242_660_947_388_078_438_6e-3,
        2.711_555_568_743_487_578_15e-5,
        2.010_334_399_292_288_132_65e-7,
    ],
    [
        1.0,
        5.998_322_065_558_879_376_9e-1,
        1.369_298_809_227_358_053_1e-1,
        1.487_536_129_085_061_485_25e-2,
        7.868_691_311_456_132_591e-4,
        1.846_318_317_510_054_681_8e-5,
        1.421_511_758_316_445_888_7e-7,
        2.044_263_103_389_939_785_64e-15,
    ],
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_tables() {
        for (u, z) in
            [(0.5, 0.0), (0.975, 1.959_963_984_540_054), (0.99, 2.326_347_874_040_841), (1e-9, -5.997_807_015_007_687)]
        {
            assert!((normal_quantile(u) - z).abs() < 1e-13, "{u}: {}", normal_quantile(u));
        }
        for k in 1..4_000 {
            let u = f64::from(k) / 4_000.0;
            assert!((normal_cdf(normal_quantile(u)) - u).abs() < 1e-10, "{u}");
            assert!((normal_quantile(u) + normal_quantile(1.0 - u)).abs() < 1e-9, "{u}");
        }
        // Several at once, in the centre and in both tails.
        for count in [1, 5, AT_ONCE] {
            let parts: Vec<f64> = (1..=count).map(|k| (k as f64 / (count + 1) as f64).powi(3)).collect();
            let mut found = parts.clone();
            normal_quantiles(&mut found);
            assert!(found.iter().zip(&parts).all(|(z, u)| z.to_bits() == normal_quantile(*u).to_bits()), "{found:?}");
        }
        // The branches meet.
        for edge in [0.075, 0.925, (-25.0_f64).exp()] {
            let (below, above) = (normal_quantile(edge * (1.0 - 1e-12)), normal_quantile(edge * (1.0 + 1e-12)));
            assert!(below <= above && above - below < 1e-9, "{edge}");
        }
    }
}
