//! The tape of each instrument, wherever its files are: named by the twin, or beside the orders.

use std::collections::BTreeMap;
use std::path::{Component, Path};

use crate::io::{DataEntry, FeedFormat, FeedKind, InputError, Table, hint_among, table_in};

use super::depth_quotes::displayed;
use super::run::history;
use super::tape_file::{TapeFiles, TapeRows, TapeTables};
use super::{History, Increments, Instrument, Print, Quotes, Tape};

/// Files that may hold the tapes of several instruments, told apart by a column `symbol`.
#[derive(Debug)]
pub(super) struct FileTapes {
    tables: [Option<Rows>; 3],
}

/// The rows of a file.
#[derive(Debug)]
enum Rows {
    /// Nothing says of which instrument they are.
    Unnamed(TapeRows),
    /// Those of each symbol.
    Named(BTreeMap<String, Table>),
}

impl FileTapes {
    /// Opens the files.
    ///
    /// # Errors
    /// What [`Table::read_with`] refuses, and a row without its symbol.
    pub fn open(files: TapeFiles<'_>, format: &FeedFormat) -> Result<Self, InputError> {
        let TapeTables { quotes, trades, bars } = TapeTables::open(files, format)?;
        let rows = |rows: Option<TapeRows>| match rows {
            Some(rows) if rows.has("symbol")? => rows.whole()?.split_by("symbol").map(|parts| Some(Rows::Named(parts))),
            rows => Ok(rows.map(Rows::Unnamed)),
        };
        Ok(Self { tables: [rows(quotes)?, rows(trades)?, rows(bars)?] })
    }

    /// Those beside the orders in `folder`; none where there are none.
    ///
    /// # Errors
    /// As [`open`](Self::open), and two tables of one name.
    pub fn of_folder(folder: &Path, format: &FeedFormat) -> Result<Option<Self>, InputError> {
        let (quotes, trades, bars) = (table_in(folder, "quotes")?, table_in(folder, "trades")?, table_in(folder, "bars")?);
        let files = TapeFiles { quotes: quotes.as_deref(), trades: trades.as_deref(), bars: bars.as_deref() };
        if files == TapeFiles::default() {
            return Ok(None);
        }
        Self::open(files, format).map(Some)
    }

    /// The tape of `symbol`, one of the `traded`; none where the files tell symbols apart and have no rows of it.
    ///
    /// # Errors
    /// What [`read_tape`](super::read_tape) refuses, and files that do not say whose rows they hold, where several are traded.
    pub fn tape(&self, symbol: &str, traded: &[&str], format: &FeedFormat) -> Result<Option<Tape>, InputError> {
        let mut own = TapeTables::default();
        let places = [&mut own.quotes, &mut own.trades, &mut own.bars];
        for (place, rows) in places.into_iter().zip(&self.tables) {
            *place = match rows {
                None => None,
                Some(Rows::Named(parts)) => parts.get(symbol).cloned().map(TapeRows::Rows),
                Some(Rows::Unnamed(rows)) if traded.len() == 1 => Some(rows.clone()),
                Some(Rows::Unnamed(rows)) => return Err(unnamed(rows, traded)),
            };
        }
        let nothing = own.quotes.is_none() && own.trades.is_none() && own.bars.is_none();
        if nothing { Ok(None) } else { own.tape(format).map(Some) }
    }

    /// The symbols of whom it has rows by name.
    pub fn symbols(&self) -> Vec<&str> {
        let mut all = Vec::new();
        for rows in self.tables.iter().flatten() {
            if let Rows::Named(parts) = rows {
                all.extend(parts.keys().map(String::as_str));
            }
        }
        all.sort_unstable();
        all.dedup();
        all
    }
}

fn unnamed(rows: &TapeRows, traded: &[&str]) -> InputError {
    let path = match rows {
        TapeRows::File(path, _) => path.as_path(),
        TapeRows::Rows(table) => table.path(),
    };
    let symbols: Vec<String> = traded.iter().map(|symbol| format!("`{symbol}`")).collect();
    let message = format!("there are orders of {}, and nothing says of which these rows are", symbols.join(", "));
    InputError::new(path, message)
        .hint("add a column `symbol`, give the twin a [[data]] section for each symbol, or put tapes into folders named as symbols")
}

/// The folder of the tape of `symbol` beside the orders in `folder`, where it is one.
pub(super) fn folder_of_symbol(folder: &Path, symbol: &str) -> Option<std::path::PathBuf> {
    let plain = Path::new(symbol).components().all(|part| matches!(part, Component::Normal(_)));
    Some(folder.join(symbol)).filter(|own| plain && own.is_dir())
}

/// The tape of `instrument` in the `[[data]]` of a document: what orders of a backtest meet, quotes or the displayed book, or else
/// bars; and trades. None where there are no data of it.
///
/// # Errors
/// What the readers of histories refuse, and a tick that is no whole number of 1e-9.
pub(super) fn tape_of_data(data: &[DataEntry], instrument: &Instrument) -> Result<Option<Tape>, InputError> {
    let of = |kind: FeedKind| data.iter().find(|entry| entry.symbol == instrument.symbol && entry.kind == kind);
    let read = |kind: FeedKind| of(kind).map(history).transpose();
    let quotes = match (of(FeedKind::Quotes), of(FeedKind::Book)) {
        (Some(entry), _) => history(entry)?.into_quotes(),
        (None, Some(entry)) => {
            let increments = Increments::of(instrument).map_err(|error| {
                let text = error.to_string();
                let (message, hint) = text.split_once("\nhint: ").unwrap_or((&text, ""));
                InputError::new(&entry.path, message).hint(hint)
            })?;
            displayed(&history(entry)?, increments)
        }
        (None, None) => Quotes::default(),
    };
    // Beside quotes no order of a backtest meets bars.
    let bars = if quotes.is_empty() { read(FeedKind::Bars)?.map(History::into_bars) } else { None };
    let prints = read(FeedKind::Trades)?.map(|history| known(&history)).unwrap_or_default();
    let tape = Tape::new(quotes, prints, bars.unwrap_or_default());
    Ok(if tape.is_empty() { None } else { Some(tape) })
}

/// The trades by the times at which they could be known, which is how a history has its quotes.
fn known(history: &History) -> Vec<Print> {
    let at = |row: usize, print: &Print| history.print_known_at(row).unwrap_or(print.time);
    history.prints().iter().enumerate().map(|(row, print)| Print { time: at(row, print), ..*print }).collect()
}

/// What may be meant by a symbol of which there is no tape.
pub(super) fn no_tape_hint(symbol: &str, known: &[&str]) -> String {
    let add = format!("add rows of it to the tape, or [[data]] with symbol = \"{symbol}\"");
    match hint_among(symbol, known) {
        Some(hint) if hint.starts_with("did you mean") => hint,
        Some(there) => format!("{add}; {there}"),
        None => add,
    }
}
