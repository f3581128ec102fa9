//! RUN.toml: what a backtest or a paper run is made of.

use std::fmt;
use std::marker::PhantomData;
use std::path::Path;

use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, DeserializeSeed, IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::data_table::{DataEntry, DataTable, FeedKind, data_entries};
use super::document::{Document, HINT};
use super::error::InputError;
use super::execution_section::ExecutionSection;
use super::feed_format::check_file;
use super::feed_rules::span;
use super::halt_entry::{HaltEntry, HaltTable, halt_entries};
use super::instrument_entry::{InstrumentEntry, check_instruments, check_terms};
use super::posterior_section::check_posterior;
use super::quantity::{MechanismEntry, check_mechanisms};
use super::randomize_section::{RandomizeSection, RandomizeTable};
use super::rate_entry::{RateEntry, RateSource, RateTable, rate_entries};
use super::sweep_section::{SweepSection, SweepTable};
use super::twin_file::{AssumedPrice, Assumptions, TwinFile};
use crate::sim2real::randomize::Posterior;
use crate::sim2real::{Timestamp, written_instant};

/// A run, as its document declares it.
#[derive(Debug, Clone, PartialEq)]
pub struct RunFile {
    document: Document,
    /// `[run]`.
    pub run: RunSection,
    /// `[[instrument]]`.
    pub instruments: Vec<InstrumentEntry>,
    /// `[[data]]`.
    pub data: Vec<DataEntry>,
    /// `[[rate]]`: what foreign currencies are worth.
    pub rates: Vec<RateEntry>,
    /// `[[halt]]`: when instruments do not trade.
    pub halts: Vec<HaltEntry>,
    /// `kind` of `[strategy]`; its other keys are read by [`strategy_settings`](Self::strategy_settings).
    pub strategy: String,
    /// `[[mechanism]]`: what stands between decision and fill; [`listed`](Self::listed) has those of a twin too.
    pub mechanisms: Vec<MechanismEntry>,
    /// `[execution]`: what is known of how orders are executed.
    pub execution: ExecutionSection,
    /// The twin that `[execution]` brings.
    pub twin: Option<Box<TwinFile>>,
    /// `[assumptions]`, where the document is a twin too.
    pub assumptions: Option<Assumptions>,
    /// `[sweep]`: which values of all that are tried. A backtest has no use for it.
    pub sweep: Option<SweepSection>,
    /// `[posterior]`: what the fit that its mechanisms come from tells of their parameters together.
    pub posterior: Option<Posterior>,
    /// `[randomize]`: what is drawn anew for every draw, and how. A single run has no use for it.
    pub randomize: Option<RandomizeSection>,
}

/// `[run]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSection {
    /// Seed of all randomness.
    pub seed: u64,
    /// Cash at the start [currency].
    pub cash: f64,
    /// Currency of cash and prices.
    pub currency: String,
    /// Largest sum of positions over equity; none for 1, which borrows nothing.
    pub max_leverage: Option<f64>,
    /// The price mechanisms start from; none for what suits them and the data.
    pub price: Option<AssumedPrice>,
    /// Whether the data show what the orders of the run did to the market, which is then not added to them; none where nobody says,
    /// and a run takes it that they do not.
    pub shows_own_orders: Option<bool>,
    /// The first instant of data that counts; none for all from the first.
    #[serde(default, deserialize_with = "instant")]
    pub start: Option<Timestamp>,
    /// The instant from which on data no longer count; none for all to the last.
    #[serde(default, deserialize_with = "instant")]
    pub end: Option<Timestamp>,
    /// Data are read while the run goes, so that what is in memory does not grow with their length.
    #[serde(default)]
    pub stream: bool,
    /// Time for which the equity curve keeps its first, lowest, highest and last point alone [ns]; none for a point an event, or a
    /// minute where data are streamed.
    #[serde(default, deserialize_with = "span")]
    pub equity_every: Option<i64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunTable {
    run: RunSection,
    #[serde(default)]
    instrument: Vec<InstrumentEntry>,
    #[serde(default)]
    data: Vec<DataTable>,
    #[serde(default)]
    rate: Vec<RateTable>,
    #[serde(default)]
    halt: Vec<HaltTable>,
    strategy: StrategyKind,
    #[serde(default)]
    mechanism: Vec<MechanismEntry>,
    sweep: Option<SweepTable>,
    posterior: Option<Posterior>,
    randomize: Option<RandomizeTable>,
    #[serde(default)]
    execution: ExecutionSection,
    assumptions: Option<Assumptions>,
    /// Read by [`TwinFile`].
    twin: Option<IgnoredAny>,
    market: Option<IgnoredAny>,
    /// Read by whoever knows what they mean.
    #[serde(rename = "matching")]
    _matching: Option<IgnoredAny>,
    #[serde(rename = "latency")]
    _latency: Option<IgnoredAny>,
    #[serde(rename = "paper")]
    _paper: Option<IgnoredAny>,
}

#[derive(Deserialize)]
struct StrategyKind {
    kind: String,
}

impl RunFile {
    /// Reads RUN.toml, and holds it to what can be held without reading the files it names; these must exist.
    ///
    /// # Errors
    /// As [`read_toml`](super::read_toml); values out of their range; instruments and data that do not belong together.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        Self::of_document(Document::read(path)?)
    }

    /// As [`read`](Self::read), but the files of market data need not exist: their rows come from elsewhere.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_without_market(path: impl AsRef<Path>) -> Result<Self, InputError> {
        Self::parse(Document::read(path)?)?.resolved(|kind| kind == FeedKind::Actions)
    }

    /// As [`read`](Self::read), of a document that was read.
    pub(super) fn of_document(document: Document) -> Result<Self, InputError> {
        Self::parse(document)?.resolved(|_| true)
    }

    /// The same with paths that start from where the program runs; files that it names must exist, of data those whose kind `must`.
    fn resolved(self, must: impl Fn(FeedKind) -> bool) -> Result<Self, InputError> {
        let run = self;
        for (index, data) in run.data.iter().enumerate().filter(|(_, data)| must(data.kind)) {
            let number = index.to_string();
            data.check_files(&run.document, &number)?;
        }
        for (index, instrument) in run.instruments.iter().enumerate() {
            if let Some(named) = instrument.calendar_file() {
                check_file(&run.document, &["instrument", &index.to_string(), "calendar"], named)?;
            }
        }
        for (index, rate) in run.rates.iter().enumerate() {
            if let RateSource::File { path, .. } = &rate.source {
                check_file(&run.document, &["rate", &index.to_string(), "file"], &path.to_string_lossy())?;
            }
        }
        for (index, halt) in run.halts.iter().enumerate() {
            if let HaltEntry::File { path, .. } = halt {
                check_file(&run.document, &["halt", &index.to_string(), "file"], &path.to_string_lossy())?;
            }
        }
        let whence = |rate: RateEntry| match rate.source {
            RateSource::File { path, named, time, columns } => {
                let path = run.document.resolve(&path);
                RateEntry { source: RateSource::File { path, named, time, columns }, ..rate }
            }
            source => RateEntry { source, ..rate },
        };
        let rates = run.rates.into_iter().map(whence).collect();
        let halts = run.halts.into_iter().map(|halt| halt.resolved(&run.document)).collect();
        let data = run.data.into_iter().map(|data| data.resolved(&run.document)).collect();
        let twin = run.execution.read_twin(&run.document)?.map(Box::new);
        Ok(Self { data, rates, halts, twin, ..run })
    }

    /// The run of a document; the files it names are neither looked for nor resolved.
    pub(super) fn parse(document: Document) -> Result<Self, InputError> {
        if document.has("twin") && !document.has("run") {
            return Err(no_run(&document));
        }
        let table: RunTable = document.parse()?;
        check_twin_sections(&document, &table)?;
        let RunTable { run, instrument, data, rate, halt, strategy, mechanism, sweep, execution, assumptions, .. } = table;
        check_posterior(&document, table.posterior.as_ref())?;
        let posterior = table.posterior;
        let randomize = table.randomize.map(|table| RandomizeSection::of(&document, table)).transpose()?;
        if !run.cash.is_finite() || run.cash < 0.0 {
            let error = document.error(&["run", "cash"], "expected a finite number that is not negative");
            return Err(error.found(run.cash).hint("it is what the run starts with"));
        }
        if let Some(leverage) = run.max_leverage.filter(|leverage| !leverage.is_finite() || *leverage <= 0.0) {
            let error = document.error(&["run", "max_leverage"], "expected a finite number greater than 0");
            return Err(error.found(leverage).hint("1 borrows nothing; 2 holds positions of up to twice the equity"));
        }
        if let (Some(start), Some(end)) = (run.start, run.end)
            && start >= end
        {
            return Err(document
                .error(&["run", "end"], format!("expected an end after the start, {start}"))
                .found(end)
                .hint("swap or correct them"));
        }
        check_instruments(&document, &instrument)?;
        check_terms(&document, &instrument)?;
        let rates = rate_entries(&document, &run.currency, rate, &instrument)?;
        let halts = halt_entries(&document, halt, &instrument)?;
        check_mechanisms(&document, &mechanism)?;
        let data = data_entries(&document, data, &instrument, run.end)?;
        if data.is_empty() {
            return Err(document.error(&[], "the run names no data").hint("add a [[data]] section"));
        }
        let sweep = sweep.map(|table| SweepSection::of(&document, table)).transpose()?;
        let strategy = strategy.kind;
        let (instruments, mechanisms, twin) = (instrument, mechanism, None);
        let run = Self {
            document,
            run,
            instruments,
            data,
            rates,
            halts,
            strategy,
            mechanisms,
            execution,
            twin,
            assumptions,
            sweep,
            posterior,
            randomize,
        };
        run.sweep.iter().try_for_each(|sweep| run.check_sweep(sweep))?;
        Ok(run)
    }

    /// All `[[mechanism]]` entries that stand between decision and fill, each with its document and its number in it: those of
    /// the run, then those of the twin it brings.
    pub fn listed(&self) -> impl Iterator<Item = (&Document, usize, &MechanismEntry)> {
        let of_twin =
            self.twin.iter().flat_map(|twin| twin.mechanisms.iter().enumerate().map(|(k, m)| (twin.document(), k, m)));
        self.mechanisms.iter().enumerate().map(|(k, m)| (&self.document, k, m)).chain(of_twin)
    }

    /// The `[assumptions]` that hold of its orders, each with its document.
    pub fn assumed(&self) -> impl Iterator<Item = (&Document, &Assumptions)> {
        let of_twin = self.twin.iter().filter_map(|twin| Some((twin.document(), twin.assumptions.as_ref()?)));
        self.assumptions.iter().map(|own| (&self.document, own)).chain(of_twin)
    }

    /// The document.
    #[must_use]
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// The keys of `[strategy]`, other than `kind`, as the settings of a strategy.
    ///
    /// # Errors
    /// Whatever `T` refuses, with line and column.
    pub fn strategy_settings<T: DeserializeOwned>(&self) -> Result<T, InputError> {
        self.document.parse::<OnlyStrategy<T>>().map(|only| only.strategy.0).map_err(|error| {
            // A key that was read to be left out or passed on no longer knows its place.
            let unknown = error.message.strip_prefix("unknown key `").and_then(|rest| rest.strip_suffix('`'));
            match unknown.map(|key| self.document.error(&["strategy", key], "").place) {
                Some(place) => error.at(place),
                None => error,
            }
        })
    }

    /// `[matching]`, how orders are matched; the default where there is none.
    ///
    /// # Errors
    /// Whatever `T` refuses, with line and column.
    pub fn matching<T: DeserializeOwned + Default>(&self) -> Result<T, InputError> {
        self.document.parse::<OnlyMatching<T>>().map(|only| only.matching)
    }

    /// `[latency]`, how long messages take; the default where there is none.
    ///
    /// # Errors
    /// Whatever `T` refuses, with line and column.
    pub fn latency<T: DeserializeOwned + Default>(&self) -> Result<T, InputError> {
        self.document.parse::<OnlyLatency<T>>().map(|only| only.latency)
    }

    /// `[paper]`, what holds a paper run within bounds; the default where there is none. A backtest has no use for it.
    ///
    /// # Errors
    /// Whatever `T` refuses, with line and column.
    pub fn paper<T: DeserializeOwned + Default>(&self) -> Result<T, InputError> {
        self.document.parse::<OnlyPaper<T>>().map(|only| only.paper)
    }

    /// An error about the key at `keys`, such as `["strategy", "kind"]`.
    #[must_use]
    pub fn error(&self, keys: &[&str], message: impl Into<String>) -> InputError {
        self.document.error(keys, message)
    }
}

/// The error of a twin that is to be run.
fn no_run(document: &Document) -> InputError {
    let name = document.path().file_name().unwrap_or_default().to_string_lossy();
    let error = document.error(&["twin"], "a twin says how orders are executed, and not what is run: there is no [run]");
    error.hint(format!("name it in a RUN.toml, with the two lines [execution] and twin = \"{name}\""))
}

/// Holds the sections of a twin to stand in a document that is one.
fn check_twin_sections(document: &Document, table: &RunTable) -> Result<(), InputError> {
    let sections = [("assumptions", table.assumptions.is_some()), ("market", table.market.is_some())];
    match sections.into_iter().find(|(_, there)| *there && table.twin.is_none()) {
        None => Ok(()),
        Some((section, _)) => {
            let error = document.error(&[section], format!("a run has no section [{section}], unless it is a twin too"));
            Err(error.hint("add [twin] with model = \"execution\", or drop the section"))
        }
    }
}

/// Reads an instant that need not be there.
pub(super) fn instant<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Timestamp>, D::Error> {
    let refused = |found: &str| {
        let hint = "such as \"2024-03-08T14:30:00Z\" (RFC 3339)";
        format!("invalid value: {found:?}, expected an instant{HINT}{hint}")
    };
    written_instant(deserializer, refused).map(Some)
}

#[derive(Deserialize)]
#[serde(bound = "T: Deserialize<'de>")]
struct OnlyStrategy<T> {
    strategy: Settings<T>,
}

#[derive(Deserialize)]
#[serde(bound = "T: Deserialize<'de> + Default")]
struct OnlyMatching<T> {
    #[serde(default)]
    matching: T,
}

#[derive(Deserialize)]
#[serde(bound = "T: Deserialize<'de> + Default")]
struct OnlyLatency<T> {
    #[serde(default)]
    latency: T,
}

#[derive(Deserialize)]
#[serde(bound = "T: Deserialize<'de> + Default")]
struct OnlyPaper<T> {
    #[serde(default)]
    paper: T,
}

/// A `T` read from a table without its key `kind`.
struct Settings<T>(T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Settings<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Table<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Table<T> {
            type Value = Settings<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Settings<T>, A::Error> {
                T::deserialize(MapAccessDeserializer::new(WithoutKind(map))).map(Settings)
            }
        }
        deserializer.deserialize_map(Table(PhantomData))
    }
}

struct WithoutKind<A>(A);

impl<'de, A: MapAccess<'de>> MapAccess<'de> for WithoutKind<A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        // The key is read as text first: a seed is spent by the key it reads.
        loop {
            let Some(key) = self.0.next_key::<String>()? else { return Ok(None) };
            if key != "kind" {
                return seed.deserialize(serde::de::value::StringDeserializer::new(key)).map(Some);
            }
            self.0.next_value::<IgnoredAny>()?;
        }
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.0.next_value_seed(seed)
    }
}
