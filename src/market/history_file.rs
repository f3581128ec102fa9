//! Market data from whole files, held to what they can be: each is a stream that is read to its end.

use std::path::Path;

use crate::io::{FeedFormat, Increase, InputError, Layout, OnBad, Spacings, Stamp, Table, TableChunks, not_increasing};

use super::stream::{BarRows, PIECE, bars_of};
use super::{Bar, DataNotes, FileStream, History, HistoryError, Quotes, Side};

/// The columns of a file of bars.
pub(super) const BAR_COLUMNS: [&str; 6] = ["ts", "open", "high", "low", "close", "volume"];

impl History {
    /// Reads a file of bars: `ts, open, high, low, close, volume`, or Lean's; files of several days with gaps between are
    /// fine.
    ///
    /// A bar is `interval` [ns] long; where that is not declared, as long as the most common distance between two of
    /// them. It never reaches into the next: see [`Stamp::spans`](crate::io::Stamp::spans).
    ///
    /// # Errors
    /// What cannot be read; no `stamp`; times that do not increase strictly; prices that are not above 0 or where not
    /// low <= open, close <= high; a negative volume; a single bar without `interval`, or bars closer than it.
    pub fn read_bars(path: impl AsRef<Path>, format: &FeedFormat, interval: Option<i64>) -> Result<Self, InputError> {
        let table = Table::read_with(path, &format.columns)?;
        let ts = BarRows::time_column(format);
        table.check_renames(&BAR_COLUMNS.map(|name| if name == "ts" { ts } else { name }))?;
        let (bars, notes) = bars(&table, format, interval)?;
        sound(table.path(), Self::new(bars, Quotes::default()), &notes)
    }

    /// Reads a file of quotes: `ts, bid, bid_size, ask, ask_size`, then `bid2, bid2_size, ask2, ask2_size` and so on to
    /// ten levels, as far as there are columns; or what [`FileStream::quotes`] reads.
    ///
    /// A price that is 0 or empty, or a size of 0, is a side (or a deeper level) that is not there; an empty size is one
    /// that is not known, and counts as infinite. Several quotes may have one time; the last is the one that stands.
    ///
    /// # Errors
    /// What cannot be read; times that go back; negative prices or sizes; a bid above the ask; deeper levels at better
    /// prices.
    pub fn read_quotes(path: impl AsRef<Path>, format: &FeedFormat) -> Result<Self, InputError> {
        Self::read_quote_bars(path, format, None)
    }

    /// As [`read_quotes`](Self::read_quotes), of a file of quote bars of `interval` [ns].
    ///
    /// # Errors
    /// As [`read_quotes`](Self::read_quotes).
    pub fn read_quote_bars(path: impl AsRef<Path>, format: &FeedFormat, interval: Option<i64>) -> Result<Self, InputError> {
        let mut stream = FileStream::quotes(path.as_ref(), format, interval, TableChunks::ROWS)?;
        let mut quotes = Quotes::with_depth(stream.depth_of_levels());
        while stream.next_rows(&mut |row| {
            quotes.push(row.known_at, row.what.opposite(Side::Sell), row.what.opposite(Side::Buy));
        })? {}
        sound(path, Self::new(Vec::new(), quotes), stream.notes())
    }

    /// Reads a file of trades: `ts, price, size`, optional `aggressor`; or what [`FileStream::trades`] reads.
    ///
    /// # Errors
    /// What cannot be read; times that go back; prices and sizes that are not above 0.
    pub fn read_trades(path: impl AsRef<Path>, format: &FeedFormat) -> Result<Self, InputError> {
        let mut stream = FileStream::trades(path.as_ref(), format, TableChunks::ROWS)?;
        let (mut prints, mut known) = (Vec::new(), Vec::new());
        while stream.next_rows(&mut |row| {
            prints.push(row.what);
            known.push(row.known_at);
        })? {}
        sound(path, Self::default().with_prints_known_at(prints, known), stream.notes())
    }

    /// Reads a file of changes of a book, price by price: what [`FileStream::depth`] reads.
    ///
    /// # Errors
    /// What cannot be read; times that go back; prices that are not above 0, negative sizes, sides there are none of.
    pub fn read_depth(path: impl AsRef<Path>, format: &FeedFormat) -> Result<Self, InputError> {
        let mut stream = FileStream::depth(path.as_ref(), format, TableChunks::ROWS)?;
        let mut depth = Vec::new();
        while stream.next_rows(&mut |row| depth.push(row))? {}
        sound(path, Self::default().with_depth(depth), stream.notes())
    }

    /// Reads a file of events of resting orders: what [`FileStream::order_events`] reads.
    ///
    /// # Errors
    /// What cannot be read; times that go back; prices and sizes that are not above 0, actions and sides there are none of;
    /// an order that is added twice.
    pub fn read_order_events(path: impl AsRef<Path>, format: &FeedFormat) -> Result<Self, InputError> {
        let mut stream = FileStream::order_events(path.as_ref(), format, TableChunks::ROWS)?;
        let mut events = Vec::new();
        while stream.next_rows(&mut |row| events.push(row))? {}
        sound(path, Self::default().with_order_events(events), stream.notes())
    }
}

/// A history of rows that were held to the same before, each at its place.
fn sound(path: impl AsRef<Path>, history: Result<History, HistoryError>, notes: &DataNotes) -> Result<History, InputError> {
    let history = history.map_err(|error| {
        let text = error.to_string();
        let (message, hint) = text.split_once("\nhint: ").unwrap_or((&text, ""));
        InputError::new(path, message).hint(hint)
    })?;
    Ok(history.with_notes(notes.clone()))
}

/// The bars of a table, and what was found in it.
pub(super) fn bars(table: &Table, format: &FeedFormat, interval: Option<i64>) -> Result<(Vec<Bar>, DataNotes), InputError> {
    let (stamp, interval) = spans(table, format, interval)?;
    bars_of(table, format, BarRows::new(format, stamp, interval))
}

/// How long a bar of a file is [ns]: as long as it is `declared`, or else as the most common distance between two of them. Nothing but
/// their times is read of a columnar file.
///
/// # Errors
/// As [`History::read_bars`], as far as times show it.
pub(super) fn bar_interval(path: &Path, format: &FeedFormat, declared: Option<i64>) -> Result<i64, InputError> {
    let table = Table::read_columns(path, &format.columns, Some(&[BarRows::time_column(format)]))?;
    spans(&table, format, declared).map(|(_, interval)| interval)
}

/// Which end of a bar its time names, and how long a bar is [ns].
fn spans(table: &Table, format: &FeedFormat, declared: Option<i64>) -> Result<(Stamp, i64), InputError> {
    let Some(stamp) = format.stamp else {
        let error = InputError::new(table.path(), "nothing says which end of a bar its time names");
        return Err(error.hint("add stamp = \"open\" or stamp = \"close\" to the section that names the file"));
    };
    if !matches!(format.layout, Layout::Trueup | Layout::Lean) {
        let error = InputError::new(table.path(), format!("the layout `{}` has no bars", format.layout.word()));
        return Err(error.hint("bars are of the layout `trueup` or `lean`"));
    }
    let common = spacings(table, format)?.most_common();
    if let (Some(declared), Some(common)) = (declared, common)
        && common < declared
    {
        let message =
            format!("most bars are {} s apart, but `interval` says {} s", common as f64 / 1e9, declared as f64 / 1e9);
        let error = InputError::new(table.path(), message).in_column(BarRows::time_column(format));
        return Err(error.hint("give the length of one bar"));
    }
    let interval = declared.or(common).ok_or_else(|| {
        let error = InputError::new(table.path(), "one bar alone does not show how long a bar is");
        error.hint("declare it: interval = \"1m\" in [[data]]; the tape of a twin needs two bars at least")
    })?;
    Ok((stamp, interval))
}

/// How far bars are apart, those left out that are no later than one before them: whether there may be such is for the policy to say.
fn spacings(table: &Table, format: &FeedFormat) -> Result<Spacings, InputError> {
    let column = BarRows::time_column(format);
    let refuses = format.rules.on_bad == OnBad::Refuse;
    let (mut spacings, mut newest) = (Spacings::default(), None);
    for piece in table.pieces(PIECE) {
        for (row, time) in piece.times_with_holes(column, &format.time)?.into_iter().enumerate() {
            match (time, newest) {
                (None, _) if refuses => return Err(piece.missing(column, row, "a time")),
                (Some(time), Some((before, place))) if time <= before => {
                    if refuses {
                        return Err(not_increasing(&piece, column, row, &time, (&before, place), Increase::Strictly));
                    }
                }
                (Some(time), _) => {
                    spacings.add(time);
                    newest = Some((time, piece.place(row)));
                }
                (None, _) => {}
            }
        }
    }
    Ok(spacings)
}

/// The error at its place in the file, in the file's own unit.
pub(super) fn in_file(table: &Table, error: &HistoryError, scale: f64) -> InputError {
    let (column, row, found) = match error {
        HistoryError::Time { row, found, .. } => ("ts", *row, found.to_string()),
        HistoryError::Span { row, open_at, .. } => ("ts", *row, open_at.to_string()),
        HistoryError::Bar { row, column: "volume", value } => ("volume", *row, value.to_string()),
        HistoryError::Bar { row, column, value } => (*column, *row, (value / scale).to_string()),
        HistoryError::Quote { row, column, value, .. } if column.ends_with("_size") => {
            (column.as_str(), *row, value.to_string())
        }
        HistoryError::Quote { row, column, value, .. } => (column.as_str(), *row, (value / scale).to_string()),
        HistoryError::Event { row, column, value, .. } => (*column, *row, value.to_string()),
        HistoryError::Known { row, known_at, .. } => ("known_at", *row, known_at.to_string()),
    };
    let (message, hint) = match error {
        HistoryError::Time { .. } => ("expected a time after the one before", "sort the rows by time"),
        HistoryError::Span { .. } => ("expected a bar that ends after it begins", "check `stamp` and `interval`"),
        HistoryError::Bar { column: "volume", .. } => ("expected a volume of 0 or more", "drop the row or correct it"),
        HistoryError::Bar { .. } => ("expected low <= open, close <= high", "drop the row or correct it"),
        HistoryError::Quote { hint, .. } => ("no such quote can be", *hint),
        HistoryError::Event { hint, .. } => ("no such row can be", *hint),
        HistoryError::Known { .. } => ("expected a time no earlier than the row's own", "declare a `clock_offset`"),
    };
    table.error(column, row, message).found(found).hint(hint)
}
