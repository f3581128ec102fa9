//! How observations are distributed while a state lasts.

use nalgebra::{Cholesky, DMatrix};
use serde::{Deserialize, Serialize};

use super::RegimeError;

/// How observations spread around a state's mean. Units are those of the series, squared.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Spread {
    /// Columns are independent: the variance of each, `[width]`.
    Diagonal(Vec<f64>),
    /// The covariance of all columns, `[width][width]`.
    Full(Vec<Vec<f64>>),
}

/// The distribution of what is observed while a state lasts: Gaussian, or Student's t where `degrees` are given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Emission {
    /// Mean (of Student's t: the location), `[width]`.
    pub mean: Vec<f64>,
    /// Covariance; of Student's t the scale matrix, which is the covariance times (degrees - 2) / degrees.
    pub spread: Spread,
    /// Degrees of freedom of a multivariate Student's t; a Gaussian has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees: Option<f64>,
}

impl Emission {
    /// Variance of each column: infinite where degrees of freedom are 2 or less.
    #[must_use]
    pub fn variances(&self) -> Vec<f64> {
        let widened = match self.degrees {
            None => 1.0,
            Some(degrees) if degrees > 2.0 => degrees / (degrees - 2.0),
            Some(_) => f64::INFINITY,
        };
        (0..self.mean.len()).map(|column| widened * self.spread.diagonal(column)).collect()
    }

    /// The root of the sum of all variances, by which states are ordered.
    #[must_use]
    pub fn volatility(&self) -> f64 {
        self.variances().iter().sum::<f64>().sqrt()
    }

    /// Lower factor of the spread, row after row: the Cholesky factor, or the standard deviations.
    pub(super) fn factor(&self, state: usize) -> Result<DMatrix<f64>, RegimeError> {
        let width = self.mean.len();
        if let Some(found) = self.degrees.filter(|d| !(d.is_finite() && *d > 0.0)) {
            return Err(RegimeError::Spread { state, what: "number of degrees of freedom", found });
        }
        if let Some(found) = self.mean.iter().copied().find(|m| !m.is_finite()) {
            return Err(RegimeError::Spread { state, what: "mean", found });
        }
        let shape = |found: usize| RegimeError::Shape { what: "a spread", found, expected: width };
        match &self.spread {
            Spread::Diagonal(variances) => {
                if variances.len() != width {
                    return Err(shape(variances.len()));
                }
                match variances.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
                    Some(&found) => Err(RegimeError::Spread { state, what: "variance", found }),
                    None => Ok(DMatrix::from_fn(width, width, |i, j| if i == j { variances[i].sqrt() } else { 0.0 })),
                }
            }
            Spread::Full(rows) => {
                if let Some(row) = rows.iter().map(Vec::len).chain([rows.len()]).find(|len| *len != width) {
                    return Err(shape(row));
                }
                let matrix = DMatrix::from_fn(width, width, |i, j| rows[i][j]);
                let uneven = (0..width)
                    .flat_map(|i| (0..i).map(move |j| (i, j)))
                    .find(|&(i, j)| (rows[i][j] - rows[j][i]).abs() > 1e-9 * (rows[i][i] * rows[j][j]).abs().sqrt());
                if let Some((i, j)) = uneven {
                    return Err(RegimeError::Spread {
                        state,
                        what: "covariance, which is not symmetric,",
                        found: rows[i][j],
                    });
                }
                let determinant = matrix.determinant();
                match Cholesky::new(matrix) {
                    Some(cholesky) => Ok(cholesky.l()),
                    None => Err(RegimeError::Spread { state, what: "determinant of the covariance", found: determinant }),
                }
            }
        }
    }
}

impl Spread {
    /// Element (column, column).
    fn diagonal(&self, column: usize) -> f64 {
        match self {
            Self::Diagonal(variances) => variances[column],
            Self::Full(rows) => rows[column][column],
        }
    }
}
