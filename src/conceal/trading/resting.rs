//! Orders that rest: their places in queues, and what fills them.

use super::client::Intent;
use super::effect::Effect;
use super::executed::{Piece, Shown};
use super::tape::Trade;

/// An order at the best price of its own side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Resting {
    number: usize,
    buys: bool,
    limit: i64,
    left: f64,
    /// What is displayed ahead of it [units]; more stands there where effects say so.
    ahead: f64,
    /// How much more stands ahead than one would think, as a standard normal number.
    luck: f64,
    until: f64,
}

impl Resting {
    /// Order `number` at `limit` [ticks], behind what is `displayed` there [units], until a time [s after the open].
    pub fn new(number: usize, order: &Intent, limit: i64, displayed: f64, until: f64) -> Self {
        let (buys, left) = (order.buys, order.quantity);
        Self { number, buys, limit, left, ahead: displayed, luck: order.normals[2], until }
    }
}

/// The orders that rest.
#[derive(Debug, Clone)]
pub(super) struct Waiting {
    orders: Vec<Resting>,
    /// What stands ahead beside what is displayed, as a part of that, and how much that varies.
    unseen: (f64, f64),
}

impl Waiting {
    pub fn new(effects: &[Effect]) -> Self {
        let unseen = effects.iter().find_map(|effect| match effect {
            Effect::Queue { ahead, wobble } => Some((*ahead, *wobble)),
            _ => None,
        });
        Self { orders: Vec::new(), unseen: unseen.unwrap_or_default() }
    }

    /// One more waits.
    pub fn join(&mut self, mut order: Resting) {
        order.ahead *= 1.0 + self.unseen.0 * (self.unseen.1 * order.luck).exp();
        self.orders.push(order);
    }

    /// What is filled because the market now stands at or beyond the limits.
    pub fn crossed(&mut self, time: f64, now: &Shown) -> Vec<(usize, Piece)> {
        self.orders.retain(|order| order.until > time);
        let reached = |order: &Resting| if order.buys { now.ask <= order.limit } else { now.bid >= order.limit };
        let filled = self.orders.iter().filter(|order| reached(order));
        let filled: Vec<(usize, Piece)> =
            filled.map(|order| (order.number, Piece { time, quantity: order.left, price: order.limit as f64 })).collect();
        self.orders.retain(|order| !reached(order));
        filled
    }

    /// What `trade` at `price` [ticks] fills: first it takes what stands ahead.
    pub fn traded(&mut self, time: f64, price: f64, trade: &Trade) -> Vec<(usize, Piece)> {
        let mut filled = Vec::new();
        for order in self.orders.iter_mut().filter(|order| order.buys != trade.bought && order.until > time) {
            let limit = order.limit as f64;
            if price != limit {
                continue;
            }
            let ahead = order.ahead.min(trade.size);
            order.ahead -= ahead;
            let quantity = order.left.min((trade.size - ahead).floor());
            if quantity >= 1.0 {
                order.left -= quantity;
                filled.push((order.number, Piece { time, quantity, price: limit }));
            }
        }
        self.orders.retain(|order| order.left >= 1.0 && order.until > time);
        filled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(buys: bool, quantity: f64) -> Intent {
        Intent { time: 0.0, buys, quantity, rests: Some(60.0), noise: 0.0, dice: [0.5; 4], normals: [0.0; 4] }
    }

    fn sold(size: f64) -> Trade {
        Trade { time: 1.0, bought: false, size }
    }

    #[test]
    fn who_rests_is_filled_after_those_ahead_or_when_the_market_comes_to_the_limit() {
        let mut waiting = Waiting::new(&[Effect::Queue { ahead: 0.5, wobble: 0.3 }]);
        waiting.join(Resting::new(7, &order(true, 30.0), 100, 40.0, 60.0));
        // 40 displayed and 20 unseen stand ahead.
        assert!(waiting.traded(1.0, 100.0, &sold(55.0)).is_empty());
        assert!(waiting.traded(1.0, 101.0, &sold(500.0)).is_empty(), "elsewhere");
        assert!(waiting.traded(1.0, 100.0, &Trade { bought: true, ..sold(500.0) }).is_empty(), "on the other side");
        let part = waiting.traded(2.0, 100.0, &sold(15.0));
        assert_eq!(part, [(7, Piece { time: 2.0, quantity: 10.0, price: 100.0 })]);
        let at = |ask| Shown { time: 3.0, row: 0, bid: ask - 1, ask };
        assert!(waiting.crossed(3.0, &at(101)).is_empty());
        assert_eq!(waiting.crossed(4.0, &at(100)), [(7, Piece { time: 4.0, quantity: 20.0, price: 100.0 })]);
        assert!(waiting.crossed(5.0, &at(99)).is_empty(), "it is filled once");
    }

    #[test]
    fn patience_ends() {
        let mut waiting = Waiting::new(&[]);
        waiting.join(Resting::new(0, &order(false, 10.0), 100, 0.0, 10.0));
        assert!(waiting.crossed(10.0, &Shown { time: 10.0, row: 0, bid: 105, ask: 106 }).is_empty());
        assert!(waiting.traded(11.0, 100.0, &Trade { bought: true, ..sold(50.0) }).is_empty());
    }
}
