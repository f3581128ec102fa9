//! The recursions in logarithms, for chains of which some state does not lead to some other at once: what is left of a state may be less
//! than any number and still be all that explains what comes later, since no other state brings it back.

use super::HiddenMarkov;
use super::course::LARGEST;
use super::observations::is_lost;
use super::trellis::{Arrivals, Seen, Visit};

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

/// Takes a row: from logarithms of what is expected of each state, which it makes those of the next row, writes those of what is believed
/// and those of the densities over the highest. Returns the logarithm of the density of the row given all before, over the highest.
pub(super) fn step(
    model: &HiddenMarkov,
    row: &[f64],
    predicted: &mut [f64],
    beliefs: &mut [f64],
    weights: &mut [f64],
) -> f64 {
    let densities = model.densities();
    densities.logarithms(row, weights);
    if !is_lost(row) {
        weights.iter_mut().for_each(|log| *log -= densities.highest);
    }
    for ((belief, before), weight) in beliefs.iter_mut().zip(&*predicted).zip(&*weights) {
        *belief = before + weight;
    }
    let total = divide(beliefs);
    let (transition, states) = (model.transition(), beliefs.len());
    for (to, next) in predicted.iter_mut().enumerate() {
        *next = sum((0..states).map(|from| beliefs[from] + transition[from * states + to].ln()));
    }
    total
}

/// The recursion backward over logarithms of beliefs and ratios, `[row][state]`; beliefs themselves are left where the visitor writes none.
pub(super) fn sweep(model: &HiddenMarkov, beliefs: &mut [f64], ratios: &[f64], visitor: &mut impl Visit) {
    let (transition, states) = (model.transition(), model.states());
    let (mut beta, mut ahead) = (vec![0.0; states], vec![0.0; states]);
    let (mut posterior, mut each) = (vec![0.0; states], vec![0.0; states * states]);
    for (row, ratio) in ratios.chunks_exact(states).enumerate().rev() {
        let (before, rest) = beliefs.split_at_mut(row * states);
        let belief = &mut rest[..states];
        for state in 0..states {
            posterior[state] = belief[state] + beta[state];
            ahead[state] = ratio[state] + beta[state];
        }
        divide(&mut posterior);
        posterior.iter_mut().for_each(|log| *log = log.exp());
        let arrivals = match before.len().checked_sub(states) {
            Some(from) => {
                for (k, count) in each.iter_mut().enumerate() {
                    let log = before[from + k / states] + ahead[k % states];
                    *count = if transition[k] > 0.0 { log.exp().min(LARGEST) } else { 0.0 };
                }
                Arrivals::Each(&each)
            }
            None => Arrivals::None,
        };
        belief.iter_mut().for_each(|log| *log = log.exp());
        visitor.visit(Seen { row, arrivals, posterior: &posterior }, belief);
        for (from, beta) in beta.iter_mut().enumerate() {
            *beta = sum((0..states).map(|to| transition[from * states + to].ln() + ahead[to]));
        }
    }
}
