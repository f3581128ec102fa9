//! A backtest under way: feed, strategy, venue and ledger, one event at a time.

use std::fmt;
use std::sync::Arc;

use crate::sim2real::Timestamp;

use super::account::Keeping;
use super::agenda::{Agenda, Due, Phase};
use super::backtest::{Backtest, BacktestError, Held, Record, Settings};
use super::blotter::Blotter;
use super::by_id::ById;
use super::carry::Carry;
use super::equity_curve::EquityCurve;
use super::hours::Timetable;
use super::known::Known;
use super::latency::Clocks;
use super::line::Line;
use super::mail::Mail;
use super::mechanism::StaleQuotes;
use super::mechanism::{Need, needs};
use super::redraws::Redrawn;
use super::sources::RowKind;
use super::transit::Transit;
use super::venue::{Auctions, Detail, Outcome, Resting, Rules, Setup, Venue};
use super::{Arrival, Daily, DataSeen, DepthBook, Event, EventKind, Feed, Ledger, Orders, Reference, Strategy};

mod clocked;
mod exchange;
mod outside;
mod plain;
mod quiet;
mod telling;

/// A backtest under way.
pub struct Session {
    pub(super) setup: Arc<Backtest>,
    pub(super) feed: Feed,
    transit: Transit,
    /// Trades value what is held: there is nothing else that could.
    trades_mark: Vec<bool>,
    /// Data take no time to the strategy but what their own two times say.
    direct: bool,
    /// Nothing but bars and orders wants to be looked for.
    can_be_quiet: bool,
    /// Market orders may meet the next open with nothing between.
    can_be_plain: bool,
    pub(super) agenda: Agenda,
    pub(super) clocks: Clocks,
    pub(super) timetable: Timetable,
    pub(super) known: Vec<Known>,
    pub(super) daily: Vec<Daily>,
    pub(super) venue: Venue,
    /// What kind of data the orders of each instrument meet.
    pub(super) data_of: Vec<EventKind>,
    /// Orders on their way to the venue.
    pub(super) sent: ById<(usize, Resting)>,
    /// What became of orders and is not known yet.
    pub(super) mail: Mail,
    pub(super) outcomes: Vec<Outcome>,
    pub(super) terms: Vec<f64>,
    /// The bar of each instrument whose open is on the agenda.
    expected: Vec<Option<usize>>,
    pub(super) ledger: Ledger,
    pub(super) carry: Carry,
    pub(super) orders: Orders,
    pub(super) blotter: Blotter,
    pub(super) equity: EquityCurve,
    held: Held,
    rows: usize,
    /// Terms, rates and corporate actions, where the account has any.
    pub(super) keeping: Option<Box<Keeping>>,
    /// What is drawn anew within the run.
    pub(super) redrawn: Option<Box<Redrawn>>,
}

impl fmt::Debug for Session {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Session").field("events", &self.held.events).finish_non_exhaustive()
    }
}

/// How finely the data of an instrument know its market.
fn detail(line: &Line) -> Detail {
    if line.tells(RowKind::Orders) {
        Detail::ByOrder
    } else if line.tells(RowKind::Depth) {
        Detail::ByPrice
    } else if line.tells(RowKind::Quotes) || line.tells(RowKind::Trades) {
        Detail::Quotes
    } else {
        Detail::Bars
    }
}

impl Session {
    /// A session before its first event, with room for the equity of so many of them.
    pub(super) fn new(setup: Arc<Backtest>, feed: Feed, room: Option<usize>) -> Self {
        let Settings { seed, reference, matching, latencies, equity_every, .. } = setup.settings.clone();
        let stale = StaleQuotes::delay_before(&setup.venue);
        let reference = reference.unwrap_or_else(|| Reference::suiting(&setup.venue));
        let origin = feed.peek().unwrap_or_default();
        let (intrabar, limit_fill, queue) = (matching.intrabar, matching.limit_fill, matching.queue);
        let depth: Vec<Detail> = feed.lines().iter().map(detail).collect();
        let known = |(k, detail): (usize, &Detail)| Known {
            book: matches!(detail, Detail::ByPrice | Detail::ByOrder).then(|| DepthBook::new(setup.increments[k])),
            ..Known::default()
        };
        let known = depth.iter().enumerate().map(known).collect();
        let data_of = feed.lines().iter().zip(&depth).map(|(line, detail)| match detail {
            Detail::Bars => EventKind::Bar,
            Detail::Quotes if !line.tells(RowKind::Quotes) => EventKind::Trade,
            Detail::Quotes => EventKind::Quote,
            Detail::ByPrice | Detail::ByOrder => EventKind::Depth,
        });
        let data_of = data_of.collect();
        let finer = [RowKind::Bars, RowKind::Depth, RowKind::Orders, RowKind::Quotes];
        let trades_mark = feed.lines().iter().map(|line| !finer.iter().any(|kind| line.tells(*kind))).collect();
        let venue = Setup {
            symbols: setup.instruments.iter().map(|i| i.symbol.as_str()).collect(),
            increments: &setup.increments,
            depth,
            rules: Rules {
                reference,
                intrabar,
                limit_fill,
                queue,
                halted: matching.halted,
                shows_own: matching.shows_own_orders,
                origin,
            },
            seed,
        };
        let asks = |id: &str, form: usize| needs(id, form).contains(&Need::RecentVolatility);
        let asks_recent = setup.venue.mechanisms().any(|(mechanism, form, _)| asks(mechanism.about().name, form));
        let mut venue = Venue::new(&setup.venue, &venue);
        let conceding = venue.conceding.len();
        let count = setup.instruments.len();
        let calendars = setup.settings.calendars.iter().map(Option::as_ref);
        let timetable = Timetable::new(calendars, &setup.settings.halts, count);
        for k in (0..count).filter(|k| timetable.keeps(*k)) {
            let has_hours = timetable.each().get(k).is_some_and(Option::is_some);
            let of = if has_hours { Auctions::of } else { Auctions::always };
            venue.floors[k].auctions = Some(of(feed.line(k)));
        }
        let mut agenda = Agenda::default();
        let (ledger, keeping) = Keeping::start(&setup.settings, count, origin, &mut agenda);
        let redrawn = setup.redraws.as_ref().map(|plan| Redrawn::new(plan, &setup.venue, &latencies, origin));
        redrawn.iter().flat_map(Redrawn::first).for_each(|(at, phase, due)| agenda.put(at, phase, due));
        let late = redrawn.as_ref().is_some_and(|redrawn| redrawn.delays_data(&setup.venue));
        let mut session = Self {
            redrawn: redrawn.map(Box::new),
            setup,
            equity: EquityCurve::new(equity_every, room),
            feed,
            trades_mark,
            transit: Transit::new(count),
            agenda,
            direct: latencies.feed.is_none() && stale == 0.0 && !late,
            can_be_quiet: false,
            can_be_plain: false,
            clocks: Clocks::new(latencies, stale, seed),
            timetable,
            known,
            daily: vec![if asks_recent { Daily::with_recent() } else { Daily::default() }; count],
            blotter: Blotter { conceding: venue.conceding.clone(), ..Blotter::default() },
            venue,
            data_of,
            sent: ById::default(),
            mail: Mail::new(conceding),
            outcomes: Vec::new(),
            terms: Vec::new(),
            expected: vec![None; count],
            ledger,
            keeping: keeping.map(Box::new),
            carry: Carry::new(count),
            orders: Orders::default(),
            held: Held::default(),
            rows: 0,
        };
        session.can_be_quiet = session.may_be_quiet();
        session.can_be_plain = session.may_be_plain();
        session
    }

    /// The same, but that next to no equity curve is kept: for runs of which the orders alone are looked at.
    pub(super) fn without_equity(mut self) -> Self {
        self.equity = EquityCurve::new(Some(i64::MAX), None);
        self
    }

    /// Rows of data read, and rows in all, where all are in memory.
    #[must_use]
    pub fn progress(&self) -> (usize, Option<usize>) {
        (self.rows, self.feed.rows())
    }

    /// Events the strategy has seen.
    #[must_use]
    pub fn events(&self) -> usize {
        self.held.events
    }

    /// When the next row of data happens or is shown; none when the data have ended.
    pub(super) fn next_time(&self) -> Option<Timestamp> {
        self.feed.peek().into_iter().chain(self.transit.peek()).min()
    }

    /// A second run that goes on from here by itself, with a [copy](Strategy::copied) of the strategy; none where data are
    /// streamed, which give their rows once.
    #[must_use]
    pub fn fork(&self) -> Option<Self> {
        Some(Self {
            setup: Arc::clone(&self.setup),
            feed: self.feed.forked()?,
            transit: self.transit.clone(),
            trades_mark: self.trades_mark.clone(),
            direct: self.direct,
            can_be_quiet: self.can_be_quiet,
            can_be_plain: self.can_be_plain,
            agenda: self.agenda.clone(),
            clocks: self.clocks.clone(),
            timetable: self.timetable.clone(),
            known: self.known.clone(),
            daily: self.daily.clone(),
            venue: self.venue.clone(),
            data_of: self.data_of.clone(),
            sent: self.sent.clone(),
            mail: self.mail.clone(),
            outcomes: self.outcomes.clone(),
            terms: self.terms.clone(),
            expected: self.expected.clone(),
            ledger: self.ledger.clone(),
            carry: self.carry.clone(),
            orders: self.orders.clone(),
            blotter: self.blotter.clone(),
            equity: self.equity.clone(),
            held: self.held,
            rows: self.rows,
            keeping: self.keeping.clone(),
            redrawn: self.redrawn.clone(),
        })
    }

    /// Lets the next event happen that the strategy sees, after all that happens before it; none when the data have ended.
    ///
    /// What becomes of orders at the very time of an event is not seen by it: what is decided at an instant rests on the data of
    /// that instant, not on what becomes of orders at it.
    ///
    /// # Errors
    /// As [`Backtest::run`].
    pub fn step(&mut self, strategy: &mut dyn Strategy) -> Result<Option<Event>, BacktestError> {
        self.step_until(Timestamp::MAX, strategy)
    }

    /// The same, but for what happens after `until`.
    #[inline(always)]
    fn step_until(&mut self, until: Timestamp, strategy: &mut dyn Strategy) -> Result<Option<Event>, BacktestError> {
        loop {
            let (data, shown) = (self.feed.peek(), self.transit.peek());
            let next = match (data, shown) {
                (Some(data), Some(shown)) => data.min(shown),
                (Some(next), None) | (None, Some(next)) => next,
                (None, None) => return Ok(None),
            };
            if until < Timestamp::MAX && self.agenda.peek().map_or(next, |(at, _)| at.min(next)) > until {
                return Ok(None);
            }
            if self.agenda.peek().is_some_and(|due| due < (next, Phase::Data) && !self.a_bar_ends_first(due)) {
                if let Some(event) = self.act(Some(strategy))? {
                    return Ok(Some(event));
                }
                continue;
            }
            if data == Some(next) {
                let Some(arrival) = self.feed.next() else { return Ok(None) };
                self.rows += arrival.end - arrival.row;
                if self.feed.is_low() {
                    self.read_on(&arrival)?;
                }
                self.happen(&arrival)?;
                if self.direct && arrival.known_at <= next {
                    return self.show(&arrival, strategy).map(Some);
                }
                self.transit.put(self.clocks.shown(arrival.known_at), arrival);
            } else if let Some((at, arrival)) = self.transit.pop() {
                return self
                    .show_late(&Arrival { event: Event { time: at, ..arrival.event }, ..arrival }, strategy)
                    .map(Some);
            }
        }
    }

    /// Ends it: what is due by the last event happens, what is under way is booked, and what met no market stays unfilled.
    ///
    /// # Errors
    /// As [`Backtest::run`].
    pub fn finish(mut self) -> Result<Record, BacktestError> {
        let end = self.equity.end().unwrap_or(Timestamp::MIN);
        let fills = self.blotter.fills.len();
        let before = self.ledger.balances().to_vec();
        while self.agenda.peek().is_some_and(|(at, _)| at <= end) || !self.mail.is_empty() {
            let Some((at, due)) = self.agenda.pop() else { break };
            match due {
                Due::Notice(place) => drop(self.note(place)?),
                due if at <= end => self.at_venue(at, due)?,
                _ => {}
            }
        }
        self.charge_all(end)?;
        if self.blotter.fills.len() > fills || self.ledger.balances() != before {
            let equity = self.ledger.equity().map_err(|error| self.amount("the end".into(), error))?;
            self.equity.push(end, equity.to_f64());
        }
        self.held.ambiguous_bars = self.venue.floors.iter().map(|floor| floor.ambiguous_bars()).sum();
        self.held.mean_equity = self.equity.mean();
        let data = self.feed.lines().iter().map(DataSeen::of).collect();
        let (outside, halts) = (self.timetable.outside(), self.timetable.halts_seen());
        let account = self.keeping.map(|keeping| keeping.record).unwrap_or_default();
        Ok(Record {
            blotter: self.blotter,
            equity: self.equity.finish(),
            ledger: self.ledger,
            held: self.held,
            data,
            outside,
            halts,
            account,
        })
    }

    /// Reads on in the data of which `arrival` came last; what is on its way to the strategy stays at hand, and the row before.
    #[cold]
    fn read_on(&mut self, arrival: &Arrival) -> Result<(), BacktestError> {
        let oldest = self.transit.oldest(&arrival.event).map_or(arrival.row, |row| row.min(arrival.row));
        self.feed.read_on(oldest.saturating_sub(1)).map_err(|error| BacktestError::Data(Box::new(error)))
    }

    /// What is due next happens: the event it makes for the strategy, if it asked to be woken. Apart from the loop, which turns
    /// faster without what few events need.
    #[inline(never)]
    fn act(&mut self, strategy: Option<&mut dyn Strategy>) -> Result<Option<Event>, BacktestError> {
        let Some((at, due)) = self.agenda.pop() else { return Ok(None) };
        if self.keeping.is_some() {
            self.look_up_rates(at);
        }
        match due {
            Due::Notice(place) => self.deliver(place, at, strategy).map(|()| None),
            Due::Action(number) => self.take_action(number, at, strategy).map(|()| None),
            Due::Wake => {
                let event = Event { time: at, instrument: 0, kind: EventKind::Timer };
                match strategy {
                    Some(strategy) => self.decide(event, strategy).map(Some),
                    None => Ok(None),
                }
            }
            due => self.at_venue(at, due).map(|()| None),
        }
    }
}
