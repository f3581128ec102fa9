//! The recursions forward and backward over a series, scaled so that no product of densities under- or overflows.

use super::emission::Densities;
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

/// What a row says: its probability density given all before, as `exp(peak) * scale`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Evidence {
    pub peak: f64,
    pub scale: f64,
}

impl Evidence {
    pub fn logarithm(self) -> f64 {
        self.peak + self.scale.ln()
    }
}

/// Turns what was predicted into what is believed once `row` is known. `weights` is left at the density of each state over
/// `exp(peak)`; a state that cannot be may be left at 0.
#[inline(always)]
pub(super) fn absorb(
    densities: &Densities,
    row: &[f64],
    predicted: &[f64],
    weights: &mut [f64],
    belief: &mut [f64],
) -> Evidence {
    densities.logarithms(row, weights);
    let peak = weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut scale = 0.0;
    for ((weight, before), after) in weights.iter_mut().zip(predicted).zip(belief.iter_mut()) {
        *weight = (*weight - peak).exp();
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
    Evidence { peak, scale }
}

/// The same in logarithms, over the states that can be.
#[cold]
fn absorb_faint(
    densities: &Densities,
    row: &[f64],
    predicted: &[f64],
    weights: &mut [f64],
    belief: &mut [f64],
) -> Evidence {
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
    Evidence { peak: peak + sum.ln(), scale: 1.0 }
}

/// A sum of logarithms that takes one for many factors.
#[derive(Debug, Clone, Copy)]
struct LogProduct {
    sum: f64,
    product: f64,
}

impl LogProduct {
    fn multiply(&mut self, factor: f64) {
        if factor < 1e-100 {
            self.sum += factor.ln();
            return;
        }
        self.product *= factor;
        // A scale is at most the number of states.
        if !(1e-150..=1e150).contains(&self.product) {
            self.sum += self.product.ln();
            self.product = 1.0;
        }
    }
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
        let mut total = LogProduct { sum: 0.0, product: 1.0 };
        let rows = self.beliefs.chunks_exact_mut(states).zip(self.ratios.chunks_exact_mut(states));
        for (row, (belief, ratio)) in series.iter().zip(rows) {
            let evidence = absorb(model.densities(), row, &predicted, ratio, belief);
            let inverse = 1.0 / evidence.scale;
            for weight in ratio.iter_mut() {
                *weight *= inverse;
            }
            total.sum += evidence.peak;
            total.multiply(evidence.scale);
            predict_of(states, model.transition(), belief, &mut predicted);
        }
        self.log_likelihood = total.sum + total.product.ln();
    }

    /// Runs backward, and shows for each row, the last first: its number, the probability of each state given the whole
    /// series, and for each state how much more likely its row and all that follow are than they were given all before
    /// (`ahead`): the expected number of transitions into this row is `belief[i] transition[i][j] ahead[j]`.
    pub fn backward(&self, model: &HiddenMarkov, visit: impl FnMut(usize, &[f64], &[f64])) {
        match self.states {
            2 => self.backward_of(2, model, visit),
            3 => self.backward_of(3, model, visit),
            4 => self.backward_of(4, model, visit),
            states => self.backward_of(states, model, visit),
        }
    }

    #[inline(always)]
    fn backward_of(&self, states: usize, model: &HiddenMarkov, mut visit: impl FnMut(usize, &[f64], &[f64])) {
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
            visit(row, posterior, ahead);
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
