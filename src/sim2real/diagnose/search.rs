//! The search: in free run and, where a plant adds up errors, on windows that start afresh; each with steps of integration as long as they
//! may be at first.

use super::decision::{SLOWLY_LEFT, slowly_above};
use super::evidence::Evidence;
use super::hypothesis::{Hypothesis, Inquiry};
use super::rivals::{self, Place};
use super::selection::Selection;
use super::weigh::{gain, squares};
use super::{Progress, free_run, gates, select};
use crate::sim2real::Twin;

/// What was found once leaves as little where it is found again, but for this part.
const AS_BEFORE: f64 = 1.02;

/// What is selected, its rivals, and whether that was on the windows of `evidence` rather than in the free run of `inquiry`.
///
/// Where a plant adds up errors, a free run tells most if the physics is complete, and hardly anything if it is not: windows are asked
/// where it leaves more than noise, or what is slower, or where they do not uphold all that it found.
pub(super) fn searched<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    evidence: &Evidence<'_, T::Stimulus>,
    progress: Progress<'_>,
) -> (Selection<T>, Vec<Place>, bool) {
    let given: Vec<f64> = inquiry.twin.parameters().iter().map(|p| p.nominal).collect();
    let as_given = (inquiry.twin, given.as_slice());
    let anew = |inquiry: &Inquiry<'_, T>| select::select(inquiry, inquiry.recalibrated(), progress);
    let (selection, places) = settled(inquiry, as_given, anew, progress);
    if evidence.window.is_none() {
        return (selection, places, false);
    }
    let in_windows = Inquiry { evidence, ..*inquiry };
    let explained = explains(&selection);
    let upheld = free_run::upheld(&in_windows, &selection);
    if explained && upheld {
        return (selection, places, false);
    }
    let (on_windows, places_there) = settled(&in_windows, as_given, anew, progress);
    // What explains a free run that was led astray brought it back by chance.
    let astray = !upheld && free_run::led_astray(&in_windows, &on_windows);
    if explained && !astray {
        return (selection, places, false);
    }
    // What windows have found may be near enough for a free run to tell the rest.
    let found = (&on_windows.selected.twin, on_windows.selected.fit.values.as_slice());
    let gone_on = |inquiry: &Inquiry<'_, T>| select::resumed(inquiry, &on_windows, progress);
    let rest =
        may_tell_more(inquiry, &selection, (&in_windows, &on_windows)).then(|| settled(inquiry, found, gone_on, progress));
    // Windows do not see what is slow: where little else is left, it is a free run that has to explain that.
    let slow = selection.complete();
    let enough = |rest: &Selection<T>| if slow { explains(rest) } else { rest.complete() };
    let there = |rest: &Selection<T>| enough(rest) && free_run::bears_out((&in_windows, &on_windows), (inquiry, rest));
    match rest.filter(|(rest, _)| there(rest)) {
        Some((rest, places)) => (rest, places, false),
        None if astray => (on_windows, places_there, true),
        None if slow || free_run::worse_than((&in_windows, &on_windows), &selection) => (selection, places, false),
        None => (on_windows, places_there, true),
    }
}

/// Whether hardly more than noise is left, and nothing that is slower than noise.
fn explains<T: Twin>(selection: &Selection<T>) -> bool {
    selection.complete() && !slowly_above(&selection.selected, SLOWLY_LEFT)
}

/// Whether a free run may tell of more than windows have found: they explained themselves, and the `selection` that was made in free run did
/// not begin with the same, which has led where it would again. Where they found too little of something to keep it, a free run, which
/// adds that up, begins with it.
fn may_tell_more<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selection: &Selection<T>,
    (in_windows, on_windows): (&Inquiry<'_, T>, &Selection<T>),
) -> bool {
    if !on_windows.complete() {
        return false;
    }
    if on_windows.selected.added.is_empty() {
        let best = on_windows.best_of_stage(1);
        return best.is_some_and(|best| gain(in_windows, &on_windows.recalibrated, best) > 0.0);
    }
    let began_there = |best: &&Hypothesis<T>| best.set() == on_windows.selected.set();
    let before = selection.best_of_stage(on_windows.selected.added.len()).filter(began_there);
    before.is_none_or(|before| !as_good(before, &inquiry.refitted_afresh(&on_windows.selected)))
}

/// Whether a fit that was found before leaves as little as one from another beginning.
fn as_good<T>(before: &Hypothesis<T>, again: &Hypothesis<T>) -> bool {
    squares(before) <= AS_BEFORE * squares(again)
}

/// What is `selected`, and settled, with steps of integration as long as they may be where that begins, then fitted once more with the
/// twin's own.
fn settled<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    (twin, values): (&T, &[f64]),
    selected: impl Fn(&Inquiry<'_, T>) -> Selection<T>,
    progress: Progress<'_>,
) -> (Selection<T>, Vec<Place>) {
    progress("refitting the twin's own parameters", 0, 1);
    let with_rivals = |inquiry: &Inquiry<'_, T>| {
        let selection = selected(inquiry);
        progress("looking for rivals", 0, 1);
        rivals::settled(inquiry, selection)
    };
    if let Some(step) = gates::exploring_step(twin, values, inquiry.evidence) {
        let twin = inquiry.twin.stepping(step);
        let coarse = Inquiry { twin: &twin, ..*inquiry };
        let (selection, places) = with_rivals(&coarse);
        let best = &selection.selected;
        let moved = gates::moved(&best.twin, &best.fit.values, inquiry.evidence, step, gates::own_step(inquiry.twin));
        progress("fitting with the twin's own step", 0, 1);
        let refitted = selection.refitted(inquiry);
        if moved < gates::SETTLED && refitted.selected.added == selection.selected.added {
            return (refitted, places);
        }
        let (refitted, places) = rivals::settled(inquiry, refitted);
        if moved < gates::SETTLED || refitted.complete() {
            return (refitted, places);
        }
    }
    with_rivals(inquiry)
}

#[cfg(test)]
mod tests {
    use super::super::weigh::tests::leaving;
    use super::*;

    #[test]
    fn a_free_run_is_searched_again_only_from_where_it_was_not_or_was_worse() {
        let before = leaving(22.0, 60.0);
        assert!(as_good(&before, &leaving(21.9, 60.0)) && as_good(&before, &leaving(40.0, 60.0)));
        assert!(!as_good(&before, &leaving(3.0, 60.0)), "windows lead to another valley");
    }
}
