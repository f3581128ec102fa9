//! What is fitted to a series, and how.

use serde::{Deserialize, Serialize};

use super::RegimeError;
use crate::sim2real::Seed;

/// What is observed in each state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Gaussian, columns independent.
    Gaussian,
    /// Gaussian with a covariance of all columns.
    GaussianFull,
    /// Student's t, columns uncorrelated: one far column makes a row far.
    StudentT(Degrees),
}

/// Degrees of freedom of Student's t.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Degrees {
    /// Each state's own, fitted between 2.1 and 200.
    Fitted,
    /// The same in all states, above 0.
    Fixed(f64),
}

/// What to fit, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Number of states, from 1.
    pub states: usize,
    /// What is observed in each.
    pub family: Family,
    /// Number of starts, from 1: the first two by rank of level and of scale, the others drawn.
    pub starts: usize,
    /// Most iterations.
    pub iterations: usize,
    /// It has converged once the log-likelihood gains no more than this in an iteration [1/observed row]. Relative to rows,
    /// not to the log-likelihood itself, which is near 0 in some units of the series.
    pub tolerance: f64,
    /// Least variance in a state [variance of the whole series]. Without it, a state that keeps one row grows infinitely likely.
    pub floor: f64,
    /// Source of the starts that are drawn.
    pub seed: Seed,
}

impl Settings {
    /// `states` states with Gaussian columns: 6 starts, 500 iterations, a tolerance of 1e-8, a floor of 1e-6.
    #[must_use]
    pub fn new(states: usize) -> Self {
        Self { states, family: Family::Gaussian, starts: 6, iterations: 500, tolerance: 1e-8, floor: 1e-6, seed: Seed(0) }
    }

    pub(super) fn check(&self) -> Result<(), RegimeError> {
        let whole = "a whole number from 1";
        RegimeError::setting("states", self.states as f64, self.states >= 1, whole)?;
        RegimeError::setting("starts", self.starts as f64, self.starts >= 1, whole)?;
        RegimeError::setting("iterations", self.iterations as f64, self.iterations >= 1, whole)?;
        let tolerates = self.tolerance >= 0.0 && self.tolerance.is_finite();
        RegimeError::setting("tolerance", self.tolerance, tolerates, "0 or above, such as 1e-8")?;
        RegimeError::setting("floor", self.floor, self.floor > 0.0 && self.floor < 1.0, "between 0 and 1, such as 1e-6")?;
        if let Family::StudentT(Degrees::Fixed(degrees)) = self.family {
            RegimeError::setting("degrees", degrees, degrees > 0.0 && degrees.is_finite(), "above 0, such as 5")?;
        }
        Ok(())
    }
}
