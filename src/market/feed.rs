//! The histories of all instruments, merged by when things could be known.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;

use crate::sim2real::Timestamp;

use super::{Event, EventKind, History};

/// The next event of one source: ordered by time, then instrument, then bars before quotes.
type Pending = Reverse<(Timestamp, usize, EventKind, usize)>;

/// Everything that becomes known, in order: by time; at one time by instrument, and bars before quotes.
#[derive(Debug, Clone)]
pub struct Feed<'d> {
    histories: &'d [History],
    pending: BinaryHeap<Pending>,
    last: Option<Timestamp>,
    events: usize,
}

impl<'d> Feed<'d> {
    /// A feed of the given histories, one an instrument.
    #[must_use]
    pub fn new(histories: &'d [History]) -> Self {
        let mut feed = Self { histories, pending: BinaryHeap::new(), last: None, events: 0 };
        for (instrument, history) in histories.iter().enumerate() {
            for kind in [EventKind::Bar, EventKind::Quote] {
                if let Some(time) = time_of(history, kind, 0) {
                    feed.pending.push(Reverse((time, instrument, kind, 0)));
                }
            }
            let ends = [history.bars().last().map(|bar| bar.known_at), history.quotes().times().last().copied()];
            feed.last = feed.last.max(ends.into_iter().flatten().max());
            feed.events += history.bars().len() + history.quotes().len();
        }
        feed
    }

    /// When the next event is known.
    #[must_use]
    pub fn peek(&self) -> Option<Timestamp> {
        self.pending.peek().map(|Reverse((time, ..))| *time)
    }

    /// When the last event of all is known.
    #[must_use]
    pub fn end(&self) -> Option<Timestamp> {
        self.last
    }

    /// Number of all events.
    #[must_use]
    pub fn events(&self) -> usize {
        self.events
    }
}

impl Iterator for Feed<'_> {
    /// The event, and the row of its bar or quote on the instrument's history.
    type Item = (Event, usize);

    #[inline]
    fn next(&mut self) -> Option<(Event, usize)> {
        let mut top = self.pending.peek_mut()?;
        let Reverse((time, instrument, kind, row)) = *top;
        // The heap is put in order once, when the changed top is let go.
        match time_of(&self.histories[instrument], kind, row + 1) {
            Some(next) => *top = Reverse((next, instrument, kind, row + 1)),
            None => {
                PeekMut::pop(top);
            }
        }
        Some((Event { time, instrument, kind }, row))
    }
}

#[inline]
fn time_of(history: &History, kind: EventKind, row: usize) -> Option<Timestamp> {
    match kind {
        EventKind::Bar => history.bars().get(row).map(|bar| bar.known_at),
        EventKind::Quote => history.quotes().times().get(row).copied(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{Bar, Level, Price, Quotes};

    fn bar(known_at: i64) -> Bar {
        let price = Price(1);
        let (open_at, known_at) = (Timestamp(known_at - 2), Timestamp(known_at));
        Bar { open_at, known_at, open: price, high: price, low: price, close: price, volume: 0.0 }
    }

    #[test]
    fn events_come_by_time_then_instrument_then_kind() {
        let mut quotes = Quotes::with_depth(1);
        for t in [4, 4, 5] {
            quotes.push(Timestamp(t), &[Level { price: 1.0, size: 1.0 }], &[]);
        }
        let histories = [
            History::new(vec![bar(4), bar(8)], quotes).unwrap(),
            History::new(vec![bar(3), bar(5)], Quotes::default()).unwrap(),
        ];
        let feed = Feed::new(&histories);
        assert_eq!((feed.peek(), feed.end(), feed.events()), (Some(Timestamp(3)), Some(Timestamp(8)), 7));
        let order: Vec<(i64, usize, EventKind, usize)> =
            feed.map(|(event, row)| (event.time.0, event.instrument, event.kind, row)).collect();
        use EventKind::{Bar, Quote};
        assert_eq!(
            order,
            [
                (3, 1, Bar, 0),
                (4, 0, Bar, 0),
                (4, 0, Quote, 0),
                (4, 0, Quote, 1),
                (5, 0, Quote, 2),
                (5, 1, Bar, 1),
                (8, 0, Bar, 1)
            ]
        );
        assert_eq!(Feed::new(&[]).peek(), None);
    }
}
