//! What is known of a stretch between two changes before it is seen.

use serde::{Deserialize, Serialize};

use super::RegimeError;

/// What is known of a stretch between two changes before anything of it is seen. Units are those of the series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Prior {
    /// Gaussian of unknown mean and variance: the variance is inverse-gamma of `shape` and `scale`, the mean Gaussian around
    /// `mean` with the variance over `strength`.
    NormalInverseGamma {
        /// Expected mean.
        mean: f64,
        /// Number of observations that the expected mean is worth, above 0.
        strength: f64,
        /// Half the number of observations that the expected variance is worth, above 0.
        shape: f64,
        /// Shape times the expected variance, roughly, above 0.
        scale: f64,
    },
    /// Gaussian of unknown mean and known variance.
    KnownVariance {
        /// Expected mean.
        mean: f64,
        /// Variance of means around it, above 0.
        spread: f64,
        /// Variance of observations around their mean, above 0.
        variance: f64,
    },
}

impl Prior {
    /// A weak prior of mean and variance: worth a twentieth of an observation for the mean, and two for the variance.
    #[must_use]
    pub fn weak(mean: f64, deviation: f64) -> Self {
        Self::NormalInverseGamma { mean, strength: 0.05, shape: 1.0, scale: deviation * deviation }
    }

    pub(super) fn check(self) -> Result<(), RegimeError> {
        let (mean, positive) = match self {
            Self::NormalInverseGamma { mean, strength, shape, scale } => {
                (mean, [("strength", strength), ("shape", shape), ("scale", scale)])
            }
            Self::KnownVariance { mean, spread, variance } => {
                (mean, [("spread", spread), ("variance", variance), ("variance", variance)])
            }
        };
        RegimeError::setting("mean", mean, mean.is_finite(), "any finite number")?;
        positive.into_iter().try_for_each(|(name, value)| {
            RegimeError::setting(name, value, value.is_finite() && value > 0.0, "above 0 and finite")
        })
    }
}
