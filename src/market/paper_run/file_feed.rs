//! Files as the feed of a paper run: every row is in the journal before the engine has it.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use crate::io::{FeedKind, InputError};
use crate::market::stream::{Dated, Known, Stream, StreamError};
use crate::market::{Bar, Book, DataNotes, DepthChange, History, OrderEvent, Print, Quote, Sources};

use super::entry::Entry;
use super::paper_log::PaperLog;
use super::stored_row::Storable;

/// A stream whose rows are given one at a time, each when the journal has it.
struct Journaled<T> {
    inner: Box<dyn Stream<T>>,
    /// Rows of the file that were read ahead.
    ahead: VecDeque<T>,
    stream: usize,
    name: String,
    log: Arc<Mutex<PaperLog>>,
}

/// The sources of all instruments, their rows going through the journal.
pub(super) fn journaled(sources: Vec<Sources>, symbols: &[&str], log: &Arc<Mutex<PaperLog>>) -> Vec<Sources> {
    let mut stream = 0;
    let all = sources.into_iter().zip(symbols);
    all.map(|(sources, symbol)| {
        let Sources { bars, quotes, trades, depth, order_events } = sources;
        Sources {
            bars: through(bars, symbol, FeedKind::Bars, &mut stream, log),
            quotes: through(quotes, symbol, FeedKind::Quotes, &mut stream, log),
            trades: through(trades, symbol, FeedKind::Trades, &mut stream, log),
            depth: through(depth, symbol, FeedKind::Book, &mut stream, log),
            order_events: through(order_events, symbol, FeedKind::Book, &mut stream, log),
        }
    })
    .collect()
}

fn through<T: Dated + Storable + 'static>(
    inner: Option<Box<dyn Stream<T>>>,
    symbol: &str,
    kind: FeedKind,
    stream: &mut usize,
    log: &Arc<Mutex<PaperLog>>,
) -> Option<Box<dyn Stream<T>>> {
    let number = *stream;
    *stream += 1;
    let name = format!("the {} of `{symbol}`", kind.word());
    inner.map(|inner| {
        let log = Arc::clone(log);
        Box::new(Journaled { inner, ahead: VecDeque::new(), stream: number, name, log }) as Box<dyn Stream<T>>
    })
}

impl<T: Dated + Storable> Journaled<T> {
    fn next_of_file(&mut self) -> Result<Option<T>, StreamError> {
        if self.ahead.is_empty() {
            let mut rows = Vec::new();
            self.inner.refill(&mut rows)?;
            self.ahead.extend(rows);
        }
        Ok(self.ahead.pop_front())
    }

    /// The next row: held to be that of the journal, or written into it.
    fn next(&mut self) -> Result<Option<T>, StreamError> {
        let own = self.next_of_file()?;
        let mut log = self.log.lock().unwrap_or_else(PoisonError::into_inner);
        let found = own.as_ref().map(Storable::stored);
        match (log.next_row(self.stream)?, found) {
            (Some(stored), found) if found.as_ref() == Some(&stored) => Ok(own),
            (Some(stored), found) => Err(log.changed(&self.name, &stored, found.as_ref()).into()),
            // A journal that is only read ends where it ends.
            (None, _) if log.is_read_only() => Ok(None),
            (None, None) => Ok(None),
            (None, Some(row)) => {
                log.add(&[Entry::Row { stream: self.stream, row }])?;
                Ok(own)
            }
        }
    }
}

impl<T: Dated + Storable> Stream<T> for Journaled<T> {
    fn refill(&mut self, into: &mut Vec<T>) -> Result<bool, StreamError> {
        let row = self.next()?;
        let more = row.is_some();
        into.extend(row);
        Ok(more)
    }

    fn notes(&self) -> Option<&DataNotes> {
        self.inner.notes()
    }
}

/// The rows of one kind of a history that is in memory, as a stream.
struct OfHistory<T> {
    history: History,
    row: fn(&History, usize) -> Option<T>,
    next: usize,
    kind: FeedKind,
}

impl<T: Dated + Send> Stream<T> for OfHistory<T> {
    fn refill(&mut self, into: &mut Vec<T>) -> Result<bool, StreamError> {
        let row = (self.row)(&self.history, self.next);
        self.next += 1;
        let more = row.is_some();
        into.extend(row);
        Ok(more)
    }

    fn notes(&self) -> Option<&DataNotes> {
        self.history.notes().iter().find(|notes| notes.what() == self.kind.word())
    }
}

/// Histories that are in memory, as streams.
pub(super) fn sources_of(histories: &[History]) -> Vec<Sources> {
    histories.iter().map(source_of).collect()
}

fn source_of(history: &History) -> Sources {
    fn rows<T: Dated + Send + 'static>(
        history: &History,
        count: usize,
        kind: FeedKind,
        row: fn(&History, usize) -> Option<T>,
    ) -> Option<Box<dyn Stream<T>>> {
        (count > 0).then(|| Box::new(OfHistory { history: history.clone(), row, next: 0, kind }) as Box<dyn Stream<T>>)
    }
    let quote = |history: &History, k: usize| history.quotes().all().get(k).map(book_of);
    let print = |history: &History, k: usize| {
        let what = *history.prints().get(k)?;
        Some(Known { known_at: history.prints_known().get(k).copied().unwrap_or(what.time), what })
    };
    let event = |history: &History, k: usize| history.order_events().get(k).copied();
    Sources {
        bars: rows::<Bar>(history, history.bars().len(), FeedKind::Bars, |history, k| history.bars().get(k).copied()),
        quotes: rows::<Known<Book>>(history, history.quotes().len(), FeedKind::Quotes, quote),
        trades: rows::<Known<Print>>(history, history.prints().len(), FeedKind::Trades, print),
        depth: rows::<DepthChange>(history, history.depth().len(), FeedKind::Book, |h, k| h.depth().get(k).copied()),
        order_events: rows::<OrderEvent>(history, history.order_events().len(), FeedKind::Book, event),
    }
}

fn book_of(quote: Quote<'_>) -> Known<Book> {
    Known { known_at: quote.time, what: quote.book() }
}

/// The error of a feed as one of its input.
pub(super) fn input(error: StreamError) -> InputError {
    match error {
        StreamError::Input(error) => error,
        StreamError::History(error) => InputError::new("the data", error.to_string()),
    }
}
