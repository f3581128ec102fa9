//! The windows of a walk-forward.

use serde::Serialize;

use crate::io::WalkForwardSection;
use crate::sim2real::Timestamp;

/// Two stretches of time: one to choose on, and a later one to try on. Each holds its start and not its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Window {
    /// Start of the training [ns since the Unix epoch, UTC].
    pub train_start: Timestamp,
    /// End of the training [ns since the Unix epoch, UTC].
    pub train_end: Timestamp,
    /// Start of the test [ns since the Unix epoch, UTC].
    pub test_start: Timestamp,
    /// End of the test [ns since the Unix epoch, UTC].
    pub test_end: Timestamp,
}

/// The windows of data known from `first` to `last`: each test begins where the one before it ended, and `purge` and
/// `embargo` after its training. The last test may be shorter than the others, because the data end.
///
/// Purge and embargo add up: a walk-forward has one border between training and test, and what is decided before it must be
/// over (purge) and forgotten (embargo) after it.
///
/// Source: Lopez de Prado, Advances in Financial Machine Learning (2018), sections 7.4 and 12.2.
#[must_use]
pub fn windows(first: Timestamp, last: Timestamp, section: &WalkForwardSection) -> Vec<Window> {
    let mut all = Vec::new();
    let gap = section.purge.saturating_add(section.embargo);
    let mut train_end = first + section.train;
    loop {
        let test_start = train_end + gap;
        if test_start > last || section.test <= 0 {
            return all;
        }
        let train_start = if section.anchored { first } else { train_end + -section.train };
        all.push(Window { train_start, train_end, test_start, test_end: test_start + section.test });
        train_end = train_end + section.test;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_roll_or_are_anchored_and_leave_a_gap() {
        let section = WalkForwardSection { train: 100, test: 30, purge: 5, embargo: 2, anchored: false };
        let shown = |section| -> Vec<[i64; 4]> {
            let all = windows(Timestamp(1_000), Timestamp(1_170), &section);
            all.iter().map(|w| [w.train_start, w.train_end, w.test_start, w.test_end].map(|t| t.0)).collect()
        };
        let rolling = [[1_000, 1_100, 1_107, 1_137], [1_030, 1_130, 1_137, 1_167], [1_060, 1_160, 1_167, 1_197]];
        assert_eq!(shown(section), rolling);
        let anchored = shown(WalkForwardSection { anchored: true, ..section });
        assert_eq!(anchored, rolling.map(|[_, b, c, d]| [1_000, b, c, d]));
        assert!(shown(WalkForwardSection { train: 200, ..section }).is_empty());
    }
}
