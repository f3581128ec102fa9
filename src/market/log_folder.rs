//! Order logs read from folders.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::io::{InputError, MarketFiles, Table, TimeFormat, TwinFile, hint_among, table_in};
use crate::sim2real::{Recording, Timestamp};

use super::log_split::{SplitLog, SymbolPart, split};
use super::run::span;
use super::run_as_twin::{assumed_price, assumption};
use super::tape_file::{TapeFiles, above_zero};
use super::tapes::{FileTapes, folder_of_symbol, no_tape_hint, tape_of_data};
use super::twin::no_assumptions;
use super::{
    Instrument, LogError, LogMarket, LogTable, LoggedFill, LoggedOrder, OrderLog, OrderType, PriceAssumption, Side, Tape,
};

/// The largest part of a log's orders that may be of symbols of which there is no tape.
const LEFT_OUT: f64 = 0.01;

/// Reads the logs that a twin is held to, beside the tape that it names or, where it names none, those beside the orders. A tape is
/// read once.
#[derive(Debug)]
pub struct LogReader<'a> {
    twin: &'a TwinFile,
    instruments: Vec<Instrument>,
    /// How files are written: unit and zone of times in orders and fills are those of the tape.
    market: MarketFiles,
    /// The files of `[market]`.
    named: Option<FileTapes>,
    /// Tapes that logs of several folders share, by symbol.
    shared: BTreeMap<String, Option<Arc<Tape>>>,
    span: Option<(Timestamp, Timestamp)>,
}

impl<'a> LogReader<'a> {
    /// A reader of the logs that `twin` is held to.
    ///
    /// # Errors
    /// A twin without `[assumptions]` or instruments, and what [`Table::read_with`] refuses of the tape.
    pub fn of(twin: &'a TwinFile) -> Result<Self, InputError> {
        if twin.assumptions.is_none() && twin.run.is_none() {
            return Err(no_assumptions(twin));
        }
        if twin.instruments.is_empty() {
            return Err(twin
                .error(&["twin"], "the twin declares no [[instrument]]")
                .hint("add [[instrument]] with symbol and tick_size, and average_daily_volume where it is known"));
        }
        for (index, entry) in twin.instruments.iter().enumerate() {
            if let Some(multiplier) = entry.multiplier.filter(|multiplier| *multiplier != 1.0) {
                let keys = ["instrument", &index.to_string(), "multiplier"];
                let error = twin.error(&keys, "the diagnosis of orders knows prices of one unit alone").found(multiplier);
                return Err(error.hint("give quantities in units of the underlying, and a multiplier of 1"));
            }
        }
        let market = twin.market.clone().unwrap_or_default();
        let files =
            TapeFiles { quotes: market.quotes.as_deref(), trades: market.trades.as_deref(), bars: market.bars.as_deref() };
        let named = if files == TapeFiles::default() { None } else { Some(FileTapes::open(files, &market.format)?) };
        let instruments = twin.instruments.iter().map(Instrument::from).collect();
        let span = twin.run.as_deref().and_then(span);
        Ok(Self { twin, instruments, named, market, shared: BTreeMap::new(), span })
    }

    /// Reads the logs in `folders`: each symbol traded is a recording, named as its folder where that is of one symbol, else as
    /// the symbol, and as both where there are several folders.
    ///
    /// # Errors
    /// What [`read`](Self::read) refuses.
    pub fn read_all(&mut self, folders: &[PathBuf]) -> Result<Vec<Recording<OrderLog>>, InputError> {
        let mut recordings = Vec::new();
        for folder in folders {
            let mut own = self.read(folder)?;
            if own.len() > 1 && folders.len() > 1 {
                own.iter_mut().for_each(|recording| recording.name = format!("{} {}", name_of(folder), recording.name));
            }
            recordings.append(&mut own);
        }
        Ok(recordings)
    }

    /// Reads the log in `folder`: `orders.*`, `fills.*` and, where the twin names no tape, `quotes.*`, `trades.*`, `bars.*`, which
    /// tell symbols apart by a column `symbol`, or lie in folders named as symbols.
    ///
    /// # Errors
    /// A path that is no folder; a missing table; what [`Table::read`], [`read_tape`](super::read_tape) and
    /// [`OrderLog::recording`] refuse; a side that is neither `buy` nor `sell`; orders of symbols that the twin does not declare, or
    /// of which there is no tape, if they are more than one in a hundred; no order within `start` and `end` of a run.
    pub fn read(&mut self, folder: &Path) -> Result<Vec<Recording<OrderLog>>, InputError> {
        let required = |stem: &str| {
            table_in(folder, stem)?.ok_or_else(|| {
                InputError::new(folder, format!("there is no {stem} table in the folder"))
                    .hint(format!("an order log is a folder with orders and fills, such as {stem}.csv or {stem}.parquet"))
            })
        };
        let (orders, fills) = (Table::read(required("orders")?)?, Table::read(required("fills")?)?);
        let log = split(&orders, &fills, &self.market.format.time, self.span)?;
        if log.parts.is_empty() {
            let error = InputError::new(orders.path(), "no order was decided between `start` and `end` of the run");
            return Err(
                error.hint("leave them out to count all orders; times without a zone in files are UTC unless declared")
            );
        }
        self.recordings(folder, &orders, log)
    }

    /// A recording of each part that there is a tape of.
    fn recordings(&mut self, folder: &Path, orders: &Table, log: SplitLog) -> Result<Vec<Recording<OrderLog>>, InputError> {
        let SplitLog { parts, outside } = log;
        // Of symbols that are not declared no tape is asked for.
        let is_declared = |symbol: &&str| self.instruments.iter().any(|instrument| instrument.symbol == **symbol);
        let traded: Vec<&str> = parts.iter().map(|part| part.symbol.as_str()).filter(is_declared).collect();
        let beside = if self.is_beside_orders() { FileTapes::of_folder(folder, &self.market.format)? } else { None };
        let (mut recordings, mut lacking, mut resting) = (Vec::new(), Vec::new(), Vec::new());
        for part in &parts {
            let market = match self.market_of(part, folder, beside.as_ref(), &traded)? {
                Ok(market) => market,
                Err(error) => {
                    lacking.push((part, error));
                    continue;
                }
            };
            let name = if parts.len() == 1 { name_of(folder) } else { part.symbol.clone() };
            let time = &self.market.format.time;
            let (sent, filled) = (read_orders(&part.orders, time)?, read_fills(&part.fills, time)?);
            match OrderLog::recording(&name, market, &sent, &filled) {
                Ok(recording) => recordings.push(recording),
                Err(error) => {
                    let error = explain(error, &part.orders, &part.fills);
                    // Of some symbols there may be orders that rest alone.
                    if parts.len() == 1 || sent.iter().any(|order| order.kind == OrderType::Market) {
                        return Err(error);
                    }
                    resting.push((part, error));
                }
            }
        }
        let without: usize = lacking.iter().map(|(part, _)| part.orders.rows()).sum();
        let all: usize = parts.iter().map(|part| part.orders.rows()).sum();
        if let Some((_, error)) = lacking.first()
            && (recordings.is_empty() || without as f64 > LEFT_OUT * all as f64)
        {
            return Err(error.clone());
        }
        let Some(first) = recordings.first_mut() else { return Err(resting.swap_remove(0).1) };
        if outside > 0 {
            let all = orders.rows();
            let note =
                format!("{outside} of {all} orders were decided outside `start` and `end` of the run and are left out");
            first.stimulus = first.stimulus.clone().with_note(note);
        }
        for (part, error) in lacking.iter().chain(&resting) {
            let note = format!("{} orders of `{}` are left out: {}", part.orders.rows(), part.symbol, error.message);
            first.stimulus = first.stimulus.clone().with_note(note);
        }
        Ok(recordings)
    }

    /// Whether the tapes are those beside the orders.
    fn is_beside_orders(&self) -> bool {
        self.named.is_none() && self.twin.data.is_empty()
    }

    /// What the orders of `part`, one of the symbols `traded`, met; or what is wrong where nothing says it.
    fn market_of(
        &mut self,
        part: &SymbolPart,
        folder: &Path,
        beside: Option<&FileTapes>,
        traded: &[&str],
    ) -> Result<Result<LogMarket, InputError>, InputError> {
        let symbol = part.symbol.as_str();
        let Some(instrument) = self.instruments.iter().find(|instrument| instrument.symbol == symbol).cloned() else {
            return Ok(Err(self.no_instrument(part)));
        };
        let own = folder_of_symbol(folder, symbol).filter(|_| self.is_beside_orders());
        let own = own.map(|own| FileTapes::of_folder(&own, &self.market.format)).transpose()?.flatten();
        let tape = match (&own, beside) {
            (Some(own), _) => own.tape(symbol, &[symbol], &self.market.format)?.map(Arc::new),
            (None, Some(beside)) => beside.tape(symbol, traded, &self.market.format)?.map(Arc::new),
            (None, None) => self.shared_tape(&instrument, traded)?,
        };
        let known = self.named.as_ref().or(beside).map(FileTapes::symbols).unwrap_or_default();
        let Some(tape) = tape else {
            if self.is_beside_orders() && beside.is_none() {
                return Ok(Err(no_tape(folder)));
            }
            let error = part.orders.error("symbol", 0, "there is no tape of this symbol").found_text(symbol);
            return Ok(Err(error.hint(no_tape_hint(symbol, &known))));
        };
        let shows_own_orders = self.twin.shows_own_orders();
        Ok(Ok(LogMarket { price: self.price_of(symbol)?, instrument, tape, shows_own_orders }))
    }

    /// The tape of `instrument` in the files that the twin names, or in its `[[data]]`.
    fn shared_tape(&mut self, instrument: &Instrument, traded: &[&str]) -> Result<Option<Arc<Tape>>, InputError> {
        if let Some(tape) = self.shared.get(&instrument.symbol) {
            return Ok(tape.clone());
        }
        let tape = match &self.named {
            Some(named) => named.tape(&instrument.symbol, traded, &self.market.format)?,
            None => tape_of_data(&self.twin.data, instrument)?,
        };
        let tape = tape.map(Arc::new);
        self.shared.insert(instrument.symbol.clone(), tape.clone());
        Ok(tape)
    }

    /// The price that the twin assumes for orders of `symbol`.
    fn price_of(&self, symbol: &str) -> Result<PriceAssumption, InputError> {
        match (&self.twin.assumptions, &self.twin.run) {
            (Some(assumptions), _) => Ok(assumption(assumptions.price)),
            (None, Some(run)) => assumed_price(run, symbol),
            (None, None) => Err(no_assumptions(self.twin)),
        }
    }

    fn no_instrument(&self, part: &SymbolPart) -> InputError {
        let known: Vec<&str> = self.instruments.iter().map(|instrument| instrument.symbol.as_str()).collect();
        part.orders
            .error("symbol", 0, "the twin declares no such instrument")
            .found_text(&part.symbol)
            .hint("add an [[instrument]] with this symbol and its tick_size to the twin")
            .maybe_hint(hint_among(&part.symbol, &known))
    }
}

/// The name of a recording of one symbol.
fn name_of(folder: &Path) -> String {
    folder.file_name().map_or_else(|| folder.display().to_string(), |name| name.to_string_lossy().into_owned())
}

fn no_tape(folder: &Path) -> InputError {
    InputError::new(folder, "there are neither quotes nor trades nor bars: nothing says what the market did")
        .hint("name the tape under [market] in the twin, or put quotes, trades or bars beside the orders")
}

fn read_orders(table: &Table, time: &TimeFormat) -> Result<Vec<LoggedOrder>, InputError> {
    let (ids, times) = (table.texts_complete("order_id")?, table.times("decided_at", time)?);
    let (sides, quantities) = (table.texts_complete("side")?, above_zero(table, "qty")?);
    let kinds = table.texts_complete("type")?;
    let seen = seen_mids(table)?;
    let order = |(row, id): (usize, String)| {
        let side = Side::of_word(&sides[row]).ok_or_else(|| {
            table
                .error("side", row, "expected `buy` or `sell`")
                .found_text(&sides[row])
                .maybe_hint(hint_among(&sides[row], &["buy", "sell"]))
        })?;
        let kind = match kinds[row].to_lowercase().as_str() {
            "market" | "mkt" => OrderType::Market,
            other => OrderType::Other(other.to_owned()),
        };
        Ok(LoggedOrder { id, side, quantity: quantities[row], decided_at: times[row], kind, seen_mid: seen[row] })
    };
    ids.into_iter().enumerate().map(order).collect()
}

/// The mids that orders were decided on, where `seen_bid` and `seen_ask` are there and hold a quote.
fn seen_mids(table: &Table) -> Result<Vec<Option<f64>>, InputError> {
    if !(table.has("seen_bid") && table.has("seen_ask")) {
        return Ok(vec![None; table.rows()]);
    }
    let (bids, asks) = (table.floats("seen_bid")?, table.floats("seen_ask")?);
    let mid = |(bid, ask): (&Option<f64>, &Option<f64>)| {
        bid.zip(*ask).filter(|(bid, ask)| *bid > 0.0 && bid <= ask && ask.is_finite()).map(|(bid, ask)| 0.5 * (bid + ask))
    };
    Ok(bids.iter().zip(&asks).map(mid).collect())
}

fn read_fills(table: &Table, time: &TimeFormat) -> Result<Vec<LoggedFill>, InputError> {
    let (ids, times) = (table.texts_complete("order_id")?, table.times("filled_at", time)?);
    let (quantities, prices) = (above_zero(table, "qty")?, above_zero(table, "price")?);
    let fees = table.floats_complete("fee")?;
    let fill = |(row, order_id): (usize, String)| LoggedFill {
        order_id,
        filled_at: times[row],
        quantity: quantities[row],
        price: prices[row],
        fee: fees[row],
    };
    Ok(ids.into_iter().enumerate().map(fill).collect())
}

/// The error with the file it is in.
fn explain(error: LogError, orders: &Table, fills: &Table) -> InputError {
    let table = match error.table {
        LogTable::Orders => orders,
        LogTable::Fills => fills,
    };
    let placed = match error.cell {
        Some((row, column)) => table.error(column, row, error.message),
        None => InputError::new(table.path(), error.message),
    };
    let placed = placed.hint(error.hint);
    match error.found {
        Some(found) => placed.found(found),
        None => placed,
    }
}
