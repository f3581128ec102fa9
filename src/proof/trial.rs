//! A case diagnosed, and what is kept of it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::oracle::{OracleFit, oracle};
use crate::conceal::Span;
use crate::sim2real::diagnose::{Diagnosis, Effect, Estimate, Outcome, Verdict, diagnose};
use crate::sim2real::{Assembly, Plant, Recording, Seed};

/// What was said of a case, and what the baselines said.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    /// The verdict.
    pub verdict: Verdict,
    /// What was named, most certain first.
    pub found: Vec<Found>,
    /// The part of the recalibrated misfit that is left.
    #[serde(default)]
    pub remainder: f64,
    /// When it began [s], if the diagnosis says so.
    pub onset: Option<f64>,
    /// Where, in the recording to learn from.
    pub intervals: Vec<Span>,
    /// Root mean square errors on the recording to test on, in the unit of the channel that is told.
    pub held_out: HeldOut,
    /// The fit that was told the names; none where the registry lacks one of them.
    pub oracle: Option<OracleFit>,
    /// The names that linear regression gives: on differentiated positions, or on what costs are usually put down to.
    pub regression: Vec<String>,
    /// How long the diagnosis took [s], other cases under way beside it.
    pub seconds: f64,
}

/// A mechanism that was named.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// Its id.
    pub mechanism: String,
    /// Probability that the name is right.
    pub confidence: f64,
    /// Evidence that would be lost without it.
    #[serde(default)]
    pub gain: Option<f64>,
    /// Evidence by which the nearest rival falls behind.
    #[serde(default)]
    pub margin: Option<f64>,
    /// What else it might be.
    pub rivals: Vec<String>,
    /// Its parameters.
    pub parameters: BTreeMap<String, Fitted>,
    /// When it acted, in the recording to learn from; empty where it acted throughout.
    #[serde(default)]
    pub active: Vec<Span>,
}

/// A fitted value and its standard deviation, which is none where it is infinite.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub std: Option<f64>,
}

/// Errors of the three twins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// As given.
    pub nominal: f64,
    /// Its own parameters refitted.
    pub recalibrated: f64,
    /// With what was named.
    pub trued: f64,
}

/// What a diagnosis is given of a case: a twin, a recording to learn from, and one to test on.
pub(super) struct Given<P: Plant> {
    pub twin: Assembly<P>,
    pub train: [Recording<P::Stimulus>; 1],
    pub test: [Recording<P::Stimulus>; 1],
    /// The channel whose errors are told.
    pub channel: &'static str,
}

impl<P: Plant> Given<P> {
    /// Diagnoses it; the oracle alone is told the `names`, and only then. `regression` says what the baseline names, and `clock`
    /// gives a time [s].
    pub fn tried(
        &self,
        names: &[&str],
        regression: impl FnOnce() -> Vec<String> + Send,
        clock: &(dyn Fn() -> f64 + Sync),
    ) -> Trial {
        let Self { twin, train, test, channel } = self;
        let (trial, outcome) = self.answered(clock);
        let (regression, oracle) = rayon::join(regression, || oracle(twin, train, test, names, channel, &outcome));
        Trial { oracle, regression, ..trial }
    }

    /// Diagnoses it, and asks no other.
    pub fn answered(&self, clock: &(dyn Fn() -> f64 + Sync)) -> (Trial, Outcome<Assembly<P>>) {
        let Self { twin, train, test, channel } = self;
        let began = clock();
        let outcome = diagnose(twin, train, test, Seed(0), &|_, _, _| {});
        let seconds = clock() - began;
        let diagnosis = &outcome.diagnosis;
        let trial = Trial {
            verdict: diagnosis.verdict,
            remainder: finite(diagnosis.checks.remainder),
            onset: diagnosis.location.onset,
            intervals: intervals(diagnosis, &train[0].name),
            held_out: held_out(diagnosis, channel),
            oracle: None,
            regression: Vec::new(),
            found: diagnosis.effects.iter().map(|effect| found(effect.clone(), &train[0].name)).collect(),
            seconds,
        };
        (trial, outcome)
    }
}

fn found(effect: Effect, recording: &str) -> Found {
    let active = effect.active.iter().filter(|stretch| stretch.recording == recording);
    Found {
        active: active.map(|stretch| Span { start: stretch.start, end: stretch.end }).collect(),
        mechanism: effect.mechanism,
        confidence: effect.confidence,
        gain: effect.gain.filter(|gain| gain.is_finite()),
        margin: effect.margin.filter(|margin| margin.is_finite()),
        rivals: effect.rivals.into_iter().map(|rival| rival.mechanism).collect(),
        parameters: effect.parameters.into_iter().map(|(name, estimate)| (name, Fitted::from(&estimate))).collect(),
    }
}

impl From<&Estimate> for Fitted {
    fn from(estimate: &Estimate) -> Self {
        Self { value: finite(estimate.value), std: Some(estimate.std).filter(|std| std.is_finite()) }
    }
}

fn intervals(diagnosis: &Diagnosis, recording: &str) -> Vec<Span> {
    let own = diagnosis.location.intervals.iter().filter(|interval| interval.recording == recording);
    own.map(|interval| Span { start: interval.start, end: interval.end }).collect()
}

fn held_out(diagnosis: &Diagnosis, channel: &str) -> HeldOut {
    let fit = diagnosis.fit.iter().find(|fit| fit.channel == channel);
    let errors = fit.map_or([f64::MAX; 3], |fit| [fit.nominal_rmse, fit.recalibrated_rmse, fit.trued_rmse]);
    let [nominal, recalibrated, trued] = errors.map(finite);
    HeldOut { nominal, recalibrated, trued }
}

/// JSON knows no infinity: what ran away is as far away as numbers go.
pub(super) fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { f64::MAX.copysign(value) }
}
