//! Quotes made of a book that is known level by level, or order by order.

use super::venue::Others;
use super::{Book, DepthBook, History, Increments, Level, Quotes, Side};
use crate::sim2real::Timestamp;

/// The levels of [`Book::DEPTH`] that a book displayed, whenever they changed. What an instant brings counts when all of it is
/// known, as it does for orders of a backtest.
pub(super) fn displayed(history: &History, increments: Increments) -> Quotes {
    let mut shown = Displayed::of(increments);
    for change in history.depth() {
        shown.before(change.known_at);
        shown.book.apply(change);
    }
    let mut others = Others::default();
    for event in history.order_events() {
        shown.before(event.known_at);
        others.show(event, &mut shown.book);
    }
    shown.tell();
    shown.quotes
}

/// A book as it is displayed, and what it displayed so far.
struct Displayed {
    book: DepthBook,
    at: Option<Timestamp>,
    last: [Vec<Level>; 2],
    quotes: Quotes,
}

impl Displayed {
    fn of(increments: Increments) -> Self {
        let quotes = Quotes::with_depth(Book::DEPTH);
        Self { book: DepthBook::new(increments), at: None, last: [Vec::new(), Vec::new()], quotes }
    }

    /// Tells what the instants before `now` have left.
    fn before(&mut self, now: Timestamp) {
        if self.at.is_some_and(|at| at < now) {
            self.tell();
        }
        self.at = Some(now);
    }

    fn tell(&mut self) {
        self.book.settle();
        let levels = [Side::Buy, Side::Sell].map(|side| self.book.levels(side).take(Book::DEPTH).collect::<Vec<Level>>());
        if let Some(at) = self.at
            && levels != self.last
        {
            self.quotes.push(at, &levels[0], &levels[1]);
            self.last = levels;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{DepthAction, DepthChange, Instrument, OrderAction, OrderEvent, Price};

    fn increments() -> Increments {
        let instrument = Instrument {
            symbol: "A".into(),
            tick_size: 0.01,
            lot_size: 1.0,
            average_daily_volume: None,
            daily_volatility: None,
        };
        Increments::of(&instrument).unwrap()
    }

    fn shown(quotes: &Quotes) -> Vec<(i64, Option<f64>, Option<f64>)> {
        (0..quotes.len()).filter_map(|k| quotes.all().get(k)).map(|quote| (quote.time.0, quote.bid(), quote.ask())).collect()
    }

    #[test]
    fn a_book_is_quoted_when_an_instant_is_over_and_something_changed() {
        let change = |at: i64, side, price: f64, size| {
            let (time, price) = (Timestamp(at), Price::nearest(price).unwrap());
            DepthChange { time, known_at: time, side, action: DepthAction::Set, price, size }
        };
        let depth = vec![
            change(1, Side::Buy, 99.0, 5.0),
            change(1, Side::Sell, 101.0, 5.0),
            change(2, Side::Buy, 99.0, 5.0),
            change(3, Side::Sell, 100.5, 1.0),
        ];
        let quotes = displayed(&History::default().with_depth(depth).unwrap(), increments());
        assert_eq!(shown(&quotes), [(1, Some(99.0), Some(101.0)), (3, Some(99.0), Some(100.5))]);
    }

    #[test]
    fn orders_of_others_make_a_book_too() {
        let event = |at: i64, id, action, side, price: f64, size| {
            let (time, price) = (Timestamp(at), Price::nearest(price).unwrap());
            OrderEvent { time, known_at: time, id, action, side, price, size }
        };
        let events = vec![
            event(1, 7, OrderAction::Add, Side::Buy, 99.0, 5.0),
            event(2, 8, OrderAction::Add, Side::Buy, 99.0, 2.0),
            event(3, 7, OrderAction::Delete, Side::Buy, 99.0, 0.0),
        ];
        let quotes = displayed(&History::default().with_order_events(events).unwrap(), increments());
        let sizes: Vec<f64> = (0..3).filter_map(|k| quotes.all().get(k)).map(|quote| quote.bids[0].size).collect();
        assert_eq!(sizes, [5.0, 7.0, 2.0]);
    }
}
