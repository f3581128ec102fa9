//! Rows put in the order in which they could be known, within a window.

use std::collections::VecDeque;

use super::Dated;
use crate::sim2real::Timestamp;

/// Holds rows back for as long as one may come that was known before them.
///
/// Without a window nothing is held back, and a row that was known before the one before it is late.
#[derive(Debug)]
pub(super) struct Sequence<T> {
    /// By how much a row may come after rows that were known later [ns].
    window: i64,
    /// Rows held back, in order.
    held: VecDeque<T>,
    /// The latest time of all rows.
    newest: Timestamp,
}

/// What became of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Placed {
    /// It is the newest.
    Last,
    /// It was put before rows that came earlier.
    Between,
    /// It comes too late to be put in order: it is left out.
    Late,
}

impl<T: Dated> Sequence<T> {
    pub(super) fn new(window: Option<i64>) -> Self {
        let window = window.unwrap_or(0);
        Self { window, held: VecDeque::new(), newest: Timestamp::MIN }
    }

    /// Whether a row that is known at `known_at` goes on at once, and is then the newest: nothing is held back, none may come before
    /// it, and it is not late. Nearly all rows are such.
    #[inline(always)]
    pub(super) fn passes(&mut self, known_at: Timestamp) -> bool {
        let passes = self.window == 0 && known_at >= self.newest && self.held.is_empty();
        if passes {
            self.newest = known_at;
        }
        passes
    }

    /// Takes a row. Those of one time stay in the order in which they came.
    pub(super) fn push(&mut self, row: T) -> Placed {
        let known_at = row.known_at();
        if known_at < self.newest + -self.window {
            return Placed::Late;
        }
        let placed = if known_at >= self.newest { Placed::Last } else { Placed::Between };
        let at = self.held.partition_point(|held| held.known_at() <= known_at);
        self.held.insert(at, row);
        self.newest = self.newest.max(known_at);
        placed
    }

    /// The next row before which none can come any more; at the `end`, any.
    pub(super) fn pop(&mut self, end: bool) -> Option<T> {
        let first = self.held.front()?.known_at();
        if end || first <= self.newest + -self.window { self.held.pop_front() } else { None }
    }

    /// The latest time of all rows.
    pub(super) fn newest(&self) -> Timestamp {
        self.newest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Copy, PartialEq)]
    struct Row(i64, char);

    impl Dated for Row {
        fn time(&self) -> Timestamp {
            Timestamp(self.0)
        }

        fn known_at(&self) -> Timestamp {
            Timestamp(self.0)
        }
    }

    fn ordered(window: Option<i64>, rows: &[i64]) -> (Vec<i64>, Vec<Placed>) {
        let mut sequence = Sequence::new(window);
        let (mut given, mut placed) = (Vec::new(), Vec::new());
        for row in rows {
            let before = given.len();
            let mut other = Sequence { held: sequence.held.clone(), ..sequence };
            placed.push(sequence.push(Row(*row, ' ')));
            // What passes is what is put last and given out at once.
            let passed = other.passes(Timestamp(*row));
            given.extend(std::iter::from_fn(|| sequence.pop(false)).map(|row| row.0));
            assert!(
                !passed
                    || (placed.last(), &given[before..], other.newest) == (Some(&Placed::Last), &[*row], sequence.newest)
            );
            assert!(passed || window.is_some() || placed.last() == Some(&Placed::Late));
        }
        given.extend(std::iter::from_fn(|| sequence.pop(true)).map(|row| row.0));
        (given, placed)
    }

    #[test]
    fn rows_within_the_window_are_put_in_order_and_others_are_late() {
        use Placed::{Between, Last, Late};
        assert_eq!(ordered(None, &[1, 3, 2, 3]), (vec![1, 3, 3], vec![Last, Last, Late, Last]));
        assert_eq!(ordered(Some(5), &[10, 12, 8, 20, 13]), (vec![8, 10, 12, 20], vec![Last, Last, Between, Last, Late]));
        assert_eq!(ordered(Some(5), &[10, 12, 8, 20, 15]).0, [8, 10, 12, 15, 20]);
    }

    #[test]
    fn rows_of_one_time_stay_as_they_came() {
        let mut sequence = Sequence::new(Some(10));
        for row in [Row(5, 'a'), Row(7, 'b'), Row(5, 'c'), Row(7, 'd')] {
            sequence.push(row);
        }
        let order: String = std::iter::from_fn(|| sequence.pop(true)).map(|row| row.1).collect();
        assert_eq!(order, "acbd");
    }
}
