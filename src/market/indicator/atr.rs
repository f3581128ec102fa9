//! Wilder's average true range.

use crate::market::Bar;

use super::{Indicator, Period, WilderAverage};

/// The true range of a bar after a close [currency]: how far it reached, the gap from that close counted.
#[must_use]
pub fn true_range(close_before: f64, bar: &Bar) -> f64 {
    let (high, low) = (bar.high.to_f64(), bar.low.to_f64());
    high.max(close_before) - low.min(close_before)
}

/// The average true range [currency]: Wilder's average of the true ranges of bars (J. W. Wilder, New Concepts in Technical
/// Trading Systems, 1978). The first bar has none, as no close comes before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Atr {
    close: Option<f64>,
    average: WilderAverage,
}

impl Atr {
    /// The average over `period` true ranges; 14 is usual.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self { close: None, average: WilderAverage::new(period) }
    }
}

impl Indicator for Atr {
    type Input = Bar;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: Bar) -> Option<f64> {
        let before = self.close.replace(input.close.to_f64())?;
        self.average.update(true_range(before, &input))
    }

    fn value(&self) -> Option<f64> {
        self.average.value()
    }

    fn is_ready(&self) -> bool {
        self.average.is_ready()
    }

    fn reset(&mut self) {
        self.close = None;
        self.average.reset();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Price;
    use crate::sim2real::Timestamp;

    #[test]
    fn a_gap_counts() {
        let bar = |high: f64, low: f64, close: f64| {
            let [high, low, close] = [high, low, close].map(|p| Price::nearest(p).unwrap());
            Bar { open_at: Timestamp(0), known_at: Timestamp(1), open: close, high, low, close, volume: 0.0 }
        };
        let mut atr = Atr::new(Period::new(2).unwrap());
        let bars = [bar(11.0, 9.0, 10.0), bar(11.0, 10.0, 11.0), bar(15.0, 14.0, 14.0), bar(13.0, 12.0, 12.0)];
        // True ranges 1, 4 (from the close of 11 to 15) and 2 (from that of 14 to 12).
        assert_eq!(bars.map(|bar| atr.update(bar)), [None, None, Some(2.5), Some(2.25)]);
    }
}
