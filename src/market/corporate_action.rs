//! Dividends and splits: what they do to what is held, to orders that work, and to what is known.

use std::sync::Arc;

use crate::sim2real::Timestamp;

use super::account::{ActionKind, BookedAction, CorporateAction, Ratio};
use super::agenda::{Due, Phase};
use super::backtest::BacktestError;
use super::session::Session;
use super::venue::Resting;
use super::{Arrival, Bar, Dividend, Event, EventKind, LedgerError, MoneyError, OrderId, Reason, Split, Strategy};

impl Session {
    /// The ex-instant of an action has come. What became of orders of its instrument before is known to their owner now
    /// at the latest, so that it is booked in the units of before.
    pub(super) fn take_action(
        &mut self,
        number: usize,
        at: Timestamp,
        mut strategy: Option<&mut dyn Strategy>,
    ) -> Result<(), BacktestError> {
        let Some(action) = self.keeping.as_ref().map(|keeping| keeping.account.actions[number]) else { return Ok(()) };
        // Of streams nobody knew it before.
        if let Some(bar) = self.bar_to_come(action.instrument).filter(|bar| bar.open_at < at) {
            let symbol = self.setup.instruments[action.instrument].symbol.clone();
            return Err(BacktestError::WithinBar { symbol, at, open_at: bar.open_at, known_at: bar.known_at });
        }
        let mut places = Vec::new();
        let mail = &self.mail;
        self.agenda.revise(|due| match due {
            Due::Notice(place) if mail.is_of(place, action.instrument) => {
                places.push(place);
                None
            }
            due => Some(due),
        });
        for place in places {
            // `as_deref_mut` would borrow it for as long as it lives.
            let hears: Option<&mut dyn Strategy> = match &mut strategy {
                Some(strategy) => Some(&mut **strategy),
                None => None,
            };
            self.deliver(place, at, hears)?;
        }
        self.book_action(&action)?;
        let Some(strategy) = strategy else { return Ok(()) };
        let event = Event { time: at, instrument: action.instrument, kind: EventKind::Timer };
        self.tell(event, |view, orders| strategy.on_action(view, &action, orders))
    }

    /// Whether a bar ends at the instant of the action that is due next, and has not been seen yet.
    #[cold]
    fn a_bar_of_that_instant_ends(&self, at: Timestamp) -> bool {
        let (Some(Due::Action(number)), Some(keeping)) = (self.agenda.next_due(), &self.keeping) else { return false };
        self.bar_to_come(keeping.account.actions[number].instrument).is_some_and(|bar| bar.known_at == at)
    }

    /// The next bar of an instrument, which is not over yet.
    fn bar_to_come(&self, instrument: usize) -> Option<&Bar> {
        self.feed.line(instrument).bar(self.next_bar(instrument)?)
    }

    /// Whether what is due has to wait for a bar that ends at its instant, which is of the time before an action.
    #[inline(always)]
    pub(super) fn a_bar_ends_first(&self, (at, phase): (Timestamp, Phase)) -> bool {
        phase == Phase::Acts && self.a_bar_of_that_instant_ends(at)
    }

    fn book_action(&mut self, action: &CorporateAction) -> Result<(), BacktestError> {
        let CorporateAction { at, instrument, kind } = *action;
        let setup = Arc::clone(&self.setup);
        let place = || format!("{} at {at}", setup.instruments[instrument].symbol);
        let failed = |error: LedgerError| match error {
            LedgerError::Money(error) => BacktestError::Money { place: place(), error },
            error => BacktestError::Account { place: place(), error },
        };
        let before = self.ledger.positions()[instrument].quantity;
        let received = match kind {
            ActionKind::Dividend { per_unit, withholding } => {
                self.ledger.dividend(&Dividend { instrument, per_unit, withholding }).map_err(failed)?
            }
            ActionKind::Split { new, old } => {
                self.charge_held(instrument, at)?;
                let lot = self.setup.increments[instrument].lot();
                let paid = self.ledger.split(&Split { instrument, new, old, lot }).map_err(failed)?;
                self.split(instrument, at, Ratio { new, old })?;
                paid
            }
        };
        let after = self.ledger.positions()[instrument].quantity;
        let fills = self.blotter.fills.len();
        if let Some(keeping) = &mut self.keeping {
            keeping.record.actions.push(BookedAction { action: *action, before, after, received, fills });
        }
        Ok(())
    }

    /// All but the account is told in new units: what is known, what works, and what is on its way.
    fn split(&mut self, instrument: usize, at: Timestamp, ratio: Ratio) -> Result<(), BacktestError> {
        let known = &mut self.known[instrument];
        known.mark = known.mark.map(|mark| ratio.price(mark));
        self.daily[instrument].split(ratio);
        self.clocks.split(ratio);
        if let Some(keeping) = &mut self.keeping {
            keeping.split[instrument] = Some((at, ratio));
        }
        let increments = self.setup.increments[instrument];
        let blotter = &self.blotter;
        self.agenda.revise(|due| match due {
            Due::Replace(id, quantity, price)
                if blotter.place(id).is_some_and(|k| blotter.orders[k].instrument == instrument) =>
            {
                // What then fits neither tick nor lot is refused where it arrives.
                Some(Due::Replace(id, quantity.map(|q| ratio.quantity(q)), price.map(|p| ratio.price(p))))
            }
            due => Some(due),
        });
        let held = self.ledger.positions()[instrument].quantity;
        let mut kept = self.venue.floors[instrument].split(ratio, held, at);
        let on_their_way: Vec<OrderId> =
            self.sent.iter().filter(|(_, (of, _))| *of == instrument).map(|(id, _)| id).collect();
        for id in on_their_way {
            // It may have gone with an order that it waited for.
            let Some((_, order)) = self.sent.get_mut(id) else { continue };
            if order.split(ratio, increments) {
                kept.push(*order);
            } else {
                self.withdraw(id, at, Reason::Split);
            }
        }
        kept.iter().for_each(|order| self.retell(order, instrument, ratio));
        self.settle(instrument)
    }

    /// Tells an order that goes on after a split in its new units.
    fn retell(&mut self, resting: &Resting, instrument: usize, ratio: Ratio) {
        let Some(k) = self.blotter.place(resting.id) else { return };
        let order = &mut self.blotter.orders[k];
        // A trigger that has done its work need not be on a tick.
        order.kind = order.kind.split(ratio, self.setup.increments[instrument]).unwrap_or(resting.kind);
        order.filled = resting.filled;
        order.quantity = resting.left + resting.filled;
        order.decision_price = ratio.price(order.decision_price);
        self.known[instrument].changed(resting.id, resting.left, order.kind);
    }

    /// A price of before the last split, which was on its way, is told in new units.
    pub(super) fn mark_as_split(&mut self, arrival: &Arrival) -> Result<(), MoneyError> {
        let Event { time, instrument, kind } = arrival.event;
        let split = self.keeping.as_ref().and_then(|keeping| keeping.split[instrument]);
        let Some((at, ratio)) = split else { return Ok(()) };
        // A bar that ends at the instant is of the time before.
        let before = if kind == EventKind::Bar { arrival.known_at <= at } else { arrival.known_at < at };
        let known = &mut self.known[instrument];
        let Some(mark) = known.mark.filter(|_| before) else { return Ok(()) };
        let mark = ratio.price(mark);
        known.mark = Some(mark);
        self.daily[instrument].see(time, mark, 0.0);
        self.ledger.mark(instrument, mark)
    }
}
