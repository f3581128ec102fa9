//! Where in time the rows of a tape are: a search among millions of rows begins beside what it seeks.

use crate::sim2real::Timestamp;

/// Rows a span of time holds in the mean.
const ROWS: usize = 8;

/// Of rows in order of time, how many come before each of many equal spans of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct TimeIndex {
    first: Timestamp,
    /// A span lasts two to this power [ns].
    shift: u32,
    /// One for each span, and one for the end; none where there are too many rows.
    before: Vec<u32>,
}

impl TimeIndex {
    /// Of rows of these times, which are in order.
    pub fn of(times: &[Timestamp]) -> Self {
        let (Some(first), Some(last), Ok(count)) = (times.first(), times.last(), u32::try_from(times.len())) else {
            return Self::default();
        };
        let lasts = last.0.abs_diff(first.0);
        let most = (times.len() / ROWS).max(1) as u64;
        let shift = (0..u64::BITS).find(|shift| lasts >> shift < most).unwrap_or(u64::BITS - 1);
        let mut index = Self { first: *first, shift, before: Vec::new() };
        let spans = (lasts >> shift) as usize + 1;
        index.before.reserve_exact(spans + 1);
        for (row, time) in (0..count).zip(times) {
            let span = index.span(*time);
            index.before.resize(index.before.len().max(span + 1), row);
        }
        index.before.resize(spans + 1, count);
        index
    }

    fn span(&self, time: Timestamp) -> usize {
        (time.0.abs_diff(self.first.0) >> self.shift) as usize
    }

    /// How many of `times`, those that this was made of, are `before` a time: those up to it, or those up to and with it.
    #[inline]
    pub fn count(&self, times: &[Timestamp], time: Timestamp, before: impl Fn(&Timestamp) -> bool) -> usize {
        if self.before.is_empty() {
            return times.partition_point(before);
        }
        if time < self.first {
            return 0;
        }
        let span = self.span(time);
        match (self.before.get(span), self.before.get(span + 1)) {
            (Some(from), Some(to)) => *from as usize + times[*from as usize..*to as usize].partition_point(before),
            _ => times.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Whatever the rows are, and wherever the time is.
        #[test]
        fn counts_are_those_of_a_search_over_all_rows(
            mut times in prop::collection::vec(prop_oneof![-50..50_i64, -1_000_000..1_000_000_i64, any::<i64>()], 0..200),
            asked in prop::collection::vec(prop_oneof![-60..60_i64, any::<i64>()], 20),
        ) {
            times.sort_unstable();
            let times: Vec<Timestamp> = times.into_iter().map(Timestamp).collect();
            let index = TimeIndex::of(&times);
            for time in asked.into_iter().map(Timestamp).chain(times.iter().copied()) {
                let (upto, with) = (|row: &Timestamp| *row < time, |row: &Timestamp| *row <= time);
                prop_assert_eq!(index.count(&times, time, upto), times.partition_point(upto));
                prop_assert_eq!(index.count(&times, time, with), times.partition_point(with));
            }
        }
    }
}
