//! The way of the price within a bar, of which a bar tells the ends and the extremes but not their order.

use serde::{Deserialize, Serialize};

use crate::market::{Bar, Price, Side};

/// Which extreme of a bar is taken to come first.
///
/// With one order near each extreme, as a stop and a target, this decides which of them is filled: results that depend on it are
/// counted, for the report to say how many there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Intrabar {
    /// What is worse for what is held: the low first when long, the high first when short. Without a position, what is
    /// worse for the entry that is waiting: a buyer enters first on the way up, or last on the way down.
    #[default]
    Pessimistic,
    /// What is better for it.
    Optimistic,
    /// The high first.
    HighFirst,
    /// The low first.
    LowFirst,
    /// The extreme nearer to the open first; the high where both are as near.
    NearestFirst,
}

impl Intrabar {
    /// Its word in reports.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Pessimistic => "pessimistic",
            Self::Optimistic => "optimistic",
            Self::HighFirst => "high first",
            Self::LowFirst => "low first",
            Self::NearestFirst => "nearest extreme first",
        }
    }

    /// The prices a bar is taken to pass, straight from one to the next; `held` is which way the position points, or else
    /// `entry` which way the orders that wait do.
    pub(super) fn way(self, bar: &Bar, held: Option<Side>, entry: Option<Side>) -> [Price; 4] {
        let nearest = bar.high.0 - bar.open.0 <= bar.open.0 - bar.low.0;
        // An entry at the low is worst where the high is over; held long, the loss is worst where it comes first.
        let pessimistic = match (held, entry) {
            (Some(Side::Buy), _) | (None, Some(Side::Sell)) => false,
            (Some(Side::Sell), _) | (None, Some(Side::Buy)) => true,
            (None, None) => nearest,
        };
        let high_first = match self {
            Self::Pessimistic => pessimistic,
            Self::Optimistic => !pessimistic,
            Self::HighFirst => true,
            Self::LowFirst => false,
            Self::NearestFirst => nearest,
        };
        let (first, second) = if high_first { (bar.high, bar.low) } else { (bar.low, bar.high) };
        [bar.open, first, second, bar.close]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Timestamp;

    #[test]
    fn the_worse_extreme_comes_first() {
        let bar = Bar {
            open_at: Timestamp(0),
            known_at: Timestamp(1),
            open: Price(100),
            high: Price(110),
            low: Price(95),
            close: Price(105),
            volume: 1.0,
        };
        let first = |rule: Intrabar, held, entry| rule.way(&bar, held, entry)[1].0;
        assert_eq!(first(Intrabar::Pessimistic, Some(Side::Buy), None), 95);
        assert_eq!(first(Intrabar::Pessimistic, Some(Side::Sell), Some(Side::Sell)), 110);
        assert_eq!(first(Intrabar::Pessimistic, None, Some(Side::Buy)), 110);
        assert_eq!(first(Intrabar::Optimistic, Some(Side::Buy), None), 110);
        assert_eq!(first(Intrabar::NearestFirst, Some(Side::Buy), None), 95);
        assert_eq!(Intrabar::LowFirst.way(&bar, None, None).map(|p| p.0), [100, 95, 110, 105]);
    }
}
