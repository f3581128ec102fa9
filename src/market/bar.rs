//! Bars: the prices of an interval, and when they could be known.

use crate::sim2real::Timestamp;

use super::Price;

/// The prices of one interval, with its two times: when it began, and when it could be known, which is when it ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bar {
    /// When the interval began: the instant of its open.
    pub open_at: Timestamp,
    /// When the interval ended: from here on a strategy may see it.
    pub known_at: Timestamp,
    /// First price.
    pub open: Price,
    /// Highest price.
    pub high: Price,
    /// Lowest price.
    pub low: Price,
    /// Last price.
    pub close: Price,
    /// Volume [units].
    pub volume: f64,
}
