//! Beyond: whether a law that was fitted up to the edge of what goes by its name would go on from there.
//!
//! Some laws become another beyond a point: a friction that grows with velocity over most of what is usual is not dry any more. So each
//! is sought within what goes by its name. One that ended at that edge, and would explain more beyond it, is not what is missing; and if
//! another of the registry were, that would have been found to do better.

use super::hypothesis::{Hypothesis, Inquiry};
use super::select::{ACCEPT, Selection};
use super::weigh::lead;
use crate::sim2real::Twin;

/// Whether one of the laws that were selected would go on beyond what goes by its name.
pub(super) fn goes_on<T: Twin>(inquiry: &Inquiry<'_, T>, selection: &Selection<T>) -> bool {
    let selected = &selection.selected;
    opened(inquiry, selected).is_some_and(|twin| {
        let further = inquiry.followed_as(twin, selected);
        lead(inquiry, &selection.recalibrated, &further, selected) > ACCEPT
    })
}

/// The twin of `selected`, whose laws may go on where they ended at the edge of what goes by their names; none where none did.
fn opened<T: Twin>(inquiry: &Inquiry<'_, T>, selected: &Hypothesis<T>) -> Option<T> {
    let mut twin = inquiry.twin.clone();
    let mut open = false;
    for number in &selected.added {
        let mut candidate = inquiry.candidates[*number].clone();
        let first = twin.parameters().len();
        let parameters = candidate.form.parameters.iter_mut().zip(&candidate.bounds).enumerate();
        for (k, (parameter, [lower, upper])) in parameters.filter(|(k, _)| selected.fit.at_bound.contains(&(first + k))) {
            let value = selected.fit.values[first + k];
            let (before, below) = ([parameter.lower, parameter.upper], value <= parameter.lower);
            if below {
                parameter.lower = *lower
            } else {
                parameter.upper = *upper
            }
            open |= before != [parameter.lower, parameter.upper];
        }
        twin = twin.with(&candidate);
    }
    open.then_some(twin)
}
