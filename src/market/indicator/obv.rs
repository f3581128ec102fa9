//! Granville's on-balance volume.

use super::double_double::DoubleDouble;
use super::{Indicator, is_taken};

/// On-balance volume [units]: the volume of all bars that closed above the one before, less that of those that closed below
/// (J. E. Granville, New Key to Stock Market Profits, 1963). Inputs are closes and volumes. It begins with the volume of
/// the first bar, as in TA-Lib; only its changes mean anything.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Obv {
    close: Option<f64>,
    sum: DoubleDouble,
}

impl Obv {
    /// Nothing seen yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

impl Indicator for Obv {
    type Input = (f64, f64);
    type Output = f64;

    #[inline]
    fn update(&mut self, (close, volume): (f64, f64)) -> Option<f64> {
        if !is_taken(close) || !is_taken(volume) || volume < 0.0 {
            return None;
        }
        let before = self.close.replace(close);
        if before.is_none_or(|before| close > before) {
            self.sum += volume.into();
        } else if before.is_some_and(|before| close < before) {
            self.sum -= volume.into();
        }
        self.value()
    }

    fn value(&self) -> Option<f64> {
        self.is_ready().then(|| self.sum.to_f64())
    }

    fn is_ready(&self) -> bool {
        self.close.is_some()
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volume_goes_with_the_close() {
        let mut obv = Obv::new();
        let values = [(10.0, 5.0), (11.0, 7.0), (11.0, 100.0), (9.0, 4.0)].map(|input| obv.update(input));
        assert_eq!(values, [5.0, 12.0, 12.0, 8.0].map(Some));
    }
}
