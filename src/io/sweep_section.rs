//! `[sweep]` of a run: which values of it are tried.

use std::collections::BTreeMap;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use toml::Value;

use super::document::{Document, HINT};
use super::error::InputError;
use super::sweep_range::SweepRange;
use crate::sim2real::Timestamp;

/// How values are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SweepMethod {
    /// Every value of a range with every value of all others.
    #[default]
    Grid,
    /// So many draws, each range drawn by itself.
    ///
    /// Source: Bergstra and Bengio, "Random search for hyper-parameter optimization", JMLR 13 (2012).
    Random,
}

/// Which end of a metric is the good one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SweepGoal {
    /// The larger, the better.
    #[default]
    Max,
    /// The smaller, the better.
    Min,
}

/// `[sweep]`.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepSection {
    /// How values are combined.
    pub method: SweepMethod,
    /// Number of draws of a random search.
    pub runs: Option<usize>,
    /// Seed of the draws; none for the run's own. It is no seed of the runs.
    pub seed: Option<u64>,
    /// The figure of `run.json` that ranks runs ("sharpe", "max_drawdown.depth").
    pub metric: String,
    /// Which end of it is the good one.
    pub goal: SweepGoal,
    /// What is tried, by path.
    pub ranges: Vec<SweepRange>,
    /// The windows of a walk-forward.
    pub walk_forward: Option<WalkForwardSection>,
}

/// `[sweep.walk_forward]`: lengths in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WalkForwardSection {
    /// Length of the data on which parameters are chosen; of the first window's, where they are anchored [ns].
    #[serde(deserialize_with = "length")]
    pub train: i64,
    /// Length of the data on which they are then tried [ns].
    #[serde(deserialize_with = "length")]
    pub test: i64,
    /// What is left out between the two, so that nothing decided in training is still open in the test [ns].
    #[serde(default, deserialize_with = "length")]
    pub purge: i64,
    /// What is left out beyond it, for what remains correlated [ns].
    #[serde(default, deserialize_with = "length")]
    pub embargo: i64,
    /// Whether all training begins with the data, and not `train` before its end.
    #[serde(default)]
    pub anchored: bool,
}

/// The section, as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SweepTable {
    #[serde(default)]
    method: SweepMethod,
    runs: Option<usize>,
    seed: Option<u64>,
    #[serde(default = "sharpe")]
    metric: String,
    #[serde(default)]
    goal: SweepGoal,
    #[serde(default)]
    ranges: BTreeMap<String, Value>,
    walk_forward: Option<WalkForwardSection>,
}

fn sharpe() -> String {
    "sharpe".to_owned()
}

impl SweepSection {
    /// The most runs of a sweep.
    pub const MOST: usize = 100_000;

    /// The section of `document`, its ranges held to make sense by themselves.
    pub(super) fn of(document: &Document, table: SweepTable) -> Result<Self, InputError> {
        let SweepTable { method, runs, seed, metric, goal, ranges, walk_forward } = table;
        let mut all = Vec::new();
        for (key, value) in &ranges {
            collect(document, &mut vec!["sweep".to_owned(), "ranges".to_owned(), key.clone()], value, &mut all)?;
        }
        if all.is_empty() {
            let error = document.error(&["sweep", "ranges"], "there is nothing to sweep over");
            return Err(error.hint("add [sweep.ranges] with e.g. \"strategy.fast\" = { from = 5, to = 50, step = 5 }"));
        }
        let section = Self { method, runs, seed, metric, goal, ranges: all, walk_forward };
        section.check(document)?;
        Ok(section)
    }

    fn check(&self, document: &Document) -> Result<(), InputError> {
        if let Some(walk) = self.walk_forward
            && (walk.train == 0 || walk.test == 0)
        {
            let key = if walk.train == 0 { "train" } else { "test" };
            let error = document.error(&["sweep", "walk_forward", key], "expected a length above 0");
            return Err(error.hint("a whole number and a unit: \"90d\", \"4w\", \"12h\""));
        }
        match (self.method, self.runs) {
            (SweepMethod::Grid, Some(_)) => {
                let error = document.error(&["sweep", "runs"], "a grid has as many runs as its ranges have combinations");
                Err(error.hint("drop the key, or set method = \"random\""))
            }
            (SweepMethod::Random, None) => {
                let error = document.error(&["sweep", "method"], "a random search needs `runs`, the number of draws");
                Err(error.hint("add runs = 200"))
            }
            (SweepMethod::Random, Some(runs)) if runs == 0 || runs > Self::MOST => {
                let error = document.error(&["sweep", "runs"], format!("expected 1 to {} runs", Self::MOST));
                Err(error.found(runs).hint("a few hundred are a usual number"))
            }
            (SweepMethod::Random, Some(_)) => Ok(()),
            (SweepMethod::Grid, None) => self.check_grid(document),
        }
    }

    fn check_grid(&self, document: &Document) -> Result<(), InputError> {
        let mut combinations = 1_usize;
        for range in &self.ranges {
            let Some(count) = range.count() else {
                let error = range.error(document, "a grid needs to know which values of the range to take");
                return Err(error.hint("add `step` or `count`, or set method = \"random\""));
            };
            combinations = combinations.saturating_mul(count);
        }
        if combinations > Self::MOST {
            let error = document.error(&["sweep", "ranges"], format!("expected at most {} combinations", Self::MOST));
            return Err(error.found(combinations).hint("take longer steps, or set method = \"random\" and `runs`"));
        }
        Ok(())
    }
}

/// Ranges at `keys` and below: `"strategy.fast" = ...` and `strategy.fast = ...` are the same.
fn collect(document: &Document, keys: &mut Vec<String>, value: &Value, all: &mut Vec<SweepRange>) -> Result<(), InputError> {
    match value {
        Value::Table(table) if !["from", "to", "step", "count", "log"].iter().any(|key| table.contains_key(*key)) => {
            for (key, value) in table {
                keys.push(key.clone());
                collect(document, keys, value, all)?;
                keys.pop();
            }
        }
        _ => {
            let range = SweepRange::of(document, keys.clone(), value)?;
            if all.iter().any(|earlier| earlier.path == range.path) {
                let error = range.error(document, format!("there is a range for `{}` already", range.path));
                return Err(error.hint("drop one of the two"));
            }
            all.push(range);
        }
    }
    Ok(())
}

/// Reads a length of time [ns]: a whole number and one of s, m, h, d, w.
fn length<'de, D: Deserializer<'de>>(deserializer: D) -> Result<i64, D::Error> {
    let text = String::deserialize(deserializer)?;
    let units = [("s", 1), ("m", 60), ("h", 3_600), ("d", 86_400), ("w", 604_800)];
    let length = units.iter().find_map(|(unit, seconds)| {
        let count: i64 = text.strip_suffix(unit)?.trim().parse().ok().filter(|count| *count >= 0)?;
        count.checked_mul(seconds * Timestamp::NANOS)
    });
    length.ok_or_else(|| {
        let hint = "a whole number and a unit: \"90d\", \"4w\", \"12h\"";
        D::Error::custom(format!("invalid value: {text:?}, expected a length of time{HINT}{hint}"))
    })
}
