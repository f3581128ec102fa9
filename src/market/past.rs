//! What is known of a feed: the newest rows, and no row that is still to come.

use super::{QuoteSlice, Quotes};

/// The newest rows of a feed, oldest first. It owns them: nothing of what is still to come can be reached from here.
#[derive(Debug, Clone, PartialEq)]
pub struct Past<T> {
    rows: Vec<T>,
}

impl<T> Default for Past<T> {
    fn default() -> Self {
        Self { rows: Vec::new() }
    }
}

impl<T: Copy> Past<T> {
    /// Takes in a row, of which the newest `keep` stay for certain.
    #[inline(always)]
    pub fn push(&mut self, row: T, keep: usize) {
        if self.rows.len() >= room(keep) {
            self.rows.drain(..self.rows.len() - (keep - 1));
        }
        self.rows.push(row);
    }

    /// The newest rows, at most `keep`.
    #[inline]
    #[must_use]
    pub fn newest(&self, keep: usize) -> &[T] {
        &self.rows[self.rows.len().saturating_sub(keep)..]
    }
}

/// Rows that are gathered before old ones are forgotten all at once.
fn room(keep: usize) -> usize {
    keep.saturating_mul(2).max(256)
}

/// The newest quotes, oldest first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PastQuotes {
    rows: Quotes,
}

impl PastQuotes {
    /// Takes in quote `row` of `from`, of which the newest `keep` stay for certain.
    #[inline]
    pub fn push(&mut self, from: &Quotes, row: usize, keep: usize) {
        if self.rows.len() >= room(keep) {
            self.rows.keep_newest(keep - 1);
        }
        if self.rows.depth() < from.depth() {
            self.rows.deepen(from.depth());
        }
        if let Some(quote) = from.all().get(row) {
            self.rows.push(quote.time, quote.bids, quote.asks);
        }
    }

    /// The newest quotes, at most `keep`.
    #[inline]
    #[must_use]
    pub fn newest(&self, keep: usize) -> QuoteSlice<'_> {
        self.rows.between(self.rows.len().saturating_sub(keep), self.rows.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Level;
    use crate::sim2real::Timestamp;

    #[test]
    fn the_newest_rows_stay_however_many_come() {
        for keep in [1, 2, 50, 1_000] {
            let (mut past, mut quotes, mut all) = (Past::default(), PastQuotes::default(), Quotes::with_depth(2));
            for row in 0..5_000_usize {
                past.push(row, keep);
                let level = Level { price: row as f64, size: 1.0 };
                all.push(Timestamp(row as i64), &[level], &[level, level]);
                quotes.push(&all, row, keep);
                let expected: Vec<usize> = ((row + 1).saturating_sub(keep)..=row).collect();
                assert_eq!(past.newest(keep), expected);
                let seen = quotes.newest(keep);
                assert_eq!((seen.len(), seen.last().unwrap().asks.len()), (expected.len(), 2));
                assert_eq!(seen.get(0).unwrap().time, Timestamp(expected[0] as i64));
            }
            assert!(past.rows.len() <= room(keep));
        }
    }
}
