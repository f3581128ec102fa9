//! The exponential moving average.

use super::{Indicator, Period, Sma, is_taken};

/// The exponential moving average: each number moves it by `2 / (period + 1)` of the difference. It begins as the mean of
/// the first `period` numbers, and these weigh `((period - 1) / (period + 1))^k` after k more.
///
/// R. G. Brown, Statistical Forecasting for Inventory Control, 1959; the weight as a period, and the beginning, as in
/// J. J. Murphy, Technical Analysis of the Financial Markets, 1999, chapter 9, and in TA-Lib.
#[derive(Debug, Clone, PartialEq)]
pub struct Ema {
    weight: f64,
    beginning: Sma,
    value: Option<f64>,
}

impl Ema {
    /// The average that moves by `2 / (period + 1)`.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self { weight: 2.0 / (period.to_f64() + 1.0), beginning: Sma::new(period), value: None }
    }
}

impl Indicator for Ema {
    type Input = f64;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: f64) -> Option<f64> {
        if !is_taken(input) {
            return None;
        }
        self.value = match self.value {
            Some(value) => Some(value + self.weight * (input - value)),
            None => self.beginning.update(input),
        };
        self.value
    }

    fn value(&self) -> Option<f64> {
        self.value
    }

    fn is_ready(&self) -> bool {
        self.value.is_some()
    }

    fn reset(&mut self) {
        self.beginning.reset();
        self.value = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_moves_by_its_weight() {
        let mut ema = Ema::new(Period::new(3).unwrap());
        let values = [2.0, 4.0, 6.0, 8.0, 0.0].map(|x| ema.update(x));
        assert_eq!(values, [None, None, Some(4.0), Some(6.0), Some(3.0)]);
    }
}
