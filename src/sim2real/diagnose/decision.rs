//! The decision: named, ambiguous, unexplained, not excited or no mismatch.

use super::Comparison;
use super::diagnosis::{ChannelFit, Effect, Score, Verdict};
use super::held_out::{
    FAR_ABOVE_THE_NOISE, FORM_ERROR, HARDLY_ABOVE, better, confirms, fails_unseen, far_off, grown, held_out_remainder,
    leaves_more, visible, worse,
};
use super::hypothesis::{Hypothesis, Inquiry};
use super::locate::Covariates;
use super::periodic;
use super::remainder::{NEAR_THE_NOISE, dependences, strongest};
use super::selection::Selection;
use super::structure::{DEPENDENT, Dependence};
use crate::sim2real::identify::Fit;
use crate::sim2real::{Clock, Twin};

/// A residual counts as structured where a regression foretells this part of it on held-out data.
pub(super) const FORETOLD: f64 = 0.10;
/// Where this part of it is foretold, what is left is physics, however small it is beside what was found, ...
const FORETOLD_WELL: f64 = 0.25;
/// ... but for less than this part of the misfit: a law whose form is off by a fifteenth leaves as much, and the motion foretells that.
const OF_ANY_FORM: f64 = 0.005;
/// A twin to which nothing can be added and whose mean squared residual is this many times the noise lacks something unknown.
pub(super) const ABOVE_THE_NOISE: f64 = 2.0;
/// So does what is slower than noise, so many rows and more, and leaves this many times the noise.
const SLOW: f64 = 5.0;
const SLOWLY_ABOVE: f64 = 1.3;
/// Beside what was named that counts from this many times the noise on: it was fitted to leave as little as it can.
pub(super) const SLOWLY_LEFT: f64 = 1.1;
/// With fewer rows than this, what is not explained is not called explained either.
pub(super) const FEWEST_ROWS: usize = 50;
/// What is less likely than this to be the library's is not said to be.
const HARDLY_THE_LIBRARY: f64 = 0.1;
/// The same of a single name, and of what does not carry over to held-out data either.
const LIKELIER_THAN_NOT: f64 = 0.5;
/// Evidence above this [twice a log-likelihood] leaves no doubt of what messages are off by, though too few of those held out tell of it, nor
/// that signals hold more than was named. Delays found in stamps that were cut to a second, where nothing is missing, come to 80 (development
/// seeds 41 to 46).
const OVERWHELMING: f64 = 200.0;
/// A name less certain than this is ambiguous.
const CERTAIN: f64 = 0.7;
/// What held-out data do not confirm must be this certain.
const CERTAIN_UNCONFIRMED: f64 = 0.8;

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
    /// What the recordings say against what they are taken to have begun with, where nothing was named.
    pub contradiction: Option<String>,
    /// What says that a name is that of nothing that is there.
    pub belied: Option<String>,
    /// Whether no more than a few of the held-out rows could tell of what was named.
    pub few_tell: bool,
    /// Whether what was named of messages is refuted by others, though something is missing.
    pub refuted: bool,
    /// Whether something that no law knows explains more of messages than what was named.
    pub of_no_law: bool,
}

/// Whether what was named of messages does worse than nothing on those held out, while without it they depend on something: what was
/// fitted is not what is missing.
pub(super) fn refuted<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selection: &Selection<T>,
    fits: &[ChannelFit],
    covariates: &Covariates,
) -> bool {
    let messages = inquiry.twin.clock() == Clock::Event && !selection.selected.added.is_empty();
    messages
        && !fits.iter().any(|fit| fit.improvement_ci95[0] > 0.0)
        && fits.iter().any(worse)
        && strongest(&dependences(inquiry, &selection.recalibrated, covariates)).is_some_and(|d| d.strength > DEPENDENT)
}

/// What the recordings say against what they are taken to have begun with, or that something shakes what was recorded, where nothing else
/// was found that could be it.
pub(super) fn contradiction<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selected: &Hypothesis<T>,
    comparisons: &[Comparison],
) -> Option<String> {
    if !selected.added.is_empty() {
        return None;
    }
    let mut begun = inquiry.evidence.compared.iter().zip(&selected.fit.state.values);
    begun
        .find_map(|(part, values)| inquiry.twin.contradicts(part.recording, values))
        .or_else(|| periodic::swing(comparisons))
}

/// Whether something else still gains so much beside what was `named`, so many, that no doubt of it is left, small as it may be.
fn asks_for_more(named: usize, scores: &[Score]) -> bool {
    let beside = scores.iter().filter(|score| score.stage == named && !score.accepted);
    beside.filter_map(|score| score.gain).any(|gain| gain > OVERWHELMING)
}

fn structured(findings: &Findings) -> bool {
    findings.foretold > FORETOLD || findings.dependence.as_ref().is_some_and(|d| d.strength > DEPENDENT)
}

/// Whether the motion foretells so much of what is left that it is physics, and that is more than any form leaves.
fn foretold_well(foretold: f64, fits: &[ChannelFit]) -> bool {
    foretold > FORETOLD_WELL && fits.iter().any(|fit| held_out_remainder(fit) > OF_ANY_FORM)
}

/// The probability that everything named, or one of its rivals each time, is what is missing: the more that is named and
/// the less sure, the likelier it is that all of it stands for one thing that is in no registry.
fn library(effects: &[Effect]) -> f64 {
    effects.iter().map(right_or_rival).product()
}

/// The probability that a name or one of its rivals is right.
fn right_or_rival(effect: &Effect) -> f64 {
    (effect.confidence + effect.rivals.iter().map(|rival| rival.confidence).sum::<f64>()).min(1.0)
}

/// Whether of several names none is sure, nor has the right one among its rivals: if more than noise is left where they were not fitted, all
/// of them together stand for something that is in no registry.
fn none_sure(effects: &[Effect]) -> bool {
    effects.len() > 1 && effects.iter().all(|effect| right_or_rival(effect) < CERTAIN_UNCONFIRMED)
}

/// What of the first misfit may be left for an error of form. What the motion foretells of the rest is physics: it is excused as that of
/// a law's form only as far as it is likely that the law is the right one.
fn form_error(library: f64, foretold: f64, sampled: bool) -> f64 {
    if sampled && foretold > FORETOLD { FORM_ERROR * library } else { FORM_ERROR }
}

/// How likely it must be at least that what was named is the library's; `unseen` is whether it fails on held-out data.
fn least_likely(effects: &[Effect], unseen: bool) -> f64 {
    match effects {
        // What the fitted data leave no doubt of is right although its form does not carry over to others.
        _ if unseen => CERTAIN_UNCONFIRMED,
        // One name alone is right or it is not; of several each may be, with another of the others.
        [_] => LIKELIER_THAN_NOT,
        _ => HARDLY_THE_LIBRARY,
    }
}

/// What is to be said.
pub(super) fn decide<T>(selection: &Selection<T>, effects: &[Effect], findings: &Findings) -> Verdict {
    let floor = |times: f64| selection.selected.misfits.iter().all(|m| m.within(times, 1.0));
    // Of messages it is known of which of them it is asked.
    let left_over = structured(findings) && (!findings.sampled || !selection.selected.within(HARDLY_ABOVE))
        || findings.foretold > FORETOLD_WELL && !floor(HARDLY_ABOVE);
    if effects.is_empty() {
        let rows: usize = selection.selected.misfits.iter().map(|m| m.count).max().unwrap_or(0);
        // Messages have noise of their own beside the rounding of what they tell: it alone is nothing that is missing.
        let above = !selection.selected.within(ABOVE_THE_NOISE) || slowly_above(&selection.selected, SLOWLY_ABOVE);
        let known = left_over || findings.inexact || findings.contradiction.is_some();
        return match known || findings.sampled && above {
            _ if rows == 0 || (rows < FEWEST_ROWS && !selection.selected.within(NEAR_THE_NOISE)) => Verdict::NotExcited,
            true => Verdict::Unexplained,
            false => unseen_there(&selection.selected, findings),
        };
    }
    if findings.of_no_law || findings.belied.is_some() {
        return Verdict::Unexplained;
    }
    if !findings.fits.iter().any(|fit| confirms(fit, findings.sampled)) {
        let visible = findings.fits.iter().any(|fit| visible(fit, &selection.selected));
        // What those held out do not confirm must be all that the fitted ones ask for.
        let clean = selection.selected.within(FAR_ABOVE_THE_NOISE)
            && !(visible && asks_for_more(selection.selected.added.len(), &selection.scores));
        return match findings.sampled {
            true if !visible && findings.fits.iter().any(|fit| fit.improvement_ci95[1] < 0.0) => Verdict::NotExcited,
            true => unconfirmed(library(effects), clean, visible),
            false if !findings.refuted && findings.few_tell && overwhelming(effects) && better(&findings.fits) => {
                Verdict::Ambiguous
            }
            false => unconfirmed_by_messages(findings.refuted, left_over, findings.remainder),
        };
    }
    let unseen = findings.sampled && findings.fits.iter().any(fails_unseen);
    let none_sure = none_sure(effects) && findings.fits.iter().any(|fit| leaves_more(fit, &selection.selected));
    let doubtful = findings.sampled && (none_sure || library(effects) < least_likely(effects, unseen));
    let unexplained = left_over || findings.inexact || findings.sampled && slowly_above(&selection.selected, SLOWLY_LEFT);
    let too_much = findings.remainder > form_error(library(effects), findings.foretold, findings.sampled)
        || foretold_well(findings.foretold, &findings.fits);
    if doubtful || findings.beyond || unexplained && too_much {
        return Verdict::Unexplained;
    }
    if unseen || effects.iter().any(|e| e.confidence < CERTAIN) { Verdict::Ambiguous } else { Verdict::Named }
}

/// Whether there is no doubt of anything that was named.
fn overwhelming(effects: &[Effect]) -> bool {
    effects.iter().all(|effect| effect.gain.is_some_and(|gain| gain > OVERWHELMING))
}

/// Whether more than so many times the noise is left of a channel, and slower than noise.
pub(super) fn slowly_above<T>(selected: &Hypothesis<T>, times: f64) -> bool {
    selected.misfits.iter().any(|m| !m.within(times, m.level) && m.autocorrelation_time > SLOW)
}

/// What is said where the fitted data show nothing, of what held-out ones show.
///
/// What is clean where it was fitted and off elsewhere was not moved enough to be told. But noise of signals is no louder where a plant is
/// moved otherwise: what went for noise of another colour, though it is not of one alone, and grows, is something unknown. So is what
/// windows do not show and a free run does not follow, if it grows.
fn unseen_there<T>(selected: &Hypothesis<T>, findings: &Findings) -> Verdict {
    let clean = findings.followed && selected.within(NEAR_THE_NOISE);
    let coloured = selected.misfits.iter().any(|misfit| misfit.level > 1.0 && !misfit.one_colour);
    let grown = findings.sampled && findings.fits.iter().any(|fit| grown(fit, selected));
    match (findings.fits.iter().any(far_off), grown) {
        (true, _) if clean => Verdict::NotExcited,
        (true, _) if findings.sampled => Verdict::Unexplained,
        (false, true) if clean && !coloured => Verdict::NotExcited,
        (false, true) => Verdict::Unexplained,
        (false, false) | (true, _) => Verdict::NoMismatch,
    }
}

/// What is said of names that held-out signals do not confirm, nor refute where nothing is off there: `known` is how likely it is that
/// they are the library's, `clean` whether the fitted data are explained, and `visible` whether the recalibrated twin is off on the
/// held-out ones.
///
/// Held-out data that part at a bounce or slip a pole speak neither for nor against what the fitted ones leave no doubt of. Where
/// these leave doubts and the twin is off all the same, or where no name is believed, something else is missing. The rest was never
/// moved enough to be told.
fn unconfirmed(known: f64, clean: bool, visible: bool) -> Verdict {
    match known {
        _ if !clean => Verdict::Unexplained,
        _ if known >= CERTAIN_UNCONFIRMED => Verdict::Ambiguous,
        _ if visible || known < HARDLY_THE_LIBRARY => Verdict::Unexplained,
        _ => Verdict::NotExcited,
    }
}

/// The same of messages. Where as much as before depends on something, with what was named, that is not what these messages depend on,
/// and they do depend on something.
fn unconfirmed_by_messages(refuted: bool, left_over: bool, remainder: f64) -> Verdict {
    if refuted || left_over && remainder > FORM_ERROR { Verdict::Unexplained } else { Verdict::NotExcited }
}

#[cfg(test)]
mod tests {
    use super::super::held_out::tests::error;
    use super::*;
    use std::collections::BTreeMap;

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

    /// A bent shaft, told as a cogging, an eccentricity and an end stop.
    #[test]
    fn of_several_names_one_at_least_is_sure() {
        assert!(none_sure(&[effect(0.65, &[]), effect(0.63, &[]), effect(0.59, &[])]));
        assert!(!none_sure(&[effect(0.85, &[]), effect(0.14, &[])]), "one is");
        assert!(!none_sure(&[effect(0.57, &[0.3]), effect(0.24, &[])]), "or has the right one beside it");
        assert!(!none_sure(&[effect(0.6, &[])]), "a single name is asked for less");
    }

    #[test]
    fn what_the_motion_foretells_is_excused_as_far_as_the_names_are_likely() {
        let two_unsure = library(&[effect(0.55, &[]), effect(0.4, &[])]);
        assert!((form_error(two_unsure, 0.12, true) - 0.22 * FORM_ERROR).abs() < 1e-12);
        assert_eq!(form_error(library(&[effect(0.6, &[0.4])]), 0.12, true), FORM_ERROR, "one of them it is");
        assert_eq!(form_error(two_unsure, 0.08, true), FORM_ERROR, "nothing foretells it");
        assert_eq!(form_error(two_unsure, 0.12, false), FORM_ERROR, "of messages it is known what is asked");
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
            unconfirmed(0.87, true, true),
            Verdict::Ambiguous,
            "an end stop, and a held-out run that parts at a bounce"
        );
        assert_eq!(unconfirmed(0.59, true, true), Verdict::Unexplained, "a shaking that a compliance hardly is");
        assert_eq!(unconfirmed(0.0, true, false), Verdict::Unexplained, "nobody believes it");
        assert_eq!(unconfirmed(0.3, true, false), Verdict::NotExcited, "nothing is off where it was not fitted");
        assert_eq!(unconfirmed(0.9, false, true), Verdict::Unexplained, "what fits neither past nor future");
    }

    /// A friction of one direction, told as a gain of one side: the fit of both recordings asks for a third law, of little.
    #[test]
    fn what_still_gains_beyond_doubt_is_asked_for_however_little_it_is() {
        let score = |stage: usize, gain: Option<f64>, accepted: bool| Score {
            mechanism: "load_friction".into(),
            form: "even".into(),
            stage,
            screen: 0.3,
            survival: 0.2,
            excited: true,
            gain,
            accepted,
        };
        assert!(asks_for_more(1, &[score(0, Some(900.0), true), score(1, None, false), score(1, Some(415.0), false)]));
        assert!(!asks_for_more(
            1,
            &[score(0, Some(900.0), true), score(0, Some(880.0), false), score(1, Some(80.0), false)]
        ));
        assert!(!asks_for_more(2, &[score(1, Some(415.0), true)]), "what was named is not asked for");
    }

    #[test]
    fn noise_is_no_louder_elsewhere() {
        use crate::sim2real::diagnose::weigh::tests::leaving;
        let findings = |held_out: f64| Findings {
            fits: vec![error(held_out.sqrt(), held_out.sqrt())],
            placebo_p: None,
            remainder: 0.0,
            followed: true,
            dependence: None,
            foretold: 0.0,
            std: Vec::new(),
            trued: leaving(1.0, 6_000.0).fit,
            sampled: true,
            inexact: false,
            beyond: false,
            contradiction: None,
            belied: None,
            few_tell: false,
            refuted: false,
            of_no_law: false,
        };
        let white = leaving(1.0, 6_000.0);
        assert_eq!(unseen_there(&white, &findings(1.2)), Verdict::NoMismatch);
        assert_eq!(
            unseen_there(&white, &findings(1.5)),
            Verdict::NotExcited,
            "a saturation that is reached elsewhere alone"
        );
        // What a floor of 1 stands for is the noise with its colour.
        let mut coloured = leaving(7.0, 400.0);
        (coloured.misfits[0].level, coloured.misfits[0].one_colour) = (7.0, false);
        assert_eq!(unseen_there(&coloured, &findings(1.3)), Verdict::NoMismatch, "of so few it may be chance");
        assert_eq!(unseen_there(&coloured, &findings(1.9)), Verdict::Unexplained, "a bent shaft, and no noise");
        assert_eq!(unseen_there(&coloured, &findings(50.0)), Verdict::NotExcited, "a pole that slips");
        coloured.misfits[0].one_colour = true;
        assert_eq!(
            unseen_there(&coloured, &findings(1.9)),
            Verdict::NotExcited,
            "noise, and a limit that is hardly reached"
        );
        let astray = |held_out: f64| Findings { followed: false, ..findings(held_out) };
        assert_eq!(
            unseen_there(&white, &astray(7.6)),
            Verdict::Unexplained,
            "a supply that sags, which windows do not show"
        );
        assert_eq!(unseen_there(&white, &astray(1.2)), Verdict::NoMismatch);
        assert!(slowly_above(&leaving(1.4, 400.0), SLOWLY_ABOVE), "a base that shakes a little");
        assert!(!slowly_above(&leaving(1.4, 3_000.0), SLOWLY_ABOVE), "and noise that hardly remembers itself");
    }

    #[test]
    fn what_is_foretold_is_physics_unless_any_form_leaves_as_much() {
        assert!(foretold_well(0.4, &[error(20.0, 3.0)]), "a fiftieth of the misfit");
        assert!(!foretold_well(0.4, &[error(40.0, 1.9)]), "a delay that wobbles, in a thousandth");
        assert!(!foretold_well(0.2, &[error(20.0, 3.0)]), "and noise");
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
    fn what_is_overwhelming_is_so_of_every_name() {
        let sure = |gain: f64| Effect { gain: Some(gain), ..effect(1.0, &[]) };
        assert!(
            overwhelming(&[sure(400.0)]) && !overwhelming(&[sure(400.0), sure(80.0)]) && !overwhelming(&[effect(1.0, &[])])
        );
    }
}
