//! A stream without what was known before a time, or after one.

use crate::market::DataNotes;
use crate::sim2real::Timestamp;

use super::{Dated, Stream, StreamError};

/// The rows of a stream that were known from `start` to `last`, both included.
#[derive(Debug, Clone)]
pub(in crate::market) struct Between<S> {
    stream: S,
    start: Timestamp,
    last: Timestamp,
    ended: bool,
}

impl<S> Between<S> {
    pub fn new(stream: S, start: Timestamp, last: Timestamp) -> Self {
        Self { stream, start, last, ended: false }
    }
}

impl<T: Dated, S: Stream<T>> Stream<T> for Between<S> {
    fn refill(&mut self, into: &mut Vec<T>) -> Result<bool, StreamError> {
        let before = into.len();
        while !self.ended && into.len() == before {
            self.ended = !self.stream.refill(into)?;
            // Rows come in the order in which they were known: behind the last, no more is read.
            let early = into[before..].iter().take_while(|row| row.known_at() < self.start).count();
            into.drain(before..before + early);
            let within = into[before..].iter().take_while(|row| row.known_at() <= self.last).count();
            if before + within < into.len() {
                into.truncate(before + within);
                self.ended = true;
            }
        }
        Ok(into.len() > before)
    }

    fn notes(&self) -> Option<&DataNotes> {
        self.stream.notes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{Bar, Price, Stored};

    #[test]
    fn rows_within_are_given_and_no_more_is_read_behind_them() {
        let price = Price(1);
        let bar = |at: i64| {
            let (open_at, known_at) = (Timestamp(at - 1), Timestamp(at));
            Bar { open_at, known_at, open: price, high: price, low: price, close: price, volume: 0.0 }
        };
        for at_a_time in [1, 2, 3, 20] {
            let stored = Stored::new((1..20).map(bar).collect(), at_a_time).unwrap();
            let mut stream = Between::new(stored, Timestamp(5), Timestamp(11));
            let mut rows = vec![bar(0)];
            while stream.refill(&mut rows).unwrap() {}
            let times: Vec<i64> = rows.iter().map(|row| row.known_at.0).collect();
            assert_eq!(times, [0, 5, 6, 7, 8, 9, 10, 11], "what was there before stays");
            assert!(!stream.refill(&mut rows).unwrap() && rows.len() == 8);
        }
    }
}
