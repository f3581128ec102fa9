//! `[market]` of a twin: the tape the backtest ran on.

use std::path::{Path, PathBuf};

use chrono_tz::Tz;
use serde::Deserialize;

use super::document::Document;
use super::error::InputError;
use super::feed_format::{FeedFormat, check_file, zone};
use super::relative_path::path_from;
use super::stamp::Stamp;
use super::table::Renames;
use super::time_format::TimeUnit;
use super::toml_text::{float, key, text};

/// `[market]`: the files of the tape, resolved, and how they are written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MarketFiles {
    /// Quotes.
    pub quotes: Option<PathBuf>,
    /// Trades.
    pub trades: Option<PathBuf>,
    /// Bars.
    pub bars: Option<PathBuf>,
    /// Whether they show what the orders of a log did to the market; none where nobody says.
    pub shows_own_orders: Option<bool>,
    /// How they are written.
    pub format: FeedFormat,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MarketTable {
    quotes: Option<String>,
    trades: Option<String>,
    bars: Option<String>,
    shows_own_orders: Option<bool>,
    stamp: Option<Stamp>,
    #[serde(default, deserialize_with = "zone")]
    zone: Option<Tz>,
    price_scale: Option<f64>,
    time_unit: Option<TimeUnit>,
    #[serde(default)]
    columns: Renames,
}

/// The files of a section, which must exist.
pub(super) fn market_files(document: &Document, market: MarketTable) -> Result<MarketFiles, InputError> {
    let format = FeedFormat::of(market.stamp, market.zone, market.time_unit, market.price_scale, market.columns);
    format.check(document, &["market"], market.bars.is_some())?;
    let resolve = |key: &str, named: Option<String>| -> Result<Option<PathBuf>, InputError> {
        let Some(named) = named else { return Ok(None) };
        check_file(document, &["market", key], &named)?;
        Ok(Some(document.resolve(named)))
    };
    Ok(MarketFiles {
        quotes: resolve("quotes", market.quotes)?,
        trades: resolve("trades", market.trades)?,
        bars: resolve("bars", market.bars)?,
        shows_own_orders: market.shows_own_orders,
        format,
    })
}

/// The keys of the section, its paths from `folder`.
pub(super) fn market_keys(market: &MarketFiles, folder: &Path) -> Vec<(&'static str, Option<String>)> {
    let path = |p: &Option<PathBuf>| p.as_ref().map(|p| text(&path_from(folder, p)));
    let format = &market.format;
    let unit = match format.time.unit {
        TimeUnit::Nanoseconds => None,
        TimeUnit::Microseconds => Some("us"),
        TimeUnit::Milliseconds => Some("ms"),
        TimeUnit::Seconds => Some("s"),
    };
    let renames: Vec<String> = format.columns.iter().map(|(name, own)| format!("{} = {}", key(name), text(own))).collect();
    vec![
        ("quotes", path(&market.quotes)),
        ("trades", path(&market.trades)),
        ("bars", path(&market.bars)),
        ("shows_own_orders", market.shows_own_orders.map(|shows| shows.to_string())),
        ("stamp", format.stamp.map(|stamp| text(stamp.word()))),
        ("zone", (format.time.zone != Tz::UTC).then(|| text(format.time.zone.name()))),
        ("time_unit", unit.map(text)),
        ("price_scale", (format.price_scale != 1.0).then(|| float(format.price_scale))),
        ("columns", (!renames.is_empty()).then(|| format!("{{ {} }}", renames.join(", ")))),
    ]
}
