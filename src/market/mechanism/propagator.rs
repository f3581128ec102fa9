//! How a displacement of the price decays: a propagator as a sum of exponentials, whose memory does not grow with the past.

use statrs::function::gamma::ln_gamma;

/// A kernel `G(t) = sum of weight * exp(-rate * t)`, with G(0) = 1.
///
/// Weights are not negative, so the kernel is completely monotone: with it linear impact knows no round trip that gains
/// (Alfonsi, Schied & Slynko, "Order book resilience, price manipulation, and the positive portfolio problem", SIAM Journal
/// on Financial Mathematics 3 (2012)).
#[derive(Debug, Clone)]
pub(super) struct Propagator {
    modes: Vec<Mode>,
}

/// One exponential of a propagator, and what is left in it.
#[derive(Debug, Clone, Copy)]
struct Mode {
    weight: f64,
    /// 1/s; infinite where nothing lasts.
    rate: f64,
    left: f64,
}

/// Logarithms of the least and the largest rate of a power law's exponentials, over 1 / lag, and their distance: the kernel is
/// followed to 1e8 lags, and is off by less than 1e-4 of itself up to 1e6.
const LEAST: f64 = -22.0;
const LARGEST: f64 = 3.5;
const APART: f64 = 0.75;

impl Propagator {
    /// `exp(-t / time_constant)` [s]; nothing lasts where that is 0.
    pub fn exponential(time_constant: f64) -> Self {
        Self { modes: vec![Mode { weight: 1.0, rate: 1.0 / time_constant, left: 0.0 }] }
    }

    /// `(1 + t / lag)^(-exponent)`, `lag` [s]: the mean of `exp(-u t / lag)` over rates `u` of a gamma distribution of that
    /// shape, summed by the trapezoidal rule over `ln u` (Beylkin & Monzón, "On approximation of functions by exponential
    /// sums", Applied and Computational Harmonic Analysis 19 (2005)). Rates too low to matter are 0.
    pub fn power(lag: f64, exponent: f64) -> Self {
        let scale = ln_gamma(exponent.max(f64::MIN_POSITIVE));
        let count = ((LARGEST - LEAST) / APART).round() as usize + 1;
        let mode = |k: usize| {
            let log = LEAST + k as f64 * APART;
            Mode { weight: APART * (exponent * log - log.exp() - scale).exp(), rate: log.exp() / lag, left: 0.0 }
        };
        let mut modes: Vec<Mode> = (0..count).map(mode).collect();
        let rest = 1.0 - modes.iter().map(|mode| mode.weight).sum::<f64>();
        modes.push(Mode { weight: rest.max(0.0), rate: if lag > 0.0 { 0.0 } else { f64::INFINITY }, left: 0.0 });
        Self { modes }
    }

    /// Lets `seconds` [s] pass.
    pub fn pass(&mut self, seconds: f64) {
        for mode in &mut self.modes {
            // What never lasts is gone before the next order, be it at the same time.
            mode.left *= if mode.rate.is_finite() { (-mode.rate * seconds).exp() } else { 0.0 };
        }
    }

    /// Moves the price by `size`.
    pub fn kick(&mut self, size: f64) {
        self.modes.iter_mut().for_each(|mode| mode.left += mode.weight * size);
    }

    /// What is left of all kicks.
    pub fn left(&self) -> f64 {
        self.modes.iter().map(|mode| mode.left).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(mut kernel: Propagator, seconds: f64) -> f64 {
        kernel.kick(1.0);
        kernel.pass(seconds);
        kernel.left()
    }

    #[test]
    fn a_sum_of_exponentials_is_the_power_law_it_stands_for() {
        for exponent in [0.2, 0.4, 0.5, 1.0, 1.7] {
            let mut worst = 0.0_f64;
            for k in 0..=120 {
                let t = 10.0_f64.powf(-3.0 + 0.075 * f64::from(k));
                let exact = (1.0 + t / 0.5).powf(-exponent);
                worst = worst.max((after(Propagator::power(0.5, exponent), t) / exact - 1.0).abs());
            }
            println!("exponent {exponent}: off by {worst} of itself at most");
            assert!(worst < 0.02, "exponent {exponent}: {worst}");
        }
    }

    #[test]
    fn what_is_gone_at_once_and_what_stays_are_the_ends_of_both_kernels() {
        for gone in [Propagator::exponential(0.0), Propagator::power(0.0, 0.5)] {
            assert_eq!((after(gone.clone(), 0.0), after(gone, 1.0)), (0.0, 0.0));
        }
        assert_eq!(after(Propagator::exponential(f64::INFINITY), 1e9), 1.0);
        assert!((after(Propagator::power(1.0, 0.0), 1e9) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn decay_does_not_depend_on_how_time_is_cut() {
        let mut cut = Propagator::power(2.0, 0.4);
        cut.kick(3.0);
        (0..100).for_each(|_| cut.pass(0.13));
        assert!((cut.left() - 3.0 * after(Propagator::power(2.0, 0.4), 13.0)).abs() < 1e-12);
    }
}
