//! Rates between currencies, and cash that is changed from one into another.

use crate::market::{Cash, MoneyError, Price};

use super::{Balance, Ledger, LedgerError};

/// 1e-9, of which rates are whole numbers.
const NANO: i128 = 1_000_000_000;

/// Cash to be changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conversion {
    /// Number of the currency that is given.
    pub from: usize,
    /// Number of the currency that is received.
    pub to: usize,
    /// How much is given, above 0, in `from`.
    pub amount: Cash,
    /// Received for one unit of `from`, in `to`, above 0.
    pub rate: Price,
}

impl Ledger {
    /// Values `currency` at `rate`, in base currency for one unit, from now on.
    ///
    /// # Errors
    /// If there is no such currency, it is the base currency, or the rate is not above 0.
    pub fn set_rate(&mut self, currency: usize, rate: Price) -> Result<(), LedgerError> {
        let there_are = self.balances.len();
        let balance = self.balances.get_mut(currency).ok_or(LedgerError::UnknownCurrency { currency, there_are })?;
        if currency == 0 || rate.0 <= 0 {
            return Err(LedgerError::Rate { currency, rate: rate.to_f64() });
        }
        balance.rate = Some(rate);
        Ok(())
    }

    /// Changes cash of one currency into another, and gives what was received.
    ///
    /// Amount times rate is exact in 1e-27 of the currency received. What is beyond whole 1e-18 is not lost: it stays in
    /// [`Balance::remainder`] and goes into the next conversion to that currency.
    ///
    /// # Errors
    /// If there is no such currency, both are the same, amount or rate is not above 0, or 128 bits do not hold a sum.
    pub fn convert(&mut self, conversion: &Conversion) -> Result<Cash, LedgerError> {
        let Conversion { from, to, amount, rate } = *conversion;
        let (mut giver, mut taker) = (*self.balance(from)?, *self.balance(to)?);
        if from == to || amount.0 <= 0 {
            return Err(LedgerError::Conversion { from, to, amount: amount.to_f64() });
        }
        if rate.0 <= 0 {
            return Err(LedgerError::Rate { currency: to, rate: rate.to_f64() });
        }
        let (whole, rest) = times(amount, rate)?;
        let rest = rest + i128::from(taker.remainder);
        let received = Cash(whole).plus(Cash(rest / NANO))?;
        giver.pay(amount)?;
        giver.converted = giver.converted.minus(amount)?;
        taker.receive(received)?;
        taker.converted = taker.converted.plus(received)?;
        taker.remainder = (rest % NANO) as u32;
        (self.balances[from], self.balances[to]) = (giver, taker);
        Ok(received)
    }

    /// `amount` of `currency` in the base currency, rounded down to 1e-18.
    pub(super) fn in_base(&self, currency: usize, amount: Cash) -> Result<Cash, MoneyError> {
        match self.balances.get(currency) {
            Some(_) if currency == 0 => Ok(amount),
            Some(Balance { rate: Some(rate), .. }) => times(amount, *rate).map(|(whole, _)| Cash(whole)),
            _ => Err(MoneyError::NoRate { currency }),
        }
    }

    /// What all but the base currency is worth in it: the exact sum, rounded down once to 1e-18.
    pub(super) fn foreign(&self) -> Result<Cash, MoneyError> {
        let (mut whole, mut rest) = (Cash::ZERO, 0);
        for (currency, balance) in self.balances.iter().enumerate().skip(1) {
            let worth = balance.worth()?;
            if worth == Cash::ZERO {
                continue;
            }
            let (more, over) = times(worth, balance.rate.ok_or(MoneyError::NoRate { currency })?)?;
            whole = whole.plus(Cash(more))?;
            rest += over;
        }
        whole.plus(Cash(rest / NANO))
    }
}

/// `amount * rate` as whole 1e-18, rounded down, and the rest, 0 to 1e9 - 1 [1e-27].
fn times(amount: Cash, rate: Price) -> Result<(i128, i128), MoneyError> {
    let (high, low) = (amount.0.div_euclid(NANO), amount.0.rem_euclid(NANO) * i128::from(rate.0));
    let whole = high.checked_mul(rate.0.into()).and_then(|high| high.checked_add(low.div_euclid(NANO)));
    Ok((whole.ok_or(MoneyError::Overflow)?, low.rem_euclid(NANO)))
}
