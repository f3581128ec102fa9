//! How a displacement of the price decays: a propagator as a sum of exponentials, whose memory does not grow with the past.

use std::f64::consts::LN_2;

use statrs::function::gamma::ln_gamma;

use crate::sim2real::{LaneChange, Parameter};

/// The part of what an order moves that it pays itself, in forms that state it. No fit moves it: fills and mids that follow them
/// say nothing of it that a spread and an impact of the order's own do not say.
pub(super) fn paid() -> Parameter {
    Parameter::new("paid", "", 0.0).within(0.0, 1.0).known_to(0.0)
}

/// A kernel `G(t) = sum of weight * exp(-rate * t)`, with G(0) = 1, and what is left of all that it was kicked by.
///
/// Weights are not negative, so the kernel is completely monotone: with it linear impact knows no round trip that gains
/// (Alfonsi, Schied & Slynko, "Order book resilience, price manipulation, and the positive portfolio problem", SIAM Journal
/// on Financial Mathematics 3 (2012)). Each rate is twice the one before, so that all of them cost one exponential.
#[derive(Debug, Clone)]
pub(super) struct Propagator {
    /// The lowest rate [1/s]; infinite where nothing lasts.
    slowest: f64,
    /// Weight of each rate, and what is left in it.
    modes: Vec<(f64, f64)>,
    /// The same of what is too slow to be told from what stays.
    staying: (f64, f64),
}

/// Logarithm of the lowest rate of a power law's exponentials, over 1 / lag, and how often it is doubled: the kernel is
/// followed from a hundredth of a lag to a million lags.
const LEAST: f64 = -17.0;
const DOUBLED: usize = 29;

impl Propagator {
    /// `exp(-t / time_constant)` [s]; nothing lasts where that is 0.
    pub fn exponential(time_constant: f64) -> Self {
        Self { slowest: 1.0 / time_constant, modes: vec![(1.0, 0.0)], staying: (0.0, 0.0) }
    }

    /// `(1 + t / lag)^(-exponent)`, `lag` [s]: the mean of `exp(-u t / lag)` over rates `u` of a gamma distribution of that
    /// shape, summed by the trapezoidal rule over `ln u` (Beylkin & Monzón, "On approximation of functions by exponential
    /// sums", Applied and Computational Harmonic Analysis 19 (2005)). Rates too low to matter are 0.
    pub fn power(lag: f64, exponent: f64) -> Self {
        let scale = ln_gamma(exponent.max(f64::MIN_POSITIVE));
        let log = |k: usize| LEAST + k as f64 * LN_2;
        let weight = |k: usize| LN_2 * (exponent * log(k) - log(k).exp() - scale).exp();
        let mut modes: Vec<(f64, f64)> = (0..=DOUBLED).map(|k| (weight(k), 0.0)).collect();
        // All rates below the lowest: weights fall by half of a power, so their sum is a geometric series.
        let below = if exponent > 0.0 {
            LN_2 * (exponent * (LEAST - LN_2) - scale).exp() / -(-exponent * LN_2).exp_m1()
        } else {
            1.0
        };
        let all = below + modes.iter().map(|(weight, _)| weight).sum::<f64>();
        modes.iter_mut().for_each(|(weight, _)| *weight /= all);
        Self { slowest: LEAST.exp() / lag, modes, staying: (below / all, 0.0) }
    }

    /// Shows `change` the kernels of all lanes, each of which is `of` its lane's parameters. Where these change, what is left stays
    /// what it is, in each exponential of the kernel, and goes on at the new rates.
    pub fn change(lanes: &mut [Self], change: &LaneChange<'_>, of: impl FnOnce(&[f64]) -> Self) {
        match *change {
            LaneChange::Retune { lane, values } => {
                if let Some(own) = lanes.get_mut(lane) {
                    let mut new = of(values);
                    new.parts().zip(own.parts()).for_each(|((_, left), (_, kept))| *left = *kept);
                    *own = new;
                }
            }
            LaneChange::Forget { lane, .. } => {
                if let Some(own) = lanes.get_mut(lane) {
                    own.parts().for_each(|(_, left)| *left = 0.0);
                }
            }
            LaneChange::Save { .. } | LaneChange::Load { .. } => change.derived(lanes, of),
        }
    }

    /// Lets `seconds` [s] pass.
    pub fn pass(&mut self, seconds: f64) {
        let mut gone = self.gone(seconds);
        for (_, left) in &mut self.modes {
            *left -= gone * *left;
            gone *= 2.0 - gone;
        }
        if !self.lasts() {
            self.staying.1 = 0.0;
        }
    }

    /// What will be left of all kicks in `seconds` [s].
    pub fn left_after(&self, seconds: f64) -> f64 {
        let (mut gone, mut sum) = (self.gone(seconds), 0.0);
        for (_, left) in &self.modes {
            sum += left - gone * left;
            gone *= 2.0 - gone;
        }
        if self.lasts() { sum + self.staying.1 } else { sum }
    }

    /// What does not last is gone before the next order, be it at the same time.
    fn lasts(&self) -> bool {
        self.slowest.is_finite()
    }

    /// The part of the slowest that goes in `seconds` [s]: told from 1, short times would lose their digits. In the one after it
    /// goes what goes here in twice the time.
    fn gone(&self, seconds: f64) -> f64 {
        if self.lasts() { -(-self.slowest * seconds).exp_m1() } else { 1.0 }
    }

    /// Moves the price by `size`.
    pub fn kick(&mut self, size: f64) {
        for (weight, left) in self.parts() {
            *left += *weight * size;
        }
    }

    /// Each weight, and what is left in it.
    fn parts(&mut self) -> impl Iterator<Item = &mut (f64, f64)> {
        self.modes.iter_mut().chain([&mut self.staying])
    }

    /// What is left of all kicks.
    pub fn left(&self) -> f64 {
        self.modes.iter().map(|(_, left)| left).sum::<f64>() + self.staying.1
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
            for k in 0..=160 {
                // From a two-thousandth of a lag to two hundred thousand lags.
                let t = 10.0_f64.powf(-3.0 + 0.05 * f64::from(k));
                let exact = (1.0 + t / 0.5).powf(-exponent);
                worst = worst.max((after(Propagator::power(0.5, exponent), t) / exact - 1.0).abs());
            }
            println!("exponent {exponent}: off by {worst} of itself at most");
            assert!(worst < 1e-3, "exponent {exponent}: {worst}");
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
    fn another_kernel_keeps_what_is_left_and_lets_it_go_at_its_own_rates() {
        let mut lanes = [Propagator::power(2.0, 0.4), Propagator::power(2.0, 0.4)];
        lanes.iter_mut().for_each(|kernel| kernel.kick(3.0));
        let slower = LaneChange::Retune { lane: 1, values: &[4.0, 0.4] };
        Propagator::change(&mut lanes, &slower, |values| Propagator::power(values[0], values[1]));
        assert_eq!(lanes[0].left(), lanes[1].left());
        // Of a lag of twice the time as much is left after twice the time.
        assert!((lanes[1].left_after(20.0) - lanes[0].left_after(10.0)).abs() < 1e-12);
        lanes[1].pass(20.0);
        let left = lanes[1].left();
        let steeper = LaneChange::Retune { lane: 1, values: &[1.0, 0.9] };
        Propagator::change(&mut lanes, &steeper, |values| Propagator::power(values[0], values[1]));
        assert_eq!(lanes[1].left(), left);
        // The next kick has the new kernel's shape.
        let before = lanes[1].left_after(5.0);
        lanes[1].kick(1.0);
        assert!((lanes[1].left_after(5.0) - before - after(Propagator::power(1.0, 0.9), 5.0)).abs() < 1e-12);
        Propagator::change(&mut lanes, &LaneChange::Forget { lane: 1, seed: Default::default() }, |_| {
            Propagator::exponential(1.0)
        });
        assert_eq!(lanes[1].left(), 0.0);
    }

    #[test]
    fn decay_does_not_depend_on_how_time_is_cut() {
        let mut cut = Propagator::power(2.0, 0.4);
        cut.kick(3.0);
        let foreseen = cut.left_after(13.0);
        (0..100).for_each(|_| cut.pass(0.13));
        assert!((cut.left() - foreseen).abs() < 1e-12, "{foreseen}");
        assert!((cut.left() - 3.0 * after(Propagator::power(2.0, 0.4), 13.0)).abs() < 1e-12);
    }
}
