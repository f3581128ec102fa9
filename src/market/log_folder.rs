//! Order logs read from folders.

use std::path::Path;
use std::sync::Arc;

use crate::io::{InputError, MarketFiles, Table, TimeFormat, hint_among, table_in};
use crate::sim2real::Recording;

use super::tape_file::{TapeFiles, above_zero, read_tape};
use super::{
    Instrument, LogError, LogMarket, LogTable, LoggedFill, LoggedOrder, OrderLog, OrderType, PriceAssumption, Side, Tape,
};

/// What a twin says of the logs it is held to.
#[derive(Debug, Clone)]
pub struct LogSettings<'a> {
    /// The instruments, one of which a log trades.
    pub instruments: &'a [Instrument],
    /// The price the twin assumes.
    pub price: PriceAssumption,
    /// How files are written: unit and zone of times in orders and fills are those of the tape.
    pub market: &'a MarketFiles,
    /// The tape, where the twin names one.
    pub tape: Option<Arc<Tape>>,
}

/// Reads the log in `folder`: `orders.*`, `fills.*` and, where the twin names no tape, `quotes.*`, `trades.*`, `bars.*`.
///
/// # Errors
/// A path that is no folder; a missing table; what [`Table::read`], [`read_tape`] and [`OrderLog::recording`] refuse; a
/// side that is neither `buy` nor `sell`; several symbols, or one the twin does not declare.
pub fn read_log(folder: &Path, settings: &LogSettings<'_>) -> Result<Recording<OrderLog>, InputError> {
    let required = |stem: &str| {
        table_in(folder, stem)?.ok_or_else(|| {
            InputError::new(folder, format!("there is no {stem} table in the folder"))
                .hint(format!("an order log is a folder with orders and fills, such as {stem}.csv or {stem}.parquet"))
        })
    };
    let (orders_table, fills_table) = (Table::read(required("orders")?)?, Table::read(required("fills")?)?);
    let time = &settings.market.format.time;
    let orders = read_orders(&orders_table, time)?;
    let fills = read_fills(&fills_table, time)?;
    let instrument = instrument_of(&orders_table, settings.instruments)?;
    let tape = match &settings.tape {
        Some(tape) => Arc::clone(tape),
        None => Arc::new(tape_of_folder(folder, settings)?),
    };
    let market = LogMarket { instrument, tape, price: settings.price };
    let name = folder.file_name().map_or_else(|| folder.display().to_string(), |name| name.to_string_lossy().into_owned());
    OrderLog::recording(&name, market, &orders, &fills).map_err(|error| explain(error, &orders_table, &fills_table))
}

/// The tape beside the orders.
fn tape_of_folder(folder: &Path, settings: &LogSettings<'_>) -> Result<Tape, InputError> {
    let (quotes, trades, bars) = (table_in(folder, "quotes")?, table_in(folder, "trades")?, table_in(folder, "bars")?);
    let files = TapeFiles { quotes: quotes.as_deref(), trades: trades.as_deref(), bars: bars.as_deref() };
    if files == TapeFiles::default() {
        return Err(InputError::new(
            folder,
            "there are neither quotes nor trades nor bars: nothing says what the market did",
        )
        .hint("name the tape under [market] in the twin, or put quotes, trades or bars beside the orders"));
    }
    read_tape(files, &settings.market.format)
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

/// The one instrument the orders trade.
fn instrument_of(table: &Table, instruments: &[Instrument]) -> Result<Instrument, InputError> {
    let symbols = table.texts_complete("symbol")?;
    let first = symbols.first().cloned().unwrap_or_default();
    if let Some(row) = symbols.iter().position(|symbol| *symbol != first) {
        return Err(table
            .error("symbol", row, format!("expected `{first}`, as in the first row"))
            .found_text(&symbols[row])
            .hint("a tape is of one instrument: put the orders of each symbol into a folder of their own"));
    }
    let known: Vec<&str> = instruments.iter().map(|instrument| instrument.symbol.as_str()).collect();
    instruments.iter().find(|instrument| instrument.symbol == first).cloned().ok_or_else(|| {
        table
            .error("symbol", 0, "the twin declares no such instrument")
            .found_text(&first)
            .hint("add an [[instrument]] with this symbol and its tick_size to the twin")
            .maybe_hint(hint_among(&first, &known))
    })
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
