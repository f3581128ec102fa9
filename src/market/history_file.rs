//! Bars and quotes from files, held to what bars and quotes can be.

use crate::io::{FeedFormat, Increase, InputError, Table, check_increasing, check_not_negative, common_spacing};
use crate::sim2real::Timestamp;

use super::{Bar, Book, History, HistoryError, Level, Price, Quotes};

/// The columns of a file of bars.
pub(super) const BAR_COLUMNS: [&str; 6] = ["ts", "open", "high", "low", "close", "volume"];

impl History {
    /// Reads a file of bars: `ts, open, high, low, close, volume`; files of several days with gaps between are fine.
    ///
    /// A bar is `interval` [ns] long; where that is not declared, as long as the most common distance between two of
    /// them. It never reaches into the next: see [`Stamp::spans`](crate::io::Stamp::spans).
    ///
    /// # Errors
    /// What cannot be read; no `stamp`; times that do not increase strictly; prices that are not above 0 or where not
    /// low <= open, close <= high; a negative volume; a single bar without `interval`, or bars closer than it.
    pub fn read_bars(
        path: impl AsRef<std::path::Path>,
        format: &FeedFormat,
        interval: Option<i64>,
    ) -> Result<Self, InputError> {
        let table = Table::read_with(path, &format.columns)?;
        table.check_renames(&BAR_COLUMNS)?;
        let bars = bars(&table, format, interval)?;
        Self::new(bars, Quotes::default()).map_err(|error| in_file(&table, &error, format.price_scale))
    }

    /// Reads a file of quotes: `ts, bid, bid_size, ask, ask_size`, then `bid2, bid2_size, ask2, ask2_size` and so on to
    /// ten levels, as far as there are columns.
    ///
    /// A price that is 0 or empty, or a size of 0, is a side (or a deeper level) that is not there; an empty size is one
    /// that is not known, and counts as infinite. Several quotes may have one time; the last is the one that stands.
    ///
    /// # Errors
    /// What cannot be read; times that go back; negative prices or sizes; a bid above the ask; deeper levels at better
    /// prices.
    pub fn read_quotes(path: impl AsRef<std::path::Path>, format: &FeedFormat) -> Result<Self, InputError> {
        let table = Table::read_with(path, &format.columns)?;
        let names: Vec<[String; 4]> = (1..=Book::DEPTH)
            .map(|k| ["bid", "ask"].map(|side| if k == 1 { side.to_owned() } else { format!("{side}{k}") }))
            .map(|[bid, ask]| [bid.clone(), format!("{bid}_size"), ask.clone(), format!("{ask}_size")])
            .collect();
        let meaningful: Vec<&str> = std::iter::once("ts").chain(names.iter().flatten().map(String::as_str)).collect();
        table.check_renames(&meaningful)?;
        let times = table.times("ts", &format.time)?;
        check_increasing(&table, "ts", &times, Increase::OrStays)?;
        let (mut bids, mut asks) = (Vec::new(), Vec::new());
        for (k, [bid, bid_size, ask, ask_size]) in names.iter().enumerate() {
            // The first level must be there; a deeper one where either side has it.
            if k == 0 || table.has(bid) {
                bids.push(levels(&table, bid, bid_size, format.price_scale)?);
            }
            if k == 0 || table.has(ask) {
                asks.push(levels(&table, ask, ask_size, format.price_scale)?);
            }
        }
        let mut quotes = Quotes::with_depth(bids.len().max(asks.len()));
        let (mut bid, mut ask) = (Vec::new(), Vec::new());
        for (row, time) in times.into_iter().enumerate() {
            for (side, of) in [(&mut bid, &bids), (&mut ask, &asks)] {
                side.clear();
                side.extend(of.iter().map_while(|level| level[row]));
            }
            quotes.push(time, &bid, &ask);
        }
        Self::new(Vec::new(), quotes).map_err(|error| in_file(&table, &error, format.price_scale))
    }
}

/// The bars of a table, of which each has its two times; prices are held to be above 0, and nothing else.
pub(super) fn bars(table: &Table, format: &FeedFormat, interval: Option<i64>) -> Result<Vec<Bar>, InputError> {
    let Some(stamp) = format.stamp else {
        let error = InputError::new(table.path(), "nothing says which end of a bar its time names");
        return Err(error.hint("add stamp = \"open\" or stamp = \"close\" to the section that names the file"));
    };
    let times = table.times("ts", &format.time)?;
    check_increasing(table, "ts", &times, Increase::Strictly)?;
    if let (Some(declared), Some(common)) = (interval, common_spacing(&times))
        && common < declared
    {
        let message =
            format!("most bars are {} s apart, but `interval` says {} s", common as f64 / 1e9, declared as f64 / 1e9);
        return Err(InputError::new(table.path(), message).in_column("ts").hint("give the length of one bar"));
    }
    let spans = stamp.spans(&times, interval).ok_or_else(|| {
        let error = InputError::new(table.path(), "one bar alone does not show how long a bar is");
        error.hint("declare it: interval = \"1m\" in [[data]]; the tape of a twin needs two bars at least")
    })?;
    let [open, high, low, close] = ["open", "high", "low", "close"].map(|name| prices(table, name, format.price_scale));
    let (open, high, low, close) = (open?, high?, low?, close?);
    let volume = table.floats_complete("volume")?;
    let bar = |(k, (open_at, known_at)): (usize, (Timestamp, Timestamp))| Bar {
        open_at,
        known_at,
        open: open[k],
        high: high[k],
        low: low[k],
        close: close[k],
        volume: volume[k],
    };
    Ok(spans.into_iter().enumerate().map(bar).collect())
}

/// A column of prices, scaled.
fn prices(table: &Table, name: &str, scale: f64) -> Result<Vec<Price>, InputError> {
    let values = table.floats_complete(name)?;
    let convert = |(row, value): (usize, f64)| {
        if value <= 0.0 {
            let error = table.error(name, row, "expected a price greater than 0").found(value);
            return Err(error.hint("drop the row, or name the column that holds the price in `columns`"));
        }
        let too_large = |_| {
            let error = table.error(name, row, "expected a price of at most 9.2e9").found(value * scale);
            error.hint("is `price_scale` right?")
        };
        Price::nearest(value * scale).map_err(too_large)
    };
    values.into_iter().enumerate().map(convert).collect()
}

/// One level of one side: none where it is not there.
fn levels(table: &Table, price: &str, size: &str, scale: f64) -> Result<Vec<Option<Level>>, InputError> {
    let (prices, sizes) = (table.floats(price)?, table.floats(size)?);
    for (name, values) in [(price, &prices), (size, &sizes)] {
        check_not_negative(table, name, values)
            .map_err(|error| error.hint("0 or an empty cell is a side that is not there; drop the row or correct it"))?;
    }
    let level = |(price, size): (Option<f64>, Option<f64>)| {
        let level = Level { price: price? * scale, size: size.unwrap_or(f64::INFINITY) };
        (level.price > 0.0 && level.size > 0.0).then_some(level)
    };
    Ok(prices.into_iter().zip(sizes).map(level).collect())
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
