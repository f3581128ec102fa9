//! Orders of others, one by one, where the data have them: the book they make, and who stands ahead of whom.

use std::collections::HashMap;

use crate::market::{DepthBook, OrderAction, OrderEvent, Price, Side};

use super::floor::Floor;
use super::shown::Shown;

/// An order of others that rests.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Other {
    side: Side,
    price: Price,
    size: f64,
    /// Number of the event by which it took its place in the queue.
    since: u64,
}

/// The orders of others that rest now.
#[derive(Debug, Clone, PartialEq, Default)]
pub(in crate::market) struct Others {
    orders: HashMap<u64, Other>,
    /// Events so far.
    events: u64,
    /// Changes of orders that were never added, or added twice.
    unknown: u64,
}

/// What an event takes out of a queue.
struct Left {
    side: Side,
    price: Price,
    size: f64,
    since: u64,
}

impl Others {
    /// Events so far.
    pub(super) fn events(&self) -> u64 {
        self.events
    }

    /// Takes in an event, for the book alone.
    pub fn show(&mut self, event: &OrderEvent, book: &mut DepthBook) {
        self.apply(event, book);
    }

    /// Takes in an event, and says what it took out of a queue.
    fn apply(&mut self, event: &OrderEvent, book: &mut DepthBook) -> Option<Left> {
        self.events += 1;
        let new = Other { side: event.side, price: event.price, size: event.size, since: self.events };
        let old = match event.action {
            OrderAction::Delete => self.orders.remove(&event.id),
            OrderAction::Add | OrderAction::Change => {
                let old = self.orders.get(&event.id).copied();
                // It keeps its place where it shrinks.
                let stays = old.is_some_and(|old| old.price == new.price && old.side == new.side && new.size <= old.size);
                let since = old.filter(|_| stays).map_or(new.since, |old| old.since);
                self.orders.insert(event.id, Other { since, ..new });
                if let (true, Some(old)) = (stays, old) {
                    let less = old.size - new.size;
                    book.add(old.side, old.price, -less);
                    return Some(Left { side: old.side, price: old.price, size: less, since: old.since });
                }
                book.add(new.side, new.price, new.size);
                old
            }
        };
        self.unknown += u64::from(old.is_some() == (event.action == OrderAction::Add));
        let old = old?;
        book.add(old.side, old.price, -old.size);
        Some(Left { side: old.side, price: old.price, size: old.size, since: old.since })
    }
}

impl Floor {
    /// Something happens to an order of others.
    pub fn on_order(&mut self, event: &OrderEvent) {
        let Shown::Depth(book) = &mut self.shown else { return };
        let Some(left) = self.others.apply(event, book) else { return };
        for order in &mut self.resting {
            let joined = order.limit().map(|limit| self.moved.level(order.side, limit));
            if order.side == left.side && joined == Some(left.price) && left.since <= order.place.joined_after {
                order.place.left_ahead(left.size);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{Increments, Instrument};

    #[test]
    fn an_order_that_shrinks_keeps_its_place_and_one_that_grows_does_not() {
        let instrument = Instrument {
            symbol: "X".into(),
            tick_size: 0.01,
            lot_size: 1.0,
            average_daily_volume: None,
            daily_volatility: None,
        };
        let mut book = DepthBook::new(Increments::of(&instrument).unwrap());
        let mut others = Others::default();
        let price = Price(10_000_000_000);
        let mut event = |time: i64, id, action, size: f64| {
            let at = crate::sim2real::Timestamp(time);
            let event = OrderEvent { time: at, known_at: at, id, action, side: Side::Buy, price, size };
            let left = others.apply(&event, &mut book);
            (left.map(|left| (left.size, left.since)), book.size(Side::Buy, price))
        };
        assert_eq!(event(1, 7, OrderAction::Add, 5.0), (None, 5.0));
        assert_eq!(event(2, 8, OrderAction::Add, 3.0), (None, 8.0));
        assert_eq!(event(3, 7, OrderAction::Change, 4.0), (Some((1.0, 1)), 7.0));
        assert_eq!(event(4, 7, OrderAction::Change, 6.0), (Some((4.0, 1)), 9.0));
        assert_eq!(event(5, 7, OrderAction::Delete, 0.0), (Some((6.0, 4)), 3.0));
        assert_eq!(event(6, 99, OrderAction::Delete, 0.0), (None, 3.0));
        assert_eq!(others.unknown, 1);
    }
}
