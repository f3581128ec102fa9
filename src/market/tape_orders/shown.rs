//! What a market shows beside its trades: a book that is kept as files tell of it, side by side.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use crate::io::InputError;
use crate::market::{
    Book, Dated, DepthAction, DepthChange, FileStream, Known, Price, Print, Quantity, Side, Stream, StreamError,
};
use crate::sim2real::Timestamp;

use super::book::{TapeBook, exact_size};
use super::found::{TapeCounts, TapeSink};

/// Why a file gives no more.
pub(super) fn of_stream(error: StreamError, path: &Path) -> InputError {
    match error {
        StreamError::Input(error) => error,
        StreamError::History(error) => InputError::new(path, error.to_string()),
    }
}

/// The rows of one file, in the order of their stamps: one that goes back counts as of the one before it.
pub(super) struct Rows<T> {
    stream: FileStream<T>,
    path: PathBuf,
    held: VecDeque<T>,
    fresh: Vec<T>,
    now: Timestamp,
}

impl<T: Dated + Clone + PartialEq + Send> Rows<T> {
    pub(super) fn new(stream: FileStream<T>, path: &Path) -> Self {
        Self { stream, path: path.to_owned(), held: VecDeque::new(), fresh: Vec::new(), now: Timestamp::MIN }
    }

    /// The stamp of the next row.
    pub(super) fn next_time(&mut self) -> Result<Option<Timestamp>, InputError> {
        if self.held.is_empty() {
            self.stream.refill(&mut self.fresh).map_err(|error| of_stream(error, &self.path))?;
            self.held.extend(self.fresh.drain(..));
        }
        let Some(row) = self.held.front() else { return Ok(None) };
        self.now = self.now.max(row.time());
        Ok(Some(self.now))
    }

    pub(super) fn next(&mut self) -> Option<T> {
        self.held.pop_front()
    }

    pub(super) fn lines(&self) -> Vec<String> {
        self.stream.notes().lines()
    }
}

/// What is shown beside trades.
pub(super) struct Shown {
    pub(super) book: TapeBook,
    pub(super) depth: Option<Rows<DepthChange>>,
    pub(super) quotes: Option<Rows<Known<Book>>>,
    /// Whether the book is whole: from the first row of its file on.
    pub(super) begun: bool,
}

impl Shown {
    pub(super) fn next_time(&mut self) -> Result<Option<Timestamp>, InputError> {
        let depth = self.depth.as_mut().map_or(Ok(None), Rows::next_time)?;
        let quotes = self.quotes.as_mut().map_or(Ok(None), Rows::next_time)?;
        Ok(depth.into_iter().chain(quotes).min())
    }

    /// Takes in all rows of the stamp `at`: changes of the book first, since best prices are told at every change.
    pub(super) fn take_instant(&mut self, at: Timestamp) -> Result<(), InputError> {
        let mut newest = None;
        if let Some(depth) = &mut self.depth {
            while depth.next_time()? == Some(at) {
                let Some(change) = depth.next() else { break };
                self.begun = true;
                newest = Some(change.side);
                match change.action {
                    DepthAction::Set => self.book.set(change.side, change.price, exact_size(change.size)),
                    DepthAction::Clear => self.book.clear(change.side),
                }
            }
        }
        if let Some(side) = newest {
            self.book.settle(side);
        }
        let Some(quotes) = &mut self.quotes else { return Ok(()) };
        while quotes.next_time()? == Some(at) {
            let Some(quote) = quotes.next() else { break };
            let shown = [(Side::Buy, quote.what.opposite(Side::Sell)), (Side::Sell, quote.what.opposite(Side::Buy))];
            for (side, levels) in shown {
                if self.depth.is_none() || levels.is_empty() {
                    self.book.clear(side);
                }
                // What has no size is no level that an order could take.
                for level in levels.iter().rev().filter(|level| level.size.is_finite()) {
                    let Ok(price) = Price::nearest(level.price) else { continue };
                    match self.depth {
                        Some(_) => self.book.show_best(side, price, exact_size(level.size)),
                        None => self.book.set(side, price, exact_size(level.size)),
                    }
                }
            }
        }
        Ok(())
    }

    /// Takes away what a trade took, and all that was displayed before it: feeds tell of a book some milliseconds after trades,
    /// and in bursts the next order comes before that. Not from quotes, which may be of other places than the trades.
    pub(super) fn deplete(&mut self, print: &Print) {
        let (Some(took), true) = (print.aggressor, self.depth.is_some()) else { return };
        let (Ok(price), Ok(size)) = (Price::nearest(print.price), Quantity::nearest(print.size)) else { return };
        let side = took.opposite();
        self.book.drop_before(side, price);
        self.book.add(side, price, Quantity(-size.0));
    }

    pub(super) fn tell<S: TapeSink>(
        &self,
        at: Timestamp,
        levels: usize,
        counts: &mut TapeCounts,
        sink: &mut S,
    ) -> Result<(), S::Error> {
        // A book that is not whole yet is no book.
        if !self.begun {
            return Ok(());
        }
        counts.quotes += 1;
        sink.quote(at, &self.book.top(Side::Buy, levels), &self.book.top(Side::Sell, levels))
    }
}
