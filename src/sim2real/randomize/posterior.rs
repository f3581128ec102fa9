//! What a fit found: values, how sure it is of each, and how they go together.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::{Correlation, Distribution, Randomized, Redraw, Target};
use crate::sim2real::Parameter;

/// The Gaussian posterior of parameters that were fitted together.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Posterior {
    /// Names of the parameters, those of mechanisms behind their id: `coulomb_friction.torque`.
    pub names: Vec<String>,
    /// What was found, each in the unit of its parameter.
    pub values: Vec<f64>,
    /// Standard deviations, in the same units.
    pub std: Vec<f64>,
    /// Correlations: of the second with the first, of the third with the first and the second, and so on.
    #[serde(default)]
    pub correlation: Vec<Vec<f64>>,
}

/// Why a posterior is none.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PosteriorError {
    /// Lists that do not belong together.
    #[error("expected {expected} `{key}`, one a name, found {found}\nhint: let `trueup diagnose` write it anew")]
    Length {
        /// Which list.
        key: &'static str,
        /// Number of names.
        expected: usize,
        /// Number of entries.
        found: usize,
    },
    /// A row of the triangle that is not as long as its number.
    #[error(
        "expected {row} correlations in row {row}, found {found}\nhint: the n-th row has those of parameter n + 1 with the n before it"
    )]
    Row {
        /// Which row, from 1.
        row: usize,
        /// Number of entries.
        found: usize,
    },
    /// A standard deviation that is none.
    #[error("expected a finite std of `{name}` above 0, found {found}\nhint: leave out what is known exactly")]
    Std {
        /// The parameter.
        name: String,
        /// What was found.
        found: f64,
    },
    /// A correlation that is none.
    #[error("expected a correlation between -1 and 1, found {found}\nhint: let `trueup diagnose` write it anew")]
    Correlation {
        /// What was found.
        found: f64,
    },
    /// Nothing.
    #[error("the posterior has no parameters\nhint: the fit it comes from must have found some")]
    Empty,
}

/// Correlations are written to so many digits.
const DIGITS: f64 = 1e6;

impl Posterior {
    /// The posterior of parameters of these `names`, which have this `correlation`; what has no finite standard deviation above 0
    /// is not in it.
    ///
    /// Where two go together so nearly that the digits written do not tell them apart, all correlations are brought nearer to 0,
    /// by the least power of ten that makes numbers with these correlations possible.
    #[must_use]
    pub fn of_fit(names: &[String], values: &[f64], std: &[f64], correlation: &DMatrix<f64>) -> Self {
        let known: Vec<usize> = (0..names.len()).filter(|k| std[*k].is_finite() && std[*k] > 0.0).collect();
        let written = |nearer: f64| {
            let of = |i: usize, j: usize| (correlation[(known[i], known[j])] * (1.0 - nearer) * DIGITS).round() / DIGITS;
            DMatrix::from_fn(known.len(), known.len(), |i, j| if i == j { 1.0 } else { of(i, j) })
        };
        let powers = [0.0].into_iter().chain((1..=6).rev().map(|power| 10.0_f64.powi(-power)));
        let possible = |matrix: &DMatrix<f64>| matrix.is_empty() || matrix.clone().symmetric_eigenvalues().min() > 1e-7;
        let told = powers.map(written).find(possible).unwrap_or_else(|| written(1.0));
        Self {
            names: known.iter().map(|k| names[*k].clone()).collect(),
            values: known.iter().map(|k| values[*k]).collect(),
            std: known.iter().map(|k| std[*k]).collect(),
            correlation: (1..known.len()).map(|i| (0..i).map(|j| told[(i, j)]).collect()).collect(),
        }
    }

    /// Whether nothing was fitted.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// Holds its lists to belong together and its numbers to make sense.
    ///
    /// # Errors
    /// What does not.
    pub fn check(&self) -> Result<(), PosteriorError> {
        let expected = self.names.len();
        if expected == 0 {
            return Err(PosteriorError::Empty);
        }
        for (key, found) in [("values", self.values.len()), ("std", self.std.len())] {
            if found != expected {
                return Err(PosteriorError::Length { key, expected, found });
            }
        }
        if !self.correlation.is_empty() && self.correlation.len() != expected - 1 {
            let found = self.correlation.len() + 1;
            return Err(PosteriorError::Length { key: "correlation", expected, found });
        }
        if let Some((row, cells)) = self.correlation.iter().enumerate().find(|(row, cells)| cells.len() != row + 1) {
            return Err(PosteriorError::Row { row: row + 1, found: cells.len() });
        }
        if let Some((name, found)) = self.names.iter().zip(&self.std).find(|(_, std)| !std.is_finite() || **std <= 0.0) {
            return Err(PosteriorError::Std { name: name.clone(), found: *found });
        }
        match self.correlation.iter().flatten().find(|c| c.is_nan() || c.abs() >= 1.0) {
            Some(found) => Err(PosteriorError::Correlation { found: *found }),
            None => Ok(()),
        }
    }

    /// The parameter of the `k`-th name.
    #[must_use]
    pub fn target(&self, k: usize) -> Target {
        match self.names[k].split_once('.') {
            // A controller's parameters are the twin's own, and have a dot.
            Some((mechanism, parameter)) if mechanism != "controller" => Target::of(mechanism, parameter),
            _ => Target::own(&self.names[k]),
        }
    }

    /// The `k`-th parameter, drawn from the posterior where that lies within the bounds of `parameter`: a posterior that reaches
    /// beyond is cut there, since no value beyond was ever tried.
    #[must_use]
    pub fn randomized(&self, k: usize, parameter: Parameter, at: Redraw) -> Randomized {
        let (mean, std) = (self.values[k], self.std[k]);
        let reach = Distribution::REACH * std;
        let distribution = if mean - reach >= parameter.lower && mean + reach <= parameter.upper {
            Distribution::Normal { mean, std }
        } else {
            let (low, high) = (parameter.lower.max(mean - reach), parameter.upper.min(mean + reach));
            Distribution::TruncatedNormal { mean, std, low, high }
        };
        Randomized { target: self.target(k), parameter, distribution, relative: false, at }
    }

    /// The correlations of its parameters, but those that are 0.
    #[must_use]
    pub fn correlations(&self) -> Vec<Correlation> {
        let pairs = self.correlation.iter().enumerate().flat_map(|(row, cells)| {
            let pair = move |(column, coefficient): (usize, &f64)| (row + 1, column, *coefficient);
            cells.iter().enumerate().map(pair)
        });
        let correlated = pairs.filter(|(.., coefficient)| *coefficient != 0.0);
        let whole = |(a, b, coefficient)| Correlation { between: [self.target(a), self.target(b)], coefficient };
        correlated.map(whole).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Level, Randomizer};
    use super::*;
    use crate::sim2real::Seed;

    fn posterior() -> Posterior {
        let names = ["inertia", "gain", "coulomb_friction.torque"].map(str::to_owned);
        let correlation = DMatrix::from_row_slice(3, 3, &[1.0, 0.0, -0.6, 0.0, 1.0, 0.0, -0.6, 0.0, 1.0]);
        Posterior::of_fit(&names, &[1.0, 1.0, 0.5], &[0.2, 0.0, 0.1], &correlation)
    }

    #[test]
    fn a_covariance_is_told_by_spreads_and_a_triangle() {
        let posterior = posterior();
        assert_eq!(posterior.names, ["inertia", "coulomb_friction.torque"], "what is known exactly is not in it");
        assert_eq!(posterior.correlation, [[-0.6]]);
        posterior.check().unwrap();
        assert_eq!(posterior.target(1), Target::of("coulomb_friction", "torque"));
        assert_eq!(posterior.correlations()[0].coefficient, -0.6);
    }

    #[test]
    fn draws_have_the_covariance_and_stay_within_bounds() {
        let posterior = posterior();
        let bounds =
            [Parameter::new("inertia", "", 1.0).within(0.01, 100.0), Parameter::new("torque", "", 0.5).within(0.3, 9.0)];
        let randomized =
            bounds.into_iter().enumerate().map(|(k, parameter)| posterior.randomized(k, parameter, Redraw::Reset)).collect();
        let randomizer = Randomizer::new(randomized, posterior.correlations()).unwrap();
        let table = randomizer.begin(Seed(1), 0, 5_000, 0, Level::FULL);
        let least = table.row(1).iter().copied().fold(f64::INFINITY, f64::min);
        assert!((0.3..0.31).contains(&least), "two standard deviations below the mean it is cut: {least}");
        let n = table.environments() as f64;
        let mean = |k: usize| table.row(k).iter().sum::<f64>() / n;
        assert!((mean(0) - 1.0).abs() < 0.01 && (mean(1) - 0.5).abs() < 0.01);
        let together: f64 = table.row(0).iter().zip(table.row(1)).map(|(a, b)| (a - mean(0)) * (b - mean(1))).sum();
        assert!((together / n + 0.012).abs() < 0.001, "{}", together / n);
    }

    #[test]
    fn what_always_goes_together_is_written_so_that_it_can_be_drawn() {
        let names = ["a", "b", "c"].map(str::to_owned);
        let (near, rest) = (1.0 - 1e-12, 0.5);
        let correlation = DMatrix::from_row_slice(3, 3, &[1.0, near, rest, near, 1.0, rest, rest, rest, 1.0]);
        let posterior = Posterior::of_fit(&names, &[1.0; 3], &[0.1; 3], &correlation);
        posterior.check().unwrap();
        assert!(posterior.correlation[0][0] > 0.999 && posterior.correlation[1][0] > 0.499, "{posterior:?}");
        let whole = |k: usize| posterior.randomized(k, Parameter::new("p", "", 1.0), Redraw::Reset);
        let all = (0..3).map(|k| Randomized { target: posterior.target(k), ..whole(k) }).collect();
        Randomizer::new(all, posterior.correlations()).unwrap();
    }

    #[test]
    fn what_is_no_posterior_is_refused() {
        let refused = |change: &dyn Fn(&mut Posterior), words: &str| {
            let mut wrong = posterior();
            change(&mut wrong);
            let text = wrong.check().unwrap_err().to_string();
            assert!(text.contains(words) && text.contains("\nhint: "), "{text}");
        };
        refused(&|p| p.values.push(1.0), "expected 2 `values`");
        refused(&|p| p.std.clear(), "expected 2 `std`");
        refused(&|p| p.std[1] = 0.0, "std of `coulomb_friction.torque`");
        refused(&|p| p.correlation.push(vec![0.0, 0.0]), "`correlation`");
        refused(&|p| p.correlation[0].push(0.0), "in row 1, found 2");
        refused(&|p| p.correlation[0][0] = 1.0, "found 1");
        refused(&|p| *p = Posterior::default(), "no parameters");
    }
}
