//! Beyond: whether a law that was fitted up to the edge of what goes by its name would go on from there.
//!
//! Some laws become another beyond a point: a friction that grows with velocity over most of what is usual is not dry any more. So each
//! is sought within what goes by its name. One that ended at that edge, and would explain more beyond it, is not what is missing; and if
//! another of the registry were, that would have been found to do better.

use super::hypothesis::{Hypothesis, Inquiry};
use super::select::{ACCEPT, Selection};
use super::weigh::{lead, squares};
use crate::sim2real::Twin;

/// Whether the law that explains most of all that were selected would go on beyond what goes by its name.
pub(super) fn goes_on<T: Twin>(inquiry: &Inquiry<'_, T>, selection: &Selection<T>) -> bool {
    let selected = &selection.selected;
    let left: Vec<f64> = selection.without.iter().map(squares).collect();
    let Some(place) = (0..left.len()).max_by(|a, b| left[*a].total_cmp(&left[*b])) else { return false };
    opened(inquiry, selected, place).is_some_and(|twin| {
        let further = inquiry.followed_as(twin, selected);
        lead(inquiry, &selection.recalibrated, &further, selected) > ACCEPT
    })
}

/// The twin of `selected`, whose `place`-th law may go on where it ended at the edge of what goes by its name; none where it did not.
fn opened<T: Twin>(inquiry: &Inquiry<'_, T>, selected: &Hypothesis<T>, place: usize) -> Option<T> {
    let mut twin = inquiry.twin.clone();
    let mut open = false;
    for (k, number) in selected.added.iter().enumerate() {
        let mut candidate = inquiry.candidates[*number].clone();
        if k == place {
            let first = twin.parameters().len();
            let parameters = candidate.form.parameters.iter_mut().zip(&candidate.bounds).enumerate();
            for (k, (parameter, [lower, upper])) in parameters.filter(|(k, _)| selected.fit.at_bound.contains(&(first + k)))
            {
                let before = [parameter.lower, parameter.upper];
                let below = selected.fit.values[first + k] <= parameter.lower;
                if below {
                    parameter.lower = *lower
                } else {
                    parameter.upper = *upper
                }
                open |= before != [parameter.lower, parameter.upper];
            }
        }
        twin = twin.with(&candidate);
    }
    open.then_some(twin)
}
