//! Forms: whether what was named would do better in another form, now that it is not alone.

use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Inquiry};
use super::screen::Screened;
use super::weigh::{lead, pursued};
use crate::sim2real::{Candidate, Twin};

/// `whole` with each of its mechanisms in the form that does best beside the others.
///
/// A form is chosen while what comes later is still missing, and an error of form looks like one thing more.
pub(super) fn reformed<T: Twin>(inquiry: &Inquiry<'_, T>, first: &Hypothesis<T>, whole: &Hypothesis<T>) -> Hypothesis<T> {
    let mut best = whole.clone();
    for number in &whole.added {
        let own = inquiry.candidates[*number].about.name;
        let Some(place) = best.added.iter().position(|n| n == number) else { continue };
        let other = |c: &Candidate| c.about.name == own;
        if !inquiry.candidates.iter().enumerate().any(|(n, c)| n != *number && other(c)) {
            continue;
        }
        let less = inquiry.without(&best, place);
        let screened: Vec<Screened> =
            inquiry.screened_among(&less, other).into_iter().filter(|one| one.number != *number && one.excited).collect();
        let fits: Vec<Hypothesis<T>> = screened.par_iter().map(|one| pursued(inquiry, first, &best, &less, one)).collect();
        for fit in fits {
            if lead(inquiry, first, &best, &fit) < 0.0 {
                best = fit;
            }
        }
    }
    best
}
