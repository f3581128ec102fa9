//! What a market environment is made of: a backtest, and how it is cut into episodes and steps.

use std::sync::Arc;

use crate::market::Backtest;
use crate::rl::Episode;
use crate::sim2real::Timestamp;
use crate::sim2real::regime::HiddenMarkov;

use super::books::Books;
use super::error::MarketEnvError;
use super::execution::{DrawnEpisode, DrawnExecution, Draws};
use super::features::{FeatureSettings, Features};
use super::pace::{Pace, Pacer};

/// What a market environment is made of. All lanes share it.
#[derive(Debug, Clone)]
pub struct MarketSetup {
    /// The data, the venue, the account and all other settings: an episode is this backtest, stepped.
    pub backtest: Backtest,
    /// When a step is due.
    pub pace: Pace,
    /// Steps of an episode, whose first row is drawn; none for all data from the first row on.
    pub length: Option<u32>,
    /// Events that go by in an episode before its first step, with nobody acting.
    pub warm_up: usize,
    /// What is observed of the market.
    pub features: FeatureSettings,
    /// What is drawn anew for every episode, and within it.
    pub execution: Option<DrawnExecution>,
}

impl MarketSetup {
    /// All of a backtest's data in one episode, at the pace of bars where there are bars alone and of events else, with the usual
    /// features and nothing drawn.
    #[must_use]
    pub fn new(backtest: Backtest) -> Self {
        let bars = backtest.histories().iter().all(|history| history.is_empty() || history.shows_bars_alone());
        let pace = if bars { Pace::Bars } else { Pace::Events(1) };
        Self { backtest, pace, length: None, warm_up: 8, features: FeatureSettings::default(), execution: None }
    }

    /// The same with episodes of so many steps, whose beginnings are drawn.
    #[must_use]
    pub fn with_length(self, length: u32) -> Self {
        Self { length: Some(length), ..self }
    }

    /// The same at another pace.
    #[must_use]
    pub fn with_pace(self, pace: Pace) -> Self {
        Self { pace, ..self }
    }

    /// The same with execution drawn anew for every episode.
    #[must_use]
    pub fn with_execution(self, execution: DrawnExecution) -> Self {
        Self { execution: Some(execution), ..self }
    }

    fn check(&self) -> Result<(), MarketEnvError> {
        let value = |what, value, hint| Err(MarketEnvError::Value { what, value, hint });
        match self.pace {
            Pace::Events(0) => return value("the pace in events", 0.0, "a step is taken every so many events, at least 1"),
            Pace::Seconds(s) if !(1e-9..=1e9).contains(&s) => {
                return value("the pace in seconds", s, "a step is taken every so many seconds, from 1e-9 to 1e9");
            }
            _ => {}
        }
        if self.length == Some(0) {
            return value("the length of an episode", 0.0, "give a number of steps above 0, or none for all data");
        }
        if self.features.windows.contains(&0) {
            return value("a window of returns", 0.0, "it is a number of rows, at least 1");
        }
        let half_lives = [self.features.fast, self.features.slow];
        if let Some(bad) = half_lives.into_iter().find(|rows| !(rows.is_finite() && *rows > 0.0)) {
            return value("a half-life", bad, "it is a number of rows above 0");
        }
        match &self.features.regimes {
            Some(model) if model.width() != 1 => {
                value("the number of columns of the model of regimes", model.width() as f64, "fit it to returns alone")
            }
            _ => Ok(()),
        }
    }
}

/// A setup made ready for episodes.
#[derive(Debug)]
pub(super) struct Ready {
    pub backtest: Arc<Backtest>,
    pub tables: Arc<Vec<Features>>,
    pub length: Option<u32>,
    pace: Pace,
    warm_up: usize,
    books: Vec<Option<Books>>,
    pub draws: Option<Draws>,
    /// First row at which an episode may begin, of the first instrument, and the number of such rows.
    starts: (usize, usize),
}

/// An episode before its first event.
pub(super) struct Beginning {
    /// The backtest it is, with what was drawn.
    pub backtest: Arc<Backtest>,
    /// What was drawn.
    pub drawn: Vec<f64>,
    /// Rows known before are left out.
    pub from: Timestamp,
}

impl Ready {
    /// Makes `setup` ready.
    ///
    /// # Errors
    /// What cannot be of it; episodes that are longer than the data; something drawn that the venue does not have.
    pub fn new(setup: MarketSetup) -> Result<Self, MarketEnvError> {
        setup.check()?;
        let MarketSetup { backtest, pace, length, warm_up, features, execution } = setup;
        let each = || backtest.histories().iter().zip(&backtest.increments);
        let tables =
            each().map(|(history, steps)| Features::of(history, *steps, &features)).collect::<Result<Vec<_>, _>>()?;
        // Only an episode that begins in the midst needs to know what was displayed before.
        let books = each().map(|(history, steps)| length.and_then(|_| Books::of(history, *steps))).collect();
        let regimes = || regimes(&tables, &features);
        let draws = execution.map(|execution| Draws::new(execution, backtest.venue(), regimes())).transpose()?;
        let starts = starts(&tables, pace, length, warm_up)?;
        Ok(Self { backtest: Arc::new(backtest), tables: Arc::new(tables), length, pace, warm_up, books, draws, starts })
    }

    /// The pace of an episode before its first event.
    pub fn pacer(&self) -> Pacer {
        Pacer::new(self.pace, self.backtest.instruments().len() > 1, self.warm_up)
    }

    /// An episode that begins at row `start` of the first instrument's data, or else at one that is drawn by `draw`, within
    /// [0, 1).
    ///
    /// # Errors
    /// A start at which none fits.
    pub fn begin(&self, episode: Episode, start: Option<usize>, draw: f64) -> Result<Beginning, MarketEnvError> {
        let from = match self.length {
            None => Timestamp::MIN,
            Some(_) => {
                let (first, count) = self.starts;
                let row = match start {
                    Some(start) if start < first || start - first >= count => {
                        return Err(MarketEnvError::Start { start, first, last: first + count - 1 });
                    }
                    Some(start) => start,
                    None => first + ((draw * count as f64) as usize).min(count - 1),
                };
                self.tables.first().and_then(|table| table.time(row - self.warm_up)).unwrap_or(Timestamp::MIN)
            }
        };
        let settings = self.backtest.settings();
        let (venue, latencies) = (self.backtest.venue(), &settings.latencies);
        let DrawnEpisode { venue, latencies, drawn, redraws } = match &self.draws {
            Some(draws) => draws.draw(episode, venue, latencies),
            None => DrawnEpisode { venue: venue.clone(), latencies: latencies.clone(), drawn: vec![], redraws: None },
        };
        let settings = crate::market::Settings { seed: episode.seed(), latencies, ..settings.clone() };
        let backtest = Arc::new(Backtest { venue, settings, redraws, ..Backtest::clone(&self.backtest) });
        Ok(Beginning { backtest, drawn, from })
    }

    /// Rows of each instrument known before `from`.
    pub fn seen(&self, from: Timestamp) -> impl Iterator<Item = usize> {
        self.tables.iter().map(move |table| table.before(from))
    }

    /// The session of an episode, with the books there were when it began.
    ///
    /// # Errors
    /// If nothing can be valued, which is nothing.
    pub fn session(&self, beginning: &Beginning) -> Result<crate::market::Session, MarketEnvError> {
        let room = self.length.map(|steps| (steps as usize + self.warm_up + 1).min(1 << 16));
        let mut session = beginning.backtest.start_with_room(beginning.from, room);
        for (k, books) in self.books.iter().enumerate() {
            if let Some((book, others)) = books.as_ref().and_then(|books| books.at(beginning.from)) {
                session.begin_with_book(k, book, others)?;
            }
        }
        Ok(session)
    }
}

/// When regimes of the first instrument begin, and which, as far as was known by then; and how many there are.
fn regimes(tables: &[Features], settings: &FeatureSettings) -> (Arc<[(Timestamp, usize)]>, usize) {
    let count = settings.regimes.as_ref().map_or(0, HiddenMarkov::states);
    (tables.first().map_or_else(Vec::new, |table| table.regimes(count)).into(), count)
}

/// The first row at which an episode may begin, and the number of such rows: behind the warm-up, and as far before the end as the
/// steps take. An episode of all data begins with the first.
fn starts(tables: &[Features], pace: Pace, length: Option<u32>, warm_up: usize) -> Result<(usize, usize), MarketEnvError> {
    let Some(length) = length else { return Ok((0, 1)) };
    let rows = tables.first().map_or(0, Features::len);
    let too_long = MarketEnvError::Window { length, warm_up, rows };
    let end = match pace {
        Pace::Events(every) => rows.checked_sub((length as usize).saturating_mul(every as usize)),
        Pace::Bars => rows.checked_sub(length as usize),
        Pace::Seconds(seconds) => tables.first().and_then(|table| table.time(rows.checked_sub(1)?)).map(|last| {
            let takes = f64::from(length) * seconds * Timestamp::NANOS as f64;
            tables.first().map_or(0, |table| table.before(Timestamp(last.0.saturating_sub(takes as i64))))
        }),
    };
    match end {
        Some(end) if end > warm_up => Ok((warm_up, end - warm_up)),
        _ => Err(too_long),
    }
}
