//! The verdict, and what it rests on.

use std::collections::{BTreeMap, BTreeSet};

use super::Found;
use super::decision::{FEWEST_ROWS, FORETOLD, Findings, decide};
use super::diagnosis::{Checks, Diagnosis, ParameterChange, SCHEMA, Score, Verdict, Where};
use super::hypothesis::{Hypothesis, Inquiry};
use super::rivals::Place;
use super::selection::Selection;
use super::structure::DEPENDENT;
use super::{effects, whiteness, words};
use crate::sim2real::{Candidate, Clock, Part, Twin};

/// What takes part of something unknown in signals is right less often than its evidence has it, and the more so the less sure that is: in
/// this part of a power of it. Of 657 names of ten spent test seeds 1 in 14 was right of those said to be 5 to 10 % sure by a third of the
/// evidence, and 7 in 10 of those said to be 30 to 35 % sure.
const PART_OF_IT: f64 = 0.6;
const LESS_SURE: f64 = 1.5;

/// The whole result.
pub(super) fn diagnosis<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selection: &Selection<T>,
    places: &[Place],
    findings: &Findings,
) -> Diagnosis {
    let selected = &selection.selected;
    let mut effects = effects::fitted(inquiry, selected, places, findings);
    let verdict = match decide(selection, &effects, findings) {
        Verdict::Named | Verdict::Ambiguous if !effects::distinct(inquiry, selected) => Verdict::Unexplained,
        verdict => verdict,
    };
    if verdict == Verdict::Unexplained {
        effects.iter_mut().for_each(|e| e.confidence = after_all(e.confidence, findings.remainder, findings.sampled));
    }
    let blocks = inquiry.problem(&selected.twin, &inquiry.evidence.compared).blocks();
    let mut names: Vec<&str> = inquiry.candidates.iter().map(|c| c.about.name).collect();
    names.dedup();
    Diagnosis {
        schema: SCHEMA.to_owned(),
        verdict,
        summary: words::summary(&facts(inquiry, findings), verdict, &effects),
        location: Where::default(),
        parameters: parameters(inquiry, selected, findings),
        fit: findings.fits.clone(),
        checks: Checks {
            adequacy: whiteness::adequacy(selected.fit.residual.as_slice(), &blocks),
            remainder: findings.remainder,
            placebo_p: findings.placebo_p,
            at_bound: at_bound(inquiry, selected, findings),
            tried: names.len(),
            not_excited: not_excited(&selection.scores),
            notes: notes(inquiry, selected, findings),
        },
        next_experiment: None,
        scores: selection.scores.clone(),
        modelled: inquiry.twin.modelled().into_iter().map(str::to_owned).collect(),
        held_out: inquiry.evidence.how.clone(),
        effects,
    }
}

/// How sure a name is where something unknown is left, of signals or of messages: what is left speaks against it.
fn after_all(sure: f64, remainder: f64, sampled: bool) -> f64 {
    let part = if sampled { PART_OF_IT * sure.powf(LESS_SURE) } else { sure };
    part * (1.0 - remainder.clamp(0.0, 1.0))
}

/// What the words for the verdict are made of.
pub(super) fn facts<T: Twin>(inquiry: &Inquiry<'_, T>, findings: &Findings) -> words::Facts {
    words::Facts {
        name: inquiry.twin.name(),
        tried: inquiry.candidates.iter().map(|candidate| (candidate.about.name, candidate.about.title)).collect(),
        fits: findings.fits.clone(),
        few: findings.trued.residual.len() < FEWEST_ROWS,
        remainder: findings.remainder,
        dependence: findings.dependence.clone(),
        contradiction: findings.contradiction.clone().or_else(|| findings.belied.clone()),
    }
}

/// Adds what the recordings show by themselves.
pub(super) fn recognized<T: Twin>(
    diagnosis: &mut Diagnosis,
    inquiry: &Inquiry<'_, T>,
    of_what: &Found<'_>,
    found: &[&Candidate],
) {
    if found.is_empty() {
        return;
    }
    let (unit, signs) = (inquiry.twin.unit("output"), &of_what.signs);
    let of_signs = [
        (signs.repeated > 0.0).then(|| {
            let share = 100.0 * signs.repeated;
            format!("{share:.1} % of the samples repeat the one before to the last bit, and were taken for lost")
        }),
        (signs.step > 0.0).then(|| format!("the sensor counts in steps of {} {unit}", words::figure(signs.step, 3))),
    ];
    let told = of_signs.into_iter().flatten().collect::<Vec<_>>().join("; ");
    let summary = match diagnosis.verdict {
        Verdict::NoMismatch => {
            Some(format!("The recordings show that {told}; for the rest the {} explains them.", inquiry.twin.name()))
        }
        // What was not moved enough to be told of does not unsay what is seen, nor is it explained by that.
        Verdict::NotExcited if diagnosis.effects.is_empty() => {
            Some(format!("The recordings show that {told}. {}", diagnosis.summary))
        }
        _ => None,
    };
    if let Some(summary) = summary {
        diagnosis.verdict = Verdict::Named;
        diagnosis.summary = summary;
    }
    diagnosis.checks.notes.push(told);
    diagnosis.effects.extend(found.iter().map(|candidate| effects::seen(inquiry, of_what, candidate)));
}

/// Names of all parameters, those of mechanisms behind their mechanism's id.
fn names<T: Twin>(inquiry: &Inquiry<'_, T>, selected: &Hypothesis<T>) -> Vec<String> {
    let own = inquiry.twin.parameters().len();
    let added = selected.added.iter().flat_map(|number| {
        let candidate = &inquiry.candidates[*number];
        candidate.form.parameters.iter().map(|p| format!("{}.{}", candidate.about.name, p.name))
    });
    selected.twin.parameters()[..own].iter().map(|p| p.name.clone().into_owned()).chain(added).collect()
}

/// The parameters that ended at a bound.
fn at_bound<T: Twin>(inquiry: &Inquiry<'_, T>, selected: &Hypothesis<T>, findings: &Findings) -> Vec<String> {
    let names = names(inquiry, selected).into_iter().enumerate();
    names.filter(|(k, _)| findings.trued.at_bound.contains(k)).map(|(_, name)| name).collect()
}

/// What is to be said of parameters that the recordings show by themselves, where a fit alone would say something else.
fn shown<T: Twin>(inquiry: &Inquiry<'_, T>, selected: &Hypothesis<T>) -> Vec<String> {
    let parameters = selected.twin.parameters().iter().zip(&selected.fit.values).zip(names(inquiry, selected));
    parameters
        .filter_map(|((p, fitted), name)| {
            let [value, std] = p.shown?;
            let unit = inquiry.twin.unit(&p.unit);
            ((fitted - value).abs() > 2.0 * std).then(|| {
                format!(
                    "`{name}` is the usual one, {} {unit}, as time stamps show it; what was recorded is followed best with {} {unit}",
                    words::figure(value, 3),
                    words::figure(*fitted, 3)
                )
            })
        })
        .collect()
}

/// Ids of the mechanisms of which no form would show beside the twin alone.
fn not_excited(scores: &[Score]) -> Vec<String> {
    let first: Vec<&Score> = scores.iter().filter(|s| s.stage == 0).collect();
    let silent = |s: &&&Score| !first.iter().any(|other| other.mechanism == s.mechanism && other.excited);
    let mut ids: Vec<String> = first.iter().filter(silent).map(|s| s.mechanism.clone()).collect();
    ids.sort();
    ids.dedup();
    ids
}

fn parameters<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selected: &Hypothesis<T>,
    findings: &Findings,
) -> BTreeMap<String, ParameterChange> {
    let own = inquiry.twin.parameters().len();
    selected.twin.parameters()[..own]
        .iter()
        .enumerate()
        .map(|(k, p)| {
            let change = ParameterChange {
                nominal: p.nominal,
                value: findings.trued.values[k],
                std: findings.std[k],
                unit: inquiry.twin.unit(&p.unit),
            };
            (p.name.clone().into_owned(), change)
        })
        .collect()
}

fn notes<T: Twin>(inquiry: &Inquiry<'_, T>, selected: &Hypothesis<T>, findings: &Findings) -> Vec<String> {
    let parts = inquiry.evidence.free_run.iter().chain(&inquiry.evidence.held_out);
    // Of several recordings a note says which it is of.
    let several = inquiry.evidence.free_run.len() > 1;
    let told = |name: &str, note: String| if several { format!("{name}: {note}") } else { note };
    let of = |part: &Part<'_, T::Stimulus>| {
        inquiry.twin.notes(part.recording).into_iter().map(|n| told(&part.recording.name, n)).collect::<Vec<_>>()
    };
    let mut notes: Vec<String> = parts.flat_map(of).collect();
    let mut told = BTreeSet::new();
    notes.retain(|note| told.insert(note.clone()));
    notes.extend(shown(inquiry, selected));
    let smooth = selected.fit.jacobian.ncols();
    if selected.fit.rank < smooth {
        notes.push(format!(
            "the recordings determine {} of {smooth} combinations of the parameters; what the twin says of their uncertainty \
             decides the rest",
            selected.fit.rank
        ));
    }
    if let Some(seconds) = inquiry.evidence.window {
        notes.push(format!(
            "this plant does not forget where it started, so hypotheses were compared on windows of {seconds:.2} s, each \
             started afresh; errors in `fit` are of the free run"
        ));
    }
    if let Some(dependence) = &findings.dependence {
        notes.push(format!(
            "what is left depends most on {} (-log10 p = {:.1}; above {DEPENDENT} it counts)",
            dependence.on, dependence.strength
        ));
    } else if inquiry.twin.clock() != Clock::Event {
        notes.push(format!(
            "a regression on the motion foretells {:.1} % of what is left on held-out data (above {:.0} % it counts)",
            100.0 * findings.foretold,
            100.0 * FORETOLD
        ));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the evidence left no doubt of is right in 6 of 10 then, what it made likely in a fifth, and of messages as often as before.
    #[test]
    fn beside_something_unknown_names_are_less_sure_and_the_unsure_by_more() {
        let told = [0.99, 0.5].map(|sure| after_all(sure, 0.0, true));
        assert!((told[0] - 0.59).abs() < 0.01 && (told[1] - 0.21).abs() < 0.01, "{told:?}");
        assert_eq!(after_all(0.5, 0.0, false), 0.5);
        assert_eq!([0.5, 2.0].map(|left| after_all(0.8, left, false)), [0.4, 0.0]);
    }
}
