//! Findings: all that a verdict rests on, asked of what was selected.

use super::decision::{self, Findings};
use super::hypothesis::Inquiry;
use super::locate::Covariates;
use super::selection::Selection;
use super::{Comparison, beyond, constancy, exact, held_out, nameless, no_law, noise_of, prove, remainder, uncertainty};
use crate::sim2real::any_twin::{AnyStimulus, AnyTwin};
use crate::sim2real::identify::Fit;
use crate::sim2real::{Clock, Parameter, Recording, Simulator};

/// What is to be known of `selection`, which was found in `recordings`: `trued` is its fit in free run, and the `comparisons` are those of
/// the twin that it makes.
pub(super) fn findings(
    inquiry: &Inquiry<'_, AnyTwin>,
    selection: &Selection<AnyTwin>,
    recordings: &[Recording<AnyStimulus>],
    (comparisons, trued): (&[Comparison], &Fit),
    covariates: &Covariates,
) -> Findings {
    let selected = &selection.selected;
    let fits = prove::channel_fits(comparisons, &noise_of(inquiry, selected), inquiry.seed);
    let std = uncertainty::inflated(inquiry, selected, trued);
    // Each of these follows the twin for long, and none waits for another.
    let belied = || {
        constancy::changed(inquiry, selected, (trued, &std), &fits)
            .or_else(|| nameless::beats(inquiry, selection, recordings, &fits))
    };
    let of_what_is_left = || {
        let of_no_law = no_law::explains_more(inquiry, selection, covariates);
        let left_by = if of_no_law { &selection.recalibrated } else { selected };
        (of_no_law, remainder::dependences(inquiry, left_by, covariates), remainder::foretold(inquiry, selected))
    };
    let ((belied, beyond), (of_no_law, depends, foretold)) =
        rayon::join(|| rayon::join(belied, || beyond::goes_on(inquiry, selection)), of_what_is_left);
    let refuted = decision::refuted(inquiry, selection, &fits, covariates);
    Findings {
        placebo_p: prove::placebo(inquiry, &selection.without, selected),
        // Of what is refuted nothing was explained.
        remainder: if refuted || of_no_law { 1.0 } else { remainder::remainder(inquiry, selection, &depends) },
        refuted,
        of_no_law,
        // What recordings have of their own, as what orders foresaw, may be what the fitted ones tell of.
        few_tell: held_out::few_tell(comparisons) && trued.state.values.iter().all(Vec::is_empty),
        contradiction: decision::contradiction(inquiry, selected, comparisons),
        followed: remainder::followed(trued, selected),
        dependence: remainder::strongest(&depends),
        foretold,
        belied,
        trued: shown(trued, selected.twin.parameters()),
        sampled: inquiry.twin.clock() != Clock::Event,
        inexact: exact::inexact(inquiry, selection),
        beyond,
        fits,
        std,
    }
}

/// The fit with what recordings show by themselves of its parameters. What they leave unexplained is told of the fit: to follow what was
/// recorded it may need another value than the usual one, which whatever is simulated next is to have.
fn shown(fit: &Fit, parameters: &[Parameter]) -> Fit {
    let mut known = fit.clone();
    for (k, [value, _]) in parameters.iter().enumerate().filter_map(|(k, p)| Some((k, p.shown?))) {
        known.values[k] = value;
        known.at_bound.retain(|at| *at != k);
    }
    known
}
