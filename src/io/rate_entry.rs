//! `[[rate]]` of RUN.toml: what a foreign currency is worth.

use std::collections::BTreeSet;
use std::path::PathBuf;

use chrono_tz::Tz;
use serde::Deserialize;

use super::document::Document;
use super::error::{InputError, hint_among};
use super::feed_format::zone;
use super::instrument_entry::InstrumentEntry;
use super::table::Renames;
use super::time_format::{TimeFormat, TimeUnit};

/// What one unit of a currency is worth in the currency of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct RateEntry {
    /// The currency.
    pub currency: String,
    /// Where its worth is told.
    pub source: RateSource,
}

/// Where a rate is told.
#[derive(Debug, Clone, PartialEq)]
pub enum RateSource {
    /// It is always the same.
    Constant(f64),
    /// A file of `ts, price`: in force from `ts` on, at which it is known.
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
    /// The latest price of an instrument of the run.
    PriceOf(String),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RateTable {
    currency: String,
    value: Option<f64>,
    file: Option<String>,
    symbol: Option<String>,
    #[serde(default, deserialize_with = "zone")]
    zone: Option<Tz>,
    time_unit: Option<TimeUnit>,
    #[serde(default)]
    columns: Renames,
}

/// The rates of a run in the currency `base`: one of each foreign currency that an instrument is in, and of no other.
pub(super) fn rate_entries(
    document: &Document,
    base: &str,
    tables: Vec<RateTable>,
    instruments: &[InstrumentEntry],
) -> Result<Vec<RateEntry>, InputError> {
    let currency = |instrument: &InstrumentEntry| instrument.currency.clone().unwrap_or_else(|| base.to_owned());
    let used: BTreeSet<String> = instruments.iter().map(currency).filter(|currency| currency != base).collect();
    let mut entries: Vec<RateEntry> = Vec::new();
    for (index, table) in tables.into_iter().enumerate() {
        let number = index.to_string();
        let refuse =
            |key: &str, message: String, hint: String| Err(document.error(&["rate", &number, key], message).hint(hint));
        let name = table.currency.clone();
        if !used.contains(&name) {
            let used: Vec<&String> = used.iter().collect();
            let drop = "drop the rate, or give an [[instrument]] that `currency`".to_owned();
            let hint = hint_among(&name, &used).filter(|hint| hint.starts_with("did you")).unwrap_or(drop);
            let message =
                if name == base { "it is the currency of the run, whose rate is 1" } else { "no instrument is in it" };
            return refuse("currency", format!("{message}: `{name}`"), hint);
        }
        if entries.iter().any(|entry| entry.currency == name) {
            return refuse("currency", format!("there is a rate of `{name}` already"), "drop one of the two".to_owned());
        }
        entries.push(RateEntry { currency: name, source: source(document, &number, table, base, instruments)? });
    }
    let missing = instruments.iter().enumerate().find_map(|(index, instrument)| {
        let currency = instrument.currency.as_ref().filter(|currency| *currency != base)?;
        (!entries.iter().any(|entry| entry.currency == *currency)).then_some((index, currency))
    });
    match missing {
        None => Ok(entries),
        Some((index, currency)) => Err(document
            .error(
                &["instrument", &index.to_string(), "currency"],
                format!("nothing says what `{currency}` is worth in `{base}`"),
            )
            .hint(format!("add [[rate]] with currency = \"{currency}\" and value, file or symbol"))),
    }
}

fn source(
    document: &Document,
    number: &str,
    table: RateTable,
    base: &str,
    instruments: &[InstrumentEntry],
) -> Result<RateSource, InputError> {
    let at = |key: &'static str| ["rate", number, key];
    let told_by_file = table.zone.is_some() || table.time_unit.is_some() || !table.columns.is_empty();
    if told_by_file && table.file.is_none() {
        let error = document.error(&["rate", number], "only a `file` has `zone`, `time_unit` and `columns`");
        return Err(error.hint("drop them, or name a file"));
    }
    match (table.value, table.file, table.symbol) {
        (Some(value), None, None) => {
            if !(value > 0.0 && value < 1e9) {
                let error = document.error(&at("value"), "expected a number above 0 and below 1e9").found(value);
                return Err(error.hint(format!("it is what one unit is worth in {base}")));
            }
            Ok(RateSource::Constant(value))
        }
        (None, Some(file), None) => Ok(RateSource::File {
            path: PathBuf::from(&file),
            named: file,
            time: TimeFormat { unit: table.time_unit.unwrap_or_default(), zone: table.zone.unwrap_or(Tz::UTC) },
            columns: table.columns,
        }),
        (None, None, Some(symbol)) => {
            let Some(instrument) = instruments.iter().find(|instrument| instrument.symbol == symbol) else {
                let symbols: Vec<&str> = instruments.iter().map(|i| i.symbol.as_str()).collect();
                let error = document.error(&at("symbol"), format!("there is no [[instrument]] with the symbol `{symbol}`"));
                return Err(error.maybe_hint(hint_among(&symbol, &symbols)));
            };
            if let Some(other) = instrument.currency.as_ref().filter(|currency| *currency != base) {
                let error =
                    document.error(&at("symbol"), format!("the price of `{symbol}` is in `{other}`, not in `{base}`"));
                return Err(error.hint(format!("a rate is told in {base}: take an instrument with that currency")));
            }
            Ok(RateSource::PriceOf(symbol))
        }
        _ => Err(document
            .error(&["rate", number], "expected exactly one of `value`, `file` and `symbol`")
            .hint("a constant, a file of `ts, price`, or an instrument of the run whose price it is")),
    }
}
