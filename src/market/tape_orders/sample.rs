//! Which of a tape's orders are written: hundreds of thousands are more than a diagnosis needs.

use crate::market::Quantity;
use crate::sim2real::Timestamp;

/// Which orders are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Selection {
    /// How many of those that fit are kept.
    pub thinning: Thinning,
    /// The smallest quantity [units].
    pub smallest: Quantity,
    /// The first instant at which they come.
    pub start: Timestamp,
    /// The instant before which they come.
    pub end: Timestamp,
}

/// How many orders are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thinning {
    /// Every so many-th: 1 for all.
    Every(u64),
    /// A systematic sample of at most so many: every first, second, fourth or eighth, and so on, whichever is the first that
    /// leaves no more. It depends on nothing but the orders' places, and so on nothing that happened to them.
    AtMost(usize),
}

impl Selection {
    /// How many orders are kept where nothing is asked for.
    pub const AT_MOST: usize = 2_000;
}

impl Default for Selection {
    fn default() -> Self {
        Self {
            thinning: Thinning::AtMost(Self::AT_MOST),
            smallest: Quantity::ZERO,
            start: Timestamp::MIN,
            end: Timestamp::MAX,
        }
    }
}

/// A systematic sample in memory that does not grow.
#[derive(Debug, Clone)]
pub(super) struct Sample<T> {
    thinning: Thinning,
    every: u64,
    seen: u64,
    kept: Vec<T>,
}

impl<T> Sample<T> {
    pub(super) fn new(thinning: Thinning) -> Self {
        let every = match thinning {
            Thinning::Every(every) => every.max(1),
            Thinning::AtMost(_) => 1,
        };
        Self { thinning, every, seen: 0, kept: Vec::new() }
    }

    /// Shows it the next one.
    pub(super) fn push(&mut self, item: T) {
        let place = self.seen;
        self.seen += 1;
        if !place.is_multiple_of(self.every) {
            return;
        }
        if let Thinning::AtMost(most) = self.thinning
            && self.kept.len() >= most.max(1)
        {
            let mut number = 0_u64;
            self.kept.retain(|_| {
                number += 1;
                !number.is_multiple_of(2)
            });
            self.every *= 2;
            if !place.is_multiple_of(self.every) {
                return;
            }
        }
        self.kept.push(item);
    }

    /// Every how many-th is kept.
    pub(super) fn every(&self) -> u64 {
        self.every
    }

    /// How many it was shown.
    pub(super) fn seen(&self) -> u64 {
        self.seen
    }

    /// Those that are kept so far, in order, which it forgets.
    pub(super) fn drain(&mut self) -> impl Iterator<Item = T> {
        self.kept.drain(..)
    }

    /// How many are in memory.
    pub(super) fn len(&self) -> usize {
        self.kept.len()
    }

    /// Whether what is kept may still go.
    pub(super) fn may_thin(&self) -> bool {
        matches!(self.thinning, Thinning::AtMost(_))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sampled(thinning: Thinning, count: u64) -> (Vec<u64>, u64) {
        let mut sample = Sample::new(thinning);
        (0..count).for_each(|k| sample.push(k));
        let every = sample.every();
        (sample.drain().collect(), every)
    }

    #[test]
    fn every_so_many_th_is_kept() {
        assert_eq!(sampled(Thinning::Every(3), 8), (vec![0, 3, 6], 3));
        assert_eq!(sampled(Thinning::Every(0), 3), (vec![0, 1, 2], 1));
        assert_eq!(sampled(Thinning::AtMost(4), 4), (vec![0, 1, 2, 3], 1));
        assert_eq!(sampled(Thinning::AtMost(4), 5), (vec![0, 2, 4], 2));
        assert_eq!(sampled(Thinning::AtMost(4), 9), (vec![0, 4, 8], 4));
        assert_eq!(sampled(Thinning::AtMost(0), 9).0.len(), 1);
    }

    proptest! {
        #[test]
        fn a_sample_is_of_every_kth_and_between_half_and_all_of_the_most(most in 1..50_usize, count in 0..2_000_u64) {
            let (kept, every) = sampled(Thinning::AtMost(most), count);
            prop_assert!(every.is_power_of_two() && kept.len() <= most);
            prop_assert_eq!(&kept, &(0..count).step_by(every as usize).collect::<Vec<_>>());
            prop_assert!(every == 1 || 2 * (kept.len() as u64) * every + 2 * every > count);
            prop_assert!(every == 1 || count > (every / 2) * most as u64);
        }
    }
}
