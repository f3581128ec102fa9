//! The account: cash, positions and what was gained on them, exact to the last unit.
//!
//! `equity = cash + sum of quantity * mark` and `equity = opening cash + realised + unrealised - fees` hold at any time,
//! as integers.

use super::{Cash, MoneyError, Price, Quantity, Side};

/// What is held of one instrument.
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
}

impl Position {
    /// What it is worth at its mark.
    #[must_use]
    pub fn value(&self) -> Cash {
        self.mark.unwrap_or_default() * self.quantity
    }

    /// The part of the basis that belongs to `closed` of the position, rounded towards 0 to 1e-18 of the currency: what
    /// is rounded off stays with the rest, so that nothing is lost.
    fn basis_of(&self, closed: i64) -> Cash {
        let (all, closed) = (i128::from(self.quantity.abs().0), i128::from(closed));
        let (each, over) = (self.basis.0 / all, self.basis.0 % all);
        Cash(each * closed + over * closed / all)
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

/// The account.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ledger {
    opening: Cash,
    cash: Cash,
    /// Worth of all positions, kept as marks change.
    holdings: Cash,
    positions: Vec<Position>,
    /// Number of positions that are not flat.
    open: usize,
}

impl Ledger {
    /// An account with `cash` and no position in any of `instruments`.
    #[must_use]
    pub fn new(cash: Cash, instruments: usize) -> Self {
        Self { opening: cash, cash, holdings: Cash::ZERO, positions: vec![Position::default(); instruments], open: 0 }
    }

    /// Cash it began with.
    #[must_use]
    pub fn opening(&self) -> Cash {
        self.opening
    }

    /// Cash in hand.
    #[must_use]
    pub fn cash(&self) -> Cash {
        self.cash
    }

    /// Cash and what the positions are worth.
    ///
    /// # Errors
    /// If 128 bits do not hold it.
    pub fn equity(&self) -> Result<Cash, MoneyError> {
        self.cash.plus(self.holdings)
    }

    /// The positions, one an instrument.
    #[must_use]
    pub fn positions(&self) -> &[Position] {
        &self.positions
    }

    /// Whether nothing is held.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        self.open == 0
    }

    /// Sum of what all positions are worth, short ones too counted as positive [currency].
    #[must_use]
    pub fn gross(&self) -> f64 {
        if self.open == 0 {
            return 0.0;
        }
        match self.positions.as_slice() {
            [_] => self.holdings.to_f64().abs(),
            many => many.iter().map(|p| p.value().to_f64().abs()).sum(),
        }
    }

    /// Values `instrument` at `price` from now on.
    ///
    /// # Errors
    /// If what it is worth is beyond 128 bits.
    #[inline]
    pub fn mark(&mut self, instrument: usize, price: Price) -> Result<(), MoneyError> {
        let Some(position) = self.positions.get_mut(instrument) else { return Ok(()) };
        if position.quantity.0 != 0 {
            let change = (price * position.quantity).minus(position.value())?;
            self.holdings = self.holdings.plus(change)?;
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
        let signed = trade.quantity.signed(trade.side);
        let quantity = before.quantity.0.checked_add(signed.0).map(Quantity).ok_or(MoneyError::Overflow)?;
        let mut after = before;
        after.quantity = quantity;
        after.mark = before.mark.or(Some(trade.price));
        after.fees = before.fees.plus(trade.fee)?;
        // The part of the trade that closes what was held; the rest opens.
        let closing = if before.quantity.0.signum() * signed.0.signum() < 0 {
            trade.quantity.0.min(before.quantity.abs().0)
        } else {
            0
        };
        let opening = Quantity(trade.quantity.0 - closing).signed(trade.side);
        let mut realised = Cash::ZERO;
        if closing > 0 {
            let released = before.basis_of(closing);
            // Closing a long brings in price * closing; closing a short pays it.
            let received = trade.price * -Quantity(closing).signed(trade.side);
            realised = received.minus(released)?;
            after.basis = after.basis.minus(released)?;
        }
        after.basis = after.basis.plus(trade.price * opening)?;
        after.realised = after.realised.plus(realised)?;
        let cash = self.cash.minus(trade.price * signed)?.minus(trade.fee)?;
        let holdings = self.holdings.minus(before.value())?.plus(after.value())?;
        cash.plus(holdings)?;
        self.open = self.open + usize::from(quantity.0 != 0) - usize::from(before.quantity.0 != 0);
        (self.cash, self.holdings) = (cash, holdings);
        self.positions[trade.instrument] = after;
        Ok(realised)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn trade(side: Side, price: f64, quantity: f64) -> Trade {
        Trade {
            instrument: 0,
            side,
            price: Price::nearest(price).unwrap(),
            quantity: Quantity::nearest(quantity).unwrap(),
            fee: Cash::nearest(1.0).unwrap(),
        }
    }

    #[test]
    fn a_round_trip_through_long_and_short() {
        let mut ledger = Ledger::new(Cash::nearest(1_000.0).unwrap(), 1);
        ledger.book(&trade(Side::Buy, 10.0, 10.0)).unwrap();
        ledger.book(&trade(Side::Buy, 12.0, 10.0)).unwrap();
        // 20 held at 11 on average; 30 sold at 13 close them with 40 gained and leave 10 short at 13.
        assert_eq!(ledger.book(&trade(Side::Sell, 13.0, 30.0)).unwrap(), Cash::nearest(40.0).unwrap());
        let position = ledger.positions()[0];
        assert_eq!((position.quantity.to_f64(), position.basis.to_f64()), (-10.0, -130.0));
        assert_eq!(ledger.book(&trade(Side::Buy, 12.5, 10.0)).unwrap(), Cash::nearest(5.0).unwrap());
        assert!(ledger.is_flat());
        assert_eq!(ledger.cash(), Cash::nearest(1_000.0 + 45.0 - 4.0).unwrap());
        assert_eq!(ledger.equity().unwrap(), ledger.cash());
    }

    /// 74 were paid for 7 of the smallest units: 2 of them cost 21 and a seventh, which the other 5 keep.
    #[test]
    fn what_a_division_leaves_stays_with_the_rest() {
        let mut ledger = Ledger::new(Cash::ZERO, 1);
        let trade = |side, price, quantity| {
            let (price, quantity) = (Price(price), Quantity(quantity));
            Trade { instrument: 0, side, price, quantity, fee: Cash::ZERO }
        };
        ledger.book(&trade(Side::Buy, 10, 3)).unwrap();
        ledger.book(&trade(Side::Buy, 11, 4)).unwrap();
        assert_eq!(ledger.book(&trade(Side::Sell, 20, 2)).unwrap(), Cash(40 - 21));
        assert_eq!(ledger.book(&trade(Side::Sell, 20, 5)).unwrap(), Cash(100 - 53));
        assert_eq!((ledger.positions()[0].basis, ledger.cash()), (Cash::ZERO, Cash(140 - 74)));
    }

    #[test]
    fn an_amount_that_does_not_fit_leaves_the_account_as_it_was() {
        let mut ledger = Ledger::new(Cash(i128::MIN + 10), 1);
        let before = ledger.clone();
        assert_eq!(ledger.book(&trade(Side::Buy, 9e9, 9e9)), Err(MoneyError::Overflow));
        assert_eq!(ledger, before);
    }

    type Step = (usize, bool, i64, i64, i64, i64);

    fn steps() -> impl Strategy<Value = Vec<Step>> {
        let one = (
            0..3_usize,
            any::<bool>(),
            1..2_000_000_000_000_i64,
            1..5_000_000_000_000_i64,
            -9..9_i64,
            1..4_000_000_000_000_i64,
        );
        proptest::collection::vec(one, 1..200)
    }

    proptest! {
        /// Over any orders, cash, positions, gains and fees reconcile to the last unit.
        #[test]
        fn the_account_adds_up(steps in steps()) {
            let opening = Cash::nearest(1_000_000.0).unwrap();
            let mut ledger = Ledger::new(opening, 3);
            let (mut cash, mut held, mut fees) = (opening.0, [0_i128; 3], 0_i128);
            for (instrument, buy, price, quantity, fee, mark) in steps {
                let side = if buy { Side::Buy } else { Side::Sell };
                let fee = Cash(i128::from(fee) * 1_000_000_000);
                ledger.book(&Trade { instrument, side, price: Price(price), quantity: Quantity(quantity), fee }).unwrap();
                let signed = if buy { i128::from(quantity) } else { -i128::from(quantity) };
                cash -= signed * i128::from(price) + fee.0;
                held[instrument] += signed;
                fees += fee.0;
                ledger.mark(instrument, Price(mark)).unwrap();
                let positions = ledger.positions();
                prop_assert_eq!(ledger.cash().0, cash);
                let worth: i128 = positions.iter().map(|p| p.value().0).sum();
                prop_assert_eq!(ledger.equity().unwrap().0, cash + worth);
                let realised: i128 = positions.iter().map(|p| p.realised.0).sum();
                let unrealised: i128 = positions.iter().map(|p| p.value().0 - p.basis.0).sum();
                prop_assert_eq!(ledger.equity().unwrap().0, opening.0 + realised + unrealised - fees);
                for (position, held) in positions.iter().zip(held) {
                    prop_assert_eq!(i128::from(position.quantity.0), held);
                    if held == 0 { prop_assert_eq!(position.basis, Cash::ZERO); }
                }
                prop_assert_eq!(ledger.is_flat(), held.iter().all(|h| *h == 0));
            }
        }
    }
}
