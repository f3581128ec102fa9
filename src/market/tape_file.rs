//! Tapes read from files.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use crate::io::{FeedFormat, InputError, Renames, Table, TableChunks};

use super::history_file::{BAR_COLUMNS, bars};
use super::{Book, Level, Print, Quotes, Side, Tape};

/// The files of a tape; those that are named are read.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TapeFiles<'a> {
    /// `ts, bid, ask`, optional `bid_size, ask_size` and deeper levels `bid2, bid2_size, …`.
    pub quotes: Option<&'a Path>,
    /// `ts, price, size`, optional `aggressor`.
    pub trades: Option<&'a Path>,
    /// `ts, open, high, low, close, volume`.
    pub bars: Option<&'a Path>,
}

/// The largest part of the quotes that may be crossed: an exchange shows none, a feed shows a few while it catches up.
const CROSSED: f64 = 0.01;

/// Reads a tape. Rows are put in order of time; those of one stamp stay in the file's order.
///
/// A level without price or size, or with a price or size of 0, is not there. Quotes whose bid is above their ask are
/// left out and noted.
///
/// # Errors
/// What [`Table::read`] refuses; missing columns, cells that are no numbers or times; negative prices and sizes, and in
/// trades prices of 0; more than one crossed quote in a hundred; and what [`History::read_bars`](super::History::read_bars) refuses of bars.
pub fn read_tape(files: TapeFiles<'_>, format: &FeedFormat) -> Result<Tape, InputError> {
    TapeTables::open(files, format)?.tape(format)
}

/// The tables of a tape, or the rows of one instrument in them.
#[derive(Debug, Default)]
pub(super) struct TapeTables {
    pub quotes: Option<TapeRows>,
    pub trades: Option<TapeRows>,
    pub bars: Option<TapeRows>,
}

/// The rows of a table of a tape.
#[derive(Debug, Clone)]
pub(super) enum TapeRows {
    /// All of a file, which is read some rows at a time: the tape of a year is held in memory once.
    File(PathBuf, Renames),
    /// Some rows of a file that was read.
    Rows(Table),
}

impl TapeTables {
    /// Opens the files.
    ///
    /// # Errors
    /// What [`TableChunks::open`] refuses.
    pub fn open(files: TapeFiles<'_>, format: &FeedFormat) -> Result<Self, InputError> {
        let quoted = |name: &str| name == "ts" || name.starts_with("bid") || name.starts_with("ask");
        let traded = |name: &str| ["ts", "price", "size", "aggressor"].contains(&name);
        let rows =
            |path: &Path, meaningful: &dyn Fn(&str) -> bool| TapeRows::File(path.to_path_buf(), renames(format, meaningful));
        Ok(Self {
            quotes: files.quotes.map(|path| rows(path, &quoted)),
            trades: files.trades.map(|path| rows(path, &traded)),
            bars: files.bars.map(|path| rows(path, &|name| BAR_COLUMNS.contains(&name))),
        })
    }

    /// The tape that is in them.
    ///
    /// # Errors
    /// As [`read_tape`].
    pub fn tape(&self, format: &FeedFormat) -> Result<Tape, InputError> {
        let mut notes = Vec::new();
        let quotes = self.quotes.as_ref().map(|rows| quotes_of(rows, format, &mut notes)).transpose()?.unwrap_or_default();
        let prints = self.trades.as_ref().map(|rows| prints_of(rows, format)).transpose()?.unwrap_or_default();
        let bars = self.bars.as_ref().map(|rows| bars(&*rows.whole()?, format, None)).transpose()?;
        let bars = bars.map(|(bars, _)| bars).unwrap_or_default();
        Ok(notes.into_iter().fold(Tape::new(quotes, prints, bars), Tape::with_note))
    }
}

impl TapeRows {
    /// All rows at once.
    ///
    /// # Errors
    /// What [`Table::read_with`] refuses.
    pub fn whole(&self) -> Result<Cow<'_, Table>, InputError> {
        match self {
            Self::File(path, renames) => Table::read_with(path, renames).map(Cow::Owned),
            Self::Rows(table) => Ok(Cow::Borrowed(table)),
        }
    }

    /// Whether there is a column of that name.
    ///
    /// # Errors
    /// What [`TableChunks::open`] refuses.
    pub fn has(&self, name: &str) -> Result<bool, InputError> {
        match self {
            Self::File(path, renames) => {
                Ok(TableChunks::open(path, renames, TableChunks::ROWS)?.first().is_some_and(|table| table.has(name)))
            }
            Self::Rows(table) => Ok(table.has(name)),
        }
    }

    /// Hands the rows to `into`, some at a time.
    fn each(&self, into: &mut dyn FnMut(&Table) -> Result<(), InputError>) -> Result<(), InputError> {
        let Self::File(path, renames) = self else { return into(&*self.whole()?) };
        let mut chunks = TableChunks::open(path, renames, TableChunks::ROWS)?;
        let mut rows = 0;
        while let Some(table) = chunks.next_table()? {
            rows += table.rows();
            into(&table)?;
        }
        // Of a table without rows its reader knows what to say.
        if rows == 0 { self.whole().map(|_| ()) } else { Ok(()) }
    }
}

/// Those of the format's names that are `meaningful` in a file: one section may rename the columns of several.
fn renames(format: &FeedFormat, meaningful: &dyn Fn(&str) -> bool) -> Renames {
    let own = format.columns.iter().filter(|(name, _)| *name == "symbol" || meaningful(name));
    own.map(|(name, own)| (name.clone(), own.clone())).collect()
}

fn level_name(side: &str, number: usize) -> String {
    if number == 1 { side.to_owned() } else { format!("{side}{number}") }
}

/// Quotes as they are read.
#[derive(Default)]
struct QuoteSheet {
    quotes: Quotes,
    rows: usize,
    crossed: usize,
    /// The first whose bid is above its ask.
    first_crossed: Option<InputError>,
    in_order: bool,
}

impl QuoteSheet {
    fn add(&mut self, table: &Table, format: &FeedFormat) -> Result<(), InputError> {
        let times = table.times("ts", &format.time)?;
        let mut sides = Vec::new();
        for side in ["bid", "ask"] {
            let mut levels = vec![read_level(table, side, 1, format)?];
            for number in (2..=Book::DEPTH).take_while(|number| table.has(&level_name(side, *number))) {
                levels.push(read_level(table, side, number, format)?);
            }
            sides.push(levels);
        }
        if self.rows == 0 {
            self.quotes = Quotes::with_depth(sides.iter().map(Vec::len).max().unwrap_or(1));
            self.in_order = true;
        }
        self.rows += times.len();
        let (mut bids, mut asks) = (Vec::new(), Vec::new());
        for (row, time) in times.into_iter().enumerate() {
            for (at, levels) in [&mut bids, &mut asks].into_iter().zip(&sides) {
                at.clear();
                at.extend(levels.iter().filter_map(|levels| levels[row]));
            }
            if let (Some(bid), Some(ask)) = (bids.first(), asks.first())
                && bid.price > ask.price
            {
                self.crossed += 1;
                self.first_crossed.get_or_insert_with(|| table.error("bid", row, "").found(bid.price));
                continue;
            }
            self.in_order &= self.quotes.times().last().is_none_or(|last| *last <= time);
            self.quotes.push(time, &bids, &asks);
        }
        Ok(())
    }
}

fn quotes_of(rows: &TapeRows, format: &FeedFormat, notes: &mut Vec<String>) -> Result<Quotes, InputError> {
    let mut sheet = QuoteSheet::default();
    rows.each(&mut |table| sheet.add(table, format))?;
    let QuoteSheet { quotes, rows, crossed, first_crossed, in_order } = sheet;
    if let Some(first) = first_crossed {
        if crossed as f64 > CROSSED * rows as f64 {
            let message = format!("the bid is above the ask, here and in {crossed} of {rows} rows");
            return Err(InputError { message, ..first }.hint("are `bid` and `ask` exchanged?"));
        }
        notes.push(format!("{crossed} of {rows} quotes have their bid above their ask and are left out"));
    }
    Ok(if in_order { quotes } else { quotes.in_order() })
}

fn read_level(table: &Table, side: &str, number: usize, format: &FeedFormat) -> Result<Vec<Option<Level>>, InputError> {
    let name = level_name(side, number);
    let size_name = format!("{name}_size");
    let prices = not_negative(table, &name)?;
    let sizes = if table.has(&size_name) { Some(not_negative(table, &size_name)?) } else { None };
    let level = |(row, price): (usize, Option<f64>)| {
        let price = price.filter(|price| *price > 0.0)? * format.price_scale;
        let size = sizes.as_ref().map_or(Some(f64::INFINITY), |sizes| sizes[row].filter(|size| *size > 0.0))?;
        Some(Level { price, size })
    };
    Ok(prices.into_iter().enumerate().map(level).collect())
}

fn not_negative(table: &Table, name: &str) -> Result<Vec<Option<f64>>, InputError> {
    let values = table.floats(name)?;
    match values.iter().position(|value| value.is_some_and(|v| v < 0.0)) {
        None => Ok(values),
        Some(row) => Err(table
            .error(name, row, "expected a number that is not negative")
            .found(values[row].unwrap_or_default())
            .hint("leave the cell empty where a side has nothing")),
    }
}

/// A complete column of numbers above 0.
pub(super) fn above_zero(table: &Table, name: &str) -> Result<Vec<f64>, InputError> {
    let values = table.floats_complete(name)?;
    match values.iter().position(|value| *value <= 0.0) {
        None => Ok(values),
        Some(row) => Err(table.error(name, row, "expected a number above 0").found(values[row]).hint(match name {
            "qty" => "quantities are above 0; which way an order trades is said by its side",
            _ => "was a fill value written where nothing was known? Then drop the row",
        })),
    }
}

fn prints_of(rows: &TapeRows, format: &FeedFormat) -> Result<Vec<Print>, InputError> {
    let mut prints = Vec::new();
    rows.each(&mut |table| {
        let (times, prices) = (table.times("ts", &format.time)?, above_zero(table, "price")?);
        let sizes = above_zero(table, "size")?;
        let words = if table.has("aggressor") { table.texts("aggressor")? } else { vec![None; times.len()] };
        let print = |row: usize| Print {
            time: times[row],
            price: prices[row] * format.price_scale,
            size: sizes[row],
            // Feeds have words of their own for trades of auctions and the like: of those no side is known.
            aggressor: words[row].as_deref().and_then(Side::of_word),
        };
        prints.extend((0..times.len()).map(print));
        Ok(())
    })?;
    Ok(prints)
}
