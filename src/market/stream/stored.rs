//! Rows that are in memory already, as a stream.

use super::{Dated, Stream, StreamError};
use crate::market::HistoryError;

/// Rows in memory, given out some at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Stored<T> {
    rows: Vec<T>,
    given: usize,
    at_a_time: usize,
}

impl<T: Dated> Stored<T> {
    /// A stream of `rows`, `at_a_time` of them with each call.
    ///
    /// # Errors
    /// Rows that are not in the order in which they could be known, or known before they happened.
    pub fn new(rows: Vec<T>, at_a_time: usize) -> Result<Self, HistoryError> {
        let what = "row";
        for (row, pair) in rows.windows(2).enumerate() {
            let (before, found) = (pair[0].known_at(), pair[1].known_at());
            if found < before {
                return Err(HistoryError::Time { what, row: row + 1, found, before });
            }
        }
        match rows.iter().enumerate().find(|(_, row)| row.known_at() < row.time()) {
            None => Ok(Self { rows, given: 0, at_a_time: at_a_time.max(1) }),
            Some((row, found)) => Err(HistoryError::Known { what, row, time: found.time(), known_at: found.known_at() }),
        }
    }
}

impl<T: Dated + Clone + Send> Stream<T> for Stored<T> {
    fn refill(&mut self, into: &mut Vec<T>) -> Result<bool, StreamError> {
        let rest = self.rows.get(self.given..).unwrap_or_default();
        let next = &rest[..self.at_a_time.min(rest.len())];
        into.extend_from_slice(next);
        self.given += next.len();
        Ok(!next.is_empty())
    }
}
