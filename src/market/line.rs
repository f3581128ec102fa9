//! The data of one instrument as a feed reads them: whole, or from streams with some rows around the present at hand.

use std::ops::Range;
use std::sync::Arc;

use crate::sim2real::Timestamp;

use super::sources::RowKind;
use super::stream::{Known, StreamError};
use super::{Bar, Book, DataNotes, DepthChange, History, OrderEvent, Print, Quote, Quotes, Sources};

/// The data of one instrument. Rows are known by their numbers from the first of all, be it at hand or not.
#[derive(Debug)]
pub(super) struct Line {
    data: Data,
    /// Which kinds there are.
    kinds: [bool; RowKind::COUNT],
    /// Number of the first row at hand.
    first: [usize; RowKind::COUNT],
    /// From this row on, more has to be read: it is at hand itself, but maybe not all that happened at its instant.
    limit: [usize; RowKind::COUNT],
}

#[derive(Debug)]
enum Data {
    /// It shares its rows with whoever else runs on them.
    Whole(History),
    Part(Box<Part>),
}

/// What is at hand of streams.
#[derive(Debug)]
struct Part {
    at_hand: History,
    sources: Sources,
    books: Vec<Known<Book>>,
    prints: Vec<Known<Print>>,
}

impl Line {
    /// A history that is in memory as a whole.
    pub fn whole(history: &History) -> Self {
        let kinds = RowKind::ALL.map(|kind| count(history, kind) > 0);
        let (first, limit) = ([0; RowKind::COUNT], [usize::MAX; RowKind::COUNT]);
        Self { data: Data::Whole(history.clone()), kinds, first, limit }
    }

    /// What streams give; the first rows of each are read at once.
    ///
    /// # Errors
    /// What the streams refuse.
    pub fn of(sources: Sources) -> Result<Self, StreamError> {
        let kinds = RowKind::ALL.map(|kind| sources.has(kind));
        let part = Part { at_hand: History::default(), sources, books: Vec::new(), prints: Vec::new() };
        let (first, limit) = ([0; RowKind::COUNT], [0; RowKind::COUNT]);
        let mut line = Self { data: Data::Part(Box::new(part)), kinds, first, limit };
        RowKind::ALL.into_iter().try_for_each(|kind| line.read_on(kind, 0, 0))?;
        Ok(line)
    }

    /// The same once more, where its data are in memory as a whole: streams give their rows once.
    pub fn forked(&self) -> Option<Self> {
        match &self.data {
            Data::Whole(history) => Some(Self { data: Data::Whole(history.clone()), ..*self }),
            Data::Part(_) => None,
        }
    }

    /// The bars at hand, the row of the first of them, and the row from which on more must be read.
    pub fn bars_at_hand(&self) -> (&Arc<Vec<Bar>>, usize, usize) {
        let (bars, k) = match &self.data {
            Data::Whole(history) => (history.shared_bars(), RowKind::Bars as usize),
            Data::Part(part) => (part.at_hand.shared_bars(), RowKind::Bars as usize),
        };
        (bars, self.first[k], self.limit[k])
    }

    /// The rows at hand.
    #[cfg(feature = "io")]
    pub fn into_at_hand(self) -> History {
        match self.data {
            Data::Whole(history) => history,
            Data::Part(part) => part.at_hand,
        }
    }

    /// Whether there are rows of that kind, or a stream of them.
    pub fn tells(&self, kind: RowKind) -> bool {
        self.kinds[kind as usize]
    }

    /// Number of all rows, where they are in memory.
    pub fn rows(&self) -> Option<usize> {
        match &self.data {
            Data::Whole(history) => Some(history.rows()),
            Data::Part(_) => None,
        }
    }

    /// What was found in the data as far as they were read.
    pub fn notes(&self) -> Vec<DataNotes> {
        match &self.data {
            Data::Whole(history) => history.notes().to_vec(),
            Data::Part(part) => part.sources.notes(),
        }
    }

    #[inline(always)]
    fn bars(&self) -> &[Bar] {
        match &self.data {
            Data::Whole(history) => history.bars(),
            Data::Part(part) => part.at_hand.bars(),
        }
    }

    #[inline(always)]
    fn all_quotes(&self) -> &Quotes {
        match &self.data {
            Data::Whole(history) => history.quotes(),
            Data::Part(part) => part.at_hand.quotes(),
        }
    }

    #[inline(always)]
    fn prints(&self) -> &[Print] {
        match &self.data {
            Data::Whole(history) => history.prints(),
            Data::Part(part) => part.at_hand.prints(),
        }
    }

    #[inline(always)]
    fn changes(&self) -> &[DepthChange] {
        match &self.data {
            Data::Whole(history) => history.depth(),
            Data::Part(part) => part.at_hand.depth(),
        }
    }

    #[inline(always)]
    fn events(&self) -> &[OrderEvent] {
        match &self.data {
            Data::Whole(history) => history.order_events(),
            Data::Part(part) => part.at_hand.order_events(),
        }
    }

    /// When each trade could be known, where that is not when it happened.
    #[inline(always)]
    fn prints_known(&self) -> &[Timestamp] {
        match &self.data {
            Data::Whole(history) => history.prints_known(),
            Data::Part(part) => part.at_hand.prints_known(),
        }
    }

    /// The place of a row among those at hand, beyond all of them where it is not.
    #[inline(always)]
    fn place(&self, kind: RowKind, row: usize) -> usize {
        row.wrapping_sub(self.first[kind as usize])
    }

    /// Bar `row`.
    #[inline(always)]
    pub fn bar(&self, row: usize) -> Option<&Bar> {
        self.bars().get(self.place(RowKind::Bars, row))
    }

    /// The quotes at hand, and the place of quote `row` among them.
    #[inline(always)]
    pub fn quotes(&self, row: usize) -> (&Quotes, usize) {
        (self.all_quotes(), self.place(RowKind::Quotes, row))
    }

    /// Quote `row`.
    #[inline(always)]
    pub fn quote(&self, row: usize) -> Option<Quote<'_>> {
        let (quotes, place) = self.quotes(row);
        quotes.all().get(place)
    }

    /// Trade `row`.
    #[inline(always)]
    pub fn print(&self, row: usize) -> Option<&Print> {
        self.prints().get(self.place(RowKind::Trades, row))
    }

    /// Changes of the book.
    #[inline(always)]
    pub fn depth(&self, rows: Range<usize>) -> &[DepthChange] {
        let kind = RowKind::Depth;
        self.changes().get(self.place(kind, rows.start)..self.place(kind, rows.end)).unwrap_or_default()
    }

    /// Events of resting orders.
    #[inline(always)]
    pub fn order_events(&self, rows: Range<usize>) -> &[OrderEvent] {
        let kind = RowKind::Orders;
        self.events().get(self.place(kind, rows.start)..self.place(kind, rows.end)).unwrap_or_default()
    }

    /// When a row happens, at the exchange: a bar when it is over. [`Timestamp::MAX`] beyond the last.
    #[inline(always)]
    pub fn time(&self, kind: RowKind, row: usize) -> Timestamp {
        let at = self.place(kind, row);
        let time = match kind {
            RowKind::Bars => self.bars().get(at).map(|bar| bar.known_at),
            RowKind::Quotes => self.all_quotes().times().get(at).copied(),
            RowKind::Trades => self.prints().get(at).map(|print| print.time),
            RowKind::Depth => self.changes().get(at).map(|change| change.time),
            RowKind::Orders => self.events().get(at).map(|event| event.time),
        };
        time.unwrap_or(Timestamp::MAX)
    }

    /// When a row that happens at `time` can be known: that is never earlier.
    #[inline(always)]
    pub fn known_at(&self, kind: RowKind, row: usize, time: Timestamp) -> Timestamp {
        let at = self.place(kind, row);
        let known_at = match kind {
            RowKind::Trades => self.prints_known().get(at).copied(),
            RowKind::Depth => self.changes().get(at).map(|change| change.known_at),
            RowKind::Orders => self.events().get(at).map(|event| event.known_at),
            RowKind::Bars | RowKind::Quotes => None,
        };
        known_at.map_or(time, |known_at| known_at.max(time))
    }

    /// The first row at hand that was known at `from` or later.
    pub fn first_known(&self, kind: RowKind, from: Timestamp) -> usize {
        let before = |time: &Timestamp| *time < from;
        let place = match kind {
            RowKind::Bars => self.bars().partition_point(|bar| bar.known_at < from),
            RowKind::Quotes => self.all_quotes().times().partition_point(before),
            RowKind::Trades if self.prints_known().is_empty() => self.prints().partition_point(|print| print.time < from),
            RowKind::Trades => self.prints_known().partition_point(before),
            RowKind::Depth => self.changes().partition_point(|change| change.known_at < from),
            RowKind::Orders => self.events().partition_point(|event| event.known_at < from),
        };
        self.first[kind as usize] + place
    }

    /// One row behind the last of those that belong to the same instant as `row`: a book is told in many changes, and is
    /// whole when all of one instant are in.
    #[inline(always)]
    pub fn batch(&self, kind: RowKind, row: usize) -> usize {
        let at = self.place(kind, row);
        match kind {
            RowKind::Depth => row + same(self.changes(), at, |change| change.time),
            RowKind::Orders => row + same(self.events(), at, |event| event.time),
            RowKind::Bars | RowKind::Quotes | RowKind::Trades => row + 1,
        }
    }

    /// Whether more has to be read before row `next` can be given out.
    #[inline(always)]
    pub fn is_low(&self, kind: RowKind, next: usize) -> bool {
        next >= self.limit[kind as usize]
    }

    /// Reads until row `next` can be given out with all of its instant, and the one behind it is at hand; rows before `keep` may
    /// be forgotten.
    ///
    /// # Errors
    /// What the stream refuses.
    #[cold]
    pub fn read_on(&mut self, kind: RowKind, next: usize, keep: usize) -> Result<(), StreamError> {
        let Data::Part(part) = &mut self.data else { return Ok(()) };
        let (first, limit) = (&mut self.first[kind as usize], &mut self.limit[kind as usize]);
        let gone = keep.saturating_sub(*first).min(count(&part.at_hand, kind));
        part.forget(kind, gone);
        *first += gone;
        while next >= *limit {
            let more = part.refill(kind)?;
            *limit = if more { *first + last_instant(&part.at_hand, kind) } else { usize::MAX };
        }
        Ok(())
    }
}

/// How many rows from `at` on happened at the instant of that row.
#[inline(always)]
fn same<T>(rows: &[T], at: usize, time: impl Fn(&T) -> Timestamp) -> usize {
    let rest = rows.get(at..).unwrap_or_default();
    rest.first().map_or(1, |first| rest.iter().take_while(|row| time(row) == time(first)).count())
}

/// Place of the first row of the last instant at hand.
fn last_instant(data: &History, kind: RowKind) -> usize {
    fn of<T>(rows: &[T], time: impl Fn(&T) -> Timestamp) -> usize {
        let Some(last) = rows.last() else { return 0 };
        rows.len() - rows.iter().rev().take_while(|row| time(row) == time(last)).count()
    }
    match kind {
        RowKind::Depth => of(data.depth(), |change| change.time),
        RowKind::Orders => of(data.order_events(), |event| event.time),
        RowKind::Bars | RowKind::Quotes | RowKind::Trades => count(data, kind).saturating_sub(1),
    }
}

/// How many rows of a kind are in `data`.
fn count(data: &History, kind: RowKind) -> usize {
    match kind {
        RowKind::Bars => data.bars().len(),
        RowKind::Trades => data.prints().len(),
        RowKind::Depth => data.depth().len(),
        RowKind::Orders => data.order_events().len(),
        RowKind::Quotes => data.quotes().len(),
    }
}

impl Part {
    /// Forgets the oldest `gone` rows of a kind.
    fn forget(&mut self, kind: RowKind, gone: usize) {
        let rows = self.at_hand.rows_mut();
        match kind {
            RowKind::Bars => drop(rows.bars.drain(..gone)),
            RowKind::Trades => {
                rows.prints.drain(..gone);
                rows.prints_known.drain(..gone);
            }
            RowKind::Depth => drop(rows.depth.drain(..gone)),
            RowKind::Orders => drop(rows.order_events.drain(..gone)),
            RowKind::Quotes => rows.quotes.keep_newest(rows.quotes.len() - gone),
        }
    }

    /// Reads the next rows of a kind; false at the end of its stream, or where there is none.
    fn refill(&mut self, kind: RowKind) -> Result<bool, StreamError> {
        let Self { at_hand, sources, books, prints } = self;
        let rows = at_hand.rows_mut();
        match kind {
            RowKind::Bars => sources.bars.as_mut().map_or(Ok(false), |stream| stream.refill(rows.bars)),
            RowKind::Depth => sources.depth.as_mut().map_or(Ok(false), |stream| stream.refill(rows.depth)),
            RowKind::Orders => sources.order_events.as_mut().map_or(Ok(false), |stream| stream.refill(rows.order_events)),
            RowKind::Trades => {
                let Some(stream) = &mut sources.trades else { return Ok(false) };
                let more = stream.refill(prints)?;
                for Known { known_at, what } in prints.drain(..) {
                    rows.prints.push(what);
                    rows.prints_known.push(known_at);
                }
                Ok(more)
            }
            RowKind::Quotes => {
                let Some(stream) = &mut sources.quotes else { return Ok(false) };
                let more = stream.refill(books)?;
                for Known { known_at, what } in books.drain(..) {
                    let (bids, asks) = (what.opposite(super::Side::Sell), what.opposite(super::Side::Buy));
                    let deepest = bids.len().max(asks.len());
                    if rows.quotes.depth() < deepest {
                        rows.quotes.deepen(deepest);
                    }
                    rows.quotes.push(known_at, bids, asks);
                }
                Ok(more)
            }
        }
    }
}
