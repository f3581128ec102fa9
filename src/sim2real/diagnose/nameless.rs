//! Curves of no name: whether an effort that goes with the velocity in whatever way, or an inertia that goes with the position, explains more
//! than what was named.
//!
//! A law that acts on something else may go with the velocity for as long as one motion lasts, as the command of one side does with motion
//! to that side; and the teeth of a motor may go with what a linkage makes of its load. Where a curve in its place leaves less of what was
//! fitted, and less by far of what was not, it is that which the effort goes with, and the name is that of nothing that is there. Laws that
//! are such curves themselves have nothing to fear from one.
//!
//! Source: Armstrong-Hélouvry, Dupont & Canudas de Wit, "A survey of models, analysis tools and compensation methods for the control of
//! machines with friction", Automatica 30 (1994): friction as a map of velocity that is found before a law is.

use rayon::prelude::*;

use super::carry_over::best_begun;
use super::diagnosis::ChannelFit;
use super::hypothesis::{Hypothesis, Inquiry};
use super::selection::Selection;
use crate::sim2real::any_twin::{AnyStimulus, AnyTwin};
use crate::sim2real::identify::Effort;
use crate::sim2real::{Candidate, Clock, Recording, Simulator, Twin};

/// What was named is asked where it leaves more than this many times the noise of held-out signals.
const LEAVES: f64 = 1.05;
/// Evidence above this [twice a log-likelihood] decides, however many constants a curve has: it is held to rows that it was not fitted to as
/// well. Of the laws that were rightly named in 150 cases of a spent test seed, none is beaten by a curve on both.
const DECISIVE: f64 = 10.0;
/// A curve must leave at most this part of what is above the noise where neither was fitted.
const LEFT: f64 = 0.5;

/// What is to be said of the law that a curve beats, if one does.
pub(super) fn beats(
    inquiry: &Inquiry<'_, AnyTwin>,
    selection: &Selection<AnyTwin>,
    recordings: &[Recording<AnyStimulus>],
    fits: &[ChannelFit],
) -> Option<String> {
    let off = |fit: &ChannelFit| fit.trued_rmse.powi(2) > LEAVES * fit.noise_floor.powi(2);
    let asked = inquiry.twin.clock() != Clock::Event && !inquiry.evidence.sparse;
    let selected = &selection.selected;
    if !asked || selected.added.is_empty() || !fits.iter().any(off) {
        return None;
    }
    let name = |place: usize| inquiry.candidates[selected.added[place]].about.name;
    let left = left_elsewhere(inquiry, selected);
    // Of windows it is these that must be off: a free run adds up what is next to nothing in each.
    if inquiry.evidence.window.is_some() && left <= LEAVES {
        return None;
    }
    inquiry.twin.nameless(recordings).into_par_iter().find_map_first(|curve| {
        let place = (0..selected.added.len()).find(|place| {
            if curve.about.contains.contains(&name(*place)) {
                return false;
            }
            let instead = instead(inquiry, selected, &selection.without[*place], &curve);
            told_by(selected, &instead) > DECISIVE && left_elsewhere(inquiry, &instead) - 1.0 < LEFT * (left - 1.0)
        })?;
        Some(format!("{} in the place of {} explains more, here and elsewhere", curve.about.title, name(place)))
    })
}

/// By how much what is left where it was fitted speaks for what stands `instead` of what was `selected`.
fn told_by<T>(selected: &Hypothesis<T>, instead: &Hypothesis<T>) -> f64 {
    let channels = selected.misfits.iter().zip(&instead.misfits);
    channels.map(|(own, other)| other.effective() * (own.sum_of_squares / other.sum_of_squares).ln()).sum()
}

/// `less` with a curve, which is fitted from nothing on; to its end where a few steps have come as far as what was `selected` has: of 69
/// that were behind then (two spent test seeds) none came to be ahead, and their ends took four times as long.
fn instead(
    inquiry: &Inquiry<'_, AnyTwin>,
    selected: &Hypothesis<AnyTwin>,
    less: &Hypothesis<AnyTwin>,
    curve: &Candidate,
) -> Hypothesis<AnyTwin> {
    let values: Vec<f64> = less.fit.values.iter().copied().chain(curve.form.parameters.iter().map(|p| p.nominal)).collect();
    let briefly = inquiry.begun(less.twin.with(curve), less.added.clone(), &values, Some(&less.fit.state), Effort::Brief);
    if told_by(selected, &briefly) > 0.0 { inquiry.finished(briefly) } else { briefly }
}

/// The mean square that `hypothesis` leaves of what is held out, in units of the noise, begun from where it is least: on windows where it
/// was fitted on windows.
fn left_elsewhere(inquiry: &Inquiry<'_, AnyTwin>, hypothesis: &Hypothesis<AnyTwin>) -> f64 {
    let parts = inquiry.evidence.held_out_as_compared();
    let problem = inquiry.problem(&hypothesis.twin, &parts);
    best_begun(&problem, &hypothesis.fit.values, inquiry.evidence.initial_state(&problem))
}
