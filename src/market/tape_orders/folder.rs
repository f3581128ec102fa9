//! A tape's orders on their way to a folder that a diagnosis reads.

use std::path::PathBuf;

use serde::Serialize;

use crate::io::{
    AssumedPrice, Assumptions, GrowingTable, InputError, InstrumentEntry, MarketFiles, OutputFolder, OutputTable, TwinFile,
};
use crate::market::{Book, Level, Price, Print, Quantity};
use crate::sim2real::Timestamp;

use super::files::{TapeReading, TapeSources};
use super::found::{LeftOut, TapeCounts, TapeOrder, TapeOrderKind, TapeSink};
use super::measured::{MeasuredInstrument, Measuring};
use super::sample::{Sample, Selection};

const ORDERS: &str = "orders.parquet";
const FILLS: &str = "fills.parquet";
const QUOTES: &str = "quotes.parquet";
const TRADES: &str = "trades.parquet";
const TWIN: &str = "assumed.toml";
const FINDINGS: &str = "findings.json";

/// The files that are written.
pub const TAPE_FILES: [&str; 6] = [ORDERS, FILLS, QUOTES, TRADES, TWIN, FINDINGS];

/// Rows that are kept in memory before they are written.
const BATCH: usize = 8_192;

/// Writes `orders`, `fills`, `quotes` and `trades` in the form of the contract, and `assumed.toml`, a twin that knows the touch.
///
/// Quotes and trades are written as they come; of orders, those that are selected.
#[derive(Debug)]
pub struct TapeFolder {
    output: OutputFolder,
    symbol: String,
    levels: usize,
    selection: Selection,
    orders: Sample<(u64, TapeOrder)>,
    numbered: u64,
    order_table: GrowingTable,
    fill_table: GrowingTable,
    quote_table: GrowingTable,
    trade_table: GrowingTable,
    quotes: Vec<Quote>,
    prints: Vec<Print>,
    /// The last quote before the first that is asked for.
    before: Option<Quote>,
    measuring: Measuring,
}

#[derive(Debug, Clone)]
struct Quote {
    time: Timestamp,
    bids: Vec<Level>,
    asks: Vec<Level>,
}

/// What was written.
#[derive(Debug, Clone, PartialEq)]
pub struct TapeWritten {
    /// The files.
    pub paths: Vec<PathBuf>,
    /// Every how many-th of the orders that fit was written.
    pub every: u64,
    /// Orders that fit: of the size and from the time that were asked for.
    pub fitting: u64,
    /// Orders that were written.
    pub orders: u64,
    /// What the tape says of its instrument; none where it shows no price.
    pub measured: Option<MeasuredInstrument>,
    /// All of it as a document (schema `trueup.tape_orders/1`).
    pub json: String,
}

impl TapeFolder {
    /// A folder in which the files will be, for an instrument called `symbol` with `levels` levels a side.
    ///
    /// # Errors
    /// Files that are there already, unless writing over is forced.
    pub fn create(mut output: OutputFolder, symbol: &str, levels: usize, selection: Selection) -> Result<Self, InputError> {
        output.check_free(&TAPE_FILES)?;
        let levels = levels.clamp(1, Book::DEPTH);
        let (orders, fills) = (order_rows(symbol, &[]), fill_rows(&[]));
        Ok(Self {
            order_table: output.grow(ORDERS, &orders)?,
            fill_table: output.grow(FILLS, &fills)?,
            quote_table: output.grow(QUOTES, &quote_rows(levels, &[]))?,
            trade_table: output.grow(TRADES, &trade_rows(&[]))?,
            output,
            symbol: symbol.to_owned(),
            levels,
            selection,
            orders: Sample::new(selection.thinning),
            numbered: 0,
            quotes: Vec::new(),
            prints: Vec::new(),
            before: None,
            measuring: Measuring::default(),
        })
    }

    fn wants(&self, time: Timestamp) -> bool {
        self.selection.start <= time && time < self.selection.end
    }

    fn write_quotes(&mut self) -> Result<(), InputError> {
        let rows = std::mem::take(&mut self.quotes);
        self.quote_table.append(&quote_rows(self.levels, &rows))
    }

    fn write_prints(&mut self) -> Result<(), InputError> {
        let rows = std::mem::take(&mut self.prints);
        self.trade_table.append(&trade_rows(&rows))
    }

    fn write_orders(&mut self) -> Result<u64, InputError> {
        let orders: Vec<(u64, TapeOrder)> = self.orders.drain().collect();
        self.order_table.append(&order_rows(&self.symbol, &orders))?;
        self.fill_table.append(&fill_rows(&orders))?;
        Ok(orders.len() as u64)
    }

    /// Writes what is left, and lets the files appear.
    ///
    /// # Errors
    /// No orders that could be used, or none that fit; a disk that is full.
    pub fn finish(mut self, sources: &TapeSources, reading: &TapeReading) -> Result<TapeWritten, InputError> {
        let measured = self.measuring.measured();
        let Some(instrument) = measured.filter(|_| self.orders.seen() > 0) else {
            return Err(self.nothing(sources, reading));
        };
        self.write_quotes()?;
        self.write_prints()?;
        self.write_orders()?;
        let Self { mut output, order_table, fill_table, quote_table, trade_table, .. } = self;
        for table in [order_table, fill_table, quote_table, trade_table] {
            table.finish()?;
        }
        let (every, fitting) = (self.orders.every(), self.orders.seen());
        let written = fitting.div_ceil(every);
        let sample = SampleFindings {
            fitting,
            every,
            written,
            tick_size: instrument.tick.to_f64(),
            lot_size: instrument.lot.to_f64(),
            span_s: instrument.span,
            daily_volume: instrument.daily_volume,
            daily_volatility: instrument.daily_volatility,
        };
        let json = findings(sources, &self.symbol, reading, Some(sample));
        output.file(TWIN, twin(&self.symbol, &instrument)?.as_bytes())?;
        output.file(FINDINGS, json.as_bytes())?;
        Ok(TapeWritten { paths: output.finish()?, every, fitting, orders: written, measured, json })
    }

    fn nothing(&self, sources: &TapeSources, reading: &TapeReading) -> InputError {
        if reading.counts.orders > 0 {
            let message = format!("none of {} orders fits what is asked for", reading.counts.orders);
            return InputError::new(sources.place(), message).hint("look at --start, --end and --min-size");
        }
        let mut reasons = reading.counts.lines();
        reasons.extend(reading.notes.iter().cloned());
        let told = if reasons.is_empty() { "nobody took anything".to_owned() } else { reasons.join("; ") };
        InputError::new(sources.place(), format!("no order could be made out of it ({told})"))
            .hint("trades need a side that took, and a book with both sides before them")
    }
}

impl TapeSink for TapeFolder {
    type Error = InputError;

    fn quote(&mut self, time: Timestamp, bids: &[Level], asks: &[Level]) -> Result<(), InputError> {
        let quote = Quote { time, bids: bids.to_vec(), asks: asks.to_vec() };
        if time < self.selection.start {
            self.before = Some(quote);
            return Ok(());
        }
        if !self.wants(time) {
            return Ok(());
        }
        if let Some((bid, ask)) = bids.first().zip(asks.first()) {
            self.measuring.mid(time, 0.5 * (bid.price + ask.price));
        }
        for level in [bids.first(), asks.first()].into_iter().flatten() {
            if let Ok(price) = Price::nearest(level.price) {
                self.measuring.price(price);
            }
        }
        self.quotes.extend(self.before.take());
        self.quotes.push(quote);
        if self.quotes.len() >= BATCH { self.write_quotes() } else { Ok(()) }
    }

    fn print(&mut self, print: Print) -> Result<(), InputError> {
        if !self.wants(print.time) {
            return Ok(());
        }
        self.measuring.print(&print);
        self.prints.push(print);
        if self.prints.len() >= BATCH { self.write_prints() } else { Ok(()) }
    }

    fn order(&mut self, order: TapeOrder) -> Result<(), InputError> {
        self.numbered += 1;
        if !self.wants(order.decided_at) || order.quantity < self.selection.smallest {
            return Ok(());
        }
        self.orders.push((self.numbered, order));
        if self.orders.len() >= BATCH && !self.orders.may_thin() {
            self.write_orders()?;
        }
        Ok(())
    }
}

/// What was found on a tape as a document (schema `trueup.tape_orders/1`), of which nothing was written.
#[must_use]
pub fn tape_findings(sources: &TapeSources, symbol: &str, reading: &TapeReading) -> String {
    findings(sources, symbol, reading, None)
}

fn findings(sources: &TapeSources, symbol: &str, reading: &TapeReading, sample: Option<SampleFindings>) -> String {
    let counted = |reason: LeftOut| Counted { reason, count: reading.counts.left_out(reason), says: reason.says() };
    let findings = Findings {
        schema: "trueup.tape_orders/1",
        source: sources.what(),
        symbol,
        counts: &reading.counts,
        left_out: LeftOut::ALL.into_iter().map(counted).filter(|counted| counted.count > 0).collect(),
        notes: &reading.notes,
        sample,
    };
    serde_json::to_string_pretty(&findings).unwrap_or_default() + "\n"
}

#[derive(Serialize)]
struct Findings<'a> {
    schema: &'static str,
    source: &'a str,
    symbol: &'a str,
    counts: &'a TapeCounts,
    left_out: Vec<Counted>,
    notes: &'a [String],
    #[serde(flatten)]
    sample: Option<SampleFindings>,
}

/// What of it was written, and what was measured.
#[derive(Serialize)]
struct SampleFindings {
    fitting: u64,
    every: u64,
    written: u64,
    tick_size: f64,
    lot_size: f64,
    span_s: f64,
    daily_volume: Option<f64>,
    daily_volatility: Option<f64>,
}

#[derive(Serialize)]
struct Counted {
    reason: LeftOut,
    count: u64,
    says: &'static str,
}

fn order_rows(symbol: &str, orders: &[(u64, TapeOrder)]) -> OutputTable {
    let limit = |order: &TapeOrder| match order.kind {
        TapeOrderKind::Market => None,
        TapeOrderKind::Limit(price) => Some(price.to_f64()),
    };
    let word = |order: &TapeOrder| if order.kind == TapeOrderKind::Market { "market" } else { "limit" };
    OutputTable::new()
        .texts("order_id", orders.iter().map(|(number, _)| number.to_string()))
        .texts("symbol", orders.iter().map(|_| symbol.to_owned()))
        .times("decided_at", orders.iter().map(|(_, order)| order.decided_at))
        .texts("side", orders.iter().map(|(_, order)| order.side.word().to_owned()))
        .floats("qty", orders.iter().map(|(_, order)| order.quantity.to_f64()))
        .texts("type", orders.iter().map(|(_, order)| word(order).to_owned()))
        .floats("limit_price", orders.iter().map(|(_, order)| limit(order)))
        .integers("tape_id", orders.iter().map(|(_, order)| order.id))
}

fn fill_rows(orders: &[(u64, TapeOrder)]) -> OutputTable {
    let fills = || orders.iter().flat_map(|(number, order)| order.fills.iter().map(move |fill| (number, fill)));
    OutputTable::new()
        .texts("order_id", fills().map(|(number, _)| number.to_string()))
        .times("filled_at", fills().map(|(_, fill)| fill.filled_at))
        .floats("qty", fills().map(|(_, fill)| fill.quantity.to_f64()))
        .floats("price", fills().map(|(_, fill)| fill.price.to_f64()))
        .floats("fee", fills().map(|_| 0.0))
        .texts("liquidity", fills().map(|_| "taker".to_owned()))
}

fn quote_rows(levels: usize, quotes: &[Quote]) -> OutputTable {
    let table = OutputTable::new().times("ts", quotes.iter().map(|quote| quote.time));
    (0..levels).fold(table, |table, k| {
        let number = if k == 0 { String::new() } else { (k + 1).to_string() };
        let side = |table: OutputTable, name: &str, of: fn(&Quote) -> &[Level]| {
            let level = |quote: &Quote| of(quote).get(k).copied();
            let size = |quote: &Quote| level(quote).map(|level| level.size);
            table
                .floats(&format!("{name}{number}"), quotes.iter().map(|quote| level(quote).map(|level| level.price)))
                .floats(&format!("{name}{number}_size"), quotes.iter().map(size))
        };
        side(side(table, "bid", |quote| &quote.bids), "ask", |quote| &quote.asks)
    })
}

fn trade_rows(prints: &[Print]) -> OutputTable {
    OutputTable::new()
        .times("ts", prints.iter().map(|print| print.time))
        .floats("price", prints.iter().map(|print| print.price))
        .floats("size", prints.iter().map(|print| print.size))
        .texts("aggressor", prints.iter().map(|print| print.aggressor.map(|side| side.word().to_owned())))
}

/// A twin that is told that fills happen at the touch, and of its instrument what the tape says.
fn twin(symbol: &str, measured: &MeasuredInstrument) -> Result<String, InputError> {
    let mut twin = TwinFile::default();
    twin.model = "execution".to_owned();
    twin.assumptions = Some(Assumptions { price: AssumedPrice::Touch, commission_bps: None, commission_per_share: None });
    twin.instruments = vec![InstrumentEntry {
        symbol: symbol.to_owned(),
        tick_size: measured.tick.to_f64(),
        lot_size: measured.lot.max(Quantity(1)).to_f64(),
        average_daily_volume: measured.daily_volume,
        daily_volatility: measured.daily_volatility,
        calendar: None,
        currency: None,
        multiplier: None,
        margin: None,
    }];
    // The orders are of the tape itself.
    twin.market = Some(MarketFiles { shows_own_orders: Some(true), ..MarketFiles::default() });
    Ok(format!(
        "# Made of a tape by `trueup data import --tape`: fills are assumed at the touch. Tick and lot are the largest steps that all\n\
         # prices and sizes are multiples of; volume and volatility are those of a day that goes on as {:.0} s of tape do.\n\
         # The tape says nothing of fees: those of the fills are 0.\n\n{}",
        measured.span,
        twin.render(std::path::Path::new("."))?
    ))
}
