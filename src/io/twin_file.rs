//! TWIN.toml: a simulator, its parameters as it has them today, and what it already models.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::controller_entry::ControllerEntry;
use super::data_table::{DataEntry, DataTable, data_entries};
use super::document::Document;
use super::equation_sections::{AttachEntry, EquationSections, InputEntry, Named, OutputEntry, StateEntry, in_order};
use super::error::InputError;
use super::instrument_entry::{InstrumentEntry, check_instruments, check_no_terms};
use super::market_files::{MarketFiles, MarketTable, market_files, market_keys};
use super::posterior_section::{check_posterior, posterior_keys};
use super::quantity::{MechanismEntry, Quantity, check_mechanisms};
use super::randomize_section::{RandomizeSection, RandomizeTable};
use super::run_file::RunFile;
use super::toml_text::{float, section, short_form, table_form, text};
use super::unit::check_unit;
use crate::sim2real::randomize::Posterior;

/// A twin, as its document declares it: a TWIN.toml, or a RUN.toml, which says how its orders are executed.
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
    /// `[[data]]`: the tape instrument by instrument, where no `[market]` names one.
    pub data: Vec<DataEntry>,
    /// `[posterior]`: what the fit that the twin comes from tells of its parameters together.
    pub posterior: Option<Posterior>,
    /// `[randomize]`: what is drawn anew for every environment, and how.
    pub randomize: Option<RandomizeSection>,
    /// The run that the document is, where it is one.
    pub run: Option<Box<RunFile>>,
    /// Keys of the document that what has been fitted says instead, such as `["latency", "order"]`.
    pub superseded: Vec<[&'static str; 2]>,
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
    #[serde(default)]
    data: Vec<DataTable>,
    posterior: Option<Posterior>,
    randomize: Option<RandomizeTable>,
}

/// What a document that is a run says as a twin.
#[derive(Deserialize)]
struct TwinOfRun {
    twin: Option<TwinSection>,
    market: Option<MarketTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TwinSection {
    model: String,
    step: Option<f64>,
}

impl TwinFile {
    /// Reads TWIN.toml, or RUN.toml as the twin of how its orders are executed, and holds it to what can be held without knowing its model; the files it names must exist.
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
        if document.has("run") {
            return Self::of_run(RunFile::of_document(document)?);
        }
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
        if !table.data.is_empty() && table.twin.model != "execution" {
            let error = document.error(&["data"], format!("the model `{}` has no section [[data]]", table.twin.model));
            return Err(error.hint("it is for `model = \"execution\"`; name recordings with --recording"));
        }
        let data = data_entries(&document, table.data, &table.instrument, None)?;
        for (number, entry) in data.iter().enumerate() {
            entry.check_files(&document, &number.to_string())?;
        }
        let data = data.into_iter().map(|entry| entry.resolved(&document)).collect();
        check_posterior(&document, table.posterior.as_ref())?;
        let randomize = table.randomize.map(|table| RandomizeSection::of(&document, table)).transpose()?;
        Ok(Self {
            document,
            data,
            posterior: table.posterior,
            randomize,
            run: None,
            superseded: Vec::new(),
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

    /// The twin of how the orders of `run` are executed.
    fn of_run(run: RunFile) -> Result<Self, InputError> {
        let document = run.document().clone();
        let TwinOfRun { twin, market } = document.parse()?;
        let model = "execution";
        if let Some(twin) = twin.filter(|twin| twin.model != model) {
            let error = document.error(&["twin", "model"], format!("what is run is a twin of the model `{model}`"));
            return Err(error.found_text(&twin.model).hint("drop [twin], or the sections of the run"));
        }
        let market = market.map(|market| market_files(&document, market)).transpose()?;
        Ok(Self {
            model: model.to_owned(),
            mechanisms: run.mechanisms.clone(),
            assumptions: run.assumptions,
            instruments: run.instruments.clone(),
            data: run.data.clone(),
            posterior: run.posterior.clone(),
            randomize: run.randomize.clone(),
            document,
            market,
            run: Some(Box::new(run)),
            ..Self::default()
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

    /// Whether its tape, or the data of the run that it is, show what own orders did; none where nobody says.
    #[must_use]
    pub fn shows_own_orders(&self) -> Option<bool> {
        let of_tape = self.market.as_ref().and_then(|market| market.shows_own_orders);
        of_tape.or_else(|| self.run.as_ref().and_then(|run| run.run.shows_own_orders))
    }

    /// The twin as TOML, to be written into `folder`: reads back as this twin, files and all. What is a run, or names its tape
    /// instrument by instrument, is its document with what has changed, and the rest to the letter.
    ///
    /// # Errors
    /// If the document is none any more.
    pub fn render(&self, folder: &Path) -> Result<String, InputError> {
        if self.run.is_some() || !self.data.is_empty() { self.changed_document(folder) } else { Ok(self.written(folder)) }
    }

    /// The twin as it is written anew.
    fn written(&self, folder: &Path) -> String {
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
        if let Some(posterior) = &self.posterior {
            section(&mut out, "[posterior]", posterior_keys(posterior));
        }
        if let Some(randomize) = &self.randomize {
            out.push('\n');
            out.push_str(&randomize.render(&self.document, folder));
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
