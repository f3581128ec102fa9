//! The recursions forward and backward over a series, scaled so that no product of densities under- or overflows.

use super::emission::Densities;
use super::observations::is_lost;
use super::{HiddenMarkov, Observations};

/// Below this the evidence of a row is added up in logarithms: almost only states that cannot be would explain it.
const FAINT: f64 = 1e-280;

/// Bound of what is multiplied, so that no product is infinite.
const LARGEST: f64 = 1e300;

/// Probabilities of the next state, `next[j] = sum of belief[i] transition[i][j]`.
#[inline(always)]
pub(super) fn predict(transition: &[f64], belief: &[f64], next: &mut [f64]) {
    match next.len() {
        2 => predict_of(2, transition, belief, next),
        3 => predict_of(3, transition, belief, next),
        4 => predict_of(4, transition, belief, next),
        states => predict_of(states, transition, belief, next),
    }
}

#[inline(always)]
fn predict_of(states: usize, transition: &[f64], belief: &[f64], next: &mut [f64]) {
    let (belief, next) = (&belief[..states], &mut next[..states]);
    next.fill(0.0);
    for (from, row) in belief.iter().zip(transition.chunks_exact(states)) {
        for (to, probability) in next.iter_mut().zip(row) {
            *to += from * probability;
        }
    }
}

/// What a row says: its probability density given all before, as `exp(peak) / inverse`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Evidence {
    peak: f64,
    scale: f64,
    inverse: f64,
}

/// Turns what was predicted into what is believed once `row` is known. `weights` is left at the density of each state over
/// `exp(peak)`; of a state that cannot be it may be left at 0.
#[inline(always)]
pub(super) fn absorb(
    densities: &Densities,
    row: &[f64],
    predicted: &[f64],
    weights: &mut [f64],
    belief: &mut [f64],
) -> Evidence {
    densities.weights(row, weights);
    let mut scale = 0.0;
    for ((weight, before), after) in weights.iter().zip(predicted).zip(belief.iter_mut()) {
        *after = *weight * before;
        scale += *after;
    }
    if scale < FAINT {
        return absorb_faint(densities, row, predicted, weights, belief);
    }
    let inverse = 1.0 / scale;
    for after in belief.iter_mut() {
        *after *= inverse;
    }
    let peak = if is_lost(row) { 0.0 } else { densities.highest };
    Evidence { peak, scale, inverse }
}

/// The same in logarithms, over the states that can be.
#[cold]
#[inline(never)]
fn absorb_faint(densities: &Densities, row: &[f64], predicted: &[f64], weights: &mut [f64], belief: &mut [f64]) -> Evidence {
    densities.logarithms(row, belief);
    let mut peak = f64::NEG_INFINITY;
    for (log, before) in belief.iter_mut().zip(predicted) {
        *log += before.ln();
        peak = peak.max(*log);
    }
    let mut sum = 0.0;
    for log in belief.iter_mut() {
        *log = (*log - peak).exp();
        sum += *log;
    }
    for ((after, weight), before) in belief.iter_mut().zip(weights).zip(predicted) {
        *after /= sum;
        *weight = if *before > 0.0 { (*after / before).min(LARGEST) } else { 0.0 };
    }
    Evidence { peak: peak + sum.ln(), scale: 1.0, inverse: 1.0 }
}

/// The logarithm of a product of evidence, which takes one logarithm for many factors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LogProduct {
    sum: f64,
    product: f64,
}

impl LogProduct {
    /// Of nothing.
    pub const ONE: Self = Self { sum: 0.0, product: 1.0 };

    #[inline(always)]
    pub fn multiply(&mut self, evidence: Evidence) {
        self.sum += evidence.peak;
        let product = self.product * evidence.scale;
        // A scale is at least `FAINT` and, but for rounding, at most 1.
        if product < 1e-300 {
            self.sum += self.product.ln() + evidence.scale.ln();
            self.product = 1.0;
        } else {
            self.product = product;
        }
    }

    pub fn logarithm(self) -> f64 {
        self.sum + self.product.ln()
    }
}

/// Who is shown the rows by [`Trellis::backward`], the last first.
pub(super) trait Visit {
    /// The number of a row, the probability of each state given the whole series, and for each state how much more likely its row
    /// and all that follow are than they were given all before: the expected number of transitions into this row is
    /// `belief[i] transition[i][j] ahead[j]`.
    fn visit(&mut self, row: usize, posterior: &[f64], ahead: &[f64]);
}

/// Runs forward over a series, shows each row's belief, and gives the log-likelihood: bit by bit what [`Trellis::forward`] finds,
/// without its memory.
pub(super) fn follow(model: &HiddenMarkov, series: Observations, mut see: impl FnMut(&[f64])) -> f64 {
    let states = model.states();
    let mut predicted = model.initial().to_vec();
    let (mut weights, mut belief) = (vec![0.0; states], vec![0.0; states]);
    let mut total = LogProduct::ONE;
    for row in series.iter() {
        total.multiply(absorb(model.densities(), row, &predicted, &mut weights, &mut belief));
        see(&belief);
        predict(model.transition(), &belief, &mut predicted);
    }
    total.logarithm()
}

/// What the recursion forward found, row after row.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Trellis {
    states: usize,
    /// Probability of each state given the rows up to this one, `[row][state]`.
    pub beliefs: Vec<f64>,
    /// Density of the row in each state over its density given all before, `[row][state]`.
    ratios: Vec<f64>,
    pub log_likelihood: f64,
}

impl Trellis {
    /// Runs forward over a series; what was held before is overwritten, and its memory used again.
    pub fn forward(&mut self, model: &HiddenMarkov, series: Observations) {
        self.states = model.states();
        let size = series.len() * self.states;
        self.beliefs.resize(size, 0.0);
        self.ratios.resize(size, 0.0);
        match self.states {
            2 => self.forward_of(2, model, series),
            3 => self.forward_of(3, model, series),
            4 => self.forward_of(4, model, series),
            states => self.forward_of(states, model, series),
        }
    }

    #[inline(always)]
    fn forward_of(&mut self, states: usize, model: &HiddenMarkov, series: Observations) {
        let mut predicted = model.initial().to_vec();
        let mut total = LogProduct::ONE;
        let rows = self.beliefs.chunks_exact_mut(states).zip(self.ratios.chunks_exact_mut(states));
        for (row, (belief, ratio)) in series.iter().zip(rows) {
            let evidence = absorb(model.densities(), row, &predicted, ratio, belief);
            for weight in ratio.iter_mut() {
                *weight *= evidence.inverse;
            }
            total.multiply(evidence);
            predict_of(states, model.transition(), belief, &mut predicted);
        }
        self.log_likelihood = total.logarithm();
    }

    /// Runs backward over what the recursion forward found.
    pub fn backward(&self, model: &HiddenMarkov, visitor: &mut impl Visit) {
        match self.states {
            2 => self.backward_of(2, model, visitor),
            3 => self.backward_of(3, model, visitor),
            4 => self.backward_of(4, model, visitor),
            states => self.backward_of(states, model, visitor),
        }
    }

    #[inline(always)]
    fn backward_of(&self, states: usize, model: &HiddenMarkov, visitor: &mut impl Visit) {
        let (mut beta, mut posterior, mut ahead) = (vec![1.0; states], vec![0.0; states], vec![0.0; states]);
        let (beta, posterior, ahead) = (&mut beta[..states], &mut posterior[..states], &mut ahead[..states]);
        let rows = self.beliefs.chunks_exact(states).zip(self.ratios.chunks_exact(states));
        for (row, (belief, ratio)) in rows.enumerate().rev() {
            let mut sum = 0.0;
            for state in 0..states {
                posterior[state] = belief[state] * beta[state];
                ahead[state] = ratio[state] * beta[state];
                sum += posterior[state];
            }
            let inverse = 1.0 / sum;
            for probability in posterior.iter_mut() {
                *probability *= inverse;
            }
            visitor.visit(row, posterior, ahead);
            for (before, transitions) in beta.iter_mut().zip(model.transition().chunks_exact(states)) {
                let mut product = 0.0;
                for (probability, after) in transitions.iter().zip(ahead.iter()) {
                    product += probability * after;
                }
                *before = product.min(LARGEST);
            }
        }
    }
}
