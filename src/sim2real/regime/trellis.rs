//! The recursions over a whole series: from its ends to where they meet, and on over what was found there.

use super::chain::{Back, Chain, LONG, LONGER, Onward, Way, middle};
use super::course::{Course, LARGEST, PerState};
use super::densities::{Block, Evaluated, each_block};
use super::{HiddenMarkov, Observations, in_logs};

/// Runs from the first row on and shows each row's belief: what is found of a row rests on no later one.
pub(super) fn follow(model: &HiddenMarkov, series: Observations, see: impl FnMut(&[f64])) {
    match model.states() {
        2 => follow_of::<[f64; 2]>(model, series, see),
        3 => follow_of::<[f64; 3]>(model, series, see),
        4 => follow_of::<[f64; 4]>(model, series, see),
        _ => follow_of::<Vec<f64>>(model, series, see),
    }
}

#[inline(always)]
fn follow_of<S: PerState>(model: &HiddenMarkov, series: Observations, mut see: impl FnMut(&[f64])) {
    let mut belief = S::of(model.initial());
    if model.mixes() {
        run::<S, Onward>(&Chain::of(model), series, |course, _, _| {
            course.believe(belief.as_mut());
            see(belief.as_ref());
        });
    } else {
        run_in_logs::<S>(model, series, |course, _, _| {
            course.believe(belief.as_mut());
            see(belief.as_ref());
        });
    }
}

/// Where a series is cut in two halves, of which the second is taken from its end; `None` where it is taken whole.
fn cut(model: &HiddenMarkov, series: Observations, long: usize) -> Option<usize> {
    if model.mixes() { middle(series.len(), long) } else { None }
}

/// Logarithm of the density of a series.
pub(super) fn log_likelihood(model: &HiddenMarkov, series: Observations) -> f64 {
    match model.states() {
        2 => log_likelihood_of::<[f64; 2]>(model, series),
        3 => log_likelihood_of::<[f64; 3]>(model, series),
        4 => log_likelihood_of::<[f64; 4]>(model, series),
        _ => log_likelihood_of::<Vec<f64>>(model, series),
    }
}

fn log_likelihood_of<S: PerState>(model: &HiddenMarkov, series: Observations) -> f64 {
    if !model.mixes() {
        return run_in_logs::<S>(model, series, |_, _, _| ()).log_likelihood(model);
    }
    let onward = |rows| run::<S, Onward>(&Chain::of(model), rows, |_, _, _| ());
    let back = |rows| run::<S, Back>(&Chain::of(model), rows, |_, _, _| ());
    if let Some(middle) = cut(model, series, LONGER) {
        let (first, last) = series.split(middle);
        let (first, last) = rayon::join(|| onward(first), || back(last));
        if let Some(meeting) = first.meet(&last, model) {
            return meeting.log_likelihood;
        }
    }
    onward(series).log_likelihood(model)
}

/// Runs over a series; `see` is shown where the recursion is after each row, the row's weights, and what makes ratios of them.
#[inline(always)]
fn run<S: PerState, W: Way>(chain: &Chain<W>, series: Observations, mut see: impl FnMut(&Course<S>, &S, f64)) -> Course<S> {
    let mut course = Course::new(chain.model, &chain.begin);
    each_block::<W>(chain.model, Evaluated::Weights, series, |block| advance(block, chain, &mut course, &mut see));
    course
}

/// Runs over a series of a model that does not mix, from the first row on; `see` is shown where the recursion is after each row, and
/// logarithms of what is believed of it and of its ratios.
fn run_in_logs<S: PerState>(
    model: &HiddenMarkov,
    series: Observations,
    mut see: impl FnMut(&Course<S>, &[f64], &[f64]),
) -> Course<S> {
    let mut course = Course::<S>::new(model, model.initial());
    let (mut beliefs, mut ratios) = (vec![0.0; model.states()], vec![0.0; model.states()]);
    for row in series.iter() {
        course.step_in_logs(model, row, &mut beliefs, &mut ratios);
        see(&course, &beliefs, &ratios);
    }
    course
}

/// Goes on over a block. A function of its own, so that where the recursion is stays in registers.
#[inline(never)]
fn advance<S: PerState, W: Way>(
    block: &Block,
    chain: &Chain<W>,
    from: &mut Course<S>,
    mut see: impl FnMut(&Course<S>, &S, f64),
) {
    let mut course = from.clone();
    block.each_row::<S, W>(|row, weights| {
        let inverse = course.step(block.model, &chain.transition, row, weights);
        see(&course, weights, inverse);
    });
    *from = course;
}

/// What is known of a row where the second recursion over its half comes by. Of the half from the last row back, everything is as seen
/// from there: the row before a row is the one that follows it.
pub(super) struct Seen<'a> {
    /// Its number in the series.
    pub row: usize,
    /// Probability of each state given the whole series.
    pub posterior: &'a [f64],
    /// Transitions into it from the row before.
    pub arrivals: Arrivals<'a>,
}

/// Expected number of transitions into a row, over their probability.
pub(super) enum Arrivals<'a> {
    /// There is no row before.
    None,
    /// The products of what was believed `before` and, for each state, how much more likely the row and all that follow are than they were
    /// given all before.
    Products { before: &'a [f64], ahead: &'a [f64] },
    /// `[from][to]`.
    Each(&'a [f64]),
}

/// Who is shown the rows by [`Trellis::backward`]: a trait, because its method can be told to be inlined.
pub(super) trait Visit: Send {
    /// Takes what is known of a row; what is written into `belief`, until now what was believed of it given the rows up to it, is kept.
    fn visit(&mut self, seen: Seen, belief: &mut [f64]);
}

/// What the first recursions found, row after row: of the rows of the first half from the first row on, of the others from the last
/// row back.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Trellis {
    states: usize,
    /// Rows of the first half.
    middle: usize,
    /// Probability of each state given the rows up to this one, `[row][state]`.
    pub beliefs: Vec<f64>,
    /// Density of the row in each state over its density given all before, `[row][state]`.
    ratios: Vec<f64>,
    /// Where the second recursion over each half begins: for each state of its last row, how much more likely the other half is than it
    /// was given this one.
    begins: [Vec<f64>; 2],
    /// Expected number of transitions from the first half into the other, over their probability; none where there is no other.
    pub crossing: Vec<f64>,
    pub log_likelihood: f64,
}

impl Trellis {
    /// Runs from the ends of a series to where they meet; what was held before is overwritten, and its memory used again.
    pub fn forward(&mut self, model: &HiddenMarkov, series: Observations) {
        self.states = model.states();
        let size = series.len() * self.states;
        self.beliefs.resize(size, 0.0);
        self.ratios.resize(size, 0.0);
        match self.states {
            2 => self.forward_of::<[f64; 2]>(model, series),
            3 => self.forward_of::<[f64; 3]>(model, series),
            4 => self.forward_of::<[f64; 4]>(model, series),
            _ => self.forward_of::<Vec<f64>>(model, series),
        }
    }

    fn forward_of<S: PerState>(&mut self, model: &HiddenMarkov, series: Observations) {
        if let Some(middle) = cut(model, series, LONG) {
            self.middle = middle;
            let ((first, last), (here, there)) = (series.split(middle), self.halves());
            let (first, last) = rayon::join(|| here.fill::<S, Onward>(model, first), || there.fill::<S, Back>(model, last));
            if let Some(meeting) = first.meet(&last, model) {
                self.begins = [meeting.after_first(), meeting.before_last()];
                self.crossing = meeting.crossing();
                self.log_likelihood = meeting.log_likelihood;
                return;
            }
        }
        self.middle = series.len();
        self.begins = [vec![1.0; self.states], vec![]];
        self.crossing.clear();
        if !model.mixes() {
            let places = self.beliefs.chunks_exact_mut(self.states).zip(self.ratios.chunks_exact_mut(self.states));
            self.log_likelihood = fill_in_logs::<S>(model, series, places).log_likelihood(model);
            return;
        }
        self.log_likelihood = self.halves().0.fill::<S, Onward>(model, series).log_likelihood(model);
    }

    fn halves(&mut self) -> (Half<'_>, Half<'_>) {
        let middle = self.middle * self.states;
        let ((first, last), (ratios, last_ratios)) = (self.beliefs.split_at_mut(middle), self.ratios.split_at_mut(middle));
        (Half { from: 0, beliefs: first, ratios }, Half { from: self.middle, beliefs: last, ratios: last_ratios })
    }

    /// Runs on from where the ends met, over what was found there, and shows `first` each row of the first half, the last first, and
    /// `last` each row of the other, its first row first.
    pub fn backward(&mut self, model: &HiddenMarkov, first: &mut impl Visit, last: &mut impl Visit) {
        match self.states {
            2 => self.backward_of::<[f64; 2]>(model, first, last),
            3 => self.backward_of::<[f64; 3]>(model, first, last),
            4 => self.backward_of::<[f64; 4]>(model, first, last),
            _ => self.backward_of::<Vec<f64>>(model, first, last),
        }
    }

    fn backward_of<S: PerState>(&mut self, model: &HiddenMarkov, first: &mut impl Visit, last: &mut impl Visit) {
        if !model.mixes() {
            in_logs::sweep(model, &mut self.beliefs, &self.ratios, first);
            return;
        }
        let begins = std::mem::take(&mut self.begins);
        let (here, there) = self.halves();
        if there.beliefs.is_empty() {
            here.sweep::<S, Onward>(model, &begins[0], first);
        } else {
            rayon::join(
                || here.sweep::<S, Onward>(model, &begins[0], first),
                || there.sweep::<S, Back>(model, &begins[1], last),
            );
        }
    }
}

/// The rows of a half.
struct Half<'a> {
    /// Number of its first row in the series.
    from: usize,
    beliefs: &'a mut [f64],
    ratios: &'a mut [f64],
}

impl Half<'_> {
    /// The first recursion.
    fn fill<S: PerState, W: Way>(self, model: &HiddenMarkov, rows: Observations) -> Course<S> {
        let states = model.states();
        let places = self.beliefs.chunks_exact_mut(states).zip(self.ratios.chunks_exact_mut(states));
        if W::BACK { fill::<S, W>(model, rows, places.rev()) } else { fill::<S, W>(model, rows, places) }
    }

    /// The second recursion, against the first.
    #[inline(always)]
    fn sweep<S: PerState, W: Way>(self, model: &HiddenMarkov, begin: &[f64], visitor: &mut impl Visit) {
        let Self { from, beliefs, ratios } = self;
        let chain = Chain::<W>::of(model);
        let (mut beta, mut posterior, mut ahead) = (S::of(begin), S::of(begin), S::of(begin));
        let (beta, posterior, ahead) = (beta.as_mut(), posterior.as_mut(), ahead.as_mut());
        let states = beta.len();
        let transition = &chain.transition[..states * states];
        let rows = ratios.len() / states;
        for k in (0..rows).rev() {
            let row = if W::BACK { rows - 1 - k } else { k };
            let ratio = &ratios[row * states..][..states];
            // The beliefs of the row, and of the one that came before it.
            let (low, high) = beliefs.split_at_mut((row + usize::from(W::BACK)) * states);
            let (belief, before) = if W::BACK {
                (&mut low[row * states..], high.get(..states))
            } else {
                (&mut high[..states], low.len().checked_sub(states).map(|from| &low[from..]))
            };
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
            let arrivals = match before {
                Some(before) => Arrivals::Products { before, ahead },
                None => Arrivals::None,
            };
            visitor.visit(Seen { row: from + row, posterior, arrivals }, belief);
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

/// Fills places, in the order of the way.
#[inline(always)]
fn fill<'a, S: PerState, W: Way>(
    model: &HiddenMarkov,
    rows: Observations,
    mut places: impl Iterator<Item = (&'a mut [f64], &'a mut [f64])>,
) -> Course<S> {
    run::<S, W>(&Chain::of(model), rows, |course, weights, inverse| {
        let Some((belief, ratios)) = places.next() else { return };
        for (ratio, weight) in ratios.iter_mut().zip(weights.as_ref()) {
            *ratio = weight * inverse;
        }
        course.believe(belief);
    })
}

/// Fills places with logarithms, of a model that does not mix.
fn fill_in_logs<'a, S: PerState>(
    model: &HiddenMarkov,
    rows: Observations,
    mut places: impl Iterator<Item = (&'a mut [f64], &'a mut [f64])>,
) -> Course<S> {
    run_in_logs::<S>(model, rows, |_, beliefs, ratios| {
        let Some((belief, ratio)) = places.next() else { return };
        belief.copy_from_slice(beliefs);
        ratio.copy_from_slice(ratios);
    })
}
