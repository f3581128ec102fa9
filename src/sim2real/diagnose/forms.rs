//! Forms: whether what was named would do better in another form, now that it is not alone.

use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Inquiry};
use super::pursue::pursued;
use super::weigh::{ABOVE_NOISE, ACCEPT, gain, lead, ranked};
use crate::sim2real::{Candidate, Twin};

/// Hypotheses behind the best by no more than this, and no more than so many, are tried in their other forms.
const FORMS_MATTER: f64 = 2.0 * ACCEPT;
const REFORMED: usize = 3;
/// So many mechanisms, if they leave more than [`ABOVE_NOISE`], may hide a further one by the forms they are in.
const SEVERAL: usize = 2;

/// `whole` with each of its mechanisms in the form that does best beside the others.
///
/// A form is chosen while what comes later is still missing, and an error of form looks like one thing more. So were its constants: where
/// more than noise is left, the same form is begun once more, from where screening would.
pub(super) fn reformed<T: Twin>(inquiry: &Inquiry<'_, T>, first: &Hypothesis<T>, whole: &Hypothesis<T>) -> Hypothesis<T> {
    let mut best = whole.clone();
    for number in &whole.added {
        let own = inquiry.candidates[*number].about.name;
        let Some(place) = best.added.iter().position(|n| n == number) else { continue };
        let afresh = !best.leaves_nothing();
        let asked = |(n, c): (usize, &Candidate)| c.about.name == own && (afresh || n != *number);
        if !inquiry.candidates.iter().enumerate().any(asked) {
            continue;
        }
        let less = inquiry.without(&best, place);
        let mut screened = inquiry.screened_among(&less, |c| c.about.name == own);
        screened.retain(|one| one.excited && (afresh || one.number != *number));
        let fits: Vec<Hypothesis<T>> = screened.par_iter().map(|one| pursued(inquiry, first, &best, &less, one)).collect();
        for fit in fits {
            if lead(inquiry, first, &best, &fit) < 0.0 {
                best = fit;
            }
        }
    }
    best
}

/// The hypotheses that come near the best, unless that leaves nothing, with each of their mechanisms in its best form; best
/// first.
pub(super) fn in_best_forms<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    parent: &Hypothesis<T>,
    mut children: Vec<Hypothesis<T>>,
) -> Vec<Hypothesis<T>> {
    let Some(best) = children.first().cloned() else { return children };
    // What gains too little to be kept is not bent by the form of another: of those it builds on that has been asked. Of several, each
    // was asked while the others stood in one form; where they leave much, all are asked together.
    let asked = parent.added.len() < SEVERAL || parent.within(ABOVE_NOISE);
    if asked && gain(inquiry, parent, &best) <= ACCEPT {
        return children;
    }
    if best.leaves_nothing() && children.get(1).is_none_or(|other| lead(inquiry, parent, &best, other) > FORMS_MATTER) {
        return children;
    }
    let names: Vec<Vec<&str>> = children.iter().map(|child| names(inquiry, child)).collect();
    let near = |child: &Hypothesis<T>| lead(inquiry, parent, &best, child) <= FORMS_MATTER;
    let asked: Vec<bool> = firsts(&names).into_iter().zip(&children).map(|(first, child)| first && near(child)).collect();
    children
        .par_iter_mut()
        .zip(asked)
        .filter(|(_, asked)| *asked)
        .for_each(|(child, _)| *child = reformed(inquiry, parent, child));
    ranked(inquiry, parent, children)
}

/// The names of the mechanisms of `hypothesis`, the same for the same set.
pub(super) fn names<'c, T: Twin>(inquiry: &Inquiry<'c, T>, hypothesis: &Hypothesis<T>) -> Vec<&'c str> {
    let mut names: Vec<&str> = hypothesis.added.iter().map(|number| inquiry.candidates[*number].about.name).collect();
    names.sort_unstable();
    names
}

/// Which are the first of their names, and no more than [`REFORMED`] of them: the same in other forms would lead to the same.
fn firsts(names: &[Vec<&str>]) -> Vec<bool> {
    let mut known: Vec<&Vec<&str>> = Vec::new();
    let first = |names| {
        let first = known.len() < REFORMED && !known.contains(&names);
        if first {
            known.push(names);
        }
        first
    };
    names.iter().map(first).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_that_stands_first_in_three_forms_leaves_room_for_two_others() {
        let sets = [["a", "b"], ["a", "b"], ["a", "c"], ["a", "b"], ["b", "c"], ["c", "d"]].map(Vec::from);
        assert_eq!(firsts(&sets), [true, false, true, false, true, false]);
        assert!(firsts(&[]).is_empty());
    }
}
