//! Fractions of an amount: margins and rates of tax.

use crate::market::{Cash, MoneyError};

/// A fraction, 0 or more [1e-9].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Fraction(u32);

const ONE: i128 = 1_000_000_000;

impl Fraction {
    /// Nothing.
    pub const ZERO: Self = Self(0);
    /// The whole.
    pub const ONE: Self = Self(1_000_000_000);

    /// `percent` hundredths.
    #[must_use]
    pub const fn percent(percent: u8) -> Self {
        Self(percent as u32 * 10_000_000)
    }

    /// The fraction nearest to `value` (0.15 is 15 %); none where that is not a number from 0 to 4.
    #[must_use]
    pub fn nearest(value: f64) -> Option<Self> {
        (0.0..=4.0).contains(&value).then(|| Self((value * 1e9).round() as u32))
    }

    /// The fraction as a floating-point number.
    #[must_use]
    pub fn to_f64(self) -> f64 {
        f64::from(self.0) / 1e9
    }

    /// This part of `amount`, rounded towards 0 to 1e-18 of the currency.
    ///
    /// # Errors
    /// If 128 bits do not hold it.
    pub fn of(self, amount: Cash) -> Result<Cash, MoneyError> {
        let (whole, rest) = (amount.0 / ONE, amount.0 % ONE);
        let part = whole.checked_mul(self.0.into()).ok_or(MoneyError::Overflow)?;
        Cash(part).plus(Cash(rest * i128::from(self.0) / ONE))
    }

    /// This part of `amount`, which is 0 or more, rounded up to 1e-18 of the currency.
    ///
    /// # Errors
    /// If 128 bits do not hold it.
    pub fn of_rounded_up(self, amount: Cash) -> Result<Cash, MoneyError> {
        let exact = amount.0 % ONE * i128::from(self.0) % ONE == 0;
        self.of(amount)?.plus(Cash(i128::from(!exact)))
    }
}
