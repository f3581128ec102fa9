//! Why a market environment cannot be made or go on.

use crate::market::{BacktestError, HistoryError, LatencyError, MoneyError};
use crate::rl::EnvError;
use crate::sim2real::randomize::RandomizeError;
use crate::sim2real::regime::RegimeError;

/// A market environment that cannot be made or go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MarketEnvError {
    /// The backtest cannot be set up, or cannot go on.
    #[error(transparent)]
    Backtest(#[from] BacktestError),
    /// Data that cannot be.
    #[error(transparent)]
    History(#[from] HistoryError),
    /// A latency that cannot be.
    #[error(transparent)]
    Latency(#[from] LatencyError),
    /// An amount that is none.
    #[error("an amount of the account: {0}")]
    Money(#[from] MoneyError),
    /// A model of regimes that does not go with returns.
    #[error("the model of regimes: {0}")]
    Regime(#[from] RegimeError),
    /// Parameters that cannot be drawn together.
    #[error(transparent)]
    Randomize(#[from] RandomizeError),
    /// Not the number of instruments the task is about.
    #[error("the task is about {task} instruments, and the backtest has {found}\nhint: give it data of as many instruments")]
    Instruments {
        /// Of the task.
        task: usize,
        /// Of the backtest.
        found: usize,
    },
    /// Data that are not in memory.
    #[error("the data are read while a run goes, and an episode begins anywhere in them\nhint: drop `stream = true`")]
    Streamed,
    /// Episodes that are longer than the data.
    #[error(
        "episodes of {length} steps and {warm_up} rows before them do not fit into {rows} rows of data\nhint: shorten `length` or `warm_up`, or give more data"
    )]
    Window {
        /// Steps of an episode.
        length: u32,
        /// Rows before the first.
        warm_up: usize,
        /// Rows there are.
        rows: usize,
    },
    /// A start at which no episode fits.
    #[error("an episode cannot begin at row {start}\nhint: give a row from {first} to {last}, or leave `start` out")]
    Start {
        /// Where it was to begin.
        start: usize,
        /// First row at which one can.
        first: usize,
        /// Last row at which one can.
        last: usize,
    },
    /// The data end before anybody decides.
    #[error(
        "the data end before the first step is due\nhint: give more data, less `warm_up`, or another pace: bars are at the pace of bars, quotes and books at that of events or seconds"
    )]
    NothingDue,
    /// A number that cannot be.
    #[error("{what} is {value}\nhint: {hint}")]
    Value {
        /// What.
        what: &'static str,
        /// What was found.
        value: f64,
        /// What to do.
        hint: &'static str,
    },
    /// Something is to be drawn every so many steps.
    #[error(
        "`{target}` is drawn anew every so many steps\nhint: a market goes on between steps: say at = {{ seconds = .. }} of its time"
    )]
    BySteps {
        /// What is drawn.
        target: String,
    },
    /// Something is to be drawn in a regime that the data do not have.
    #[error(
        "`{target}` is drawn in regime {regime}, and there are {count}, counted from 0\nhint: the model of regimes of the features says how many there are"
    )]
    NoSuchRegime {
        /// What is drawn.
        target: String,
        /// The regime.
        regime: usize,
        /// How many there are.
        count: usize,
    },
    /// Something is to be drawn that the venue does not have.
    #[error(
        "`{target}` cannot be drawn: the venue has {known}\nhint: add the mechanism to the venue with its nominal value, or drop it here"
    )]
    UnknownTarget {
        /// What was to be drawn.
        target: String,
        /// What there is.
        known: String,
    },
}

impl From<MarketEnvError> for EnvError {
    fn from(error: MarketEnvError) -> Self {
        Self::Failed { lane: 0, why: Box::new(error) }
    }
}
