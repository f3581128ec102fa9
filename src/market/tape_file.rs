//! Tapes read from files.

use std::path::Path;

use crate::io::{FeedFormat, InputError, Renames, Table};

use super::history_file::{BAR_COLUMNS, bars};
use super::{Bar, Book, Level, Print, Quotes, Side, Tape};

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
    let mut notes = Vec::new();
    let quotes = files.quotes.map(|path| read_quotes(path, format, &mut notes)).transpose()?.unwrap_or_default();
    let prints = files.trades.map(|path| read_prints(path, format)).transpose()?.unwrap_or_default();
    let bars = files.bars.map(|path| read_bars(path, format)).transpose()?.unwrap_or_default();
    Ok(notes.into_iter().fold(Tape::new(quotes, prints, bars), Tape::with_note))
}

/// Opens a table with those of the format's names that it has: one section may rename the columns of several files.
fn open(path: &Path, format: &FeedFormat, meaningful: impl Fn(&str) -> bool) -> Result<Table, InputError> {
    let renames: Renames =
        format.columns.iter().filter(|(name, _)| meaningful(name)).map(|(a, b)| (a.clone(), b.clone())).collect();
    Table::read_with(path, &renames)
}

fn level_name(side: &str, number: usize) -> String {
    if number == 1 { side.to_owned() } else { format!("{side}{number}") }
}

fn read_quotes(path: &Path, format: &FeedFormat, notes: &mut Vec<String>) -> Result<Quotes, InputError> {
    let table = open(path, format, |name| name == "ts" || name.starts_with("bid") || name.starts_with("ask"))?;
    let times = table.times("ts", &format.time)?;
    let mut sides = Vec::new();
    for side in ["bid", "ask"] {
        let mut levels = vec![read_level(&table, side, 1, format)?];
        for number in (2..=Book::DEPTH).take_while(|number| table.has(&level_name(side, *number))) {
            levels.push(read_level(&table, side, number, format)?);
        }
        sides.push(levels);
    }
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by_key(|row| times[*row]);
    let mut quotes = Quotes::with_depth(sides.iter().map(Vec::len).max().unwrap_or(1));
    let mut crossed: Vec<usize> = Vec::new();
    for row in order {
        let at = |side: &[Vec<Option<Level>>]| side.iter().filter_map(|levels| levels[row]).collect::<Vec<_>>();
        let (bids, asks) = (at(&sides[0]), at(&sides[1]));
        if bids.first().zip(asks.first()).is_some_and(|(bid, ask)| bid.price > ask.price) {
            crossed.push(row);
            continue;
        }
        quotes.push(times[row], &bids, &asks);
    }
    if let Some(row) = crossed.first().copied() {
        if crossed.len() as f64 > CROSSED * times.len() as f64 {
            let message = format!("the bid is above the ask, here and in {} of {} rows", crossed.len(), times.len());
            let bid = sides[0].first().and_then(|levels| levels[row]).map_or(0.0, |level| level.price);
            return Err(table.error("bid", row, message).found(bid).hint("are `bid` and `ask` exchanged?"));
        }
        notes.push(format!("{} of {} quotes have their bid above their ask and are left out", crossed.len(), times.len()));
    }
    Ok(quotes)
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

fn read_prints(path: &Path, format: &FeedFormat) -> Result<Vec<Print>, InputError> {
    let table = open(path, format, |name| ["ts", "price", "size", "aggressor"].contains(&name))?;
    let (times, prices) = (table.times("ts", &format.time)?, above_zero(&table, "price")?);
    let sizes = above_zero(&table, "size")?;
    let words = if table.has("aggressor") { table.texts("aggressor")? } else { vec![None; times.len()] };
    let print = |row: usize| Print {
        time: times[row],
        price: prices[row] * format.price_scale,
        size: sizes[row],
        // Feeds have words of their own for trades of auctions and the like: of those no side is known.
        aggressor: words[row].as_deref().and_then(Side::of_word),
    };
    Ok((0..times.len()).map(print).collect())
}

fn read_bars(path: &Path, format: &FeedFormat) -> Result<Vec<Bar>, InputError> {
    let table = open(path, format, |name| BAR_COLUMNS.contains(&name))?;
    Ok(bars(&table, format, None)?.0)
}
