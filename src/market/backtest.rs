//! The backtest: what it is set up of, and what it leaves. Its loop is a [`Session`].

use std::sync::Arc;

use crate::sim2real::{Assembly, Seed, Timestamp};

use super::blotter::Blotter;
use super::halt::check_halts;
use super::line::Line;
use super::redraws::Redraws;
use super::sources::RowKind;
use super::spare::Spare;
use super::{
    Account, AccountRecord, Calendar, Cash, DataNotes, Execution, Feed, Halt, HaltSeen, History, Increments, Instrument,
    Latencies, LatencyError, Ledger, LedgerError, Matching, MoneyError, QueueModel, Reference, Session, Sources, Strategy,
    StreamError,
};

/// A backtest, as it was set up.
#[derive(Debug, Clone)]
pub struct Backtest {
    pub(super) instruments: Vec<Instrument>,
    pub(super) increments: Vec<Increments>,
    pub(super) histories: Vec<History>,
    pub(super) venue: Assembly<Execution>,
    pub(super) settings: Settings,
    /// What is drawn anew within a run.
    pub(super) redraws: Option<Arc<Redraws>>,
    /// Memory that runs to come go on in.
    pub(super) spare: Spare,
}

/// What else a backtest depends on.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Cash it begins with.
    pub cash: Cash,
    /// Where the randomness of mechanisms comes from.
    pub seed: Seed,
    /// Largest sum of positions, short ones counted as positive, as a multiple of equity. An order that would exceed it,
    /// at the prices of its decision, is refused unless it makes the sum smaller; moves of prices are not policed.
    pub max_leverage: f64,
    /// The price mechanisms start from where there are quotes; none for what suits the mechanisms.
    pub reference: Option<Reference>,
    /// How orders are matched.
    pub matching: Matching,
    /// How long messages take.
    pub latencies: Latencies,
    /// Time for which the equity curve keeps its first, lowest, highest and last point alone [ns]; none to keep one an event.
    pub equity_every: Option<i64>,
    /// When the market of each instrument is open, in their order. Instruments without a calendar, as those behind the last
    /// here, trade whenever there are data, in days of UTC.
    pub calendars: Vec<Option<Arc<Calendar>>>,
    /// When instruments do not trade within their sessions.
    pub halts: Vec<Halt>,
    /// How the account is kept; none for cash and prices in one currency, and nothing that happens to what is held.
    pub account: Option<Arc<Account>>,
}

impl Settings {
    /// No borrowing: the sum of positions stays within the equity.
    #[must_use]
    pub fn with_cash(cash: Cash) -> Self {
        let (matching, latencies, calendars, halts) = Default::default();
        let (seed, max_leverage, reference, equity_every, account) = (Seed::default(), 1.0, None, None, None);
        Self { cash, seed, max_leverage, reference, matching, latencies, equity_every, calendars, halts, account }
    }
}

/// A backtest that cannot be set up or go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BacktestError {
    /// No instrument has any data.
    #[error("there is nothing to run on\nhint: give at least one bar or quote between `start` and `end`")]
    NoData,
    /// Instruments and histories do not match.
    #[error("there are {instruments} instruments and data for {histories}\nhint: give each instrument its data")]
    Unmatched {
        /// Number of instruments.
        instruments: usize,
        /// Number of histories.
        histories: usize,
    },
    /// Calendars of instruments that are not there.
    #[error(
        "there are {instruments} instruments and calendars for {calendars}\nhint: give calendars in the order of the instruments"
    )]
    Calendars {
        /// Number of instruments.
        instruments: usize,
        /// Number of calendars.
        calendars: usize,
    },
    /// A leverage that cannot be.
    #[error("max_leverage is {0}\nhint: it is a number above 0; 1 borrows nothing")]
    Leverage(f64),
    /// A model of queues that cannot be.
    #[error("the queue is to move by {0}\nhint: the exponent is a number above 0; 1 is in proportion")]
    Queue(QueueModel),
    /// A halt that cannot be.
    #[error("the halt of {symbol} from {from}: {what}\nhint: {hint}")]
    Halt {
        /// Its number among the halts, from 0.
        number: usize,
        /// Symbol of the instrument.
        symbol: String,
        /// When it begins.
        from: Timestamp,
        /// What is wrong with it.
        what: String,
        /// What to do about it.
        hint: &'static str,
    },
    /// A latency that cannot be.
    #[error(transparent)]
    Latency(#[from] LatencyError),
    /// An amount that is no amount.
    #[error("{place}: {error}")]
    Money {
        /// Where it came up.
        place: String,
        /// What is wrong with it.
        error: MoneyError,
    },
    /// A time between points of the equity curve that is none.
    #[error("points of the equity curve are to be {0} ns apart\nhint: give a time above 0, such as \"1s\"")]
    EquityEvery(i64),
    /// Data that cannot be read, or cannot be.
    #[error(transparent)]
    Data(Box<StreamError>),
    /// Something the account cannot book.
    #[error("{place}: {error}")]
    Account {
        /// Where it came up.
        place: String,
        /// What is wrong.
        error: LedgerError,
    },
    /// There is something in a currency of which nothing says yet what it is worth.
    #[error(
        "{place}: there is something in {currency}, and no rate of it is known yet\nhint: give [[rate]] a row that is no later than the first trade in {currency}, or a constant `value`"
    )]
    NoRate {
        /// Where it came up.
        place: String,
        /// The currency.
        currency: String,
    },
    /// Rates that are not in the order of time.
    #[error("the rate of {currency} of {at} is not after the one before it\nhint: sort rates by time, one an instant")]
    RateOrder {
        /// The currency.
        currency: String,
        /// From when on the rate is in force.
        at: Timestamp,
    },
    /// A dividend or split within a bar, whose prices are then of before and after.
    #[error(
        "an action of {symbol} at {at} lies within the bar from {open_at} to {known_at}\nhint: the ex-instant is the open of the first bar without the dividend or after the split: check `ts` and `zone`"
    )]
    WithinBar {
        /// Symbol of the instrument.
        symbol: String,
        /// The ex-instant.
        at: Timestamp,
        /// When the bar opens.
        open_at: Timestamp,
        /// When it is over.
        known_at: Timestamp,
    },
    /// An account that does not say on which terms each instrument is held.
    #[error(
        "there are terms for {terms} of {instruments} instruments\nhint: give terms for each instrument, in their order"
    )]
    Terms {
        /// Number of terms.
        terms: usize,
        /// Number of instruments.
        instruments: usize,
    },
    /// An account that does not say what each currency is worth.
    #[error("there are {rates} rates for {currencies} foreign currencies\nhint: give a rate for each but the first")]
    Rates {
        /// Number of rates.
        rates: usize,
        /// Number of currencies but the first.
        currencies: usize,
    },
    /// Mechanisms that give a price no market has.
    #[error(
        "order {order_id} for {symbol} at {time}: its mechanisms give a price of {price}\nhint: check the size of their parameters; impacts are for small parts of a day's volume"
    )]
    ModelPrice {
        /// The order.
        order_id: u64,
        /// Its instrument.
        symbol: String,
        /// When it met the market.
        time: Timestamp,
        /// The price.
        price: f64,
    },
}

/// The account's worth at an event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EquityPoint {
    /// When.
    pub time: Timestamp,
    /// Cash and positions [currency], the nearest floating-point number.
    pub equity: f64,
}

/// How much was held, over all events.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Held {
    /// Number of events.
    pub events: usize,
    /// Events at which something was held.
    pub invested: usize,
    /// Sum over events of what was held, short positions counted as positive, over equity.
    pub leverage: f64,
    /// Mean of the equity at all points, be they kept or not; none without an event.
    pub mean_equity: Option<f64>,
    /// Bars within which orders rested on both sides of the open, so that a rule had to say which was met first.
    pub ambiguous_bars: usize,
}

/// All that a backtest leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Orders, fills and refusals.
    pub blotter: Blotter,
    /// One point an event, and one for fills after the last; fewer where [`Settings::equity_every`] says so.
    pub equity: Vec<EquityPoint>,
    /// The account at the end.
    pub ledger: Ledger,
    /// How much was held.
    pub held: Held,
    /// What the data were, one an instrument.
    pub data: Vec<DataSeen>,
    /// Of each instrument, rows from outside the sessions of its calendar, which no order met; none where it has no calendar,
    /// and nothing at all where no instrument has one.
    pub outside: Vec<Option<usize>>,
    /// What it saw of its halts, in the order in which it names them.
    pub halts: Vec<HaltSeen>,
    /// Corporate actions and margin calls.
    pub account: AccountRecord,
}

/// What the data of an instrument were.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DataSeen {
    /// Whether there were quotes.
    pub quoted: bool,
    /// Whether there were bars, and nothing finer.
    pub bars_alone: bool,
    /// What was found in the files, one a file.
    pub notes: Vec<DataNotes>,
}

impl DataSeen {
    pub(super) fn of(line: &Line) -> Self {
        let finer = [RowKind::Trades, RowKind::Depth, RowKind::Orders, RowKind::Quotes];
        Self {
            quoted: line.tells(RowKind::Quotes),
            bars_alone: line.tells(RowKind::Bars) && !finer.iter().any(|kind| line.tells(*kind)),
            notes: line.notes(),
        }
    }
}

impl Backtest {
    /// The same backtest, with orders filled by `venue`.
    #[must_use]
    pub fn with_venue(&self, venue: Assembly<Execution>) -> Self {
        Self { venue, ..self.clone() }
    }

    /// A backtest of `instruments` on `histories` (one an instrument, in the same order), with orders filled by `venue`.
    ///
    /// # Errors
    /// If there are no data, the two differ in number, or a tick size, lot size, the leverage or the account cannot be.
    pub fn new(
        instruments: Vec<Instrument>,
        histories: Vec<History>,
        venue: Assembly<Execution>,
        settings: Settings,
    ) -> Result<Self, BacktestError> {
        if instruments.len() != histories.len() {
            return Err(BacktestError::Unmatched { instruments: instruments.len(), histories: histories.len() });
        }
        if histories.iter().all(History::is_empty) {
            return Err(BacktestError::NoData);
        }
        Self::of(instruments, histories, venue, settings)
    }

    /// A backtest of `instruments` whose data are not held in memory: it [starts on](Self::start_on) streams.
    ///
    /// # Errors
    /// As [`Backtest::new`], but for data.
    pub fn streaming(
        instruments: Vec<Instrument>,
        venue: Assembly<Execution>,
        settings: Settings,
    ) -> Result<Self, BacktestError> {
        let histories = vec![History::default(); instruments.len()];
        Self::of(instruments, histories, venue, settings)
    }

    fn of(
        instruments: Vec<Instrument>,
        histories: Vec<History>,
        venue: Assembly<Execution>,
        settings: Settings,
    ) -> Result<Self, BacktestError> {
        if settings.calendars.len() > instruments.len() {
            let (instruments, calendars) = (instruments.len(), settings.calendars.len());
            return Err(BacktestError::Calendars { instruments, calendars });
        }
        if !settings.max_leverage.is_finite() || settings.max_leverage <= 0.0 {
            return Err(BacktestError::Leverage(settings.max_leverage));
        }
        if let Some(every) = settings.equity_every.filter(|every| *every <= 0) {
            return Err(BacktestError::EquityEvery(every));
        }
        let Latencies { feed, order, response, compute, .. } = &settings.latencies;
        [feed, order, response, compute].into_iter().try_for_each(|latency| latency.check())?;
        if !settings.matching.queue.is_possible() {
            return Err(BacktestError::Queue(settings.matching.queue));
        }
        check_halts(&settings.halts, &instruments)?;
        let increments = instruments
            .iter()
            .map(|i| Increments::of(i).map_err(|error| BacktestError::Money { place: i.symbol.clone(), error }))
            .collect::<Result<_, _>>()?;
        if let Some(account) = &settings.account {
            account.check(&instruments)?;
            account.check_actions(&instruments, &histories)?;
        }
        Ok(Self { instruments, increments, histories, venue, settings, redraws: None, spare: Spare::default() })
    }

    /// The instruments.
    #[must_use]
    pub fn instruments(&self) -> &[Instrument] {
        &self.instruments
    }

    /// What orders meet.
    #[must_use]
    pub fn venue(&self) -> &Assembly<Execution> {
        &self.venue
    }

    /// What else it depends on.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Their data.
    #[must_use]
    pub fn histories(&self) -> &[History] {
        &self.histories
    }

    /// The same backtest on other data.
    ///
    /// # Errors
    /// As [`Backtest::new`].
    pub fn on(&self, histories: Vec<History>) -> Result<Self, BacktestError> {
        let backtest = Self::new(self.instruments.clone(), histories, self.venue.clone(), self.settings.clone())?;
        Ok(backtest.beside(self))
    }

    /// The same backtest, its runs in the [memory](Self::recycle) of those of `other`.
    pub(super) fn beside(self, other: &Self) -> Self {
        Self { spare: other.spare.clone(), ..self }
    }

    /// Starts it, before its first event.
    #[must_use]
    pub fn start(&self) -> Session {
        let feed = Feed::new(&self.histories);
        let room = feed.rows();
        Session::new(Arc::new(self.clone()), feed, room)
    }

    /// Starts it in the midst of its data: rows that were known before `from` are left out, which is found by bisection. The books of
    /// data that tell them change by change are empty then, and fill as changes come.
    ///
    /// It is the run of [`on`](Self::on) the rows from there, without a copy of them.
    #[must_use]
    pub fn start_from(self: &Arc<Self>, from: Timestamp) -> Session {
        self.start_with_room(from, None)
    }

    /// The same, with room for the equity of so many events.
    pub(super) fn start_with_room(self: &Arc<Self>, from: Timestamp, room: Option<usize>) -> Session {
        Session::new(Arc::clone(self), Feed::from(&self.histories, from), room)
    }

    /// Starts it on streams, one set an instrument, before its first event: of the data only what lies around the present is in
    /// memory. What it does is the same as on whole histories of the same rows.
    ///
    /// # Errors
    /// What the streams refuse of their first rows; not as many sets as instruments; no data at all.
    pub fn start_on(&self, sources: Vec<Sources>) -> Result<Session, BacktestError> {
        let (instruments, histories) = (self.instruments.len(), sources.len());
        if instruments != histories {
            return Err(BacktestError::Unmatched { instruments, histories });
        }
        let feed = Feed::streaming(sources).map_err(|error| BacktestError::Data(Box::new(error)))?;
        if feed.peek().is_none() {
            return Err(BacktestError::NoData);
        }
        let room = feed.rows();
        Ok(Session::new(Arc::new(self.clone()), feed, room))
    }

    /// Runs it from the first event to the last.
    ///
    /// # Errors
    /// If an amount overflows, or a mechanism gives a price no market has.
    pub fn run(&self, strategy: &mut dyn Strategy) -> Result<Record, BacktestError> {
        let mut session = self.start();
        if let Some(over) = self.spare.take() {
            session.go_on_in(over);
        }
        while session.advance(strategy, usize::MAX)? {}
        session.finish()
    }

    /// Gives back what a run left and nobody reads any more: the next one, of this backtest or of a copy of it, goes on in its
    /// memory. What comes of it is the same to the last bit.
    pub fn recycle(&self, over: Record) {
        self.spare.give(over);
    }
}
