//! What a paper run is set up of: the backtest of its RUN.toml, a feed and a journal.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use crate::io::{CutTail, FeedKind, InputError, JournalSync, RunFile, file_hash};
use crate::market::line::Line;
use crate::market::run_beside::Beside;
use crate::market::stream::check_rows;
use crate::market::{
    Backtest, BacktestError, History, Instrument, MoneyError, PreparedRun, Record, RunOutputs, Session, Sources, Strategy,
    StreamError, explained, prepare_run, prepare_streaming_run, run, run_needs, run_stream,
};

use super::entry::{Entry, FeedFrom, Header, SCHEMA};
use super::file_feed::{input, journaled, sources_of};
use super::limits::PaperSettings;
use super::line_feed::{BadRows, LineSource, Lines, LinesSeen, sources};
use super::paper_log::PaperLog;
use super::trading::PaperSession;

/// Where the rows of a paper run come from.
pub enum PaperFeed {
    /// The files that RUN.toml names.
    Files,
    /// Lines of JSON, and what is done about those that cannot be.
    Lines(Box<dyn LineSource>, BadRows),
}

impl std::fmt::Debug for PaperFeed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Files => f.write_str("Files"),
            Self::Lines(_, bad) => write!(f, "Lines({bad:?})"),
        }
    }
}

/// What is done with a journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JournalUse {
    /// It is begun.
    Begin(JournalSync),
    /// It is gone on with.
    GoOn(JournalSync),
    /// It is run once more as far as it goes, and left as it is.
    Read,
}

/// A paper run that can start.
pub struct PreparedPaper {
    run: RunFile,
    prepared: PreparedRun,
    settings: PaperSettings,
    log: Arc<Mutex<PaperLog>>,
    lines: Option<Arc<Mutex<Lines>>>,
}

/// What was found when a journal was opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Opened {
    /// What was torn at its end, and cut.
    pub cut: Option<CutTail>,
}

impl std::fmt::Debug for PreparedPaper {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PreparedPaper").field("settings", &self.settings).finish_non_exhaustive()
    }
}

impl PreparedPaper {
    /// The name of the journal in the folder of a paper run.
    pub const JOURNAL: &'static str = "journal.jsonl";

    /// Sets up the paper run of `run` with its journal at `path`. Where the feed is lines, it waits for the first rows of each
    /// stream.
    ///
    /// # Errors
    /// As [`prepare_run`]; limits that cannot be; a journal that is of another run, is damaged or cannot be written.
    pub fn open(run: RunFile, feed: PaperFeed, path: &Path, how: JournalUse) -> Result<(Self, Opened), InputError> {
        let settings = PaperSettings::read(&run)?;
        if let PaperFeed::Lines(..) = &feed {
            run::venue(&run)?;
            run.data.iter().filter(|entry| entry.kind != FeedKind::Actions).try_for_each(check_rows)?;
        }
        let files = match &feed {
            PaperFeed::Files if run.run.stream => Some(prepare_streaming_run(&run)?),
            PaperFeed::Files => Some(prepare_run(&run)?),
            PaperFeed::Lines(..) => None,
        };
        let header = Header {
            schema: SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            run_sha256: file_hash(run.document().path())?,
            seed: run.run.seed,
            feed: if files.is_some() { FeedFrom::Files } else { FeedFrom::Lines },
        };
        let (log, cut) = match how {
            JournalUse::Begin(sync) => (PaperLog::create(path, &header, sync)?, None),
            JournalUse::GoOn(sync) => PaperLog::resume(path, &header, sync)?,
            JournalUse::Read => PaperLog::read(path, &header)?,
        };
        let log = Arc::new(Mutex::new(log));
        let (prepared, lines) = match (files, feed) {
            (Some(prepared), _) => (prepared, None),
            (None, PaperFeed::Lines(source, bad)) => {
                let lines = Arc::new(Mutex::new(Lines::new(&run, source, bad, &log)));
                (on_lines(&run, &lines)?, Some(lines))
            }
            (None, PaperFeed::Files) => (prepare_run(&run)?, None),
        };
        Ok((Self { run, prepared, settings, log, lines }, Opened { cut }))
    }

    /// The run.
    #[must_use]
    pub fn run(&self) -> &RunFile {
        &self.run
    }

    /// The symbols of its instruments.
    pub fn symbols(&self) -> impl Iterator<Item = &str> {
        self.run.instruments.iter().map(|instrument| instrument.symbol.as_str())
    }

    /// What holds it within bounds.
    #[must_use]
    pub fn settings(&self) -> &PaperSettings {
        &self.settings
    }

    /// What was found in the lines of its feed, where it has any.
    #[must_use]
    pub fn lines_seen(&self) -> Option<LinesSeen> {
        let lines = self.lines.as_ref()?;
        Some(lines.lock().unwrap_or_else(PoisonError::into_inner).seen)
    }

    /// Closes the journal, once all that is to be written is written.
    ///
    /// # Errors
    /// A journal that cannot be written.
    pub fn close(&self) -> Result<(), InputError> {
        let mut log = self.log.lock().unwrap_or_else(PoisonError::into_inner);
        log.add(&[Entry::Closed {}])?;
        log.sync()
    }

    /// Starts it, before its first event.
    ///
    /// # Errors
    /// Files that cannot be read any more, rows that cannot be, and a journal that cannot be written.
    pub fn start(&self, strategy: Box<dyn Strategy>) -> Result<PaperSession<'_>, InputError> {
        let session = self.session().map_err(|error| explained(&self.run, &error))?;
        Ok(PaperSession::new(session, strategy, self.settings.clone(), &self.run, Arc::clone(&self.log)))
    }

    fn session(&self) -> Result<Session, BacktestError> {
        let data = |error: InputError| BacktestError::Data(Box::new(StreamError::Input(error)));
        let sources = match &self.lines {
            Some(lines) => sources(&self.run, lines).map_err(data)?,
            None => {
                let symbols: Vec<&str> = self.run.instruments.iter().map(|i| i.symbol.as_str()).collect();
                let files = match &self.prepared.streamed {
                    Some(run) => run_stream::sources(run).map_err(data)?,
                    None => sources_of(self.prepared.backtest.histories()),
                };
                journaled(files, &symbols, &self.log)
            }
        };
        self.prepared.backtest.start_on(sources)
    }

    /// All that `record`, the record of this run, is shown as.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn outputs(&self, record: &Record) -> Result<RunOutputs, MoneyError> {
        self.prepared.outputs(record)
    }
}

/// Sets up the backtest of `run` on lines, of which the first rows of each stream are looked at.
fn on_lines(run: &RunFile, lines: &Arc<Mutex<Lines>>) -> Result<PreparedRun, InputError> {
    let venue = run::venue(run)?;
    let at_hand = |sources: Sources| Ok(Line::of(sources)?.into_at_hand());
    let begun =
        sources(run, lines)?.into_iter().map(at_hand).collect::<Result<Vec<History>, StreamError>>().map_err(input)?;
    lines.lock().unwrap_or_else(PoisonError::into_inner).rewind();
    let instruments: Vec<Instrument> = run.instruments.iter().map(Instrument::from).collect();
    run_needs::check(run, &venue, &instruments, &begun)?;
    let beside = Beside::read(run)?;
    let settings = run::settings(run, &begun, &beside)?;
    let backtest = Backtest::streaming(instruments, venue, settings).map_err(|error| explained(run, &error))?;
    let provenance = run::provenance(run, &backtest, beside.inputs_without_market(run)?)?;
    Ok(PreparedRun { provenance, backtest, streamed: None, beside })
}
