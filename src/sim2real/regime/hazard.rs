//! How often there are changes.

use serde::{Deserialize, Serialize};

use super::RegimeError;

/// The probability that a change comes before the next row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hazard {
    /// The same at any time, between 0 and 1: changes come every 1 / hazard rows on average.
    Constant(f64),
    /// After runs of 1, 2, 3, … rows, each from 0 to 1 (both excluded); longer runs have the last.
    ByLength(Vec<f64>),
}

impl Hazard {
    pub(super) fn check(&self) -> Result<(), RegimeError> {
        let all = match self {
            Self::Constant(hazard) => std::slice::from_ref(hazard),
            Self::ByLength(hazards) => hazards,
        };
        let hint = "between 0 and 1, such as 0.004 for a change every 250 rows";
        if all.is_empty() {
            return RegimeError::setting("number of hazards", 0.0, false, "at least one");
        }
        all.iter().try_for_each(|h| RegimeError::setting("hazard", *h, *h > 0.0 && *h < 1.0, hint))
    }

    /// After a run of `run` rows.
    pub(super) fn after(&self, run: u64) -> f64 {
        match self {
            Self::Constant(hazard) => *hazard,
            Self::ByLength(hazards) => hazards[(run.max(1) as usize - 1).min(hazards.len() - 1)],
        }
    }
}
