//! Mean and spread of values of which only bounds are known.

use statrs::distribution::{Continuous, ContinuousCDF, Normal};

/// Between which values one lies; the upper bound may be infinite, and where both are the same it is known.
pub(super) type Bounds = (f64, f64);

/// A normal distribution of values that are known between bounds, of largest likelihood (Dempster, Laird & Rubin, "Maximum
/// likelihood from incomplete data via the EM algorithm", JRSS B 39 (1977)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spread {
    pub mean: f64,
    pub std: f64,
    pub log_likelihood: f64,
}

/// Values are told no more finely than this.
const FINEST: f64 = 0.05;
/// Between bounds closer than this part of a standard deviation the density is flat.
const FLAT: f64 = 0.05;
/// Steps of the fit, and the change of a step at which it ends.
const STEPS: usize = 1_000;
const SETTLED: f64 = 1e-7;

impl Spread {
    /// Of values between `bounds`, with that `mean` where it is given; none of no values.
    pub fn fit(bounds: &[Bounds], mean: Option<f64>) -> Option<Self> {
        if bounds.is_empty() {
            return None;
        }
        let count = bounds.len() as f64;
        let start = bounds.iter().map(|(low, high)| if high.is_finite() { 0.5 * (low + high) } else { *low });
        let mut spread = Self { mean: mean.unwrap_or(start.sum::<f64>() / count), std: 0.5, log_likelihood: 0.0 };
        for _ in 0..STEPS {
            let inside: Vec<Inside> = bounds.iter().map(|bounds| spread.inside(*bounds)).collect();
            let middle = mean.unwrap_or(inside.iter().map(|one| one.mean).sum::<f64>() / count);
            let square = |one: &Inside| one.variance + (one.mean - middle).powi(2);
            let std = (inside.iter().map(square).sum::<f64>() / count).sqrt().max(FINEST);
            let change = (middle - spread.mean).abs() + (std - spread.std).abs();
            spread = Self { mean: middle, std, log_likelihood: inside.iter().map(|one| one.log_part).sum() };
            if change < SETTLED {
                break;
            }
        }
        Some(spread)
    }

    /// A value between each of `bounds`: in turns a standard deviation above and below what is expected there, so that
    /// all together they have the mean and the spread of what is not known.
    pub fn values(&self, bounds: &[Bounds]) -> Vec<f64> {
        let mut sign = -1.0;
        let one = |bounds: &Bounds| {
            let inside = self.inside(*bounds);
            if inside.variance > 0.0 {
                sign = -sign;
            }
            inside.mean + sign * inside.variance.sqrt()
        };
        bounds.iter().map(one).collect()
    }

    /// What is known of a value of the distribution that lies between bounds.
    fn inside(&self, (low, high): Bounds) -> Inside {
        let (a, b) = ((low - self.mean) / self.std, (high - self.mean) / self.std);
        let normal = Normal::standard();
        if b - a < FLAT {
            // What is known exactly is known to a width of its own, however wide the distribution is.
            let width = (high - low).max(FLAT * FINEST) / self.std;
            return Inside {
                mean: 0.5 * (low + high),
                variance: (high - low).powi(2) / 12.0,
                log_part: normal.ln_pdf(0.5 * (a + b)) + width.ln(),
            };
        }
        // From the end that is nearer to the mean, where differences keep their digits.
        let part = if a > 0.0 { normal.sf(a) - normal.sf(b) } else { normal.cdf(b) - normal.cdf(a) };
        if part < f64::MIN_POSITIVE.sqrt() {
            // Far out all of it is at the nearer bound.
            let (near, bound) = if a > 0.0 { (a, low) } else { (b, high) };
            return Inside { mean: bound, variance: 0.0, log_part: normal.ln_pdf(near) - near.abs().ln() };
        }
        let (pdf_a, pdf_b) = (normal.pdf(a), if b.is_finite() { normal.pdf(b) } else { 0.0 });
        let shift = (pdf_a - pdf_b) / part;
        let slope = (a * pdf_a - if b.is_finite() { b * pdf_b } else { 0.0 }) / part;
        Inside {
            mean: self.mean + self.std * shift,
            variance: self.std.powi(2) * (1.0 + slope - shift * shift).max(0.0),
            log_part: part.ln(),
        }
    }
}

/// A value between bounds: its mean, its variance, and the logarithm of how much of the distribution is there.
struct Inside {
    mean: f64,
    variance: f64,
    log_part: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values at even steps of probability, of mean 2 and standard deviation 0.5.
    fn values() -> Vec<f64> {
        let normal = Normal::new(2.0, 0.5).unwrap();
        (0..200).map(|k| normal.inverse_cdf((f64::from(k) + 0.5) / 200.0)).collect()
    }

    #[test]
    fn known_values_have_their_own_mean_and_spread() {
        let known: Vec<Bounds> = values().iter().map(|value| (*value, *value)).collect();
        let spread = Spread::fit(&known, None).unwrap();
        assert!((spread.mean - 2.0).abs() < 1e-9 && (spread.std - 0.5).abs() < 0.005, "{spread:?}");
        assert_eq!(Spread::fit(&[], None), None);
    }

    #[test]
    fn the_likelihood_of_known_values_is_that_of_their_spreads() {
        // Of n values the spread about another mean is wider, and n ln(wider / narrower) is how much less likely that makes them.
        let known: Vec<Bounds> = values().iter().map(|value| (*value, *value)).collect();
        let [own, held] = [None, Some(1.0)].map(|mean| Spread::fit(&known, mean).unwrap());
        let expected = 200.0 * (held.std / own.std).ln();
        assert!((own.log_likelihood - held.log_likelihood - expected).abs() < 1e-6 * expected, "{own:?} {held:?}");
    }

    #[test]
    fn what_is_cut_off_is_reckoned_with() {
        // Half of them known to a step of 0.4; of a third those beyond a bound, which knows nothing of them, known to be beyond it.
        let bounds: Vec<Bounds> = values()
            .iter()
            .enumerate()
            .map(|(k, value)| match k % 6 {
                0 => (*value, *value),
                1 if *value > 1.8 => (1.8, f64::INFINITY),
                2 if *value > 2.2 => (2.2, f64::INFINITY),
                1 | 2 => (*value, *value),
                _ => ((value / 0.4).floor() * 0.4, ((value / 0.4).floor() + 1.0) * 0.4),
            })
            .collect();
        let spread = Spread::fit(&bounds, None).unwrap();
        assert!((spread.mean - 2.0).abs() < 0.05 && (spread.std - 0.5).abs() < 0.05, "{spread:?}");
        let held = Spread::fit(&bounds, Some(1.0)).unwrap();
        assert!(held.mean == 1.0 && held.log_likelihood < spread.log_likelihood - 50.0, "{held:?} {spread:?}");
        let values = spread.values(&bounds);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        assert!((mean - spread.mean).abs() < 0.02, "{mean}");
        assert!(values.iter().zip(&bounds).all(|(value, (low, high))| *value > low - 0.5 && *value < high + 0.5));
    }

    #[test]
    fn bounds_far_from_all_others_are_no_harm() {
        let mut bounds: Vec<Bounds> = values().iter().map(|value| (*value, *value)).collect();
        bounds.push((60.0, f64::INFINITY));
        bounds.push((-90.0, -80.0));
        let spread = Spread::fit(&bounds, None).unwrap();
        assert!(spread.mean.is_finite() && spread.std.is_finite() && spread.log_likelihood.is_finite(), "{spread:?}");
    }
}
