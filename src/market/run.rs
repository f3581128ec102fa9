//! Runs: what a RUN.toml sets up.

use crate::io::{DataEntry, FeedKind, InputError, RunFile, listed_mechanism};
use crate::sim2real::{Assembly, Seed, Timestamp};

use super::{Backtest, BacktestError, Cash, Execution, History, Instrument, MECHANISMS, MoneyError, Settings};

/// A backtest as a run declares it.
#[derive(Debug, Clone)]
pub struct RunSetUp {
    /// The backtest.
    pub backtest: Backtest,
    /// Rows of each `[[data]]` file, those outside `start` and `end` among them.
    pub rows: Vec<usize>,
}

impl RunSetUp {
    /// Sets up the backtest of `run`, and reads its data.
    ///
    /// # Errors
    /// Data of kinds no backtest runs on, instruments without data, data outside `start` and `end`; mechanisms, keys,
    /// units or values the registry does not know, or that need quotes where there are none; and what
    /// [`History::read_bars`] and [`History::read_quotes`] refuse.
    pub fn of(run: &RunFile) -> Result<Self, InputError> {
        let venue = venue(run)?;
        let read = run.data.iter().enumerate().map(|(index, entry)| history(run, index, entry));
        let read = read.collect::<Result<Vec<History>, InputError>>()?;
        let rows = read.iter().map(|history| history.bars().len() + history.quotes().len()).collect();
        let histories = run
            .instruments
            .iter()
            .enumerate()
            .map(|(index, instrument)| joined(run, index, &instrument.symbol, &read))
            .collect::<Result<Vec<History>, InputError>>()?;
        let instruments = run.instruments.iter().map(Instrument::from).collect();
        let cash = Cash::nearest(run.run.cash).map_err(|error| money(run, &["run", "cash"], &error))?;
        let settings = Settings { seed: Seed(run.run.seed), ..Settings::with_cash(cash) };
        let settings = Settings { max_leverage: run.run.max_leverage.unwrap_or(settings.max_leverage), ..settings };
        let backtest = Backtest::new(instruments, histories, venue, settings).map_err(|error| explained(run, &error))?;
        Ok(Self { backtest, rows })
    }
}

/// The execution plant with the mechanisms of `run`.
fn venue(run: &RunFile) -> Result<Assembly<Execution>, InputError> {
    let mut venue = Assembly::new(Execution, MECHANISMS);
    for (index, entry) in run.mechanisms.iter().enumerate() {
        let (mechanism, form, parameters) = listed_mechanism(run.document(), index, entry, &Execution, MECHANISMS)?;
        // On bars these would do nothing, unnoticed.
        let of_the_book = entry.name == "book_walk" || entry.parameter("fraction").is_some() && entry.name == "half_spread";
        let quoted = |symbol: &str| run.data.iter().any(|data| data.kind == FeedKind::Quotes && data.symbol == symbol);
        if let Some(bare) = run.instruments.iter().find(|instrument| of_the_book && !quoted(&instrument.symbol)) {
            let message = format!("`{}` needs quotes in this form, and there are none of `{}`", entry.name, bare.symbol);
            let error = run.error(&["mechanism", &index.to_string(), "name"], message);
            return Err(error.hint("add [[data]] with quotes, or use half_spread with bps"));
        }
        venue = venue.with_mechanism(mechanism, form, parameters);
    }
    Ok(venue)
}

/// The history in a data file.
fn history(run: &RunFile, index: usize, entry: &DataEntry) -> Result<History, InputError> {
    match entry.kind {
        FeedKind::Bars => History::read_bars(&entry.path, &entry.format, entry.interval),
        FeedKind::Quotes => History::read_quotes(&entry.path, &entry.format),
        FeedKind::Trades | FeedKind::Book => {
            let word = entry.kind.word();
            let error = run.error(&["data", &index.to_string(), word], format!("a backtest does not run on `{word}` yet"));
            Err(error.hint("give bars or quotes"))
        }
    }
}

/// All there is of the `index`-th instrument, between the run's `start` and `end`.
fn joined(run: &RunFile, index: usize, symbol: &str, read: &[History]) -> Result<History, InputError> {
    let of = |kind| run.data.iter().zip(read).find(|(data, _)| data.symbol == symbol && data.kind == kind).map(|(_, h)| h);
    let whole = match (of(FeedKind::Bars), of(FeedKind::Quotes)) {
        (Some(bars), Some(quotes)) => {
            let joined = bars.clone().with_quotes_of(quotes);
            joined.map_err(|error| run.error(&["instrument", &index.to_string()], error.to_string()))?
        }
        (Some(one), None) | (None, Some(one)) => one.clone(),
        (None, None) => {
            let error = run.error(&["instrument", &index.to_string()], format!("there are no data of `{symbol}`"));
            return Err(error.hint("add [[data]] with its symbol and bars or quotes, or drop the instrument"));
        }
    };
    let (start, end) = (run.run.start, run.run.end);
    if start.is_none() && end.is_none() {
        return Ok(whole);
    }
    // A run's end is the first instant that no longer counts.
    let last = end.map_or(Timestamp::MAX, |end| Timestamp(end.0.saturating_sub(1)));
    let within = whole.within(start.unwrap_or(Timestamp::MIN), last);
    if within.bars().is_empty() && within.quotes().is_empty() {
        let error = run.error(&["run"], format!("there are no data of `{symbol}` between `start` and `end`"));
        return Err(error.hint("leave them out to run on all data; times without a zone in files are UTC unless declared"));
    }
    Ok(within)
}

/// The error of a backtest at its place in the run.
///
/// Amounts that overflow and prices that cannot be are known only once a backtest runs, so callers need this too.
#[must_use]
pub fn explained(run: &RunFile, error: &BacktestError) -> InputError {
    let keys: &[&str] = match error {
        BacktestError::Leverage(_) => &["run", "max_leverage"],
        BacktestError::ModelPrice { .. } => &["mechanism"],
        _ => &["run"],
    };
    split(run, keys, &error.to_string())
}

fn money(run: &RunFile, keys: &[&str], error: &MoneyError) -> InputError {
    split(run, keys, &error.to_string())
}

/// A text with a line for its hint as an error.
fn split(run: &RunFile, keys: &[&str], text: &str) -> InputError {
    match text.split_once("\nhint: ") {
        Some((message, hint)) => run.error(keys, message).hint(hint),
        None => run.error(keys, text),
    }
}
