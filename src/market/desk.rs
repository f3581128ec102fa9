//! The desk: it checks what a strategy asks for, sends it, and books what becomes of it.

use crate::sim2real::Timestamp;

use super::agenda::{Due, Phase};
use super::backtest::BacktestError;
use super::session::Session;
use super::venue::{Filled, Outcome, Resting, What};
use super::{
    Cash, Condition, Fill, FillCost, InFlight, Link, News, Notice, OpenOrder, Order, OrderId, OrderKind, Price, Quantity,
    Reason, Rejection, Request, Role, Status, Ticket, TimeInForce, Trade, Why,
};

/// Length of a day of UTC [ns].
const DAY: i64 = 86_400 * Timestamp::NANOS;

/// What became of an order, until it is known.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pending {
    outcome: Outcome,
    /// First of its terms, among those of all fills under way.
    terms: usize,
}

impl Session<'_> {
    /// Sends what the strategy asked for, or refuses it.
    pub(super) fn send_all(&mut self, now: Timestamp, equity: Cash) {
        let mut orders = std::mem::take(&mut self.orders);
        for request in orders.requests() {
            match *request {
                Request::Submit(id, ticket) => match self.admit(id, &ticket, now, equity.to_f64()) {
                    Ok(price) => self.send(id, &ticket, now, price),
                    Err(reason) => {
                        let Ticket { instrument, side, quantity, .. } = ticket;
                        self.blotter.reject(Rejection { decided_at: now, instrument, side, quantity, reason });
                    }
                },
                Request::Cancel(id) => self.post(id, now, Due::Cancel(id)),
                Request::Replace { id, quantity, price } => self.post(id, now, Due::Replace(id, quantity, price)),
                Request::Wake(time) => self.agenda.put(time.max(now), Phase::Notices, Due::Wake),
            }
        }
        orders.clear();
        self.orders = orders;
    }

    /// The price at decision of an order that may be sent, or why it may not.
    fn admit(&self, id: OrderId, ticket: &Ticket, now: Timestamp, equity: f64) -> Result<Price, Reason> {
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
        let at_auction = matches!(
            ticket.kind,
            OrderKind::MarketOnOpen
                | OrderKind::LimitOnOpen { .. }
                | OrderKind::MarketOnClose
                | OrderKind::LimitOnClose { .. }
        );
        if at_auction && !self.venue.floors[ticket.instrument].by_bars() {
            return Err(Reason::NoAuction);
        }
        if let TimeInForce::GoodTillDate(end) = ticket.time_in_force
            && end <= now
        {
            return Err(Reason::Late);
        }
        let linked = match ticket.link {
            Link::Alone => true,
            Link::ChildOf { parent } => self.sent.get(&parent).is_some_and(|(k, _)| *k == ticket.instrument),
            // The first of a group is there before the others.
            Link::OneCancelsOther { group } => {
                let others = || self.sent.values().filter(|(_, order)| order.link == ticket.link);
                (group == id || others().count() > 0) && others().all(|(k, _)| *k == ticket.instrument)
            }
        };
        if !linked {
            return Err(Reason::Unlinked);
        }
        let price = self.known[ticket.instrument].mark.ok_or(Reason::NoPrice)?;
        if ticket.condition == Condition::ReduceOnly || self.carries(ticket, equity) {
            Ok(price)
        } else {
            Err(Reason::Leverage)
        }
    }

    /// Whether the account can carry an order at the prices of now: what is held with all that is under way stays within
    /// the largest leverage, or becomes less.
    fn carries(&self, ticket: &Ticket, equity: f64) -> bool {
        let (mut before, mut after) = (0.0, 0.0);
        for (k, (position, known)) in self.ledger.positions().iter().zip(&self.known).enumerate() {
            let coming = position.quantity + known.working;
            let mark = known.mark.unwrap_or_default();
            before += (mark * coming).to_f64().abs();
            let then = if k == ticket.instrument { coming + ticket.quantity.signed(ticket.side) } else { coming };
            after += (mark * then).to_f64().abs();
        }
        after <= before || after <= self.setup.settings.max_leverage * equity
    }

    fn send(&mut self, id: OrderId, ticket: &Ticket, now: Timestamp, price: Price) {
        let Ticket { instrument, side, quantity, kind, time_in_force, condition, link } = *ticket;
        let (about, daily) = (&self.setup.instruments[instrument], &self.daily[instrument]);
        let mid = price.to_f64();
        let decided = InFlight {
            side,
            role: Role::Taker,
            quantity: quantity.to_f64(),
            decided_at: now,
            arrives_at: now,
            assumed: mid,
            mid,
            participation_limit: f64::INFINITY,
            average_daily_volume: about.average_daily_volume.or_else(|| daily.volume()),
            daily_volatility: about.daily_volatility.or_else(|| daily.volatility()),
        };
        let shaped = self.venue.floors[instrument].accept(&decided);
        let order = shaped.arriving(self.clocks.order(shaped.arrives_at));
        // A law may have cut the quantity down: the rest is not sent.
        let left = self.lots_of(instrument, order.quantity, quantity);
        let child = matches!(link, Link::ChildOf { .. });
        let resting = Resting::new(id, ticket, order, left);
        let known = &mut self.known[instrument];
        let quote = known.quotes.newest(1).last();
        let (seen_bid, seen_ask) = match &known.book {
            Some(book) => [super::Side::Buy, super::Side::Sell].map(|side| book.best(side).map(Price::to_f64)).into(),
            None => (quote.and_then(|quote| quote.bid()), quote.and_then(|quote| quote.ask())),
        };
        known.opened(OpenOrder { id, side, kind, left: quantity, closes: child || condition == Condition::ReduceOnly });
        self.blotter.orders.push(Order {
            order_id: id.0,
            instrument,
            decided_at: now,
            arrives_at: order.arrives_at,
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
        self.sent.insert(id, (instrument, resting));
        if !child {
            self.agenda.put(order.arrives_at, phase(now, order.arrives_at), Due::Arrive(id));
        }
        match time_in_force {
            TimeInForce::GoodTillDate(end) => self.agenda.put(end, Phase::Before, Due::Expire(id)),
            TimeInForce::Day => {
                let end = (order.arrives_at.0.div_euclid(DAY) + 1).saturating_mul(DAY);
                self.agenda.put(Timestamp(end), Phase::Ends, Due::Expire(id));
            }
            _ => {}
        }
    }

    /// A model's quantity in whole lots; what is whole stays whole.
    fn lots_of(&self, instrument: usize, model: f64, whole: Quantity) -> Quantity {
        if model >= whole.to_f64() {
            return whole;
        }
        let increments = self.setup.increments[instrument];
        Quantity::nearest(model.max(0.0)).map_or(whole, |quantity| increments.whole_lots(quantity))
    }

    /// Sends a message about an order.
    fn post(&mut self, id: OrderId, now: Timestamp, due: Due) {
        if self.blotter.place(id).is_none() {
            *self.blotter.rejected.entry(Reason::UnknownOrder).or_default() += 1;
            return;
        }
        let at = self.clocks.order(now);
        self.agenda.put(at, phase(now, at), due);
    }

    /// Something due at the venue happens.
    pub(super) fn at_venue(&mut self, at: Timestamp, due: Due) -> Result<(), BacktestError> {
        let instrument = match due {
            Due::Arrive(id) => self.arrive(id, at),
            Due::Cancel(id) => self.withdraw(id, at, Reason::Asked),
            Due::Expire(id) => self.withdraw(id, at, Reason::TimeInForce),
            Due::Replace(id, quantity, price) => self.amend(id, quantity, price, at),
            Due::Open(instrument) => {
                self.open_bar(instrument);
                Some(instrument)
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
        let (instrument, first) = self.sent.get(&id).copied()?;
        let together = |other: &Resting| {
            other.id == id
                || other.link == (Link::ChildOf { parent: id })
                || (other.link == first.link && matches!(first.link, Link::OneCancelsOther { .. }))
        };
        let ids: Vec<OrderId> = self.sent.values().filter(|(_, other)| together(other)).map(|(_, other)| other.id).collect();
        let orders: Vec<Resting> = ids.iter().filter_map(|id| self.sent.remove(id)).map(|(_, order)| order).collect();
        let orders = orders.into_iter().map(|order| Resting { order: order.order.arriving(at), ..order }).collect();
        self.venue.floors[instrument].arrive(orders, at);
        self.expect_open(instrument);
        Some(instrument)
    }

    /// An order is taken back, wherever it is.
    fn withdraw(&mut self, id: OrderId, at: Timestamp, reason: Reason) -> Option<usize> {
        if let Some((instrument, order)) = self.sent.remove(&id) {
            // It was on its way still; what waited for it waits in vain.
            let children: Vec<OrderId> =
                self.sent.values().filter(|(_, o)| o.link == (Link::ChildOf { parent: id })).map(|(_, o)| o.id).collect();
            self.pend(Outcome { id: order.id, instrument, at, what: What::Ended(reason) }, &[]);
            for child in children {
                self.sent.remove(&child);
                self.pend(Outcome { id: child, instrument, at, what: What::Ended(Reason::Linked) }, &[]);
            }
            return None;
        }
        let instrument = self.blotter.orders.get(self.blotter.place(id)?)?.instrument;
        self.venue.floors[instrument].cancel(id, at, reason).then_some(instrument)
    }

    fn amend(&mut self, id: OrderId, quantity: Option<Quantity>, price: Option<Price>, at: Timestamp) -> Option<usize> {
        let instrument = self.blotter.orders.get(self.blotter.place(id)?)?.instrument;
        let increments = self.setup.increments[instrument];
        let fits = quantity.is_none_or(|q| q >= Quantity::ZERO && increments.holds(q))
            && price.is_none_or(|p| p.0 > 0 && increments.on_tick(p));
        if !fits {
            *self.blotter.rejected.entry(Reason::OffTick).or_default() += 1;
            return None;
        }
        self.venue.floors[instrument].replace(id, quantity, price, at).then_some(instrument)
    }

    /// Takes what happened on a floor, which its owner will know in a while.
    pub(super) fn settle(&mut self, instrument: usize) -> Result<(), BacktestError> {
        if self.venue.floors[instrument].is_quiet() {
            return Ok(());
        }
        let (mut outcomes, mut terms) = (std::mem::take(&mut self.outcomes), std::mem::take(&mut self.terms));
        self.venue.floors[instrument].drain(&mut outcomes, &mut terms);
        let count = self.venue.conceding.len();
        let mut fills = 0;
        for outcome in &outcomes {
            let mut own: &[f64] = &[];
            if let What::Filled(filled) = outcome.what {
                self.check_price(outcome, &filled)?;
                own = &terms[fills * count..(fills + 1) * count];
                fills += 1;
            }
            self.pend(*outcome, own);
        }
        outcomes.clear();
        terms.clear();
        (self.outcomes, self.terms) = (outcomes, terms);
        Ok(())
    }

    fn check_price(&self, outcome: &Outcome, filled: &Filled) -> Result<(), BacktestError> {
        if filled.price.0 > 0 && filled.model_price.is_finite() {
            return Ok(());
        }
        let symbol = self.setup.instruments[outcome.instrument].symbol.clone();
        Err(BacktestError::ModelPrice { order_id: outcome.id.0, symbol, time: outcome.at, price: filled.model_price })
    }

    /// Sends word of what became of an order.
    fn pend(&mut self, outcome: Outcome, terms: &[f64]) {
        let at = self.clocks.response(outcome.at);
        let pending = Pending { outcome, terms: self.pending_terms.len() };
        self.pending_terms.extend_from_slice(terms);
        self.pending.push(Some(pending));
        self.agenda.put(at, Phase::Notices, Due::Notice(self.pending.len() - 1));
        self.under_way += 1;
    }

    /// What became of an order is known: it is booked.
    pub(super) fn note(&mut self, place: usize) -> Result<Option<Notice>, BacktestError> {
        let Some(Pending { outcome, terms }) = self.pending.get_mut(place).and_then(Option::take) else { return Ok(None) };
        let count = self.venue.conceding.len();
        let Outcome { id, instrument, at, what } = outcome;
        let Some(k) = self.blotter.place(id) else { return Ok(None) };
        let news = match what {
            What::Filled(filled) => {
                self.charge_held(instrument, at)?;
                self.book(k, &outcome, &filled)?;
                let own: Vec<f64> = self.pending_terms[terms..terms + count].to_vec();
                for (mechanism, term) in self.venue.conceding.iter().zip(&own) {
                    *self.blotter.concessions.entry(mechanism).or_default() += term * filled.quantity.to_f64();
                }
                self.blotter.terms.extend(own);
                let order = &self.blotter.orders[k];
                let left = order.quantity - order.filled;
                News::Filled { quantity: filled.quantity, price: filled.price, role: filled.role, left }
            }
            What::Ended(reason) => {
                let order = &mut self.blotter.orders[k];
                (order.status, order.reason) = (Status::ended(reason), Some(reason));
                self.known[instrument].closed(id);
                News::Ended(reason)
            }
            What::SetOff => News::SetOff,
            What::Replaced { quantity, kind } => {
                let order = &mut self.blotter.orders[k];
                (order.quantity, order.kind) = (quantity, kind);
                let left = quantity - order.filled;
                self.known[instrument].changed(id, left, kind);
                News::Replaced
            }
        };
        self.under_way -= 1;
        if self.under_way == 0 {
            self.pending.clear();
            self.pending_terms.clear();
        }
        let side = self.blotter.orders[k].side;
        Ok(Some(Notice { order_id: id, instrument, side, at, news }))
    }

    /// Books a fill of order `k`.
    fn book(&mut self, k: usize, outcome: &Outcome, filled: &Filled) -> Result<(), BacktestError> {
        let Outcome { id, instrument, at, .. } = *outcome;
        let order = &mut self.blotter.orders[k];
        let symbol = &self.setup.instruments[instrument].symbol;
        let money = |error| BacktestError::Money { place: format!("order {} for {symbol} at {at}", id.0), error };
        let (side, quantity, price) = (order.side, filled.quantity, filled.price);
        let fee = Cash::nearest(filled.fee).map_err(money)?;
        let closes = self.ledger.positions()[instrument].quantity.signed(side) < Quantity::ZERO;
        let realised = self.ledger.book(&Trade { instrument, side, price, quantity, fee }).map_err(money)?;
        order.filled = order.filled + quantity;
        if order.filled >= order.quantity {
            (order.status, order.reason) = (Status::Filled, None);
        }
        let loss = |from: f64, to: f64| side.sign() * (to - from) * quantity.to_f64();
        let cost = FillCost {
            timing: loss(order.decision_price.to_f64(), filled.mid),
            spread_and_impact: loss(filled.mid, filled.model_price),
            rounding: loss(filled.model_price, price.to_f64()),
        };
        self.known[instrument].less(id, quantity);
        let why = Why {
            role: filled.role,
            data: self.data_of[instrument],
            row: filled.row,
            met: filled.mid,
            band: filled.band,
            queued_behind: filled.queued_behind,
        };
        self.blotter.fills.push(Fill {
            fill_id: self.blotter.fills.len() as u64 + 1,
            order_id: id.0,
            instrument,
            filled_at: at,
            side,
            quantity,
            price,
            fee,
            realised: closes.then_some(realised),
            cost,
            why,
        });
        Ok(())
    }
}

/// Whether a message that leaves at `now` and arrives at `at` meets the data of that instant.
fn phase(now: Timestamp, at: Timestamp) -> Phase {
    if at > now { Phase::Before } else { Phase::AtOnce }
}
