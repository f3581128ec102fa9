//! Locate, name, model, prove: what a simulator left out, found from recordings.
//!
//! One file a step, in this order: `evidence` divides the recordings and finds their `noise`; a `hypothesis` is the
//! twin with mechanisms added, and `approach` finds the first of them, with none, its own parameters refitted; `screen` ranks mechanisms
//! by their signatures; `select` fits and compares sets of them, `weigh`ed by the evidence that `whiteness` counts, and `forms` finds
//! for each the form that does best beside the others; `rivals` looks for other names, `carry_over` asks the one recording of
//! what explains little in the other, and `confidence` says how sure one is;
//! `remainder` asks what is left, and `structure` what that depends on; `prove` measures errors on what was held out, `constancy` asks
//! whether the same constants hold there, and `nameless` whether a curve of any shape explains more; the `decision` rests on all of these
//! `findings` and on what `held_out` data say, and `verdict` and `words` tell it. `gates` says how long steps of integration may be, and
//! `recognize` sees what needs no fit. `locate` and `onset` say where and since when the twin is off, `activity` when what was named acted,
//! and `experiment` designs, from the commands of `excitation`, what to record where rivals are left; `unread` asks what the twin does not
//! read of them. Where recordings
//! show several things that no mechanism has in common, each of these `aspects` goes through all of it by itself.

mod activity;
mod approach;
mod aspects;
mod beyond;
mod by_recording;
mod carry_over;
mod changes;
mod confidence;
mod constancy;
mod crossings;
mod decision;
mod diagnosis;
mod effects;
mod evidence;
mod exact;
mod excitation;
mod experiment;
mod findings;
mod forms;
mod free_run;
mod gates;
mod held_out;
mod hypothesis;
mod judged;
mod kin;
mod locate;
mod nameless;
mod needed;
mod no_law;
mod noise;
mod onset;
mod order;
mod periodic;
mod profile;
mod prove;
mod prune;
mod pursue;
mod recognize;
mod record;
mod remainder;
mod rested;
mod rivals;
mod screen;
mod screening;
mod search;
mod select;
mod selection;
mod settle;
mod structure;
mod uncertainty;
mod unread;
mod verdict;
mod weigh;
mod whiteness;
mod words;

pub use diagnosis::{
    Bin, Change, ChannelFit, Checks, ColumnSplit, Diagnosis, Effect, Estimate, Interval, Moved, NextExperiment,
    ParameterChange, RecordingError, Rival, SCHEMA, Score, Stretch, Verdict, Where,
};
pub use evidence::{Evidence, HELD_OUT, settled};
pub use excitation::Excitation;
pub use experiment::EXPERIMENT_FILE;
pub use hypothesis::Hypothesis;
pub use noise::channel_weights;
pub use profile::Profile;
pub use unread::Unread;

use nalgebra::DMatrix;

use hypothesis::Inquiry;
use judged::Judged;
use prove::Contest;
use rivals::Place;
use selection::Selection;

use super::any_twin::{AnyStimulus, AnyTwin, any_recordings};
use super::{Candidate, ChannelWeight, Clock, Recording, Seed, Signs, Simulator, Twin};

/// Told of each step: what is done, and how many steps of how many lie behind it.
pub type Progress<'a> = &'a (dyn Fn(&str, usize, usize) + Sync);

/// One channel of one recording beside what the three twins say of it, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The recording.
    pub recording: String,
    /// Whether no fit saw these rows.
    pub held_out: bool,
    /// What makes the clock tick.
    pub clock: Clock,
    /// The channel.
    pub channel: String,
    /// Its unit.
    pub unit: String,
    /// Time of each row [s].
    pub time: Vec<f64>,
    /// What was measured; none where the sample was lost.
    pub measured: Vec<Option<f64>>,
    /// The twin as given.
    pub nominal: Vec<f64>,
    /// The twin with its own parameters refitted.
    pub recalibrated: Vec<f64>,
    /// The twin with what was found added.
    pub trued: Vec<f64>,
}

/// A diagnosis, the twin it leads to, and what to plot.
#[derive(Debug, Clone)]
pub struct Outcome<T> {
    /// What was found.
    pub diagnosis: Diagnosis,
    /// The twin with what was found added.
    pub trued: T,
    /// Values of the trued twin's parameters, in their order.
    pub values: Vec<f64>,
    /// Their standard deviations.
    pub std: Vec<f64>,
    /// Their correlations; 0 where no fit tells.
    pub correlation: DMatrix<f64>,
    /// Measurements beside the three twins.
    pub comparisons: Vec<Comparison>,
    /// Errors over the states they may depend on.
    pub profiles: Vec<Profile>,
    /// The commands of the next experiment, where one was designed.
    pub excitation: Option<Excitation>,
}

/// A twin refitted, with nothing added.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// Values of its parameters, in their order.
    pub values: Vec<f64>,
    /// Their standard deviations.
    pub std: Vec<f64>,
    /// Their correlations; 0 where no fit tells.
    pub correlation: DMatrix<f64>,
    /// Names of the parameters that ended at a bound.
    pub at_bound: Vec<String>,
    /// Errors on held-out data; the trued twin is the recalibrated one.
    pub fit: Vec<ChannelFit>,
    /// How the held-out data were chosen, in words.
    pub held_out: String,
    /// Measurements beside the twin as given and refitted.
    pub comparisons: Vec<Comparison>,
}

/// Finds what `twin` leaves out, from `recordings`; `held_out` are for proof alone, and where there are none, the last
/// [`HELD_OUT`] of each recording is.
#[must_use]
pub fn diagnose<T: Twin>(
    twin: &T,
    recordings: &[Recording<T::Stimulus>],
    held_out: &[Recording<T::Stimulus>],
    seed: Seed,
    progress: Progress<'_>,
) -> Outcome<T> {
    diagnose_beside(twin, recordings, held_out, &[], seed, progress)
}

/// The same, where the recordings have columns that the twin does not read: those that tell where it errs are told.
#[must_use]
pub fn diagnose_beside<T: Twin>(
    twin: &T,
    recordings: &[Recording<T::Stimulus>],
    held_out: &[Recording<T::Stimulus>],
    unread: &[Unread],
    seed: Seed,
    progress: Progress<'_>,
) -> Outcome<T> {
    let aspects = aspects::split(twin, recordings, held_out);
    let mut each = aspects.iter().map(|aspect| of_one(twin, &aspect.recordings, &aspect.held_out, unread, seed, progress));
    match each.next() {
        Some(first) => aspects::joined(twin, first, each.collect()),
        None => of_one(twin, recordings, held_out, unread, seed, progress).outcome,
    }
}

/// What was found of one aspect.
pub(super) struct Answered<T> {
    outcome: Outcome<T>,
    /// What was added to the twin, in the order of its parameters.
    added: Vec<Candidate>,
    facts: words::Facts,
}

impl Answered<AnyTwin> {
    /// The answer to the twin `like` it was asked of.
    fn of_its_kind<T: Twin>(self, like: &T) -> Answered<T> {
        let Self { outcome, added, facts } = self;
        let Outcome { diagnosis, trued, values, std, correlation, comparisons, profiles, excitation } = outcome;
        let trued = trued.of_its_kind(like);
        let outcome = Outcome { diagnosis, trued, values, std, correlation, comparisons, profiles, excitation };
        Answered { outcome, added, facts }
    }
}

/// The same of recordings that show one thing.
fn of_one<T: Twin>(
    twin: &T,
    recordings: &[Recording<T::Stimulus>],
    held_out: &[Recording<T::Stimulus>],
    unread: &[Unread],
    seed: Seed,
    progress: Progress<'_>,
) -> Answered<T> {
    let signs = recognize::signs(twin, recordings);
    let lost = recognize::lost(twin, recordings);
    let of_steps = twin.recognized(&Signs { repeated: 0.0, run: 0.0, ..signs });
    let found = Found { signs, of: twin.recognized(&signs), of_steps, lost, unread };
    let channel = twin.channels().first().map(|c| c.name.clone()).unwrap_or_default();
    let cleaned =
        (signs.repeated > 0.0).then(|| [recordings, held_out].map(|all| recognize::without_repeats(twin, all, &channel)));
    let [recordings, held_out] = cleaned.as_ref().map_or([recordings, held_out], |all| all.each_ref().map(Vec::as_slice));
    answered(&twin.quiet().rounding(false), recordings, held_out, &found, seed, progress)
}

/// What the recordings show by themselves.
pub(super) struct Found<'a> {
    signs: Signs,
    of: Vec<Candidate>,
    /// Those that would be recognized if no sample had been lost.
    of_steps: Vec<Candidate>,
    /// When samples were lost.
    lost: Vec<Stretch>,
    /// What the twin does not read of them.
    unread: &'a [Unread],
}

/// The same of a twin that is followed, beside what was found without following it.
fn answered<T: Twin>(
    twin: &T,
    recordings: &[Recording<T::Stimulus>],
    held_out: &[Recording<T::Stimulus>],
    found: &Found<'_>,
    seed: Seed,
    progress: Progress<'_>,
) -> Answered<T> {
    let [recordings, held_out] = [recordings, held_out].map(any_recordings);
    followed(&AnyTwin::new(twin.clone()), &recordings, &held_out, found, seed, progress).of_its_kind(twin)
}

/// The same of a twin of any kind: with recordings as they are stamped and, where they ask for it, as they were made.
fn followed(
    twin: &AnyTwin,
    recordings: &[Recording<AnyStimulus>],
    held_out: &[Recording<AnyStimulus>],
    found: &Found<'_>,
    seed: Seed,
    progress: Progress<'_>,
) -> Answered<AnyTwin> {
    let (as_stamped, asked_for) = as_stamped(twin, recordings, held_out, found, seed, progress);
    let Some(candidate) = asked_for else { return as_stamped };
    let (corrected, _) = self::as_stamped(&twin.with(&candidate), recordings, held_out, found, seed, progress);
    record::better(as_stamped, corrected, &candidate)
}

/// The answer where nothing but what the twin models was done to recordings, and what of the record they ask for beside it.
fn as_stamped(
    twin: &AnyTwin,
    recordings: &[Recording<AnyStimulus>],
    held_out: &[Recording<AnyStimulus>],
    found: &Found<'_>,
    seed: Seed,
    progress: Progress<'_>,
) -> (Answered<AnyTwin>, Option<Candidate>) {
    progress("dividing the recordings", 0, 1);
    let evidence = Evidence::divide(twin, recordings, held_out);
    let candidates = recognize::fixed(twin.candidates(recordings));
    let free_run = evidence.in_free_run();
    let mut inquiry = Inquiry { twin, candidates: &candidates, evidence: &free_run, seed };
    let (mut selection, mut rivals, on_windows) = search::searched(&inquiry, &evidence, progress);
    if on_windows {
        inquiry.evidence = &evidence;
    }
    if let Some((beneath, places)) = crossings::beneath(&inquiry, &selection, [recordings, held_out], found, progress) {
        inquiry.evidence = &free_run;
        (selection, rivals) = (beneath.seen(&inquiry), places);
    }
    selection.mark_accepted(&candidates);
    let mut selection = recognize::finished(&inquiry, selection, &mut rivals);
    let asked_for = record::asked_for(&inquiry, &selection.selected, recordings);
    progress("proving on held-out data", 0, 1);
    let covariates = locate::covariates(&inquiry);
    let judged = |selection: &Selection<AnyTwin>, places: &[Place]| {
        judged::judged(&inquiry, selection, places, recordings, &covariates)
    };
    let mut judgement = judged(&selection, &rivals);
    // What held-out data do not confirm does not unsay what is seen without a fit: it is said without it.
    if found.signs.repeated > 0.0 && judgement.of_fitted_rows_alone() {
        let unconfirmed = judgement.unconfirmed(&inquiry);
        rivals.clear();
        selection = recognize::finished(&inquiry, selection.bare(), &mut rivals);
        judgement = judged(&selection, &rivals);
        judgement.diagnosis.checks.notes.push(unconfirmed);
    }
    let Judged { comparisons, trued, findings, mut diagnosis } = judgement;
    // What the fit has named already need not be recognized besides.
    let named: Vec<&str> = selection.selected.added.iter().map(|number| candidates[*number].about.name).collect();
    let seen: Vec<&Candidate> = found.of.iter().filter(|c| !named.contains(&c.about.name)).collect();
    verdict::recognized(&mut diagnosis, &inquiry, found, &seen);
    progress("saying where", 0, 1);
    diagnosis.location = locate::located(&inquiry, &selection.recalibrated, &covariates);
    if diagnosis.verdict != Verdict::NoMismatch {
        diagnosis.location.columns = unread::splits(&inquiry, &selection.recalibrated, &covariates, found.unread);
    }
    diagnosis.location.recordings = by_recording::by_recording(&comparisons);
    let activities = activity::activities(&inquiry, &selection.selected, &trued, &covariates);
    activity::tell(&mut diagnosis, &inquiry, &selection.selected, activities);
    let profiles = profile::profiles(&inquiry, &selection.recalibrated, &selection.selected, &covariates);
    progress("designing the next experiment", 0, 1);
    let next = experiment::next(&inquiry, &selection, &rivals, diagnosis.verdict, &diagnosis.effects);
    let excitation = next.and_then(|(next, excitation)| {
        diagnosis.next_experiment = Some(next);
        excitation
    });
    let facts = verdict::facts(&inquiry, &findings);
    let mut added: Vec<Candidate> = selection.selected.added.iter().map(|number| candidates[*number].clone()).collect();
    let mut correlation = trued.correlation(selection.selected.twin.parameters());
    let (mut trued_twin, mut values, mut std) =
        (selection.selected.twin.rounding(true), findings.trued.values, findings.std);
    for candidate in seen {
        trued_twin = trued_twin.with(candidate);
        values.extend(candidate.form.parameters.iter().map(|p| p.nominal));
        std.resize(values.len(), 0.0);
        added.push(candidate.clone());
    }
    // What was seen without a fit goes with nothing else.
    let fitted = correlation.nrows();
    correlation = correlation.resize(values.len(), values.len(), 0.0);
    (fitted..values.len()).for_each(|k| correlation[(k, k)] = 1.0);
    let outcome = Outcome { diagnosis, trued: trued_twin, values, std, correlation, comparisons, profiles, excitation };
    (Answered { outcome, added, facts }, asked_for)
}

/// Refits the parameters that `twin` has, and adds nothing.
#[must_use]
pub fn calibrate<T: Twin>(
    twin: &T,
    recordings: &[Recording<T::Stimulus>],
    held_out: &[Recording<T::Stimulus>],
    seed: Seed,
    progress: Progress<'_>,
) -> Calibration {
    let [recordings, held_out] = [recordings, held_out].map(any_recordings);
    refitted(&AnyTwin::new(twin.quiet().rounding(false)), &recordings, &held_out, seed, progress)
}

/// The same of a twin of any kind.
fn refitted(
    twin: &AnyTwin,
    recordings: &[Recording<AnyStimulus>],
    held_out: &[Recording<AnyStimulus>],
    seed: Seed,
    progress: Progress<'_>,
) -> Calibration {
    progress("fitting", 0, 1);
    let evidence = Evidence::divide(twin, recordings, held_out);
    let inquiry = Inquiry { twin, candidates: &[], evidence: &evidence, seed };
    let hypothesis = inquiry.recalibrated();
    let fit = inquiry.in_free_run(&hypothesis);
    let given: Vec<f64> = twin.parameters().iter().map(|p| p.nominal).collect();
    let contest = Contest { nominal: (twin, &given), recalibrated: (twin, &fit.values), trued: (twin, &fit.values) };
    let comparisons = prove::compared(&contest, &evidence, seed);
    Calibration {
        std: uncertainty::inflated(&inquiry, &hypothesis, &fit),
        correlation: fit.correlation(twin.parameters()),
        at_bound: fit.at_bound.iter().map(|k| twin.parameters()[*k].name.clone().into_owned()).collect(),
        values: fit.values,
        fit: prove::channel_fits(&comparisons, &noise_of(&inquiry, &hypothesis), seed),
        held_out: evidence.how.clone(),
        comparisons,
    }
}

/// The noise of every channel, of the colour that the residuals of `hypothesis` have.
fn noise_of<T: Twin>(inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>) -> Vec<ChannelWeight> {
    let level = |channel: &str| hypothesis.misfits.iter().find(|m| m.channel == channel).map_or(1.0, |m| m.level);
    let weights = inquiry.evidence.weights.iter();
    weights.map(|w| ChannelWeight { channel: w.channel.clone(), noise: w.noise * level(&w.channel).sqrt() }).collect()
}
