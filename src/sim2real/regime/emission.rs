//! How observations are distributed while a state lasts, and densities made ready to be evaluated.

use nalgebra::{Cholesky, DMatrix};
use serde::{Deserialize, Serialize};
use statrs::function::gamma::ln_gamma;

use super::RegimeError;
use super::observations::is_lost;

/// Squared distances are cut here, so that a density is never 0 in all states at once.
const FARTHEST: f64 = 1e300;

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

/// The densities of all states, made ready: arrays over states, nothing allocated when one is evaluated.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Densities {
    width: usize,
    /// `[state][column]`.
    means: Vec<f64>,
    /// What makes deviations white, the inverse of the factor: its diagonal `[state][column]`, or its lower triangle row
    /// after row, `[state][width (width + 1) / 2]`.
    whitening: Vec<f64>,
    triangular: bool,
    /// Logarithm of the density at the mean.
    peaks: Vec<f64>,
    /// The largest of them: no density is above it.
    pub highest: f64,
    /// Degrees of freedom, where the states have any.
    pub degrees: Option<Vec<f64>>,
}

impl Densities {
    pub fn new(emissions: &[Emission]) -> Result<Self, RegimeError> {
        let width = emissions.first().map_or(0, |e| e.mean.len());
        if width == 0 {
            return Err(RegimeError::Shape { what: "states", found: 0, expected: 1 });
        }
        let triangular = emissions.iter().any(|e| matches!(e.spread, Spread::Full(_)));
        let heavy = emissions.iter().any(|e| e.degrees.is_some());
        let mut densities = Self {
            width,
            means: vec![],
            whitening: vec![],
            triangular,
            peaks: vec![],
            highest: f64::NEG_INFINITY,
            degrees: heavy.then(Vec::new),
        };
        for (state, emission) in emissions.iter().enumerate() {
            if emission.mean.len() != width {
                return Err(RegimeError::Shape { what: "a mean", found: emission.mean.len(), expected: width });
            }
            let factor = emission.factor(state)?;
            let determinant: f64 = factor.diagonal().iter().map(|d| d.ln()).sum();
            let inverse = factor.solve_lower_triangular(&DMatrix::identity(width, width)).ok_or(RegimeError::Spread {
                state,
                what: "variance",
                found: 0.0,
            })?;
            densities.means.extend(&emission.mean);
            for row in 0..width {
                let from = if triangular { 0 } else { row };
                densities.whitening.extend((from..=row).map(|column| inverse[(row, column)]));
            }
            let wide = width as f64;
            let peak = match emission.degrees {
                None => -0.5 * wide * std::f64::consts::TAU.ln(),
                Some(nu) => ln_gamma(0.5 * (nu + wide)) - ln_gamma(0.5 * nu) - 0.5 * wide * (nu * std::f64::consts::PI).ln(),
            };
            densities.peaks.push(peak - determinant);
            densities.highest = densities.highest.max(peak - determinant);
            if let Some(degrees) = &mut densities.degrees {
                let Some(nu) = emission.degrees else {
                    return Err(RegimeError::Shape {
                        what: "states with degrees of freedom",
                        found: state,
                        expected: emissions.len(),
                    });
                };
                degrees.push(nu);
            }
        }
        Ok(densities)
    }

    /// Squared Mahalanobis distance of a row from the mean of a state.
    #[inline]
    pub fn distance(&self, state: usize, row: &[f64]) -> f64 {
        let means = &self.means[state * self.width..][..self.width];
        if self.width == 1 {
            let white = (row[0] - means[0]) * self.whitening[state];
            return (white * white).min(FARTHEST);
        }
        let mut sum = 0.0;
        if self.triangular {
            let size = self.width * (self.width + 1) / 2;
            let mut rest = &self.whitening[state * size..][..size];
            for line in 1..=self.width {
                let (weights, after) = rest.split_at(line);
                let white: f64 = weights.iter().zip(row.iter().zip(means)).map(|(w, (x, m))| w * (x - m)).sum();
                sum += white * white;
                rest = after;
            }
        } else {
            let whitening = &self.whitening[state * self.width..][..self.width];
            for ((x, m), w) in row.iter().zip(means).zip(whitening) {
                let white = (x - m) * w;
                sum += white * white;
            }
        }
        sum.min(FARTHEST)
    }

    /// Writes the logarithm of each state's density at `row`; 0 in all states where the row was lost.
    #[inline(always)]
    pub fn logarithms(&self, row: &[f64], into: &mut [f64]) {
        self.evaluate(row, into, 0.0, |log| log);
    }

    /// Writes each state's density at `row` over the highest that any has; the same in all states where the row was lost.
    #[inline(always)]
    pub fn weights(&self, row: &[f64], into: &mut [f64]) {
        self.evaluate(row, into, self.highest, f64::exp);
    }

    #[inline(always)]
    fn evaluate(&self, row: &[f64], into: &mut [f64], less: f64, of: impl Fn(f64) -> f64) {
        let states = into.len();
        if is_lost(row) {
            into.fill(of(0.0));
        } else if let Some(degrees) = &self.degrees {
            let wide = self.width as f64;
            for (state, value) in into.iter_mut().enumerate() {
                let nu = degrees[state];
                *value = of(self.peaks[state] - less - 0.5 * (nu + wide) * (self.distance(state, row) / nu).ln_1p());
            }
        } else if let [x] = row {
            // Most series have one column: no more is done than must be.
            let (means, whitening, peaks) = (&self.means[..states], &self.whitening[..states], &self.peaks[..states]);
            for (((value, mean), whiten), peak) in into.iter_mut().zip(means).zip(whitening).zip(peaks) {
                let white = (x - mean) * whiten;
                *value = of(peak - less - 0.5 * (white * white).min(FARTHEST));
            }
        } else {
            for (state, value) in into.iter_mut().enumerate() {
                *value = of(self.peaks[state] - less - 0.5 * self.distance(state, row));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{Continuous, Normal, StudentsT};

    fn logarithm(emission: Emission, row: &[f64]) -> f64 {
        let mut log = [f64::NAN];
        Densities::new(&[emission]).unwrap().logarithms(row, &mut log);
        log[0]
    }

    #[test]
    fn densities_are_those_of_the_distributions() {
        let emission = Emission { mean: vec![1.5], spread: Spread::Diagonal(vec![4.0]), degrees: None };
        let expected = Normal::new(1.5, 2.0).unwrap().ln_pdf(-0.7);
        assert!((logarithm(emission.clone(), &[-0.7]) - expected).abs() < 1e-12);
        let heavy = Emission { degrees: Some(3.5), ..emission };
        let expected = StudentsT::new(1.5, 2.0, 3.5).unwrap().ln_pdf(-0.7);
        assert!((logarithm(heavy, &[-0.7]) - expected).abs() < 1e-9);
    }

    /// By hand: determinant 3, inverse [[2, -1], [-1, 2]] / 3, at (1, -1): (2 + 2 + 2) / 3 = 2.
    #[test]
    fn a_full_covariance_by_hand() {
        let spread = Spread::Full(vec![vec![2.0, 1.0], vec![1.0, 2.0]]);
        let emission = Emission { mean: vec![0.0, 0.0], spread, degrees: None };
        let expected = -std::f64::consts::TAU.ln() - 0.5 * 3.0_f64.ln() - 1.0;
        assert!((logarithm(emission, &[1.0, -1.0]) - expected).abs() < 1e-12);
        // A diagonal one is the product over its columns.
        let emission = Emission { mean: vec![0.0, 1.0], spread: Spread::Diagonal(vec![1.0, 9.0]), degrees: None };
        let expected = Normal::new(0.0, 1.0).unwrap().ln_pdf(0.3) + Normal::new(1.0, 3.0).unwrap().ln_pdf(4.0);
        assert!((logarithm(emission, &[0.3, 4.0]) - expected).abs() < 1e-12);
    }

    #[test]
    fn what_spreads_cannot_be() {
        let of = |spread, degrees| Densities::new(&[Emission { mean: vec![0.0, 0.0], spread, degrees }]).map(|_| ());
        let zero = of(Spread::Diagonal(vec![1.0, 0.0]), None);
        assert_eq!(zero, Err(RegimeError::Spread { state: 0, what: "variance", found: 0.0 }));
        assert!(of(Spread::Diagonal(vec![1.0]), None).unwrap_err().to_string().contains("1, where 2 are expected"));
        let flat = of(Spread::Full(vec![vec![1.0, 1.0], vec![1.0, 1.0]]), None).unwrap_err();
        assert!(flat.to_string().contains("determinant of the covariance is 0"), "{flat}");
        let skew = of(Spread::Full(vec![vec![1.0, 0.5], vec![0.2, 1.0]]), None).unwrap_err();
        assert!(skew.to_string().contains("not symmetric"), "{skew}");
        assert!(of(Spread::Diagonal(vec![1.0; 2]), Some(0.0)).is_err());
    }

    #[test]
    fn a_lost_row_says_nothing() {
        let states = [(0.0, 1.0), (3.0, 2.0)].map(|(mean, variance)| Emission {
            mean: vec![mean],
            spread: Spread::Diagonal(vec![variance]),
            degrees: None,
        });
        let mut logs = [f64::NAN; 2];
        Densities::new(&states).unwrap().logarithms(&[f64::NAN], &mut logs);
        assert_eq!(logs, [0.0; 2]);
        // And one that is too far from any is of no state, but breaks nothing.
        Densities::new(&states).unwrap().logarithms(&[1e200], &mut logs);
        assert!(logs.iter().all(|l| l.is_finite()), "{logs:?}");
    }
}
