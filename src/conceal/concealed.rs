//! What a label says of one effect.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// One concealed effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Concealed {
    /// The name a right diagnosis says.
    pub id: String,
    /// Root mean square, over the rows to learn from, of what it changes and refitting could not hide [standard deviations of
    /// the noise].
    pub size: f64,
    /// Its true parameters, as far as a registry's of that name can be compared with them.
    pub parameters: BTreeMap<String, f64>,
    /// What forms that lack some of them come closest with: for each such form all of its names, and their values.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub simpler: Vec<BTreeMap<String, f64>>,
    /// When it began [s], where not from the start: of what takes a while, the middle of that.
    pub onset: Option<f64>,
    /// When it acted, in the recording to learn from, where it acts at times only.
    pub active: Vec<Span>,
}

/// A stretch of time [s].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Span {
    /// Its start.
    pub start: f64,
    /// Its end.
    pub end: f64,
}
