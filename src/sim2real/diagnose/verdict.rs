//! The verdict, and what it rests on.

use std::collections::{BTreeMap, BTreeSet};

use super::Found;
use super::diagnosis::{ChannelFit, Checks, Diagnosis, Effect, ParameterChange, SCHEMA, Score, Verdict, Where};
use super::hypothesis::{Hypothesis, Inquiry};
use super::remainder::{NEAR_THE_NOISE, dependences, strongest};
use super::rivals::Place;
use super::select::Selection;
use super::structure::Dependence;
use super::{effects, whiteness, words};
use crate::sim2real::identify::Fit;
use crate::sim2real::{Candidate, Clock, Part, Twin};

/// A remainder above this part of the first misfit is more than an error of form.
const FORM_ERROR: f64 = 0.10;
/// Close to the noise a remainder on held-out data is known less well: above this part it is more than an error of form.
const MOSTLY_LEFT: f64 = 0.35;
/// The mean square of the noise is known to this factor.
const NOISE_KNOWN: f64 = 1.05;
/// A residual counts as structured where a covariate's F test is this strong (-log10 p): complete models reach 5.
const DEPENDENT: f64 = 6.5;
/// A residual counts as structured where a regression foretells this part of it on held-out data.
const FORETOLD: f64 = 0.10;
/// Where this part of it is foretold, what is left is physics, however small it is beside what was found.
const FORETOLD_WELL: f64 = 0.25;
/// A twin whose mean squared residual is this many times the noise does not explain the recordings, whether or not
/// anything foretells what is left.
const FAR_ABOVE_THE_NOISE: f64 = 9.0;
/// A twin to which nothing can be added and whose mean squared residual is this many times the noise lacks something unknown.
pub(super) const ABOVE_THE_NOISE: f64 = 2.0;
/// What a regression foretells counts where the mean squared residual is more than this many times the noise.
const HARDLY_ABOVE: f64 = 1.2;
/// With fewer rows than this, what is not explained is not called explained either.
const FEWEST_ROWS: usize = 50;
/// Larger by less than this, an error is as large.
const WORSE: f64 = 1.02;
/// What is less likely than this to be the library's is not said to be.
const HARDLY_THE_LIBRARY: f64 = 0.1;
/// The same of a single name, and of what does not carry over to held-out data either.
const LIKELIER_THAN_NOT: f64 = 0.5;
/// What takes part of something unknown in signals is right so many times less often than its evidence has it (development seeds 51, 61 and 62).
const PART_OF_IT: f64 = 0.35;
/// A name less certain than this is ambiguous.
const CERTAIN: f64 = 0.7;

/// Everything a verdict rests on.
pub(super) struct Findings {
    pub fits: Vec<ChannelFit>,
    pub placebo_p: Option<f64>,
    pub remainder: f64,
    /// Whether the trued twin follows what was fitted in free run too, and not on windows alone.
    pub followed: bool,
    pub dependence: Option<Dependence>,
    pub foretold: f64,
    pub std: Vec<f64>,
    pub trued: Fit,
    /// Whether rows are samples of signals, rather than messages.
    pub sampled: bool,
    /// Whether what knows no noise is off.
    pub inexact: bool,
    /// Whether a law that was named would go on beyond what goes by its name.
    pub beyond: bool,
    /// Whether what was named of messages is refuted by others, though something is missing.
    pub refuted: bool,
}

/// Whether what was named of messages does worse than nothing on those held out, while without it they depend on something: what was
/// fitted is not what is missing.
pub(super) fn refuted<T: Twin>(inquiry: &Inquiry<'_, T>, selection: &Selection<T>, fits: &[ChannelFit]) -> bool {
    let messages = inquiry.twin.clock() == Clock::Event && !selection.selected.added.is_empty();
    messages
        && !fits.iter().any(|fit| fit.improvement_ci95[0] > 0.0)
        && fits.iter().any(worse)
        && strongest(&dependences(inquiry, &selection.recalibrated)).is_some_and(|d| d.strength > DEPENDENT)
}

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
        let part_of_it = if findings.sampled { PART_OF_IT } else { 1.0 };
        let after_all = part_of_it * (1.0 - findings.remainder.clamp(0.0, 1.0));
        effects.iter_mut().for_each(|e| e.confidence *= after_all);
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

/// What the words for the verdict are made of.
pub(super) fn facts<T: Twin>(inquiry: &Inquiry<'_, T>, findings: &Findings) -> words::Facts {
    words::Facts {
        name: inquiry.twin.name(),
        tried: inquiry.candidates.iter().map(|candidate| (candidate.about.name, candidate.about.title)).collect(),
        fits: findings.fits.clone(),
        remainder: findings.remainder,
        dependence: findings.dependence.clone(),
    }
}

/// Adds what the recordings show by themselves.
pub(super) fn recognized<T: Twin>(
    diagnosis: &mut Diagnosis,
    inquiry: &Inquiry<'_, T>,
    of_what: &Found,
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
    if diagnosis.verdict == Verdict::NoMismatch {
        diagnosis.verdict = Verdict::Named;
        diagnosis.summary =
            format!("The recordings show that {told}; for the rest the {} explains them.", inquiry.twin.name());
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

fn structured(findings: &Findings) -> bool {
    findings.foretold > FORETOLD || findings.dependence.as_ref().is_some_and(|d| d.strength > DEPENDENT)
}

/// The part of the recalibrated misfit above the noise that is left on held-out data; the noise is known to
/// [`NOISE_KNOWN`].
pub(super) fn held_out_remainder(fit: &ChannelFit) -> f64 {
    let above = |rmse: f64, known: f64| (rmse * rmse - known * fit.noise_floor * fit.noise_floor).max(0.0);
    let misfit = above(fit.recalibrated_rmse, 1.0);
    if misfit > 0.0 { above(fit.trued_rmse, NOISE_KNOWN) / misfit } else { 0.0 }
}

/// Whether so much is left on held-out signals that what was named does not explain them.
fn fails_unseen(fit: &ChannelFit) -> bool {
    let remainder = held_out_remainder(fit);
    far_off(fit) && remainder > FORM_ERROR || remainder > MOSTLY_LEFT
}

/// Whether the recalibrated twin leaves more than the noise on held-out data.
fn above_the_noise(fit: &ChannelFit) -> bool {
    fit.recalibrated_rmse * fit.recalibrated_rmse > HARDLY_ABOVE * fit.noise_floor * fit.noise_floor
}

/// Whether what was named does worse on held-out data than nothing.
fn worse(fit: &ChannelFit) -> bool {
    fit.trued_rmse > WORSE * fit.recalibrated_rmse
}

/// The probability that everything named, or one of its rivals each time, is what is missing: the more that is named and
/// the less sure, the likelier it is that all of it stands for one thing that is in no registry.
fn library(effects: &[Effect]) -> f64 {
    let known = |e: &Effect| (e.confidence + e.rivals.iter().map(|r| r.confidence).sum::<f64>()).min(1.0);
    effects.iter().map(known).product()
}

/// How likely it must be at least that what was named is the library's; `unseen` is whether it fails on held-out data.
fn least_likely(effects: &[Effect], unseen: bool) -> f64 {
    match effects {
        // What the fitted data leave no doubt of is right although its form does not carry over to others.
        _ if unseen => CERTAIN,
        // One name alone is right or it is not; of several each may be, with another of the others.
        [_] => LIKELIER_THAN_NOT,
        _ => HARDLY_THE_LIBRARY,
    }
}

/// Whether what is left on held-out data stands far above the noise.
fn far_off(fit: &ChannelFit) -> bool {
    fit.trued_rmse * fit.trued_rmse > FAR_ABOVE_THE_NOISE * fit.noise_floor * fit.noise_floor
}

fn decide<T>(selection: &Selection<T>, effects: &[Effect], findings: &Findings) -> Verdict {
    let floor = |times: f64| selection.selected.misfits.iter().all(|m| m.within(times, 1.0));
    // Of messages it is known of which of them it is asked.
    let left_over = structured(findings) && (!findings.sampled || !selection.selected.within(HARDLY_ABOVE))
        || findings.foretold > FORETOLD_WELL && !floor(HARDLY_ABOVE);
    if effects.is_empty() {
        let rows: usize = selection.selected.misfits.iter().map(|m| m.count).max().unwrap_or(0);
        // Messages have noise of their own beside the rounding of what they tell: it alone is nothing that is missing.
        return match left_over || findings.inexact || findings.sampled && !selection.selected.within(ABOVE_THE_NOISE) {
            _ if rows == 0 || (rows < FEWEST_ROWS && !selection.selected.within(NEAR_THE_NOISE)) => Verdict::NotExcited,
            true => Verdict::Unexplained,
            // What is clean where it was fitted and far off elsewhere was not moved enough to be told.
            false if findings.fits.iter().any(far_off) && findings.followed && selection.selected.within(NEAR_THE_NOISE) => {
                Verdict::NotExcited
            }
            false if findings.sampled && findings.fits.iter().any(far_off) => Verdict::Unexplained,
            false => Verdict::NoMismatch,
        };
    }
    if !findings.fits.iter().any(|f| f.improvement_ci95[0] > 0.0) {
        let clean = selection.selected.within(FAR_ABOVE_THE_NOISE);
        let visible = findings.fits.iter().any(above_the_noise);
        return match findings.sampled {
            true => unconfirmed(library(effects), clean, visible),
            false => unconfirmed_by_messages(findings.refuted, left_over, findings.remainder),
        };
    }
    let unseen = findings.sampled && findings.fits.iter().any(fails_unseen);
    let doubtful = findings.sampled && library(effects) < least_likely(effects, unseen);
    let unexplained = left_over || findings.inexact;
    if doubtful || findings.beyond || unexplained && (findings.remainder > FORM_ERROR || findings.foretold > FORETOLD_WELL) {
        return Verdict::Unexplained;
    }
    if unseen || effects.iter().any(|e| e.confidence < CERTAIN) { Verdict::Ambiguous } else { Verdict::Named }
}

/// What is said of names that held-out signals do not confirm: `known` is how likely it is that they are the library's, `clean` whether
/// the fitted data are explained, and `visible` whether the recalibrated twin is off on the held-out ones.
///
/// Held-out data that part at a bounce or slip a pole speak neither for nor against what the fitted ones leave no doubt of. Where
/// these leave doubts and the twin is off all the same, or where no name is believed, something else is missing. The rest was never
/// moved enough to be told.
fn unconfirmed(known: f64, clean: bool, visible: bool) -> Verdict {
    match known {
        _ if !clean => Verdict::Unexplained,
        _ if known >= CERTAIN => Verdict::Ambiguous,
        _ if visible || known < HARDLY_THE_LIBRARY => Verdict::Unexplained,
        _ => Verdict::NotExcited,
    }
}

/// The same of messages. Where as much as before depends on something, with what was named, that is not what these messages depend on,
/// and they do depend on something.
fn unconfirmed_by_messages(refuted: bool, left_over: bool, remainder: f64) -> Verdict {
    if refuted || left_over && remainder > FORM_ERROR { Verdict::Unexplained } else { Verdict::NotExcited }
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
    use crate::sim2real::Site;
    use crate::sim2real::diagnose::diagnosis::Rival;

    fn effect(confidence: f64, rivals: &[f64]) -> Effect {
        let rival = |c: &f64| Rival { mechanism: "rival".into(), confidence: *c };
        Effect {
            mechanism: "own".into(),
            site: Site::Plant,
            confidence,
            gain: None,
            margin: None,
            parameters: BTreeMap::new(),
            rivals: rivals.iter().map(rival).collect(),
            location: None,
            active: Vec::new(),
            moved: Vec::new(),
        }
    }

    #[test]
    fn a_rival_is_of_the_library_and_many_unsure_names_are_not() {
        assert!((library(&[effect(0.5, &[0.4])]) - 0.9).abs() < 1e-12);
        assert_eq!(library(&[effect(0.6, &[0.6])]), 1.0);
        assert!(library(&[effect(0.9, &[]), effect(0.3, &[]), effect(0.2, &[])]) < HARDLY_THE_LIBRARY);
        assert_eq!(library(&[]), 1.0);
    }

    #[test]
    fn one_name_alone_must_be_likelier_than_not() {
        let says = |effects: &[Effect], unseen: bool| library(effects) >= least_likely(effects, unseen);
        assert!(!says(&[effect(0.4, &[])], false) && says(&[effect(0.4, &[0.2])], false), "its rivals count");
        assert!(says(&[effect(0.4, &[]), effect(0.9, &[])], false), "of several, one may be right");
        assert!(!says(&[effect(0.6, &[])], true) && says(&[effect(0.8, &[])], true), "what fails unseen must be certain");
    }

    #[test]
    fn what_held_out_data_do_not_confirm_is_as_sure_as_the_fitted_ones_make_it() {
        assert_eq!(
            unconfirmed(0.74, true, true),
            Verdict::Ambiguous,
            "an end stop, and a held-out run that parts at a bounce"
        );
        assert_eq!(unconfirmed(0.57, true, true), Verdict::Unexplained, "a shaking that a compliance hardly is");
        assert_eq!(unconfirmed(0.0, true, false), Verdict::Unexplained, "nobody believes it");
        assert_eq!(unconfirmed(0.3, true, false), Verdict::NotExcited, "nothing is off where it was not fitted");
        assert_eq!(unconfirmed(0.9, false, true), Verdict::Unexplained, "what fits neither past nor future");
    }

    #[test]
    fn messages_that_still_depend_on_something_have_not_been_explained() {
        assert_eq!(
            unconfirmed_by_messages(false, true, 1.0),
            Verdict::Unexplained,
            "a dealer that refuses what the market moves against, and a lot size that does not carry over"
        );
        assert_eq!(
            unconfirmed_by_messages(false, true, 0.01),
            Verdict::NotExcited,
            "what depends on something is hardly any"
        );
        assert_eq!(unconfirmed_by_messages(false, false, 1.0), Verdict::NotExcited, "what is left is noise");
        assert_eq!(unconfirmed_by_messages(true, false, 0.0), Verdict::Unexplained);
    }

    #[test]
    fn errors_are_held_to_the_noise_and_to_each_other() {
        let fit = |recalibrated_rmse: f64, trued_rmse: f64| ChannelFit {
            channel: "position".into(),
            unit: "rad".into(),
            noise_floor: 1.0,
            nominal_rmse: 20.0,
            recalibrated_rmse,
            trued_rmse,
            nominal_mae: 20.0,
            recalibrated_mae: recalibrated_rmse,
            trued_mae: trued_rmse,
            improvement_ci95: [0.0, 0.0],
        };
        assert!(worse(&fit(2.0, 2.1)) && !worse(&fit(2.0, 2.0)));
        assert!(above_the_noise(&fit(1.2, 1.0)) && !above_the_noise(&fit(1.05, 1.0)));
        assert!(far_off(&fit(9.0, 3.1)) && !far_off(&fit(9.0, 2.9)));
        assert!(fails_unseen(&fit(9.0, 3.1)), "a tenth of the misfit is left, far above the noise");
        assert!(!fails_unseen(&fit(9.0, 2.9)), "and close to it that is an error of form");
        assert!(fails_unseen(&fit(3.0, 2.0)), "unless it is a third");
    }
}
