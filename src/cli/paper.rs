//! `trueup paper`: a strategy against the paper venue, driven by a clock.

mod clock;
mod standard_input;
mod stops;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};

use crate::io::{InputError, JournalSync, OutputFolder, Overwrite, RunFile};
use crate::market::paper_run::{
    BadRows, JournalUse, PaperFeed, PaperSession, PaperSettings, PaperStatus, PreparedPaper, StopReason,
};
use crate::market::{Reason, Record, RunOutputs};

use super::backtest::{strategy, told};
use super::screen::{self, Progress, Screen};
use super::stop::{Outcome, Stop};
use clock::{PaperClock, Speed, speed};
use standard_input::StandardInput;
use stops::Stops;

/// Run a strategy on a feed as it comes, against the paper venue, and keep a log of it
///
/// The engine is that of `trueup backtest`: on the same data the same orders and fills, to the last bit. Everything it is given
/// and all it does is in DIR/journal.jsonl at once, so that a session that was killed goes on with --resume. Ctrl-C ends it:
/// orders are cancelled and tables written; a second Ctrl-C ends it at once.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup paper run.toml --out monday --speed 60
  trueup paper run.toml --out monday --resume
  feed | trueup paper run.toml --out monday --feed -
  trueup paper run.toml --out monday --export so-far
  trueup reconcile --backtest runs/first --paper monday")]
pub(super) struct Paper {
    /// TOML file of the run, as for `trueup backtest`; [paper] holds its limits and kill file
    run: PathBuf,
    /// Folder of the log: journal.jsonl, and at the end run.json, orders.parquet, fills.parquet and the others of a backtest
    #[arg(long, value_name = "DIR", default_value = "paper")]
    out: PathBuf,
    /// How fast the time of the files goes: a number of times as fast as a clock, or max
    #[arg(long, value_name = "N", default_value = "1", value_parser = speed)]
    speed: Speed,
    /// Where rows come from: `files` of RUN.toml, or `-` for standard input, a JSON object a line, as it comes
    #[arg(long, value_name = "FEED", default_value = "files", value_parser = ["files", "-"])]
    feed: String,
    /// End the session at the first row of standard input that cannot be, instead of leaving it out
    #[arg(long)]
    strict: bool,
    /// Go on with the session in DIR, where it was when it was stopped
    #[arg(long)]
    resume: bool,
    /// When the journal is on the disk and not only with the system: at every entry, or about once a second
    #[arg(long, value_name = "WHEN", value_enum, default_value_t = SyncWhen::Interval)]
    sync: SyncWhen,
    /// Write the tables of the session in DIR, as far as it came, into this folder, and leave the session as it is
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["resume", "sync", "speed"])]
    export: Option<PathBuf>,
    /// Print run.json on standard output instead of a table
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SyncWhen {
    /// After every entry: nothing is lost when the power fails
    Always,
    /// About once a second: a killed process loses nothing, a loss of power a second
    Interval,
}

impl Paper {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let from_lines = self.feed == "-";
        let file = if from_lines { RunFile::read_without_market(&self.run)? } else { RunFile::read(&self.run)? };
        strategy(&file)?;
        let settings = PaperSettings::read(&file)?;
        let (folder, overwrite) = match (&self.export, self.resume) {
            (Some(folder), _) => (folder, Overwrite::Refuse),
            // It was killed while it wrote them, or has not written them yet: they are its own.
            (None, true) => (&self.out, Overwrite::Force),
            (None, false) => (&self.out, Overwrite::Refuse),
        };
        if overwrite == Overwrite::Refuse {
            OutputFolder::create(folder, overwrite)?.check_free(&RunOutputs::FILES)?;
        }
        let stops = Stops::listen(settings.kill_file.as_deref().filter(|_| self.export.is_none()))?;
        let feed = match from_lines {
            true => PaperFeed::Lines(Box::new(StandardInput::open(stops.clone())), self.bad_rows()),
            false => PaperFeed::Files,
        };
        let journal = self.out.join(PreparedPaper::JOURNAL);
        let (paper, opened) = PreparedPaper::open(file, feed, &journal, self.journal_use())?;
        if let Some(cut) = opened.cut {
            eprintln!("{}: {} bytes from line {} on were torn, and are cut", journal.display(), cut.bytes, cut.line);
        }
        let session = paper.start(strategy(paper.run())?)?;
        let (record, why) = match self.export {
            Some(_) => replayed(session)?,
            None => self.drive(session, &paper, &stops, screen)?,
        };
        let outputs = paper.outputs(&record).map_err(|error| Stop::Bug(error.to_string()))?;
        let written = written(&outputs, folder, overwrite)?;
        if self.export.is_none() {
            paper.close()?;
        }
        let text = if self.json { outputs.json()? } else { ended(&outputs, &record, &paper, why, &written, screen) };
        screen.print(&text)?;
        Ok(Outcome::Done)
    }

    fn bad_rows(&self) -> BadRows {
        if self.strict { BadRows::EndIt } else { BadRows::LeftOut }
    }

    fn journal_use(&self) -> JournalUse {
        let sync = match self.sync {
            SyncWhen::Always => JournalSync::Always,
            SyncWhen::Interval => JournalSync::Asked,
        };
        match (&self.export, self.resume) {
            (Some(_), _) => JournalUse::Read,
            (None, true) => JournalUse::GoOn(sync),
            (None, false) => JournalUse::Begin(sync),
        }
    }

    /// Drives a session by the clock to its end.
    fn drive(
        &self,
        mut session: PaperSession<'_>,
        paper: &PreparedPaper,
        stops: &Stops,
        screen: &Screen,
    ) -> Result<(Record, Option<StopReason>), Stop> {
        // What comes by itself keeps its own time.
        let mut clock = PaperClock::new(if self.feed == "-" { Speed::Max } else { self.speed });
        let mut beside = Beside { paper, progress: screen.progress(), synced: Instant::now(), told: None, lost: false };
        let mut replaying = self.resume;
        let why = loop {
            if replaying && !session.is_replaying()? {
                replaying = false;
                if session.was_stopped().is_none() {
                    beside.resumed(&session);
                }
            }
            if let Some(why) = session.was_stopped() {
                break why;
            }
            if let Some(why) = stops.asked().filter(|_| !replaying) {
                break why;
            }
            let Some(due) = session.next_due() else { break StopReason::EndOfFeed };
            if !replaying {
                let left = clock.left(due);
                beside.look(&session, &clock, left)?;
                clock.wait(due, stops);
                if stops.asked().is_some() {
                    continue;
                }
            }
            session.step(due)?;
            beside.lost(&session);
        };
        Ok((session.finish(why)?, Some(why)))
    }
}

/// What is told and done beside the session.
struct Beside<'a> {
    paper: &'a PreparedPaper,
    progress: Progress,
    synced: Instant,
    told: Option<Instant>,
    lost: bool,
}

impl Beside<'_> {
    /// Time between two syncs of the journal.
    const SYNC: Duration = Duration::from_secs(1);
    /// Time between two lines of status.
    const TELL: Duration = Duration::from_millis(200);

    fn resumed(&self, session: &PaperSession<'_>) {
        let done = session.replayed();
        eprintln!("resumed after {} rows, {} orders and {} fills of the log", done.rows, done.orders, done.fills);
    }

    /// Syncs the journal when it is time to, and before a long wait; tells how the session stands.
    fn look(&mut self, session: &PaperSession<'_>, clock: &PaperClock, wait: Duration) -> Result<(), InputError> {
        if wait >= Self::SYNC || self.synced.elapsed() >= Self::SYNC {
            session.sync()?;
            self.synced = Instant::now();
        }
        if self.told.is_none_or(|told| told.elapsed() >= Self::TELL) {
            self.told = Some(Instant::now());
            let status = session.status()?;
            self.progress.tell(&told_status(&status, self.paper, clock.lag()), status.fills, 0);
        }
        Ok(())
    }

    /// Tells once that too much was lost.
    fn lost(&mut self, session: &PaperSession<'_>) {
        if let Some(loss) = session.loss().filter(|_| !self.lost) {
            self.lost = true;
            let (at, lost, allowed, limit) = (loss.at, loss.lost, loss.allowed, loss.limit);
            eprintln!("trading stopped at {at}: {lost:.2} lost, and `{limit}` allows {allowed}");
        }
    }
}

/// The status of a session in a line.
fn told_status(status: &PaperStatus, paper: &PreparedPaper, lag: f64) -> String {
    const SHOWN: usize = 3;
    let time = status.time.map_or_else(|| "before the first event".to_owned(), |time| time.to_string());
    let held = paper.symbols().zip(&status.positions).filter(|(_, held)| held.0 != 0);
    let held: Vec<String> = held.take(SHOWN).map(|(symbol, held)| format!("{} {symbol}", held.to_f64())).collect();
    let held = if held.is_empty() { "flat".to_owned() } else { held.join(", ") };
    let PaperStatus { equity, working, orders, .. } = status;
    format!("{time}  equity {:.2}  {held}  {working} of {orders} orders work  {lag:.1} s behind", equity.to_f64())
}

/// Runs a journal once more, as far as it goes.
fn replayed(mut session: PaperSession<'_>) -> Result<(Record, Option<StopReason>), Stop> {
    while session.is_replaying()? {
        let Some(due) = session.next_due() else { break };
        session.step(due)?;
    }
    let why = session.was_stopped();
    Ok((session.finish(why.unwrap_or(StopReason::EndOfFeed))?, why))
}

fn written(outputs: &RunOutputs, folder: &Path, overwrite: Overwrite) -> Result<Vec<PathBuf>, Stop> {
    let mut output = OutputFolder::create(folder, overwrite)?;
    outputs.write(&mut output)?;
    Ok(output.finish()?)
}

/// What is told at the end.
fn ended(
    outputs: &RunOutputs,
    record: &Record,
    paper: &PreparedPaper,
    why: Option<StopReason>,
    written: &[PathBuf],
    screen: &Screen,
) -> String {
    let mut text = told(&outputs.page.title, &outputs.page.metrics, screen);
    text += &why
        .map_or_else(|| "\nThe session goes on.\n".to_owned(), |why| format!("\nThe session has ended: {}.\n", why.words()));
    let limits = [Reason::OrderLimit, Reason::PositionLimit, Reason::OrderRate];
    for (reason, count) in limits.iter().filter_map(|reason| Some((reason, record.blotter.rejected.get(reason)?))) {
        text += &format!("Orders refused: {count}; {reason}.\n");
    }
    if let Some(seen) = paper.lines_seen() {
        text +=
            &format!("Rows of the feed: {} taken, {} left out, {} known already.\n", seen.rows, seen.refused, seen.known);
    }
    text += &screen::written(written);
    text
}
