//! Matching against bars: at the open, and then on the way within the bar.

use crate::market::{Bar, Book, Condition, OrderKind, Price, Quantity, Reason, Side, TimeInForce};
use crate::sim2real::Timestamp;

use super::floor::{Floor, Offer};
use super::taken::Taken;
use super::{LimitFill, Resting};

impl Floor {
    /// Whether an order waits that a bar opening at `open_at` may fill.
    pub fn awaits_open(&self, open_at: Timestamp) -> bool {
        self.resting.iter().any(|order| order.from <= open_at)
    }

    /// The bar opens: orders that arrived by then meet its open, the first price after their decision.
    pub fn on_open(&mut self, bar: &Bar, first_of_session: bool) {
        self.taken = Taken::of_bars();
        let at = bar.open_at;
        let offer = self.offer(bar, at, bar.open);
        self.displace_by(at, bar.open.to_f64());
        let open = bar.open.plus(self.moved.by());
        for k in 0..self.resting.len() {
            let order = &mut self.resting[k];
            if order.from > at || order.tradable() <= Quantity::ZERO {
                continue;
            }
            order.follow(open);
            if order.waits() && order.set_off_by(open) {
                order.set_off();
                let id = order.id;
                self.tell(id, at, super::What::SetOff);
            }
            let order = &self.resting[k];
            let takes = match order.kind {
                OrderKind::Market => true,
                OrderKind::Limit { .. } => self.moved.reaches(order, bar.open),
                OrderKind::MarketOnOpen => first_of_session,
                OrderKind::LimitOnOpen { .. } => first_of_session && self.moved.reaches(order, bar.open),
                _ => false,
            };
            self.meet_at(k, &offer, takes, first_of_session);
        }
        self.sweep(at);
    }

    /// What becomes of an order when it has, or has not, been offered to the market.
    fn meet_at(&mut self, k: usize, offer: &Offer, takes: bool, first_of_session: bool) {
        let (tradable, time_in_force) = (self.resting[k].tradable(), self.resting[k].time_in_force);
        if takes && self.resting[k].condition == Condition::PostOnly {
            return self.end(k, offer.at, Reason::PostOnly);
        }
        // With bars all the volume there is stands at the price: a cap alone can leave something over.
        let whole = time_in_force != TimeInForce::FillOrKill || {
            let room = self.room(k, offer);
            room >= tradable && self.within_limit(k, offer, room) >= tradable
        };
        if takes && whole {
            self.take(k, offer, tradable);
        }
        let order = &self.resting[k];
        if order.left <= Quantity::ZERO {
            return;
        }
        let over = match (order.kind, order.time_in_force) {
            (_, TimeInForce::FillOrKill) => Some(Reason::FillOrKill),
            (_, TimeInForce::ImmediateOrCancel) => Some(Reason::TimeInForce),
            // A market order takes once; what the volume does not allow is cancelled.
            (OrderKind::Market, _) if takes && !order.waits_for_parent() => Some(order.exhausted()),
            (OrderKind::MarketOnOpen | OrderKind::LimitOnOpen { .. }, _) if first_of_session => Some(Reason::TimeInForce),
            _ => None,
        };
        if let Some(reason) = over {
            self.end(k, offer.at, reason);
        }
    }

    /// What the cap on participation leaves for an order at an offer.
    fn room(&self, k: usize, offer: &Offer) -> Quantity {
        let cap = self.resting[k].order.participation_limit;
        if cap.is_infinite() {
            return self.allowed(k);
        }
        let left = (cap * offer.volume - self.taken.by(self.resting[k].side)).max(0.0);
        Quantity::nearest(left.min(9e9)).map_or(Quantity::ZERO, |q| self.increments.whole_lots(q)).min(self.allowed(k))
    }

    /// The bar is over: what rested through it meets the prices on its way.
    ///
    /// Only orders that had arrived when it opened take part: of a bar nobody knows what came after an instant within it. What
    /// is filled carries the time at which the bar could be known, the latest it can have been.
    ///
    /// The last bar of a session `closes_for` the orders that arrived by that instant.
    pub fn on_bar(&mut self, bar: &Bar, closes_for: Option<Timestamp>) {
        let at = bar.known_at;
        if !self.resting.iter().any(|order| order.from <= closes_for.unwrap_or(bar.open_at)) {
            return;
        }
        // What came within the bar is not known in its order: it is moved as the market stood when it opened.
        self.displace_by(bar.open_at, bar.open.to_f64());
        if self.awaits_open(bar.open_at) {
            let way = self.way(bar);
            for leg in way.windows(2) {
                self.walk(bar, leg[0], leg[1], at);
            }
        }
        if let Some(by) = closes_for {
            self.close(bar, by, at);
        }
        self.sweep(at);
    }

    /// The way within the bar, which is counted where its order decides.
    fn way(&mut self, bar: &Bar) -> [Price; 4] {
        let mut entry = [false; 2];
        let (mut above, mut below) = (false, false);
        for order in self.resting.iter().filter(|o| o.from <= bar.open_at) {
            entry[usize::from(order.side == Side::Sell)] |= order.tradable() > Quantity::ZERO;
            for price in [self.level_of(order), self.trigger_of(order)].into_iter().flatten() {
                above |= price > bar.open && price <= bar.high;
                below |= price < bar.open && price >= bar.low;
            }
        }
        self.ambiguous += usize::from(above && below);
        let held = match self.held.0.signum() {
            1 => Some(Side::Buy),
            -1 => Some(Side::Sell),
            _ => None,
        };
        let entry = match entry {
            [true, false] => Some(Side::Buy),
            [false, true] => Some(Side::Sell),
            _ => None,
        };
        self.rules.intrabar.way(bar, held, entry)
    }

    /// The price goes straight from one price to another: what it passes is filled or set off in the order in which it is
    /// passed.
    fn walk(&mut self, bar: &Bar, from: Price, to: Price, at: Timestamp) {
        let mut here = from;
        // Each turn fills, sets off or ends an order at a price no earlier on the way than the last.
        while let Some((k, price)) = self.next_passed(bar, here, to) {
            here = price;
            let order = &mut self.resting[k];
            let before = (order.left, order.kind);
            let sets_off = order.waits();
            if sets_off {
                order.set_off();
                let id = order.id;
                self.tell(id, at, super::What::SetOff);
            }
            let offer = self.offer(bar, at, price);
            let order = &self.resting[k];
            // Where the market is beyond its limit already, an order that is set off or released here takes what there is.
            let (accepts, beyond) = (self.moved.accepts(order, price), self.level_of(order) != Some(price));
            match order.kind {
                OrderKind::Market => self.meet_at(k, &offer, true, false),
                OrderKind::Limit { .. } if accepts && (sets_off || beyond) => self.meet_at(k, &offer, true, false),
                // It waits from now on for the market to come to its limit.
                OrderKind::Limit { .. } if sets_off => {}
                _ => {
                    let room = self.room(k, &offer);
                    self.make(k, &offer, room);
                    let (side, left) = (self.resting[k].side, self.resting[k].left);
                    self.taken.add(side, (before.0 - left).to_f64());
                    self.resting[k].met = true;
                }
            }
            if (self.resting[k].left, self.resting[k].kind) == before {
                // The cap has been used up, or there is nothing to close: it waits for the next bar.
                self.resting[k].from = bar.open_at + 1;
            }
        }
        let moved = to.plus(self.moved.by());
        for order in &mut self.resting {
            if order.from <= bar.open_at {
                order.follow(moved);
            }
        }
    }

    /// The recorded price at which an order waits that has a limit.
    fn level_of(&self, order: &Resting) -> Option<Price> {
        order.limit().map(|limit| self.moved.level(order.side, limit))
    }

    /// The recorded price that sets an order off, where it waits for one.
    fn trigger_of(&self, order: &Resting) -> Option<Price> {
        order.trigger().map(|trigger| trigger.minus(self.moved.by()))
    }

    /// The first order that the way from `from` to `to` fills or sets off, and the price at which it does.
    fn next_passed(&self, bar: &Bar, from: Price, to: Price) -> Option<(usize, Price)> {
        let passes = |order: &Resting| {
            if order.from > bar.open_at || order.tradable() <= Quantity::ZERO {
                return None;
            }
            let (price, far) = match order.kind {
                OrderKind::Market => return Some(from),
                OrderKind::Limit { price } => {
                    let level = self.moved.level(order.side, price);
                    (level, self.through(order.side, level))
                }
                _ if order.waits() => (self.trigger_of(order)?, self.trigger_of(order)?),
                _ => return None,
            };
            let rising = to >= from;
            // A stop to buy and a limit to sell are met from below.
            let met_from_below = (order.side == Side::Buy) == order.waits();
            match (rising, met_from_below) {
                (true, true) if from <= far && far <= to => Some(price.max(from)),
                (false, false) if to <= far && far <= from => Some(price.min(from)),
                // Where it stands already it is met at once: a child that was released here.
                (_, true) if from >= far => Some(from),
                (_, false) if from <= far => Some(from),
                _ => None,
            }
        };
        let passed = self.resting.iter().enumerate().filter_map(|(k, order)| Some((k, passes(order)?)));
        passed.min_by_key(|(k, price)| ((price.0 - from.0).abs(), *k))
    }

    /// The price the market has to reach for a limit order to be filled.
    fn through(&self, side: Side, limit: Price) -> Price {
        match (self.rules.limit_fill, side) {
            (LimitFill::Touch, _) => limit,
            (LimitFill::Through, Side::Buy) => limit.minus(self.increments.tick()),
            (LimitFill::Through, Side::Sell) => limit.plus(self.increments.tick()),
        }
    }

    /// Orders for the close meet the last price of the session.
    fn close(&mut self, bar: &Bar, by: Timestamp, at: Timestamp) {
        let offer = self.offer(bar, at, bar.close);
        for k in 0..self.resting.len() {
            let order = self.resting[k];
            let on_close = matches!(order.kind, OrderKind::MarketOnClose | OrderKind::LimitOnClose { .. });
            if !on_close || order.from > by {
                continue;
            }
            if self.moved.reaches(&order, bar.close) {
                self.take(k, &offer, order.tradable());
            }
            if self.resting[k].left > Quantity::ZERO {
                self.end(k, at, Reason::TimeInForce);
            }
        }
    }

    pub(super) fn offer(&self, bar: &Bar, at: Timestamp, price: Price) -> Offer {
        let mid = price.to_f64();
        let book = Book::at_price(at, mid);
        Offer { at, reference: mid, mid, book, volume: bar.volume, row: self.rows[0], band: [bar.low, bar.high] }
    }
}
