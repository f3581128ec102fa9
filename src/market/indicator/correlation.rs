//! The correlation of a window.

use super::co_moments::CoMoments;
use super::{Indicator, Period};

/// The correlation of the last `period` pairs, from -1 to 1 (K. Pearson, "Regression, heredity and panmixia", Philosophical
/// Transactions of the Royal Society A 187, 1896). There is none where one side does not vary.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation(CoMoments);

impl Correlation {
    /// The correlation of the last `period` pairs.
    #[must_use]
    pub fn new(period: Period) -> Self {
        Self(CoMoments::new(period))
    }
}

impl Indicator for Correlation {
    type Input = (f64, f64);
    type Output = f64;

    #[inline]
    fn update(&mut self, input: (f64, f64)) -> Option<f64> {
        if self.0.update(input) { self.value() } else { None }
    }

    fn value(&self) -> Option<f64> {
        let scatter = self.0.scatter()?;
        let scale = scatter.xx.to_f64().sqrt() * scatter.yy.to_f64().sqrt();
        Some((scatter.xy.to_f64() / scale).clamp(-1.0, 1.0))
    }

    fn is_ready(&self) -> bool {
        self.0.is_ready()
    }

    fn reset(&mut self) {
        self.0.reset();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_correlation_of_a_window() {
        let mut correlation = Correlation::new(Period::new(3).unwrap());
        let pairs = [(9.0, 9.0), (1.0, 1.0), (2.0, 3.0), (3.0, 2.0), (4.0, 1.0), (5.0, 1.0), (6.0, 1.0)];
        let values = pairs.map(|pair| correlation.update(pair));
        // (1,1), (2,3), (3,2): 1/2. Then a line down, and a side that does not vary.
        assert!((values[3].unwrap() - 0.5).abs() < 1e-15);
        assert_eq!((values[4], values[6]), (Some(-1.0), None));
    }
}
