//! The return over some inputs.

use super::window::Window;
use super::{Indicator, Period, is_taken};

/// The return over `period` inputs (a fraction): the last over the one `period` before it, less 1 (J. J. Murphy, Technical
/// Analysis of the Financial Markets, 1999, chapter 10). There is none from a price of 0.
#[derive(Debug, Clone, PartialEq)]
pub struct RateOfChange {
    window: Window<f64>,
    /// The input `period` before the last, once there is one.
    base: Option<f64>,
    last: f64,
}

impl RateOfChange {
    /// The return over `period` inputs.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self { window: Window::new(period), base: None, last: 0.0 }
    }
}

impl Indicator for RateOfChange {
    type Input = f64;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: f64) -> Option<f64> {
        if !is_taken(input) {
            return None;
        }
        self.last = input;
        self.base = self.window.push(input);
        self.value()
    }

    fn value(&self) -> Option<f64> {
        let base = self.base.filter(|base| *base != 0.0)?;
        Some(self.last / base - 1.0)
    }

    fn is_ready(&self) -> bool {
        self.base.is_some()
    }

    fn reset(&mut self) {
        self.window.clear();
        (self.base, self.last) = (None, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_return_over_a_period() {
        let mut change = RateOfChange::new(Period::new(2).unwrap());
        let values = [4.0, 0.0, 5.0, 3.0].map(|x| change.update(x));
        assert_eq!(values, [None, None, Some(0.25), None]);
        assert!(change.is_ready());
    }
}
