//! `[[data]]` of RUN.toml: a file of market data, and how it is written and held to what it can be.

use std::collections::BTreeSet;
use std::path::PathBuf;

use chrono_tz::Tz;
use serde::de::Error;
use serde::{Deserialize, Deserializer};

use super::document::{Document, HINT};
use super::error::{InputError, hint_among, listed};
use super::feed_format::{FeedFormat, check_file, zone};
use super::feed_rules::{ClockOffset, FeedClock, FeedRules, OnBad, clock_offset, span};
use super::instrument_entry::InstrumentEntry;
use super::layout::Layout;
use super::stamp::Stamp;
use super::table::Renames;
use super::time_format::TimeUnit;
use crate::sim2real::Timestamp;

/// What a data file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FeedKind {
    /// Bars: open, high, low, close and volume of an interval.
    Bars,
    /// Quotes: best bid and ask, and deeper levels.
    Quotes,
    /// Trades.
    Trades,
    /// Changes of an order book.
    Book,
    /// Dividends and splits.
    Actions,
}

impl FeedKind {
    /// The word for it in documents.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Bars => "bars",
            Self::Quotes => "quotes",
            Self::Trades => "trades",
            Self::Book => "book",
            Self::Actions => "actions",
        }
    }
}

/// `[[data]]`: a file of market data of one instrument.
#[derive(Debug, Clone, PartialEq)]
pub struct DataEntry {
    /// Symbol of the instrument.
    pub symbol: String,
    /// What the file holds.
    pub kind: FeedKind,
    /// The file.
    pub path: PathBuf,
    /// The file, as the document names it.
    pub named: String,
    /// How it is written.
    pub format: FeedFormat,
    /// Length of a bar [ns]; none where the distances between bars show it.
    pub interval: Option<i64>,
}

impl DataEntry {
    /// Holds its files, which stand in the `number`-th section of `document`, to exist.
    pub(super) fn check_files(&self, document: &Document, number: &str) -> Result<(), InputError> {
        check_file(document, &["data", number, self.kind.word()], &self.path.to_string_lossy())?;
        match &self.format.snapshot {
            Some(snapshot) => check_file(document, &["data", number, "snapshot"], &snapshot.to_string_lossy()),
            None => Ok(()),
        }
    }

    /// The same with paths that start from where the program runs.
    pub(super) fn resolved(self, document: &Document) -> Self {
        let snapshot = self.format.snapshot.as_ref().map(|path| document.resolve(path));
        Self { path: document.resolve(&self.path), format: FeedFormat { snapshot, ..self.format }, ..self }
    }
}

/// The entries of a document's sections, none of them of the same data of one instrument; there should be data up to `end`.
pub(super) fn data_entries(
    document: &Document,
    tables: Vec<DataTable>,
    instruments: &[InstrumentEntry],
    end: Option<Timestamp>,
) -> Result<Vec<DataEntry>, InputError> {
    let entry = |(index, table): (usize, DataTable)| data_entry(document, &index.to_string(), table, instruments, end);
    let data = tables.into_iter().enumerate().map(entry).collect::<Result<Vec<_>, _>>()?;
    let mut seen = BTreeSet::new();
    match data.iter().position(|d| !seen.insert((d.symbol.clone(), d.kind))) {
        None => Ok(data),
        Some(index) => {
            let message = format!("there are {} of `{}` already", data[index].kind.word(), data[index].symbol);
            Err(document.error(&["data", &index.to_string()], message).hint("join the files into one"))
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DataTable {
    symbol: String,
    bars: Option<String>,
    quotes: Option<String>,
    trades: Option<String>,
    book: Option<String>,
    actions: Option<String>,
    stamp: Option<Stamp>,
    #[serde(default, deserialize_with = "interval")]
    interval: Option<i64>,
    #[serde(default, deserialize_with = "zone")]
    zone: Option<Tz>,
    price_scale: Option<f64>,
    time_unit: Option<TimeUnit>,
    #[serde(default)]
    columns: Renames,
    #[serde(default)]
    layout: Layout,
    snapshot: Option<String>,
    known_at: Option<String>,
    #[serde(default, deserialize_with = "clock_offset")]
    clock_offset: Option<ClockOffset>,
    #[serde(default)]
    on_bad: OnBad,
    #[serde(default, deserialize_with = "span")]
    reorder: Option<i64>,
    #[serde(default, deserialize_with = "span")]
    max_gap: Option<i64>,
}

/// The entry of a section.
fn data_entry(
    document: &Document,
    number: &str,
    mut table: DataTable,
    instruments: &[InstrumentEntry],
    end: Option<Timestamp>,
) -> Result<DataEntry, InputError> {
    let keys = ["data", number];
    let kinds = [
        (FeedKind::Bars, table.bars.take()),
        (FeedKind::Quotes, table.quotes.take()),
        (FeedKind::Trades, table.trades.take()),
        (FeedKind::Book, table.book.take()),
        (FeedKind::Actions, table.actions.take()),
    ];
    let mut named = kinds.into_iter().filter_map(|(kind, path)| path.map(|path| (kind, path)));
    let (Some((kind, path)), None) = (named.next(), named.next()) else {
        return Err(document
            .error(&keys, "expected exactly one of `bars`, `quotes`, `trades`, `book` and `actions`")
            .hint("a second file of the same instrument has a [[data]] section of its own"));
    };
    if !instruments.iter().any(|i| i.symbol == table.symbol) {
        let symbols: Vec<&str> = instruments.iter().map(|i| i.symbol.as_str()).collect();
        let hint = hint_among(&table.symbol, &symbols).unwrap_or_else(|| "add an [[instrument]] section".to_owned());
        let message = format!("there is no [[instrument]] with the symbol `{}`", table.symbol);
        return Err(document.error(&["data", number, "symbol"], message).hint(hint));
    }
    check_keys(document, number, &table, kind)?;
    let own = FeedFormat::of(table.stamp, table.zone, table.time_unit, table.price_scale, table.columns);
    let format = FeedFormat {
        stamp: own.stamp.or(table.layout.stamp()),
        price_scale: table.price_scale.unwrap_or(table.layout.price_scale()),
        layout: table.layout,
        clock: FeedClock { known_at: table.known_at, offset: table.clock_offset.unwrap_or_default() },
        rules: FeedRules { on_bad: table.on_bad, reorder: table.reorder, max_gap: table.max_gap, until: end },
        snapshot: table.snapshot.map(PathBuf::from),
        ..own
    };
    format.check(document, &keys, kind == FeedKind::Bars)?;
    Ok(DataEntry { symbol: table.symbol, kind, path: PathBuf::from(&path), named: path, format, interval: table.interval })
}

/// Holds the keys of a section to belong together.
fn check_keys(document: &Document, number: &str, table: &DataTable, kind: FeedKind) -> Result<(), InputError> {
    let layout = table.layout;
    let refuse = |key: &str, message: String, hint: &str| Err(document.error(&["data", number, key], message).hint(hint));
    if !layout.kinds().contains(&kind) {
        let kinds: Vec<&str> = layout.kinds().iter().map(|kind| kind.word()).collect();
        let message = format!("a file of `{}` is not of the layout `{}`", kind.word(), layout.word());
        return refuse("layout", message, &format!("that layout has {}", listed(&kinds)));
    }
    if kind == FeedKind::Actions {
        let keys = [
            ("stamp", table.stamp.is_some()),
            ("price_scale", table.price_scale.is_some()),
            ("known_at", table.known_at.is_some()),
            ("on_bad", table.on_bad != OnBad::default()),
            ("reorder", table.reorder.is_some()),
            ("max_gap", table.max_gap.is_some()),
        ];
        if let Some((key, _)) = keys.into_iter().find(|(_, there)| *there) {
            return refuse(key, format!("dividends and splits have no `{key}`"), "drop the key");
        }
    }
    let bars = kind == FeedKind::Bars;
    // Quote bars have a length, too.
    if table.interval.is_some() && !(bars || layout == Layout::Lean && kind == FeedKind::Quotes) {
        return refuse("interval", "only bars have an `interval`".to_owned(), "drop the key");
    }
    if table.snapshot.is_some() && layout != Layout::BinanceDepth {
        return refuse("snapshot", "only the layout `binance_depth` has a `snapshot`".to_owned(), "drop the key");
    }
    if table.known_at.is_some() && (bars || !layout.is_own()) {
        let message = if bars { "a bar is known when it ends" } else { "the layout says when a row was known" };
        return refuse("known_at", message.to_owned(), "drop the key");
    }
    if table.clock_offset.is_some() && table.known_at.is_none() && !layout.has_local_clock() {
        let hint = "name the column with the times of the local clock: known_at = \"...\", or drop the key";
        return refuse("clock_offset", "there is no second clock to be offset".to_owned(), hint);
    }
    if table.reorder.is_some() && bars {
        return refuse("reorder", "bars are not put in order".to_owned(), "sort the file, or drop the key");
    }
    if layout == Layout::Lean && table.zone.is_none() {
        let hint = "declare it: zone = \"America/New_York\" for stocks, zone = \"UTC\" for crypto";
        return refuse("layout", "the times of the layout `lean` are local, and nothing says where".to_owned(), hint);
    }
    if layout == Layout::Lean && table.stamp == Some(Stamp::Close) {
        return refuse("stamp", "the layout `lean` stamps a bar at its open".to_owned(), "drop the key");
    }
    if layout == Layout::DatabentoMbo && table.price_scale.is_some() {
        return refuse("price_scale", "the layout says what a price is worth".to_owned(), "drop the key");
    }
    Ok(())
}

/// Reads the length of a bar [ns]: a whole number and one of s, m, h, d.
fn interval<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<i64>, D::Error> {
    let text = String::deserialize(deserializer)?;
    let units = [("s", 1), ("m", 60), ("h", 3_600), ("d", 86_400)];
    let length = units.iter().find_map(|(unit, seconds)| {
        let count: i64 = text.strip_suffix(unit)?.trim().parse().ok().filter(|count| *count > 0)?;
        count.checked_mul(seconds * Timestamp::NANOS)
    });
    length.map(Some).ok_or_else(|| {
        let hint = "a whole number and a unit: \"1s\", \"5m\", \"1h\", \"1d\"";
        D::Error::custom(format!("invalid value: {text:?}, expected the length of a bar{HINT}{hint}"))
    })
}
