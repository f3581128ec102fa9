//! The sine as a polynomial, which compilers turn into vector instructions over lanes, where a library's is called lane by
//! lane. It has the same bits on every machine.

use pulp::{Arch, NullaryFnOnce};

/// Above this size [rad] the reduction to half a turn would lose digits.
const LARGEST: f64 = 1e5;
/// Adding this to a number of less than 2^51 rounds it to a whole one, whose lowest bit is then the lowest of the sum.
const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// Pi in three parts, the first two short enough for exact products with a whole number of up to 17 bits (Cody & Waite,
/// *Software Manual for the Elementary Functions* (1980), chapter 8).
const PI: [f64; 3] = [3.141_592_653_584_666_6, 5.126_688_303_167_911_6e-12, 2.112_599_813_397_485_5e-23];
/// Taylor's coefficients, `(-1)^k / (2 k + 1)!` from `k = 1` on: what is left out is below 1e-17 within half a turn.
const C: [f64; 10] = [
    -1.0 / 6.0,
    1.0 / 120.0,
    -1.0 / 5_040.0,
    1.0 / 362_880.0,
    -1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
    -1.0 / 1_307_674_368_000.0,
    1.0 / 355_687_428_096_000.0,
    -1.0 / 121_645_100_408_832_000.0,
    1.0 / 51_090_942_171_709_440_000.0,
];

/// The sine of `angle` [rad], to within two units in the last place of 1.
#[inline]
pub(super) fn sine(angle: f64) -> f64 {
    if within(angle) { polynomial(angle) } else { angle.sin() }
}

/// Puts the sine of each angle [rad] in its place: the same bits as those of [`sine`].
#[inline]
pub(super) fn sines(angles: &mut [f64]) {
    if angles.iter().fold(true, |all, angle| all & within(*angle)) {
        Arch::new().dispatch(Polynomials(angles));
    } else {
        angles.iter_mut().for_each(|angle| *angle = sine(*angle));
    }
}

/// Angles that take so many at once of the widest vectors there are.
pub(super) const BLOCK: usize = 8;

/// Angles whose polynomials are to be put in their place.
struct Polynomials<'a>(&'a mut [f64]);

impl NullaryFnOnce for Polynomials<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (blocks, rest) = self.0.as_chunks_mut::<BLOCK>();
        blocks.iter_mut().for_each(of_block);
        // A block that is not full takes no longer than a full one, and less than its angles one by one.
        if !rest.is_empty() {
            let mut block = [0.0; BLOCK];
            block[..rest.len()].copy_from_slice(rest);
            of_block(&mut block);
            rest.copy_from_slice(&block[..rest.len()]);
        }
    }
}

#[inline(always)]
fn of_block(angles: &mut [f64; BLOCK]) {
    angles.iter_mut().for_each(|angle| *angle = polynomial(*angle));
}

/// Whether the polynomial will do; not for what is no number.
#[inline]
fn within(angle: f64) -> bool {
    angle.abs() <= LARGEST
}

#[inline(always)]
fn polynomial(angle: f64) -> f64 {
    let shifted = angle * std::f64::consts::FRAC_1_PI + ROUNDING;
    let turns = shifted - ROUNDING;
    let rest = ((angle - turns * PI[0]) - turns * PI[1]) - turns * PI[2];
    // In pairs, so that few operations wait for one another (Estrin 1960).
    let z = rest * rest;
    let (z2, z4) = (z * z, (z * z) * (z * z));
    let low = (C[0] + C[1] * z) + (C[2] + C[3] * z) * z2;
    let high = (C[4] + C[5] * z) + (C[6] + C[7] * z) * z2;
    let sum = low + (high + (C[8] + C[9] * z) * z4) * z4;
    let sine = rest + rest * (z * sum);
    // Every other half turn the sign changes.
    f64::from_bits(sine.to_bits() ^ (shifted.to_bits() << 63))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_sine() {
        for k in -200_000..200_000 {
            for angle in [f64::from(k) * 1e-4, f64::from(k) * 0.4999, f64::from(k) * std::f64::consts::FRAC_PI_2] {
                let apart = (sine(angle) - angle.sin()).abs();
                assert!(apart <= 2.0 * f64::EPSILON, "{angle}: {} and {}", sine(angle), angle.sin());
            }
        }
        let many: Vec<f64> = (0..21).map(|k| 0.7 * f64::from(k) - 5.0).chain([1e9]).collect();
        for count in 0..=many.len() {
            let mut all = many[..count].to_vec();
            sines(&mut all);
            assert_eq!(all, many[..count].iter().map(|angle| sine(*angle)).collect::<Vec<_>>());
        }
        assert_eq!(sine(0.0), 0.0);
        assert_eq!(sine(1e-9), 1e-9_f64.sin());
    }

    #[test]
    fn what_is_very_large_or_no_number_is_what_the_library_says() {
        assert_eq!(sine(3e9).to_bits(), 3e9_f64.sin().to_bits());
        assert!(sine(f64::NAN).is_nan() && sine(f64::INFINITY).is_nan());
    }
}
