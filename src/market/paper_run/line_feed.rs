//! Lines of JSON as the feed of a paper run: every line is in the journal before it is read.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::io::{DataEntry, FeedKind, InputError, JsonRow, RunFile, Table, hint_among};
use crate::market::stream::{Between, Dated, Stream, StreamError, TableRows, check_rows};
use crate::market::{DataNotes, Sources, run};

use super::entry::Entry;
use super::paper_log::PaperLog;

/// What gives the lines of a feed. It waits until there is one.
pub trait LineSource: Send {
    /// The next line. It waits a while for one, and says so where there is none by then.
    ///
    /// # Errors
    /// A feed that cannot be read.
    fn next_line(&mut self) -> Result<NextLine, InputError>;

    /// A row that cannot be was left out.
    fn refused(&mut self, why: &InputError);
}

/// What comes next in a feed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NextLine {
    /// A line.
    Text(String),
    /// Nothing yet.
    Later,
    /// There are no more, or nobody wants them any more.
    End,
}

/// What is done about rows of a feed that cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BadRows {
    /// They are told, counted and left out.
    #[default]
    LeftOut,
    /// The first ends the session.
    EndIt,
}

/// What was found in the lines of a feed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LinesSeen {
    /// Lines with a row that was taken.
    pub rows: u64,
    /// Lines that were left out, because they could not be read or their rows cannot be.
    pub refused: u64,
    /// Rows whose `seq` was in the log already.
    pub known: u64,
}

/// What errors call the feed.
pub(super) const NAME: &str = "standard input";

/// Keys that say where a row belongs.
const ADDRESS: [&str; 3] = ["symbol", "kind", "seq"];

/// The lines of a feed, sorted into the streams they belong to.
pub(super) struct Lines {
    source: Box<dyn LineSource>,
    log: Arc<Mutex<PaperLog>>,
    /// Symbol and kind of each stream.
    streams: Vec<(String, &'static str)>,
    waiting: Vec<VecDeque<Waiting>>,
    /// What was given out while the feed is only looked at.
    looked_at: Option<Vec<(usize, Waiting)>>,
    bad: BadRows,
    /// Number of the last line.
    line: usize,
    newest: Option<u64>,
    ended: bool,
    pub seen: LinesSeen,
}

/// A row that waits to be asked for.
#[derive(Clone)]
struct Waiting {
    row: JsonRow,
    /// It is new: what is wrong with it has yet to be told.
    fresh: bool,
}

impl Lines {
    /// The feed of `run` from `source`.
    pub fn new(run: &RunFile, source: Box<dyn LineSource>, bad: BadRows, log: &Arc<Mutex<PaperLog>>) -> Self {
        let market = run.data.iter().filter(|entry| entry.kind != FeedKind::Actions);
        let streams: Vec<_> = market.map(|entry| (entry.symbol.clone(), word(entry.kind))).collect();
        Self {
            source,
            log: Arc::clone(log),
            waiting: vec![VecDeque::new(); streams.len()],
            streams,
            looked_at: Some(Vec::new()),
            bad,
            line: 0,
            newest: None,
            ended: false,
            seen: LinesSeen::default(),
        }
    }

    /// What was only looked at is given out once more.
    pub fn rewind(&mut self) {
        for (stream, waiting) in self.looked_at.take().unwrap_or_default().into_iter().rev() {
            self.waiting[stream].push_front(waiting);
        }
    }

    /// The next row of a stream; none when the feed has ended.
    fn next(&mut self, stream: usize) -> Result<Option<Waiting>, InputError> {
        loop {
            if let Some(waiting) = self.waiting[stream].pop_front() {
                if let Some(looked_at) = &mut self.looked_at {
                    looked_at.push((stream, waiting.clone()));
                }
                return Ok(Some(waiting));
            }
            if self.ended || !self.read_on()? {
                return Ok(None);
            }
        }
    }

    /// Reads a line if there is one, and puts its row where it belongs; false at the end.
    fn read_on(&mut self) -> Result<bool, InputError> {
        let mut log = self.log.lock().unwrap_or_else(PoisonError::into_inner);
        let (line, text, fresh) = match log.next_text()? {
            Some((line, text)) => (line, text, false),
            None if log.input_has_ended() || log.is_read_only() => {
                self.ended = true;
                return Ok(false);
            }
            None => match self.source.next_line()? {
                NextLine::Text(text) => {
                    let line = self.line + 1;
                    log.add(&[Entry::Line { line, text: text.clone() }])?;
                    (line, text, true)
                }
                NextLine::Later => {
                    log.sync()?;
                    return Ok(true);
                }
                NextLine::End => {
                    log.add(&[Entry::EndOfInput {}])?;
                    self.ended = true;
                    return Ok(false);
                }
            },
        };
        drop(log);
        self.line = line;
        match self.addressed(line, &text) {
            Ok(Some((stream, row))) => {
                self.seen.rows += 1;
                self.waiting[stream].push_back(Waiting { row, fresh });
            }
            Ok(None) => self.seen.known += 1,
            Err(error) => self.refuse(error, fresh)?,
        }
        Ok(true)
    }

    /// The row of a line and its stream; none where it was there already.
    fn addressed(&mut self, line: usize, text: &str) -> Result<Option<(usize, JsonRow)>, InputError> {
        let row = JsonRow::read(NAME, line, text)?;
        if let Some(number) = row.count("seq")? {
            if self.newest.is_some_and(|newest| number <= newest) {
                return Ok(None);
            }
            self.newest = Some(number);
        }
        let (symbol, kind) = (row.text("symbol")?, row.text("kind")?);
        let at = self.streams.iter().position(|(own, word)| own == symbol && *word == kind);
        let Some(stream) = at else {
            let known = self.streams.iter().any(|(own, _)| own == symbol);
            let (key, found) = if known { ("kind", kind) } else { ("symbol", symbol) };
            let there: Vec<&str> = match known {
                true => self.streams.iter().filter(|(own, _)| own == symbol).map(|(_, word)| *word).collect(),
                false => self.streams.iter().map(|(own, _)| own.as_str()).collect(),
            };
            let error = row.error(key, "RUN.toml names no such data").found_text(found);
            return Err(error.maybe_hint(hint_among(found, &there)));
        };
        Ok(Some((stream, row)))
    }

    /// Leaves a row out, or ends the session.
    fn refuse(&mut self, error: InputError, fresh: bool) -> Result<(), InputError> {
        if self.bad == BadRows::EndIt {
            return Err(error);
        }
        self.seen.refused += 1;
        if fresh {
            self.source.refused(&error);
        }
        Ok(())
    }
}

/// The word of a kind in a line.
fn word(kind: FeedKind) -> &'static str {
    match kind {
        FeedKind::Bars => "bar",
        FeedKind::Quotes => "quote",
        FeedKind::Trades => "trade",
        FeedKind::Book => "depth",
        FeedKind::Actions => "action",
    }
}

/// The rows of one stream.
struct LineRows<T> {
    lines: Arc<Mutex<Lines>>,
    stream: usize,
    rows: TableRows<T>,
    ended: bool,
}

fn locked(lines: &Mutex<Lines>) -> MutexGuard<'_, Lines> {
    lines.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<T: Dated + Clone + PartialEq + Send> Stream<T> for LineRows<T> {
    fn refill(&mut self, into: &mut Vec<T>) -> Result<bool, StreamError> {
        let before = into.len();
        let mut lines = locked(&self.lines);
        while into.len() == before && !self.ended {
            let Some(Waiting { row, fresh }) = lines.next(self.stream)? else {
                self.ended = true;
                self.rows.finish(&mut |row| into.push(row));
                break;
            };
            let read = one(&row).and_then(|table| self.rows.read(&table, &mut |row| into.push(row)));
            if let Err(error) = read.map_err(|error| row.placed(error)) {
                // What is looked at comes again, and is told then.
                match (&lines.looked_at, lines.bad) {
                    (Some(_), BadRows::LeftOut) => {}
                    _ => {
                        lines.seen.rows = lines.seen.rows.saturating_sub(1);
                        lines.refuse(error, fresh)?;
                    }
                }
            }
        }
        Ok(into.len() > before)
    }

    fn notes(&self) -> Option<&DataNotes> {
        Some(self.rows.notes())
    }
}

fn one(row: &JsonRow) -> Result<Table, InputError> {
    row.table(&ADDRESS)
}

/// The sources of all instruments of `run`, from lines.
///
/// # Errors
/// Data that cannot come line by line; an instrument without data.
pub(super) fn sources(run: &RunFile, lines: &Arc<Mutex<Lines>>) -> Result<Vec<Sources>, InputError> {
    let of = |(index, symbol): (usize, &str)| {
        let mut sources = Sources::default();
        let market = run.data.iter().filter(|entry| entry.kind != FeedKind::Actions).enumerate();
        let mut own = market.filter(|(_, entry)| entry.symbol == symbol).peekable();
        if own.peek().is_none() {
            return Err(run::no_data(run, index, symbol));
        }
        own.try_for_each(|(stream, entry)| add(&mut sources, run, entry, (lines, stream)))?;
        Ok(sources)
    };
    run.instruments.iter().map(|instrument| instrument.symbol.as_str()).enumerate().map(of).collect()
}

fn add(
    sources: &mut Sources,
    run: &RunFile,
    entry: &DataEntry,
    (lines, stream): (&Arc<Mutex<Lines>>, usize),
) -> Result<(), InputError> {
    fn through<T: Dated + Clone + PartialEq + Send + 'static>(
        rows: TableRows<T>,
        run: &RunFile,
        (lines, stream): (&Arc<Mutex<Lines>>, usize),
    ) -> Box<dyn Stream<T>> {
        let rows = LineRows { lines: Arc::clone(lines), stream, rows, ended: false };
        match run::span(run) {
            Some((start, last)) => Box::new(Between::new(rows, start, last)),
            None => Box::new(rows),
        }
    }
    check_rows(entry)?;
    let at = (lines, stream);
    match entry.kind {
        FeedKind::Bars => sources.bars = TableRows::bars(entry).map(|rows| through(rows, run, at)),
        FeedKind::Quotes => sources.quotes = Some(through(TableRows::quotes(entry), run, at)),
        FeedKind::Trades => sources.trades = Some(through(TableRows::trades(entry), run, at)),
        FeedKind::Book if entry.format.layout.tells_orders() => {
            sources.order_events = Some(through(TableRows::order_events(entry), run, at));
        }
        FeedKind::Book => sources.depth = Some(through(TableRows::depth(entry), run, at)),
        FeedKind::Actions => {}
    }
    Ok(())
}
