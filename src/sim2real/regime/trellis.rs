//! The recursions over a whole series: forward, and backward over what was found forward.

use super::course::{Course, LARGEST, PerState};
use super::densities::{Block, Evaluated, each_block};
use super::{HiddenMarkov, Observations};

/// Runs forward over a series, shows each row's belief, and gives the log-likelihood: bit by bit what [`Trellis::forward`] finds,
/// without its memory.
pub(super) fn follow(model: &HiddenMarkov, series: Observations, see: impl FnMut(&[f64])) -> f64 {
    match model.states() {
        2 => follow_of::<[f64; 2]>(model, series, see),
        3 => follow_of::<[f64; 3]>(model, series, see),
        4 => follow_of::<[f64; 4]>(model, series, see),
        _ => follow_of::<Vec<f64>>(model, series, see),
    }
}

#[inline(always)]
fn follow_of<S: PerState>(model: &HiddenMarkov, series: Observations, mut see: impl FnMut(&[f64])) -> f64 {
    let mut course = Course::<S>::new(model);
    let mut belief = S::of(model.initial());
    each_block(model, Evaluated::Weights, series, |block| {
        advance(block, &mut course, |course, _, _| {
            course.believe(belief.as_mut());
            see(belief.as_ref());
        });
    });
    course.log_likelihood(model)
}

/// Goes on over a block; `see` is shown where it is after each row, its weights, and what makes ratios of them. A function of its own, so that
/// where it is stays in registers.
#[inline(never)]
fn advance<S: PerState>(block: &Block, from: &mut Course<S>, mut see: impl FnMut(&Course<S>, &S, f64)) {
    let mut course = from.clone();
    block.each_row::<S>(|row, weights| {
        let inverse = course.step(block.model, row, weights);
        see(&course, weights, inverse);
    });
    *from = course;
}

/// What is known of a row where the recursion backward comes by.
pub(super) struct Seen<'a> {
    pub row: usize,
    /// What was believed of the row before it; nothing of the first.
    pub before: Option<&'a [f64]>,
    /// What was believed of it given the rows up to it. It is read no more.
    pub belief: &'a mut [f64],
    /// Probability of each state given the whole series.
    pub posterior: &'a [f64],
    /// For each state how much more likely the row and all that follow are than they were given all before: the expected number of
    /// transitions into this row is `before[i] transition[i][j] ahead[j]`.
    pub ahead: &'a [f64],
}

/// Who is shown the rows by [`Trellis::backward`]: a trait, because its method can be told to be inlined.
pub(super) trait Visit {
    /// Takes what is known of a row.
    fn visit(&mut self, seen: Seen);
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
            2 => self.forward_of::<[f64; 2]>(2, model, series),
            3 => self.forward_of::<[f64; 3]>(3, model, series),
            4 => self.forward_of::<[f64; 4]>(4, model, series),
            states => self.forward_of::<Vec<f64>>(states, model, series),
        }
    }

    #[inline(always)]
    fn forward_of<S: PerState>(&mut self, states: usize, model: &HiddenMarkov, series: Observations) {
        let mut course = Course::<S>::new(model);
        let mut rows = self.beliefs.chunks_exact_mut(states).zip(self.ratios.chunks_exact_mut(states));
        each_block(model, Evaluated::Weights, series, |block| {
            advance(block, &mut course, |course, weights, inverse| {
                let Some((belief, ratios)) = rows.next() else { return };
                for (ratio, weight) in ratios.iter_mut().zip(weights.as_ref()) {
                    *ratio = weight * inverse;
                }
                course.believe(belief);
            });
        });
        self.log_likelihood = course.log_likelihood(model);
    }

    /// Runs backward over what the recursion forward found, and shows `visitor` each row, the last first.
    #[inline(always)]
    pub fn backward(&mut self, model: &HiddenMarkov, visitor: &mut impl Visit) {
        match self.states {
            2 => self.backward_of::<[f64; 2]>(model, visitor),
            3 => self.backward_of::<[f64; 3]>(model, visitor),
            4 => self.backward_of::<[f64; 4]>(model, visitor),
            _ => self.backward_of::<Vec<f64>>(model, visitor),
        }
    }

    #[inline(always)]
    fn backward_of<S: PerState>(&mut self, model: &HiddenMarkov, visitor: &mut impl Visit) {
        let (mut beta, mut posterior, mut ahead) = (S::of(model.initial()), S::of(model.initial()), S::of(model.initial()));
        let (beta, posterior, ahead) = (beta.as_mut(), posterior.as_mut(), ahead.as_mut());
        let states = beta.len();
        let transition = &model.transition()[..states * states];
        beta.fill(1.0);
        let (beliefs, ratios) = (self.beliefs.as_mut_slice(), self.ratios.as_slice());
        for (row, ratio) in ratios.chunks_exact(states).enumerate().rev() {
            let (before, rest) = beliefs.split_at_mut(row * states);
            let before = row.checked_sub(1).map(|row| &before[row * states..][..states]);
            let belief = &mut rest[..states];
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
            visitor.visit(Seen { row, before, belief, posterior, ahead });
            for from in 0..states {
                let mut product = transition[from * states] * ahead[0];
                for to in 1..states {
                    product += transition[from * states + to] * ahead[to];
                }
                beta[from] = if product < LARGEST { product } else { LARGEST };
            }
        }
    }
}
