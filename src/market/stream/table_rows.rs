//! Rows of tables that come from elsewhere than a file: a few at a time, and nobody knows when the next.

use crate::io::{ClockOffset, DataEntry, FeedKind, InputError, Layout, OnBad, Table};
use crate::market::{Bar, Book, DataNotes, DepthChange, OrderEvent, Print};
use crate::sim2real::Timestamp;

use super::bar_rows::BarRows;
use super::decode::{Decode, Kept};
use super::depth_rows::DepthRows;
use super::file_stream::{decode, finish};
use super::order_rows::OrderRows;
use super::print_rows::PrintRows;
use super::quote_rows::QuoteRows;
use super::{Dated, Known};

/// Reads rows as a file of the contract's own layout has them, and holds them to the same rules. Each row that cannot be is an
/// error: what is done about it is for whoever reads on.
pub(in crate::market) struct TableRows<T> {
    decode: Box<dyn Decode<T>>,
    order_column: String,
    rows: Kept<T>,
    until: Option<Timestamp>,
    max_gap: Option<i64>,
}

impl<T: Dated + Clone + PartialEq> TableRows<T> {
    fn new(entry: &DataEntry, decode: Box<dyn Decode<T>>) -> Self {
        let rules = entry.format.rules;
        let notes = DataNotes::of(entry.kind.word());
        let order_column = decode.order_column().to_owned();
        let rows = Kept::new(notes, OnBad::Refuse, rules.reorder, rules.max_gap);
        Self { decode, order_column, rows, until: rules.until, max_gap: rules.max_gap }
    }

    /// Hands the rows of a table to `into`.
    ///
    /// # Errors
    /// The first row that cannot be.
    pub fn read(&mut self, table: &Table, into: &mut dyn FnMut(T)) -> Result<(), InputError> {
        decode(table, &mut *self.decode, &self.order_column, &mut self.rows, into)
    }

    /// Hands out what was held back: no more rows come.
    pub fn finish(&mut self, into: &mut dyn FnMut(T)) {
        finish(&mut *self.decode, &mut self.rows, (self.until, self.max_gap), into);
    }

    /// What was found so far.
    pub fn notes(&self) -> &DataNotes {
        &self.rows.notes
    }
}

/// Holds `entry`, a `[[data]]` of a run, to be read row by row: in the contract's own layout, and with clocks that are known.
pub(in crate::market) fn check_rows(entry: &DataEntry) -> Result<(), InputError> {
    let refuse = |message: String, hint: &str| Err(InputError::new(&entry.path, message).hint(hint));
    let own = matches!(entry.format.layout, Layout::Trueup | Layout::TrueupOrders);
    if !own && entry.kind != FeedKind::Actions {
        let message = format!("rows of the layout `{}` cannot come line by line", entry.format.layout.word());
        return refuse(message, "drop `layout`: the keys of a line are the contract's columns");
    }
    if entry.format.clock.offset == ClockOffset::Estimated {
        let hint = "declare the seconds to add to the local clock: clock_offset = 0.003";
        return refuse("a `clock_offset` cannot be estimated from rows that are still to come".to_owned(), hint);
    }
    if entry.kind == FeedKind::Bars && (entry.format.stamp.is_none() || entry.interval.is_none()) {
        let hint = "declare them in [[data]]: stamp = \"open\", interval = \"1m\"";
        return refuse("bars that come line by line need their `stamp` and their `interval`".to_owned(), hint);
    }
    Ok(())
}

impl TableRows<Bar> {
    /// Bars; none where their stamp or interval is not declared.
    pub fn bars(entry: &DataEntry) -> Option<Self> {
        let rows = BarRows::new(&entry.format, entry.format.stamp?, entry.interval?);
        Some(Self::new(entry, Box::new(rows)))
    }
}

impl TableRows<Known<Book>> {
    /// Quotes.
    pub fn quotes(entry: &DataEntry) -> Self {
        Self::new(entry, Box::new(QuoteRows::new(&entry.format)))
    }
}

impl TableRows<Known<Print>> {
    /// Trades.
    pub fn trades(entry: &DataEntry) -> Self {
        Self::new(entry, Box::new(PrintRows::new(&entry.format)))
    }
}

impl TableRows<DepthChange> {
    /// Changes of a book by price.
    pub fn depth(entry: &DataEntry) -> Self {
        Self::new(entry, Box::new(DepthRows::new(&entry.format)))
    }
}

impl TableRows<OrderEvent> {
    /// Events of resting orders.
    pub fn order_events(entry: &DataEntry) -> Self {
        Self::new(entry, Box::new(OrderRows::new(&entry.format)))
    }
}
