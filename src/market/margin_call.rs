//! Margin: whether the account can carry an order, and what the broker does when it can no longer carry what it holds.

use super::account::MarginCall;
use super::agenda::{Due, Phase};
use super::backtest::BacktestError;
use super::session::Session;
use super::{Cash, Closing, Condition, Event, Ledger, Margin, MoneyError, OrderId, Quantity, Sender, Side, Ticket, Trade};

impl Session {
    /// Whether equity covers the initial margin of what is held with all that is under way and an order beside, or the order
    /// makes that less.
    pub(super) fn has_margin_for(&self, ticket: &Ticket) -> bool {
        let required = || -> Result<(Cash, Cash), MoneyError> {
            let (mut before, mut after) = (Cash::ZERO, Cash::ZERO);
            for (k, (position, known)) in self.ledger.positions().iter().zip(&self.known).enumerate() {
                let coming = position.quantity + known.working;
                let then = if k == ticket.instrument { coming + ticket.quantity.signed(ticket.side) } else { coming };
                before = before.plus(self.ledger.initial_margin_of(k, coming)?)?;
                after = after.plus(self.ledger.initial_margin_of(k, then)?)?;
            }
            Ok((before, after))
        };
        match (required(), self.ledger.equity()) {
            (Ok((before, after)), Ok(equity)) => after <= before || after <= equity,
            // Where a currency has no rate nobody can say; the run says so when something is held in it.
            (Err(MoneyError::NoRate { .. }), _) | (_, Err(MoneyError::NoRate { .. })) => true,
            _ => false,
        }
    }

    /// Prices or rates have changed: where equity is below maintenance, the broker closes what it takes.
    ///
    /// It counts its own orders under way as filled at the marks, so that it never closes twice what falls short once; what a
    /// move or a cost then leaves missing is closed by further orders.
    pub(super) fn call_margin(&mut self, event: Event) -> Result<(), BacktestError> {
        let Some(margin) = self.shortfall().map_err(|error| self.money(event, error))? else {
            if let Some(keeping) = &mut self.keeping {
                keeping.called = false;
            }
            return Ok(());
        };
        let Some(keeping) = &mut self.keeping else { return Ok(()) };
        if !std::mem::replace(&mut keeping.called, true) {
            let Margin { equity, required_maintenance: required, .. } = margin;
            keeping.record.margin_calls.push(MarginCall { at: event.time, equity, required });
            for id in self.adding() {
                self.agenda.put(event.time, Phase::AtOnce, Due::Revoke(id));
            }
        }
        let lots: Vec<Quantity> = self.setup.increments.iter().map(|increments| increments.lot()).collect();
        let closings = self.as_if_closed().and_then(|ledger| ledger.liquidation(&lots));
        for Closing { instrument, side, quantity } in closings.map_err(|error| self.money(event, error))? {
            let Some(price) = self.known[instrument].mark else { continue };
            let id = self.orders.number();
            let ticket = Ticket::market(instrument, side, quantity).on(Condition::ReduceOnly);
            self.send(id, &ticket, event.time, price, Sender::Broker);
        }
        Ok(())
    }

    /// Equity and margin, where the one is below the other.
    fn shortfall(&self) -> Result<Option<Margin>, MoneyError> {
        if self.ledger.is_flat() {
            return Ok(None);
        }
        Ok(Some(self.ledger.margin()?).filter(Margin::is_below_maintenance))
    }

    /// The strategy's orders that would add to a position, or open one.
    fn adding(&self) -> Vec<OrderId> {
        let of = |(position, known): (&super::Position, &super::known::Known)| {
            let adds = |side: Side| position.quantity.signed(side) >= Quantity::ZERO;
            known.orders.iter().filter(|order| !order.closes && adds(order.side)).map(|order| order.id).collect::<Vec<_>>()
        };
        self.ledger.positions().iter().zip(&self.known).flat_map(of).collect()
    }

    /// The account as it will be when the broker's orders under way are filled at the marks.
    fn as_if_closed(&self) -> Result<Ledger, MoneyError> {
        let mut ledger = self.ledger.clone();
        for (instrument, known) in self.known.iter().enumerate() {
            for order in &known.orders {
                let by_broker =
                    self.blotter.place(order.id).is_some_and(|k| self.blotter.orders[k].sender == Sender::Broker);
                let position = ledger.positions()[instrument];
                // No more than closes what is held, as the venue has it.
                let closes = (-position.quantity.signed(order.side)).max(Quantity::ZERO);
                let (quantity, Some(price)) = (order.left.min(closes), position.mark) else { continue };
                if by_broker && quantity > Quantity::ZERO {
                    ledger.book(&Trade { instrument, side: order.side, price, quantity, fee: Cash::ZERO })?;
                }
            }
        }
        Ok(ledger)
    }
}
