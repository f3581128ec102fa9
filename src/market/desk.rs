//! The desk: it checks what a strategy asks for, and sends it.

use crate::sim2real::Timestamp;

use super::agenda::{Due, Phase};
use super::backtest::BacktestError;
use super::session::Session;
use super::venue::{Outcome, Resting, What};
use super::{
    Cash, Condition, InFlight, Link, OpenOrder, Order, OrderId, Price, Quantity, Reason, Rejection, Request, Role, Sender,
    Side, Status, Ticket, TimeInForce,
};

impl Session {
    /// Sends what the strategy asked for, or refuses it.
    pub(super) fn send_all(&mut self, now: Timestamp, equity: Cash) {
        let mut orders = std::mem::take(&mut self.orders);
        for request in orders.requests() {
            match *request {
                Request::Submit(id, ticket) => match self.admit(id, &ticket, now, equity.to_f64()) {
                    Ok(price) => self.send(id, &ticket, now, price, Sender::Strategy),
                    Err(reason) => {
                        let Ticket { instrument, side, quantity, .. } = ticket;
                        self.blotter.reject(Rejection { decided_at: now, instrument, side, quantity, reason });
                    }
                },
                Request::Cancel(id) => self.post(id, now, Due::Cancel(id)),
                Request::Replace { id, quantity, price } => self.post(id, now, Due::Replace(id, quantity, price)),
                Request::Refused { instrument, side, quantity, reason } => {
                    self.blotter.reject(Rejection { decided_at: now, instrument, side, quantity, reason });
                }
                Request::Wake(time) => self.agenda.put(time.max(now), Phase::Notices, Due::Wake),
            }
        }
        orders.clear();
        self.orders = orders;
    }

    /// The price at decision of an order that may be sent, or why it may not.
    pub(super) fn admit(&self, id: OrderId, ticket: &Ticket, now: Timestamp, equity: f64) -> Result<Price, Reason> {
        let increments = self.setup.increments.get(ticket.instrument).ok_or(Reason::UnknownInstrument)?;
        if ticket.quantity <= Quantity::ZERO {
            return Err(Reason::NoQuantity);
        }
        if !increments.holds(ticket.quantity) {
            return Err(Reason::OffLot);
        }
        if ticket.kind.prices().any(|price| price.0 <= 0 || !increments.on_tick(price)) {
            return Err(Reason::OffTick);
        }
        let hours = self.timetable.each().get(ticket.instrument).is_some_and(Option::is_some);
        if ticket.kind.is_for_auction() && !hours && !self.venue.floors[ticket.instrument].by_bars() {
            return Err(Reason::NoAuction);
        }
        if let TimeInForce::GoodTillDate(end) = ticket.time_in_force
            && end <= now
        {
            return Err(Reason::Late);
        }
        let linked = match ticket.link {
            Link::Alone => true,
            Link::ChildOf { parent } => self.sent.get(parent).is_some_and(|(k, _)| *k == ticket.instrument),
            // The first of a group is there before the others.
            Link::OneCancelsOther { group } => {
                let others = || self.sent.iter().map(|(_, sent)| sent).filter(|(_, order)| order.link == ticket.link);
                (group == id || others().count() > 0) && others().all(|(k, _)| *k == ticket.instrument)
            }
        };
        if !linked {
            return Err(Reason::Unlinked);
        }
        let price = self.known[ticket.instrument].mark.ok_or(Reason::NoPrice)?;
        if ticket.condition == Condition::ReduceOnly {
            return Ok(price);
        }
        if !self.carries(ticket, equity) {
            return Err(Reason::Leverage);
        }
        let requires = self.keeping.as_ref().is_some_and(|keeping| keeping.margin);
        if requires && !self.has_margin_for(ticket) { Err(Reason::Margin) } else { Ok(price) }
    }

    /// Whether the account can carry an order at the prices of now: what is held with all that is under way stays within
    /// the largest leverage, or becomes less.
    fn carries(&self, ticket: &Ticket, equity: f64) -> bool {
        let (mut before, mut after) = (0.0, 0.0);
        for (k, (position, known)) in self.ledger.positions().iter().zip(&self.known).enumerate() {
            let coming = position.quantity + known.working;
            let mark = known.mark.unwrap_or_default();
            let one = self.worth_of_one(k);
            before += (mark * coming).to_f64().abs() * one;
            let then = if k == ticket.instrument { coming + ticket.quantity.signed(ticket.side) } else { coming };
            after += (mark * then).to_f64().abs() * one;
        }
        after <= before || after <= self.setup.settings.max_leverage * equity
    }

    pub(super) fn send(&mut self, id: OrderId, ticket: &Ticket, now: Timestamp, price: Price, sender: Sender) {
        let Ticket { instrument, side, quantity, kind, time_in_force, condition, link } = *ticket;
        let decided = self.decided(ticket, now, price);
        // Laws of commands say when it arrives and how much of a volume it may be; its quantity is its owner's.
        let shaped = self.venue.floors[instrument].shape(&decided);
        let order = shaped.arriving(match sender {
            Sender::Strategy => self.clocks.order(shaped.arrives_at),
            // Who sends it sits at the exchange.
            Sender::Broker => now,
        });
        let child = matches!(link, Link::ChildOf { .. });
        let resting = Resting::new(id, ticket, order, quantity);
        // What the broker closes is as good as closed, and nothing is to be done about it.
        let closes = sender == Sender::Strategy && (child || condition == Condition::ReduceOnly);
        self.known[instrument].opened(OpenOrder { id, side, kind, left: quantity, closes });
        self.enter(id, ticket, now, order.arrives_at, price, sender);
        self.sent.insert(id, (instrument, resting));
        if !child {
            self.agenda.put(order.arrives_at, phase(now, order.arrives_at), Due::Arrive(id));
        }
        match time_in_force {
            TimeInForce::GoodTillDate(end) => self.agenda.put(end, Phase::Before, Due::Expire(id)),
            TimeInForce::Day => {
                if let Some(end) = self.day_ends(instrument, order.arrives_at) {
                    self.agenda.put(end, Phase::Ends, Due::Expire(id));
                }
            }
            _ => {}
        }
    }

    /// An order as it is decided, before any law has shaped it.
    pub(super) fn decided(&self, ticket: &Ticket, now: Timestamp, price: Price) -> InFlight {
        let Ticket { instrument, side, quantity, .. } = *ticket;
        let (about, daily) = (&self.setup.instruments[instrument], &self.daily[instrument]);
        let mid = price.to_f64();
        InFlight {
            side,
            role: Role::Taker,
            quantity: quantity.to_f64(),
            decided_at: now,
            arrives_at: now,
            seen_until: now,
            assumed: mid,
            mid,
            participation_limit: f64::INFINITY,
            multiplier: self.ledger.terms()[instrument].multiplier.get() as f64,
            average_daily_volume: about.average_daily_volume.or_else(|| daily.volume()),
            daily_volatility: about.daily_volatility.or_else(|| daily.volatility()),
            recent_volatility: daily.recent_volatility(),
        }
    }

    /// Enters an order that is sent in the blotter.
    pub(super) fn enter(
        &mut self,
        id: OrderId,
        ticket: &Ticket,
        now: Timestamp,
        arrives_at: Timestamp,
        price: Price,
        sender: Sender,
    ) {
        let Ticket { instrument, side, quantity, kind, time_in_force, .. } = *ticket;
        let known = &self.known[instrument];
        let quote = known.quotes.newest(1).last();
        let (seen_bid, seen_ask) = match &known.book {
            Some(book) => [Side::Buy, Side::Sell].map(|side| book.best(side).map(Price::to_f64)).into(),
            None => (quote.and_then(|quote| quote.bid()), quote.and_then(|quote| quote.ask())),
        };
        self.blotter.orders.push(Order {
            order_id: id.0,
            sender,
            instrument,
            decided_at: now,
            arrives_at,
            kind,
            time_in_force,
            side,
            quantity,
            decision_price: price,
            seen_bid,
            seen_ask,
            status: Status::Unfilled,
            reason: None,
            filled: Quantity::ZERO,
        });
    }

    /// Sends a message about an order.
    fn post(&mut self, id: OrderId, now: Timestamp, due: Due) {
        match self.blotter.place(id).map(|k| self.blotter.orders[k].sender) {
            Some(Sender::Strategy) => {}
            Some(Sender::Broker) => return self.refuse(Reason::NotOwn),
            None => return self.refuse(Reason::UnknownOrder),
        }
        let at = self.clocks.order(now);
        self.agenda.put(at, phase(now, at), due);
    }

    /// Something due at the venue happens.
    pub(super) fn at_venue(&mut self, at: Timestamp, due: Due) -> Result<(), BacktestError> {
        let instrument = match due {
            Due::Arrive(id) => self.arrive(id, at),
            Due::Cancel(id) => self.withdraw(id, at, Reason::Asked),
            Due::Expire(id) => match self.works_till(id, at) {
                Some(end) => {
                    self.agenda.put(end, Phase::Ends, Due::Expire(id));
                    None
                }
                None => self.withdraw(id, at, Reason::TimeInForce),
            },
            Due::Revoke(id) => self.withdraw(id, at, Reason::Liquidated),
            Due::Replace(id, quantity, price) => self.amend(id, quantity, price, at),
            Due::Open(instrument) => {
                self.open_bar(instrument);
                Some(instrument)
            }
            Due::Close(instrument) => {
                self.close_day(instrument, at);
                Some(instrument)
            }
            Due::Action(number) => return self.take_action(number, at, None),
            Due::Redraw(group) => {
                self.redraw(group);
                None
            }
            Due::Notice(_) | Due::Wake => None,
        };
        match instrument {
            Some(instrument) => self.settle(instrument),
            None => Ok(()),
        }
    }

    /// An order arrives, with all that were sent with it.
    fn arrive(&mut self, id: OrderId, at: Timestamp) -> Option<usize> {
        let (instrument, first) = self.sent.remove(id)?;
        let in_group = matches!(first.link, Link::OneCancelsOther { .. });
        let others =
            self.taken_along(|other| other.link == (Link::ChildOf { parent: id }) || (in_group && other.link == first.link));
        self.keep_hours(instrument, at);
        let all = std::iter::once(first).chain(others).map(|order| order.arriving(at));
        self.venue.floors[instrument].arrive(all, at);
        self.expect_open(instrument);
        self.expect_close(instrument, at);
        Some(instrument)
    }

    /// Takes those off the way that go with an order.
    fn taken_along(&mut self, goes: impl Fn(&Resting) -> bool) -> Vec<Resting> {
        let ids: Vec<OrderId> = self.sent.iter().filter(|(_, (_, order))| goes(order)).map(|(id, _)| id).collect();
        ids.into_iter().filter_map(|id| self.sent.remove(id)).map(|(_, order)| order).collect()
    }

    /// An order is taken back, wherever it is.
    pub(super) fn withdraw(&mut self, id: OrderId, at: Timestamp, reason: Reason) -> Option<usize> {
        if let Some((instrument, order)) = self.sent.remove(id) {
            // It was on its way still; what waited for it waits in vain.
            let children = self.taken_along(|other| other.link == (Link::ChildOf { parent: id }));
            self.pend(Outcome { id: order.id, instrument, at, what: What::Ended(reason) }, &[]);
            for child in children {
                self.pend(Outcome { id: child.id, instrument, at, what: What::Ended(Reason::Linked) }, &[]);
            }
            return None;
        }
        let instrument = self.blotter.orders.get(self.blotter.place(id)?)?.instrument;
        let there = self.venue.floors[instrument].cancel(id, at, reason);
        // A time that ends for an order that is over already is nobody's mistake.
        if !there && reason == Reason::Asked {
            self.refuse(Reason::UnknownOrder);
        }
        there.then_some(instrument)
    }

    /// Counts a message about an order that could not be obeyed.
    fn refuse(&mut self, reason: Reason) {
        *self.blotter.rejected.entry(reason).or_default() += 1;
    }

    fn amend(&mut self, id: OrderId, quantity: Option<Quantity>, price: Option<Price>, at: Timestamp) -> Option<usize> {
        let instrument = self.blotter.orders.get(self.blotter.place(id)?)?.instrument;
        let increments = self.setup.increments[instrument];
        let fits = quantity.is_none_or(|q| q >= Quantity::ZERO && increments.holds(q))
            && price.is_none_or(|p| p.0 > 0 && increments.on_tick(p));
        if !fits {
            self.refuse(Reason::OffTick);
            return None;
        }
        self.keep_hours(instrument, at);
        let there = self.venue.floors[instrument].replace(id, quantity, price, at);
        if !there {
            self.refuse(Reason::UnknownOrder);
        }
        there.then_some(instrument)
    }
}

/// Whether a message that leaves at `now` and arrives at `at` meets the data of that instant.
fn phase(now: Timestamp, at: Timestamp) -> Phase {
    if at > now { Phase::Before } else { Phase::AtOnce }
}
