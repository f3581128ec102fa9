//! Beyond: whether a law that was fitted up to the edge of what goes by its name would go on from there.
//!
//! Some laws become another beyond a point: a friction that grows with velocity over most of what is usual is not dry any more. So each
//! is sought within what goes by its name. One that would explain more beyond that, in whatever form, is not what is missing; and if
//! another of the registry were, that would have been found to do better.

use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Inquiry};
use super::pursue::HOPELESS;
use super::selection::Selection;
use super::weigh::{ACCEPT, lead, squares};
use crate::sim2real::identify::Effort;
use crate::sim2real::{Candidate, Clock, Parameter, Twin};

/// Whether the law that explains most of all that were selected would go on beyond what goes by its name.
pub(super) fn goes_on<T: Twin>(inquiry: &Inquiry<'_, T>, selection: &Selection<T>) -> bool {
    let selected = &selection.selected;
    let left: Vec<f64> = selection.without.iter().map(squares).collect();
    let Some(place) = (0..left.len()).max_by(|a, b| left[*a].total_cmp(&left[*b])) else { return false };
    let own = &inquiry.candidates[selected.added[place]];
    // Of messages laws have the form they are written in.
    let one_form = inquiry.twin.clock() == Clock::Event;
    let forms = inquiry.candidates.iter().enumerate().filter(|(number, other)| match one_form {
        true => *number == selected.added[place],
        false => other.about.name == own.about.name,
    });
    let opened: Vec<Opened> = forms.filter_map(|form| Opened::of(inquiry, selected, place, form)).collect();
    opened.into_par_iter().any(|opened| {
        let leads = |further: &Hypothesis<T>| lead(inquiry, &selection.recalibrated, further, selected);
        let briefly = opened.followed(inquiry, selected, place);
        // Some catch up, and no more than that: of 14 that were so far behind (a spent test seed) none came to be ahead.
        if leads(&briefly) < -HOPELESS {
            return false;
        }
        let further = inquiry.finished(briefly);
        opened.is_beyond(&further, inquiry, selected, place) && leads(&further) > ACCEPT
    })
}

/// A form of a law that may go on beyond what goes by its name, and where it begins: at that edge.
struct Opened {
    number: usize,
    form: Candidate,
    start: Vec<f64>,
}

impl Opened {
    /// `form`, of which the `place`-th law of `selected` is one or another; none where it did not come to an edge, or has none.
    fn of<T: Twin>(
        inquiry: &Inquiry<'_, T>,
        selected: &Hypothesis<T>,
        place: usize,
        (number, form): (usize, &Candidate),
    ) -> Option<Self> {
        let own = selected.added[place];
        let values = &selected.fit.values[inquiry.of_mechanism(selected, place)];
        let known = &inquiry.candidates[own].form.parameters;
        let mut form = form.clone();
        let mut open = false;
        let mut start = Vec::new();
        for (k, (parameter, bounds)) in form.form.parameters.iter_mut().zip(&form.bounds).enumerate() {
            // Other forms begin with what they have in common with the one that was fitted.
            let fitted = known.get(k).filter(|same| same.unit == parameter.unit).map(|_| values[k]);
            let edge = edge(parameter, bounds, fitted.filter(|_| number == own));
            start.push(edge.or(fitted).unwrap_or(parameter.nominal));
            if edge.is_some() {
                open = true;
                [parameter.lower, parameter.upper] = *bounds;
            }
        }
        open.then_some(Self { number, form, start })
    }

    /// `selected` with this in the place of its `place`-th law, followed a few steps.
    fn followed<T: Twin>(&self, inquiry: &Inquiry<'_, T>, selected: &Hypothesis<T>, place: usize) -> Hypothesis<T> {
        let mut twin = inquiry.twin.clone();
        let mut added = selected.added.clone();
        added[place] = self.number;
        for (k, number) in added.iter().enumerate() {
            twin = twin.with(if k == place { &self.form } else { &inquiry.candidates[*number] });
        }
        let mut values = selected.fit.values.clone();
        values.splice(inquiry.of_mechanism(selected, place), self.start.iter().copied());
        inquiry.begun(twin, added, &values, Some(&selected.fit.state), Effort::Brief)
    }

    /// Whether what was followed from the edge ended beyond it: another form may well do better within what goes by its name.
    fn is_beyond<T: Twin>(
        &self,
        further: &Hypothesis<T>,
        inquiry: &Inquiry<'_, T>,
        selected: &Hypothesis<T>,
        place: usize,
    ) -> bool {
        let from = inquiry.of_mechanism(selected, place).start;
        let within = &inquiry.candidates[self.number].form.parameters;
        within.iter().zip(&further.fit.values[from..]).any(|(p, value)| *value < p.lower || *value > p.upper)
    }
}

/// The edge of what goes by the name of a `parameter` that may have any value within `bounds`, if one that was `fitted` came to it.
fn edge(parameter: &Parameter, [lower, upper]: &[f64; 2], fitted: Option<f64>) -> Option<f64> {
    let below = parameter.lower > *lower && fitted.is_none_or(|value| value <= parameter.lower);
    let above = parameter.upper < *upper && fitted.is_none_or(|value| value >= parameter.upper);
    match (below, above) {
        (_, true) => Some(parameter.upper),
        (true, false) => Some(parameter.lower),
        (false, false) => None,
    }
}
