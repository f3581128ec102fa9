//! Backward elimination: what a set does not need is left out again.

use rayon::prelude::*;

use super::forms::{names, reformed};
use super::hypothesis::{Hypothesis, Inquiry};
use super::needed::needed;
use super::weigh::{ACCEPT, gain, lead, ranked, squares};
use crate::sim2real::Twin;

/// Two fits of one twin that leave as much but for this part came to the same.
const AS_LITTLE: f64 = 1e-4;
/// Of so many mechanisms, one may stand for what the others leave in the wrong form.
const SEVERAL: usize = 3;
/// So many other sets that are as good as the best of the last stage are pruned as well.
const AS_GOOD: usize = 2;

/// Leaves out of the largest set what it does not need, one mechanism at a time, refitting each time. Gives the twin with
/// nothing added too: its refit may have been better begun from where that of the set ended.
pub(super) fn pruned<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    recalibrated: &Hypothesis<T>,
    mut best_of_stage: Vec<Hypothesis<T>>,
) -> (Hypothesis<T>, Hypothesis<T>, Vec<Hypothesis<T>>) {
    let mut bare = recalibrated.clone();
    let Some(mut whole) = best_of_stage.pop() else { return (bare.clone(), bare, Vec::new()) };
    loop {
        if whole.added.is_empty() {
            return (bare.clone(), bare, Vec::new());
        }
        // A set must be worth its size beside the best of one less, whether or not that is a part of it.
        if let Some(smaller) = best_of_stage.pop_if(|smaller| {
            smaller.added.len() + 1 == whole.added.len()
                && (gain(inquiry, smaller, &whole) <= ACCEPT || !needed(inquiry, &bare, smaller, &whole))
        }) {
            whole = better_part(inquiry, &bare, &whole, smaller);
            continue;
        }
        let mut without = parts(inquiry, &whole);
        if whole.added.len() >= SEVERAL {
            without = without.par_iter().map(|less| reformed(inquiry, recalibrated, less)).collect();
        }
        if let [alone] = without.as_mut_slice() {
            if squares(alone) < (1.0 - AS_LITTLE) * squares(&bare) {
                bare = alone.clone();
            } else {
                *alone = bare.clone();
            }
        }
        let weakest = (0..whole.added.len())
            .map(|i| (i, gain(inquiry, &without[i], &whole), needed(inquiry, &bare, &without[i], &whole)))
            .filter(|(_, gain, needed)| *gain <= ACCEPT || !needed)
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((weakest, _, _)) = weakest else { return (bare, whole, without) };
        let smaller = without[weakest].clone();
        // Another set of that size, found on the way up, may have been the better one to keep.
        whole = match best_of_stage.pop() {
            Some(other) if lead(inquiry, &bare, &other, &smaller) > 0.0 => other,
            _ => smaller,
        };
    }
}

/// Sets as large as may be that are as good as the `best` of them, for all that so few points of evidence say, no two of the same names.
///
/// Which of them is best is hardly told, and what the one needs and the others do not may be the right set.
pub(super) fn others_as_good<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    parent: &Hypothesis<T>,
    best: &Hypothesis<T>,
    children: &[Hypothesis<T>],
) -> Vec<Hypothesis<T>> {
    let near = |child: &&Hypothesis<T>| lead(inquiry, parent, best, child) <= ACCEPT;
    let mut known = vec![names(inquiry, best)];
    let mut kept = Vec::new();
    for child in children.iter().filter(near) {
        let names = names(inquiry, child);
        if kept.len() < AS_GOOD && !known.contains(&names) {
            known.push(names);
            kept.push(child.clone());
        }
    }
    kept
}

/// What is needed of the largest of `best_of_stage`, or of one of those that are `as_good`, if that comes to more.
pub(super) fn best_part<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    recalibrated: &Hypothesis<T>,
    best_of_stage: Vec<Hypothesis<T>>,
    as_good: Vec<Hypothesis<T>>,
) -> (Hypothesis<T>, Hypothesis<T>, Vec<Hypothesis<T>>) {
    let smaller = best_of_stage.split_last().map_or_else(Vec::new, |(_, smaller)| smaller.to_vec());
    let of_others = as_good.into_par_iter().map(|other| [smaller.clone(), vec![other]].concat());
    let paths: Vec<Vec<Hypothesis<T>>> = [best_of_stage].into_par_iter().chain(of_others).collect();
    let all: Vec<_> = paths.into_par_iter().map(|path| pruned(inquiry, recalibrated, path)).collect();
    let mut all = all.into_iter();
    let first = all.next().unwrap_or_else(|| (recalibrated.clone(), recalibrated.clone(), Vec::new()));
    all.fold(first, |best, other| if lead(inquiry, &best.0, &best.1, &other.1) < 0.0 { other } else { best })
}

/// Whether each mechanism of `whole` is needed, which leaves less than what is fitted `without` it.
pub(super) fn all_needed<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    bare: &Hypothesis<T>,
    whole: &Hypothesis<T>,
    without: &[Hypothesis<T>],
) -> bool {
    without.iter().all(|less| gain(inquiry, less, whole) > ACCEPT && needed(inquiry, bare, less, whole))
}

/// `whole` with one of its mechanisms left out, in their order.
fn parts<T: Twin>(inquiry: &Inquiry<'_, T>, whole: &Hypothesis<T>) -> Vec<Hypothesis<T>> {
    (0..whole.added.len()).into_par_iter().map(|i| inquiry.without(whole, i)).collect()
}

/// The best of `smaller` and of all parts of `whole` in their best forms, unless `smaller` leaves nothing: what `whole` explains more, and
/// is not worth its size for, may be what another form explains.
fn better_part<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    first: &Hypothesis<T>,
    whole: &Hypothesis<T>,
    smaller: Hypothesis<T>,
) -> Hypothesis<T> {
    if whole.added.len() < SEVERAL || smaller.leaves_nothing() || gain(inquiry, &smaller, whole) <= ACCEPT {
        return smaller;
    }
    let parts = parts(inquiry, whole);
    let mut all: Vec<Hypothesis<T>> = parts.par_iter().map(|part| reformed(inquiry, first, part)).collect();
    all.insert(0, smaller.clone());
    ranked(inquiry, first, all).into_iter().next().unwrap_or(smaller)
}
