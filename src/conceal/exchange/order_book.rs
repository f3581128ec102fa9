//! The generator's own matching engine: price, then time; whole ticks and whole lots.

use std::collections::{BTreeMap, VecDeque};

/// Which way an order goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// It takes offers or rests as a bid.
    Buy,
    /// It takes bids or rests as an offer.
    Sell,
}

impl Side {
    /// 1 for a buy, -1 for a sale.
    #[must_use]
    pub fn sign(self) -> i64 {
        match self {
            Self::Buy => 1,
            Self::Sell => -1,
        }
    }

    /// The contract's word.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Buy => "buy",
            Self::Sell => "sell",
        }
    }

    /// The side it trades with.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Buy => Self::Sell,
            Self::Sell => Self::Buy,
        }
    }
}

/// An order that waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Resting {
    id: u64,
    quantity: i64,
}

/// A resting order met, wholly or in part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Match {
    /// The resting order.
    pub maker: u64,
    /// Price [ticks].
    pub ticks: i64,
    /// Quantity [lots].
    pub quantity: i64,
}

/// Resting orders of both sides. Never crossed: what could trade has traded.
#[derive(Debug, Clone, Default)]
pub struct OrderBook {
    bids: BTreeMap<i64, VecDeque<Resting>>,
    asks: BTreeMap<i64, VecDeque<Resting>>,
}

impl OrderBook {
    /// Highest bid [ticks].
    #[must_use]
    pub fn best_bid(&self) -> Option<i64> {
        self.bids.keys().next_back().copied()
    }

    /// Lowest offer [ticks].
    #[must_use]
    pub fn best_ask(&self) -> Option<i64> {
        self.asks.keys().next().copied()
    }

    /// Best price of a side [ticks].
    #[must_use]
    pub fn best(&self, side: Side) -> Option<i64> {
        match side {
            Side::Buy => self.best_bid(),
            Side::Sell => self.best_ask(),
        }
    }

    /// Price levels of a side.
    #[must_use]
    pub fn levels(&self, side: Side) -> usize {
        self.resting(side).len()
    }

    /// The best `levels` prices of a side, best first, with the quantity displayed [ticks, lots].
    #[must_use]
    pub fn depth(&self, side: Side, levels: usize) -> Vec<(i64, i64)> {
        let total = |(ticks, queue): (&i64, &VecDeque<Resting>)| (*ticks, queue.iter().map(|order| order.quantity).sum());
        match side {
            Side::Buy => self.bids.iter().rev().take(levels).map(total).collect(),
            Side::Sell => self.asks.iter().take(levels).map(total).collect(),
        }
    }

    /// An order that takes what stands at `limit` [ticks] or better, and rests with the remainder.
    pub fn limit(&mut self, id: u64, side: Side, limit: i64, quantity: i64) -> Vec<Match> {
        let matches = self.take(side, Some(limit), quantity);
        let left = quantity - matches.iter().map(|met| met.quantity).sum::<i64>();
        if left > 0 {
            self.resting_mut(side).entry(limit).or_default().push_back(Resting { id, quantity: left });
        }
        matches
    }

    /// An order that takes what there is at any price; what it finds nothing for lapses.
    pub fn market(&mut self, side: Side, quantity: i64) -> Vec<Match> {
        self.take(side, None, quantity)
    }

    /// Takes an order away; the quantity it still had [lots], or none where it no longer rests there.
    pub fn cancel(&mut self, id: u64, side: Side, ticks: i64) -> Option<i64> {
        let levels = self.resting_mut(side);
        let queue = levels.get_mut(&ticks)?;
        let place = queue.iter().position(|order| order.id == id)?;
        let order = queue.remove(place)?;
        if queue.is_empty() {
            levels.remove(&ticks);
        }
        Some(order.quantity)
    }

    fn take(&mut self, side: Side, limit: Option<i64>, quantity: i64) -> Vec<Match> {
        let (mut left, mut matches) = (quantity, Vec::new());
        while left > 0 {
            let Some(ticks) = self.best(side.opposite()) else { break };
            if limit.is_some_and(|limit| side.sign() * (ticks - limit) > 0) {
                break;
            }
            let levels = self.resting_mut(side.opposite());
            let Some(queue) = levels.get_mut(&ticks) else { break };
            while let Some(order) = queue.front_mut().filter(|_| left > 0) {
                let traded = left.min(order.quantity);
                matches.push(Match { maker: order.id, ticks, quantity: traded });
                left -= traded;
                order.quantity -= traded;
                if order.quantity == 0 {
                    queue.pop_front();
                }
            }
            if queue.is_empty() {
                levels.remove(&ticks);
            }
        }
        matches
    }

    fn resting(&self, side: Side) -> &BTreeMap<i64, VecDeque<Resting>> {
        match side {
            Side::Buy => &self.bids,
            Side::Sell => &self.asks,
        }
    }

    fn resting_mut(&mut self, side: Side) -> &mut BTreeMap<i64, VecDeque<Resting>> {
        match side {
            Side::Buy => &mut self.bids,
            Side::Sell => &mut self.asks,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_better_price_goes_first_then_the_earlier_order() {
        let mut book = OrderBook::default();
        book.limit(1, Side::Sell, 102, 10);
        book.limit(2, Side::Sell, 101, 5);
        book.limit(3, Side::Sell, 101, 5);
        let met = |maker, ticks, quantity| Match { maker, ticks, quantity };
        assert_eq!(book.market(Side::Buy, 12), [met(2, 101, 5), met(3, 101, 5), met(1, 102, 2)]);
        assert_eq!(book.depth(Side::Sell, 5), [(102, 8)]);
    }

    #[test]
    fn a_limit_takes_no_worse_than_its_price_and_rests_with_the_remainder() {
        let mut book = OrderBook::default();
        book.limit(1, Side::Buy, 100, 4);
        book.limit(2, Side::Buy, 98, 4);
        assert_eq!(book.limit(3, Side::Sell, 99, 10), [Match { maker: 1, ticks: 100, quantity: 4 }]);
        assert_eq!((book.best_bid(), book.best_ask()), (Some(98), Some(99)));
        assert_eq!(book.depth(Side::Sell, 1), [(99, 6)]);
    }

    #[test]
    fn a_market_order_into_an_empty_book_lapses() {
        assert!(OrderBook::default().market(Side::Buy, 7).is_empty());
    }

    proptest! {
        /// Whatever comes in: never crossed, best prices first, and every lot is resting, traded or cancelled.
        #[test]
        fn lots_are_conserved_and_the_book_never_crosses(
            orders in prop::collection::vec((0_u8..4, any::<bool>(), 90_i64..110, 1_i64..50), 1..200)
        ) {
            let mut book = OrderBook::default();
            let (mut rested, mut gone) = (0, 0);
            let mut known = Vec::new();
            for (id, (kind, buys, ticks, quantity)) in orders.into_iter().enumerate() {
                let side = if buys { Side::Buy } else { Side::Sell };
                let id = id as u64;
                match kind {
                    0 => {
                        let had: i64 = book.depth(side.opposite(), 1000).iter().map(|level| level.1).sum();
                        let traded: i64 = book.market(side, quantity).iter().map(|met| met.quantity).sum();
                        prop_assert_eq!(traded, quantity.min(had));
                        gone += traded;
                    }
                    1 if !known.is_empty() => {
                        let (id, side, ticks) = known[quantity as usize % known.len()];
                        gone += book.cancel(id, side, ticks).unwrap_or(0);
                    }
                    _ => {
                        let matches = book.limit(id, side, ticks, quantity);
                        let traded: i64 = matches.iter().map(|met| met.quantity).sum();
                        prop_assert!(matches.iter().all(|met| side.sign() * (met.ticks - ticks) <= 0));
                        prop_assert!(matches.windows(2).all(|pair| side.sign() * (pair[1].ticks - pair[0].ticks) >= 0));
                        rested += quantity - traded;
                        gone += traded;
                        known.push((id, side, ticks));
                    }
                }
                if let (Some(bid), Some(ask)) = (book.best_bid(), book.best_ask()) {
                    prop_assert!(bid < ask, "crossed: {} against {}", bid, ask);
                }
                let resting: i64 =
                    [Side::Buy, Side::Sell].iter().flat_map(|side| book.depth(*side, 1000)).map(|level| level.1).sum();
                prop_assert_eq!(resting + gone, rested);
            }
        }
    }
}
