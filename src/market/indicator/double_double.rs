//! Numbers of twice the precision of an `f64`, for sums that things enter and leave all the time.

use std::ops::{Add, AddAssign, Mul, Sub, SubAssign};

/// The sum of two floating-point numbers, the second no more than the rounding error of the first: 106 bits.
///
/// Sums and products are those of T. J. Dekker, "A floating-point technique for extending the available precision",
/// Numerische Mathematik 18 (1971), with the more careful addition of Y. Hida, X. S. Li and D. H. Bailey, "Algorithms for
/// quad-double precision floating point arithmetic", ARITH-15 (2001): an addition is off by 2^-105 of its result at most.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct DoubleDouble {
    high: f64,
    low: f64,
}

impl DoubleDouble {
    pub(super) const ZERO: Self = Self { high: 0.0, low: 0.0 };

    /// A product, exactly, of factors below 1e100.
    #[inline]
    pub(super) fn product(a: f64, b: f64) -> Self {
        let high = a * b;
        let ((a_high, a_low), (b_high, b_low)) = (halves(a), halves(b));
        Self { high, low: ((a_high * b_high - high) + a_high * b_low + a_low * b_high) + a_low * b_low }
    }

    /// The nearest `f64`.
    #[inline]
    pub(super) fn to_f64(self) -> f64 {
        self.high + self.low
    }
}

impl From<f64> for DoubleDouble {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

/// A sum, and what it leaves out (D. E. Knuth, The Art of Computer Programming 2, section 4.2.2).
#[inline]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_seen = sum - a;
    (sum, (a - (sum - b_seen)) + (b - b_seen))
}

/// As [`two_sum`], where `a` is the larger.
#[inline]
fn two_sum_sorted(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    (sum, b - (sum - a))
}

/// The first and the last 26 bits (Veltkamp 1968, in Dekker's paper).
#[inline]
fn halves(x: f64) -> (f64, f64) {
    const SPLIT: f64 = 134_217_729.0; // 2^27 + 1
    let scaled = SPLIT * x;
    let high = scaled - (scaled - x);
    (high, x - high)
}

impl Add for DoubleDouble {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        let (high, error) = two_sum(self.high, other.high);
        let (low, rest) = two_sum(self.low, other.low);
        let (high, error) = two_sum_sorted(high, error + low);
        let (high, low) = two_sum_sorted(high, error + rest);
        Self { high, low }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self + Self { high: -other.high, low: -other.low }
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let Self { high, low } = Self::product(self.high, other.high);
        let (high, low) = two_sum_sorted(high, low + (self.high * other.low + self.low * other.high));
        Self { high, low }
    }
}

impl AddAssign for DoubleDouble {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for DoubleDouble {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_a_float_forgets_is_kept() {
        let sum = DoubleDouble::from(1e20) + DoubleDouble::from(1.0) - DoubleDouble::from(1e20);
        assert_eq!(sum.to_f64(), 1.0);
        // 0.1 is not a tenth, and its square has 106 bits.
        let square = DoubleDouble::product(0.1, 0.1) - DoubleDouble::from(0.1 * 0.1);
        assert_eq!(square.to_f64(), 0.1_f64.mul_add(0.1, -(0.1 * 0.1)));
    }

    proptest! {
        #[test]
        fn sums_and_products_are_those_of_integers(
            terms in prop::collection::vec((-(1_i64 << 50)..1 << 50, -(1_i64 << 50)..1 << 50), 1..50),
        ) {
            let mut sum = DoubleDouble::ZERO;
            let mut exact = 0_i128;
            for (a, b) in terms {
                sum += DoubleDouble::product(a as f64, b as f64);
                exact += i128::from(a) * i128::from(b);
            }
            prop_assert_eq!(sum.high as i128 + sum.low as i128, exact);
        }
    }
}
