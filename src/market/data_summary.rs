//! What was found in the data of a run, as its summary and its report say it.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{DataNotes, Finding, Instrument, Record};

/// What was found in one file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DataSummary {
    /// Symbol of the instrument.
    pub symbol: String,
    /// What the file holds: "bars", "quotes", "trades", "book".
    pub kind: String,
    /// Rows read.
    pub rows: u64,
    /// Rows that came of them: fewer where some are left out, more where a row means several changes.
    pub kept: u64,
    /// Of how many rows something was found, by what; nothing that was not found.
    pub findings: BTreeMap<Finding, u64>,
    /// The longest time between two rows [s].
    pub longest_silence_s: f64,
    /// What was added to the local clock [s]; none where there is no such clock.
    pub clock_offset_s: Option<f64>,
    /// Whether the data end more than `max_gap` before they should.
    pub ended_early: bool,
    /// The same in sentences, where something was found.
    #[serde(skip)]
    pub lines: Vec<String>,
}

impl DataSummary {
    /// What was found in the data of `record`, file by file.
    #[must_use]
    pub fn of(record: &Record, instruments: &[Instrument]) -> Vec<Self> {
        let all = record.data.iter().zip(instruments);
        all.flat_map(|(seen, instrument)| seen.notes.iter().map(|notes| Self::new(&instrument.symbol, notes))).collect()
    }

    fn new(symbol: &str, notes: &DataNotes) -> Self {
        let found = |finding: &Finding| (*finding, notes.count(*finding));
        Self {
            symbol: symbol.to_owned(),
            kind: notes.what().to_owned(),
            rows: notes.rows(),
            kept: notes.kept(),
            findings: Finding::ALL.iter().map(found).filter(|(_, count)| *count > 0).collect(),
            longest_silence_s: notes.longest_silence() as f64 / 1e9,
            clock_offset_s: notes.clock_offset().map(|offset| offset as f64 / 1e9),
            ended_early: notes.ended_early(),
            lines: notes.lines(),
        }
    }
}
