//! Orders with known exponents, for tests.

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

use crate::sim2real::Seed;

/// Signs in which every order is as likely to buy as to sell.
pub(super) fn independent_signs(count: usize, seed: Seed) -> Vec<f64> {
    let mut draws = seed.stream("signs");
    (0..count).map(|_| if draws.random::<bool>() { 1.0 } else { -1.0 }).collect()
}

/// Signs whose autocorrelation falls as `lag^-gamma`: parent orders of lengths with `P(length >= l) = l^-(1 + gamma)`, one after
/// the other, each in children of its sign (Lillo, Mike & Farmer, Physical Review E 71, 066122, 2005).
pub(super) fn lasting_signs(count: usize, gamma: f64, seed: Seed) -> Vec<f64> {
    let mut draws = seed.stream("signs");
    let mut signs = Vec::with_capacity(count);
    while signs.len() < count {
        let uniform: f64 = draws.random::<f64>().max(1e-12);
        let length = uniform.powf(-1.0 / (1.0 + gamma)).floor().min(count as f64) as usize;
        let sign = if draws.random::<bool>() { 1.0 } else { -1.0 };
        signs.extend(std::iter::repeat_n(sign, length.max(1)));
    }
    signs.truncate(count);
    signs
}

/// The mid before each order [bps from the first], where an order moves it by `kernel(l)` once `l` orders have come, and noise of
/// `noise` [bps] a step is added.
pub(super) fn propagated(signs: &[f64], reach: usize, noise: f64, seed: Seed, kernel: impl Fn(usize) -> f64) -> Vec<f64> {
    let kernel: Vec<f64> = (1..=reach).map(kernel).collect();
    let mut draws = seed.stream("noise");
    let (mut walk, mut mids) = (0.0, Vec::with_capacity(signs.len()));
    for n in 0..signs.len() {
        // What is older than the reach stays where it is.
        let moved: f64 = (1..=n).map(|l| signs[n - l] * kernel[l.min(reach) - 1]).sum();
        let draw: f64 = StandardNormal.sample(&mut draws);
        walk += noise * draw;
        mids.push(moved + walk);
    }
    mids
}
