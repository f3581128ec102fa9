//! The recursions over a whole series: from its ends to where they meet, and on over what was found there.

use wide::f64x2;

use super::course::{Course, LARGEST, Meeting, predict};
use super::densities::{Block, Evaluated, each_block};
use super::ends::{Chain, Ends, PerState, Steps};
use super::{HiddenMarkov, Observations, in_logs};

/// Runs from the first row on and shows each row's belief: what is found of a row rests on no later one.
pub(super) fn follow(model: &HiddenMarkov, series: Observations, see: impl FnMut(&[f64])) {
    if !model.mixes() {
        return in_logs::follow(model, series, see);
    }
    match model.states() {
        2 => follow_of::<[f64; 2]>(model, series, see),
        3 => follow_of::<[f64; 3]>(model, series, see),
        4 => follow_of::<[f64; 4]>(model, series, see),
        _ => follow_of::<Vec<f64>>(model, series, see),
    }
}

#[inline(always)]
fn follow_of<S: PerState<Of = f64>>(model: &HiddenMarkov, series: Observations, mut see: impl FnMut(&[f64])) {
    let mut belief = S::of(model.states(), |_| 0.0);
    run::<S>(model, series, |course| {
        course.believe(belief.as_mut());
        see(belief.as_ref());
    });
}

/// Logarithm of the density of a series.
pub(super) fn log_likelihood(model: &HiddenMarkov, series: Observations) -> f64 {
    let meeting = match model.states() {
        _ if !model.mixes() => None,
        2 => met::<[f64x2; 2]>(model, series),
        3 => met::<[f64x2; 3]>(model, series),
        4 => met::<[f64x2; 4]>(model, series),
        _ => met::<Vec<f64x2>>(model, series),
    };
    match meeting {
        Some(meeting) => meeting.log_likelihood,
        None => in_logs::log_likelihood(model, series),
    }
}

fn met<S: PerState<Of = f64x2>>(model: &HiddenMarkov, series: Observations) -> Option<Meeting> {
    run::<S>(model, series, |_| ()).meet(model, series.observed())
}

/// Runs over a series; `see` is shown where the recursion is after each step.
#[inline(always)]
fn run<S: PerState>(model: &HiddenMarkov, series: Observations, mut see: impl FnMut(&Course<S>)) -> Course<S> {
    let (chain, steps) = (Chain::of(model), Steps::of::<S::Of>(series));
    let mut course = Course::new(&chain.begin);
    each_block(model, Evaluated::Weights, steps, |block| advance(&block, steps, &chain, &mut course, &mut see));
    course
}

/// Goes on over a block. A function of its own, so that where the recursion is stays in registers.
#[inline(never)]
fn advance<S: PerState>(
    block: &Block<S::Of>,
    steps: Steps,
    chain: &Chain<S::Of>,
    from: &mut Course<S>,
    mut see: impl FnMut(&Course<S>),
) {
    let mut course = from.clone();
    block.each_step::<S>(|step, weights| {
        course.step(chain.model, &chain.transition, weights, |end| steps.row(step, end));
        see(&course);
    });
    *from = course;
}

/// What is known of a step's rows where the second recursion comes by, side by side. Of the half from the last row back, everything is as
/// seen from there: the row before a row is the one that follows it.
pub(super) struct Seen<'a> {
    /// The step.
    pub step: usize,
    /// Number of ends: of what was taken from one end only, numbers of the other are 0.
    pub ends: usize,
    /// Probability of each state given the whole series.
    pub posterior: &'a [f64x2],
    /// Transitions into them from the rows before.
    pub arrivals: Arrivals<'a>,
}

/// Expected number of transitions into a row, over their probability.
pub(super) enum Arrivals<'a> {
    /// There is no row before.
    None,
    /// The products of what was believed `before` and, for each state, how much more likely the row and all that follow are than they were
    /// given all before.
    Products { before: &'a [f64x2], ahead: &'a [f64x2] },
    /// `[from][to]`, of the first end.
    Each(&'a [f64]),
}

/// Who is shown what is known by [`Trellis::backward`]: a trait, because its method can be told to be inlined.
pub(super) trait Visit {
    /// Whether what is believed given the whole series takes the place of what was believed without what follows.
    const KEEPS: bool;

    /// Takes what is known of a step's rows.
    fn visit(&mut self, seen: Seen);
}

/// What the first recursions found, step after step.
#[derive(Debug, Clone, Default)]
pub(super) struct Trellis {
    /// Probability of each state given the rows up to this one, `[row][state]`, with the row behind the series where there is one.
    pub beliefs: Vec<f64>,
    /// Number of steps.
    count: usize,
    /// Whether there is a row behind the series.
    uneven: bool,
    /// Of each half, for each state of its last row as it is come by, how much more likely the other half is than it was given this one.
    beyond: Vec<f64x2>,
    /// What was found in logarithms, where the recursions do not meet.
    in_logs: Option<in_logs::Trellis>,
    /// Expected number of transitions from the first half into the other, over their probability; none where there is no other.
    pub crossing: Vec<f64>,
    pub log_likelihood: f64,
}

impl Trellis {
    /// Runs from the ends of a series to where they meet; what was held before is overwritten, and its memory used again.
    pub fn forward(&mut self, model: &HiddenMarkov, series: Observations) {
        let met = match model.states() {
            _ if !model.mixes() => None,
            2 => self.forward_of::<[f64x2; 2]>(model, series),
            3 => self.forward_of::<[f64x2; 3]>(model, series),
            4 => self.forward_of::<[f64x2; 4]>(model, series),
            _ => self.forward_of::<Vec<f64x2>>(model, series),
        };
        if let Some(Meeting { log_likelihood, beyond, crossing }) = met {
            self.in_logs = None;
            (self.log_likelihood, self.beyond) = (log_likelihood, beyond);
            self.crossing = if series.len() > 1 { crossing } else { vec![] };
        } else {
            let found = in_logs::Trellis::of(model, series);
            self.log_likelihood = found.log_likelihood;
            self.crossing.clear();
            self.in_logs = Some(found);
        }
    }

    fn forward_of<S: PerState<Of = f64x2>>(&mut self, model: &HiddenMarkov, series: Observations) -> Option<Meeting> {
        let (states, steps) = (model.states(), Steps::of::<f64x2>(series));
        (self.count, self.uneven) = (steps.count, steps.uneven());
        self.beliefs.resize(2 * steps.count * states, 0.0);
        let (first, last) = self.beliefs.split_at_mut(steps.count * states);
        let mut places = first.chunks_exact_mut(states).zip(last.rchunks_exact_mut(states));
        let mut believed = S::of(states, |_| f64x2::ZERO);
        let course = run::<S>(model, series, |course| {
            let Some((first, last)) = places.next() else { return };
            course.believe(believed.as_mut());
            write(believed.as_ref(), first, last);
        });
        course.meet(model, series.observed())
    }

    /// Runs on from where the ends met to the ends, over what was found there, and shows `visitor` each step, the last first.
    pub fn backward(&mut self, model: &HiddenMarkov, visitor: &mut impl Visit) {
        match model.states() {
            _ if self.in_logs.is_some() => {
                let beliefs = &mut self.beliefs;
                self.in_logs.iter().for_each(|found| found.sweep(model, beliefs, visitor));
            }
            2 => self.sweep::<[f64x2; 2], _>(model, visitor),
            3 => self.sweep::<[f64x2; 3], _>(model, visitor),
            4 => self.sweep::<[f64x2; 4], _>(model, visitor),
            _ => self.sweep::<Vec<f64x2>, _>(model, visitor),
        }
    }

    /// The second recursion, against the first.
    #[inline(always)]
    fn sweep<S: PerState<Of = f64x2>, V: Visit>(&mut self, model: &HiddenMarkov, visitor: &mut V) {
        let Chain { transition, begin, .. } = Chain::<f64x2>::of(model);
        let states = begin.len();
        let mut beta = S::of(states, |state| self.beyond[state]);
        let (mut posterior, mut ahead, mut belief) = (beta.clone(), beta.clone(), beta.clone());
        let (mut before, mut predicted) = (beta.clone(), beta.clone());
        let (beta, posterior, ahead) = (beta.as_mut(), posterior.as_mut(), ahead.as_mut());
        let (states, transition) = (beta.len(), &transition[..beta.len() * beta.len()]);
        let (first, last) = self.beliefs.split_at_mut(self.count * states);
        if self.count > 0 {
            read(before.as_mut(), &first[(self.count - 1) * states..], &last[..states]);
        }
        for step in (0..self.count).rev() {
            let (here, there) = (step * states, (self.count - 1 - step) * states);
            belief.as_mut().copy_from_slice(before.as_ref());
            if step > 0 {
                read(before.as_mut(), &first[here - states..], &last[there + states..]);
            }
            // Densities of the row in each state, over that given all before, are how much more is believed than was expected: of a
            // model that mixes something was expected of every state.
            predict(transition, before.as_ref(), predicted.as_mut());
            let mut sum = f64x2::ZERO;
            for ((state, belief), expected) in belief.as_ref().iter().enumerate().zip(predicted.as_ref()) {
                posterior[state] = *belief * beta[state];
                ahead[state] = posterior[state] / *expected;
                sum += posterior[state];
            }
            let inverse = f64x2::ONE / sum;
            for probability in posterior.iter_mut() {
                *probability *= inverse;
            }
            if self.uneven && step == 1 {
                // Nothing came from a row that is not there.
                before.as_mut().iter_mut().for_each(|before| *before = before.with(1, 0.0));
            }
            let arrivals = if step > 0 { Arrivals::Products { before: before.as_ref(), ahead } } else { Arrivals::None };
            visitor.visit(Seen { step, ends: 2, posterior, arrivals });
            if V::KEEPS {
                write(posterior, &mut first[here..], &mut last[there..]);
            }
            for from in 0..states {
                let mut product = transition[from * states] * ahead[0];
                for to in 1..states {
                    product += transition[from * states + to] * ahead[to];
                }
                beta[from] = product.at_most(LARGEST);
            }
        }
    }
}

/// Writes numbers of a step to where its two rows are.
#[inline(always)]
fn write(numbers: &[f64x2], first: &mut [f64], last: &mut [f64]) {
    for ((number, first), last) in numbers.iter().zip(first).zip(last) {
        [*first, *last] = number.to_array();
    }
}

/// Reads them from there.
#[inline(always)]
fn read(numbers: &mut [f64x2], first: &[f64], last: &[f64]) {
    for ((number, first), last) in numbers.iter_mut().zip(first).zip(last) {
        *number = f64x2::from([*first, *last]);
    }
}
