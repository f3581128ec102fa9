//! The likeliest path of states: the best path to each state of a strand's last row, and which of them fit together.

use std::array;
use std::marker::PhantomData;
use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::densities::{Evaluated, evaluate};
use super::ends::PerState;
use super::strands::{BLOCK, Rows, STRANDS, Strands};
use super::{HiddenMarkov, Observations};

/// Steps of which choices are kept in one word.
const WORD: usize = 64;

/// Rows by which it is forgotten, of most series, what came before: paths to all states have one beginning.
const FORGOTTEN: usize = 64;

/// Of logarithms of densities that are added up in another order, the part that may differ.
const ROUNDING: f64 = 1e-12;

/// The likeliest path and the logarithm of its density with the series.
pub(super) fn likeliest(model: &HiddenMarkov, series: Observations) -> (Vec<usize>, f64) {
    match model.states() {
        2 => likeliest_of::<[f64; 2]>(model, series),
        3 => likeliest_of::<[f64; 3]>(model, series),
        4 => likeliest_of::<[f64; 4]>(model, series),
        _ => likeliest_of::<Vec<f64>>(model, series),
    }
}

fn likeliest_of<N: PerState>(model: &HiddenMarkov, series: Observations) -> (Vec<usize>, f64) {
    let strands = Strands::many(series, FORGOTTEN).map(|strands| Ways::of::<N>(model, strands));
    let ways = match strands {
        Some(ways) if ways.forgot() => ways,
        _ => Ways::of::<N>(model, Strands::two(series)),
    };
    ways.together()
}

/// One for each strand.
type Each<T> = [T; STRANDS];

/// The best path to each state of the row after the last that was come by, of each strand.
struct Ways<'a> {
    strands: Strands<'a>,
    rows: usize,
    states: usize,
    scores: Scores,
    /// Scores of the rows with which strands begin, `[state]`.
    begun: Vec<Each<f64>>,
    /// Of each state of a step after the first, whether the best path comes from that state, of those up to it: a bit a step,
    /// `[word][to][from]`.
    choices: Vec<Each<u64>>,
}

/// Logarithms of the density of the rows so far along the best path to each state of the last row, and to each of the next, `[state]`.
#[derive(Debug, Clone)]
struct Scores {
    best: Vec<Each<f64>>,
    next: Vec<Each<f64>>,
}

impl<'a> Ways<'a> {
    fn of<N: PerState>(model: &HiddenMarkov, strands: Strands<'a>) -> Self {
        let (states, rows) = (model.states(), strands.lanes() * strands.length - strands.behind());
        let end = strands.run_in + strands.length;
        let (mut columns, mut values) =
            (vec![[f64::NAN; BLOCK * STRANDS]; model.width()], vec![[0.0; BLOCK * STRANDS]; states]);
        let transition = transitions(model);
        let nothing = vec![[0.0; STRANDS]; states];
        let mut scores = Scores { best: nothing.clone(), next: nothing.clone() };
        let (mut begun, mut words) = (nothing, vec![[0; STRANDS]; states * states]);
        let mut choices = Vec::with_capacity(words.len() * strands.length.div_ceil(WORD));
        // Where it is known what comes before: in the outermost strands, nothing before the first row, and nothing after the last.
        let known = [strands.run_in, strands.run_in + strands.behind()];
        let mut come_to = |step: usize, scores: &mut Scores, words: &mut [Each<u64>]| {
            if step == known[0] {
                scores.next.iter_mut().zip(model.initial()).for_each(|(next, p)| next[Strands::lane(0, false)] = p.ln());
                begun.clone_from(&scores.next);
                words.fill([0; STRANDS]);
            }
            if step == known[1] {
                scores.next.iter_mut().for_each(|next| next[Strands::lane(0, true)] = 0.0);
            }
        };
        come_to(0, &mut scores, &mut words);
        for from in (0..end).step_by(BLOCK) {
            strands.columns(from, &mut columns);
            evaluate(model.densities(), Evaluated::Logarithms, &columns, &mut values);
            let (mut at, to) = (from, end.min(from + BLOCK));
            while at < to {
                let until = known.into_iter().filter(|step| (at + 1..to).contains(step)).min().unwrap_or(to);
                Arch::new().dispatch(Choice::<N> {
                    values: &values,
                    steps: at - from..until - from,
                    number: at - strands.run_in.min(at),
                    transition: &transition,
                    lanes: strands.lanes(),
                    scores: &mut scores,
                    words: &mut words,
                    states: PhantomData,
                });
                at = until;
                come_to(at, &mut scores, &mut words);
            }
            let own = to.saturating_sub(strands.run_in);
            if own > 0 && (own.is_multiple_of(WORD) || to == end) {
                choices.extend_from_slice(&words);
                words.fill([0; STRANDS]);
            }
        }
        Self { strands, rows, states, scores, begun, choices }
    }

    /// Where a strand ends and the next begins: their lanes.
    fn joints(&self) -> impl Iterator<Item = [usize; 2]> {
        let from_each = self.strands.from_each;
        [false, true]
            .into_iter()
            .flat_map(move |back| (1..from_each).map(move |k| [k - 1, k].map(|k| Strands::lane(k, back))))
    }

    /// Whether strands begin with what is known where those before them end, but for what all states share.
    fn forgot(&self) -> bool {
        self.joints().all(|lanes @ [before, _]| {
            let (best, apart) = self.apart(lanes);
            self.scores.next.iter().zip(&self.begun).all(|(next, begun)| {
                let (known, held) = (next[before], begun[lanes[1]] + apart);
                known == held || (known - held).abs() <= ROUNDING * best.abs()
            })
        })
    }

    /// Of the likeliest state where a strand ends, the score, and how much less that was where the next began.
    fn apart(&self, [before, after]: [usize; 2]) -> (f64, f64) {
        let scores =
            self.scores.next.iter().zip(&self.begun).map(|(next, begun)| (next[before], next[before] - begun[after]));
        scores.fold((f64::NEG_INFINITY, 0.0), |best, score| if score.0 > best.0 { score } else { best })
    }

    /// The likeliest of all paths, and the logarithm of its density with the series.
    fn together(&self) -> (Vec<usize>, f64) {
        let Strands { from_each, length, .. } = self.strands;
        let [on, back] = [false, true].map(|back| Strands::lane(from_each - 1, back));
        let scores = self.scores.best.iter().zip(&self.scores.next).map(|(here, there)| here[on] + there[back]);
        // The first of the best.
        let start = (0, f64::NEG_INFINITY);
        let best = |best: (usize, f64), (state, score)| if score > best.1 { (state, score) } else { best };
        let (state, score) = scores.enumerate().fold(start, best);
        let mut path = Path::of(self.strands.lanes() * length);
        if length > 0 {
            path.set(false, from_each * length - 1, state);
        }
        let mut steps = [Steps { state, left: length.saturating_sub(1) }, Steps { state, left: length }];
        for outer in (0..from_each).rev() {
            // Where the number of states is known fewer branches are taken.
            match self.states {
                2 => self.trace(2, outer, &mut steps, &mut path),
                3 => self.trace(3, outer, &mut steps, &mut path),
                4 => self.trace(4, outer, &mut steps, &mut path),
                states => self.trace(states, outer, &mut steps, &mut path),
            }
            steps.iter_mut().for_each(|steps| steps.left = length);
        }
        (path.told(self.rows), score + self.joints().map(|lanes| self.apart(lanes).1).sum::<f64>())
    }

    /// Goes back over a strand from the first row on and over the one from the last row back that answers to it.
    #[inline(always)]
    fn trace(&self, states: usize, outer: usize, steps: &mut [Steps; 2], path: &mut Path) {
        let before = outer * self.strands.length;
        // By turns, so that neither waits for the other.
        while steps[0].left > 0 || steps[1].left > 0 {
            for (back, steps) in [false, true].into_iter().zip(&mut *steps) {
                if steps.left > 0 {
                    path.fill(back, before + steps.left, steps.state);
                    let word = (steps.left - 1) / WORD;
                    let choices = &self.choices[word * states * states..][..states * states];
                    steps.go_back(choices, states, Strands::lane(outer, back));
                    path.set(back, before + steps.left, steps.state);
                }
            }
        }
    }
}

/// Steps of a strand from which the best path goes on to a state.
struct Steps {
    state: usize,
    left: usize,
}

impl Steps {
    /// Goes back over the steps that are in this state, and over the one before them, as far as `choices`, those of a word, tell: to the state
    /// before them. There is no branch, which would seldom be foreseen.
    #[inline(always)]
    fn go_back(&mut self, choices: &[Each<u64>], states: usize, lane: usize) {
        let (state, first) = (self.state, (self.left - 1) / WORD * WORD);
        // The latest of them in the highest bit.
        let unknown = first + WORD - self.left;
        let chosen = |from: usize| choices[state * states + from][lane] << unknown;
        let later = (1..states).fold(0, |bits, from| bits | if from > state { chosen(from) } else { 0 });
        let stays = if state == 0 { !later } else { chosen(state) & !later };
        let stayed = (stays.leading_ones() as usize).min(self.left - first);
        let came = |from: usize| chosen(from) << (stayed % WORD) >> (WORD - 1) == 1;
        let before = (1..states).fold(0, |before, from| if came(from) { from } else { before });
        let changes = self.left - stayed > first;
        *self = Self { state: if changes { before } else { state }, left: self.left - stayed - usize::from(changes) };
    }
}

/// States of the rows of a series, written from its middle to its ends.
struct Path {
    rows: usize,
    /// With room for a word's steps before and after. No model has so many states that there is no room for their numbers.
    states: Vec<u16>,
}

impl Path {
    fn of(rows: usize) -> Self {
        Self { rows, states: vec![0; rows + 2 * WORD] }
    }

    /// Writes the state of the last of the first `end` rows, or of the first of the last, and of as many before it as may be in the same: those
    /// that are not are written again.
    #[inline(always)]
    fn fill(&mut self, back: bool, end: usize, state: usize) {
        let start = if back { WORD + self.rows - end } else { end };
        self.states[start..][..WORD].fill(state as u16);
    }

    /// Writes the state of a row with so many before it, or after it.
    #[inline(always)]
    fn set(&mut self, back: bool, others: usize, state: usize) {
        let row = if back { self.rows - 1 - others } else { others };
        self.states[WORD + row] = state as u16;
    }

    /// The states of the first rows.
    fn told(&self, rows: usize) -> Vec<usize> {
        self.states[WORD..][..rows].iter().map(|state| usize::from(*state)).collect()
    }
}

/// Logarithms of transitions as strands come by states, `[from][to]`: from the last row back those of the model transposed.
fn transitions(model: &HiddenMarkov) -> Vec<Each<f64>> {
    let (states, transition) = (model.states(), model.transition());
    let transposed = |k: usize| k % states * states + k / states;
    let of = |k: usize| array::from_fn(|lane| transition[if lane % 2 == 0 { k } else { transposed(k) }].ln());
    (0..states * states).map(of).collect()
}

/// Goes on over some steps, and keeps where paths come from.
struct Choice<'a, N> {
    /// Logarithms of densities, `[state][step][lane]`.
    values: &'a [Rows],
    steps: Range<usize>,
    /// Of the first of them: its bit in words.
    number: usize,
    transition: &'a [Each<f64>],
    lanes: usize,
    scores: &'a mut Scores,
    words: &'a mut [Each<u64>],
    states: PhantomData<N>,
}

impl<N: PerState> WithSimd for Choice<'_, N> {
    type Output = ();

    // What is not inlined here is compiled without the processor's vectors.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let states = self.values.len();
        let zero = simd.splat_u64s(0);
        for group in 0..self.lanes.div_ceil(S::F64_LANES) {
            let mut transition = N::each(states, |_| N::each(states, |_| simd.splat_f64s(0.0)));
            let mut words = N::each(states, |_| N::each(states, |_| zero));
            let mut best = N::each(states, |_| simd.splat_f64s(0.0));
            let mut next = N::each(states, |_| simd.splat_f64s(0.0));
            let (transition, words) = (transition.as_mut(), words.as_mut());
            let (best, next) = (best.as_mut(), next.as_mut());
            let states = next.len();
            for one in 0..states {
                best[one] = S::as_simd_f64s(&self.scores.best[one]).0[group];
                next[one] = S::as_simd_f64s(&self.scores.next[one]).0[group];
                for other in 0..states {
                    transition[one].as_mut()[other] = S::as_simd_f64s(&self.transition[one * states + other]).0[group];
                    words[one].as_mut()[other] = S::as_simd_u64s(&self.words[one * states + other]).0[group];
                }
            }
            let mut bit = simd.splat_u64s(1 << (self.number % WORD));
            for step in self.steps.clone() {
                for state in 0..states {
                    let (densities, _) = S::as_simd_f64s(&self.values[state]);
                    best[state] = simd.add_f64s(next[state], densities[step * (STRANDS / S::F64_LANES) + group]);
                }
                for to in 0..states {
                    let mut score = simd.add_f64s(best[0], transition[0].as_ref()[to]);
                    for from in 1..states {
                        let candidate = simd.add_f64s(best[from], transition[from].as_ref()[to]);
                        let better = simd.greater_than_f64s(candidate, score);
                        let word = &mut words[to].as_mut()[from];
                        *word = simd.or_u64s(*word, simd.select_u64s(better, bit, zero));
                        score = simd.max_f64s(candidate, score);
                    }
                    next[to] = score;
                }
                bit = simd.add_u64s(bit, bit);
            }
            for one in 0..states {
                S::as_mut_simd_f64s(&mut self.scores.best[one]).0[group] = best[one];
                S::as_mut_simd_f64s(&mut self.scores.next[one]).0[group] = next[one];
                for other in 0..states {
                    S::as_mut_simd_u64s(&mut self.words[one * states + other]).0[group] = words[one].as_ref()[other];
                }
            }
        }
    }
}
