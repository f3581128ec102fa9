//! `sweep.json` and `sweep.parquet`.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use toml::Value;

use crate::io::{OutputTable, SweepGoal, SweepMethod, SweepSection, Values as Cells};
use crate::market::InputFile;

use super::{Outcome, Sweep, Trial, ranked, selection};

/// `sweep.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepSummary {
    /// [`SweepSummary::SCHEMA`].
    pub schema: &'static str,
    /// Version of the program.
    pub version: String,
    /// How values were combined.
    pub method: SweepMethod,
    /// The figure that ranks runs.
    pub metric: String,
    /// Which end of it is the good one.
    pub goal: SweepGoal,
    /// Paths of the ranges.
    pub ranges: Vec<String>,
    /// Number of runs.
    pub runs: usize,
    /// Runs that came to their end.
    pub done: usize,
    /// Runs whose values the strategy refuses.
    pub invalid: usize,
    /// Runs that could not go on to their end.
    pub failed: usize,
    /// Why the first of the invalid and failed runs are so, by how many are for that reason.
    pub reasons: BTreeMap<String, usize>,
    /// The best runs, the best first.
    pub best: Vec<Ranked>,
    /// Half of all runs that have the metric are at most as large as this.
    pub median: Option<f64>,
    /// The probability that the best Sharpe ratio is more than the luck of so many runs; none where it is not known.
    pub deflated_sharpe: Option<f64>,
    /// Every file the runs read.
    pub inputs: Vec<InputFile>,
}

/// A run among the best.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ranked {
    /// Its metric.
    pub value: f64,
    /// The run.
    #[serde(flatten)]
    pub trial: Trial,
}

impl SweepSummary {
    /// The schema, with its version.
    pub const SCHEMA: &'static str = "trueup.sweep/1";
    /// How many runs are among the best.
    pub const BEST: usize = 10;

    /// The summary of `trials`, the runs of `sweep`.
    #[must_use]
    pub fn of(sweep: &Sweep<'_>, section: &SweepSection, trials: &[Trial]) -> Self {
        let ranked = ranked(section, trials);
        let count = |word: &str| trials.iter().filter(|trial| trial.outcome.word() == word).count();
        let mut reasons = BTreeMap::new();
        for trial in trials {
            if let Outcome::Invalid { why } | Outcome::Failed { why } = &trial.outcome {
                *reasons.entry(reason(why)).or_default() += 1;
            }
        }
        let mut values: Vec<f64> = ranked.iter().map(|(_, value)| *value).collect();
        values.sort_by(f64::total_cmp);
        Self {
            schema: Self::SCHEMA,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            method: section.method,
            metric: section.metric.clone(),
            goal: section.goal,
            ranges: section.ranges.iter().map(|range| range.path.clone()).collect(),
            runs: trials.len(),
            done: count("done"),
            invalid: count("invalid"),
            failed: count("failed"),
            reasons,
            deflated_sharpe: ranked.first().and_then(|(best, _)| selection::deflated_sharpe(best, trials)),
            best: ranked
                .iter()
                .take(Self::BEST)
                .map(|(trial, value)| Ranked { value: *value, trial: (*trial).clone() })
                .collect(),
            median: values.len().checked_sub(1).map(|last| values[last / 2]),
            inputs: sweep.prepared.provenance.inputs.clone(),
        }
    }
}

/// A reason without the numbers that differ from run to run.
fn reason(why: &str) -> String {
    let word = |word: &str| match word.trim_end_matches([':', ',', ';']) {
        number if number.chars().any(|c| c.is_ascii_digit()) => format!("...{}", &word[number.len()..]),
        _ => word.to_owned(),
    };
    why.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// `sweep.parquet`: a row a run with its number, outcome, seed, hash, values by path and figures by name.
#[must_use]
pub fn sweep_table(trials: &[Trial]) -> OutputTable {
    let done = |trial: &Trial| match &trial.outcome {
        Outcome::Done { .. } => None,
        Outcome::Invalid { why } | Outcome::Failed { why } => Some(why.clone()),
    };
    let mut table = OutputTable::new()
        .integers("run", trials.iter().map(|trial| trial.index as i64))
        .texts("outcome", trials.iter().map(|trial| trial.outcome.word().to_owned()))
        .texts("why", trials.iter().map(done))
        // Seeds are bits: those beyond the range of signed integers show as negative.
        .integers("seed", trials.iter().map(|trial| trial.seed as i64))
        .texts("hash", trials.iter().map(|trial| trial.hash.clone()));
    let paths: BTreeSet<&String> = trials.iter().flat_map(|trial| trial.values.keys()).collect();
    for path in paths {
        table = table.with(path, column(trials.iter().map(|trial| trial.values.get(path))));
    }
    let names: BTreeSet<&String> = trials
        .iter()
        .filter_map(|trial| if let Outcome::Done { metrics } = &trial.outcome { Some(metrics.keys()) } else { None })
        .flatten()
        .collect();
    for name in names {
        table = table.floats(name, trials.iter().map(|trial| trial.outcome.figure(name)));
    }
    table
}

/// Values as a column of the narrowest type that holds all of them.
pub(in crate::market) fn column<'v>(values: impl Iterator<Item = Option<&'v Value>> + Clone) -> Cells {
    let present = || values.clone().flatten();
    if present().all(Value::is_integer) {
        return Cells::Integers(values.map(|value| value.and_then(Value::as_integer)).collect());
    }
    if present().all(|value| number(value).is_some()) {
        return Cells::Floats(values.map(|value| value.and_then(number)).collect());
    }
    Cells::Texts(values.map(|value| value.map(shown)).collect())
}

/// A value as a number.
pub(in crate::market) fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

/// The end of a path that tells it from the others.
pub(in crate::market) fn head(path: &str, all: &[String]) -> String {
    let last = |path: &str| path.rsplit('.').next().unwrap_or_default().to_owned();
    let alone = all.iter().filter(|other| last(other) == last(path)).count() <= 1;
    if alone { last(path) } else { path.to_owned() }
}

/// A value as people read it.
pub(in crate::market) fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Float(number) => {
            let digits = crate::report::quantity::significant(*number, 4);
            if digits.contains('.') { digits.trim_end_matches('0').trim_end_matches('.').to_owned() } else { digits }
        }
        other => other.to_string(),
    }
}
