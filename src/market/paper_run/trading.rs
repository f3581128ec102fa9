//! A paper run under way.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::io::{InputError, RunFile};
use crate::market::{BacktestError, Cash, Quantity, Reason, Record, Session, Status, Strategy, explained};
use crate::sim2real::Timestamp;

use super::entry::{Entry, Stop, StopReason, Told};
use super::limits::{Limited, Loss, PaperSettings};
use super::paper_log::{PaperLog, Replayed};

/// A paper run under way: the session of a backtest that goes as far as it is told, with all it does in the journal.
pub struct PaperSession<'p> {
    session: Session,
    strategy: Limited,
    run: &'p RunFile,
    log: Arc<Mutex<PaperLog>>,
    told: Told,
    /// Steps so far: whatever drives the session, the same steps come one after the other.
    steps: u64,
    now: Option<Timestamp>,
}

/// How a paper run stands.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperStatus {
    /// When the last event was, by the feed; none before the first.
    pub time: Option<Timestamp>,
    /// Cash and what is held [currency of the run].
    pub equity: Cash,
    /// What is held of each instrument.
    pub positions: Vec<Quantity>,
    /// Orders that work.
    pub working: usize,
    /// Orders sent so far.
    pub orders: usize,
    /// Fills so far.
    pub fills: usize,
    /// Orders refused so far.
    pub refused: usize,
}

impl std::fmt::Debug for PaperSession<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PaperSession").field("steps", &self.steps).finish_non_exhaustive()
    }
}

impl<'p> PaperSession<'p> {
    pub(super) fn new(
        session: Session,
        strategy: Box<dyn Strategy>,
        settings: PaperSettings,
        run: &'p RunFile,
        log: Arc<Mutex<PaperLog>>,
    ) -> Self {
        let strategy = Limited::new(strategy, settings);
        Self { session, strategy, run, log, told: Told::default(), steps: 0, now: None }
    }

    fn log(&self) -> MutexGuard<'_, PaperLog> {
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn explained(&self, error: &BacktestError) -> InputError {
        explained(self.run, error)
    }

    /// When the next thing happens, by the feed; none when the feed has ended.
    #[must_use]
    pub fn next_due(&self) -> Option<Timestamp> {
        self.session.next_due()
    }

    /// Whether what happens next happened before, and has only to be done again: there is nothing to wait for.
    ///
    /// # Errors
    /// A journal that cannot be read any more.
    pub fn is_replaying(&self) -> Result<bool, InputError> {
        let mut log = self.log();
        Ok(match log.stop {
            Some(stop) => self.steps < stop.after,
            None => log.is_replaying()?,
        })
    }

    /// Where the journal says that it was stopped, once it has come there.
    #[must_use]
    pub fn was_stopped(&self) -> Option<StopReason> {
        let stop = self.log().stop.filter(|stop| self.steps >= stop.after)?;
        Some(stop.why)
    }

    /// Lets happen what happens up to `until` or up to the next event, whichever is first; what came of it is in the journal when
    /// this returns.
    ///
    /// # Errors
    /// What a backtest refuses; a journal that cannot be written; and where it is run again, that it does not do what it did.
    pub fn step(&mut self, until: Timestamp) -> Result<(), InputError> {
        let event = self.session.step_up_to(until, &mut self.strategy).map_err(|error| self.explained(&error))?;
        self.now = event.map(|event| event.time).or(self.now);
        self.steps += 1;
        self.tell()
    }

    /// Puts what is new into the journal.
    fn tell(&mut self) -> Result<(), InputError> {
        let (blotter, instruments) = (&self.session.blotter, self.session.setup.instruments());
        let news = self.told.news(blotter, instruments, self.session.events());
        if news.is_empty() { Ok(()) } else { self.log().outcome(news) }
    }

    /// How it stands.
    ///
    /// # Errors
    /// An amount that overflows.
    pub fn status(&self) -> Result<PaperStatus, InputError> {
        let blotter = &self.session.blotter;
        Ok(PaperStatus {
            time: self.now,
            equity: self.session.equity_now().map_err(|error| self.explained(&error))?,
            positions: self.session.holdings().collect(),
            working: blotter.count(Status::Unfilled),
            orders: blotter.orders.len(),
            fills: blotter.fills.len(),
            refused: blotter.rejected.values().sum(),
        })
    }

    /// Why and when trading stopped, where too much was lost.
    #[must_use]
    pub fn loss(&self) -> Option<Loss> {
        self.strategy.loss()
    }

    /// How much of it was replayed.
    #[must_use]
    pub fn replayed(&self) -> Replayed {
        self.log().replayed
    }

    /// Brings the journal to the disk.
    ///
    /// # Errors
    /// A disk that fails.
    pub fn sync(&self) -> Result<(), InputError> {
        self.log().sync()
    }

    /// Ends it: orders that work are taken back unless the feed has come to its end, and what is under way is booked. The journal
    /// is not closed yet: [`PreparedPaper::close`](super::PreparedPaper::close) does that once the tables are written.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn finish(mut self, why: StopReason) -> Result<Record, InputError> {
        let stop = Stop { why, after: self.steps };
        {
            let mut log = self.log();
            if log.stop.is_none() {
                log.add(&[Entry::Stop(stop)])?;
            }
        }
        if why != StopReason::EndOfFeed {
            self.session.cancel_all(Reason::Stopped).map_err(|error| explained(self.run, &error))?;
        }
        self.tell()?;
        let (mut told, run, log) = (self.told, self.run, Arc::clone(&self.log));
        let (events, setup) = (self.session.events(), Arc::clone(&self.session.setup));
        let instruments = setup.instruments();
        let record = self.session.finish().map_err(|error| explained(run, &error))?;
        let mut log = log.lock().unwrap_or_else(PoisonError::into_inner);
        log.outcome(told.news(&record.blotter, instruments, events))?;
        log.all_done()?;
        log.sync()?;
        Ok(record)
    }
}
