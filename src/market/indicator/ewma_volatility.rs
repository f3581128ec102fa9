//! The exponentially weighted volatility.

use super::{Indicator, IndicatorError, Period, is_taken};

/// The volatility of returns [per input, in their unit]: the root of the mean of their squares, weighted by `decay^k` for
/// the one `k` before the last.
///
/// J. P. Morgan, RiskMetrics Technical Document, 4th edition 1996, section 5.2, where `decay` is 0.94 for days; returns
/// count from 0 and not from their mean, as there. Weights are divided by their sum, so that the first returns weigh no
/// more than they should.
#[derive(Debug, Clone, PartialEq)]
pub struct EwmaVolatility {
    decay: f64,
    least: usize,
    count: usize,
    squares: f64,
    weights: f64,
}

impl EwmaVolatility {
    /// The volatility with weights that fall by `decay` a return, known from the first return on.
    ///
    /// # Errors
    /// If the decay is not above 0 and below 1.
    pub fn new(decay: f64) -> Result<Self, IndicatorError> {
        if !(decay > 0.0 && decay < 1.0) {
            return Err(IndicatorError::Decay(decay));
        }
        Ok(Self { decay, least: 1, count: 0, squares: 0.0, weights: 0.0 })
    }

    /// The volatility whose weights have their centre of mass `centre` returns back, which is a decay of
    /// `centre / (centre + 1)`; known once there are as many returns. Moskowitz, Ooi and Pedersen (2012) take 60 days.
    #[must_use]
    pub fn centred(centre: Period) -> Self {
        let decay = centre.to_f64() / (centre.to_f64() + 1.0);
        Self { decay, least: centre.get(), count: 0, squares: 0.0, weights: 0.0 }
    }
}

impl Indicator for EwmaVolatility {
    type Input = f64;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: f64) -> Option<f64> {
        if !is_taken(input) {
            return None;
        }
        self.count = self.count.saturating_add(1);
        self.squares = self.decay * self.squares + input * input;
        self.weights = self.decay * self.weights + 1.0;
        self.value()
    }

    fn value(&self) -> Option<f64> {
        self.is_ready().then(|| (self.squares / self.weights).sqrt())
    }

    fn is_ready(&self) -> bool {
        self.count >= self.least
    }

    fn reset(&mut self) {
        (self.count, self.squares, self.weights) = (0, 0.0, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_fade_by_the_decay() {
        let mut volatility = EwmaVolatility::new(0.5).unwrap();
        let values = [3.0, -4.0, 0.0].map(|x| volatility.update(x).unwrap());
        // (16 + 9/2) / (3/2), (0 + 16/2 + 9/4) / (7/4)
        let expected = [3.0, (41.0_f64 / 3.0).sqrt(), (41.0_f64 / 7.0).sqrt()];
        assert!(values.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{values:?}");
        let mut centred = EwmaVolatility::centred(Period::new(2).unwrap());
        assert_eq!(centred.update(1.0), None);
        // (4 + 2/3) / (1 + 2/3)
        assert!((centred.update(2.0).unwrap() - (14.0_f64 / 5.0).sqrt()).abs() < 1e-15);
        for bad in [0.0, 1.0, -0.5, f64::NAN] {
            assert!(EwmaVolatility::new(bad).is_err(), "{bad}");
        }
    }
}
