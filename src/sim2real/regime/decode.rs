//! Which states a whole series was in: the probability of each in each row, and the likeliest path.

use super::course::PerState;
use super::densities::{Block, Evaluated, each_block};
use super::trellis::{Seen, Trellis, Visit, follow};
use super::{HiddenMarkov, Observations, RegimeError};

/// Writes what is believed given the whole series over what was believed without what follows.
struct InPlace;

impl Visit for InPlace {
    #[inline(always)]
    fn visit(&mut self, seen: Seen) {
        seen.belief.copy_from_slice(seen.posterior);
    }
}

impl HiddenMarkov {
    /// Logarithm of the density of a series.
    ///
    /// # Errors
    /// A series of another width than the model's.
    pub fn log_likelihood(&self, series: Observations) -> Result<f64, RegimeError> {
        self.check(series)?;
        Ok(follow(self, series, |_| ()))
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
        trellis.backward(self, &mut InPlace);
        Ok(trellis.beliefs)
    }

    /// The likeliest path of states given the whole series, and the logarithm of its density with the series (A. J. Viterbi,
    /// IEEE Transactions on Information Theory 13, 1967). Of paths equally likely it is the one of lower numbers.
    ///
    /// # Errors
    /// A series of another width than the model's.
    pub fn viterbi(&self, series: Observations) -> Result<(Vec<usize>, f64), RegimeError> {
        self.check(series)?;
        Ok(match self.states() {
            2 => likeliest::<[f64; 2]>(self, series),
            3 => likeliest::<[f64; 3]>(self, series),
            4 => likeliest::<[f64; 4]>(self, series),
            _ => likeliest::<Vec<f64>>(self, series),
        })
    }
}

/// The recursion of Viterbi.
fn likeliest<S: PerState>(model: &HiddenMarkov, series: Observations) -> (Vec<usize>, f64) {
    let states = model.states();
    let transition: Vec<f64> = model.transition().iter().map(|p| p.ln()).collect();
    let mut scores = Scores { best: S::of(model.initial()), next: S::of(model.initial()) };
    scores.next.as_mut().iter_mut().for_each(|probability| *probability = probability.ln());
    // Where the best path to each state of the next row comes from, `[row][state]`.
    let mut origins = vec![0_u32; series.len() * states];
    each_block(model, Evaluated::Logarithms, series, |block| {
        choose(block, &transition, &mut scores, &mut origins[block.from * states..]);
    });
    let (mut state, mut score) = (0, f64::NEG_INFINITY);
    for (candidate, of) in scores.best.as_ref().iter().enumerate() {
        if *of > score {
            (state, score) = (candidate, *of);
        }
    }
    let mut path = vec![state; series.len()];
    for (place, origin) in path.iter_mut().zip(origins.chunks_exact(states)).rev().skip(1) {
        state = origin[state] as usize;
        *place = state;
    }
    (path, score)
}

/// Logarithms of the density of the rows so far along the best path to each state of the last row, and to each of the next.
#[derive(Clone)]
struct Scores<S> {
    best: S,
    next: S,
}

/// Goes on over a block, and writes where paths come from. A function of its own, so that scores stay in registers.
#[inline(never)]
fn choose<S: PerState>(block: &Block, transition: &[f64], scores: &mut Scores<S>, origins: &mut [u32]) {
    let Scores { mut best, mut next } = scores.clone();
    let states = best.as_ref().len();
    let transition = &transition[..states * states];
    let mut rows = origins.chunks_exact_mut(states);
    block.each_row::<S>(|_, density| {
        let Some(origin) = rows.next() else { return };
        let (best, next) = (best.as_mut(), next.as_mut());
        for ((best, before), density) in best.iter_mut().zip(&*next).zip(density.as_ref()) {
            *best = before + density;
        }
        for to in 0..states {
            let (mut from, mut score) = (0, best[0] + transition[to]);
            for state in 1..states {
                let candidate = best[state] + transition[state * states + to];
                // Two choices, and no branch.
                from = if candidate > score { state as u32 } else { from };
                score = if candidate > score { candidate } else { score };
            }
            origin[to] = from;
            next[to] = score;
        }
    });
    *scores = Scores { best, next };
}
