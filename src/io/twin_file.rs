//! TWIN.toml: a simulator, its parameters as it has them today, and what it already models.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use chrono_tz::Tz;
use serde::{Deserialize, Serialize};

use super::controller_entry::ControllerEntry;
use super::document::Document;
use super::equation_sections::{AttachEntry, EquationSections, InputEntry, Named, OutputEntry, StateEntry, in_order};
use super::error::InputError;
use super::feed_format::{FeedFormat, check_file, zone};
use super::instrument_entry::{InstrumentEntry, check_instruments, check_no_terms};
use super::quantity::{MechanismEntry, Quantity, check_mechanisms};
use super::relative_path::path_from;
use super::stamp::Stamp;
use super::table::Renames;
use super::time_format::TimeUnit;
use super::unit::check_unit;

/// A twin, as its document declares it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TwinFile {
    document: Document,
    /// `model` of `[twin]`: the plant's name.
    pub model: String,
    /// `step` of `[twin]`: the longest step of integration [s], where one is given.
    pub step: Option<f64>,
    /// `[parameters]`: nominal values.
    pub parameters: BTreeMap<String, Quantity>,
    /// `[channels]`: which columns of a recording are which.
    pub channels: BTreeMap<String, ChannelEntry>,
    /// The sections of a twin given as equations; empty of any other.
    pub equations: EquationSections,
    /// `[controller]`: what closes the loop, where it is closed.
    pub controller: Option<ControllerEntry>,
    /// `[[mechanism]]`: what the twin models already.
    pub mechanisms: Vec<MechanismEntry>,
    /// `[assumptions]`: what a backtest assumes of every order.
    pub assumptions: Option<Assumptions>,
    /// `[[instrument]]`.
    pub instruments: Vec<InstrumentEntry>,
    /// `[market]`: the tape the backtest ran on.
    pub market: Option<MarketFiles>,
}

/// One of `[channels]`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelEntry {
    /// Column of the recording.
    pub column: String,
    /// Unit of its values, where one is claimed.
    pub unit: Option<String>,
}

/// `[assumptions]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Assumptions {
    /// The price of every fill.
    pub price: AssumedPrice,
    /// Commission [1e-4 of the traded value].
    pub commission_bps: Option<f64>,
    /// Commission [currency per unit traded].
    pub commission_per_share: Option<f64>,
}

/// The price that a backtest assumes for a fill, in force when the order was decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AssumedPrice {
    /// The middle of bid and ask.
    Mid,
    /// The ask for a buy, the bid for a sell.
    Touch,
    /// The last trade.
    Last,
    /// The close of the bar.
    BarClose,
    /// The open of the next bar.
    NextOpen,
}

impl AssumedPrice {
    /// The word for it in documents.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Mid => "mid",
            Self::Touch => "touch",
            Self::Last => "last",
            Self::BarClose => "bar_close",
            Self::NextOpen => "next_open",
        }
    }
}

/// `[market]`: the files of the tape, resolved, and how they are written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MarketFiles {
    /// Quotes.
    pub quotes: Option<PathBuf>,
    /// Trades.
    pub trades: Option<PathBuf>,
    /// Bars.
    pub bars: Option<PathBuf>,
    /// How they are written.
    pub format: FeedFormat,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TwinTable {
    twin: TwinSection,
    #[serde(default)]
    parameters: BTreeMap<String, Quantity>,
    #[serde(default)]
    channels: BTreeMap<String, ChannelEntry>,
    #[serde(default)]
    states: Named<StateEntry>,
    #[serde(default)]
    inputs: Named<InputEntry>,
    #[serde(default)]
    definitions: Named<String>,
    #[serde(default)]
    derivatives: Named<String>,
    #[serde(default)]
    next: Named<String>,
    #[serde(default)]
    outputs: Named<OutputEntry>,
    attach: Option<AttachEntry>,
    controller: Option<ControllerEntry>,
    #[serde(default)]
    mechanism: Vec<MechanismEntry>,
    assumptions: Option<Assumptions>,
    #[serde(default)]
    instrument: Vec<InstrumentEntry>,
    market: Option<MarketTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TwinSection {
    model: String,
    step: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MarketTable {
    quotes: Option<String>,
    trades: Option<String>,
    bars: Option<String>,
    stamp: Option<Stamp>,
    #[serde(default, deserialize_with = "zone")]
    zone: Option<Tz>,
    price_scale: Option<f64>,
    time_unit: Option<TimeUnit>,
    #[serde(default)]
    columns: Renames,
}

impl TwinFile {
    /// Reads TWIN.toml, and holds it to what can be held without knowing its model; the files it names must exist.
    ///
    /// # Errors
    /// As [`read_toml`](super::read_toml), and values out of their range.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        Self::parse(Document::read(path)?)
    }

    /// The twin of a document.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(document: Document) -> Result<Self, InputError> {
        let table: TwinTable = document.parse()?;
        for (name, quantity) in &table.parameters {
            quantity.check(&document, &["parameters", name])?;
        }
        if let Some(step) = table.twin.step.filter(|step| !step.is_finite() || *step <= 0.0) {
            let error = document.error(&["twin", "step"], "expected a step of integration above 0").found(step);
            return Err(error.hint("it is the longest step in seconds; left out, it follows from the distance of rows"));
        }
        check_mechanisms(&document, &table.mechanism)?;
        check_instruments(&document, &table.instrument)?;
        check_no_terms(&document, &table.instrument)?;
        if let Some(assumptions) = &table.assumptions {
            check_assumptions(&document, assumptions)?;
        }
        let equations = EquationSections {
            states: in_order(table.states),
            inputs: in_order(table.inputs),
            definitions: in_order(table.definitions),
            derivatives: in_order(table.derivatives),
            next: in_order(table.next),
            outputs: in_order(table.outputs),
            attach: table.attach,
        };
        equations.check(&document)?;
        if let Some(section) = equations.first().filter(|_| table.twin.model != "equations") {
            let error = document.error(&[section], format!("the model `{}` has no section [{section}]", table.twin.model));
            return Err(error.hint("it is for `model = \"equations\"`"));
        }
        if let Some(controller) = &table.controller {
            if table.twin.model == "execution" {
                let error = document.error(&["controller"], "orders have no controller");
                return Err(error.hint("leave [controller] out: it closes the loop of what moves"));
            }
            controller.check(&document)?;
        }
        let market = table.market.map(|market| market_files(&document, market)).transpose()?;
        Ok(Self {
            document,
            model: table.twin.model,
            step: table.twin.step,
            parameters: table.parameters,
            channels: table.channels,
            equations,
            controller: table.controller,
            mechanisms: table.mechanism,
            assumptions: table.assumptions,
            instruments: table.instrument,
            market,
        })
    }

    /// The document.
    #[must_use]
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// An error about the key at `keys`, such as `["mechanism", "0", "torque"]`; entries of lists go by number.
    #[must_use]
    pub fn error(&self, keys: &[&str], message: impl Into<String>) -> InputError {
        self.document.error(keys, message)
    }

    /// Holds the unit claimed at `keys` to be the one expected.
    ///
    /// # Errors
    /// Another unit, with how to convert where that is known.
    pub fn check_unit(&self, keys: &[&str], found: Option<&str>, expected: &str) -> Result<(), InputError> {
        check_unit(found, expected).map_err(|mismatch| {
            let error = self.error(keys, format!("expected the unit `{}`", mismatch.expected));
            error.found(format_args!("`{}`", mismatch.found)).hint(mismatch.hint)
        })
    }

    /// The twin as TOML, to be written into `folder`: reads back as this twin, files and all.
    #[must_use]
    pub fn render(&self, folder: &Path) -> String {
        let mut out = String::new();
        section(&mut out, "[twin]", [("model", Some(text(&self.model))), ("step", self.step.map(float))]);
        let parameters = self.parameters.iter().map(|(name, q)| (name.as_str(), Some(table_form(q))));
        section(&mut out, "[parameters]", parameters);
        let channels = self.channels.iter().map(|(name, channel)| {
            let unit = channel.unit.as_ref().map(|unit| format!(", unit = {}", text(unit))).unwrap_or_default();
            (name.as_str(), Some(format!("{{ column = {}{unit} }}", text(&channel.column))))
        });
        section(&mut out, "[channels]", channels);
        self.equations.render(&mut out);
        if let Some(controller) = &self.controller {
            controller.render(&mut out);
        }
        for mechanism in &self.mechanisms {
            let parameters = mechanism.parameters.iter().map(|(key, q)| (key.as_str(), Some(short_form(q))));
            section(&mut out, "[[mechanism]]", [("name", Some(text(&mechanism.name)))].into_iter().chain(parameters));
        }
        if let Some(assumptions) = &self.assumptions {
            let keys = [
                ("price", Some(text(assumptions.price.word()))),
                ("commission_bps", assumptions.commission_bps.map(float)),
                ("commission_per_share", assumptions.commission_per_share.map(float)),
            ];
            section(&mut out, "[assumptions]", keys);
        }
        for instrument in &self.instruments {
            let keys = [
                ("symbol", Some(text(&instrument.symbol))),
                ("tick_size", Some(float(instrument.tick_size))),
                ("lot_size", Some(float(instrument.lot_size))),
                ("average_daily_volume", instrument.average_daily_volume.map(float)),
                ("daily_volatility", instrument.daily_volatility.map(float)),
            ];
            section(&mut out, "[[instrument]]", keys);
        }
        if let Some(market) = &self.market {
            section(&mut out, "[market]", market_keys(market, folder));
        }
        out
    }
}

fn check_assumptions(document: &Document, assumptions: &Assumptions) -> Result<(), InputError> {
    let costs = [("commission_bps", assumptions.commission_bps), ("commission_per_share", assumptions.commission_per_share)];
    for (key, value) in costs {
        if let Some(value) = value.filter(|v| !v.is_finite()) {
            return Err(document.error(&["assumptions", key], "expected a finite number").found(value).hint("0 for none"));
        }
    }
    if costs.iter().all(|(_, value)| value.is_some()) {
        let error = document.error(&["assumptions", "commission_per_share"], "the commission is given twice");
        return Err(error.hint("give `commission_bps` or `commission_per_share`"));
    }
    Ok(())
}

fn market_files(document: &Document, market: MarketTable) -> Result<MarketFiles, InputError> {
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
        format,
    })
}

/// Adds a section, unless it has no keys; keys without a value are left out.
pub(super) fn section<'a>(out: &mut String, head: &str, keys: impl IntoIterator<Item = (&'a str, Option<String>)>) {
    let lines: Vec<String> =
        keys.into_iter().filter_map(|(name, value)| Some(format!("{} = {}\n", key(name), value?))).collect();
    if lines.is_empty() {
        return;
    }
    let blank = if out.is_empty() { "" } else { "\n" };
    // Writing to a String cannot fail.
    let _ = write!(out, "{blank}{head}\n{}", lines.concat());
}

fn market_keys(market: &MarketFiles, folder: &Path) -> Vec<(&'static str, Option<String>)> {
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
        ("stamp", format.stamp.map(|stamp| text(stamp.word()))),
        ("zone", (format.time.zone != Tz::UTC).then(|| text(format.time.zone.name()))),
        ("time_unit", unit.map(text)),
        ("price_scale", (format.price_scale != 1.0).then(|| float(format.price_scale))),
        ("columns", (!renames.is_empty()).then(|| format!("{{ {} }}", renames.join(", ")))),
    ]
}

fn table_form(quantity: &Quantity) -> String {
    let unit = quantity.unit.as_ref().map(|unit| format!(", unit = {}", text(unit))).unwrap_or_default();
    format!("{{ value = {}{unit}, uncertainty = {} }}", float(quantity.value), float(quantity.uncertainty))
}

/// A bare number where it is known exactly.
pub(super) fn exact_form(quantity: &Quantity) -> String {
    let bare = quantity.unit.is_none() && quantity.uncertainty == 0.0;
    if bare { float(quantity.value) } else { table_form(quantity) }
}

/// A bare number where nothing more is known than that.
fn short_form(quantity: &Quantity) -> String {
    if *quantity == Quantity::bare(quantity.value) { float(quantity.value) } else { table_form(quantity) }
}

/// A finite number, in the shortest form that reads back as the same bits.
pub(super) fn float(value: f64) -> String {
    format!("{value:?}")
}

/// A basic string of one line, which may be a key too.
pub(super) fn text(value: &str) -> String {
    let mut out = String::from('"');
    for c in value.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => {
                // Writing to a String cannot fail.
                let _ = write!(out, "\\u{:04x}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
    if bare { name.to_owned() } else { text(name) }
}
