//! Plain orders: market orders that meet the next open, with nothing between their decision and their fill.
//!
//! On bars without delays that is what nearly all orders are. What happens to one is known when it is asked for: it arrives at
//! once, the next bar opens, and word of the fill comes with it. An agenda that holds nothing else would only be asked three times
//! what comes next. So all of it happens in one go here, and leaves behind, to the last bit, what it does step by step; whatever is
//! not plain goes [the usual way](Session::send_all).

use crate::market::feed::BarsAlone;
use crate::market::venue::{Floor, Outcome, What};
use crate::market::{
    BacktestError, Bar, Cash, Event, EventKind, News, Notice, OpenOrder, OrderId, Quantity, Rejection, Request, Sender, Side,
};
use crate::market::{Strategy, Ticket};
use crate::sim2real::Timestamp;

use super::Session;

/// A plain order, and the bar it meets.
struct Plain {
    id: OrderId,
    instrument: usize,
    side: Side,
    quantity: Quantity,
    row: usize,
    bar: Bar,
}

impl Session {
    /// Whether orders of this run may be plain: bars alone, nothing that [wants to be looked for](Self::may_be_quiet), messages that
    /// take no time, nothing drawn anew, and floors that [are plain](Floor::can_be_plain).
    pub(super) fn may_be_plain(&self) -> bool {
        let latencies = &self.setup.settings.latencies;
        self.can_be_quiet
            && self.redrawn.is_none()
            && [&latencies.order, &latencies.response, &latencies.compute].iter().all(|latency| latency.is_none())
            && self.venue.floors.iter().all(Floor::can_be_plain)
    }

    /// From now on no order is plain; whether any could have been.
    #[cfg(test)]
    pub(in crate::market) fn go_the_usual_way(&mut self) -> bool {
        std::mem::take(&mut self.can_be_plain)
    }

    /// Sends what was asked for at `now`, for whoever goes on to the next event and looks at nothing before: what is plain is filled
    /// at once.
    ///
    /// # Errors
    /// As [`Session::step`].
    #[inline]
    pub(in crate::market) fn send_on(
        &mut self,
        now: Timestamp,
        equity: Cash,
        strategy: &mut dyn Strategy,
    ) -> Result<(), BacktestError> {
        if self.orders.requests().is_empty() {
            return Ok(());
        }
        match self.plain(now) {
            Some(plain) => self.trade(&plain, now, equity, strategy),
            None => {
                self.send_all(now, equity);
                Ok(())
            }
        }
    }

    /// What was asked for, where it is one plain order and nothing comes before the bar it meets.
    #[inline]
    fn plain(&self, now: Timestamp) -> Option<Plain> {
        if !self.can_be_plain || !self.agenda.is_empty() || self.transit.peek().is_some() {
            return None;
        }
        let [Request::Submit(id, ticket)] = self.orders.requests() else { return None };
        let BarsAlone { instrument, bars, next, row, end } = self.feed.bars_alone()?;
        let bar = bars.get(next).and_then(|next| next.first())?;
        let comes_next = instrument == ticket.instrument && now <= bar.open_at && bar.open_at < bar.known_at.min(end);
        let (side, quantity) = (ticket.side, ticket.quantity);
        let of_market = *ticket == Ticket::market(instrument, side, quantity);
        let plain = comes_next && of_market && self.venue.floors[instrument].is_alone();
        plain.then_some(Plain { id: *id, instrument, side, quantity, row, bar: *bar })
    }

    /// A plain order is sent, filled and booked, and word of it told.
    #[inline(never)]
    fn trade(
        &mut self,
        plain: &Plain,
        now: Timestamp,
        equity: Cash,
        strategy: &mut dyn Strategy,
    ) -> Result<(), BacktestError> {
        let Plain { id, instrument, side, quantity, row, bar } = *plain;
        let ticket = &Ticket::market(instrument, side, quantity);
        self.orders.clear();
        let price = match self.admit(id, ticket, now, equity.to_f64()) {
            Ok(price) => price,
            Err(reason) => {
                self.blotter.reject(Rejection { decided_at: now, instrument, side, quantity, reason });
                return Ok(());
            }
        };
        let decided = (!self.venue.floors[instrument].is_bare()).then(|| self.decided(ticket, now, price));
        self.enter(id, ticket, now, now, price, Sender::Strategy);
        self.expected[instrument] = Some(row);
        // Its arrival and the open.
        self.agenda.passed(2);
        let floor = &mut self.venue.floors[instrument];
        let Some(filled) = floor.meet_open(id, side, quantity, &bar, row, decided.as_ref()) else {
            // Part of it is still open when word of the rest comes.
            self.known[instrument].opened(OpenOrder { id, side, kind: ticket.kind, left: quantity, closes: false });
            return self.settle(instrument);
        };
        // Word of it.
        self.agenda.passed(1);
        let place = self.mail.pass(floor.concessions());
        let (at, last) = (bar.open_at, self.blotter.orders.len() - 1);
        self.charge_held(instrument, at)?;
        self.book(last, &Outcome { id, instrument, at, what: What::Filled(filled) }, &filled)?;
        self.concede(place, instrument, filled.quantity);
        let news = News::Filled { quantity, price: filled.price, role: filled.role, left: Quantity::ZERO };
        let notice = Notice { order_id: id, instrument, side, at, news };
        let event = Event { time: at, instrument, kind: EventKind::Timer };
        self.tell(event, |view, orders| strategy.on_notice(view, &notice, orders))
    }
}
