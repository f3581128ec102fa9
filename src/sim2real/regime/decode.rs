//! Which states a whole series was in: the probability of each in each row, and the likeliest path.

use std::ops::Range;

use wide::{CmpGt, f64x2, u64x2};

use super::densities::{Block, Evaluated, each_block};
use super::ends::{Chain, Ends, LANES, PerState, Steps};
use super::trellis::{self, Seen, Trellis, Visit};
use super::{HiddenMarkov, Observations, RegimeError};

/// Asks for nothing but what is believed given the whole series.
struct Believed;

impl Visit for Believed {
    const KEEPS: bool = true;

    #[inline(always)]
    fn visit(&mut self, _: Seen) {}
}

impl HiddenMarkov {
    /// Logarithm of the density of a series.
    ///
    /// # Errors
    /// A series of another width than the model's.
    pub fn log_likelihood(&self, series: Observations) -> Result<f64, RegimeError> {
        self.check(series)?;
        Ok(trellis::log_likelihood(self, series))
    }

    /// Probability of each state in each row given the whole series, `[row][state]` row after row. It looks ahead: decisions
    /// in time rest on [`Filter`](super::Filter).
    ///
    /// # Errors
    /// A series of another width than the model's.
    pub fn smooth(&self, series: Observations) -> Result<Vec<f64>, RegimeError> {
        self.check(series)?;
        let mut trellis = Trellis::default();
        trellis.forward(self, series);
        trellis.backward(self, &mut Believed);
        trellis.beliefs.truncate(series.len() * self.states());
        Ok(trellis.beliefs)
    }

    /// The likeliest path of states given the whole series, and the logarithm of its density with the series (A. J. Viterbi,
    /// IEEE Transactions on Information Theory 13, 1967). Where states are equally likely the lower number is taken.
    ///
    /// # Errors
    /// A series of another width than the model's.
    pub fn viterbi(&self, series: Observations) -> Result<(Vec<usize>, f64), RegimeError> {
        self.check(series)?;
        Ok(match self.states() {
            2 => likeliest::<[f64x2; 2]>(self, series),
            3 => likeliest::<[f64x2; 3]>(self, series),
            4 => likeliest::<[f64x2; 4]>(self, series),
            _ => likeliest::<Vec<f64x2>>(self, series),
        })
    }
}

/// The likeliest path: that of each half from its end, and which of them fit together.
fn likeliest<S: PerState<Of = f64x2>>(model: &HiddenMarkov, series: Observations) -> (Vec<usize>, f64) {
    let ways = Ways::<S>::of(model, series);
    let together = ways.scores.best.as_ref().iter().zip(ways.scores.next.as_ref());
    let start = (0, f64::NEG_INFINITY);
    // The first of the best.
    let (state, score) = together
        .map(|(here, there)| here.at(0) + there.at(1))
        .enumerate()
        .fold(start, |best, (state, score)| if score > best.1 { (state, score) } else { best });
    let mut path = vec![0; series.len()];
    let (first, last) = path.split_at_mut(ways.steps.count);
    if let Some(place) = first.last_mut() {
        let count = ways.steps.count;
        *place = state;
        ways.trace(0, state, count - 1, |steps, state| first[steps].fill(state));
        ways.trace(1, state, count, |steps, state| {
            // The last half is come by from its end, and of the row behind the series nothing is told.
            let to = (count - steps.start).min(last.len());
            last[count - steps.end..to].fill(state);
        });
    }
    (path, score)
}

/// Steps of which choices are kept in one word.
const WORD: usize = LANES / 2;

/// The best path to each state of the row after the last that was come by, from each end.
struct Ways<'a, S> {
    steps: Steps<'a>,
    scores: Scores<S>,
    /// Of each state of a step after the first, whether the best path comes from that state, of those up to it: a bit a step,
    /// `[word][to][from]`, the last step in the lowest.
    choices: Vec<u64x2>,
}

/// Logarithms of the density of the rows so far along the best path to each state of the last row, and to each of the next.
#[derive(Clone)]
struct Scores<S> {
    best: S,
    next: S,
}

impl<'a, S: PerState<Of = f64x2>> Ways<'a, S> {
    fn of(model: &HiddenMarkov, series: Observations<'a>) -> Self {
        let Chain { begin, transition, .. } = Chain::<f64x2>::of(model);
        let logarithms =
            |of: Vec<f64x2>| of.into_iter().map(|both| f64x2::each(|end| both.at(end).ln())).collect::<Vec<_>>();
        let (states, begin, transition) = (begin.len(), logarithms(begin), logarithms(transition));
        let steps = Steps::of::<f64x2>(series);
        let begin = S::of(states, |state| begin[state]);
        let mut scores = Scores { best: begin.clone(), next: begin };
        let words = states * states;
        let mut choices = vec![u64x2::ZERO; words * steps.count.div_ceil(WORD)];
        each_block(model, Evaluated::Logarithms, steps, |block| {
            let choices = &mut choices[block.from / WORD * words..][..words];
            choose(&block, &transition, steps.uneven(), &mut scores, choices);
        });
        Self { steps, scores, choices }
    }

    /// Shows `write` which state each of the first `to` steps from an end is in, the last steps first, where the best path goes on to
    /// `state`.
    fn trace(&self, end: usize, mut state: usize, mut to: usize, mut write: impl FnMut(Range<usize>, usize)) {
        let states = self.scores.best.as_ref().len();
        while to > 0 {
            let first = (to - 1) / WORD * WORD;
            // The lowest bit is that of the word's last step.
            let bit = (first + WORD).min(self.steps.count) - to;
            let choices = &self.choices[(first / WORD * states + state) * states..][..states];
            let chosen = |from: usize| choices[from].as_array_ref()[end] >> bit;
            let later = (state + 1..states).fold(0, |bits, from| bits | chosen(from));
            let stays = if state == 0 { !later } else { chosen(state) & !later };
            let stayed = (stays.trailing_ones() as usize).min(to - first);
            write(to - stayed..to, state);
            to -= stayed;
            if to > first {
                let came = |from: &usize| chosen(*from) >> stayed & 1 == 1;
                state = (1..states).rev().find(came).unwrap_or(0);
                write(to - 1..to, state);
                to -= 1;
            }
        }
    }
}

/// Goes on over a block, and writes where paths come from. A function of its own, so that scores stay in registers.
#[inline(never)]
fn choose<S: PerState<Of = f64x2>>(
    block: &Block<f64x2>,
    transition: &[f64x2],
    uneven: bool,
    scores: &mut Scores<S>,
    choices: &mut [u64x2],
) {
    let Scores { mut best, mut next } = scores.clone();
    let states = best.as_ref().len();
    let mut words = S::each(states, |_| S::each(states, |_| u64x2::ZERO));
    block.each_step::<S>(|step, densities| {
        let (best, next) = (best.as_mut(), next.as_mut());
        let states = best.len();
        let transition = &transition[..states * states];
        for ((best, before), density) in best.iter_mut().zip(&*next).zip(densities.as_ref()) {
            *best = *before + *density;
        }
        for (to, words) in words.as_mut().iter_mut().enumerate() {
            let mut score = best[0] + transition[to];
            for (from, bits) in words.as_mut().iter_mut().enumerate().skip(1) {
                let candidate = best[from] + transition[from * states + to];
                // All bits of what is better are set, which is -1.
                let better: u64x2 = bytemuck::cast(candidate.cmp_gt(score));
                *bits = *bits + *bits - better;
                score = candidate.fast_max(score);
            }
            next[to] = score;
        }
        if uneven && step == 0 {
            // Of a row behind the series nothing is expected.
            next.iter_mut().for_each(|score| *score = score.with(1, 0.0));
        }
    });
    *scores = Scores { best, next };
    for (kept, words) in choices.chunks_exact_mut(states).zip(words.as_ref()) {
        kept.copy_from_slice(words.as_ref());
    }
}
