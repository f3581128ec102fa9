//! The book that a tape shows, price by price, in exact numbers.

use std::collections::BTreeMap;

use crate::market::{Level, Price, Quantity, Side};

/// What is displayed on both sides. Prices need no tick, for that is what the tape is asked for.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct TapeBook {
    bids: BTreeMap<Price, Quantity>,
    asks: BTreeMap<Price, Quantity>,
}

/// A size in exact numbers; one beyond them is the largest that they hold.
pub(super) fn exact_size(size: f64) -> Quantity {
    Quantity::nearest(size).unwrap_or(Quantity(i64::MAX))
}

impl TapeBook {
    fn side(&self, side: Side) -> &BTreeMap<Price, Quantity> {
        match side {
            Side::Buy => &self.bids,
            Side::Sell => &self.asks,
        }
    }

    fn side_mut(&mut self, side: Side) -> &mut BTreeMap<Price, Quantity> {
        match side {
            Side::Buy => &mut self.bids,
            Side::Sell => &mut self.asks,
        }
    }

    /// `side` displays `size` at `price` from now on; nothing takes the level away.
    pub(super) fn set(&mut self, side: Side, price: Price, size: Quantity) {
        if size > Quantity::ZERO {
            self.side_mut(side).insert(price, size);
        } else {
            self.side_mut(side).remove(&price);
        }
    }

    /// Adds to what is displayed, or takes from it; a level never holds less than nothing.
    pub(super) fn add(&mut self, side: Side, price: Price, by: Quantity) {
        let now = self.side(side).get(&price).copied().unwrap_or_default();
        self.set(side, price, Quantity(now.0.saturating_add(by.0)));
    }

    /// The whole side is empty.
    pub(super) fn clear(&mut self, side: Side) {
        self.side_mut(side).clear();
    }

    /// The best price of a side, and what is there.
    pub(super) fn best(&self, side: Side) -> Option<(Price, Quantity)> {
        let level = match side {
            Side::Buy => self.bids.last_key_value(),
            Side::Sell => self.asks.first_key_value(),
        };
        level.map(|(price, size)| (*price, *size))
    }

    /// Best bid and best ask, where there are both and they do not cross.
    pub(super) fn touch(&self) -> Option<[Price; 2]> {
        let (bid, ask) = (self.best(Side::Buy)?.0, self.best(Side::Sell)?.0);
        (bid < ask).then_some([bid, ask])
    }

    /// Whether an order of `side` with this limit meets something at once.
    pub(super) fn is_met_by(&self, side: Side, limit: Price) -> bool {
        self.best(side.opposite()).is_some_and(|(price, _)| side.accepts(price, limit))
    }

    /// `side` has its best level here and nothing before it: what a feed of best prices says.
    pub(super) fn show_best(&mut self, side: Side, price: Price, size: Quantity) {
        self.drop_before(side, price);
        self.set(side, price, size);
    }

    /// Takes away the levels of `side` that are better than `price`.
    pub(super) fn drop_before(&mut self, side: Side, price: Price) {
        while let Some((best, _)) = self.best(side).filter(|(best, _)| *best != price && side.accepts(price, *best)) {
            self.side_mut(side).remove(&best);
        }
    }

    /// Takes away what a newer level of `newest` crosses: it is gone.
    pub(super) fn settle(&mut self, newest: Side) {
        while let Some((bid, ask)) = self.best(Side::Buy).zip(self.best(Side::Sell)).filter(|(bid, ask)| bid.0 >= ask.0) {
            match newest {
                Side::Buy => drop(self.asks.remove(&ask.0)),
                Side::Sell => drop(self.bids.remove(&bid.0)),
            }
        }
    }

    /// The best `count` levels of a side.
    pub(super) fn top(&self, side: Side, count: usize) -> Vec<Level> {
        let level = |(price, size): (&Price, &Quantity)| Level { price: price.to_f64(), size: size.to_f64() };
        match side {
            Side::Buy => self.bids.iter().rev().take(count).map(level).collect(),
            Side::Sell => self.asks.iter().take(count).map(level).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn price(value: i64) -> Price {
        Price(value * 1_000_000_000)
    }

    fn book() -> TapeBook {
        let mut book = TapeBook::default();
        for (at, size) in [(99, 1.0), (98, 2.0), (97, 3.0)] {
            book.set(Side::Buy, price(at), exact_size(size));
        }
        for (at, size) in [(101, 1.0), (102, 2.0)] {
            book.set(Side::Sell, price(at), exact_size(size));
        }
        book
    }

    fn prices(book: &TapeBook, side: Side) -> Vec<f64> {
        book.top(side, 9).iter().map(|level| level.price).collect()
    }

    #[test]
    fn levels_come_and_go_and_the_best_are_first() {
        let mut book = book();
        assert_eq!((prices(&book, Side::Buy), prices(&book, Side::Sell)), (vec![99.0, 98.0, 97.0], vec![101.0, 102.0]));
        assert_eq!(book.touch(), Some([price(99), price(101)]));
        book.add(Side::Buy, price(99), Quantity(-1_000_000_000));
        book.add(Side::Sell, price(101), exact_size(0.5));
        assert_eq!((book.top(Side::Buy, 1)[0].price, book.top(Side::Sell, 1)[0].size), (98.0, 1.5));
        book.add(Side::Buy, price(98), Quantity(i64::MIN));
        book.clear(Side::Sell);
        assert_eq!((prices(&book, Side::Buy), book.touch()), (vec![97.0], None));
    }

    #[test]
    fn a_limit_meets_what_is_at_it_or_better() {
        let book = book();
        assert!(book.is_met_by(Side::Buy, price(101)) && !book.is_met_by(Side::Buy, price(100)));
        assert!(book.is_met_by(Side::Sell, price(99)) && !book.is_met_by(Side::Sell, price(100)));
    }

    #[test]
    fn best_prices_take_away_what_stands_before_them_and_the_newer_side_stays() {
        let mut book = book();
        book.show_best(Side::Buy, price(98), exact_size(7.0));
        book.show_best(Side::Sell, price(100), exact_size(f64::INFINITY));
        assert_eq!((prices(&book, Side::Buy), prices(&book, Side::Sell)), (vec![98.0, 97.0], vec![100.0, 101.0, 102.0]));
        assert_eq!((book.top(Side::Buy, 1)[0].size, book.top(Side::Sell, 1)[0].size), (7.0, i64::MAX as f64 / 1e9));
        book.set(Side::Buy, price(101), exact_size(1.0));
        assert_eq!(book.touch(), None, "crossed");
        let mut other = book.clone();
        book.settle(Side::Buy);
        assert_eq!(book.touch(), Some([price(101), price(102)]));
        other.settle(Side::Sell);
        assert_eq!(other.touch(), Some([price(98), price(100)]));
    }
}
