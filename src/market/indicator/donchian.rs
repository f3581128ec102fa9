//! Donchian's channel.

use crate::market::Bar;

use super::{Indicator, Period, RollingMaximum, RollingMinimum};

/// Donchian's channel: the highest high and the lowest low of the last `period` bars, the newest counted, and the middle
/// between (R. D. Donchian, "High finance in copper", Financial Analysts Journal 16(6), 1960).
///
/// A rule that buys above the channel compares with the channel of the bar before: no bar is above one it is part of.
#[derive(Debug, Clone, PartialEq)]
pub struct Donchian {
    highest: RollingMaximum,
    lowest: RollingMinimum,
}

/// A range of prices [currency].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// The highest high.
    pub upper: f64,
    /// Midway between.
    pub middle: f64,
    /// The lowest low.
    pub lower: f64,
}

impl Donchian {
    /// The channel of the last `period` bars.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self { highest: RollingMaximum::new(period), lowest: RollingMinimum::new(period) }
    }
}

impl Indicator for Donchian {
    type Input = Bar;
    type Output = Channel;

    #[inline]
    fn update(&mut self, input: Bar) -> Option<Channel> {
        self.highest.update(input.high.to_f64());
        self.lowest.update(input.low.to_f64());
        self.value()
    }

    fn value(&self) -> Option<Channel> {
        let (upper, lower) = (self.highest.value()?, self.lowest.value()?);
        Some(Channel { upper, middle: 0.5 * (upper + lower), lower })
    }

    fn is_ready(&self) -> bool {
        self.highest.is_ready()
    }

    fn reset(&mut self) {
        self.highest.reset();
        self.lowest.reset();
    }
}
