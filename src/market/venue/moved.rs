//! The market as own orders have moved it: what those meet in it that wait with a limit or a trigger.
//!
//! A replayed market shows prices in which nobody has traded but others. Laws of impact that lasts say by how much own orders have
//! moved them; orders that take pay that. For orders that wait the recorded prices are moved by as much, in whole ticks, the nearest:
//!
//! - **Against an order** (one to buy after purchases) it waits further from the market: it is filled where the recorded price
//!   comes to its limit less the move, and stands in the queue that is displayed there. Where that is another level than it was,
//!   it joins the end of the queue anew.
//! - **In its favour** (one to sell after purchases) nobody comes to it whom the data know of: where the move alone brings the
//!   market to its limit it takes there, pays what laws ask of those who take, and moves the market back. It is filled as far
//!   as its limit allows then. So no round trip gains from own impact, be its legs limit orders or not; for the same
//!   reason no limit order is filled beyond the quantity at which what it moves itself has used up its limit.
//! - **Triggers** are set off by the moved price either way: what is set off takes, and pays.
//!
//! On bars a bar is moved as the market stands when it opens. Strategies are shown what was recorded.

use crate::market::{Book, Condition, InFlight, Met, Price, Quantity, Role, Side};
use crate::sim2real::Timestamp;

use super::Resting;
use super::floor::{Floor, Offer};
use super::queue::Place;

/// How far own orders have moved the market, where laws say so.
#[derive(Debug, Clone, Default)]
pub(in crate::market) struct Moved {
    /// Numbers of the laws that say so, among those that act on prices.
    laws: Vec<usize>,
    /// By how much it is above the recorded one: whole ticks.
    by: Price,
}

impl Moved {
    /// By what the laws of these numbers say.
    pub fn by_laws(laws: Vec<usize>) -> Self {
        Self { laws, ..Self::default() }
    }

    /// Whether no law says so: the market is the recorded one.
    pub fn is_never(&self) -> bool {
        self.laws.is_empty()
    }

    /// By how much the market is above the recorded one: whole ticks.
    pub fn by(&self) -> Price {
        self.by
    }

    /// The recorded price at which an order of `side` waits whose limit is `limit`: never nearer than the limit itself.
    #[inline]
    pub fn level(&self, side: Side, limit: Price) -> Price {
        match side {
            Side::Buy => limit.minus(self.by.max(Price(0))),
            Side::Sell => limit.minus(self.by.min(Price(0))),
        }
    }

    /// Whether the recorded `price` lets `order` trade.
    #[inline]
    pub fn accepts(&self, order: &Resting, price: Price) -> bool {
        order.limit().is_none_or(|limit| order.side.accepts(price, self.level(order.side, limit)))
    }

    /// Whether it does, or what was moved alone brings it to the limit of `order`, which may take then.
    pub fn reaches(&self, order: &Resting, price: Price) -> bool {
        let moved = price.plus(self.by);
        self.accepts(order, price)
            || order.condition != Condition::PostOnly && order.limit().is_some_and(|limit| order.side.accepts(moved, limit))
    }
}

impl Floor {
    /// Moves the market that orders wait in to where own orders have moved it by `at`.
    #[inline]
    pub(super) fn displace(&mut self, at: Timestamp) {
        if !self.moved.laws.is_empty()
            && let Some(mid) = self.shown.mid()
        {
            self.displace_by(at, mid);
        }
    }

    /// The same where the recorded price is `mid` [currency].
    pub(super) fn displace_by(&mut self, at: Timestamp, mid: f64) {
        if self.moved.laws.is_empty() || self.resting.is_empty() || self.rules.shows_own {
            return;
        }
        // Laws say it in bps of the mid: any order would be told the same.
        let order = InFlight { mid, ..self.resting[0].order };
        let met = Met::at(Book::at_price(at, mid), mid, f64::INFINITY);
        let by = self.increments.whole_ticks(self.ask(&order, met, at).displaced);
        let before = self.moved.clone();
        self.moved.by = by;
        // On bars there are no queues, and an order that waits for its parent stands in none.
        for k in 0..if self.by_bars { 0 } else { self.resting.len() } {
            let order = &self.resting[k];
            let level = |moved: &Moved| order.limit().map(|limit| moved.level(order.side, limit));
            if order.tradable() > Quantity::ZERO && level(&before) != level(&self.moved) {
                self.resting[k].place = Place::default();
                self.join(k, at);
            }
        }
    }

    /// Order `k`, which waits, takes where what own orders have moved alone has brought the market to its limit.
    pub(super) fn take_moved(&mut self, k: usize, at: Timestamp) {
        let order = self.resting[k];
        let touch = self.touch_price(order.side).filter(|_| self.moved.by != Price(0));
        if touch.is_some_and(|touch| self.moved.reaches(&order, touch))
            && let Some(offer) = self.offer_shown(order.side, at)
        {
            self.take_shown(k, &offer);
        }
    }

    /// The most of `quantity` that order `k` can take from `offer` before what it moves itself has used up its limit.
    pub(super) fn within_limit(&mut self, k: usize, offer: &Offer, quantity: Quantity) -> Quantity {
        let order = self.resting[k];
        let (Some(limit), false) = (order.limit(), self.moved.laws.is_empty()) else { return quantity };
        let Some(touch) = offer.book.touch(order.side) else { return quantity };
        let room = order.side.sign() * (limit.to_f64() - touch) + 1e-9;
        let lot = self.increments.lot().0;
        // Lots that fit, and lots that do not.
        let (mut fit, mut most) = (0, quantity.0 / lot + 1);
        let mut next = most - 1;
        while fit < next {
            if self.moves(k, offer, Quantity(next * lot)) <= room {
                fit = next;
            } else {
                most = next;
            }
            next = fit + (most - fit) / 2;
        }
        Quantity(fit * lot)
    }

    /// What the laws of lasting impact would add to the price of `quantity` of order `k` [currency]: nothing happens.
    fn moves(&mut self, k: usize, offer: &Offer, quantity: Quantity) -> f64 {
        let before = (self.run.clone(), self.messages);
        let arriving = InFlight { quantity: quantity.to_f64(), ..self.resting[k].order.as_a(Role::Taker) };
        self.meet(&arriving, offer);
        (self.run, self.messages) = before;
        self.moved.laws.iter().filter_map(|law| self.concessions.get(*law)).sum()
    }
}
