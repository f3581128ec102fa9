//! Which states a whole series was in: the probability of each in each row, and the likeliest path.

use super::chain::{Back, Chain, LONG, LONGER, Onward, Way, awake, middle};
use super::course::PerState;
use super::densities::{Block, Evaluated, each_block};
use super::trellis::{self, Seen, Trellis, Visit};
use super::{HiddenMarkov, Observations, RegimeError};

/// Writes what is believed given the whole series over what was believed without what follows.
struct InPlace;

impl Visit for InPlace {
    #[inline(always)]
    fn visit(&mut self, seen: Seen, belief: &mut [f64]) {
        belief.copy_from_slice(seen.posterior);
    }
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
        let smooth = || {
            let mut trellis = Trellis::default();
            trellis.forward(self, series);
            trellis.backward(self, &mut InPlace, &mut InPlace);
            trellis.beliefs
        };
        Ok(if middle(series.len(), LONG).is_some() { awake(smooth) } else { smooth() })
    }

    /// The likeliest path of states given the whole series, and the logarithm of its density with the series (A. J. Viterbi,
    /// IEEE Transactions on Information Theory 13, 1967). Where states are equally likely the lower number is taken.
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

/// The likeliest path: of a long series that of each half, from its end, and which of them fit together.
fn likeliest<S: Origins>(model: &HiddenMarkov, series: Observations) -> (Vec<usize>, f64) {
    let mut path = vec![0; series.len()];
    let Some(middle) = middle(series.len(), LONGER) else {
        let ways = Ways::<S>::of::<Onward>(model, series);
        let (last, score) = best(ways.scores.best.as_ref().iter().copied());
        ways.trace(last, path.iter_mut().rev());
        return (path, score);
    };
    let (first, last) = series.split(middle);
    let (first, last) = rayon::join(|| Ways::<S>::of::<Onward>(model, first), || Ways::<S>::of::<Back>(model, last));
    let together = first.scores.best.as_ref().iter().zip(last.scores.next.as_ref());
    let (state, score) = best(together.map(|(here, there)| here + there));
    let (here, there) = path.split_at_mut(middle);
    rayon::join(|| first.trace(state, here.iter_mut().rev()), || last.trace(last.next_of(state), there.iter_mut()));
    (path, score)
}

/// The first of the best scores.
fn best(scores: impl Iterator<Item = f64>) -> (usize, f64) {
    let start = (0, f64::NEG_INFINITY);
    scores.enumerate().fold(start, |best, (state, score)| if score > best.1 { (state, score) } else { best })
}

/// Where paths to each state come from, of one row: of up to four states in two bits each.
trait Origins: PerState {
    /// What it is written in.
    type Word: Copy + Default + Send + Sync;

    /// Words of a row.
    fn words(states: usize) -> usize;

    /// Writes into words of zeros that the best path to state `to` comes from state `from`.
    fn put(words: &mut [Self::Word], to: usize, from: u32);

    /// Where the best path to state `to` comes from.
    fn get(words: &[Self::Word], to: usize) -> usize;
}

impl<const N: usize> Origins for [f64; N] {
    type Word = u8;

    fn words(_: usize) -> usize {
        const { assert!(N <= 4) };
        1
    }

    #[inline(always)]
    fn put(words: &mut [u8], to: usize, from: u32) {
        words[0] |= (from as u8) << (2 * to);
    }

    #[inline(always)]
    fn get(words: &[u8], to: usize) -> usize {
        usize::from(words[0] >> (2 * to) & 3)
    }
}

impl Origins for Vec<f64> {
    type Word = u32;

    fn words(states: usize) -> usize {
        states
    }

    fn put(words: &mut [u32], to: usize, from: u32) {
        words[to] = from;
    }

    fn get(words: &[u32], to: usize) -> usize {
        words[to] as usize
    }
}

/// The best path to each state of the row after the last that was come by, one way.
struct Ways<S: Origins> {
    scores: Scores<S>,
    /// Of each row in the order in which they were come by, for each state of the next.
    origins: Vec<S::Word>,
    words: usize,
}

/// Logarithms of the density of the rows so far along the best path to each state of the last row, and to each of the next.
#[derive(Clone)]
struct Scores<S> {
    best: S,
    next: S,
}

impl<S: Origins> Ways<S> {
    fn of<W: Way>(model: &HiddenMarkov, series: Observations) -> Self {
        let Chain { begin, transition, .. } = Chain::<W>::of(model);
        let logarithms = |of: Vec<f64>| of.into_iter().map(f64::ln).collect::<Vec<f64>>();
        let (begin, transition, words) = (logarithms(begin), logarithms(transition), S::words(model.states()));
        let scores = Scores { best: S::of(&begin), next: S::of(&begin) };
        let mut ways = Self { scores, origins: vec![S::Word::default(); words * series.len()], words };
        let mut known = 0;
        each_block::<W>(model, Evaluated::Logarithms, series, |block| {
            choose::<S, W>(block, &transition, &mut ways.scores, &mut ways.origins[known..]);
            known += words * block.rows.len();
        });
        ways
    }

    /// State of the last row that was come by on the best path to state `to` of the next.
    fn next_of(&self, to: usize) -> usize {
        self.origins.rchunks_exact(self.words).next().map_or(to, |words| S::get(words, to))
    }

    /// Writes the path that ends in `state` of the last row that was come by, from there back.
    fn trace<'a>(&self, mut state: usize, mut places: impl Iterator<Item = &'a mut usize>) {
        let Some(place) = places.next() else { return };
        *place = state;
        for (place, words) in places.zip(self.origins.rchunks_exact(self.words).skip(1)) {
            state = S::get(words, state);
            *place = state;
        }
    }
}

/// Goes on over a block, and writes where paths come from. A function of its own, so that scores stay in registers.
#[inline(never)]
fn choose<S: Origins, W: Way>(block: &Block, transition: &[f64], scores: &mut Scores<S>, origins: &mut [S::Word]) {
    let Scores { mut best, mut next } = scores.clone();
    let states = best.as_ref().len();
    let transition = &transition[..states * states];
    let mut rows = origins.chunks_exact_mut(S::words(states));
    block.each_row::<S, W>(|_, density| {
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
            S::put(origin, to, from);
            next[to] = score;
        }
    });
    *scores = Scores { best, next };
}
