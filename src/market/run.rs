//! Runs: what a RUN.toml sets up, and what it leaves.

use chrono_tz::Tz;

use crate::io::{AssumedPrice, DataEntry, FeedKind, InputError, RateSource, RunFile, file_hash, listed_mechanism};
use crate::sim2real::{Assembly, Seed, Timestamp, Twin};

use super::account_file::{AccountFiles, account};
use super::run_log::InputFile;
use super::{
    Backtest, BacktestError, Cash, Execution, History, Instrument, Latencies, MECHANISMS, Matching, MoneyError, Provenance,
    Record, Reference, RunOutputs, Settings, run_needs,
};

/// A backtest as a run declares it, with its data read.
#[derive(Debug, Clone)]
pub struct PreparedRun {
    /// The backtest.
    pub backtest: Backtest,
    /// What it was made of.
    pub provenance: Provenance,
}

/// Sets up the backtest of `run`, and reads its data. The strategy is for the caller to build, from `run.strategy` and
/// [`RunFile::strategy_settings`].
///
/// # Errors
/// Data of kinds no backtest runs on, instruments without data, data outside `start` and `end`; a `price` the data do not
/// have; mechanisms, keys, units or values the registry does not know, or that need data there are none of; and what
/// [`History::read_bars`] and [`History::read_quotes`] refuse.
pub fn prepare_run(run: &RunFile) -> Result<PreparedRun, InputError> {
    // What needs no data is said before they are read.
    venue(run)?;
    let mut inputs = vec![own_document(run)?];
    let mut files = AccountFiles::read_rates(run)?;
    let mut read = Vec::new();
    for entry in &run.data {
        let history = if entry.kind == FeedKind::Actions { None } else { Some(history(entry)?) };
        let rows = match &history {
            Some(history) => history.rows(),
            None => files.read_actions(run, entry)?,
        };
        inputs.push(InputFile { path: entry.named.clone(), sha256: file_hash(&entry.path)?, rows: Some(rows) });
        read.push(history);
    }
    for (number, rate) in run.rates.iter().enumerate() {
        if let RateSource::File { path, named, .. } = &rate.source {
            inputs.push(InputFile { path: named.clone(), sha256: file_hash(path)?, rows: files.rows_of_rate(number) });
        }
    }
    let joined = run.instruments.iter().enumerate().map(|(index, entry)| joined(run, index, &entry.symbol, &mut read));
    let histories = joined.collect::<Result<Vec<History>, InputError>>()?;
    let backtest = set_up(run, histories, files)?;
    let venue = backtest.venue();
    let provenance = Provenance {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: run.run.seed,
        currency: run.run.currency.clone(),
        strategy: run.strategy.clone(),
        mechanisms: venue.modelled().into_iter().map(str::to_owned).collect(),
        reference: backtest.settings().reference.unwrap_or_else(|| Reference::suiting(venue)),
        zone: zone(run),
        inputs,
    };
    Ok(PreparedRun { backtest, provenance })
}

/// The backtest of `run` on data that were read.
fn set_up(run: &RunFile, histories: Vec<History>, files: AccountFiles) -> Result<Backtest, InputError> {
    let instruments: Vec<Instrument> = run.instruments.iter().map(Instrument::from).collect();
    let venue = venue(run)?;
    run_needs::check(run, &venue, &instruments, &histories)?;
    let cash = Cash::nearest(run.run.cash).map_err(|error| money(run, &["run", "cash"], &error))?;
    let borrowing_nothing = Settings::with_cash(cash);
    let settings = Settings {
        cash,
        seed: Seed(run.run.seed),
        max_leverage: run.run.max_leverage.unwrap_or(borrowing_nothing.max_leverage),
        reference: reference(run, &histories)?,
        matching: run.matching::<Matching>()?,
        latencies: run.latency::<Latencies>()?,
        account: account(run, files)?,
    };
    Backtest::new(instruments, histories, venue, settings).map_err(|error| explained(run, &error))
}

impl PreparedRun {
    /// The backtest of `run`, which has other values but the same data: these are shared, not read again.
    ///
    /// # Errors
    /// As [`prepare_run`], but for what it says of files.
    pub fn variant(&self, run: &RunFile) -> Result<Backtest, InputError> {
        let files = AccountFiles::of(self.backtest.settings().account.as_ref());
        set_up(run, self.backtest.histories().to_vec(), files)
    }

    /// All that `record`, the record of this backtest, is shown as.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn outputs(&self, record: &Record) -> Result<RunOutputs, MoneyError> {
        RunOutputs::new(self.provenance.clone(), &self.backtest, record)
    }
}

/// The zone of the data's times, where they have one in common.
fn zone(run: &RunFile) -> Tz {
    let market = run.data.iter().filter(|entry| entry.kind != FeedKind::Actions);
    let mut zones = market.map(|entry| entry.format.time.zone);
    let first = zones.next().unwrap_or(Tz::UTC);
    if zones.all(|zone| zone == first) { first } else { Tz::UTC }
}

fn own_document(run: &RunFile) -> Result<InputFile, InputError> {
    let path = run.document().path();
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(InputFile { path: name, sha256: file_hash(path)?, rows: None })
}

/// The execution plant with the mechanisms of `run`.
fn venue(run: &RunFile) -> Result<Assembly<Execution>, InputError> {
    let mut venue = Assembly::new(Execution, MECHANISMS);
    for (index, entry) in run.mechanisms.iter().enumerate() {
        let (mechanism, form, parameters) = listed_mechanism(run.document(), index, entry, &Execution, MECHANISMS)?;
        venue = venue.with_mechanism(mechanism, form, parameters);
    }
    Ok(venue)
}

/// The history in a data file.
fn history(entry: &DataEntry) -> Result<History, InputError> {
    match entry.kind {
        // They are no data of a market.
        FeedKind::Actions => Ok(History::default()),
        FeedKind::Bars => History::read_bars(&entry.path, &entry.format, entry.interval),
        FeedKind::Quotes => History::read_quotes(&entry.path, &entry.format),
        FeedKind::Trades => History::read_trades(&entry.path, &entry.format),
        FeedKind::Book if entry.format.layout.tells_orders() => History::read_order_events(&entry.path, &entry.format),
        FeedKind::Book => History::read_depth(&entry.path, &entry.format),
    }
}

/// All there is of the `index`-th instrument, taken from `read`, between the run's `start` and `end`.
fn joined(run: &RunFile, index: usize, symbol: &str, read: &mut [Option<History>]) -> Result<History, InputError> {
    let mut take = |kind| {
        let at = run.data.iter().position(|data| data.symbol == symbol && data.kind == kind)?;
        read[at].take()
    };
    let kinds = [FeedKind::Bars, FeedKind::Quotes, FeedKind::Trades, FeedKind::Book];
    let Some(whole) = kinds.into_iter().filter_map(&mut take).reduce(History::joined_with) else {
        let error = run.error(&["instrument", &index.to_string()], format!("there are no data of `{symbol}`"));
        return Err(error.hint("add [[data]] with its symbol and bars, quotes, trades or book, or drop the instrument"));
    };
    let (start, end) = (run.run.start, run.run.end);
    if start.is_none() && end.is_none() {
        return Ok(whole);
    }
    // A run's end is the first instant that no longer counts.
    let last = end.map_or(Timestamp::MAX, |end| Timestamp(end.0.saturating_sub(1)));
    let within = whole.within(start.unwrap_or(Timestamp::MIN), last);
    if within.is_empty() {
        let key = if start.is_some() { "start" } else { "end" };
        let error = run.error(&["run", key], format!("there are no data of `{symbol}` between `start` and `end`"));
        return Err(error.hint("leave them out to run on all data; times without a zone in files are UTC unless declared"));
    }
    Ok(within)
}

/// What `[run] price` asks for, as far as the data have it.
fn reference(run: &RunFile, histories: &[History]) -> Result<Option<Reference>, InputError> {
    let Some(price) = run.run.price else { return Ok(None) };
    let refuse = |message: String, hint: &str| Err(run.error(&["run", "price"], message).hint(hint));
    let quoted = histories.iter().any(|history| !history.quotes().is_empty());
    match (price, quoted) {
        (AssumedPrice::Mid, true) => Ok(Some(Reference::Mid)),
        (AssumedPrice::Touch, true) => Ok(Some(Reference::Touch)),
        (AssumedPrice::NextOpen, false) => Ok(None),
        (AssumedPrice::Mid | AssumedPrice::Touch, false) => refuse(
            format!("the price \"{}\" needs quotes, and there are none", price.word()),
            "with bars it is \"next_open\"",
        ),
        (AssumedPrice::NextOpen, true) => {
            refuse("orders meet the quotes, which are there".to_owned(), "with quotes it is \"mid\" or \"touch\"")
        }
        (AssumedPrice::Last | AssumedPrice::BarClose, _) => refuse(
            format!("\"{}\" is what an order was decided on: no order meets it", price.word()),
            "give \"next_open\" with bars, \"mid\" or \"touch\" with quotes",
        ),
    }
}

/// The error of a backtest at its place in the run: amounts that overflow and prices that cannot be are known only once it
/// runs.
#[must_use]
pub fn explained(run: &RunFile, error: &BacktestError) -> InputError {
    if let BacktestError::WithinBar { symbol, .. } = error {
        let of = |entry: &DataEntry| entry.kind == FeedKind::Actions && entry.symbol == *symbol;
        let number = run.data.iter().position(of).unwrap_or_default().to_string();
        return split(run, &["data", &number, "actions"], &error.to_string());
    }
    let keys: &[&str] = match error {
        BacktestError::Leverage(_) => &["run", "max_leverage"],
        BacktestError::ModelPrice { .. } => &["mechanism"],
        BacktestError::Latency(_) => &["latency"],
        BacktestError::NoRate { .. } => &["rate"],
        BacktestError::Queue(_) => &["matching", "queue"],
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
