//! A session that is to stop: what it holds and is worth, and all of its orders taken back.

use crate::market::{BacktestError, Cash, Quantity, Reason, Session, Status};

impl Session {
    /// Takes all orders back that work or are on their way, at the exchange and at once, as a broker does for whom a connection is
    /// lost.
    ///
    /// # Errors
    /// As [`Session::step`].
    pub(in crate::market) fn cancel_all(&mut self, reason: Reason) -> Result<(), BacktestError> {
        let Some(now) = self.equity.end() else { return Ok(()) };
        let works = |order: &&crate::market::Order| order.status == Status::Unfilled;
        let ids: Vec<u64> = self.blotter.orders.iter().filter(works).map(|order| order.order_id).collect();
        for id in ids {
            if let Some(instrument) = self.withdraw(crate::market::OrderId(id), now, reason) {
                self.settle(instrument)?;
            }
        }
        Ok(())
    }

    /// What the account is worth now, as its owner knows.
    ///
    /// # Errors
    /// An amount that overflows.
    pub(in crate::market) fn equity_now(&self) -> Result<Cash, BacktestError> {
        self.ledger.equity().map_err(|error| self.amount("the equity".into(), error))
    }

    /// What is held of each instrument.
    pub(in crate::market) fn holdings(&self) -> impl Iterator<Item = Quantity> + '_ {
        self.ledger.positions().iter().map(|position| position.quantity)
    }
}
