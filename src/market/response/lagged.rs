//! What one order does by itself, once those that follow it are taken out: the propagator.

use nalgebra::{DMatrix, DVector};

use crate::sim2real::Seed;

use super::blocks::{Estimated, FEWEST, interval};
use super::power_law::{Point, fit, least};

/// What one order does to the mid by itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Propagator {
    /// `G(l)`: by how much one order has moved the mid once `l` orders have come [bps], for l = 1, 2, …
    pub kernel: Vec<f64>,
    /// `beta` of `G(l) ~ l^-beta`; none where the returns speak for no power within [-1, 1.5], or the orders are too few.
    pub beta: Option<Estimated>,
    /// The same of lags from [`LATER`](Self::LATER) on: of what is left once the market has answered, where it takes its time to.
    pub later_beta: Option<Estimated>,
    /// How many returns it is made of.
    pub returns: usize,
}

impl Propagator {
    /// From how many orders on the market has answered.
    pub const LATER: usize = 10;
}

/// The products of one block of rows, from which every regression on them can be made.
#[derive(Debug, Clone)]
struct Products {
    signs: DMatrix<f64>,
    cross: DVector<f64>,
    square: f64,
}

impl Products {
    fn none(lags: usize) -> Self {
        Self { signs: DMatrix::zeros(lags, lags), cross: DVector::zeros(lags), square: 0.0 }
    }

    fn sum<'a>(lags: usize, parts: impl Iterator<Item = &'a Self>) -> Self {
        parts.fold(Self::none(lags), |mut sum, part| {
            sum.signs += &part.signs;
            sum.cross += &part.cross;
            sum.square += part.square;
            sum
        })
    }

    /// What is left of the returns by the kernel `l^-beta`, times whatever factor fits best.
    fn left(&self, beta: f64) -> f64 {
        let power = |l: usize| (l as f64).powf(-beta);
        let step = DVector::from_fn(self.cross.len(), |lag, _| if lag == 0 { 1.0 } else { power(lag + 1) - power(lag) });
        let cross = step.dot(&self.cross);
        let square = (&self.signs * &step).dot(&step);
        if square > 0.0 && cross > 0.0 { self.square - cross * cross / square } else { self.square }
    }

    fn beta(&self) -> Option<f64> {
        least([-1.0, 1.5], |beta| self.left(beta))
    }

    /// `G(l)` for l = 1, 2, …, with nothing assumed of its shape.
    fn kernel(&self) -> Option<Vec<f64>> {
        let steps = self.signs.clone().cholesky()?.solve(&self.cross);
        let sum = |sum: &mut f64, step: &f64| {
            *sum += step;
            Some(*sum)
        };
        Some(steps.iter().scan(0.0, sum).collect())
    }

    /// The power law nearest to the kernel from [`Propagator::LATER`] on, each lag weighted so that decades count alike.
    fn later_beta(&self) -> Option<f64> {
        let kernel = self.kernel()?;
        let lags = (Propagator::LATER..=kernel.len()).zip(kernel.iter().skip(Propagator::LATER - 1));
        let points: Vec<Point> = lags.map(|(l, y)| Point { x: l as f64, y: *y, weight: 1.0 / l as f64 }).collect();
        // Less than half a decade says nothing of a power.
        let long = kernel.len() >= 3 * Propagator::LATER;
        fit(&points, [-1.5, 1.0]).filter(|_| long).map(|law| -law.exponent)
    }
}

/// The propagator of `signs`, the orders' in order of time, on `mids`, those before each order [bps of whatever].
///
/// In the model the mid before order n is `sum over k < n of G(n - k) s_k` and noise. So the return from one order to the next is
/// `sum over l >= 0 of (G(l + 1) - G(l)) s_(n - l)` with `G(0) = 0`: a regression on the last `lags` signs, from which the memory of
/// signs drops out. The exponent is that of the power law which leaves least of the returns; its interval is by blocks of orders.
/// Where the market takes its time to answer, or is told of late, the kernel rises at first, and no power law is what it is from
/// the first lag on: [`later_beta`](Propagator::later_beta) is then what fades.
///
/// Source: Bouchaud, Gefen, Potters & Wyart, "Fluctuations and response in financial markets: the subtle nature of 'random' price
/// changes", Quantitative Finance 4 (2004), equation 7.
#[must_use]
pub fn propagator(signs: &[f64], mids: &[Option<f64>], lags: usize, seed: Seed) -> Option<Propagator> {
    const BLOCKS: usize = 20;
    let count = signs.len().min(mids.len());
    // Less than a handful of rows for each number to be found says nothing.
    if lags < 2 || count < 10 * lags || count / BLOCKS < lags {
        return None;
    }
    let length = count.div_ceil(BLOCKS);
    let mut blocks = vec![Products::none(lags); BLOCKS];
    let mut returns = 0;
    for n in lags..count.saturating_sub(1) {
        let Some((before, after)) = mids[n].zip(mids[n + 1]) else { continue };
        returns += 1;
        let row = DVector::from_fn(lags, |lag, _| signs[n - lag]);
        let block = &mut blocks[n / length];
        block.signs.ger(1.0, &row, &row, 1.0);
        block.cross.axpy(after - before, &row, 1.0);
        block.square += (after - before).powi(2);
    }
    if returns < 10 * lags || blocks.len() < FEWEST {
        return None;
    }
    let whole = Products::sum(lags, blocks.iter());
    let estimated = |of: fn(&Products) -> Option<f64>| {
        let drawn = |drawn: &[usize]| of(&Products::sum(lags, drawn.iter().map(|block| &blocks[*block])));
        Some(Estimated { value: of(&whole)?, ci95: interval(BLOCKS, seed.child("propagator"), drawn)? })
    };
    Some(Propagator {
        kernel: whole.kernel()?,
        beta: estimated(Products::beta),
        later_beta: estimated(Products::later_beta),
        returns,
    })
}

#[cfg(test)]
mod tests {
    use super::super::simulated::{independent_signs, lasting_signs, propagated};
    use super::*;

    fn found(signs: &[f64], noise: f64, kernel: impl Fn(usize) -> f64) -> Propagator {
        let mids: Vec<Option<f64>> = propagated(signs, 2_000, noise, Seed(8), kernel).into_iter().map(Some).collect();
        propagator(signs, &mids, 50, Seed(1)).unwrap()
    }

    #[test]
    fn the_decay_of_a_simulated_propagator_is_found_under_the_memory_of_signs() {
        let signs = lasting_signs(6_000, 0.5, Seed(4));
        for beta in [0.25, 0.6] {
            let found = found(&signs, 0.5, |l| (l as f64).powf(-beta));
            let own = found.beta.unwrap();
            assert!((own.value - beta).abs() < 0.05, "{own:?}, not {beta}");
            assert!(own.ci95[0] < own.value && own.value < own.ci95[1] && own.ci95[1] - own.ci95[0] < 0.2, "{own:?}");
            let later = found.later_beta.unwrap();
            assert!(
                (later.value - beta).abs() < 0.25 && later.ci95[0] < beta && beta < later.ci95[1],
                "{later:?}, not {beta}"
            );
            for l in [1, 10, 40_usize] {
                let expected = (l as f64).powf(-beta);
                assert!((found.kernel[l - 1] - expected).abs() < 0.12, "{l}: {} for {expected}", found.kernel[l - 1]);
            }
        }
    }

    #[test]
    fn what_stays_has_the_exponent_0_and_what_is_not_there_has_none() {
        let signs = independent_signs(6_000, Seed(6));
        let stays = found(&signs, 0.5, |_| 1.0).beta.unwrap();
        assert!(stays.value.abs() < 0.02, "{stays:?}");
        let nothing = found(&signs, 1.0, |_| 0.0);
        assert!(nothing.beta.is_none_or(|beta| beta.ci95[1] - beta.ci95[0] > 0.3), "{:?}", nothing.beta);
    }

    /// The market answers within ten orders, and forgets after that.
    #[test]
    fn what_rises_first_and_fades_then_is_told_apart() {
        let signs = lasting_signs(6_000, 0.5, Seed(4));
        let found = found(&signs, 0.3, |l| (l as f64 / 10.0).min(1.0) * (l as f64 / 10.0).max(1.0).powf(-0.6));
        let (whole, later) = (found.beta.unwrap(), found.later_beta.unwrap());
        assert!(whole.value < 0.0 && (later.value - 0.6).abs() < 0.25, "{whole:?}, {later:?}");
    }

    #[test]
    fn too_few_orders_give_none() {
        let signs = independent_signs(400, Seed(6));
        assert_eq!(propagator(&signs, &vec![Some(1.0); 400], 50, Seed(1)), None);
        assert_eq!(propagator(&signs, &vec![None; 400], 5, Seed(1)), None);
    }
}
