//! What a diagnosis says, in the form `diagnosis.json` has.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Deserializer, Serialize};

use crate::sim2real::Site;

/// The schema `diagnosis.json` names.
pub const SCHEMA: &str = "trueup.diagnosis/1";

/// The answer, in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The missing mechanisms are named, and the trued twin explains data it has not seen.
    Named,
    /// Something is missing, but these data do not tell which of the listed mechanisms it is.
    Ambiguous,
    /// The twin explains the recordings, at most after its own parameters are refitted.
    NoMismatch,
    /// Something is missing that none of the known mechanisms explains.
    Unexplained,
    /// The recordings do not move the system enough to tell.
    NotExcited,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Named => "named",
            Self::Ambiguous => "ambiguous",
            Self::NoMismatch => "no_mismatch",
            Self::Unexplained => "unexplained",
            Self::NotExcited => "not_excited",
        })
    }
}

/// The whole result. Field by field it is `diagnosis.json`; `scores` and `modelled` are additions to its schema.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// [`SCHEMA`].
    pub schema: String,
    /// The answer, in one word.
    pub verdict: Verdict,
    /// The answer, in one sentence a person can act on.
    pub summary: String,
    /// What was found, most certain first.
    pub effects: Vec<Effect>,
    /// Where model and recording part, before anything is named.
    #[serde(rename = "where")]
    pub location: Where,
    /// The twin's own parameters, refitted together with what was found.
    pub parameters: BTreeMap<String, ParameterChange>,
    /// Errors per channel, all on held-out data.
    pub fit: Vec<ChannelFit>,
    /// What speaks for and against the answer.
    pub checks: Checks,
    /// What to record next, where these data cannot tell.
    pub next_experiment: Option<NextExperiment>,
    /// How each mechanism that was tried did, best first.
    pub scores: Vec<Score>,
    /// What the twin already modelled.
    pub modelled: Vec<String>,
    /// How the held-out data were chosen, in words.
    pub held_out: String,
}

/// A mechanism that was found to be missing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// Its id.
    pub mechanism: String,
    /// Where it acts.
    pub site: Site,
    /// Probability that the name is right, from 0 to 1.
    pub confidence: f64,
    /// Evidence that would be lost without it: `N_e ln(RSS0 / RSS1) - dk ln N_e`, about twice the logarithm of a likelihood
    /// ratio. None for what is seen without a fit.
    #[serde(default)]
    pub gain: Option<f64>,
    /// Evidence by which the nearest of all rivals that were tried falls behind; none where there was none to try.
    #[serde(default)]
    pub margin: Option<f64>,
    /// Its fitted parameters.
    pub parameters: BTreeMap<String, Estimate>,
    /// What else it might be.
    pub rivals: Vec<Rival>,
    /// When it acted, in words: `|velocity| < 0.05 rad/s`, `from 12.4 s on`, `throughout`; none where nothing separates the
    /// moments at which it did.
    #[serde(rename = "where")]
    pub location: Option<String>,
    /// When it acted in the fitted recordings, where it acts at times only.
    #[serde(default)]
    pub active: Vec<Stretch>,
    /// By how much it moved each channel there.
    #[serde(default)]
    pub moved: Vec<Moved>,
}

/// A stretch of time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stretch {
    /// The recording it lies in.
    pub recording: String,
    /// Start [s].
    pub start: f64,
    /// End [s].
    pub end: f64,
}

/// By how much a mechanism moved a channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    /// The channel.
    pub channel: String,
    /// Root mean square of what following the fitted recordings without it, all else equal, changes, in `unit`.
    pub rms: f64,
    /// The channel's unit.
    pub unit: String,
}

/// A fitted value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The value, in `unit`.
    pub value: f64,
    /// Its standard deviation, in `unit`.
    #[serde(deserialize_with = "without_bound")]
    pub std: f64,
    /// Its unit.
    pub unit: String,
}

/// A mechanism that explains the data nearly as well as the one named.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rival {
    /// Its id.
    pub mechanism: String,
    /// Probability that it is the right name instead.
    pub confidence: f64,
}

/// Where the recalibrated twin and the recording part.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Where {
    /// The worst stretches of time, worst first.
    pub intervals: Vec<Interval>,
    /// When it began [s], where it did not from the start.
    pub onset: Option<f64>,
    /// When the error grew or shrank for good, in order of time.
    #[serde(default)]
    pub changes: Vec<Change>,
    /// The states that hold most of the error, the most telling first.
    #[serde(default)]
    pub against: Vec<Bin>,
    /// Columns that the twin does not read and that tell when its parameters are others, the most telling first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub columns: Vec<ColumnSplit>,
    /// Where there are several recordings, the errors of each on held-out data.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub recordings: Vec<RecordingError>,
}

/// A column that the twin does not read: with parameters of its own on either side of a value of it, it would err far less.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ColumnSplit {
    /// The column.
    pub column: String,
    /// The value, in the column's unit.
    pub at: f64,
    /// The part, from 0 to 1, of the recalibrated twin's squared error above the noise that two sets of parameters explain, in windows that
    /// start afresh.
    pub explains: f64,
}

/// A time from which on the recalibrated twin errs more, or less, than before.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// The channel.
    pub channel: String,
    /// The recording.
    pub recording: String,
    /// When [s].
    pub time: f64,
    /// Root mean square error after it over that before it.
    pub factor: f64,
}

/// How far a channel of one recording is off on held-out data, before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordingError {
    /// The recording: of orders the log, and the symbol where a log is of several.
    pub recording: String,
    /// The channel.
    pub channel: String,
    /// Its unit, and that of all errors.
    pub unit: String,
    /// Rows with a sample.
    pub rows: usize,
    /// The part of the channel's squared error that lies within, from 0 to 1, of the recalibrated twin.
    pub share_of_error: f64,
    /// Root mean square error of the twin as given.
    #[serde(deserialize_with = "without_bound")]
    pub nominal_rmse: f64,
    /// Of the twin with its own parameters refitted.
    #[serde(deserialize_with = "without_bound")]
    pub recalibrated_rmse: f64,
    /// Of the twin with what was found added.
    #[serde(deserialize_with = "without_bound")]
    pub trued_rmse: f64,
}

/// A range of a state that holds more of a channel's error than of its rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// The channel.
    pub channel: String,
    /// What it is a range of: `velocity`, `|velocity|`, `command`, `time`.
    pub on: String,
    /// Unit of that, as far as it has one.
    pub unit: String,
    /// Where the range begins, in `unit`; none where it has no lower end.
    pub from: Option<f64>,
    /// Where it ends, in `unit`; none where it has no upper end.
    pub to: Option<f64>,
    /// The part of the channel's squared error that lies within, from 0 to 1.
    pub share_of_error: f64,
    /// The part of the rows that does, from 0 to 1.
    pub share_of_rows: f64,
}

/// A stretch of time in which a channel's error is large.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The channel.
    pub channel: String,
    /// Start [s].
    pub start: f64,
    /// End [s].
    pub end: f64,
    /// The part of the channel's squared error that lies within, from 0 to 1.
    pub share_of_error: f64,
    /// The recording it lies in.
    pub recording: String,
}

/// A parameter of the twin, before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterChange {
    /// What the twin says today.
    pub nominal: f64,
    /// What the recordings say.
    pub value: f64,
    /// Its standard deviation.
    #[serde(deserialize_with = "without_bound")]
    pub std: f64,
    /// Its unit.
    pub unit: String,
}

/// Errors of one channel on held-out data, in the channel's unit; infinite (`null` in a file) where a twin diverges.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelFit {
    /// The channel.
    pub channel: String,
    /// Its unit, and that of all errors.
    pub unit: String,
    /// Standard deviation of the measurement noise.
    pub noise_floor: f64,
    /// Root mean square error of the twin as given.
    #[serde(deserialize_with = "without_bound")]
    pub nominal_rmse: f64,
    /// Of the twin with its own parameters refitted.
    #[serde(deserialize_with = "without_bound")]
    pub recalibrated_rmse: f64,
    /// Of the twin with what was found added.
    #[serde(deserialize_with = "without_bound")]
    pub trued_rmse: f64,
    /// Mean absolute error of the twin as given.
    #[serde(deserialize_with = "without_bound")]
    pub nominal_mae: f64,
    /// Mean absolute error of the twin with its own parameters refitted.
    #[serde(deserialize_with = "without_bound")]
    pub recalibrated_mae: f64,
    /// Mean absolute error of the twin with what was found added.
    #[serde(deserialize_with = "without_bound")]
    pub trued_mae: f64,
    /// By what part the trued twin's RMSE lies below the recalibrated twin's: 95 % interval, block bootstrap; minus infinity
    /// (`null` in a file) where the trued twin alone diverges.
    #[serde(deserialize_with = "below_all_bounds")]
    pub improvement_ci95: [f64; 2],
}

/// A number, or infinity where a file has none.
fn without_bound<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(from)?.unwrap_or(f64::INFINITY))
}

/// Two numbers, each minus infinity where a file has none.
fn below_all_bounds<'de, D: Deserializer<'de>>(from: D) -> Result<[f64; 2], D::Error> {
    Ok(<[Option<f64>; 2]>::deserialize(from)?.map(|end| end.unwrap_or(f64::NEG_INFINITY)))
}

/// What speaks for and against a verdict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Checks {
    /// Mean over 40 lags of `N rho^2` of the trued residual: about 1 when the physics is complete.
    pub adequacy: f64,
    /// The part of the recalibrated misfit above the noise floor that is left.
    pub remainder: f64,
    /// Share of placebos that did at least as well as what was named; none where nothing was named.
    pub placebo_p: Option<f64>,
    /// Parameters that ended at a bound.
    pub at_bound: Vec<String>,
    /// How many mechanisms were tried.
    pub tried: usize,
    /// Ids of the mechanisms of which these recordings cannot tell: at no size that was tried would they have changed what
    /// was measured by more than the noise.
    #[serde(default)]
    pub not_excited: Vec<String>,
    /// Further findings a reader should know, in words.
    pub notes: Vec<String>,
}

/// What to record next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NextExperiment {
    /// What to do, in one sentence.
    pub what: String,
    /// File with the commands to send, beside this one; none where there is only advice.
    #[serde(default)]
    pub file: Option<String>,
    /// Ids of the mechanisms it tells apart.
    #[serde(default)]
    pub rivals: Vec<String>,
    /// What they would then differ by, whatever parameters the worse one is given: root mean square, in units of the noise.
    #[serde(default)]
    pub separation: Option<f64>,
    /// The gain in log-likelihood to expect of the right one, `N / 2` times `separation` squared.
    #[serde(default)]
    pub gain: Option<f64>,
    /// The same of the commands in the recordings at hand.
    #[serde(default)]
    pub gain_so_far: Option<f64>,
}

/// How one mechanism did in the stage in which it was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// Its id.
    pub mechanism: String,
    /// Which of its forms, where there are several.
    pub form: String,
    /// Number of mechanisms already accepted when it was tried.
    pub stage: usize,
    /// Correlation of its projected signature with the residual, from 0 to 1.
    pub screen: f64,
    /// The part of its signature that refitting the other parameters could not hide, from 0 to 1.
    pub survival: f64,
    /// Whether it would change what is measured by more than the noise, at the largest size that was tried.
    #[serde(default = "yes")]
    pub excited: bool,
    /// `N_e ln(RSS0 / RSS1) - k ln N_e`; none where it was screened out.
    pub gain: Option<f64>,
    /// Whether it was accepted in that stage.
    pub accepted: bool,
}

/// What is said of a score written before it was asked.
fn yes() -> bool {
    true
}
