//! What a backtest leaves on disk: its summary, and its orders, fills and equity in the form of an execution log.

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::io::OutputTable;

use super::metric::{Counts, InstrumentSummary, Metrics};
use super::{Instrument, MoneyError, Record, Reference};

/// A file a run depends on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct InputHash {
    /// Path, as the run names it.
    pub path: String,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

impl InputHash {
    /// The hash of a file that holds `bytes`.
    #[must_use]
    pub fn of(path: impl Into<String>, bytes: &[u8]) -> Self {
        let sha256 = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        Self { path: path.into(), sha256 }
    }
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
    /// Every file it read.
    pub inputs: Vec<InputHash>,
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
    /// Instrument by instrument.
    pub instruments: Vec<InstrumentSummary>,
}

impl RunSummary {
    /// The schema, with its version.
    pub const SCHEMA: &'static str = "trueup.run/1";

    /// The summary of `record`.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn new(provenance: Provenance, record: &Record, instruments: &[Instrument]) -> Result<Self, MoneyError> {
        Ok(Self {
            schema: Self::SCHEMA,
            provenance,
            metrics: Metrics::of(record)?,
            counts: Counts::of(record),
            instruments: InstrumentSummary::of(record, instruments),
        })
    }
}

impl Record {
    /// `orders`: `order_id, symbol, decided_at, side, qty, type, limit_price, submitted_at, strategy, seen_bid, seen_ask`,
    /// and beyond the contract's columns `status, filled_qty`. Orders that were refused were never sent and are not here.
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
            .texts("type", orders.iter().map(|_| "market".to_owned()))
            .floats("limit_price", orders.iter().map(|_| None::<f64>))
            .times("submitted_at", orders.iter().map(|o| o.decided_at))
            .texts("strategy", orders.iter().map(|_| strategy.to_owned()))
            .floats("seen_bid", orders.iter().map(|o| o.seen_bid))
            .floats("seen_ask", orders.iter().map(|o| o.seen_ask))
            .texts("status", orders.iter().map(|o| o.status.word().to_owned()))
            .floats("filled_qty", orders.iter().map(|o| o.filled.to_f64()))
    }

    /// `fills`: `order_id, filled_at, qty, price, fee, liquidity, fill_id`.
    #[must_use]
    pub fn fills_table(&self) -> OutputTable {
        let fills = &self.blotter.fills;
        OutputTable::new()
            .integers("order_id", fills.iter().map(|f| f.order_id as i64))
            .times("filled_at", fills.iter().map(|f| f.filled_at))
            .floats("qty", fills.iter().map(|f| f.quantity.to_f64()))
            .floats("price", fills.iter().map(|f| f.price.to_f64()))
            .floats("fee", fills.iter().map(|f| f.fee.to_f64()))
            .texts("liquidity", fills.iter().map(|_| "taker".to_owned()))
            .integers("fill_id", fills.iter().map(|f| f.fill_id as i64))
    }

    /// `equity`: `ts, equity`, one row an event.
    #[must_use]
    pub fn equity_table(&self) -> OutputTable {
        OutputTable::new()
            .times("ts", self.equity.iter().map(|p| p.time))
            .floats("equity", self.equity.iter().map(|p| p.equity))
    }
}
