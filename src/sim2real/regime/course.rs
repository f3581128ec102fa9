//! The recursion over rows: what is believed of the states from row to row, so scaled that no product of densities underflows.

use std::f64::consts::LN_2;

use super::HiddenMarkov;
use super::in_logs;
use super::observations::is_lost;

/// Below this a mass is multiplied by a power of two, which costs no digits.
const LEAST: f64 = power_of_two(-64);

/// Below this the evidence of a row is added up in logarithms: almost only states that cannot be would explain it.
const FAINT: f64 = power_of_two(-900);

/// Bound of what is multiplied, so that no product is infinite.
pub(super) const LARGEST: f64 = 1e300;

/// `2^exponent`, from -1,022 to 1,023.
const fn power_of_two(exponent: i64) -> f64 {
    f64::from_bits(((exponent + 1_023) as u64) << 52)
}

/// One number for each state: an array where the compiler knows how many there are, which it then keeps in registers.
pub(super) trait PerState: AsRef<[f64]> + AsMut<[f64]> + Clone + Send + Sync {
    /// A copy of these numbers.
    fn of(numbers: &[f64]) -> Self;
}

impl PerState for Vec<f64> {
    fn of(numbers: &[f64]) -> Self {
        numbers.to_vec()
    }
}

impl<const N: usize> PerState for [f64; N] {
    fn of(numbers: &[f64]) -> Self {
        std::array::from_fn(|state| numbers[state])
    }
}

/// Where the recursion is.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Course<S> {
    /// Density of the rows so far together with each state, over a factor that all states share.
    joint: S,
    /// The same of the state before the next row; its logarithm where the model does not mix.
    predicted: S,
    /// Sum of `joint`.
    mass: f64,
    /// Logarithm of that factor, but for `observed` times the highest density.
    log: f64,
    /// Rows so far that were not lost.
    observed: u64,
}

impl<S: PerState> Course<S> {
    /// Before any row, with what is known of the state before it.
    pub fn new(model: &HiddenMarkov, begin: &[f64]) -> Self {
        let mut predicted = S::of(begin);
        if !model.mixes() {
            predicted.as_mut().iter_mut().for_each(|probability| *probability = probability.ln());
        }
        Self { joint: S::of(begin), predicted, mass: 1.0, log: 0.0, observed: 0 }
    }

    /// Takes the next row of a model that does not mix, and writes the logarithms of what is believed, and of densities over the density
    /// of the row given all before.
    #[cold]
    pub fn step_in_logs(&mut self, model: &HiddenMarkov, row: &[f64], beliefs: &mut [f64], ratios: &mut [f64]) {
        let log = in_logs::step(model, row, self.predicted.as_mut(), beliefs, ratios);
        for (joint, belief) in self.joint.as_mut().iter_mut().zip(&*beliefs) {
            *joint = belief.exp();
        }
        ratios.iter_mut().for_each(|ratio| *ratio -= log);
        self.log += log;
        self.observed += u64::from(!is_lost(row));
    }

    /// Takes the next row, of which `weights` are the densities over the highest. These times what is returned are the density of the row in
    /// each state over its density given all before; of a state that cannot be the weight may be set to 0. `transition` is that of the
    /// way the recursion goes, `[from][to]`.
    #[inline(always)]
    pub fn step(&mut self, model: &HiddenMarkov, transition: &[f64], row: &[f64], weights: &mut S) -> f64 {
        let mut mass = 0.0;
        let before = self.predicted.as_ref().iter();
        for ((joint, weight), before) in self.joint.as_mut().iter_mut().zip(weights.as_ref()).zip(before) {
            *joint = weight * before;
            mass += *joint;
        }
        let mut inverse = self.mass / mass;
        if mass < LEAST {
            // Of copies, so that what is seldom needed does not keep the others out of registers.
            let (mut joint, mut scaled_weights) = (self.joint.clone(), weights.clone());
            let scaled = rescaled(model, row, self.mass, joint.as_mut(), &self.predicted.clone(), &mut scaled_weights);
            (self.joint, *weights) = (joint, scaled_weights);
            self.log += scaled.log;
            (mass, inverse) = (scaled.mass, scaled.inverse);
        }
        self.mass = mass;
        self.observed += u64::from(!is_lost(row));
        predict(transition, self.joint.as_ref(), self.predicted.as_mut());
        inverse
    }

    /// Writes the probability of each state given the rows so far.
    #[inline(always)]
    pub fn believe(&self, into: &mut [f64]) {
        let inverse = 1.0 / self.mass;
        for (belief, joint) in into.iter_mut().zip(self.joint.as_ref()) {
            *belief = joint * inverse;
        }
    }

    /// Logarithm of the density of all rows so far.
    pub fn log_likelihood(&self, model: &HiddenMarkov) -> f64 {
        self.observed as f64 * model.densities().highest + self.log + self.mass.ln()
    }

    /// What is known where this recursion, from the first row on, meets one from the last row `back`; `None` where hardly anything
    /// that the one holds possible is possible to the other, so that digits would be lost.
    pub fn meet<'a>(&'a self, back: &'a Self, model: &HiddenMarkov) -> Option<Meeting<'a, S>> {
        let together: f64 = self.joint.as_ref().iter().zip(back.predicted.as_ref()).map(|(here, there)| here * there).sum();
        // Not a number is no meeting either.
        let met = together >= FAINT;
        let rest = self.log + back.log + together.ln();
        let log_likelihood = (self.observed + back.observed) as f64 * model.densities().highest + rest;
        met.then_some(Meeting { first: self, back, together, log_likelihood })
    }
}

/// Where two recursions meet.
pub(super) struct Meeting<'a, S> {
    first: &'a Course<S>,
    back: &'a Course<S>,
    /// Density of all rows, over the factors of both.
    together: f64,
    /// Logarithm of the density of all rows.
    pub log_likelihood: f64,
}

impl<S: PerState> Meeting<'_, S> {
    /// For each state of the last row of the first half, how much more likely all that follow are than they are given those before.
    pub fn after_first(&self) -> Vec<f64> {
        let factor = self.first.mass / self.together;
        self.back.predicted.as_ref().iter().map(|there| there * factor).collect()
    }

    /// The same of the last half seen from its end: for each state of its first row, of the rows before.
    pub fn before_last(&self) -> Vec<f64> {
        let factor = self.back.mass / self.together;
        self.first.predicted.as_ref().iter().map(|here| here * factor).collect()
    }

    /// Expected number of transitions from the one half into the other, over their probability, `[from][to]`.
    pub fn crossing(&self) -> Vec<f64> {
        let to = self.back.joint.as_ref();
        self.first.joint.as_ref().iter().flat_map(|from| to.iter().map(move |to| from * (to / self.together))).collect()
    }
}

/// What becomes of a mass that has grown small.
struct Scaled {
    mass: f64,
    /// Logarithm of what the mass was divided by.
    log: f64,
    inverse: f64,
}

/// Brings the mass near 1; where hardly anything is left of it the row is taken again, in logarithms.
#[cold]
#[inline(never)]
fn rescaled<S: PerState>(
    model: &HiddenMarkov,
    row: &[f64],
    before: f64,
    joint: &mut [f64],
    predicted: &S,
    weights: &mut S,
) -> Scaled {
    let (predicted, weights) = (predicted.as_ref(), weights.as_mut());
    let mass: f64 = joint.iter().sum();
    if mass >= FAINT {
        let exponent = (mass.to_bits() >> 52) as i64 - 1_023;
        let factor = power_of_two(-exponent);
        joint.iter_mut().for_each(|joint| *joint *= factor);
        return Scaled { mass: mass * factor, log: exponent as f64 * LN_2, inverse: before / mass };
    }
    model.densities().logarithms(row, joint);
    let mut peak = f64::NEG_INFINITY;
    for (log, before) in joint.iter_mut().zip(predicted) {
        *log += before.ln();
        peak = peak.max(*log);
    }
    let mut sum = 0.0;
    for log in joint.iter_mut() {
        *log = (*log - peak).exp();
        sum += *log;
    }
    for ((joint, weight), before) in joint.iter_mut().zip(weights).zip(predicted) {
        *joint /= sum;
        *weight = if *before > 0.0 { (*joint / before).min(LARGEST) } else { 0.0 };
    }
    let highest = if is_lost(row) { 0.0 } else { model.densities().highest };
    Scaled { mass: 1.0, log: peak + sum.ln() - highest, inverse: before }
}

/// `next[j] = sum of from[i] transition[i][j]`.
#[inline(always)]
fn predict(transition: &[f64], from: &[f64], next: &mut [f64]) {
    let states = next.len();
    let transition = &transition[..states * states];
    for to in 0..states {
        let mut sum = from[0] * transition[to];
        for state in 1..states {
            sum += from[state] * transition[state * states + to];
        }
        next[to] = sum;
    }
}
