//! `[[halt]]` of RUN.toml: when an instrument does not trade.

use std::path::PathBuf;

use chrono_tz::Tz;
use serde::Deserialize;

use super::document::Document;
use super::error::{InputError, hint_among};
use super::feed_format::zone;
use super::instrument_entry::InstrumentEntry;
use super::run_file::instant;
use super::table::Renames;
use super::time_format::{TimeFormat, TimeUnit};
use crate::sim2real::Timestamp;

/// Where halts are told.
#[derive(Debug, Clone, PartialEq)]
pub enum HaltEntry {
    /// One, in the document.
    Written {
        /// Symbol of the instrument.
        symbol: String,
        /// The first instant at which it does not trade.
        from: Timestamp,
        /// The first instant after it at which it trades.
        to: Timestamp,
        /// Why.
        reason: Option<String>,
    },
    /// A file of `symbol, from, to` and optionally `reason`.
    File {
        /// The file.
        path: PathBuf,
        /// The file, as the document names it.
        named: String,
        /// How its times are written.
        time: TimeFormat,
        /// Columns that are named otherwise.
        columns: Renames,
    },
}

impl HaltEntry {
    /// The same with the path of its file as the document is to be read.
    pub(super) fn resolved(self, document: &Document) -> Self {
        match self {
            Self::File { path, named, time, columns } => Self::File { path: document.resolve(&path), named, time, columns },
            written @ Self::Written { .. } => written,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HaltTable {
    symbol: Option<String>,
    #[serde(default, deserialize_with = "instant")]
    from: Option<Timestamp>,
    #[serde(default, deserialize_with = "instant")]
    to: Option<Timestamp>,
    reason: Option<String>,
    file: Option<String>,
    #[serde(default, deserialize_with = "zone")]
    zone: Option<Tz>,
    time_unit: Option<TimeUnit>,
    #[serde(default)]
    columns: Renames,
}

/// The halts of a run, each of an instrument it has.
pub(super) fn halt_entries(
    document: &Document,
    tables: Vec<HaltTable>,
    instruments: &[InstrumentEntry],
) -> Result<Vec<HaltEntry>, InputError> {
    let one = |(index, table): (usize, HaltTable)| entry(document, &index.to_string(), table, instruments);
    tables.into_iter().enumerate().map(one).collect()
}

fn entry(
    document: &Document,
    number: &str,
    table: HaltTable,
    instruments: &[InstrumentEntry],
) -> Result<HaltEntry, InputError> {
    let refuse = |message: &str, hint: &str| Err(document.error(&["halt", number], message).hint(hint));
    let told_by_file = table.zone.is_some() || table.time_unit.is_some() || !table.columns.is_empty();
    let HaltTable { symbol, from, to, reason, file, zone, time_unit, columns } = table;
    match (symbol, from, to, file) {
        (Some(symbol), Some(from), Some(to), None) => {
            if told_by_file {
                return refuse("only a `file` has `zone`, `time_unit` and `columns`", "drop them, or name a file");
            }
            let symbols: Vec<&str> = instruments.iter().map(|instrument| instrument.symbol.as_str()).collect();
            if !symbols.contains(&symbol.as_str()) {
                let message = format!("there is no [[instrument]] with the symbol `{symbol}`");
                return Err(document.error(&["halt", number, "symbol"], message).maybe_hint(hint_among(&symbol, &symbols)));
            }
            if from >= to {
                let message = format!("expected an end after the beginning, {from}");
                return Err(document.error(&["halt", number, "to"], message).found(to).hint("swap or correct them"));
            }
            Ok(HaltEntry::Written { symbol, from, to, reason })
        }
        (None, None, None, Some(file)) if reason.is_none() => Ok(HaltEntry::File {
            path: PathBuf::from(&file),
            named: file,
            time: TimeFormat { unit: time_unit.unwrap_or_default(), zone: zone.unwrap_or(Tz::UTC) },
            columns,
        }),
        (_, _, _, Some(_)) => refuse("a `file` says all of its halts itself", "drop `symbol`, `from`, `to` and `reason`"),
        _ => refuse("expected `symbol`, `from` and `to`, or a `file`", "a file has these columns, and may have `reason`"),
    }
}
