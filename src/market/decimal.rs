//! Decimal numbers as texts, read exactly: no price goes through a binary number that cannot hold it.

use std::fmt;
use std::str::FromStr;

use super::{Cash, Price, Quantity};

/// A text that is no decimal number, or none that fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum DecimalError {
    /// No number: letters, two points, nothing at all.
    #[error("expected a decimal number\nhint: such as 61809.6, -0.05 or 4.2e-5, without signs for thousands or currencies")]
    Unreadable,
    /// Beyond what the integer holds.
    #[error("the number is beyond what is held\nhint: prices and quantities reach to 9.2e9, amounts of cash to 1.7e20")]
    TooLarge,
    /// More digits than the unit has.
    #[error("the number has digits below the smallest unit\nhint: prices and quantities are held to 1e-9, cash to 1e-18")]
    TooFine,
}

/// A number in whole units, and whether digits below the unit were rounded off, half away from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rounded<T> {
    /// The number, to the nearest unit.
    pub value: T,
    /// Whether there was more than that.
    pub rounded: bool,
}

/// The number `text` says, times ten to the power of `places`, to the nearest integer.
fn scaled(text: &str, places: i32) -> Result<Rounded<i128>, DecimalError> {
    // Beyond this the digits cannot be those of a number that somebody pays.
    const LONGEST: usize = 120;
    let text = text.trim();
    if text.len() > LONGEST {
        return Err(DecimalError::Unreadable);
    }
    let (negative, size) = match text.as_bytes().first() {
        Some(b'-') => (true, &text[1..]),
        Some(b'+') => (false, &text[1..]),
        _ => (false, text),
    };
    let (mantissa, exponent) = match size.find(['e', 'E']) {
        Some(at) => (&size[..at], size[at + 1..].parse::<i32>().map_err(|_| DecimalError::Unreadable)?),
        None => (size, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = || whole.bytes().chain(fraction.bytes());
    if digits().next().is_none() || !digits().all(|b| b.is_ascii_digit()) {
        return Err(DecimalError::Unreadable);
    }
    // How many of the digits stand before the unit's point.
    let kept = i64::from(exponent) + i64::from(places) + whole.len() as i64;
    let mut value: i128 = 0;
    let (mut half, mut rest) = (false, false);
    for (k, digit) in digits().map(|b| i128::from(b - b'0')).enumerate() {
        let k = k as i64;
        if k < kept {
            value = value.checked_mul(10).and_then(|v| v.checked_add(digit)).ok_or(DecimalError::TooLarge)?;
        } else {
            half |= k == kept && digit >= 5;
            rest |= digit != 0;
        }
    }
    for _ in (whole.len() + fraction.len()) as i64..kept {
        if value == 0 {
            break;
        }
        value = value.checked_mul(10).ok_or(DecimalError::TooLarge)?;
    }
    let value = value.checked_add(i128::from(half)).ok_or(DecimalError::TooLarge)?;
    Ok(Rounded { value: if negative { -value } else { value }, rounded: rest })
}

fn narrow(number: Rounded<i128>) -> Result<Rounded<i64>, DecimalError> {
    let value = i64::try_from(number.value).map_err(|_| DecimalError::TooLarge)?;
    Ok(Rounded { value, rounded: number.rounded })
}

fn exact<T>(number: Rounded<T>) -> Result<T, DecimalError> {
    if number.rounded { Err(DecimalError::TooFine) } else { Ok(number.value) }
}

impl Price {
    /// The price nearest to the decimal number `text` [currency], half away from 0.
    ///
    /// # Errors
    /// A text that is no decimal number, or one beyond 9.2e9.
    pub fn nearest_decimal(text: &str) -> Result<Rounded<Self>, DecimalError> {
        narrow(scaled(text, 9)?).map(|n| Rounded { value: Self(n.value), rounded: n.rounded })
    }
}

impl Quantity {
    /// The quantity nearest to the decimal number `text` [units], half away from 0.
    ///
    /// # Errors
    /// A text that is no decimal number, or one beyond 9.2e9.
    pub fn nearest_decimal(text: &str) -> Result<Rounded<Self>, DecimalError> {
        narrow(scaled(text, 9)?).map(|n| Rounded { value: Self(n.value), rounded: n.rounded })
    }
}

impl Cash {
    /// The amount nearest to the decimal number `text` [currency], half away from 0.
    ///
    /// # Errors
    /// A text that is no decimal number, or one beyond 1.7e20.
    pub fn nearest_decimal(text: &str) -> Result<Rounded<Self>, DecimalError> {
        scaled(text, 18).map(|n| Rounded { value: Self(n.value), rounded: n.rounded })
    }
}

impl FromStr for Price {
    type Err = DecimalError;

    fn from_str(text: &str) -> Result<Self, DecimalError> {
        exact(Self::nearest_decimal(text)?)
    }
}

impl FromStr for Quantity {
    type Err = DecimalError;

    fn from_str(text: &str) -> Result<Self, DecimalError> {
        exact(Self::nearest_decimal(text)?)
    }
}

impl FromStr for Cash {
    type Err = DecimalError;

    fn from_str(text: &str) -> Result<Self, DecimalError> {
        exact(Self::nearest_decimal(text)?)
    }
}

/// Whole units of 1e-9 to the last digit, without the zeros at the end.
fn show_nanos(nanos: i64, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    fmt::Display::fmt(&Cash(i128::from(nanos) * 1_000_000_000), f)
}

impl fmt::Display for Price {
    /// To the last unit, without the zeros at the end.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        show_nanos(self.0, f)
    }
}

impl fmt::Display for Quantity {
    /// To the last unit, without the zeros at the end.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        show_nanos(self.0, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_read_to_the_last_digit() {
        assert_eq!("61809.6".parse(), Ok(Price(61_809_600_000_000)));
        assert_eq!("23730422.401518747".parse(), Ok(Quantity(23_730_422_401_518_747)));
        assert_eq!("4.217e-05".parse(), Ok(Price(42_170)));
        assert_eq!("-2.557".parse(), Ok(Cash(-2_557_000_000_000_000_000)));
        assert_eq!(" +1E3 ".parse(), Ok(Quantity(1_000_000_000_000)));
        assert_eq!("0e99999".parse(), Ok(Price(0)));
        assert_eq!(".5".parse(), Ok(Price(500_000_000)));
        assert_eq!("5.".parse(), Ok(Price(5_000_000_000)));
    }

    #[test]
    fn what_is_below_the_unit_is_rounded_and_said() {
        let found = Price::nearest_decimal("0.0000000015").unwrap();
        assert_eq!((found.value, found.rounded), (Price(2), true));
        assert_eq!(Price::nearest_decimal("-0.0000000014999").unwrap().value, Price(-1));
        assert_eq!(Price::nearest_decimal("61806.700000000004").unwrap().value, Price(61_806_700_000_000));
        assert_eq!(Price::nearest_decimal("1e-30").unwrap(), Rounded { value: Price(0), rounded: true });
        assert_eq!("0.1234567891".parse::<Price>(), Err(DecimalError::TooFine));
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in
            ["", ".", "-", "1,000", "5.56 USDT", "1.2.3", "NaN", "inf", "0x10", "1e", "1e1.5", "--1", "1e99999999999"]
        {
            assert_eq!(text.parse::<Price>(), Err(DecimalError::Unreadable), "{text}");
        }
        for text in ["9300000000", "1e10", "1e2000000000"] {
            assert_eq!(text.parse::<Price>(), Err(DecimalError::TooLarge), "{text}");
        }
        assert_eq!("1e21".parse::<Cash>(), Err(DecimalError::TooLarge));
    }

    proptest::proptest! {
        #[test]
        fn what_is_shown_is_read_again(nanos in proptest::num::i64::ANY, cash in proptest::num::i128::ANY) {
            proptest::prop_assert_eq!(Price(nanos).to_string().parse(), Ok(Price(nanos)));
            proptest::prop_assert_eq!(Quantity(nanos).to_string().parse(), Ok(Quantity(nanos)));
            proptest::prop_assert_eq!(Cash(cash).to_string().parse(), Ok(Cash(cash)));
        }
    }
}
