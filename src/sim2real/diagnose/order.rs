//! Order: which of two laws of commands, or of observations, acts first.
//!
//! What a sensor folds and what it is off by, or a dead zone and a limit, do not do the same in either order, and mechanisms are found in the
//! order in which they explain most. Laws of a plant act at once, and what messages are off by adds up.

use nalgebra::DVector;

use super::hypothesis::{Hypothesis, Inquiry};
use super::weigh::squares;
use crate::sim2real::identify::Effort;
use crate::sim2real::{Clock, Site, Twin};

/// Residuals that differ by this part of their sum of squares are the same.
const ROUNDING: f64 = 1e-12;

/// `found`, or the same with its last law before another of its site, if that leaves less.
pub(super) fn in_either_order<T: Twin>(inquiry: &Inquiry<'_, T>, found: Hypothesis<T>, effort: Effort) -> Hypothesis<T> {
    if inquiry.twin.clock() == Clock::Event || found.leaves_nothing() {
        return found;
    }
    let others = earlier_of_its_site(inquiry, &found);
    let others = others.into_iter().filter_map(|place| with_last_before(inquiry, &found, place, effort));
    let least = others.min_by(|a, b| squares(a).total_cmp(&squares(b)));
    match least {
        Some(other) if squares(&other) < squares(&found) => other,
        _ => found,
    }
}

/// The places of the laws of `hypothesis` that act one after the other, the last of them after all.
fn earlier_of_its_site<T: Twin>(inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>) -> Vec<usize> {
    let site = |number: &usize| inquiry.candidates[*number].about.site;
    let Some((last, earlier)) = hypothesis.added.split_last() else { return Vec::new() };
    (0..earlier.len()).filter(|place| site(last) != Site::Plant && site(&earlier[*place]) == site(last)).collect()
}

/// `found` with its last law before its `place`-th, fitted from where it stands; none where that is the same.
fn with_last_before<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    found: &Hypothesis<T>,
    place: usize,
    effort: Effort,
) -> Option<Hypothesis<T>> {
    let (mut added, mut values) = (found.added.clone(), found.fit.values.clone());
    let last = inquiry.of_mechanism(found, added.len() - 1);
    values[inquiry.of_mechanism(found, place).start..].rotate_right(last.len());
    added[place..].rotate_right(1);
    let twin = inquiry.with(&added);
    let there = inquiry.problem(&twin, &inquiry.evidence.compared).evaluate(&values, &found.fit.state, &[]);
    if same(&there.residual, &found.fit.residual) {
        return None;
    }
    Some(inquiry.begun(twin, added, &values, Some(&found.fit.state), effort))
}

/// Whether two residuals are the same but for rounding.
fn same(a: &DVector<f64>, b: &DVector<f64>) -> bool {
    (a - b).norm_squared() <= ROUNDING * b.norm_squared()
}
