//! Wilder's relative strength index.

use super::{Indicator, Period, WilderAverage, is_taken};

/// Wilder's relative strength index, from 0 to 100: `100 U / (U + D)`, where U and D are Wilder's averages of what the
/// price rose and fell by from one input to the next (J. W. Wilder, New Concepts in Technical Trading Systems, 1978). It
/// takes `period` changes, and there is none while nothing has changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Rsi {
    last: Option<f64>,
    rises: WilderAverage,
    falls: WilderAverage,
}

impl Rsi {
    /// The index over `period` changes; 14 is usual.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self { last: None, rises: WilderAverage::new(period), falls: WilderAverage::new(period) }
    }
}

impl Indicator for Rsi {
    type Input = f64;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: f64) -> Option<f64> {
        if !is_taken(input) {
            return None;
        }
        let change = input - self.last.replace(input)?;
        self.rises.update(change.max(0.0));
        self.falls.update((-change).max(0.0));
        self.value()
    }

    fn value(&self) -> Option<f64> {
        let (rises, falls) = (self.rises.value()?, self.falls.value()?);
        (rises + falls > 0.0).then(|| 100.0 * rises / (rises + falls))
    }

    fn is_ready(&self) -> bool {
        self.falls.is_ready()
    }

    fn reset(&mut self) {
        self.last = None;
        self.rises.reset();
        self.falls.reset();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_of_all_moves_that_went_up() {
        let mut rsi = Rsi::new(Period::new(4).unwrap());
        let values = [10.0, 13.0, 12.0, 12.0, 12.0, 16.0].map(|x| rsi.update(x));
        // Averages 3/4 and 1/4; then (3 * 3/4 + 4) / 4 = 25/16 and 3/16.
        assert_eq!(values, [None, None, None, None, Some(75.0), Some(100.0 * 25.0 / 28.0)]);
        rsi.reset();
        assert_eq!([1.0; 6].map(|x| rsi.update(x))[5], None);
    }
}
