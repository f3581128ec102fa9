//! The simple moving average.

use super::double_double::DoubleDouble;
use super::window::Window;
use super::{Indicator, Period, is_taken};

/// The mean of the last `period` numbers, each with the same weight (J. J. Murphy, Technical Analysis of the Financial
/// Markets, 1999, chapter 9).
#[derive(Debug, Clone, PartialEq)]
pub struct Sma {
    period: Period,
    window: Window<f64>,
    sum: DoubleDouble,
}

impl Sma {
    /// The mean of the last `period` numbers.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self { period, window: Window::new(period), sum: DoubleDouble::ZERO }
    }
}

impl Indicator for Sma {
    type Input = f64;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: f64) -> Option<f64> {
        if !is_taken(input) {
            return None;
        }
        self.sum += input.into();
        if let Some(left) = self.window.push(input) {
            self.sum -= left.into();
        }
        self.value()
    }

    fn value(&self) -> Option<f64> {
        self.is_ready().then(|| self.sum.to_f64() / self.period.to_f64())
    }

    fn is_ready(&self) -> bool {
        self.window.is_full()
    }

    fn reset(&mut self) {
        self.window.clear();
        self.sum = DoubleDouble::ZERO;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_window() {
        let mut sma = Sma::new(Period::new(3).unwrap());
        let values = [11.0, 12.0, 13.0, 17.0].map(|x| sma.update(x));
        assert_eq!(values, [None, None, Some(12.0), Some(14.0)]);
    }

    /// Numbers of very different sizes pass through the window; what is left of them after is nothing.
    #[test]
    fn ten_million_updates_leave_no_drift() {
        let mut sma = Sma::new(Period::new(50).unwrap());
        let mut state = 1_u64;
        let mut last = [0.0; 50];
        for k in 0..10_000_000_usize {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let unit = (state >> 11) as f64 * 2.0_f64.powi(-53);
            let input = if k % 1_000 == 0 { 1e9 * unit } else { 1e-3 * unit };
            last[k % 50] = input;
            sma.update(input);
        }
        let mean = last.iter().sum::<f64>() / 50.0;
        let error = (sma.value().unwrap() / mean - 1.0).abs();
        assert!(error < 1e-14, "{error:e}");
    }
}
