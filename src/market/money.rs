//! Exact money: prices, quantities and cash as integers, so that an account adds up to the last unit.
//!
//! | type | integer | one unit | reaches to |
//! |---|---|---|---|
//! | [`Price`] | 64 bits | 1e-9 of the currency | 9.2e9 |
//! | [`Quantity`] | 64 bits | 1e-9 of a unit traded | 9.2e9 |
//! | [`Cash`] | 128 bits | 1e-18 of the currency | 1.7e20 |
//!
//! A price times a quantity is exactly an amount of cash: nothing is rounded there. What comes from a model as a
//! floating-point number is rounded once, where it enters: to 1e-9 of the currency (half away from 0), and prices of
//! fills then to the instrument's tick, against the order.

use std::fmt;
use std::ops::{Add, Mul, Neg, Sub};

use super::{Instrument, Side};

/// Units of [`Price`] and [`Quantity`] in 1.
const NANO: f64 = 1e9;
/// Units of [`Cash`] in 1e-9 of the currency.
const NANO_CASH: i128 = 1_000_000_000;

/// A number that cannot be a price, a quantity or an amount of cash.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MoneyError {
    /// NaN or infinite.
    #[error("{what} is {value}\nhint: give a finite number")]
    NotFinite {
        /// What was to be converted.
        what: &'static str,
        /// What was found.
        value: f64,
    },
    /// Beyond what the integer holds.
    #[error("{what} {value} is beyond {limit:e}\nhint: trade in larger units, or scale prices by `price_scale`")]
    TooLarge {
        /// What was to be converted.
        what: &'static str,
        /// What was found.
        value: f64,
        /// The largest that is held.
        limit: f64,
    },
    /// A step that is no whole number of 1e-9, or not above 0.
    #[error("{what} {value} is not a multiple of 1e-9 above 0\nhint: give the smallest step, for example 0.01")]
    Step {
        /// Which step.
        what: &'static str,
        /// What was found.
        value: f64,
    },
    /// Cash or positions in a currency whose rate to the base currency is not known yet.
    #[error("currency {currency} has no rate to the base currency\nhint: set its rate before the first trade in it")]
    NoRate {
        /// Number of the currency.
        currency: usize,
    },
    /// A sum of cash that 128 bits do not hold.
    #[error("an amount of cash is beyond 1.7e20\nhint: trade smaller quantities")]
    Overflow,
}

/// `value` in whole 1e-9, to the nearest, half away from 0.
#[inline]
fn nanos(what: &'static str, value: f64) -> Result<i64, MoneyError> {
    const LIMIT: f64 = 9.2e9;
    if value.abs() <= LIMIT {
        return Ok(rounded(value * NANO));
    }
    Err(match value.is_finite() {
        true => MoneyError::TooLarge { what, value, limit: LIMIT },
        false => MoneyError::NotFinite { what, value },
    })
}

/// The integer nearest to `value`, which 64 bits hold, half away from 0: as `round` has it, which is a call of a library on most
/// processors, and every price that is read is rounded.
#[inline]
fn rounded(value: f64) -> i64 {
    let whole = value as i64;
    // Beyond 2^53 there is nothing behind the point; below, the difference is exact.
    let rest = value - whole as f64;
    whole + i64::from(rest >= 0.5) - i64::from(rest <= -0.5)
}

/// A price [1e-9 of the currency].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Price(pub i64);

impl Price {
    /// The price nearest to `value` [currency].
    ///
    /// # Errors
    /// If it is not finite or beyond 9.2e9.
    pub fn nearest(value: f64) -> Result<Self, MoneyError> {
        nanos("a price", value).map(Self)
    }

    /// The price higher by `other`, as far as 64 bits reach.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }

    /// The price lower by `other`, as far as 64 bits reach.
    #[must_use]
    pub fn minus(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }

    /// The price as a floating-point number [currency], the nearest there is.
    #[must_use]
    pub fn to_f64(self) -> f64 {
        self.0 as f64 / NANO
    }
}

/// A quantity [1e-9 of a unit]; negative for a short position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Quantity(pub i64);

impl Quantity {
    /// Nothing.
    pub const ZERO: Self = Self(0);

    /// The quantity nearest to `value` [units].
    ///
    /// # Errors
    /// If it is not finite or beyond 9.2e9.
    pub fn nearest(value: f64) -> Result<Self, MoneyError> {
        nanos("a quantity", value).map(Self)
    }

    /// The quantity as a floating-point number [units], the nearest there is.
    #[must_use]
    pub fn to_f64(self) -> f64 {
        self.0 as f64 / NANO
    }

    /// Its size, whichever way it points.
    #[must_use]
    pub fn abs(self) -> Self {
        Self(self.0.saturating_abs())
    }

    /// This quantity as a position it adds: positive for a buy, negative for a sell.
    #[must_use]
    pub fn signed(self, side: Side) -> Self {
        match side {
            Side::Buy => self,
            Side::Sell => -self,
        }
    }
}

impl Add for Quantity {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Quantity {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Neg for Quantity {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

/// An amount of cash [1e-18 of the currency].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Cash(pub i128);

/// 2^63, exactly.
const TWO_TO_63: f64 = 9_223_372_036_854_775_808.0;

impl Cash {
    /// Nothing.
    pub const ZERO: Self = Self(0);

    /// The amount nearest to `value` [currency] that is a whole number of 1e-9, half away from 0: the one rounding of
    /// fees and of a run's opening cash.
    ///
    /// # Errors
    /// If it is not finite or beyond 1e18.
    pub fn nearest(value: f64) -> Result<Self, MoneyError> {
        const LIMIT: f64 = 1e18;
        if !value.is_finite() {
            return Err(MoneyError::NotFinite { what: "an amount of cash", value });
        }
        if value.abs() > LIMIT {
            return Err(MoneyError::TooLarge { what: "an amount of cash", value, limit: LIMIT });
        }
        Ok(Self((value * NANO).round() as i128 * NANO_CASH))
    }

    /// The amount as a floating-point number [currency], the nearest there is up to one part in 1e15.
    #[must_use]
    #[inline]
    pub fn to_f64(self) -> f64 {
        // Two conversions of 64 bits take less time than one of 128, which no processor has.
        let size = self.0.unsigned_abs();
        if size >> 126 != 0 {
            return self.0 as f64 * 1e-18;
        }
        let (high, low) = ((size >> 63) as i64, size as i64 & i64::MAX);
        let size = high as f64 * TWO_TO_63 + low as f64;
        (if self.0 < 0 { -size } else { size }) * 1e-18
    }

    /// The floating-point number that is nearest of all [currency]: whoever writes it with the fewest digits that tell it apart
    /// from others writes the amount again, where that has no more than 15 digits.
    #[must_use]
    pub fn nearest_f64(self) -> f64 {
        // Reading a decimal number is what rounds right, however long it is.
        self.to_string().parse().unwrap_or_else(|_| self.to_f64())
    }

    /// The sum.
    ///
    /// # Errors
    /// If 128 bits do not hold it.
    pub fn plus(self, other: Self) -> Result<Self, MoneyError> {
        self.0.checked_add(other.0).map(Self).ok_or(MoneyError::Overflow)
    }

    /// The difference.
    ///
    /// # Errors
    /// If 128 bits do not hold it.
    pub fn minus(self, other: Self) -> Result<Self, MoneyError> {
        self.0.checked_sub(other.0).map(Self).ok_or(MoneyError::Overflow)
    }
}

impl Mul<Quantity> for Price {
    type Output = Cash;
    /// What a quantity at a price is worth, exactly.
    fn mul(self, quantity: Quantity) -> Cash {
        Cash(i128::from(self.0) * i128::from(quantity.0))
    }
}

impl fmt::Display for Cash {
    /// To the last unit, without the zeros at the end.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const ONE: u128 = 1_000_000_000_000_000_000;
        let (sign, size) = (if self.0 < 0 { "-" } else { "" }, self.0.unsigned_abs());
        let fraction = format!("{:018}", size % ONE);
        let fraction = fraction.trim_end_matches('0');
        let point = if fraction.is_empty() { "" } else { "." };
        write!(f, "{sign}{}{point}{fraction}", size / ONE)
    }
}

/// The steps in which an instrument's prices and quantities move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Increments {
    tick: i64,
    lot: i64,
}

impl Increments {
    /// The increments of `instrument`.
    ///
    /// # Errors
    /// If its tick or lot size is not a whole number of 1e-9 above 0.
    pub fn of(instrument: &Instrument) -> Result<Self, MoneyError> {
        let step = |what: &'static str, value: f64| match nanos(what, value) {
            Ok(step) if step > 0 && (value * NANO - step as f64).abs() <= 1e-6 * step as f64 => Ok(step),
            Ok(_) => Err(MoneyError::Step { what, value }),
            Err(error) => Err(error),
        };
        Ok(Self { tick: step("tick_size", instrument.tick_size)?, lot: step("lot_size", instrument.lot_size)? })
    }

    /// The same lots, with prices in steps of 1e-9: for averages over several trades, which lie between ticks.
    #[must_use]
    pub fn without_tick(self) -> Self {
        Self { tick: 1, ..self }
    }

    /// `price` on a tick, moved against an order of `side` where it is not on one: up for a buy, down for a sell.
    #[must_use]
    pub fn against(self, side: Side, price: Price) -> Price {
        let above = price.0.rem_euclid(self.tick);
        match side {
            _ if above == 0 => price,
            Side::Buy => Price(price.0.saturating_add(self.tick - above)),
            Side::Sell => Price(price.0 - above),
        }
    }

    /// The largest whole number of lots within `quantity`, towards 0.
    #[must_use]
    pub fn whole_lots(self, quantity: Quantity) -> Quantity {
        Quantity(quantity.0 - quantity.0 % self.lot)
    }

    /// Whether `quantity` is a whole number of lots.
    #[must_use]
    pub fn holds(self, quantity: Quantity) -> bool {
        quantity.0 % self.lot == 0
    }

    /// Whether `price` is on a tick.
    #[must_use]
    pub fn on_tick(self, price: Price) -> bool {
        price.0 % self.tick == 0
    }

    /// The whole number of ticks nearest to `distance` [currency]; none of them where it is not a price could be.
    #[must_use]
    pub fn whole_ticks(self, distance: f64) -> Price {
        let ticks = (distance * NANO / self.tick as f64).round();
        Price::nearest(ticks * self.tick as f64 / NANO).map_or(Price(0), |near| Price(near.0 - near.0 % self.tick))
    }

    /// One tick.
    #[must_use]
    pub fn tick(self) -> Price {
        Price(self.tick)
    }

    /// One lot.
    #[must_use]
    pub fn lot(self) -> Quantity {
        Quantity(self.lot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn instrument(tick_size: f64, lot_size: f64) -> Instrument {
        Instrument { symbol: "XYZ".into(), tick_size, lot_size, average_daily_volume: None, daily_volatility: None }
    }

    #[test]
    fn an_amount_is_written_as_the_decimal_number_it_is() {
        for nanos in [1_i128, 12_345_000_000, 99_999_999_999_999, -370_801_800_000] {
            let cash = Cash(nanos * 1_000_000_000);
            assert_eq!(cash.nearest_f64().to_string(), cash.to_string());
        }
    }

    #[test]
    fn a_price_times_a_quantity_is_exact() {
        let price = Price::nearest(61_800.3).unwrap();
        let quantity = Quantity::nearest(0.006).unwrap();
        assert_eq!((price * quantity).to_string(), "370.8018");
        assert_eq!((Price(1) * Quantity(1)).to_string(), "0.000000000000000001");
        assert_eq!((Price(i64::MAX) * Quantity(i64::MIN)).0, i128::from(i64::MAX) * i128::from(i64::MIN));
    }

    #[test]
    fn a_number_is_rounded_as_round_has_it() {
        let half = [0.0, 0.5, 1.5, 2.5, 0.499_999_999_999_999_94, 4_503_599_627_370_495.5, 9_007_199_254_740_993.0, 9.2e18];
        let near = |value: f64| [value.next_down(), value, value.next_up()];
        for value in half.into_iter().flat_map(near).flat_map(|value| [value, -value]) {
            assert_eq!(rounded(value), value.round() as i64, "{value}");
        }
    }

    #[test]
    fn what_is_no_number_is_refused() {
        assert!(matches!(Price::nearest(f64::NAN), Err(MoneyError::NotFinite { .. })));
        assert!(matches!(Quantity::nearest(f64::INFINITY), Err(MoneyError::NotFinite { .. })));
        assert!(matches!(Price::nearest(1e10), Err(MoneyError::TooLarge { .. })));
        assert!(matches!(Cash::nearest(1e19), Err(MoneyError::TooLarge { .. })));
        assert!(Cash(i128::MAX).plus(Cash(1)).is_err() && Cash(i128::MIN).minus(Cash(1)).is_err());
        for bad in [0.0, -0.01, 1e-12, 0.015e-7] {
            assert!(matches!(Increments::of(&instrument(bad, 1.0)), Err(MoneyError::Step { .. })), "{bad}");
        }
    }

    #[test]
    fn a_price_off_the_tick_moves_against_the_order() {
        let steps = Increments::of(&instrument(0.01, 1.0)).unwrap();
        let at = |x: f64| Price::nearest(x).unwrap();
        assert_eq!(steps.against(Side::Buy, at(170.017)), at(170.02));
        assert_eq!(steps.against(Side::Sell, at(170.017)), at(170.01));
        // The nearest double to 170.01 is not 170.01; that is no reason to move a tick.
        for tick in 0..100_000_i64 {
            let price = tick as f64 * 0.01;
            assert_eq!(steps.against(Side::Buy, at(price)).0, tick * 10_000_000);
            assert_eq!(steps.against(Side::Sell, at(price)).0, tick * 10_000_000);
        }
    }

    #[test]
    fn quantities_are_cut_to_whole_lots_towards_zero() {
        let steps = Increments::of(&instrument(0.01, 100.0)).unwrap();
        let of = |x: f64| Quantity::nearest(x).unwrap();
        assert_eq!(steps.whole_lots(of(250.0)), of(200.0));
        assert_eq!(steps.whole_lots(of(-250.0)), of(-200.0));
        assert!(steps.holds(of(300.0)) && !steps.holds(of(301.0)));
    }

    proptest::proptest! {
        #[test]
        fn cash_as_a_float_is_the_nearest_to_one_part_in_a_quadrillion(high in proptest::num::i64::ANY, low in proptest::num::u64::ANY, shift in 0..127_u32) {
            let amount = (i128::from(high) << 64 | i128::from(low)) >> shift;
            for amount in [amount, amount.wrapping_neg(), i128::MIN, i128::MAX, 0, 1, -1] {
                let (found, exact) = (Cash(amount).to_f64(), amount as f64 * 1e-18);
                proptest::prop_assert!((found - exact).abs() <= 1e-15 * exact.abs(), "{amount}: {found} and {exact}");
            }
        }
    }
}
