//! Moments of a sample.

use super::defined;

/// Mean, deviation, skewness and kurtosis of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moments {
    /// Mean; NaN of nothing.
    pub mean: f64,
    /// Standard deviation, of `n - 1` degrees of freedom; NaN of fewer than two.
    pub deviation: f64,
    /// Third central moment over the power 3/2 of the second, both of the sample; none where all are alike.
    pub skewness: Option<f64>,
    /// Fourth central moment over the square of the second, 3 for a normal distribution; none where all are alike.
    pub kurtosis: Option<f64>,
}

impl Moments {
    pub fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let central = |power: i32| values.iter().map(|v| (v - mean).powi(power)).sum::<f64>();
        let squares = central(2);
        let variance = squares / count;
        Self {
            mean,
            deviation: (squares / (count - 1.0)).sqrt(),
            skewness: defined(central(3) / count / variance.powf(1.5)),
            kurtosis: defined(central(4) / count / (variance * variance)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1, 1, 1, 5: mean 2, deviations -1, -1, -1, 3. Squares 12, cubes 24, fourth powers 84: skewness 6 / 3^1.5, kurtosis
    /// 21 / 9.
    #[test]
    fn moments_are_those_by_hand() {
        let m = Moments::of(&[1.0, 1.0, 1.0, 5.0]);
        assert_eq!((m.mean, m.deviation), (2.0, 2.0));
        assert!((m.skewness.unwrap() - 6.0 / 27.0_f64.sqrt()).abs() < 1e-15);
        assert!((m.kurtosis.unwrap() - 21.0 / 9.0).abs() < 1e-15);
        assert_eq!((Moments::of(&[2.0; 5]).skewness, Moments::of(&[]).kurtosis), (None, None));
    }
}
