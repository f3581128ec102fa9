//! What hypotheses that were compared on windows do in free run.

use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Inquiry, KEEPS_UP};
use super::selection::Selection;
use super::weigh::{ABOVE_NOISE, ACCEPT, gain, lead};
use crate::sim2real::Twin;

/// Of so many hypotheses that come near the best on windows, the one that does best in free run is taken.
const NEAR_BEST: usize = 8;
/// What leaves this many times as much in free run as what it builds on is not an explanation, however well it fits windows.
const STRAYS: f64 = 1.5;
/// A free run that leaves no more than so many times the noise knows what windows may have missed.
const HARDLY_MORE: f64 = 2.0;

/// Puts first, of the hypotheses that come near the best and are no longer, the one that does best in free run, where windows
/// were compared; what goes astray there beside `parent`, on which all build, is left out.
pub(super) fn steadiest_first<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    parent: &Hypothesis<T>,
    children: &mut Vec<Hypothesis<T>>,
) {
    for _ in 0..NEAR_BEST {
        nearest_in_free_run(inquiry, first, children);
        match children.first() {
            Some(best) if strays(inquiry, parent, best) => drop(children.remove(0)),
            _ => return,
        }
    }
    children.clear();
}

fn nearest_in_free_run<T: Twin>(inquiry: &Inquiry<'_, T>, first: &Hypothesis<T>, children: &mut [Hypothesis<T>]) {
    let Some(best) = children.first() else { return };
    let close = |child: &Hypothesis<T>| child.free() <= best.free() && lead(inquiry, first, best, child) <= ACCEPT;
    let near: Vec<usize> = (0..children.len().min(NEAR_BEST)).filter(|k| close(&children[*k])).collect();
    if near.len() < 2 {
        return;
    }
    let left: Vec<Option<f64>> = near.par_iter().map(|k| inquiry.left_in_free_run(&children[*k])).collect();
    let least = near.iter().zip(&left).filter_map(|(k, left)| Some((*k, (*left)?))).min_by(|a, b| a.1.total_cmp(&b.1));
    if let Some((k, _)) = least {
        children[..=k].rotate_right(1);
    }
}

/// Whether `whole` fits windows better than `less` and a free run much worse.
///
/// What leaves nothing but noise of windows of which `less` leaves more may: where a plant can come to rest in one place or in the
/// next, a free run tells which it came to, and not how.
pub(super) fn strays<T: Twin>(inquiry: &Inquiry<'_, T>, less: &Hypothesis<T>, whole: &Hypothesis<T>) -> bool {
    if whole.within(ABOVE_NOISE) && !less.within(ABOVE_NOISE) {
        return false;
    }
    match (inquiry.left_in_free_run(less), inquiry.left_in_free_run(whole)) {
        (Some(less), Some(whole)) => whole > STRAYS * less,
        _ => false,
    }
}

/// Whether windows gain by each of several effects that were found in free run.
pub(super) fn upheld<T: Twin>(in_windows: &Inquiry<'_, T>, found: &Selection<T>) -> bool {
    if found.selected.added.len() < 2 {
        return true;
    }
    let whole = in_windows.refitted_afresh(&found.selected);
    found.without.iter().all(|less| gain(in_windows, &in_windows.refitted_afresh(less), &whole) > 0.0)
}

/// Whether windows show nothing but what pushes a plant by chance: where no command is as late as the one before, each pushes one that adds up
/// a little too far or not far enough, which no law foretells. A free run goes astray by it, and teeth or a stop may lead it back.
pub(super) fn led_astray<T: Twin>(in_windows: &Inquiry<'_, T>, selection: &Selection<T>) -> bool {
    selection.complete() && selection.selected.added.iter().any(|number| in_windows.candidates[*number].unsteady)
}

/// Whether what free run `found` beside what was selected on windows is there: that keeps up with the recordings by itself, and nothing leads
/// it [astray](led_astray), or windows gain by what was found, too. Where a plant can come to rest in one place or in the next, whatever
/// moves it a little may bring it to the right one by chance.
pub(super) fn bears_out<T: Twin>(
    windows: (&Inquiry<'_, T>, &Selection<T>),
    free_run: (&Inquiry<'_, T>, &Selection<T>),
) -> bool {
    let (in_windows, selection) = windows;
    let (in_free_run, found) = free_run;
    let keeps_up = || in_free_run.refitted_afresh(&selection.selected).within(KEEPS_UP);
    found.selected.set() == selection.selected.set()
        || !led_astray(in_windows, selection) && keeps_up()
        || gain(in_windows, &selection.selected, &in_windows.refitted_afresh(&found.selected)) > 0.0
}

/// Whether what was selected on windows does so much worse in free run than what was selected there, or so much as worse at greater
/// length, that it cannot be what is missing: it does not leave mere noise of windows, or what was selected in free run hardly leaves
/// more than noise itself.
pub(super) fn worse_than<T: Twin>(windows: (&Inquiry<'_, T>, &Selection<T>), free_run: &Selection<T>) -> bool {
    let (inquiry, selection) = windows;
    let left = inquiry.left_in_free_run(&selection.selected);
    let longer = selection.selected.free() > free_run.selected.free();
    let least = if longer { 1.0 } else { STRAYS } * free_run.selected.fit.objective();
    let in_doubt = !selection.complete() || free_run.selected.within(HARDLY_MORE);
    in_doubt && !free_run.selected.added.is_empty() && left.is_some_and(|left| left > least)
}
