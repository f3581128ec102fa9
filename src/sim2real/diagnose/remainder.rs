//! What is left beside what was found: how much of it, what it depends on, and whether the motion foretells it.

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::hypothesis::{Hypothesis, Inquiry};
use super::locate::{Covariates, identity};
use super::selection::Selection;
use super::structure::{DEPENDENT, Dependence, Left, foretold as regression, strongest_dependence};
use super::whiteness::{self, ChannelMisfit};
use crate::sim2real::identify::{Block, Fit, Problem, State};
use crate::sim2real::{Clock, Covariate, Measured, Part, Recording, Twin};

/// Where noise is known less well, a remainder above this part of the first misfit is more than an error of form: a volatility slippage of
/// another form leaves up to .28 of the spread of costs (development seeds 42 to 47), and what depends on the side .57 and more.
pub(super) const MOSTLY_LEFT: f64 = 0.35;

/// A twin whose mean squared residual is at most this many times the noise needs nothing.
pub(super) const NEAR_THE_NOISE: f64 = 1.5;

/// Noise of which rounding has this part of the variance is rounding.
const ALL_OF_IT: f64 = 0.99;

/// A run whose mean squared residual is at most this many times the noise follows what was recorded.
const FOLLOWED: f64 = 2.0;

/// The part of the recalibrated misfit above the noise that is left: of the channel in which most is left.
///
/// Where rows are messages the misfit is taken about its mean: a constant cost is something that any simulator can be
/// given, and no measure of what was explained. How much noise messages have nobody knows but where it is that of rounding: of what is
/// left elsewhere that counts which depends on something. Where most of the whole misfit does, the spread of costs that goes for their
/// noise is the very thing that is missing.
pub(super) fn remainder<T: Twin>(inquiry: &Inquiry<'_, T>, selection: &Selection<T>, depends: &[OfChannel]) -> f64 {
    let blocks = inquiry.problem(inquiry.twin, &inquiry.evidence.compared).blocks();
    let about_mean = inquiry.twin.clock() == Clock::Event;
    let of_channel = |(first, last): (&ChannelMisfit, &ChannelMisfit)| {
        let count = first.count as f64;
        let residual = selection.recalibrated.fit.residual.as_slice();
        let sum: f64 = whiteness::of_channel(residual, &blocks, &first.channel).iter().flat_map(|s| s.iter()).sum();
        let constant = if about_mean { sum * sum / count.max(1.0) } else { 0.0 };
        let whole = first.sum_of_squares - constant;
        let misfit = whole - last.level * count;
        let visible = misfit > (NEAR_THE_NOISE - 1.0) * last.level * count;
        let of_misfit = if visible { left(inquiry, depends, last) / misfit } else { 0.0 };
        let beyond_doubt = explained(depends, last, DEPENDENT);
        if beyond_doubt > MOSTLY_LEFT * whole { of_misfit.max(beyond_doubt / whole) } else { of_misfit }
    };
    let channels = selection.recalibrated.misfits.iter().zip(&selection.selected.misfits);
    channels.map(of_channel).fold(0.0, f64::max)
}

/// What is left of a channel that the selected twin leaves like that, of which residuals of messages depend on something.
fn left<T: Twin>(inquiry: &Inquiry<'_, T>, depends: &[OfChannel], last: &ChannelMisfit) -> f64 {
    let above = last.above(last.level);
    // Where noise is rounding and no more, all that is above it is something.
    if inquiry.twin.clock() != Clock::Event || inquiry.evidence.rounding_of(&last.channel) > ALL_OF_IT {
        return above;
    }
    explained(depends, last, 0.0).min(above)
}

/// What residuals of messages of a channel owe to what they depend on, of the dependences that are stronger than this.
fn explained(depends: &[OfChannel], of: &ChannelMisfit, strength: f64) -> f64 {
    let own = depends.iter().filter(|one| one.channel == of.channel && one.dependence.strength > strength);
    own.map(|one| one.dependence.explained).sum()
}

/// Whether `fit`, that of `selected` in free run, leaves no more than about the noise.
pub(super) fn followed<T>(fit: &Fit, selected: &Hypothesis<T>) -> bool {
    let level = selected.misfits.iter().map(|m| m.level).fold(1.0, f64::max);
    fit.residual.norm_squared() <= FOLLOWED * level * fit.residual.len() as f64
}

/// What the residuals of a channel of messages depend on most in one recording.
pub(super) struct OfChannel {
    channel: String,
    dependence: Dependence,
}

/// What the remaining residuals of messages depend on most, channel by channel, of those that leave more than what numbers are rounded
/// to: below it there is nothing to explain, however regular it is, for rounding is regular too.
pub(super) fn dependences<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selected: &Hypothesis<T>,
    covariates: &Covariates,
) -> Vec<OfChannel> {
    let rounded = |channel: &str| {
        let misfit = selected.misfits.iter().find(|misfit| misfit.channel == channel);
        misfit.is_none_or(|misfit| misfit.within(NEAR_THE_NOISE, inquiry.evidence.rounding_of(channel)))
    };
    if inquiry.twin.clock() != Clock::Event || selected.misfits.iter().all(|misfit| rounded(&misfit.channel)) {
        return Vec::new();
    }
    let parts = &inquiry.evidence.compared;
    let residual = selected.fit.residual.as_slice();
    let blocks = inquiry.problem(&selected.twin, parts).blocks().into_iter().filter(|block| !rounded(&block.channel));
    let of_part = |part: usize| covariates.get(&identity(parts[part].recording));
    let of = |block: Block| {
        let dependence = strongest_dependence(&residual[block.range.clone()], &block.rows, of_part(block.part)?)?;
        Some(OfChannel { channel: block.channel, dependence })
    };
    blocks.filter_map(of).collect()
}

/// The strongest of them.
pub(super) fn strongest(depends: &[OfChannel]) -> Option<Dependence> {
    let all = depends.iter().map(|one| &one.dependence);
    all.max_by(|a, b| a.strength.total_cmp(&b.strength)).cloned()
}

/// The part of what is left of sampled signals that the motion foretells on held-out data.
///
/// The motion is the simulated one: what is measured holds the noise itself, and coloured noise would foretell itself.
pub(super) fn foretold<T: Twin>(inquiry: &Inquiry<'_, T>, selected: &Hypothesis<T>) -> f64 {
    if inquiry.twin.clock() == Clock::Event {
        return 0.0;
    }
    let held_out = inquiry.evidence.held_out_as_compared();
    let mut simulated: BTreeMap<usize, Simulated<'_, T::Stimulus>> = BTreeMap::new();
    for Part { recording, .. } in inquiry.evidence.free_run.iter().chain(&inquiry.evidence.held_out) {
        simulated.entry(identity(recording)).or_insert_with(|| (recording, recording.measured.clone()));
    }
    let mut left = |parts: &[Part<'_, T::Stimulus>], state: &State| -> Vec<Left> {
        let problem = inquiry.problem(&selected.twin, parts);
        let residual = problem.evaluate(&selected.fit.values, state, &[]).residual;
        let blocks = problem.blocks();
        follow(&problem, &blocks, &residual, &mut simulated);
        let first = blocks.first().map(|b| b.channel.clone());
        let of_first = blocks.into_iter().filter(|b| Some(&b.channel) == first.as_ref());
        of_first
            .map(|b| Left {
                recording: identity(parts[b.part].recording),
                residual: residual.as_slice()[b.range].to_vec(),
                rows: b.rows,
            })
            .collect()
    };
    let mut begun = inquiry.evidence.initial_state(&inquiry.problem(&selected.twin, &held_out));
    if inquiry.evidence.window.is_none() {
        // A run far from where it should have begun is off by what its motion foretells.
        let settled = |part| inquiry.evidence.settled(&selected.twin, &selected.fit.values, part);
        begun.values = held_out.iter().map(settled).collect();
    }
    let (fitted, unseen) = (left(&inquiry.evidence.compared, &selected.fit.state), left(&held_out, &begun));
    let of_motion = |(recording, samples): Simulated<'_, T::Stimulus>| -> Vec<Covariate> {
        inquiry.twin.covariates(&inquiry.twin.resampled(recording, samples))
    };
    let covariates = simulated.into_iter().map(|(identity, one)| (identity, of_motion(one))).collect();
    regression(&fitted, &unseen, &covariates)
}

/// A recording, and its samples as they were simulated.
type Simulated<'a, S> = (&'a Recording<S>, Vec<Measured>);

/// Puts what was simulated in the place of what was measured.
fn follow<T: Twin>(
    problem: &Problem<'_, T>,
    blocks: &[Block],
    residual: &DVector<f64>,
    simulated: &mut BTreeMap<usize, Simulated<'_, T::Stimulus>>,
) {
    for block in blocks {
        let noise = problem.weights.iter().find(|w| w.channel == block.channel).map_or(0.0, |w| w.noise);
        let of_recording = simulated.get_mut(&identity(problem.parts[block.part].recording));
        let channel = of_recording.and_then(|(_, samples)| samples.iter_mut().find(|m| m.channel == block.channel));
        let Some(channel) = channel else { continue };
        for (row, at) in block.rows.iter().zip(block.range.clone()) {
            if let Some(sample) = &mut channel.samples[*row] {
                *sample -= noise * residual[at];
            }
        }
    }
}
