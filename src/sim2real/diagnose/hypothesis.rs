//! A hypothesis: the twin with some mechanisms added, fitted as well as it goes.

use std::ops::Range;

use super::evidence::Evidence;
use super::screen::{Screened, signatures};
use super::weigh::{squares, strained};
use super::whiteness::{ChannelMisfit, channel_misfits};
use crate::sim2real::identify::{Block, Effort, Fit, Problem, State, fit};
use crate::sim2real::{Candidate, Parameter, Part, Seed, Twin};

/// A mean squared residual of at most this many times the noise ...
const AT_THE_NOISE: f64 = 1.1;
/// ... and an autocorrelation time below this [rows] are those of noise.
const NEARLY_WHITE: f64 = 1.5;
/// What is no larger than the noise is nothing where its autocorrelation time is below this [rows].
const HARDLY_COLOURED: f64 = 5.0;

/// The twin with the mechanisms numbered in `added`, and its fit.
#[derive(Debug, Clone)]
pub struct Hypothesis<T> {
    /// The twin with the mechanisms.
    pub twin: T,
    /// Numbers of the candidates added, in the order in which their parameters stand.
    pub added: Vec<usize>,
    /// The fit to what hypotheses are compared on.
    pub fit: Fit,
    /// What is left, channel by channel.
    pub(super) misfits: Vec<ChannelMisfit>,
}

impl<T> Hypothesis<T> {
    /// The mechanisms added, in the order of their numbers: the same for the same set.
    pub(super) fn set(&self) -> Vec<usize> {
        let mut set = self.added.clone();
        set.sort_unstable();
        set
    }

    /// Number of free parameters.
    pub(super) fn free(&self) -> usize {
        self.fit.free.len()
    }

    /// Whether what is left looks like the noise in size and is as white. Recordings long enough show what any form is off by,
    /// so what is no larger than the noise itself may be a little less white.
    pub(super) fn leaves_nothing(&self) -> bool {
        let nothing = |m: &ChannelMisfit| {
            m.within(AT_THE_NOISE, 1.0) && m.autocorrelation_time < NEARLY_WHITE
                || m.within(1.0, 1.0) && m.autocorrelation_time < HARDLY_COLOURED
        };
        self.misfits.iter().all(nothing)
    }

    /// Whether it leaves more than noise, of whatever colour. Where a first mechanism alone gains nothing, two may: what the second
    /// would take away hides how much the first explains, if it is slow.
    pub(super) fn leaves_something(&self) -> bool {
        !self.leaves_nothing() && !self.misfits.iter().all(ChannelMisfit::like_noise)
    }

    /// The same of noise that certainly is noise: a twin that leaves that is not bent by what it lacks.
    pub(super) fn unbent(&self, times: f64) -> bool {
        self.within(times) && self.misfits.iter().all(|m| m.level <= 1.0 || m.one_colour)
    }

    /// Whether the mean square of what is left is at most `times` that of the noise, whatever its colour.
    pub(super) fn within(&self, times: f64) -> bool {
        self.misfits.iter().all(|m| m.within(times, m.level))
    }
}

/// What all hypotheses share: the twin as given, what may be added to it, and the evidence.
pub(super) struct Inquiry<'a, T: Twin> {
    pub twin: &'a T,
    pub candidates: &'a [Candidate],
    pub evidence: &'a Evidence<'a, T::Stimulus>,
    pub seed: Seed,
}

/// A twin that leaves at most this many times the mean square of the noise keeps up with its recordings.
pub(super) const KEEPS_UP: f64 = 4.0;

/// What leaves so many times what the same leaves without the last mechanism went astray: with next to nothing of it no more would be left.
const ASTRAY: f64 = 1.5;
/// These parts of a mechanism are next to nothing of it.
const TIMID: [f64; 3] = [0.1, 0.03, 0.01];

/// How many of a candidate's starts are followed at the most.
pub(super) const STARTS: usize = 4;

impl<T: Twin> Inquiry<'_, T> {
    /// `parent` with what was `screened` added, fitted from `most` of the starts that screening liked best.
    pub fn extended(&self, parent: &Hypothesis<T>, screened: &Screened, most: usize, effort: Effort) -> Hypothesis<T> {
        let twin = parent.twin.with(&self.candidates[screened.number]);
        let starts = apart(&screened.starts, twin.parameters(), most);
        let added = parent.added.iter().copied().chain([screened.number]).collect();
        self.boldly_or_timidly(twin, added, &starts, parent, screened, effort)
    }

    /// The best fit of `twin`, which is that of `less` with what was `screened`, from several starts; or, where all went astray, from next
    /// to nothing of that.
    fn boldly_or_timidly(
        &self,
        twin: T,
        added: Vec<usize>,
        starts: &[Vec<f64>],
        less: &Hypothesis<T>,
        screened: &Screened,
        effort: Effort,
    ) -> Hypothesis<T> {
        let boldly = self.fitted(twin.clone(), added.clone(), starts, Some(&less.fit.state), effort);
        if less.added.is_empty() || squares(&boldly) <= ASTRAY * squares(less) {
            return boldly;
        }
        let own = &self.candidates[screened.number].form.parameters;
        let Some(start) = screened.starts.first() else { return boldly };
        let starts = TIMID.map(|part| timid(&less.fit.values, own, start, part));
        let timidly = self.fitted(twin, added, &starts, Some(&less.fit.state), effort);
        if squares(&timidly).total_cmp(&squares(&boldly)).is_lt() { timidly } else { boldly }
    }

    /// `less`, which is `whole` without one of its mechanisms, with what was `screened` in its place.
    ///
    /// `less` was refitted without that mechanism, and may have been bent so far that no fit finds back from there: it is begun
    /// from where `whole` stands, too. What `whole` has dragged the twin's own parameters to is no place to begin at: then from where they
    /// are given as well.
    pub fn instead(
        &self,
        whole: &Hypothesis<T>,
        less: &Hypothesis<T>,
        screened: &Screened,
        effort: Effort,
    ) -> Hypothesis<T> {
        let twin = less.twin.with(&self.candidates[screened.number]);
        let mut starts = apart(&screened.starts, twin.parameters(), STARTS);
        if let Some(in_place) = self.in_place(whole, less, screened) {
            if strained(self, whole) {
                let given: Vec<Vec<f64>> =
                    screened.starts.iter().map(|start| self.as_given(&in_place, start, screened)).collect();
                starts.extend(apart(&given, twin.parameters(), STARTS));
            }
            starts.push(in_place);
        }
        let added = less.added.iter().copied().chain([screened.number]).collect();
        self.boldly_or_timidly(twin, added, &starts, less, screened, effort)
    }

    /// Of all parameters of `whole`, those of its `place`-th mechanism.
    pub fn of_mechanism(&self, whole: &Hypothesis<T>, place: usize) -> Range<usize> {
        let count = |number: &usize| self.candidates[*number].form.parameters.len();
        let from = self.twin.parameters().len() + whole.added[..place].iter().map(count).sum::<usize>();
        from..from + count(&whole.added[place])
    }

    /// Whether a parameter of the `place`-th mechanism of `whole` ended at a bound.
    pub fn at_a_bound(&self, whole: &Hypothesis<T>, place: usize) -> bool {
        let own = self.of_mechanism(whole, place);
        whole.fit.at_bound.iter().any(|parameter| own.contains(parameter))
    }

    /// Where `whole` stands, with another of its mechanisms at its most promising start instead of the one that `less` lacks, and
    /// with what both call alike as it was.
    fn in_place(&self, whole: &Hypothesis<T>, less: &Hypothesis<T>, screened: &Screened) -> Option<Vec<f64>> {
        let place = (0..whole.added.len()).find(|i| {
            let others = whole.added.iter().enumerate().filter(|(k, _)| k != i).map(|(_, number)| *number);
            others.eq(less.added.iter().copied())
        })?;
        let count = |number: &usize| self.candidates[*number].form.parameters.len();
        let own = self.of_mechanism(whole, place);
        let mut values = whole.fit.values[..own.start].to_vec();
        values.extend_from_slice(&whole.fit.values[own.end..]);
        values.extend_from_slice(screened.starts.first()?.get(values.len()..)?);
        let shared = values.len() - count(&screened.number);
        let (before, after) = (&self.candidates[whole.added[place]], &self.candidates[screened.number]);
        for (value, parameter) in values[shared..].iter_mut().zip(&after.form.parameters) {
            let alike = |p: &Parameter| p.name == parameter.name && p.unit == parameter.unit;
            if let Some(k) = before.form.parameters.iter().position(alike) {
                *value = whole.fit.values[own.start + k].clamp(parameter.lower, parameter.upper);
            }
        }
        Some(values)
    }

    /// `values`, with the twin's own as they are given, and those of what was `screened`, which stand last, as in `start`.
    fn as_given(&self, values: &[f64], start: &[f64], screened: &Screened) -> Vec<f64> {
        let (own, last) = (self.twin.parameters(), self.candidates[screened.number].form.parameters.len());
        let given = own.iter().map(|parameter| parameter.nominal);
        let others = values[own.len()..values.len() - last].iter().copied();
        given.chain(others).chain(start[start.len() - last..].iter().copied()).collect()
    }

    /// `whole` without the `position`-th of its mechanisms, refitted from the joint solution and from the twin as given.
    pub fn without(&self, whole: &Hypothesis<T>, position: usize) -> Hypothesis<T> {
        let added: Vec<usize> =
            whole.added.iter().enumerate().filter(|(i, _)| *i != position).map(|(_, number)| *number).collect();
        let own = self.twin.parameters().len();
        let mut twin = self.twin.clone();
        let mut joint = whole.fit.values[..own].to_vec();
        let mut given: Vec<f64> = self.twin.parameters().iter().map(|p| p.nominal).collect();
        let mut at = own;
        for (i, number) in whole.added.iter().enumerate() {
            let count = self.candidates[*number].form.parameters.len();
            if i != position {
                twin = twin.with(&self.candidates[*number]);
                joint.extend_from_slice(&whole.fit.values[at..at + count]);
                given.extend_from_slice(&whole.fit.values[at..at + count]);
            }
            at += count;
        }
        self.fitted(twin, added, &[joint, given], Some(&whole.fit.state), Effort::Thorough)
    }

    /// `parent` with candidate `number` added at its nominal values, and nothing fitted anew.
    pub fn as_it_is(&self, parent: &Hypothesis<T>, number: usize) -> Hypothesis<T> {
        let twin = parent.twin.with(&self.candidates[number]);
        let problem = self.problem(&twin, &self.evidence.compared);
        let mut fit = parent.fit.clone();
        fit.values.extend(self.candidates[number].form.parameters.iter().map(|p| p.nominal));
        fit.std.resize(fit.values.len(), 0.0);
        fit.residual = problem.evaluate(&fit.values, &fit.state, &[]).residual;
        let blocks = problem.blocks();
        let added = parent.added.iter().copied().chain([number]).collect();
        self.weighed(twin, added, fit, &blocks)
    }

    /// `hypothesis`, which was fitted to other rows of the same parts, and nothing of it fitted anew.
    pub fn seen(&self, hypothesis: &Hypothesis<T>) -> Hypothesis<T> {
        let Hypothesis { twin, added, fit, .. } = hypothesis.clone();
        let problem = self.problem(&twin, &self.evidence.compared);
        let evaluation = problem.evaluate(&fit.values, &fit.state, &fit.free);
        let blocks = problem.blocks();
        let fit = Fit { residual: evaluation.residual, jacobian: evaluation.jacobian, ..fit };
        self.weighed(twin, added, fit, &blocks)
    }

    /// The twin with what was `added`, with this inquiry's step of integration.
    pub fn with(&self, added: &[usize]) -> T {
        added.iter().fold(self.twin.clone(), |twin, number| twin.with(&self.candidates[*number]))
    }

    /// `hypothesis` with this inquiry's step of integration, and nothing of it fitted anew.
    pub fn stepped(&self, hypothesis: &Hypothesis<T>) -> Hypothesis<T> {
        Hypothesis { twin: self.with(&hypothesis.added), ..hypothesis.clone() }
    }

    /// `hypothesis` refitted with this inquiry's step of integration, from where it stands.
    pub fn refitted(&self, hypothesis: &Hypothesis<T>) -> Hypothesis<T> {
        self.followed_on(hypothesis, Effort::Thorough)
    }

    /// The same, as far as `effort` goes.
    pub fn followed_on(&self, hypothesis: &Hypothesis<T>, effort: Effort) -> Hypothesis<T> {
        let Hypothesis { added, fit, .. } = hypothesis;
        self.begun(self.with(added), added.clone(), &fit.values, Some(&fit.state), effort)
    }

    /// `briefly`, of which a few steps were made, fitted to its end, whatever its twin has beside mechanisms.
    pub fn finished(&self, briefly: Hypothesis<T>) -> Hypothesis<T> {
        let Hypothesis { twin, added, fit, .. } = briefly;
        self.begun(twin, added, &fit.values, Some(&fit.state), Effort::Thorough)
    }

    /// `hypothesis` refitted where the recordings are divided in another way than they were for it.
    pub fn refitted_afresh(&self, hypothesis: &Hypothesis<T>) -> Hypothesis<T> {
        let Hypothesis { added, fit, .. } = hypothesis;
        self.begun(self.with(added), added.clone(), &fit.values, None, Effort::Thorough)
    }

    /// `twin`, which has what is `added`, fitted from these `values` on, and from `state` if that is known of the same parts.
    pub fn begun(&self, twin: T, added: Vec<usize>, values: &[f64], state: Option<&State>, effort: Effort) -> Hypothesis<T> {
        self.fitted(twin, added, &[values.to_vec()], state, effort)
    }

    /// The best fit of `twin` from several starts.
    fn fitted(
        &self,
        twin: T,
        added: Vec<usize>,
        starts: &[Vec<f64>],
        state: Option<&State>,
        effort: Effort,
    ) -> Hypothesis<T> {
        let problem = self.problem(&twin, &self.evidence.compared);
        let estimated;
        let state = match state {
            Some(state) => state,
            None => {
                estimated = self.evidence.initial_state(&problem);
                &estimated
            }
        };
        let best = fit(&problem, starts, &free_parameters(&twin), state, effort);
        let blocks = problem.blocks();
        self.weighed(twin, added, best, &blocks)
    }

    fn weighed(&self, twin: T, added: Vec<usize>, fit: Fit, blocks: &[Block]) -> Hypothesis<T> {
        let mut misfits = channel_misfits(fit.residual.as_slice(), blocks, |channel| self.evidence.rounding_of(channel));
        if self.evidence.sparse {
            // What remembers itself from one such row to the next is no noise.
            misfits.iter_mut().for_each(|misfit| misfit.level = 1.0);
        }
        Hypothesis { twin, added, fit, misfits }
    }

    /// `hypothesis` fitted to the same rows in free run.
    pub fn in_free_run(&self, hypothesis: &Hypothesis<T>) -> Fit {
        if self.evidence.window.is_none() {
            return hypothesis.fit.clone();
        }
        let twin = hypothesis.twin.rounding(false);
        let problem = self.problem(&twin, &self.evidence.free_run);
        let start = std::slice::from_ref(&hypothesis.fit.values);
        fit(&problem, start, &hypothesis.fit.free, &State::estimated(&problem), Effort::Thorough)
    }

    /// What `hypothesis` leaves of the fitted rows in free run, for plants that are compared on windows: what windows do not
    /// tell apart may go its own ways there.
    pub fn left_in_free_run(&self, hypothesis: &Hypothesis<T>) -> Option<f64> {
        self.evidence.window.map(|_| self.in_free_run(hypothesis).objective())
    }

    /// The problem of fitting `twin` to `parts`.
    pub fn problem<'b>(&'b self, twin: &'b T, parts: &'b [Part<'b, T::Stimulus>]) -> Problem<'b, T> {
        Problem { simulator: twin, parts, weights: &self.evidence.weights, seed: self.seed }
    }

    /// How each candidate that `parent` does not have yet would do, by its signature.
    pub fn screened(&self, parent: &Hypothesis<T>) -> Vec<Screened> {
        signatures(self, parent, |_| true)
    }

    /// The same of candidate `number` alone.
    pub fn screened_as(&self, parent: &Hypothesis<T>, number: usize) -> Option<Screened> {
        // A wider law begins as the forms of its name do.
        let name = self.candidates[number].about.name;
        let alike = self.screened_among(parent, |candidate| candidate.about.name == name);
        alike.into_iter().find(|screened| screened.number == number)
    }

    /// The same of the candidates that are `wanted` alone.
    pub fn screened_among(&self, parent: &Hypothesis<T>, wanted: impl Fn(&Candidate) -> bool + Sync) -> Vec<Screened> {
        signatures(self, parent, wanted)
    }
}

/// Numbers of the parameters a fit may move.
pub(super) fn free_parameters<T: Twin>(twin: &T) -> Vec<usize> {
    twin.parameters().iter().enumerate().filter(|(_, p)| !p.frozen()).map(|(k, _)| k).collect()
}

/// `values`, those of a twin, and those of a mechanism with the `parameters` that is added to it: a small `part` of the way to its `start`,
/// which stands last of all, from where it does nothing; of what does nothing at infinity, as many times as far.
fn timid(values: &[f64], parameters: &[Parameter], start: &[f64], part: f64) -> Vec<f64> {
    let own = &start[start.len() - parameters.len()..];
    let little = |(parameter, start): (&Parameter, &f64)| {
        let nothing = parameter.nominal;
        let value = if nothing.is_finite() { nothing + part * (start - nothing) } else { start / part };
        value.clamp(parameter.lower, parameter.upper)
    };
    values.iter().copied().chain(parameters.iter().zip(own).map(little)).collect()
}

/// The first starts that differ from those before them by more than a fit makes up for in a step or two, `most` of them.
fn apart(starts: &[Vec<f64>], parameters: &[Parameter], most: usize) -> Vec<Vec<f64>> {
    let mut kept: Vec<Vec<f64>> = Vec::new();
    for start in starts {
        let near = |other: &Vec<f64>| {
            start.iter().zip(other).zip(parameters).all(|((a, b), p)| {
                let size = (a - p.nominal).abs().max((b - p.nominal).abs());
                (a - b).abs() <= 0.3 * if size.is_finite() { size } else { b.abs() }
            })
        };
        if kept.len() < most && !kept.iter().any(near) {
            kept.push(start.clone());
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn next_to_nothing_of_a_mechanism_is_near_where_it_does_nothing() {
        let parameters = [
            Parameter::new("strength", "", 0.0).within(0.0, f64::INFINITY),
            Parameter::new("time_constant", "s", f64::INFINITY).within(0.1, 500.0),
            Parameter::new("sharpness", "", 2.0).within(1.99, 20.0),
        ];
        // One value of the twin, refitted since; then what screening would begin with.
        let start = [0.7, 4.0, 30.0, 1.0];
        assert_eq!(timid(&[0.9], &parameters, &start, 0.1), [0.9, 0.4, 300.0, 1.99]);
        assert_eq!(timid(&[0.9], &parameters, &start, 0.01)[2], 500.0, "within its bounds");
    }
}
