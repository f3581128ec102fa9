//! Runs that may be under way, and what each has learned.

use statrs::function::gamma::ln_gamma;

/// From this shape on, a difference of log-gammas is taken from its asymptotic series, which there is exact to 1e-16.
const ASYMPTOTIC: f64 = 256.0;

/// Runs that may be, the longest first: arrays over them.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Runs {
    /// Row at which each began, from 0.
    pub starts: Vec<u64>,
    /// Rows of it that were observed.
    pub seen: Vec<f64>,
    pub mean: Vec<f64>,
    /// Scale of the inverse gamma, and its logarithm.
    pub scale: Vec<f64>,
    pub log_scale: Vec<f64>,
    pub probability: Vec<f64>,
    /// Logarithm of the density of the likeliest changes that lead here.
    pub best: Vec<f64>,
}

impl Runs {
    /// Logarithm of the density of `value` under Student's t, as which an unknown variance foretells it; the run learns of it.
    #[inline]
    pub fn learn(&mut self, run: usize, value: f64, strength: f64, shape: f64, peaks: &[f64]) -> f64 {
        let (known, shape) = (strength + self.seen[run], shape + 0.5 * self.seen[run]);
        let deviation = value - self.mean[run];
        let scale = self.scale[run] + 0.5 * known / (known + 1.0) * deviation * deviation;
        let log_scale = scale.ln();
        let peak = peaks.get(self.seen[run] as usize).copied().unwrap_or_else(|| peak(known, shape));
        let foretold = peak + shape * self.log_scale[run] - (shape + 0.5) * log_scale;
        self.mean[run] += deviation / (known + 1.0);
        self.scale[run] = scale;
        self.log_scale[run] = log_scale;
        self.seen[run] += 1.0;
        foretold
    }

    /// The same of a known variance: a Gaussian, wider by what is not known of its mean.
    #[inline]
    pub fn learn_mean(&mut self, run: usize, value: f64, spread: f64, variance: f64) -> f64 {
        let unknown = 1.0 / (1.0 / spread + self.seen[run] / variance);
        let total = unknown + variance;
        let deviation = value - self.mean[run];
        self.mean[run] += deviation * unknown / total;
        self.seen[run] += 1.0;
        -0.5 * ((std::f64::consts::TAU * total).ln() + deviation * deviation / total)
    }

    /// Keeps the run at `from` at place `to`.
    pub fn shift(&mut self, from: usize, to: usize) {
        if from == to {
            return;
        }
        self.starts[to] = self.starts[from];
        for column in self.columns() {
            column[to] = column[from];
        }
    }

    /// Drops all but the first `kept`.
    pub fn truncate(&mut self, kept: usize) {
        self.starts.truncate(kept);
        for column in self.columns() {
            column.truncate(kept);
        }
    }

    fn columns(&mut self) -> [&mut Vec<f64>; 6] {
        let Self { seen, mean, scale, log_scale, probability, best, .. } = self;
        [seen, mean, scale, log_scale, probability, best]
    }
}

/// Logarithm of the factor of Student's t that depends on the number of rows alone.
pub(super) fn peak(known: f64, shape: f64) -> f64 {
    gamma_ratio(shape) - 0.5 * (std::f64::consts::TAU * (known + 1.0) / known).ln()
}

/// Logarithm of gamma(shape + 1/2) / gamma(shape).
#[inline]
fn gamma_ratio(shape: f64) -> f64 {
    if shape < ASYMPTOTIC {
        return ln_gamma(shape + 0.5) - ln_gamma(shape);
    }
    let inverse = 1.0 / shape;
    0.5 * shape.ln() - inverse / 8.0 + inverse * inverse * inverse / 192.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_asymptotic_series_joins_on() {
        for shape in [256.0, 1_000.0, 1e6] {
            let exact = ln_gamma(shape + 0.5) - ln_gamma(shape);
            assert!((gamma_ratio(shape) - exact).abs() < 1e-9 * exact.abs().max(1.0), "{shape}");
        }
        // gamma(3/2) / gamma(1) is half the root of pi.
        assert!((gamma_ratio(1.0) - (0.5 * std::f64::consts::PI.sqrt()).ln()).abs() < 1e-12);
    }
}
