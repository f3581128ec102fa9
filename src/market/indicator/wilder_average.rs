//! Wilder's average.

use super::double_double::DoubleDouble;
use super::{Indicator, Period, is_taken};

/// Wilder's average: the mean of the first `period` numbers; then each number moves it by `1 / period` of the difference.
///
/// J. W. Wilder, New Concepts in Technical Trading Systems, 1978, which builds the RSI, the average true range and the
/// directional movement on it. It is an exponential average of `2 period - 1`.
#[derive(Debug, Clone, PartialEq)]
pub struct WilderAverage {
    period: Period,
    count: usize,
    sum: DoubleDouble,
    value: f64,
}

impl WilderAverage {
    /// The average that moves by `1 / period`.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self { period, count: 0, sum: DoubleDouble::ZERO, value: 0.0 }
    }
}

impl Indicator for WilderAverage {
    type Input = f64;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: f64) -> Option<f64> {
        if !is_taken(input) {
            return None;
        }
        if self.is_ready() {
            self.value += (input - self.value) / self.period.to_f64();
            return Some(self.value);
        }
        self.count += 1;
        self.sum += input.into();
        self.value = self.sum.to_f64() / self.count as f64;
        self.value()
    }

    fn value(&self) -> Option<f64> {
        self.is_ready().then_some(self.value)
    }

    fn is_ready(&self) -> bool {
        self.count == self.period.get()
    }

    fn reset(&mut self) {
        *self = Self::new(self.period);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_the_first_then_a_part_of_each() {
        let mut average = WilderAverage::new(Period::new(4).unwrap());
        let values = [1.0, 2.0, 3.0, 6.0, 7.0, 0.0].map(|x| average.update(x));
        assert_eq!(values, [None, None, None, Some(3.0), Some(4.0), Some(3.0)]);
    }
}
