//! One run of a sweep, and what it came to.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use toml::Value;

use crate::market::metric::Metrics;

/// One run of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trial {
    /// Its number, from 0.
    pub index: usize,
    /// Its values, by path.
    pub values: BTreeMap<String, Value>,
    /// The seed of its randomness.
    pub seed: u64,
    /// SHA-256 of its document with these values, of its data and of the program's version.
    pub hash: String,
    /// What it came to.
    #[serde(flatten)]
    pub outcome: Outcome,
}

/// What a run came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub enum Outcome {
    /// It ran to its end.
    Done {
        /// Its figures, by the names they have in `run.json`; what is not defined is not here.
        metrics: BTreeMap<String, f64>,
    },
    /// The strategy refuses its values.
    Invalid {
        /// Why.
        why: String,
    },
    /// It could not go on to its end.
    Failed {
        /// Why.
        why: String,
    },
}

impl Outcome {
    /// Its word in tables.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self {
            Self::Done { .. } => "done",
            Self::Invalid { .. } => "invalid",
            Self::Failed { .. } => "failed",
        }
    }

    /// The figure of that name, where it is defined.
    #[must_use]
    pub fn figure(&self, name: &str) -> Option<f64> {
        match self {
            Self::Done { metrics } => metrics.get(name).copied(),
            Self::Invalid { .. } | Self::Failed { .. } => None,
        }
    }
}

/// The figures of a run by the names they have in `run.json`, those of tables with a dot (`max_drawdown.depth`); what is not
/// defined is left out, and so are times.
#[must_use]
pub fn figures(metrics: &Metrics) -> BTreeMap<String, f64> {
    let mut all = BTreeMap::new();
    // Figures that are no JSON would be a bug, and show as none.
    collect("", &serde_json::to_value(metrics).unwrap_or_default(), &mut all);
    all
}

fn collect(name: &str, value: &serde_json::Value, all: &mut BTreeMap<String, f64>) {
    match value {
        serde_json::Value::Object(table) => {
            for (key, value) in table.iter().filter(|(key, _)| !key.ends_with("_at")) {
                let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
                collect(&name, value, all);
            }
        }
        other => all.extend(other.as_f64().map(|number| (name.to_owned(), number))),
    }
}
