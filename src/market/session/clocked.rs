//! A session that is driven by a clock: it is asked what comes next and when, and goes no further.

use crate::market::{BacktestError, Cash, Event, Quantity, Reason, Status, Strategy};
use crate::sim2real::Timestamp;

use super::Session;

impl Session<'_> {
    /// When the next thing happens: a row of data, or a message that is due; none when the data have ended.
    #[must_use]
    pub fn next_due(&self) -> Option<Timestamp> {
        let next = self.next_time()?;
        Some(self.agenda.peek().map_or(next, |(at, _)| at.min(next)))
    }

    /// As [`step`](Self::step), but nothing happens that is later than `until`: none where the strategy sees nothing up to then.
    ///
    /// # Errors
    /// As [`Session::step`].
    #[inline(never)]
    pub fn step_up_to(&mut self, until: Timestamp, strategy: &mut dyn Strategy) -> Result<Option<Event>, BacktestError> {
        self.step_until(until, strategy)
    }

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
