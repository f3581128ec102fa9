//! Files of market data as streams.

use std::path::Path;

use crate::io::{ClockOffset, FeedFormat, FeedKind, InputError, Layout, Table, TableChunks};
use crate::market::{Bar, Book, DataNotes, DepthChange, OrderEvent, Print};
use crate::sim2real::Timestamp;

use super::bar_rows::BarRows;
use super::binance_depth::BinanceDepth;
use super::bitstamp::BitstampOrders;
use super::clocks::estimated_offset;
use super::databento::{DatabentoOrders, DatabentoPrints};
use super::decode::{Decode, Emit, Kept};
use super::depth_rows::DepthRows;
use super::lean::{LeanPrints, LeanQuotes};
use super::order_rows::OrderRows;
use super::print_rows::PrintRows;
use super::quote_rows::QuoteRows;
use super::{Dated, Known, NumberedPrint, OrderStep, Stream, StreamError};

/// A file of market data, read some rows at a time: what is in memory does not grow with its length (see [`TableChunks`]).
///
/// Each row is held to what it can be, and so is what it must be beside the rows before it, also where these came with an
/// earlier table. What is done with rows that cannot be is [`FeedFormat::rules`]; what was found is [`notes`](Self::notes).
pub struct FileStream<T> {
    chunks: TableChunks,
    decode: Box<dyn Decode<T>>,
    order_column: String,
    rows: Kept<T>,
    format: FeedFormat,
    state: State,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Reading,
    Ended,
}

impl<T> std::fmt::Debug for FileStream<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "FileStream({}, {:?})", self.chunks.path().display(), self.state)
    }
}

/// A clock offset that is estimated from a file becomes a declared one.
fn settled<T>(
    path: &Path,
    format: &FeedFormat,
    decoder: impl Fn(&FeedFormat) -> Result<Box<dyn Decode<T>>, InputError>,
) -> Result<(Box<dyn Decode<T>>, FeedFormat), InputError> {
    let mut format = format.clone();
    let mut decode = decoder(&format)?;
    if format.clock.offset == ClockOffset::Estimated {
        let Some(clocks) = decode.clocks() else {
            return Err(InputError::new(path, "there is no second clock whose offset could be estimated")
                .hint("name the column with its times: known_at = \"...\" in [[data]]"));
        };
        let renames = &format.columns;
        format.clock.offset = ClockOffset::Declared(estimated_offset(path, renames, clocks)?);
        decode = decoder(&format)?;
    }
    Ok((decode, format))
}

fn notes<T>(kind: &str, decode: &dyn Decode<T>, format: &FeedFormat) -> DataNotes {
    let mut notes = DataNotes::of(kind);
    if let (Some(_), ClockOffset::Declared(offset)) = (decode.clocks(), format.clock.offset) {
        notes.set_clock_offset(offset);
    }
    notes
}

/// The error of a layout that has no such data.
fn no_such(path: &Path, layout: Layout, kind: &str) -> InputError {
    let with = Layout::ALL.into_iter().filter(|layout| layout.kinds().iter().any(|k| k.word() == kind)).map(Layout::word);
    let hint = format!("`{kind}` can be {}", crate::io::listed(&with.collect::<Vec<_>>()));
    InputError::new(path, format!("the layout `{}` has no {kind} of that form", layout.word())).hint(hint)
}

impl<T: Dated + Clone + PartialEq> FileStream<T> {
    fn open(
        path: &Path,
        format: &FeedFormat,
        kind: &str,
        rows: usize,
        decoder: impl Fn(&FeedFormat) -> Result<Box<dyn Decode<T>>, InputError>,
    ) -> Result<Self, InputError> {
        let (decode, format) = settled(path, format, decoder)?;
        let chunks = TableChunks::open(path, &format.columns, rows)?;
        if let Some(first) = chunks.first() {
            first.check_renames(&decode.columns())?;
        }
        let rules = format.rules;
        let rows = Kept::new(notes(kind, &*decode, &format), rules.on_bad, rules.reorder, rules.max_gap);
        let order_column = decode.order_column().to_owned();
        Ok(Self { chunks, decode, order_column, rows, format, state: State::Reading })
    }

    /// What was found so far; all there is once the stream is at its end.
    #[must_use]
    pub fn notes(&self) -> &DataNotes {
        &self.rows.notes
    }

    /// Hands the rows of the next table to `into`; false at the end, when the last of them are handed out.
    pub(in crate::market) fn next_rows(&mut self, into: &mut dyn FnMut(T)) -> Result<bool, InputError> {
        if self.state == State::Ended {
            return Ok(false);
        }
        // An error is an end, too.
        self.state = State::Ended;
        let Some(table) = self.chunks.next_table()? else {
            let rules = self.format.rules;
            finish(&mut *self.decode, &mut self.rows, (rules.until, rules.max_gap), into);
            return Ok(false);
        };
        decode(&table, &mut *self.decode, &self.order_column, &mut self.rows, into)?;
        self.state = State::Reading;
        Ok(true)
    }
}

/// Reads one table.
pub(super) fn decode<T: Dated + Clone + PartialEq>(
    table: &Table,
    decode: &mut dyn Decode<T>,
    order_column: &str,
    rows: &mut Kept<T>,
    into: &mut dyn FnMut(T),
) -> Result<(), InputError> {
    rows.notes.read(table.rows() as u64);
    decode.decode(table, &mut Emit { table, order_column, rows, into })?;
    rows.leave(table);
    Ok(())
}

/// Gives out what was held back; `until` is the time up to which there should be data, beside the longest gap that is none [ns].
pub(super) fn finish<T: Dated + Clone + PartialEq>(
    decode: &mut dyn Decode<T>,
    rows: &mut Kept<T>,
    (until, max_gap): (Option<Timestamp>, Option<i64>),
    into: &mut dyn FnMut(T),
) {
    for last in decode.last() {
        rows.sequence.push(last);
    }
    rows.give(true, into);
    rows.notes.end(until, max_gap);
}

impl FileStream<Known<Book>> {
    /// How many levels the quotes of the file have, as far as its columns say [levels].
    pub(in crate::market) fn depth_of_levels(&self) -> usize {
        let has = |k: &usize| {
            self.chunks.first().is_some_and(|table| ["bid", "ask"].iter().any(|side| table.has(&format!("{side}{k}"))))
        };
        (2..=Book::DEPTH).rfind(has).unwrap_or(1)
    }
}

/// Rows of a table in memory that are decoded at once: their columns fit into the cache of a core.
pub(in crate::market) const PIECE: usize = 1 << 12;

/// The bars of a table that is in memory as a whole.
pub(in crate::market) fn bars_of(
    table: &Table,
    format: &FeedFormat,
    rows: BarRows,
) -> Result<(Vec<Bar>, DataNotes), InputError> {
    let mut reader = rows;
    let rules = format.rules;
    let mut kept = Kept::new(DataNotes::of(FeedKind::Bars.word()), rules.on_bad, None, rules.max_gap);
    let mut bars = Vec::with_capacity(table.rows());
    let order_column = BarRows::time_column(format);
    for piece in table.pieces(PIECE) {
        decode(&piece, &mut reader, order_column, &mut kept, &mut |bar| bars.push(bar))?;
    }
    finish(&mut reader, &mut kept, (rules.until, rules.max_gap), &mut |bar| bars.push(bar));
    Ok((bars, kept.notes))
}

impl FileStream<Bar> {
    /// Bars of `interval` [ns]: `ts, open, high, low, close, volume`, or Lean's. A stream does not know the distances of bars
    /// to come, so their length must be declared.
    ///
    /// # Errors
    /// What cannot be opened, no `stamp` or `interval`, a layout without bars.
    pub fn bars(
        path: impl AsRef<Path>,
        format: &FeedFormat,
        interval: Option<i64>,
        rows: usize,
    ) -> Result<Self, InputError> {
        let path = path.as_ref();
        let (Some(stamp), Some(interval)) = (format.stamp, interval) else {
            let message = "a stream of bars needs their `stamp` and their `interval`";
            return Err(InputError::new(path, message).hint("declare them in [[data]]: stamp = \"open\", interval = \"1m\""));
        };
        if !matches!(format.layout, Layout::Trueup | Layout::Lean) {
            return Err(no_such(path, format.layout, "bars"));
        }
        Self::open(path, format, "bars", rows, |format| Ok(Box::new(BarRows::new(format, stamp, interval))))
    }
}

impl FileStream<Known<Book>> {
    /// Quotes: `ts, bid, bid_size, ask, ask_size` and deeper levels; Binance's best bid and ask; Lean's ticks, and its quote
    /// bars of `interval` [ns], of which the last quote is read, known when the bar ends.
    ///
    /// # Errors
    /// What cannot be opened, a layout without quotes.
    pub fn quotes(
        path: impl AsRef<Path>,
        format: &FeedFormat,
        interval: Option<i64>,
        rows: usize,
    ) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::open(path, format, "quotes", rows, |format| match format.layout {
            Layout::Trueup | Layout::BinanceBookTicker => Ok(Box::new(QuoteRows::new(format))),
            Layout::Lean => Ok(Box::new(LeanQuotes::new(format, interval))),
            layout => Err(no_such(path, layout, "quotes")),
        })
    }
}

impl FileStream<Known<Print>> {
    /// Trades: `ts, price, size`, optional `aggressor`; Binance's, Lean's, and those among Databento's messages by order.
    ///
    /// # Errors
    /// What cannot be opened, a layout without trades.
    pub fn trades(path: impl AsRef<Path>, format: &FeedFormat, rows: usize) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::open(path, format, "trades", rows, |format| match format.layout {
            Layout::Trueup | Layout::BinanceTrades => Ok(Box::new(PrintRows::new(format))),
            Layout::Lean => Ok(Box::new(LeanPrints::new(format))),
            Layout::DatabentoMbo => Ok(Box::new(DatabentoPrints::new(format))),
            layout => Err(no_such(path, layout, "trades")),
        })
    }
}

impl FileStream<NumberedPrint> {
    /// The same trades with their numbers, where the layout has such.
    ///
    /// # Errors
    /// As [`FileStream::trades`].
    pub fn numbered_trades(path: impl AsRef<Path>, format: &FeedFormat, rows: usize) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::open(path, format, "trades", rows, |format| match format.layout {
            Layout::Trueup | Layout::BinanceTrades => Ok(Box::new(PrintRows::new(format))),
            layout => Err(no_such(path, layout, "trades")),
        })
    }
}

impl FileStream<OrderStep> {
    /// Events of orders with what the file says of those that leave: `ts, order_id, action, side, price, size`, and Bitstamp's.
    ///
    /// # Errors
    /// As [`FileStream::order_events`].
    pub fn order_steps(path: impl AsRef<Path>, format: &FeedFormat, rows: usize) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::open(path, format, "book", rows, |format| match format.layout {
            Layout::TrueupOrders => Ok(Box::new(OrderRows::new(format))),
            Layout::BitstampL3 => Ok(Box::new(BitstampOrders::new(format))),
            layout => Err(no_such(path, layout, "book")),
        })
    }
}

impl FileStream<DepthChange> {
    /// Changes of a book by price: `ts, side, price, size`, optional `action`; Binance's, after their snapshot.
    ///
    /// # Errors
    /// What cannot be opened, a layout without such changes, and what cannot be read of a snapshot.
    pub fn depth(path: impl AsRef<Path>, format: &FeedFormat, rows: usize) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::open(path, format, "book", rows, |format| match format.layout {
            Layout::Trueup => Ok(Box::new(DepthRows::new(format))),
            Layout::BinanceDepth => Ok(Box::new(BinanceDepth::new(format)?)),
            layout => Err(no_such(path, layout, "book")),
        })
    }
}

impl FileStream<OrderEvent> {
    /// Events of resting orders: `ts, order_id, action, side, price, size`; Databento's and Bitstamp's.
    ///
    /// # Errors
    /// What cannot be opened, a layout without such events.
    pub fn order_events(path: impl AsRef<Path>, format: &FeedFormat, rows: usize) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::open(path, format, "book", rows, |format| match format.layout {
            Layout::TrueupOrders => Ok(Box::new(OrderRows::new(format))),
            Layout::DatabentoMbo => Ok(Box::new(DatabentoOrders::new(format))),
            Layout::BitstampL3 => Ok(Box::new(BitstampOrders::new(format))),
            layout => Err(no_such(path, layout, "book")),
        })
    }
}

impl<T: Dated + Clone + PartialEq + Send> Stream<T> for FileStream<T> {
    fn refill(&mut self, into: &mut Vec<T>) -> Result<bool, StreamError> {
        let before = into.len();
        // A table may hold nothing that is kept, and the end may still give out what was held back.
        while self.next_rows(&mut |row| into.push(row))? {
            if into.len() > before {
                return Ok(true);
            }
        }
        Ok(into.len() > before)
    }

    fn notes(&self) -> Option<&DataNotes> {
        Some(&self.rows.notes)
    }
}
