//! How long the signs of orders go on.

use crate::sim2real::Seed;

use super::blocks::{Estimated, interval};
use super::power_law::{Point, fit};

/// The memory of signs.
#[derive(Debug, Clone, PartialEq)]
pub struct SignMemory {
    /// Lags in orders with the autocorrelation of signs there, averaged over lags that lie near on a logarithmic scale.
    pub autocorrelation: Vec<(f64, f64)>,
    /// `gamma` of `C(lag) ~ lag^-gamma`; none where signs do not go on, or fade faster than any power.
    pub gamma: Option<Estimated>,
}

/// How many blocks the orders are cut into.
const BLOCKS: usize = 20;

/// The sums of one block: how many pairs there are at each lag, and the sum of their products.
type LagSums = Vec<[f64; 2]>;

/// The memory of `signs` (+1 and -1, in order of time) up to a lag of `longest` orders.
///
/// The exponent is that of a power law fitted by least squares to the autocorrelation, whose lags lie evenly on a logarithmic
/// scale; its interval is by blocks of a twentieth of the orders, and knows nothing of what is longer than those. Of ten thousand
/// orders it is off by a tenth either way, by chance and by the few longest runs.
///
/// Source: Lillo & Farmer, "The long memory of the efficient market", Studies in Nonlinear Dynamics & Econometrics 8 (2004).
#[must_use]
pub fn sign_memory(signs: &[f64], longest: usize, seed: Seed) -> Option<SignMemory> {
    let longest = longest.min(signs.len() / BLOCKS / 2);
    if longest < 4 {
        return None;
    }
    let mean = signs.iter().sum::<f64>() / signs.len() as f64;
    let centred: Vec<f64> = signs.iter().map(|sign| sign - mean).collect();
    let variance = centred.iter().map(|sign| sign * sign).sum::<f64>() / signs.len() as f64;
    if variance <= 0.0 {
        return None;
    }
    let bins = lag_bins(longest);
    let length = signs.len().div_ceil(BLOCKS);
    let blocks: Vec<LagSums> = (0..BLOCKS).map(|block| lag_sums(&centred, block * length, length, &bins)).collect();
    let correlation = |drawn: &[usize]| -> Vec<Point> {
        let point = |(bin, (from, to)): (usize, &(usize, usize))| {
            let sums = drawn.iter().fold([0.0; 2], |[count, sum], block| {
                let own = blocks[*block][bin];
                [count + own[0], sum + own[1]]
            });
            let lag = (*from as f64 * (to - 1) as f64).sqrt();
            Point { x: lag, y: sums[1] / sums[0].max(1.0) / variance, weight: 1.0 }
        };
        bins.iter().enumerate().map(point).collect()
    };
    let exponent = |drawn: &[usize]| fit(&correlation(drawn), [-2.0, 0.5]).map(|law| -law.exponent);
    let whole: Vec<usize> = (0..BLOCKS).collect();
    let gamma = exponent(&whole).and_then(|value| {
        let ci95 = interval(BLOCKS, seed.child("signs"), exponent)?;
        Some(Estimated { value, ci95 })
    });
    let autocorrelation = correlation(&whole).iter().map(|point| (point.x, point.y)).collect();
    Some(SignMemory { autocorrelation, gamma })
}

/// Lags from 1 to `longest`, put together so that each group reaches a third further than the one before: from, and to before.
fn lag_bins(longest: usize) -> Vec<(usize, usize)> {
    let mut bins = Vec::new();
    let mut from = 1;
    while from <= longest {
        let to = (from + from.div_ceil(3)).min(longest + 1).max(from + 1);
        bins.push((from, to));
        from = to;
    }
    bins
}

/// Sums over pairs whose first is in the block.
fn lag_sums(centred: &[f64], from: usize, length: usize, bins: &[(usize, usize)]) -> LagSums {
    let end = (from + length).min(centred.len());
    let sums_of = |(low, high): &(usize, usize)| {
        let mut sums = [0.0; 2];
        for lag in *low..*high {
            for first in from..end.min(centred.len().saturating_sub(lag)) {
                sums = [sums[0] + 1.0, sums[1] + centred[first] * centred[first + lag]];
            }
        }
        sums
    };
    bins.iter().map(sums_of).collect()
}

#[cfg(test)]
mod tests {
    use super::super::simulated::{independent_signs, lasting_signs};
    use super::*;

    #[test]
    fn the_memory_of_simulated_signs_is_found_on_average() {
        let mut last = 0.0;
        for gamma in [0.4, 0.6, 0.8] {
            let found = (0..6).map(|seed| {
                let signs = lasting_signs(12_000, gamma, Seed(seed));
                let own = sign_memory(&signs, 200, Seed(1)).unwrap().gamma.unwrap();
                assert!(own.ci95[0] < own.value && own.value < own.ci95[1], "{own:?}");
                own.value
            });
            let mean = found.sum::<f64>() / 6.0;
            assert!((mean - gamma).abs() < 0.15 && mean > last, "{mean}, not {gamma}");
            last = mean;
        }
    }

    #[test]
    fn signs_without_memory_have_none() {
        let found = sign_memory(&independent_signs(20_000, Seed(2)), 200, Seed(1)).unwrap();
        assert!(found.autocorrelation.iter().all(|(_, c)| c.abs() < 0.03), "{found:?}");
        if let Some(gamma) = found.gamma {
            assert!(gamma.ci95[1] - gamma.ci95[0] > 0.5, "an exponent of noise is one of wide bounds: {gamma:?}");
        }
        assert_eq!(sign_memory(&[1.0; 1_000], 10, Seed(1)), None);
        assert_eq!(sign_memory(&independent_signs(100, Seed(2)), 10, Seed(1)), None);
    }

    #[test]
    fn groups_of_lags_leave_none_out() {
        let bins = lag_bins(50);
        assert_eq!((bins[0], bins[1], bins[2]), ((1, 2), (2, 3), (3, 4)));
        assert!(bins.windows(2).all(|pair| pair[0].1 == pair[1].0) && bins.last().unwrap().1 == 51);
    }
}
