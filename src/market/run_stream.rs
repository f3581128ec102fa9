//! Runs whose data are read while they go: `stream = true`.

use crate::io::{DataEntry, FeedKind, InputError, RunFile, is_columnar};
use crate::sim2real::Timestamp;

use super::history_file::bar_interval;
use super::line::Line;
use super::run::{no_data, no_data_within, provenance, settings, span, venue};
use super::run_beside::Beside;
use super::stream::{Between, Dated, Stream, StreamError};
use super::{Backtest, BacktestError, FileStream, History, Instrument, PreparedRun, Session, Sources, run_needs};

/// Rows that are read at a time: few enough to stay near the processor from their columns to the run.
const ROWS: usize = 1 << 13;

/// Sets up the backtest of `run` to read its data while it runs, so that what is in memory does not grow with their length. Of
/// each file the first rows are read, to see that mechanisms have what they need; and of bars without an `interval`, where the run
/// does not ask for streams itself, the times of all rows, which show it.
///
/// # Errors
/// As [`prepare_run`](super::prepare_run), as far as the first rows show it; bars without an `interval` of a run that asks for
/// streams.
pub fn prepare_streaming_run(run: &RunFile) -> Result<PreparedRun, InputError> {
    let venue = venue(run)?;
    let beside = Beside::read(run)?;
    // Nothing of the one depends on the other.
    let (begun, inputs) = rayon::join(|| begun(run), || beside.inputs(run));
    let (run, begun) = begun?;
    let instruments: Vec<Instrument> = run.instruments.iter().map(Instrument::from).collect();
    run_needs::check(&run, &venue, &instruments, &begun)?;
    let settings = settings(&run, &begun, &beside)?;
    let backtest = Backtest::streaming(instruments, venue, settings).map_err(|error| super::explained(&run, &error))?;
    let provenance = provenance(&run, &backtest, inputs?)?;
    Ok(PreparedRun { provenance, backtest, streamed: Some(Box::new(run)), beside })
}

/// Whether the data of `run` may as well be read while it runs: nothing of its files would be read twice but the times of bars.
#[must_use]
pub fn streams_as_well(run: &RunFile) -> bool {
    let market = || run.data.iter().filter(|entry| entry.kind != FeedKind::Actions);
    market().all(|entry| is_columnar(&entry.path))
}

/// The run with the interval of all its bars, and the first rows of its data.
fn begun(run: &RunFile) -> Result<(RunFile, Vec<History>), InputError> {
    let mut run = run.clone();
    if !run.run.stream {
        for entry in run.data.iter_mut().filter(|entry| entry.kind == FeedKind::Bars) {
            entry.interval = Some(bar_interval(&entry.path, &entry.format, entry.interval)?);
        }
    }
    let begun = sources(&run)?.into_iter().map(|sources| Ok(Line::of(sources)?.into_at_hand()));
    let begun = begun.collect::<Result<Vec<History>, StreamError>>().map_err(|error| input(&run, error))?;
    if let Some(empty) = begun.iter().position(History::is_empty).filter(|_| span(&run).is_some()) {
        return Err(no_data_within(&run, &run.instruments[empty].symbol));
    }
    Ok((run, begun))
}

impl PreparedRun {
    /// Starts the backtest: on the data in memory, or from the beginning of its files, which are read ahead of it by threads of
    /// their own where there is more than one.
    ///
    /// # Errors
    /// Files that cannot be opened any more, and what is refused of their first rows.
    pub fn start(&self) -> Result<Session, BacktestError> {
        let Some(run) = &self.streamed else { return Ok(self.backtest.start()) };
        let data = |error: InputError| BacktestError::Data(Box::new(StreamError::Input(error)));
        let mut sources = sources(run).map_err(data)?;
        if rayon::current_num_threads() > 1 {
            sources.iter_mut().try_for_each(Sources::read_ahead).map_err(|error| {
                let error =
                    InputError::new(run.document().path(), format!("no thread can be started to read ahead ({error})"));
                data(error.hint("--threads 1 reads without"))
            })?;
        }
        self.backtest.start_on(sources)
    }
}

fn input(run: &RunFile, error: StreamError) -> InputError {
    match error {
        StreamError::Input(error) => error,
        StreamError::History(error) => super::explained(run, &BacktestError::Data(Box::new(StreamError::History(error)))),
    }
}

/// The streams of a run, of each instrument those of its files.
pub(super) fn sources(run: &RunFile) -> Result<Vec<Sources>, InputError> {
    let of = |(index, symbol): (usize, &str)| {
        let mut sources = Sources::default();
        let mut entries = run.data.iter().filter(|e| e.symbol == symbol && e.kind != FeedKind::Actions).peekable();
        if entries.peek().is_none() {
            return Err(no_data(run, index, symbol));
        }
        entries.try_for_each(|entry| add(&mut sources, run, entry))?;
        Ok(sources)
    };
    run.instruments.iter().map(|instrument| instrument.symbol.as_str()).enumerate().map(of).collect()
}

fn add(sources: &mut Sources, run: &RunFile, entry: &DataEntry) -> Result<(), InputError> {
    let (path, format, rows) = (&entry.path, &entry.format, ROWS);
    let span = span(run);
    match entry.kind {
        FeedKind::Bars => sources.bars = Some(cut(FileStream::bars(path, format, entry.interval, rows)?, span)),
        FeedKind::Quotes => sources.quotes = Some(cut(FileStream::quotes(path, format, entry.interval, rows)?, span)),
        FeedKind::Trades => sources.trades = Some(cut(FileStream::trades(path, format, rows)?, span)),
        FeedKind::Book if format.layout.tells_orders() => {
            sources.order_events = Some(cut(FileStream::order_events(path, format, rows)?, span));
        }
        FeedKind::Actions => {}
        FeedKind::Book => sources.depth = Some(cut(FileStream::depth(path, format, rows)?, span)),
    }
    Ok(())
}

/// The stream without what was known before or after the run.
fn cut<T: Dated + 'static>(stream: impl Stream<T> + 'static, span: Option<(Timestamp, Timestamp)>) -> Box<dyn Stream<T>> {
    match span {
        Some((start, last)) => Box::new(Between::new(stream, start, last)),
        None => Box::new(stream),
    }
}
