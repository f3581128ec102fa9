//! Matching against what is displayed: quotes, or the whole book, and the trades that are printed.

use crate::market::{
    Condition, DepthAction, DepthChange, OrderKind, Price, Print, Quantity, Quote, Reason, Side, TimeInForce,
};
use crate::sim2real::Timestamp;

use super::floor::{Floor, Offer};
use super::shown::Shown;
use super::taken::Taken;
use super::{LimitFill, Resting, What};

impl Floor {
    /// Order `k` arrives, with what the market shows now.
    pub(super) fn meet_shown(&mut self, k: usize, at: Timestamp) {
        let order = self.resting[k];
        if order.tradable() <= Quantity::ZERO {
            return;
        }
        let Some(touch) = self.touch_price(order.side) else {
            // Nothing to take: what cannot wait is over, the rest waits.
            return self.wait_or_end(k, at);
        };
        let moved = touch.plus(self.moved.by());
        self.resting[k].follow(moved);
        if order.waits() {
            if !self.resting[k].set_off_by(moved) {
                return self.wait_or_end(k, at);
            }
            self.resting[k].set_off();
            self.tell(order.id, at, What::SetOff);
        }
        let order = self.resting[k];
        let takes = match order.kind {
            OrderKind::Market => true,
            OrderKind::Limit { .. } => self.moved.reaches(&order, touch),
            _ => false,
        };
        if takes && order.condition == Condition::PostOnly {
            return self.end(k, at, Reason::PostOnly);
        }
        if takes && let Some(offer) = self.offer_shown(order.side, at) {
            self.take_shown(k, &offer);
        }
        self.wait_or_end(k, at);
    }

    /// Order `k` takes of what is displayed: a market order whatever its size, as diagnosis has it; a limit order what is there
    /// within its limit; one to be filled whole, all or nothing.
    pub(super) fn take_shown(&mut self, k: usize, offer: &Offer) {
        let order = self.resting[k];
        let within = match order.kind {
            OrderKind::Market => Quantity(i64::MAX),
            _ => quantity_of(self.takable(&order)),
        };
        let whole = order.time_in_force != TimeInForce::FillOrKill
            || within >= order.tradable() && self.within_limit(k, offer, order.tradable()) >= order.tradable();
        if whole {
            self.take(k, offer, within);
            let best = self.best_taken(order.side);
            self.taken.from(order.side, best);
        }
    }

    /// What an order finds within its limit [units]. What was taken of it already is not there a second time, though a
    /// replayed market goes on to show it.
    fn takable(&self, order: &Resting) -> f64 {
        let limit = order.limit().map(|limit| limit.minus(self.moved.by()));
        (self.shown.takable(order.side, limit) - self.taken.by(order.side)).max(0.0)
    }

    /// Best price an order of `side` can take, and what is displayed there.
    fn best_taken(&self, side: Side) -> Option<(Price, f64)> {
        let touch = self.shown.touch_price(side)?;
        Some((touch, self.shown.displayed_at(side.opposite(), touch)))
    }

    /// What is left of an order that has met the market: it waits, or is over.
    fn wait_or_end(&mut self, k: usize, at: Timestamp) {
        let order = self.resting[k];
        if order.left <= Quantity::ZERO {
            return;
        }
        let reason = match (order.time_in_force, order.kind) {
            (TimeInForce::FillOrKill, _) => Some(Reason::FillOrKill),
            (TimeInForce::ImmediateOrCancel, _) => Some(Reason::TimeInForce),
            (_, OrderKind::Market) if order.met && !order.waits_for_parent() => Some(order.exhausted()),
            _ => None,
        };
        match reason {
            Some(reason) => self.end(k, at, reason),
            None => self.join(k, at),
        }
    }

    /// A new quote stands.
    #[inline]
    pub fn on_quote(&mut self, quote: &Quote<'_>, at: Timestamp) {
        if matches!(self.shown, Shown::Depth(_)) {
            return;
        }
        let book = quote.book();
        if self.resting.is_empty() && self.taken.is_nothing() {
            self.shown = Shown::Quote(book);
            return;
        }
        let before = std::mem::replace(&mut self.shown, Shown::Quote(book));
        for k in 0..self.resting.len() {
            let order = &mut self.resting[k];
            if let OrderKind::Limit { price } = order.kind {
                let price = self.moved.level(order.side, price);
                let (was, is) = (before.displayed_at(order.side, price), self.shown.displayed_at(order.side, price));
                if was.is_finite() && is.is_finite() {
                    order.place.displayed(self.rules.queue, was, is);
                } else if is.is_finite() {
                    self.come_into_view(k, is, at);
                }
            }
        }
        self.look(at);
    }

    /// A level changes. What an instant brings is complete when [`Floor::look`] is called.
    #[inline]
    pub fn on_depth(&mut self, change: &DepthChange) {
        let Shown::Depth(book) = &mut self.shown else { return };
        if !self.resting.is_empty() {
            for order in &mut self.resting {
                // A snapshot says anew what is there; until it does, nothing is known to have gone.
                if order.side == change.side
                    && let OrderKind::Limit { price } = order.kind
                    && self.moved.level(order.side, price) == change.price
                    && change.action == DepthAction::Set
                {
                    let was = book.size(order.side, change.price);
                    order.place.displayed(self.rules.queue, was, change.size);
                }
            }
        }
        book.apply(change);
    }

    /// All changes of an instant are in: what they let trade does.
    #[inline]
    pub fn look(&mut self, at: Timestamp) {
        if let Shown::Depth(book) = &mut self.shown {
            book.settle();
        }
        if !self.taken.is_nothing() {
            for side in [Side::Buy, Side::Sell] {
                let best = self.best_taken(side);
                self.taken.refresh(side, best);
            }
        }
        if self.resting.is_empty() || !self.is_open() {
            return;
        }
        self.displace(at);
        let (to_buy, to_sell) = (self.touch_price(Side::Buy), self.touch_price(Side::Sell));
        let mut others = false;
        for k in 0..self.resting.len() {
            let order = &self.resting[k];
            if !matches!(order.kind, OrderKind::Limit { .. }) {
                others = true;
                continue;
            }
            // What rests behind the touch, as nearly all does, has nothing to do with it.
            let touch = if order.side == Side::Buy { to_buy } else { to_sell };
            if touch.is_some_and(|touch| self.moved.reaches(order, touch)) {
                self.look_at(k, at);
            }
        }
        // Who rests is met by whoever comes; what the new price sets off comes after that, and finds what is left.
        for k in (0..self.resting.len()).filter(|_| others) {
            if !matches!(self.resting[k].kind, OrderKind::Limit { .. }) {
                self.look_at(k, at);
            }
        }
        // What is over has been told.
        if !self.is_quiet() {
            self.sweep(at);
        }
    }

    /// Order `k` meets what is shown, which reaches its limit if it has one, or would if own orders had not moved the market.
    fn look_at(&mut self, k: usize, at: Timestamp) {
        let order = self.resting[k];
        if order.tradable() <= Quantity::ZERO {
            return;
        }
        match order.kind {
            OrderKind::Limit { price } => {
                let crossed = self.touch_price(order.side);
                let Some(offer) =
                    crossed.filter(|touch| self.moved.accepts(&order, *touch)).and_then(|_| self.offer_at(price, at))
                else {
                    return self.take_moved(k, at);
                };
                // What we took ourselves is shown on; nobody new is there.
                if self.taken.by(order.side) > 0.0 && self.takable(&order) <= 0.0 {
                    return;
                }
                // Whoever shows a price at or beyond our limit has passed us by: we stood before them.
                self.make(k, &offer, order.tradable());
            }
            _ if order.waits() => {
                let Some(price) = self.touch_price(order.side).map(|touch| touch.plus(self.moved.by())) else { return };
                self.resting[k].follow(price);
                if self.resting[k].set_off_by(price) {
                    self.meet_shown(k, at);
                }
            }
            OrderKind::Market => self.meet_shown(k, at),
            _ => {}
        }
    }

    /// The market prints a trade.
    pub fn on_print(&mut self, print: &Print, at: Timestamp) {
        let Ok(price) = Price::nearest(print.price) else { return };
        if matches!(self.shown, Shown::Nothing | Shown::Last(_)) {
            self.shown = Shown::Last(price);
            self.taken = Taken::default();
        }
        self.heed_print(price, print.size, at);
        if self.resting.is_empty() || !self.is_open() {
            return;
        }
        self.displace(at);
        self.line_up(price, at);
        let moved = price.plus(self.moved.by());
        for k in 0..self.resting.len() {
            let order = self.resting[k];
            if order.tradable() <= Quantity::ZERO {
                continue;
            }
            if order.waits() {
                self.resting[k].follow(moved);
                if self.resting[k].set_off_by(moved) {
                    self.resting[k].set_off();
                    self.tell(order.id, at, What::SetOff);
                    self.meet_shown(k, at);
                }
                continue;
            }
            let OrderKind::Limit { price: limit } = order.kind else {
                if order.kind == OrderKind::Market {
                    self.meet_shown(k, at);
                }
                continue;
            };
            // A trade that took from our own side says nothing of whoever rests on the other.
            if print.aggressor == Some(order.side) || !self.moved.accepts(&order, price) {
                continue;
            }
            let reached = if price == self.moved.level(order.side, limit) {
                match (self.rules.limit_fill, &self.shown) {
                    // Without a book nobody knows what stands ahead: the price has to go beyond the limit.
                    (LimitFill::Through, Shown::Last(_)) => 0.0,
                    (LimitFill::Touch, Shown::Last(_)) => print.size,
                    // By-order data say themselves who left the queue.
                    _ if self.by_order => self.resting[k].place.reached(print.size),
                    _ => self.resting[k].place.traded(print.size),
                }
            } else {
                f64::INFINITY
            };
            if let Some(offer) = self.offer_at(limit, at).filter(|_| reached > 0.0) {
                self.make(k, &offer, quantity_of(reached));
            }
        }
        self.sweep(at);
    }

    /// The first trade of an instant at a `price`: of own orders that wait there, for each of which the others stand in the queue as
    /// well, those that have less ahead of them come first, and where that is the same those that came first.
    fn line_up(&mut self, price: Price, at: Timestamp) {
        if self.printed.replace((at, price)) == Some((at, price)) {
            return;
        }
        if let [alone] = &mut self.resting[..] {
            return alone.place.begin_trades(0.0, self.by_order);
        }
        for side in [Side::Buy, Side::Sell] {
            let there = |order: &Resting| match order.kind {
                OrderKind::Limit { price: limit } if order.side == side && order.tradable() > Quantity::ZERO => {
                    self.moved.level(side, limit) == price
                }
                _ => false,
            };
            let mut own: Vec<usize> = (0..self.resting.len()).filter(|k| there(&self.resting[*k])).collect();
            own.sort_by(|a, b| self.resting[*a].place.in_front().total_cmp(&self.resting[*b].place.in_front()));
            let mut ahead = 0.0;
            for k in own {
                self.resting[k].place.begin_trades(ahead, self.by_order);
                ahead += self.allowed(k).to_f64();
            }
        }
    }

    /// The best price recorded that an order of `side` can take.
    pub(super) fn touch_price(&self, side: Side) -> Option<Price> {
        self.shown.touch_price(side)
    }

    /// What an order of `side` can take now.
    pub(super) fn offer_shown(&self, side: Side, at: Timestamp) -> Option<Offer> {
        let reference = self.shown.reference(self.rules.reference, side)?;
        let mid = self.shown.mid().unwrap_or(reference);
        let book = self.shown.book(at);
        let volume = book.displayed(side);
        Some(Offer { at, reference, mid, book, volume, row: self.row(), band: self.band(mid) })
    }

    /// What a resting order is taken at.
    fn offer_at(&self, limit: Price, at: Timestamp) -> Option<Offer> {
        let mid = self.shown.mid().unwrap_or(limit.to_f64());
        let book = self.shown.book(at);
        Some(Offer {
            at,
            reference: limit.to_f64(),
            mid,
            book,
            volume: f64::INFINITY,
            row: self.row(),
            band: self.band(mid),
        })
    }

    /// Lowest and highest price displayed on the inside.
    fn band(&self, mid: f64) -> [Price; 2] {
        let mid = Price::nearest(mid).unwrap_or_default();
        let of = |side| self.shown.touch_price(side).unwrap_or(mid);
        [of(Side::Sell).min(mid), of(Side::Buy).max(mid)]
    }

    pub(super) fn row(&self) -> usize {
        match self.shown {
            Shown::Depth(_) => self.rows[3],
            Shown::Last(_) => self.rows[2],
            _ => self.rows[1],
        }
    }
}

/// A size as a quantity, as large as can be where it is not known.
fn quantity_of(size: f64) -> Quantity {
    Quantity::nearest(size.min(9e9)).unwrap_or(Quantity::ZERO)
}
