//! The account: cash, positions and what was gained on them, exact to the last unit.
//!
//! `equity = cash + sum of quantity * mark` and `equity = opening cash + realised + unrealised - fees` hold at any time,
//! as integers. With dividends, charges and conversions, and in each of several currencies, what holds is in [`Balance`].
//!
//! What is rounded, and how: equity in the base currency once, down, where it is asked for; a conversion's remainder is kept
//! ([`Ledger::convert`]); the basis of what is closed, towards 0, the rest staying with what is held; tax, the cash and the
//! mark of a split as said there. No rounding moves cash without being booked.

use super::{Cash, MoneyError, Price};

mod action;
mod balance;
mod conversion;
mod fraction;
mod margin;
#[cfg(test)]
mod one_currency;
mod position;
mod terms;
#[cfg(test)]
mod tests;

pub use action::{Dividend, Split};
pub use balance::{Balance, ChargeKind, Charges, Income};
pub use conversion::Conversion;
pub use fraction::Fraction;
pub use margin::{Closing, Margin};
pub use position::{Multiplier, Position, Trade};
pub use terms::{LedgerError, Requirement, Terms};

/// The account.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ledger {
    /// One a currency, first that of the base currency.
    balances: Vec<Balance>,
    positions: Vec<Position>,
    /// One an instrument, as are terms and positions.
    income: Vec<Income>,
    terms: Vec<Terms>,
    /// Number of positions that are not flat.
    open: usize,
}

impl Ledger {
    /// An account with `cash` and no position in any of `instruments`, all in one currency.
    #[must_use]
    pub fn new(cash: Cash, instruments: usize) -> Self {
        Self::of(&[cash], vec![Terms::default(); instruments])
    }

    /// An account with opening cash in each currency, first in the base currency, and no position in any of the instruments
    /// whose terms are given.
    ///
    /// # Errors
    /// If there is no currency, or an instrument is in one that there is not.
    pub fn with_terms(opening: &[Cash], terms: Vec<Terms>) -> Result<Self, LedgerError> {
        let there_are = opening.len();
        if there_are == 0 {
            return Err(LedgerError::NoCurrency);
        }
        match terms.iter().find(|terms| terms.currency >= there_are) {
            Some(Terms { currency, .. }) => Err(LedgerError::UnknownCurrency { currency: *currency, there_are }),
            None => Ok(Self::of(opening, terms)),
        }
    }

    fn of(opening: &[Cash], terms: Vec<Terms>) -> Self {
        let flat = |terms: &Terms| {
            let Terms { multiplier, currency, .. } = *terms;
            Position { multiplier, currency, ..Position::default() }
        };
        let balances = opening.iter().map(|cash| Balance::of(*cash)).collect();
        let (positions, income) = (terms.iter().map(flat).collect(), vec![Income::default(); terms.len()]);
        Self { balances, positions, income, terms, open: 0 }
    }

    /// Cash it began with, in the base currency.
    #[must_use]
    pub fn opening(&self) -> Cash {
        self.balances[0].opening
    }

    /// Cash in hand, in the base currency.
    #[must_use]
    pub fn cash(&self) -> Cash {
        self.balances[0].cash
    }

    /// What there is in each currency, first in the base currency.
    #[must_use]
    pub fn balances(&self) -> &[Balance] {
        &self.balances
    }

    /// Cash and what the positions are worth, in the base currency. What other currencies come to at their rates is the
    /// exact sum, rounded down once to 1e-18.
    ///
    /// # Errors
    /// If 128 bits do not hold it, or a currency in which there is something has no rate.
    #[inline]
    pub fn equity(&self) -> Result<Cash, MoneyError> {
        let base = self.balances[0].worth()?;
        if self.balances.len() == 1 { Ok(base) } else { base.plus(self.foreign()?) }
    }

    /// The positions, one an instrument.
    #[must_use]
    pub fn positions(&self) -> &[Position] {
        &self.positions
    }

    /// The terms of the instruments.
    #[must_use]
    pub fn terms(&self) -> &[Terms] {
        &self.terms
    }

    /// What positions brought and cost while they were held, one an instrument.
    #[must_use]
    pub fn income(&self) -> &[Income] {
        &self.income
    }

    /// Whether nothing is held.
    #[inline]
    #[must_use]
    pub fn is_flat(&self) -> bool {
        self.open == 0
    }

    /// Sum of what all positions are worth, short ones too counted as positive [base currency]. Those in a currency without
    /// a rate, with which equity is an error, are not in it.
    #[inline]
    #[must_use]
    pub fn gross(&self) -> f64 {
        if self.open == 0 {
            return 0.0;
        }
        match (self.positions.as_slice(), self.balances.as_slice()) {
            ([_], [only]) => only.holdings.to_f64().abs(),
            _ => self.gross_of_many(),
        }
    }

    fn gross_of_many(&self) -> f64 {
        let rate = |p: &Position| match p.currency {
            0 => 1.0,
            other => self.balances[other].rate.map_or(0.0, Price::to_f64),
        };
        self.positions.iter().map(|p| p.value().to_f64().abs() * rate(p)).sum()
    }

    /// Values `instrument` at `price` from now on.
    ///
    /// # Errors
    /// If what it is worth is beyond 128 bits.
    #[inline]
    pub fn mark(&mut self, instrument: usize, price: Price) -> Result<(), MoneyError> {
        let Some(position) = self.positions.get_mut(instrument) else { return Ok(()) };
        if position.quantity.0 != 0 {
            let change = position.change_to(price)?;
            let balance = &mut self.balances[position.currency];
            balance.holdings = balance.holdings.plus(change)?;
        }
        position.mark = Some(price);
        Ok(())
    }

    /// Books a trade and gives what it realised, before its fee. A trade larger than the position it closes turns it
    /// round.
    ///
    /// # Errors
    /// If an amount is beyond 128 bits, or a position beyond 64; the account is as it was.
    pub fn book(&mut self, trade: &Trade) -> Result<Cash, MoneyError> {
        let Some(before) = self.positions.get(trade.instrument).copied() else { return Ok(Cash::ZERO) };
        let (after, realised) = before.after(trade)?;
        let mut balance = self.balances[before.currency];
        let paid = before.amount(trade.price, trade.quantity.signed(trade.side))?;
        let cash = balance.cash.minus(paid)?.minus(trade.fee)?;
        balance.holdings = balance.holdings.minus(before.value())?.plus(after.value())?;
        balance.cash = cash;
        balance.worth()?;
        self.open = self.open + usize::from(after.quantity.0 != 0) - usize::from(before.quantity.0 != 0);
        self.balances[before.currency] = balance;
        self.positions[trade.instrument] = after;
        Ok(realised)
    }

    fn balance(&self, currency: usize) -> Result<&Balance, LedgerError> {
        let there_are = self.balances.len();
        self.balances.get(currency).ok_or(LedgerError::UnknownCurrency { currency, there_are })
    }

    fn position(&self, instrument: usize) -> Result<&Position, LedgerError> {
        let there_are = self.positions.len();
        self.positions.get(instrument).ok_or(LedgerError::UnknownInstrument { instrument, there_are })
    }
}
