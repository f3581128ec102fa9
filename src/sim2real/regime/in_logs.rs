//! The recursions in logarithms, from the first row on: for chains of which some state does not lead to some other at once, since what is
//! left of a state may be less than any number and still be all that explains what comes later, no other state bringing it back; and for
//! series of which halves seen from both ends contradict each other.

use wide::f64x2;

use super::course::LARGEST;
use super::ends::Ends;
use super::observations::is_lost;
use super::trellis::{Arrivals, Seen, Visit};
use super::{HiddenMarkov, Observations};

/// Logarithm of the sum of numbers of which these are the logarithms; that of 0 where there is nothing in any.
fn sum(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY { most } else { most + logs.map(|log| (log - most).exp()).sum::<f64>().ln() }
}

/// Makes logarithms those of parts of a whole, and returns that of the whole. In two steps: where they are very large the second is less
/// than their last digit.
fn divide(logs: &mut [f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    logs.iter_mut().for_each(|log| *log -= most);
    let rest = sum(logs.iter().copied());
    logs.iter_mut().for_each(|log| *log -= rest);
    most + rest
}

/// Where the recursion is, in logarithms.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Course {
    /// Of what is expected of each state of the next row.
    predicted: Vec<f64>,
    /// Of what is believed of each state of the last.
    pub beliefs: Vec<f64>,
    /// Of the density of the last row in each state over its density given all before.
    ratios: Vec<f64>,
    /// Of the density of all rows so far, but for the highest density of each that was not lost.
    log: f64,
}

impl Course {
    /// Before any row.
    pub fn new(model: &HiddenMarkov) -> Self {
        let predicted: Vec<f64> = model.initial().iter().map(|probability| probability.ln()).collect();
        let states = predicted.len();
        Self { beliefs: predicted.clone(), predicted, ratios: vec![0.0; states], log: 0.0 }
    }

    /// Takes the next row.
    pub fn step(&mut self, model: &HiddenMarkov, row: &[f64]) {
        let Self { predicted, beliefs, ratios, log } = self;
        let densities = model.densities();
        densities.logarithms(row, ratios);
        if !is_lost(row) {
            ratios.iter_mut().for_each(|log| *log -= densities.highest);
        }
        for ((belief, before), weight) in beliefs.iter_mut().zip(&*predicted).zip(&*ratios) {
            *belief = before + weight;
        }
        let total = divide(beliefs);
        ratios.iter_mut().for_each(|log| *log -= total);
        *log += total;
        let (transition, states) = (model.transition(), beliefs.len());
        for (to, next) in predicted.iter_mut().enumerate() {
            *next = sum((0..states).map(|from| beliefs[from] + transition[from * states + to].ln()));
        }
    }

    /// Writes the probability of each state given the rows so far.
    pub fn believe(&self, into: &mut [f64]) {
        into.iter_mut().zip(&self.beliefs).for_each(|(belief, log)| *belief = log.exp());
    }

    /// Logarithm of the density of all rows so far, of which `observed` were not lost.
    pub fn log_likelihood(&self, model: &HiddenMarkov, observed: u64) -> f64 {
        observed as f64 * model.densities().highest + self.log
    }
}

/// Runs from the first row on and shows each row's belief.
pub(super) fn follow(model: &HiddenMarkov, series: Observations, mut see: impl FnMut(&[f64])) {
    let mut course = Course::new(model);
    let mut belief = vec![0.0; model.states()];
    for row in series.iter() {
        course.step(model, row);
        course.believe(&mut belief);
        see(&belief);
    }
}

/// Logarithm of the density of a series.
pub(super) fn log_likelihood(model: &HiddenMarkov, series: Observations) -> f64 {
    let mut course = Course::new(model);
    series.iter().for_each(|row| course.step(model, row));
    course.log_likelihood(model, series.observed() as u64)
}

/// What the recursion from the first row on found, `[row][state]`.
#[derive(Debug, Clone)]
pub(super) struct Trellis {
    beliefs: Vec<f64>,
    ratios: Vec<f64>,
    pub log_likelihood: f64,
}

impl Trellis {
    /// Of a series.
    pub fn of(model: &HiddenMarkov, series: Observations) -> Self {
        let size = series.len() * model.states();
        let (mut beliefs, mut ratios) = (Vec::with_capacity(size), Vec::with_capacity(size));
        let mut course = Course::new(model);
        for row in series.iter() {
            course.step(model, row);
            beliefs.extend_from_slice(&course.beliefs);
            ratios.extend_from_slice(&course.ratios);
        }
        let log_likelihood = course.log_likelihood(model, series.observed() as u64);
        Self { beliefs, ratios, log_likelihood }
    }

    /// The recursion backward: shows `visitor` each row, the last first, and writes what is kept into `into`.
    pub fn sweep<V: Visit>(&self, model: &HiddenMarkov, into: &mut Vec<f64>, visitor: &mut V) {
        if V::KEEPS {
            into.resize(self.beliefs.len(), 0.0);
        }
        let (transition, states) = (model.transition(), model.states());
        let (mut beta, mut ahead) = (vec![0.0; states], vec![0.0; states]);
        let (mut logs, mut posterior, mut each) = (vec![0.0; states], vec![f64x2::ZERO; states], vec![0.0; states * states]);
        for (row, ratio) in self.ratios.chunks_exact(states).enumerate().rev() {
            let belief = &self.beliefs[row * states..][..states];
            for state in 0..states {
                logs[state] = belief[state] + beta[state];
                ahead[state] = ratio[state] + beta[state];
            }
            divide(&mut logs);
            posterior.iter_mut().zip(&logs).for_each(|(both, log)| *both = f64x2::from([log.exp(), 0.0]));
            let arrivals = match row.checked_sub(1).map(|row| &self.beliefs[row * states..][..states]) {
                Some(before) => {
                    for (k, count) in each.iter_mut().enumerate() {
                        let log = before[k / states] + ahead[k % states];
                        *count = if transition[k] > 0.0 { log.exp().min(LARGEST) } else { 0.0 };
                    }
                    Arrivals::Each(&each)
                }
                None => Arrivals::None,
            };
            visitor.visit(Seen { step: row, ends: 1, arrivals, posterior: &posterior });
            if V::KEEPS {
                into[row * states..].iter_mut().zip(&posterior).for_each(|(into, posterior)| *into = posterior.at(0));
            }
            for (from, beta) in beta.iter_mut().enumerate() {
                *beta = sum((0..states).map(|to| transition[from * states + to].ln() + ahead[to]));
            }
        }
    }
}
