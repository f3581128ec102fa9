//! The cash of one currency, and how it came about.

use crate::market::{Cash, MoneyError, Price};

/// What an account has in one currency. In integers, at any time,
///
/// ```text
/// cash + holdings = opening + converted - charges.total
///                 + sum over its instruments of (realised + value - basis - fees + income.dividends - income.withheld
///                                                - income.charges.total)
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Balance {
    /// Cash it began with.
    pub opening: Cash,
    /// Cash in hand.
    pub cash: Cash,
    /// Worth of the positions in this currency.
    pub holdings: Cash,
    /// Received in conversions, less what was given.
    pub converted: Cash,
    /// Below 1e-18: what conversions brought beyond whole units, kept for the next one [1e-27 of the currency].
    pub remainder: u32,
    /// Charged on cash.
    pub charges: Charges,
    /// Base currency for one unit of this one; of the base currency none is needed.
    pub rate: Option<Price>,
}

impl Balance {
    pub(super) fn of(opening: Cash) -> Self {
        Self { opening, cash: opening, ..Self::default() }
    }

    /// Cash and holdings, in this currency.
    ///
    /// # Errors
    /// If 128 bits do not hold it.
    pub fn worth(&self) -> Result<Cash, MoneyError> {
        self.cash.plus(self.holdings)
    }

    pub(super) fn receive(&mut self, amount: Cash) -> Result<(), MoneyError> {
        let cash = self.cash.plus(amount)?;
        cash.plus(self.holdings)?;
        self.cash = cash;
        Ok(())
    }

    pub(super) fn pay(&mut self, amount: Cash) -> Result<(), MoneyError> {
        let cash = self.cash.minus(amount)?;
        cash.plus(self.holdings)?;
        self.cash = cash;
        Ok(())
    }
}

/// What a charge is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ChargeKind {
    /// Borrowing of what was sold short.
    Borrow,
    /// Funding of a perpetual future.
    Funding,
    /// Interest on cash or debt.
    Interest,
    /// Anything else.
    Other,
}

/// Charges by kind; credits are below 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Charges {
    /// Borrowing of what was sold short.
    pub borrow: Cash,
    /// Funding of perpetual futures.
    pub funding: Cash,
    /// Interest.
    pub interest: Cash,
    /// Others.
    pub other: Cash,
}

impl Charges {
    /// Those of one kind.
    #[must_use]
    pub fn of(&self, kind: ChargeKind) -> Cash {
        match kind {
            ChargeKind::Borrow => self.borrow,
            ChargeKind::Funding => self.funding,
            ChargeKind::Interest => self.interest,
            ChargeKind::Other => self.other,
        }
    }

    /// All together.
    ///
    /// # Errors
    /// If 128 bits do not hold it.
    pub fn total(&self) -> Result<Cash, MoneyError> {
        self.borrow.plus(self.funding)?.plus(self.interest)?.plus(self.other)
    }

    /// These and one more.
    pub(super) fn with(mut self, amount: Cash, kind: ChargeKind) -> Result<Self, MoneyError> {
        let sum = match kind {
            ChargeKind::Borrow => &mut self.borrow,
            ChargeKind::Funding => &mut self.funding,
            ChargeKind::Interest => &mut self.interest,
            ChargeKind::Other => &mut self.other,
        };
        *sum = sum.plus(amount)?;
        Ok(self)
    }
}

/// What positions in an instrument brought and cost while they were held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Income {
    /// Dividends received, before tax, less those paid on short positions.
    pub dividends: Cash,
    /// Tax withheld from them.
    pub withheld: Cash,
    /// Charges.
    pub charges: Charges,
}
