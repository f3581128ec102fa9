//! Distributions of one number.

use serde::Serialize;

use super::normal::{normal_cdf, normal_quantile};
use crate::sim2real::elementary::exp;

/// How a number is distributed. Units are those of the parameter it is of; of a relative one, the nominal value.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "distribution", rename_all = "snake_case")]
pub enum Distribution {
    /// Always the same.
    Constant {
        /// The value.
        value: f64,
    },
    /// Anywhere between two ends alike.
    Uniform {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// The logarithm is uniform: each factor is as likely anywhere between the ends, which are above 0.
    LogUniform {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// Gaussian. What is drawn lies within [`Distribution::REACH`] standard deviations.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        std: f64,
    },
    /// Gaussian, given that it lies between two ends: what is beyond is drawn again, not moved to the end.
    TruncatedNormal {
        /// Mean before it is cut.
        mean: f64,
        /// Standard deviation before it is cut.
        std: f64,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// The logarithm is Gaussian.
    LogNormal {
        /// Median, above 0.
        median: f64,
        /// Standard deviation of the natural logarithm: 0.1 is about 10 %.
        sigma: f64,
    },
    /// One of some values.
    Choice {
        /// The values.
        values: Vec<f64>,
        /// How often each is drawn, in any unit; empty where all are alike.
        weights: Vec<f64>,
    },
}

/// Why a distribution is none.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DistributionError {
    /// A number that is none, or infinite.
    #[error("expected a finite `{key}`, found {found}\nhint: every number of a distribution must be finite")]
    NotFinite {
        /// Which.
        key: &'static str,
        /// What was found.
        found: f64,
    },
    /// Ends in the wrong order, or in the same place.
    #[error(
        "expected `low` below `high`, found {low} and {high}\nhint: swap them; for one value alone say distribution = \"constant\""
    )]
    Ends {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// A number that must be above 0.
    #[error("expected `{key}` above 0, found {found}\nhint: {hint}")]
    NotPositive {
        /// Which.
        key: &'static str,
        /// What was found.
        found: f64,
        /// What to do.
        hint: &'static str,
    },
    /// Next to nothing of the Gaussian lies between the ends.
    #[error(
        "next to nothing of a normal distribution of mean {mean} and std {std} lies between {low} and {high}\nhint: move the ends to where the mean is, or draw uniformly between them"
    )]
    NothingWithin {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        std: f64,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// Nothing to choose from.
    #[error("there is nothing to choose from\nhint: values = [1.0, 2.0]")]
    NoValues,
    /// Not a weight a value.
    #[error("expected {values} weights, one a value, found {weights}\nhint: leave `weights` out where all values are alike")]
    Weights {
        /// Number of values.
        values: usize,
        /// Number of weights.
        weights: usize,
    },
    /// Weights that cannot be.
    #[error(
        "expected weights that are not negative and not all 0, found {found}\nhint: a value that is never drawn can be left out"
    )]
    Weight {
        /// The weight, or the sum.
        found: f64,
    },
}

impl Distribution {
    /// Standard deviations within which a Gaussian is drawn: a number in (0, 1) with 52 bits reaches no further.
    pub const REACH: f64 = 8.3;

    /// Its name in documents.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Constant { .. } => "constant",
            Self::Uniform { .. } => "uniform",
            Self::LogUniform { .. } => "log_uniform",
            Self::Normal { .. } => "normal",
            Self::TruncatedNormal { .. } => "truncated_normal",
            Self::LogNormal { .. } => "log_normal",
            Self::Choice { .. } => "choice",
        }
    }

    /// Holds its numbers to make a distribution.
    ///
    /// # Errors
    /// Numbers that are not finite; ends that are reversed or the same; widths and medians that are not above 0; a Gaussian of
    /// which nothing lies between the ends; weights that are none.
    pub fn check(&self) -> Result<(), DistributionError> {
        for (key, found) in self.numbers() {
            if !found.is_finite() {
                return Err(DistributionError::NotFinite { key, found });
            }
        }
        let positive = |key, found: f64, hint| match found > 0.0 {
            true => Ok(()),
            false => Err(DistributionError::NotPositive { key, found, hint }),
        };
        let wide = "a spread of 0 is distribution = \"constant\"";
        let ends = |low: f64, high: f64| if low < high { Ok(()) } else { Err(DistributionError::Ends { low, high }) };
        match self {
            Self::Constant { .. } => Ok(()),
            Self::Uniform { low, high } => ends(*low, *high),
            Self::LogUniform { low, high } => {
                positive("low", *low, "a logarithm needs ends above 0; say distribution = \"uniform\"")?;
                ends(*low, *high)
            }
            Self::Normal { std, .. } => positive("std", *std, wide),
            Self::TruncatedNormal { mean, std, low, high } => {
                positive("std", *std, wide)?;
                ends(*low, *high)?;
                let part = normal_cdf((high - mean) / std) - normal_cdf((low - mean) / std);
                if part < 1e-12 {
                    return Err(DistributionError::NothingWithin { mean: *mean, std: *std, low: *low, high: *high });
                }
                Ok(())
            }
            Self::LogNormal { median, sigma } => {
                positive("median", *median, "a logarithm needs a median above 0; say distribution = \"normal\"")?;
                positive("sigma", *sigma, wide)
            }
            Self::Choice { values, weights } => {
                if values.is_empty() {
                    return Err(DistributionError::NoValues);
                }
                if !weights.is_empty() && weights.len() != values.len() {
                    return Err(DistributionError::Weights { values: values.len(), weights: weights.len() });
                }
                if let Some(found) = weights.iter().find(|weight| **weight < 0.0) {
                    return Err(DistributionError::Weight { found: *found });
                }
                let sum: f64 = weights.iter().sum();
                if !weights.is_empty() && (sum <= 0.0 || !sum.is_finite()) {
                    return Err(DistributionError::Weight { found: sum });
                }
                Ok(())
            }
        }
    }

    fn numbers(&self) -> Vec<(&'static str, f64)> {
        match self {
            Self::Constant { value } => vec![("value", *value)],
            Self::Uniform { low, high } | Self::LogUniform { low, high } => vec![("low", *low), ("high", *high)],
            Self::Normal { mean, std } => vec![("mean", *mean), ("std", *std)],
            Self::TruncatedNormal { mean, std, low, high } => {
                vec![("mean", *mean), ("std", *std), ("low", *low), ("high", *high)]
            }
            Self::LogNormal { median, sigma } => vec![("median", *median), ("sigma", *sigma)],
            Self::Choice { values, weights } => {
                values.iter().map(|v| ("values", *v)).chain(weights.iter().map(|w| ("weights", *w))).collect()
            }
        }
    }

    /// The least and the largest value that can be drawn.
    #[must_use]
    pub fn support(&self) -> [f64; 2] {
        match self {
            Self::Constant { value } => [*value, *value],
            Self::Uniform { low, high } | Self::LogUniform { low, high } | Self::TruncatedNormal { low, high, .. } => {
                [*low, *high]
            }
            Self::Normal { mean, std } => [mean - Self::REACH * std, mean + Self::REACH * std],
            Self::LogNormal { median, sigma } => {
                let factor = (Self::REACH * sigma).exp();
                [median / factor, median * factor]
            }
            Self::Choice { values, weights } => {
                let drawn = values.iter().enumerate().filter(|(k, _)| weights.get(*k).is_none_or(|w| *w > 0.0));
                drawn.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (_, v)| [low.min(*v), high.max(*v)])
            }
        }
    }

    /// Whether it is told in factors: a way to its values goes by factors too.
    pub(super) fn by_factors(&self) -> bool {
        matches!(self, Self::LogUniform { .. } | Self::LogNormal { .. })
    }

    /// The distribution made ready for many draws.
    pub(super) fn inverse(&self) -> Inverse {
        match self {
            Self::Constant { value } => Inverse::Constant(*value),
            Self::Uniform { low, high } => Inverse::Uniform { low: *low, high: *high },
            Self::LogUniform { low, high } => {
                Inverse::LogUniform { low: *low, high: *high, from: low.ln(), width: high.ln() - low.ln() }
            }
            Self::Normal { mean, std } => Inverse::Normal { mean: *mean, std: *std },
            Self::TruncatedNormal { mean, std, low, high } => {
                let below = normal_cdf((low - mean) / std);
                let within = normal_cdf((high - mean) / std) - below;
                let beyond = normal_cdf(-(high - mean) / std);
                let above = [beyond, normal_cdf(-(low - mean) / std) - beyond];
                let cut = Cut { low: *low, high: *high, below, within, above };
                Inverse::TruncatedNormal { mean: *mean, std: *std, cut }
            }
            Self::LogNormal { median, sigma } => Inverse::LogNormal { mean: median.ln(), sigma: *sigma },
            Self::Choice { values, weights } => {
                let weight = |k: usize| weights.get(k).copied().unwrap_or(1.0);
                let total: f64 = (0..values.len()).map(weight).sum();
                let mut sum = 0.0;
                let upto = |k| {
                    sum += weight(k) / total;
                    sum
                };
                let cumulative = (0..values.len()).map(upto).collect();
                Inverse::Choice { values: values.clone(), cumulative }
            }
        }
    }
}

/// What is left of a normal distribution between two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cut {
    pub low: f64,
    pub high: f64,
    /// The part of the whole below the lower end.
    below: f64,
    /// The part between them.
    within: f64,
    /// The part above the upper end, and that between them told from above.
    above: [f64; 2],
}

impl Cut {
    /// The part of the whole, from the nearer end of it, beyond which a part `u` of what is left lies: below, where the side is 1, or above,
    /// where it is -1, since parts near to 1 have no more digits to tell them from below.
    #[inline(always)]
    pub fn part(&self, u: f64) -> (f64, f64) {
        let part = self.below + u * self.within;
        let [beyond, between] = self.above;
        if part <= 0.5 { (part, 1.0) } else { (beyond + (1.0 - u) * between, -1.0) }
    }
}

/// From a number in (0, 1) to a value, and from a standard normal one.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Inverse {
    Constant(f64),
    Uniform { low: f64, high: f64 },
    LogUniform { low: f64, high: f64, from: f64, width: f64 },
    Normal { mean: f64, std: f64 },
    TruncatedNormal { mean: f64, std: f64, cut: Cut },
    LogNormal { mean: f64, sigma: f64 },
    Choice { values: Vec<f64>, cumulative: Vec<f64> },
}

impl Inverse {
    /// The value below which a part `u` of all draws lies.
    #[inline]
    pub fn at(&self, u: f64) -> f64 {
        match self {
            Self::Constant(value) => *value,
            Self::Uniform { low, high } => uniform_at(u, *low, *high),
            Self::LogUniform { low, high, from, width } => log_uniform_at(u, [*low, *high], *from, *width),
            Self::Normal { mean, std } => mean + std * normal_quantile(u),
            Self::TruncatedNormal { mean, std, cut } => {
                let (part, side) = cut.part(u);
                within(mean + std * side * normal_quantile(part), cut.low, cut.high)
            }
            Self::LogNormal { mean, sigma } => (mean + sigma * normal_quantile(u)).exp(),
            Self::Choice { values, cumulative } => {
                let at = cumulative.partition_point(|upto| *upto <= u).min(values.len() - 1);
                values[at]
            }
        }
    }

    /// Whether the copula's normal numbers make values as they are, where others take the parts that lie below them.
    pub fn takes_normal(&self) -> bool {
        match self {
            Self::Normal { .. } | Self::LogNormal { .. } => true,
            // Nothing is cut off.
            Self::TruncatedNormal { cut, .. } => cut.within >= 1.0,
            _ => false,
        }
    }

    /// The value of which the copula says `z`, a standard normal number.
    #[inline]
    pub fn at_normal(&self, z: f64) -> f64 {
        match self {
            Self::Normal { mean, std } => mean + std * z,
            Self::LogNormal { mean, sigma } => (mean + sigma * z).exp(),
            Self::TruncatedNormal { mean, std, cut } if self.takes_normal() => within(mean + std * z, cut.low, cut.high),
            other => other.at(open(normal_cdf(z))),
        }
    }
}

/// The value between two ends below which a part `u` lies. Rounding may not lead beyond the ends; `clamp` would ask of every number
/// whether they are in order.
#[inline(always)]
pub(super) fn uniform_at(u: f64, low: f64, high: f64) -> f64 {
    within(low + u * (high - low), low, high)
}

/// The same where logarithms are uniform, `from` and on for `width`.
#[inline(always)]
pub(super) fn log_uniform_at(u: f64, [low, high]: [f64; 2], from: f64, width: f64) -> f64 {
    let log = from + u * width;
    within(exp(if log < LARGEST_LOG { log } else { LARGEST_LOG }), low, high)
}

/// As far as exponentials are told.
const LARGEST_LOG: f64 = 708.0;

#[inline(always)]
pub(super) fn within(value: f64, low: f64, high: f64) -> f64 {
    let value = if value < low { low } else { value };
    if value > high { high } else { value }
}

/// `part`, which may be rounded to an end of (0, 1), where it is in it.
#[inline(always)]
pub(super) fn open(part: f64) -> f64 {
    part.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0)
}

#[cfg(test)]
#[path = "distribution_tests.rs"]
mod tests;
