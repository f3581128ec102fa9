//! Books at every so many rows, so that an episode may begin in the midst of data that tell a book change by change.

use std::sync::Arc;

use crate::market::known::Known;
use crate::market::line::Line;
use crate::market::sources::RowKind;
use crate::market::venue::Others;
use crate::market::{Arrival, DepthBook, Event, EventKind, Feed, History, Increments};
use crate::sim2real::Timestamp;

/// Rows from one kept book to the next: at most so many are read again when an episode begins.
const EVERY: usize = 1_024;

/// The books of an instrument that are kept.
#[derive(Debug, Clone)]
pub(super) struct Books {
    history: History,
    kept: Arc<Vec<Kept>>,
}

#[derive(Debug, Clone)]
struct Kept {
    /// Number of the first row that is not in it.
    row: usize,
    book: DepthBook,
    others: Others,
}

impl Books {
    /// The books of `history`; none where its data tell none.
    pub fn of(history: &History, increments: Increments) -> Option<Self> {
        let line = Line::whole(history);
        if !line.tells(RowKind::Depth) && !line.tells(RowKind::Orders) {
            return None;
        }
        let mut known = Known { book: Some(DepthBook::new(increments)), ..Known::default() };
        let mut kept: Vec<Kept> = Vec::new();
        for arrival in Feed::new(std::slice::from_ref(history)).filter(|arrival| arrival.event.kind == EventKind::Depth) {
            if kept.last().is_none_or(|last| arrival.row >= last.row + EVERY)
                && let Some(book) = &known.book
            {
                kept.push(Kept { row: arrival.row, book: book.clone(), others: known.others.clone() });
            }
            known.learn_depth(&line, &arrival);
        }
        Some(Self { history: history.clone(), kept: Arc::new(kept) })
    }

    /// The book as the rows known before `from` left it, and the orders of others where the data know them.
    pub fn at(&self, from: Timestamp) -> Option<(DepthBook, Others)> {
        let line = Line::whole(&self.history);
        let kind = if line.tells(RowKind::Orders) { RowKind::Orders } else { RowKind::Depth };
        let end = line.first_known(kind, from);
        let Kept { mut row, book, others } = self.kept[..self.kept.partition_point(|kept| kept.row <= end)].last()?.clone();
        let mut known = Known { book: Some(book), others, ..Known::default() };
        while row < end {
            let next = line.batch(kind, row).min(end);
            let time = line.time(kind, row);
            let event = Event { time, instrument: 0, kind: EventKind::Depth };
            known.learn_depth(&line, &Arrival { event, row, end: next, known_at: time });
            row = next;
        }
        known.book.map(|book| (book, known.others))
    }
}
