//! What a backtest leaves on disk: its summary, and its orders, fills and equity in the form of an execution log.

use std::collections::BTreeMap;

use chrono_tz::Tz;
use serde::{Serialize, Serializer};

use crate::io::{InputError, OutputFolder, OutputTable};
use crate::report::{BacktestPage, Metric, ReportError};

use super::draws::{DrawsSummary, RunDraws};
use super::metric::{Counts, CurrencySummary, InstrumentSummary, Metrics, RoundTrip};
use super::run_figures::key_figures;
use super::run_page::{run_page, title};
use super::{Backtest, DataSummary, HaltSummary, Instrument, MoneyError, Price, Record, Reference};

/// A file a run depends on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct InputFile {
    /// Path, as the run names it.
    pub path: String,
    /// SHA-256 of its bytes, in hexadecimal digits.
    pub sha256: String,
    /// Rows read, those outside `start` and `end` among them; none where it is no table.
    pub rows: Option<usize>,
}

/// What a run was made of: the part of its summary that is not a result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Seed of all randomness.
    pub seed: u64,
    /// Currency of all amounts.
    pub currency: String,
    /// The strategy's `kind`.
    pub strategy: String,
    /// Ids of the mechanisms between decision and fill.
    pub mechanisms: Vec<String>,
    /// The price mechanisms start from where there are quotes; with bars only it is the open.
    pub reference: Reference,
    /// The zone months are counted in: that of the data's times, UTC where they differ.
    #[serde(serialize_with = "zone_name")]
    pub zone: Tz,
    /// The calendar of each instrument that has one, by its symbol.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub calendars: BTreeMap<String, String>,
    /// Every file it read.
    pub inputs: Vec<InputFile>,
}

fn zone_name<S: Serializer>(zone: &Tz, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(zone.name())
}

/// `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunSummary {
    /// [`RunSummary::SCHEMA`].
    pub schema: &'static str,
    /// What it was made of.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// The figures.
    pub metrics: Metrics,
    /// How many of everything.
    pub counts: Counts,
    /// Cash, dividends, tax and charges, currency by currency.
    pub account: Vec<CurrencySummary>,
    /// Instrument by instrument.
    pub instruments: Vec<InstrumentSummary>,
    /// Its halts, and what came in them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub halts: Vec<HaltSummary>,
    /// What was found in the data, file by file.
    pub data: Vec<DataSummary>,
    /// What randomized executions came to; none of a run alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub draws: Option<DrawsSummary>,
}

impl RunSummary {
    /// The schema, with its version.
    pub const SCHEMA: &'static str = "trueup.run/1";

    /// The summary of `record`.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn new(provenance: Provenance, record: &Record, instruments: &[Instrument]) -> Result<Self, MoneyError> {
        let account = CurrencySummary::of(record, &provenance.currency)?;
        Ok(Self {
            schema: Self::SCHEMA,
            provenance,
            metrics: Metrics::of(record)?,
            counts: Counts::of(record),
            account,
            instruments: InstrumentSummary::of(record, instruments)?,
            halts: HaltSummary::of(record, instruments),
            data: DataSummary::of(record, instruments),
            draws: None,
        })
    }

    /// `run.json` as text.
    ///
    /// # Errors
    /// If it is no JSON, which would be a bug.
    pub fn json(&self) -> Result<String, OutputError> {
        Ok(format!("{}\n", serde_json::to_string_pretty(self)?))
    }
}

/// A run in a sentence and its key figures: what is shown where nothing is written.
#[derive(Debug, Clone, PartialEq)]
pub struct RunBrief {
    /// `run.json`.
    pub summary: RunSummary,
    /// What was traded, when, and how it went.
    pub title: String,
    /// The figures that come first.
    pub metrics: Vec<Metric>,
}

impl RunBrief {
    /// `record`, the record of `backtest`, in brief.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn new(provenance: Provenance, backtest: &Backtest, record: &Record) -> Result<Self, MoneyError> {
        let summary = RunSummary::new(provenance, record, backtest.instruments())?;
        Ok(Self { title: title(&summary, backtest, record), metrics: key_figures(&summary), summary })
    }
}

/// All that a run is shown as.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOutputs {
    /// `run.json`.
    pub summary: RunSummary,
    /// `orders.parquet`.
    pub orders: OutputTable,
    /// `fills.parquet`.
    pub fills: OutputTable,
    /// `trades.parquet`.
    pub trades: OutputTable,
    /// `equity.parquet`.
    pub equity: OutputTable,
    /// `draws.parquet`, of a run with randomized executions.
    pub draws: Option<OutputTable>,
    /// `report.html`.
    pub page: BacktestPage,
}

/// Outputs that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// A file that cannot be written.
    #[error(transparent)]
    File(#[from] InputError),
    /// A page that cannot be rendered.
    #[error(transparent)]
    Page(#[from] ReportError),
    /// A summary that is no JSON.
    #[error("run.json cannot be written: {0}\nhint: this is a bug in trueup, not in the input")]
    Summary(#[from] serde_json::Error),
}

impl RunOutputs {
    /// The files there will be.
    pub const FILES: [&str; 6] =
        ["run.json", "orders.parquet", "fills.parquet", "trades.parquet", "equity.parquet", "report.html"];

    /// What `record`, the record of `backtest`, is shown as.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn new(provenance: Provenance, backtest: &Backtest, record: &Record) -> Result<Self, MoneyError> {
        let summary = RunSummary::new(provenance, record, backtest.instruments())?;
        let trips = RoundTrip::of(record)?;
        Ok(Self {
            orders: record.orders_table(backtest.instruments(), &summary.provenance.strategy),
            fills: record.fills_table(),
            trades: trades_table(&trips, &summary),
            equity: record.equity_table(),
            draws: None,
            page: run_page(&summary, backtest, record, &trips),
            summary,
        })
    }

    /// The file there is besides, of a run with randomized executions.
    pub const DRAWS: &str = "draws.parquet";

    /// The same with what randomized executions of the run came to.
    #[must_use]
    pub fn with_draws(mut self, draws: &RunDraws) -> Self {
        let summary = draws.summary(&self.summary.metrics);
        self.page.draws = Some(draws.page(&summary, &self.page));
        self.draws = Some(draws.table());
        self.summary.draws = Some(summary);
        self
    }

    /// `run.json` as text.
    ///
    /// # Errors
    /// As [`RunSummary::json`].
    pub fn json(&self) -> Result<String, OutputError> {
        self.summary.json()
    }

    /// Adds all files to `folder`.
    ///
    /// # Errors
    /// As [`OutputFolder::file`], and a page or summary that cannot be made.
    pub fn write(&self, folder: &mut OutputFolder) -> Result<(), OutputError> {
        let [summary, orders, fills, trades, equity, page] = Self::FILES;
        folder.file(summary, self.json()?.as_bytes())?;
        folder.table(orders, &self.orders)?;
        folder.table(fills, &self.fills)?;
        folder.table(trades, &self.trades)?;
        folder.table(equity, &self.equity)?;
        if let Some(draws) = &self.draws {
            folder.table(Self::DRAWS, draws)?;
        }
        folder.file(page, self.page.render()?.as_bytes())?;
        Ok(())
    }
}

/// `trades`, the round trips in the order in which they were entered: `trade_id, symbol, side ("long", "short"), entered_at,
/// exited_at, seconds, qty, entry_price, exit_price, gross, fees, net, return, fills, currency, rate`; `exited_at` is empty where
/// something is still held, and `gross` then counts it at its last price. Amounts are in `currency`, and `rate` is what one
/// unit of that was worth at the end of the trip in the currency of the run.
fn trades_table(trips: &[RoundTrip], summary: &RunSummary) -> OutputTable {
    let of = |k: usize| summary.instruments.get(k);
    let symbol = |k: usize| of(k).map(|i| i.symbol.clone());
    let base = &summary.provenance.currency;
    let currency = |k: usize| of(k).map(|i| i.currency.as_ref().unwrap_or(base).clone());
    OutputTable::new()
        .integers("trade_id", (1..=trips.len()).map(|k| k as i64))
        .texts("symbol", trips.iter().map(|t| symbol(t.instrument)))
        .texts("side", trips.iter().map(|t| t.word().to_owned()))
        .times("entered_at", trips.iter().map(|t| t.entered_at))
        .times("exited_at", trips.iter().map(|t| t.exited_at))
        .floats("seconds", trips.iter().map(|t| t.seconds))
        .floats("qty", trips.iter().map(|t| t.quantity))
        .floats("entry_price", trips.iter().map(|t| t.entry_price))
        .floats("exit_price", trips.iter().map(|t| t.exit_price))
        .floats("gross", trips.iter().map(|t| t.gross.to_f64()))
        .floats("fees", trips.iter().map(|t| t.fees.to_f64()))
        .floats("net", trips.iter().map(|t| t.net.to_f64()))
        .floats("return", trips.iter().map(RoundTrip::growth))
        .integers("fills", trips.iter().map(|t| t.fills as i64))
        .texts("currency", trips.iter().map(|t| currency(t.instrument)))
        .floats("rate", trips.iter().map(|t| t.rate))
}

impl Record {
    /// `orders`: `order_id, symbol, decided_at, side, qty, type, limit_price, submitted_at, strategy, seen_bid, seen_ask`,
    /// and beyond the contract's columns `status, filled_qty, stop_price, time_in_force, arrives_at, reason, sent_by ("strategy", "broker")`. Orders that were
    /// refused before they were sent are not here.
    #[must_use]
    pub fn orders_table(&self, instruments: &[Instrument], strategy: &str) -> OutputTable {
        let orders = &self.blotter.orders;
        let symbol = |k: usize| instruments.get(k).map(|i| i.symbol.clone());
        OutputTable::new()
            .integers("order_id", orders.iter().map(|o| o.order_id as i64))
            .texts("symbol", orders.iter().map(|o| symbol(o.instrument)))
            .times("decided_at", orders.iter().map(|o| o.decided_at))
            .texts("side", orders.iter().map(|o| o.side.word().to_owned()))
            .floats("qty", orders.iter().map(|o| o.quantity.to_f64()))
            .texts("type", orders.iter().map(|o| o.kind.word().to_owned()))
            .floats("limit_price", orders.iter().map(|o| o.kind.limit().map(Price::to_f64)))
            .times("submitted_at", orders.iter().map(|o| o.decided_at))
            .texts("strategy", orders.iter().map(|_| strategy.to_owned()))
            .floats("seen_bid", orders.iter().map(|o| o.seen_bid))
            .floats("seen_ask", orders.iter().map(|o| o.seen_ask))
            .texts("status", orders.iter().map(|o| o.status.word().to_owned()))
            .floats("filled_qty", orders.iter().map(|o| o.filled.to_f64()))
            .floats("stop_price", orders.iter().map(|o| o.kind.trigger().map(Price::to_f64)))
            .texts("time_in_force", orders.iter().map(|o| o.time_in_force.word().to_owned()))
            .times("arrives_at", orders.iter().map(|o| o.arrives_at))
            .texts("reason", orders.iter().map(|o| o.reason.map(|reason| reason.word().to_owned())))
            .texts("sent_by", orders.iter().map(|o| o.sender.word().to_owned()))
    }

    /// `fills`: `order_id, filled_at, qty, price, fee, liquidity, fill_id`, and beyond the contract's columns why it was filled
    /// then and at that price: `data` (what brought it about) and `data_row` (which row of these, from 0), `met` (open or mid it met),
    /// `band_low` and `band_high` (what the data show for that time), `queued_behind` (units ahead when it joined the queue), and
    /// `added_by_X`, what mechanism X added to the price, against the order positive.
    #[must_use]
    pub fn fills_table(&self) -> OutputTable {
        let fills = &self.blotter.fills;
        let table = OutputTable::new()
            .integers("order_id", fills.iter().map(|f| f.order_id as i64))
            .times("filled_at", fills.iter().map(|f| f.filled_at))
            .floats("qty", fills.iter().map(|f| f.quantity.to_f64()))
            .floats("price", fills.iter().map(|f| f.price.to_f64()))
            .floats("fee", fills.iter().map(|f| f.fee.nearest_f64()))
            .texts("liquidity", fills.iter().map(|f| f.why.role.word().to_owned()))
            .integers("fill_id", fills.iter().map(|f| f.fill_id as i64))
            .texts("data", fills.iter().map(|f| f.why.data.word().to_owned()))
            .integers("data_row", fills.iter().map(|f| f.why.row as i64))
            .floats("met", fills.iter().map(|f| f.why.met))
            .floats("band_low", fills.iter().map(|f| f.why.band[0].to_f64()))
            .floats("band_high", fills.iter().map(|f| f.why.band[1].to_f64()))
            .floats("queued_behind", fills.iter().map(|f| Some(f.why.queued_behind).filter(|size| size.is_finite())));
        let blotter = &self.blotter;
        blotter.conceding.iter().enumerate().fold(table, |table, (k, mechanism)| {
            let added = blotter.terms.iter().skip(k).step_by(blotter.conceding.len().max(1)).copied();
            table.floats(&format!("added_by_{mechanism}"), added)
        })
    }

    /// `equity`: `ts, equity`, one row an event.
    #[must_use]
    pub fn equity_table(&self) -> OutputTable {
        OutputTable::new()
            .times("ts", self.equity.iter().map(|p| p.time))
            .floats("equity", self.equity.iter().map(|p| p.equity))
    }
}
