//! Runs: what a RUN.toml sets up, and what it leaves.

use std::collections::BTreeMap;

use chrono_tz::Tz;

use crate::io::{AssumedPrice, DataEntry, FeedKind, InputError, RunFile, file_hash};
use crate::sim2real::{Assembly, Seed, Timestamp, Twin};

use super::account_file::account;
use super::listed;
use super::run_as_twin::price;
use super::run_beside::Beside;
use super::run_log::InputFile;
use super::{
    Backtest, BacktestError, Calendar, Cash, Execution, History, Instrument, Latencies, Matching, MoneyError, Provenance,
    Record, Reference, RunBrief, RunOutputs, Settings, StreamError, run_needs,
};

/// A backtest as a run declares it, with its data read.
#[derive(Debug, Clone)]
pub struct PreparedRun {
    /// The backtest.
    pub backtest: Backtest,
    /// What it was made of.
    pub provenance: Provenance,
    /// The run whose files are read while it goes; none where its data are in memory.
    pub(super) streamed: Option<Box<RunFile>>,
    /// What was read beside its market data.
    pub(super) beside: Beside,
}

/// Sets up the backtest of `run`, and reads its data. The strategy is for the caller to build, from `run.strategy` and
/// [`RunFile::strategy_settings`].
///
/// # Errors
/// Data of kinds no backtest runs on, instruments without data, data outside `start` and `end`; a `price` the data do not
/// have; calendars that are not there or are none; mechanisms, keys, units or values the registry does not know, or that need
/// data there are none of; files of rates or actions that cannot be; and what [`History::read_bars`] and
/// [`History::read_quotes`] refuse.
pub fn prepare_run(run: &RunFile) -> Result<PreparedRun, InputError> {
    // What needs no data is said before they are read.
    venue(run)?;
    let beside = Beside::read(run)?;
    // Nothing of the one depends on the other.
    let (read, inputs) = rayon::join(|| read_data(run), || beside.inputs(run));
    let mut read = read?;
    let rows: Vec<Option<usize>> = read.iter().map(|history| history.as_ref().map(History::rows)).collect();
    let joined = run.instruments.iter().enumerate().map(|(index, entry)| joined(run, index, &entry.symbol, &mut read));
    let histories = joined.collect::<Result<Vec<History>, InputError>>()?;
    let backtest = set_up(run, histories, &beside)?;
    let provenance = provenance(run, &backtest, beside.with_rows(inputs?, &rows))?;
    Ok(PreparedRun { provenance, backtest, streamed: None, beside })
}

/// The market data of `run`, one for each `[[data]]`; none for what is no market data.
fn read_data(run: &RunFile) -> Result<Vec<Option<History>>, InputError> {
    let read = |entry: &DataEntry| if entry.kind == FeedKind::Actions { Ok(None) } else { history(entry).map(Some) };
    run.data.iter().map(read).collect()
}

/// What `backtest`, that of `run`, is made of: its document and `files`.
pub(super) fn provenance(run: &RunFile, backtest: &Backtest, files: Vec<InputFile>) -> Result<Provenance, InputError> {
    let venue = backtest.venue();
    Ok(Provenance {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: run.run.seed,
        currency: run.run.currency.clone(),
        strategy: run.strategy.clone(),
        mechanisms: venue.modelled().into_iter().map(str::to_owned).collect(),
        reference: backtest.settings().reference.unwrap_or_else(|| Reference::suiting(venue)),
        zone: zone(run),
        calendars: calendar_names(run, backtest),
        inputs: [own_document(run)?].into_iter().chain(files).collect(),
    })
}

/// The backtest of `run` on data that were read.
fn set_up(run: &RunFile, histories: Vec<History>, beside: &Beside) -> Result<Backtest, InputError> {
    let instruments: Vec<Instrument> = run.instruments.iter().map(Instrument::from).collect();
    let venue = venue(run)?;
    run_needs::check(run, &venue, &instruments, &histories)?;
    let settings = settings(run, &histories, beside)?;
    Backtest::new(instruments, histories, venue, settings).map_err(|error| explained(run, &error))
}

/// What else the backtest of `run` depends on.
pub(super) fn settings(run: &RunFile, histories: &[History], beside: &Beside) -> Result<Settings, InputError> {
    let cash = Cash::nearest(run.run.cash).map_err(|error| money(run, &["run", "cash"], &error))?;
    let borrowing_nothing = Settings::with_cash(cash);
    Ok(Settings {
        cash,
        seed: Seed(run.run.seed),
        max_leverage: run.run.max_leverage.unwrap_or(borrowing_nothing.max_leverage),
        reference: reference(run, histories)?,
        matching: Matching { shows_own_orders: shows_own_orders(run), ..run.matching::<Matching>()? },
        latencies: run.latency::<Latencies>()?,
        equity_every: run.run.equity_every.or(run.run.stream.then_some(60 * Timestamp::NANOS)),
        calendars: beside.calendars.clone().of(run)?,
        halts: beside.halts.all.clone(),
        account: account(run, beside.account.clone())?,
    })
}

/// Whether the data show what own orders did, as the run says, or the twin that it brings.
fn shows_own_orders(run: &RunFile) -> bool {
    let brought = run.twin.as_ref().and_then(|twin| twin.shows_own_orders());
    run.run.shows_own_orders.or(brought).unwrap_or(false)
}

impl PreparedRun {
    /// The backtest of `run`, which has other values but the same data: these are shared, not read again.
    ///
    /// # Errors
    /// As [`prepare_run`], but for what it says of files.
    pub fn variant(&self, run: &RunFile) -> Result<Backtest, InputError> {
        let backtest = set_up(run, self.backtest.histories().to_vec(), &self.beside)?;
        Ok(backtest.beside(&self.backtest))
    }

    /// All that `record`, the record of this backtest, is shown as.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn outputs(&self, record: &Record) -> Result<RunOutputs, MoneyError> {
        RunOutputs::new(self.provenance_of(record), &self.backtest, record)
    }

    /// `record`, the record of this backtest, in brief: without tables and plots.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn brief(&self, record: &Record) -> Result<RunBrief, MoneyError> {
        RunBrief::new(self.provenance_of(record), &self.backtest, record)
    }

    fn provenance_of(&self, record: &Record) -> Provenance {
        let mut provenance = self.provenance.clone();
        if let Some(run) = &self.streamed {
            // Only now is known how many rows the files have.
            let files = 1 + self.beside.calendars.files.len();
            for (entry, file) in run.data.iter().zip(provenance.inputs.iter_mut().skip(files)) {
                let instrument = run.instruments.iter().position(|instrument| instrument.symbol == entry.symbol);
                let seen = instrument.and_then(|k| record.data.get(k));
                let notes = seen.and_then(|seen| seen.notes.iter().find(|notes| notes.what() == entry.kind.word()));
                file.rows = notes.map(|notes| notes.rows() as usize);
            }
        }
        provenance
    }
}

fn calendar_names(run: &RunFile, backtest: &Backtest) -> BTreeMap<String, String> {
    let named = |calendar: &Calendar| calendar.name().to_owned();
    let all = run.instruments.iter().zip(&backtest.settings().calendars);
    all.filter_map(|(entry, calendar)| Some((entry.symbol.clone(), named(calendar.as_deref()?)))).collect()
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

/// The execution plant with the mechanisms of `run`, and those of a twin that it brings.
pub(super) fn venue(run: &RunFile) -> Result<Assembly<Execution>, InputError> {
    listed::assembly(run.listed(), run.assumed(), &[])
}

/// The history in a data file.
pub(super) fn history(entry: &DataEntry) -> Result<History, InputError> {
    match entry.kind {
        // They are no data of a market.
        FeedKind::Actions => Ok(History::default()),
        FeedKind::Bars => History::read_bars(&entry.path, &entry.format, entry.interval),
        FeedKind::Quotes => History::read_quote_bars(&entry.path, &entry.format, entry.interval),
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
        return Err(no_data(run, index, symbol));
    };
    let Some((start, last)) = span(run) else { return Ok(whole) };
    let within = whole.within(start, last);
    if within.is_empty() { Err(no_data_within(run, symbol)) } else { Ok(within) }
}

/// The error about an instrument without data.
pub(super) fn no_data(run: &RunFile, index: usize, symbol: &str) -> InputError {
    let error = run.error(&["instrument", &index.to_string()], format!("there are no data of `{symbol}`"));
    error.hint("add [[data]] with its symbol and bars, quotes, trades or book, or drop the instrument")
}

/// The error about an instrument without data between the run's `start` and `end`.
pub(super) fn no_data_within(run: &RunFile, symbol: &str) -> InputError {
    let key = if run.run.start.is_some() { "start" } else { "end" };
    let error = run.error(&["run", key], format!("there are no data of `{symbol}` between `start` and `end`"));
    error.hint("leave them out to run on all data; times without a zone in files are UTC unless declared")
}

/// The first and the last instant whose data count; none where all do.
pub(super) fn span(run: &RunFile) -> Option<(Timestamp, Timestamp)> {
    let (start, end) = (run.run.start, run.run.end);
    // A run's end is the first instant that no longer counts.
    let last = end.map_or(Timestamp::MAX, |end| Timestamp(end.0.saturating_sub(1)));
    (start.is_some() || end.is_some()).then_some((start.unwrap_or(Timestamp::MIN), last))
}

/// The price that is asked for, in `[run]` or by a twin, as far as the data have it.
fn reference(run: &RunFile, histories: &[History]) -> Result<Option<Reference>, InputError> {
    let Some(price) = price(run)? else { return Ok(None) };
    let place = match () {
        () if run.run.price.is_some() => ["run", "price"],
        () if run.assumptions.is_some() => ["assumptions", "price"],
        () => ["execution", "twin"],
    };
    let refuse = |message: String, hint: &str| Err(run.error(&place, message).hint(hint));
    let shows = |history: &History| {
        !(history.quotes().is_empty() && history.depth().is_empty() && history.order_events().is_empty())
    };
    let quoted = histories.iter().any(shows);
    // Where trades are all there is, orders meet the last of them.
    if price == AssumedPrice::Last && !quoted && histories.iter().all(|history| history.bars().is_empty()) {
        return Ok(None);
    }
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
    if let BacktestError::Data(error) = error
        && let StreamError::Input(error) = &**error
    {
        return error.clone();
    }
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
        BacktestError::Halt { .. } => &["halt"],
        BacktestError::EquityEvery(_) => &["run", "equity_every"],
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
