//! The normal distribution and its quantiles, of one number or of several at once: the bits are the same.

use pulp::{Arch, NullaryFnOnce};

use crate::sim2real::elementary::exp_less;

/// The part of a standard normal distribution that lies below `z`; right to a few units in its last place, in the lower tail too, down
/// to -37.5. Below -37.6, where a part is less than any number of full precision, it is 0.
///
/// As in Cody, "Rational Chebyshev approximations for the error function", Mathematics of Computation 23 (1969), the part beyond
/// `|z|` is `e^(-z^2 / 2)` times a quotient of polynomials, and the square is split so that the exponent is exact. Cody has three
/// quotients for three ranges. Here one goes over all of them, so that nothing depends on where `z` lies and compilers make vector
/// instructions of it: that of degrees 9 and 10 which is right at 0 and at the Chebyshev nodes of `(z - 4) / (z + 4)` up to `z` =
/// 37.7, a mapping of Shepherd and Laframboise, "Chebyshev approximation of (1 + 2x) exp(x^2) erfc x in 0 <= x < infinity",
/// Mathematics of Computation 36 (1981). Between the nodes it is right to 8.4e-17 of its value.
#[must_use]
pub fn normal_cdf(z: f64) -> f64 {
    normal_part(z)
}

#[inline(always)]
fn normal_part(z: f64) -> f64 {
    // Beyond, all is 0; infinities would make no quotient.
    let size = if z.abs() > FARTHEST { FARTHEST } else { z.abs() };
    // A number of 26 bits, whose square is exact, and what is left of the square.
    let short = f64::from_bits(size.to_bits() & SHORT);
    let left = 0.5 * (size - short) * (size + short);
    let beyond = exp_less(-0.5 * short * short, left) * (polynomial(size, &ABOVE) / polynomial(size, &BELOW));
    if z > 0.0 { 1.0 - beyond } else { beyond }
}

/// Where no part is left.
const FARTHEST: f64 = 38.0;

/// The upper 26 bits of a mantissa, the one that is not written among them, with sign and exponent.
const SHORT: u64 = !0 << 27;

/// The even powers and the odd ones, so that few operations wait for one another. All coefficients are above 0: nothing cancels.
#[inline(always)]
fn polynomial<const N: usize>(z: f64, coefficients: &[f64; N]) -> f64 {
    let square = z * z;
    let (mut sum, mut next) = (coefficients[N - 1], coefficients[N - 2]);
    for c in coefficients[..N - 2].iter().rev() {
        (sum, next) = (next, sum * square + c);
    }
    sum * z + next
}

#[allow(clippy::excessive_precision, reason = "as found with 70 digits")]
const ABOVE: [f64; 10] = [
    0.5,
    0.774_873_314_287_903_536_33,
    0.594_015_629_698_575_818_87,
    0.289_290_853_067_523_368_41,
    9.767_123_389_178_143_403_92e-2,
    2.361_068_132_237_335_458_93e-2,
    4.086_052_393_816_173_259_66e-3,
    4.898_140_868_397_596_807_57e-4,
    3.718_447_618_994_267_849_56e-5,
    1.381_686_137_438_818_410_17e-6,
];

#[allow(clippy::excessive_precision, reason = "as found with 70 digits")]
const BELOW: [f64; 11] = [
    1.0,
    2.347_631_189_378_667_457_26,
    2.561_169_939_861_854_386_9,
    1.714_245_584_318_780_576_41,
    0.781_907_143_179_246_694_29,
    0.254_881_264_177_512_291_09,
    6.040_405_689_208_044_166_55e-2,
    1.033_542_211_053_300_046_82e-2,
    1.231_245_213_115_829_656_2e-3,
    9.320_765_939_300_455_451_58e-5,
    3.463_373_538_779_714_025_05e-6,
];

/// Makes numbers the parts that lie below them, bit by bit as one by one.
pub(super) fn normal_parts(numbers: &mut [f64]) {
    Arch::new().dispatch(Parts(numbers));
}

/// With the widest vectors of the processor: what is not inlined into it is compiled without.
struct Parts<'a>(&'a mut [f64]);

impl NullaryFnOnce for Parts<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for z in self.0 {
            *z = normal_part(*z);
        }
    }
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

/// Makes parts up to [`AT_ONCE`] their quantiles, bit by bit as one by one.
pub(super) fn normal_quantiles(parts: &mut [f64]) {
    Arch::new().dispatch(Quantiles(parts));
}

/// With the widest vectors of the processor, which compilers make of loops without branches: all are taken as if none were in a tail,
/// and then those that are beside one another.
struct Quantiles<'a>(&'a mut [f64]);

impl NullaryFnOnce for Quantiles<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        // Parts in tails and where they are: what is in none is written over by the next.
        let (mut places, mut tails, mut count) = ([0; AT_ONCE], [0.0; AT_ONCE], 0);
        for (place, u) in self.0.iter().enumerate() {
            (places[count], tails[count]) = (place, *u);
            count += usize::from((u - 0.5).abs() > REACH);
        }
        for u in self.0.iter_mut() {
            *u = centre(*u - 0.5);
        }
        let (places, tails) = (&places[..count], &tails[..count]);
        let mut logarithms = [0.0; AT_ONCE];
        for (logarithm, u) in logarithms.iter_mut().zip(tails) {
            *logarithm = outer(*u).ln();
        }
        let mut sizes = [0.0; AT_ONCE];
        for (size, logarithm) in sizes.iter_mut().zip(&logarithms[..count]) {
            *size = near(depth(*logarithm));
        }
        for k in 0..count {
            let depth = depth(logarithms[k]);
            let size = if depth <= NEAR { sizes[k] } else { far(depth) };
            self.0[places[k]] = size.copysign(tails[k] - 0.5);
        }
    }
}

/// How far the centre reaches from the median.
const REACH: f64 = 0.425;

#[inline(always)]
fn centre(q: f64) -> f64 {
    q * ratio(0.180_625 - q * q, &CENTRE)
}

fn tail(u: f64) -> f64 {
    let depth = depth(outer(u).ln());
    let size = if depth <= NEAR { near(depth) } else { far(depth) };
    size.copysign(u - 0.5)
}

/// The part beyond, in whichever tail it is.
#[inline(always)]
fn outer(u: f64) -> f64 {
    u.min(1.0 - u)
}

/// How deep in its tail a part of this logarithm is.
#[inline(always)]
fn depth(logarithm: f64) -> f64 {
    (-logarithm).sqrt()
}

/// How deep the nearer part of a tail goes.
const NEAR: f64 = 5.0;

#[inline(always)]
fn near(depth: f64) -> f64 {
    ratio(depth - 1.6, &TAIL)
}

#[inline(always)]
fn far(depth: f64) -> f64 {
    ratio(depth - NEAR, &FAR_TAIL)
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
    use std::f64::consts::SQRT_2;

    use statrs::function::erf::erfc;

    use super::*;

    /// Found with 50 digits, by mpmath.
    #[test]
    #[allow(clippy::excessive_precision, reason = "as found")]
    fn parts_are_those_of_tables_to_the_last_digits_in_tails_too() {
        for (z, part) in [
            (-37.0, 5.725_571_222_524_576_8e-300),
            (-30.0, 4.906_713_927_148_187_1e-198),
            (-20.0, 2.753_624_118_606_233_7e-89),
            (-10.0, 7.619_853_024_160_526_1e-24),
            (-8.25, 7.919_726_314_642_477_3e-17),
            (-5.0, 2.866_515_718_791_939_1e-7),
            (-3.0, 1.349_898_031_630_094_5e-3),
            (-1.5, 6.680_720_126_885_806_6e-2),
            (-1.0, 1.586_552_539_314_570_5e-1),
            (-0.5, 3.085_375_387_259_869e-1),
            (-0.125, 4.502_617_751_698_871_1e-1),
            (0.25, 5.987_063_256_829_237_2e-1),
            (1.0, 8.413_447_460_685_429_5e-1),
            (2.0, 9.772_498_680_518_207_9e-1),
            (6.0, 9.999_999_990_134_123_5e-1),
            // The squares of these have more digits than a number.
            (-36.9, 2.310_524_481_140_617_5e-298),
            (-12.3, 4.528_706_956_158_784_7e-35),
            (-4.7, 1.300_807_453_917_280_9e-6),
            (-0.7, 2.419_636_522_230_730_3e-1),
            (1.3, 9.031_995_154_143_896_7e-1),
        ] {
            let found = normal_cdf(z);
            assert!((found / part - 1.0).abs() <= 4.0 * f64::EPSILON, "{z}: {found:e} and {part:e}");
        }
        assert_eq!([0.0, -0.0, 9.0, 38.0, 1e300, f64::INFINITY].map(normal_cdf), [0.5, 0.5, 1.0, 1.0, 1.0, 1.0]);
        assert_eq!([-38.0, -1e300, f64::NEG_INFINITY].map(normal_cdf), [0.0; 3]);
        assert!(normal_cdf(f64::NAN).is_nan());
    }

    /// Another way to the same numbers, which is right to 10 digits.
    #[test]
    fn parts_are_those_of_another_library_everywhere() {
        let mut before = 0.0;
        for step in -37_000..=37_000 {
            let z = f64::from(step) * 1e-3;
            let (found, other) = (normal_cdf(z), 0.5 * erfc(-z / SQRT_2));
            assert!((found / other - 1.0).abs() < 2e-10, "{z}: {found:e} and {other:e}");
            assert!(found > before || (z > 7.0 && found == before), "falls at {z}");
            assert!((found + normal_cdf(-z) - 1.0).abs() < 2.0 * f64::EPSILON, "{z}");
            before = found;
        }
    }

    #[test]
    fn quantiles_are_those_of_tables() {
        for (u, z) in
            [(0.5, 0.0), (0.975, 1.959_963_984_540_054), (0.99, 2.326_347_874_040_841), (1e-9, -5.997_807_015_007_687)]
        {
            assert!((normal_quantile(u) - z).abs() < 1e-13, "{u}: {}", normal_quantile(u));
        }
        for k in 1..4_000 {
            let u = f64::from(k) / 4_000.0;
            assert!((normal_cdf(normal_quantile(u)) / u - 1.0).abs() < 1e-14, "{u}");
            assert!((normal_quantile(u) + normal_quantile(1.0 - u)).abs() < 1e-9, "{u}");
        }
        for power in 3..300 {
            let u = 10.0_f64.powi(-power);
            assert!((normal_cdf(normal_quantile(u)) / u - 1.0).abs() < 1e-12, "{u:e}");
        }
        // The branches meet.
        for edge in [0.075, 0.925, (-25.0_f64).exp()] {
            let (below, above) = (normal_quantile(edge * (1.0 - 1e-12)), normal_quantile(edge * (1.0 + 1e-12)));
            assert!(below <= above && above - below < 1e-9, "{edge}");
        }
    }

    /// However many at once, in the centre, in both tails and far in them.
    #[test]
    fn several_at_once_are_bit_by_bit_as_one_by_one() {
        let alike = |found: &[f64], from: &[f64], one: fn(f64) -> f64| {
            found.iter().zip(from).all(|(found, from)| found.to_bits() == one(*from).to_bits())
        };
        for count in 1..=AT_ONCE {
            for power in [1, 3, 30] {
                let below = |k: usize| (k as f64 / (count + 1) as f64).powi(power);
                let above = |k| (1.0 - below(k)).min(1.0 - f64::EPSILON);
                for parts in [(1..=count).map(below).collect::<Vec<_>>(), (1..=count).map(above).collect()] {
                    let mut found = parts.clone();
                    normal_quantiles(&mut found);
                    assert!(alike(&found, &parts, normal_quantile), "{parts:?}: {found:?}");
                }
            }
            for wide in [1.0, 4.0, 40.0] {
                let numbers: Vec<f64> = (0..=count).map(|k| wide * (2.0 * k as f64 / count as f64 - 1.0)).collect();
                let mut found = numbers.clone();
                normal_parts(&mut found);
                assert!(alike(&found, &numbers, normal_cdf), "{numbers:?}: {found:?}");
            }
        }
    }
}
