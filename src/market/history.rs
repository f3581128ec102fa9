//! What is known of one instrument's market over time.

use std::sync::Arc;

use crate::sim2real::Timestamp;

use super::row_check::{check_bar, check_depth, check_order, check_print, check_quote};
use super::{Bar, DataNotes, DepthChange, OrderEvent, Print, Quotes};

#[cfg(test)]
mod tests;

/// Bars, quotes, trades and changes of the book of one instrument, each in the order in which they could be known. It was
/// made by its own checks, so that what reads it need not check again. A clone shares them: many runs on the same data hold them once.
///
/// The `time` of a quote is here the time at which it could be known: a backtest that shows it by that shows nothing early.
/// Trades, changes of the book and order events have both times.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    bars: Arc<Vec<Bar>>,
    quotes: Arc<Quotes>,
    prints: Arc<Vec<Print>>,
    /// When each of them could be known; empty where that is when it happened.
    prints_known: Arc<Vec<Timestamp>>,
    depth: Arc<Vec<DepthChange>>,
    order_events: Arc<Vec<OrderEvent>>,
    notes: Vec<DataNotes>,
}

/// The rows of a history that is read piece by piece.
pub(super) struct RowsMut<'h> {
    pub bars: &'h mut Vec<Bar>,
    pub quotes: &'h mut Quotes,
    pub prints: &'h mut Vec<Print>,
    pub prints_known: &'h mut Vec<Timestamp>,
    pub depth: &'h mut Vec<DepthChange>,
    pub order_events: &'h mut Vec<OrderEvent>,
}

/// A history that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HistoryError {
    /// Time goes back, or stands still where it must not.
    #[error("{what} {row}: its time {found} does not follow {before}\nhint: sort by time and remove duplicates")]
    Time {
        /// "bar", "quote", "trade" and so on.
        what: &'static str,
        /// Row, from 0.
        row: usize,
        /// Its time.
        found: Timestamp,
        /// The time before.
        before: Timestamp,
    },
    /// A bar that ends before it begins.
    #[error(
        "bar {row}: it begins at {open_at} and ends at {known_at}\nhint: `stamp` says which end of a bar its time names"
    )]
    Span {
        /// Row, from 0.
        row: usize,
        /// When it begins.
        open_at: Timestamp,
        /// When it ends.
        known_at: Timestamp,
    },
    /// Prices that cannot be those of one bar.
    #[error(
        "bar {row}: {column} is {value}\nhint: prices must be above 0, with low <= open, close <= high; volume must be finite, 0 or above"
    )]
    Bar {
        /// Row, from 0.
        row: usize,
        /// The column at fault.
        column: &'static str,
        /// What was found.
        value: f64,
    },
    /// A level that cannot be quoted, or sides that cross.
    #[error("quote {row}: {column} is {value}\nhint: {hint}")]
    Quote {
        /// Row, from 0.
        row: usize,
        /// The column at fault ("ask", "bid2_size").
        column: String,
        /// What was found.
        value: f64,
        /// The remedy.
        hint: &'static str,
    },
    /// A trade, a change of the book or an order event that cannot be.
    #[error("{what} {row}: {column} is {value}\nhint: {hint}")]
    Event {
        /// What it is.
        what: &'static str,
        /// Row, from 0.
        row: usize,
        /// The column at fault.
        column: &'static str,
        /// What was found.
        value: f64,
        /// The remedy.
        hint: &'static str,
    },
    /// What was known before it happened.
    #[error("{what} {row}: it was known at {known_at}, before it happened at {time}\nhint: add an offset to the clock")]
    Known {
        /// What it is.
        what: &'static str,
        /// Row, from 0.
        row: usize,
        /// When it happened.
        time: Timestamp,
        /// When it was known.
        known_at: Timestamp,
    },
}

impl History {
    /// A history of the given bars and quotes.
    ///
    /// # Errors
    /// If times do not increase (strictly for bars, which must not overlap either), or a price or size cannot be.
    pub fn new(bars: Vec<Bar>, quotes: Quotes) -> Result<Self, HistoryError> {
        check_bars(&bars)?;
        check_quotes(&quotes)?;
        Ok(Self { bars: Arc::new(bars), quotes: Arc::new(quotes), ..Self::default() })
    }

    /// The same with these trades.
    ///
    /// # Errors
    /// If times go back, or a price or size is not above 0.
    pub fn with_prints(self, prints: Vec<Print>) -> Result<Self, HistoryError> {
        check_order_of_times("trade", prints.iter().map(|print| print.time))?;
        prints.iter().enumerate().try_for_each(|(row, print)| check_print(row, print))?;
        Ok(Self { prints: Arc::new(prints), ..self })
    }

    /// The same with these trades, each of which could be known at its place in `known`.
    ///
    /// # Errors
    /// If these times go back, one lies before its trade or is missing, or a price or size is not above 0.
    pub fn with_prints_known_at(self, prints: Vec<Print>, known: Vec<Timestamp>) -> Result<Self, HistoryError> {
        check_order_of_times("trade", known.iter().copied())?;
        for (row, print) in prints.iter().enumerate() {
            check_print(row, print)?;
            let (time, known_at) = (print.time, known.get(row).copied().unwrap_or(Timestamp::MIN));
            if known_at < time {
                return Err(HistoryError::Known { what: "trade", row, time, known_at });
            }
        }
        let same = prints.iter().zip(&known).all(|(print, known)| print.time == *known);
        let known = if same { Vec::new() } else { known };
        Ok(Self { prints: Arc::new(prints), prints_known: Arc::new(known), ..self })
    }

    /// When trade `row` could be known.
    #[must_use]
    pub fn print_known_at(&self, row: usize) -> Option<Timestamp> {
        let print = self.prints.get(row)?;
        Some(self.prints_known.get(row).copied().unwrap_or(print.time))
    }

    /// The same with these changes of the book, price by price.
    ///
    /// # Errors
    /// If the times at which they were known go back, one was known before it happened, or a price or size cannot be.
    pub fn with_depth(self, depth: Vec<DepthChange>) -> Result<Self, HistoryError> {
        check_order_of_times("change of the book", depth.iter().map(|change| change.known_at))?;
        depth.iter().enumerate().try_for_each(|(row, change)| check_depth(row, change))?;
        Ok(Self { depth: Arc::new(depth), ..self })
    }

    /// The same with these events of resting orders.
    ///
    /// # Errors
    /// If the times at which they were known go back, one was known before it happened, or a price or size cannot be.
    pub fn with_order_events(self, order_events: Vec<OrderEvent>) -> Result<Self, HistoryError> {
        check_order_of_times("order event", order_events.iter().map(|event| event.known_at))?;
        order_events.iter().enumerate().try_for_each(|(row, event)| check_order(row, event))?;
        Ok(Self { order_events: Arc::new(order_events), ..self })
    }

    /// The same with what is to be said of the data it was read from.
    #[must_use]
    pub fn with_notes(mut self, notes: DataNotes) -> Self {
        self.notes.push(notes);
        self
    }

    /// Its bars, oldest first.
    #[must_use]
    pub fn bars(&self) -> &[Bar] {
        &self.bars
    }

    /// Its bars, for who keeps them while it goes on with something else.
    #[inline(always)]
    pub(super) fn shared_bars(&self) -> &Arc<Vec<Bar>> {
        &self.bars
    }

    /// Its bars alone, oldest first.
    #[must_use]
    pub fn into_bars(self) -> Vec<Bar> {
        Arc::unwrap_or_clone(self.bars)
    }

    /// Its quotes alone, oldest first.
    #[must_use]
    pub fn into_quotes(self) -> Quotes {
        Arc::unwrap_or_clone(self.quotes)
    }

    /// Its quotes, oldest first.
    #[must_use]
    pub fn quotes(&self) -> &Quotes {
        &self.quotes
    }

    /// Its trades, in the order in which they were known.
    #[must_use]
    pub fn prints(&self) -> &[Print] {
        &self.prints
    }

    /// When each of its trades could be known; nothing where that is when they happened.
    #[inline(always)]
    pub(super) fn prints_known(&self) -> &[Timestamp] {
        &self.prints_known
    }

    /// Its changes of the book, in the order in which they were known.
    #[must_use]
    pub fn depth(&self) -> &[DepthChange] {
        &self.depth
    }

    /// Its events of resting orders, in the order in which they were known.
    #[must_use]
    pub fn order_events(&self) -> &[OrderEvent] {
        &self.order_events
    }

    /// What is to be said of the files it was read from: one a file.
    #[must_use]
    pub fn notes(&self) -> &[DataNotes] {
        &self.notes
    }

    /// Whether there is nothing in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        let empty = [self.bars.is_empty(), self.quotes.is_empty(), self.prints.is_empty()];
        empty.into_iter().all(|empty| empty) && self.depth.is_empty() && self.order_events.is_empty()
    }

    /// Whether bars are all there is in it.
    #[must_use]
    pub fn shows_bars_alone(&self) -> bool {
        let finer =
            self.quotes.is_empty() && self.prints.is_empty() && self.depth.is_empty() && self.order_events.is_empty();
        finer && !self.bars.is_empty()
    }

    /// Its rows, for who reads them piece by piece, and holds each to what it can be.
    pub(super) fn rows_mut(&mut self) -> RowsMut<'_> {
        RowsMut {
            bars: Arc::make_mut(&mut self.bars),
            quotes: Arc::make_mut(&mut self.quotes),
            prints: Arc::make_mut(&mut self.prints),
            prints_known: Arc::make_mut(&mut self.prints_known),
            depth: Arc::make_mut(&mut self.depth),
            order_events: Arc::make_mut(&mut self.order_events),
        }
    }

    /// Number of its rows of all kinds.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.bars.len() + self.quotes.len() + self.prints.len() + self.depth.len() + self.order_events.len()
    }

    /// The same with the kinds of data that it has not and `other` has: each was checked when it was made.
    #[must_use]
    pub fn joined_with(self, other: Self) -> Self {
        let notes = self.notes.into_iter().chain(other.notes).collect();
        Self {
            bars: if self.bars.is_empty() { other.bars } else { self.bars },
            quotes: if self.quotes.is_empty() { other.quotes } else { self.quotes },
            prints_known: if self.prints.is_empty() { other.prints_known } else { self.prints_known },
            prints: if self.prints.is_empty() { other.prints } else { self.prints },
            depth: if self.depth.is_empty() { other.depth } else { self.depth },
            order_events: if self.order_events.is_empty() { other.order_events } else { self.order_events },
            notes,
        }
    }

    /// The same history without what was known before `start` or after `end`.
    #[must_use]
    pub fn within(&self, start: Timestamp, end: Timestamp) -> Self {
        let all = self.quotes.all();
        let mut quotes = Quotes::with_depth(self.quotes.depth());
        let from = all.times().partition_point(|time| *time < start);
        for quote in (from..all.len()).map_while(|k| all.get(k)).take_while(|quote| quote.time <= end) {
            quotes.push(quote.time, quote.bids, quote.asks);
        }
        let known = (0..self.prints.len()).filter_map(|row| Some((self.prints[row], self.print_known_at(row)?)));
        let prints = cut(&known.collect::<Vec<_>>(), |(_, known)| *known, start, end);
        let known = prints.iter().map(|(_, known)| *known).collect();
        Self {
            bars: Arc::new(cut(&self.bars, |bar| bar.known_at, start, end)),
            quotes: Arc::new(quotes),
            prints: Arc::new(prints.iter().map(|(print, _)| *print).collect()),
            prints_known: Arc::new(if self.prints_known.is_empty() { Vec::new() } else { known }),
            depth: Arc::new(cut(&self.depth, |change| change.known_at, start, end)),
            order_events: Arc::new(cut(&self.order_events, |event| event.known_at, start, end)),
            notes: self.notes.clone(),
        }
    }
}

fn check_bars(bars: &[Bar]) -> Result<(), HistoryError> {
    let mut before: Option<&Bar> = None;
    for (row, bar) in bars.iter().enumerate() {
        if let Some(before) = before
            && bar.open_at < before.known_at
        {
            return Err(HistoryError::Time { what: "bar", row, found: bar.open_at, before: before.known_at });
        }
        check_bar(row, bar)?;
        before = Some(bar);
    }
    Ok(())
}

fn check_quotes(quotes: &Quotes) -> Result<(), HistoryError> {
    let all = quotes.all();
    check_order_of_times("quote", all.times().iter().copied())?;
    for (row, quote) in (0..all.len()).map_while(|k| all.get(k)).enumerate() {
        check_quote(row, quote.bids, quote.asks)?;
    }
    Ok(())
}

/// Holds times not to go back.
fn check_order_of_times(what: &'static str, times: impl Iterator<Item = Timestamp>) -> Result<(), HistoryError> {
    let mut before = Timestamp::MIN;
    for (row, found) in times.enumerate() {
        if found < before {
            return Err(HistoryError::Time { what, row, found, before });
        }
        before = found;
    }
    Ok(())
}

/// Those of `rows`, which are in order of `time`, from `start` to `end`.
fn cut<T: Copy>(rows: &[T], time: impl Fn(&T) -> Timestamp, start: Timestamp, end: Timestamp) -> Vec<T> {
    let from = rows.partition_point(|row| time(row) < start);
    let to = rows.partition_point(|row| time(row) <= end);
    rows.get(from..to).unwrap_or_default().to_vec()
}
