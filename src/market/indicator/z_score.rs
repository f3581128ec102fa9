//! How far off the last number is.

use super::{Indicator, Period, StandardDeviation};

/// How many standard deviations the last number lies above the mean of the last `period`, itself counted; below it where
/// negative. There is none where all are equal. It lies within the root of `period - 1` on both sides (G. Samuelson,
/// "How deviant can you be?", Journal of the American Statistical Association 63, 1968).
#[derive(Debug, Clone, PartialEq)]
pub struct ZScore {
    deviation: StandardDeviation,
    last: f64,
}

impl ZScore {
    /// The score of a number among the last `period`.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self { deviation: StandardDeviation::new(period), last: 0.0 }
    }

    /// The standard deviation of the window, and its mean.
    #[must_use]
    pub fn deviation(&self) -> &StandardDeviation {
        &self.deviation
    }
}

impl Indicator for ZScore {
    type Input = f64;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: f64) -> Option<f64> {
        if !super::is_taken(input) {
            return None;
        }
        self.deviation.update(input);
        self.last = input;
        self.value()
    }

    fn value(&self) -> Option<f64> {
        let (mean, deviation) = (self.deviation.mean()?, self.deviation.value()?);
        (deviation > 0.0).then(|| (self.last - mean) / deviation)
    }

    fn is_ready(&self) -> bool {
        self.deviation.is_ready()
    }

    fn reset(&mut self) {
        self.deviation.reset();
        self.last = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_score_of_the_last_number() {
        let mut score = ZScore::new(Period::new(4).unwrap());
        let values = [1.0, 1.0, 1.0, 5.0, 1.0, 1.0, 1.0, 1.0].map(|x| score.update(x));
        let root = 3.0_f64.sqrt();
        assert!((values[3].unwrap() - root).abs() < 1e-15);
        assert!((values[4].unwrap() + 1.0 / root).abs() < 1e-15);
        assert_eq!(values[7], None);
        assert!(score.is_ready());
    }
}
