//! The standard deviation of a window.

use super::double_double::DoubleDouble;
use super::window::Window;
use super::{Indicator, Period, is_taken};

/// The standard deviation of the last `period` numbers as a population: the root of their mean squared distance from
/// their mean, divided by `period` and not by one less. Bollinger's bands and TA-Lib's `STDDEV` take it so too.
///
/// Sums of numbers and of squares are kept in 106 bits. After ten million updates the variance is off by about 1e-24 of
/// the mean square: below 1e-9 of itself while the deviation is above 1e-7 of the mean. A window of equal numbers has a
/// deviation of exactly 0.
#[derive(Debug, Clone, PartialEq)]
pub struct StandardDeviation {
    period: Period,
    window: Window<f64>,
    sum: DoubleDouble,
    squares: DoubleDouble,
    last: f64,
    /// Numbers at the end of the window that are equal to the last.
    equal: usize,
}

impl StandardDeviation {
    /// The standard deviation of the last `period` numbers.
    #[must_use]
    pub fn new(period: Period) -> Self {
        let (sum, squares) = (DoubleDouble::ZERO, DoubleDouble::ZERO);
        Self { period, window: Window::new(period), sum, squares, last: 0.0, equal: 0 }
    }

    /// Their mean, once there are enough.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        self.is_ready().then(|| self.sum.to_f64() / self.period.to_f64())
    }

    /// Their variance, once there are enough.
    #[must_use]
    pub fn variance(&self) -> Option<f64> {
        if !self.is_ready() {
            return None;
        }
        if self.equal >= self.period.get() {
            return Some(0.0);
        }
        let count = self.period.to_f64();
        let spread = self.squares * count.into() - self.sum * self.sum;
        Some((spread.to_f64() / (count * count)).max(0.0))
    }
}

impl Indicator for StandardDeviation {
    type Input = f64;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: f64) -> Option<f64> {
        if !is_taken(input) {
            return None;
        }
        self.equal = if input == self.last { self.equal.saturating_add(1) } else { 1 };
        self.last = input;
        self.sum += input.into();
        self.squares += DoubleDouble::product(input, input);
        if let Some(left) = self.window.push(input) {
            self.sum -= left.into();
            self.squares -= DoubleDouble::product(left, left);
        }
        self.value()
    }

    fn value(&self) -> Option<f64> {
        self.variance().map(f64::sqrt)
    }

    fn is_ready(&self) -> bool {
        self.window.is_full()
    }

    fn reset(&mut self) {
        self.window.clear();
        (self.sum, self.squares) = (DoubleDouble::ZERO, DoubleDouble::ZERO);
        (self.last, self.equal) = (0.0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_deviation_of_a_window() {
        let mut deviation = StandardDeviation::new(Period::new(8).unwrap());
        for x in [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0] {
            assert_eq!(deviation.update(x), None);
        }
        assert_eq!((deviation.update(9.0), deviation.mean()), (Some(2.0), Some(5.0)));
    }

    #[test]
    fn equal_numbers_deviate_by_exactly_nothing_whatever_came_before() {
        let mut deviation = StandardDeviation::new(Period::new(3).unwrap());
        for x in [1e9 / 7.0, 1e-9 / 3.0, 0.1, 0.1] {
            assert_ne!(deviation.update(x), Some(0.0));
        }
        assert_eq!(deviation.update(0.1), Some(0.0));
    }

    /// A price of about 60,000 with ticks of 0.01, which no float is, ten million times.
    #[test]
    fn ten_million_updates_leave_no_drift() {
        let mut deviation = StandardDeviation::new(Period::new(20).unwrap());
        let mut state = 1_u64;
        let mut last = [0.0; 20];
        for k in 0..10_000_000_usize {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let price = (6_000_000 + (state >> 61)) as f64 * 0.01;
            last[k % 20] = price;
            deviation.update(price);
        }
        let mean = last.iter().sum::<f64>() / 20.0;
        let variance = last.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 20.0;
        let error = (deviation.variance().unwrap() / variance - 1.0).abs();
        assert!(error < 1e-9, "{error:e}");
    }
}
