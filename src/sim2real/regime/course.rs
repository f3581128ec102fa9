//! The recursion over rows: what is believed of the states from row to row, so scaled that no product of densities underflows.

use std::f64::consts::LN_2;

use wide::f64x2;

use super::HiddenMarkov;
use super::ends::{Ends, PerState};
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

/// Where the recursion is, from one end of a series or from both.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Course<S: PerState> {
    /// Density of the rows so far together with each state, over a factor that all states share.
    joint: S,
    /// The same of the state before the next row.
    predicted: S,
    /// Sum of `joint`.
    mass: S::Of,
    /// Logarithm of that factor, but for the highest density of each row that was not lost.
    log: S::Of,
}

impl<S: PerState> Course<S> {
    /// Before any row, with what is known of the state before it.
    pub fn new(begin: &[S::Of]) -> Self {
        let begin = S::of(begin.len(), |state| begin[state]);
        Self { joint: begin.clone(), predicted: begin, mass: S::Of::each(|_| 1.0), log: S::Of::each(|_| 0.0) }
    }

    /// Takes the next row, of which `weights` are the densities over the highest. `transition` is that of
    /// [`Chain`](super::ends::Chain), and `row` tells the row of an end.
    #[inline(always)]
    pub fn step<'a>(
        &mut self,
        model: &HiddenMarkov,
        transition: &[S::Of],
        weights: &S,
        row: impl Fn(usize) -> Option<&'a [f64]>,
    ) {
        let states = weights.as_ref().len();
        let (joint, predicted) = (self.joint.as_mut(), self.predicted.as_ref());
        for ((joint, weight), before) in joint.iter_mut().zip(weights.as_ref()).zip(predicted) {
            *joint = *weight * *before;
        }
        self.mass = total(joint);
        if self.mass.below(LEAST) {
            // Of a copy, so that what is seldom needed does not keep the others out of registers.
            let mut joint = self.joint.clone();
            let rows = std::array::from_fn(|end| if end < S::Of::COUNT { row(end) } else { None });
            let scaled = rescaled(model, rows, joint.as_mut(), self.predicted.clone().as_ref());
            self.joint = joint;
            self.log = self.log + scaled.log;
            self.mass = scaled.mass;
        }
        predict(&transition[..states * states], self.joint.as_ref(), self.predicted.as_mut());
    }

    /// Writes the probability of each state given the rows so far.
    #[inline(always)]
    pub fn believe(&self, into: &mut [S::Of]) {
        let inverse = S::Of::each(|_| 1.0) / self.mass;
        for (belief, joint) in into.iter_mut().zip(self.joint.as_ref()) {
            *belief = *joint * inverse;
        }
    }

    /// Logarithm of the density of all rows so far from the first on, of which `observed` were not lost.
    pub fn log_likelihood(&self, model: &HiddenMarkov, observed: u64) -> f64 {
        observed as f64 * model.densities().highest + self.log.at(0) + self.mass.at(0).ln()
    }
}

impl<S: PerState<Of = f64x2>> Course<S> {
    /// What is known where the recursions from both ends meet; `None` where hardly anything that the one holds possible is possible to the
    /// other, so that digits would be lost.
    pub fn meet(&self, model: &HiddenMarkov, observed: usize) -> Option<Meeting> {
        let (joint, predicted) = (self.joint.as_ref(), self.predicted.as_ref());
        let together: f64 = joint.iter().zip(predicted).map(|(here, there)| here.at(0) * there.at(1)).sum();
        // Not a number is no meeting either.
        let met = together >= FAINT;
        let factors: [f64; 2] = std::array::from_fn(|end| self.mass.at(end) / together);
        met.then(|| Meeting {
            log_likelihood: observed as f64 * model.densities().highest + self.log.at(0) + self.log.at(1) + together.ln(),
            beyond: predicted.iter().map(|there| f64x2::each(|end| there.at(1 - end) * factors[end])).collect(),
            crossing: joint.iter().flat_map(|from| joint.iter().map(move |to| from.at(0) * (to.at(1) / together))).collect(),
        })
    }
}

/// Where two recursions meet.
pub(super) struct Meeting {
    /// Logarithm of the density of all rows.
    pub log_likelihood: f64,
    /// Of each half, for each state of its last row as it is come by, how much more likely the other half is than it was given this one.
    pub beyond: Vec<f64x2>,
    /// Expected number of transitions from the first half into the other, over their probability, `[from][to]`.
    pub crossing: Vec<f64>,
}

/// What becomes of masses of which one has grown small.
struct Scaled<X> {
    mass: X,
    /// Logarithm of what the mass was divided by.
    log: X,
}

/// Brings masses near 1; where hardly anything is left of one its row is taken again, in logarithms.
#[cold]
#[inline(never)]
fn rescaled<X: Ends>(model: &HiddenMarkov, rows: [Option<&[f64]>; 2], joint: &mut [X], predicted: &[X]) -> Scaled<X> {
    let mass = total(joint);
    let left = |end: usize| mass.at(end) >= FAINT;
    let exponent = |end: usize| if left(end) { (mass.at(end).to_bits() >> 52) as i64 - 1_023 } else { 0 };
    let factor = X::each(|end| power_of_two(-exponent(end)));
    joint.iter_mut().for_each(|joint| *joint = *joint * factor);
    let mut scaled = Scaled { mass: mass * factor, log: X::each(|end| exponent(end) as f64 * LN_2) };
    for end in (0..X::COUNT).filter(|end| !left(*end)) {
        let log = taken_again(model, rows[end], end, joint, predicted);
        scaled = Scaled { mass: scaled.mass.with(end, 1.0), log: scaled.log.with(end, log) };
    }
    scaled
}

/// Takes a row again, in logarithms; returns that of its density given all before, over the highest.
fn taken_again<X: Ends>(model: &HiddenMarkov, row: Option<&[f64]>, end: usize, joint: &mut [X], predicted: &[X]) -> f64 {
    let mut logs = vec![0.0; joint.len()];
    let row = row.filter(|row| !is_lost(row));
    if let Some(row) = row {
        model.densities().logarithms(row, &mut logs);
    }
    logs.iter_mut().zip(predicted).for_each(|(log, before)| *log += before.at(end).ln());
    let peak = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = logs.iter().map(|log| (log - peak).exp()).sum();
    for (joint, log) in joint.iter_mut().zip(logs) {
        *joint = joint.with(end, (log - peak).exp() / sum);
    }
    peak + sum.ln() - if row.is_some() { model.densities().highest } else { 0.0 }
}

/// The sum over states.
#[inline(always)]
fn total<X: Ends>(joint: &[X]) -> X {
    let mut sum = joint[0];
    for joint in &joint[1..] {
        sum = sum + *joint;
    }
    sum
}

/// `next[j] = sum of from[i] transition[i][j]`.
#[inline(always)]
pub(super) fn predict<X: Ends>(transition: &[X], from: &[X], next: &mut [X]) {
    let states = next.len();
    for to in 0..states {
        let mut sum = from[0] * transition[to];
        for state in 1..states {
            sum = sum + from[state] * transition[state * states + to];
        }
        next[to] = sum;
    }
}
