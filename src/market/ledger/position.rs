//! What is held of an instrument, and the trades that change it.

use crate::market::{Cash, MoneyError, Price, Quantity, Side};

/// What is held of one instrument. Amounts are in the instrument's currency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Position {
    /// How much, negative when short.
    pub quantity: Quantity,
    /// What was paid for what is held, at average cost; negative when short: what was received.
    pub basis: Cash,
    /// Gain on what was closed, at average cost, before fees.
    pub realised: Cash,
    /// Fees paid.
    pub fees: Cash,
    /// The price it is valued at: the last close or mid, and the price of a fill where neither is known.
    pub mark: Option<Price>,
    /// Units of the underlying in one unit traded.
    pub multiplier: Multiplier,
    /// Number of its currency.
    pub currency: usize,
}

impl Position {
    /// What it is worth at its mark.
    #[must_use]
    pub fn value(&self) -> Cash {
        let value = self.mark.unwrap_or_default() * self.quantity;
        match self.multiplier {
            Multiplier(1) => value,
            // The ledger takes no mark and no trade by which this is beyond 128 bits.
            Multiplier(many) => Cash(value.0.saturating_mul(many.into())),
        }
    }

    /// By how much it is worth more at `price` than at its mark.
    #[inline]
    pub(super) fn change_to(&self, price: Price) -> Result<Cash, MoneyError> {
        match (self.multiplier, price.0.checked_sub(self.mark.unwrap_or_default().0)) {
            (Multiplier(1), Some(moved)) => Ok(Price(moved) * self.quantity),
            _ => self.amount(price, self.quantity)?.minus(self.value()),
        }
    }

    /// What `quantity` of it is worth at `price`.
    pub(super) fn amount(&self, price: Price, quantity: Quantity) -> Result<Cash, MoneyError> {
        match self.multiplier {
            Multiplier(1) => Ok(price * quantity),
            Multiplier(many) => (price * quantity).0.checked_mul(many.into()).map(Cash).ok_or(MoneyError::Overflow),
        }
    }

    /// The part of the basis that belongs to `closed` of `all` held, rounded towards 0 to 1e-18 of the currency: what is
    /// rounded off stays with the rest, so that nothing is lost.
    pub(super) fn basis_of(&self, closed: i64, all: i64) -> Cash {
        if closed == all {
            return self.basis;
        }
        let (all, closed) = (i128::from(all), i128::from(closed));
        let (each, over) = (self.basis.0 / all, self.basis.0 % all);
        Cash(each * closed + over * closed / all)
    }

    /// The position after a trade, and what the trade realised before its fee.
    pub(super) fn after(&self, trade: &Trade) -> Result<(Self, Cash), MoneyError> {
        let signed = trade.quantity.signed(trade.side);
        let quantity = self.quantity.0.checked_add(signed.0).map(Quantity).ok_or(MoneyError::Overflow)?;
        let mut after = *self;
        after.quantity = quantity;
        after.mark = self.mark.or(Some(trade.price));
        after.fees = self.fees.plus(trade.fee)?;
        // The part of the trade that closes what was held; the rest opens.
        let closing =
            if self.quantity.0.signum() * signed.0.signum() < 0 { trade.quantity.0.min(self.quantity.abs().0) } else { 0 };
        let opening = Quantity(trade.quantity.0 - closing).signed(trade.side);
        let mut realised = Cash::ZERO;
        if closing > 0 {
            let released = self.basis_of(closing, self.quantity.abs().0);
            // Closing a long brings in price * closing; closing a short pays it.
            let received = self.amount(trade.price, -Quantity(closing).signed(trade.side))?;
            realised = received.minus(released)?;
            after.basis = after.basis.minus(released)?;
        }
        after.basis = after.basis.plus(self.amount(trade.price, opening)?)?;
        after.realised = after.realised.plus(realised)?;
        after.amount(after.mark.unwrap_or_default(), quantity)?;
        Ok((after, realised))
    }
}

/// Units of the underlying in one unit traded: 1 of a share, 50 of an E-mini S&P 500 future.
///
/// A contract is booked as if its whole value was paid for: cash goes down by it and holdings up. Equity is that of an
/// account with daily settlement; cash is not what lies at the broker.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Multiplier(pub(super) i64);

impl Multiplier {
    /// The multiplier, where it is above 0.
    #[must_use]
    pub fn new(units: i64) -> Option<Self> {
        (units > 0).then_some(Self(units))
    }

    /// Units of the underlying in one unit traded.
    #[must_use]
    pub fn get(self) -> i64 {
        self.0
    }
}

impl Default for Multiplier {
    fn default() -> Self {
        Self(1)
    }
}

/// One trade.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trade {
    /// Number of the instrument.
    pub instrument: usize,
    /// Which way.
    pub side: Side,
    /// At which price.
    pub price: Price,
    /// How much, above 0.
    pub quantity: Quantity,
    /// Fee.
    pub fee: Cash,
}
