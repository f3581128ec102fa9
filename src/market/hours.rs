//! Hours of trading: when the orders of an instrument meet its market, by its calendar.
//!
//! Rows from outside sessions are seen by strategies, and counted; no order meets them. A **day** is what a calendar gives one
//! date: from its first open to its last close.
//!
//! - **Bars** belong to the session they begin in, or else to the sessions they cover whole, as a bar of a day does. Their open
//!   is then no earlier than that of the session, and what is filled in them no later than its close. A bar that begins
//!   before an open and ends within the session mixes two markets: it is outside.
//! - **The last bar** of a day is the one that ends at its close or later. Where there is none, orders for the close end
//!   unfilled: whether nothing was traded or rows are missing, nobody can tell.
//! - **Day orders** end with the close of the day in which they arrive, or of the next one where the market is closed.
//!
//! A calendar knows closings that were announced late from the beginning, as that of September 2001: an order for the next
//! day then waits for the day there was.

use std::sync::Arc;

use chrono::NaiveDate;

use crate::sim2real::Timestamp;

use super::agenda::{Due, Phase};
use super::calendar::{Calendar, Hours, Trading};
use super::halt::{Halt, Halts};
use super::session::Session;
use super::{Arrival, Bar, EventKind, OrderId, TimeInForce};

/// Length of a day of UTC [ns].
const DAY: i64 = 86_400 * Timestamp::NANOS;

/// The hours of one instrument, and where a run is in them.
#[derive(Debug, Clone)]
pub(super) struct TradingHours {
    trading: Trading,
    /// The day that was asked for last.
    day: Option<Hours>,
    /// The session in which something happened last.
    session: Option<Hours>,
    /// The date of the last bar that belongs to a session.
    last_bar_of: Option<NaiveDate>,
    /// The close that is on the agenda.
    close_due: Option<Timestamp>,
    /// Rows from outside sessions.
    outside: usize,
}

/// A bar as orders meet it, and the day it belongs to.
struct InSession {
    bar: Bar,
    day: Hours,
}

impl TradingHours {
    fn new(calendar: &Arc<Calendar>) -> Self {
        let trading = Trading::new(Arc::clone(calendar));
        Self { trading, day: None, session: None, last_bar_of: None, close_due: None, outside: 0 }
    }

    /// The session at `time`, for a strategy.
    pub fn session_at(&self, time: Timestamp) -> Option<Hours> {
        self.trading.seen_at(time)
    }

    pub fn calendar(&self) -> &Calendar {
        self.trading.calendar()
    }

    fn day_of(&mut self, session: Hours) -> Hours {
        match self.day.filter(|day| day.date == session.date) {
            Some(day) => day,
            None => *self.day.insert(self.calendar().day(session.date).unwrap_or(session)),
        }
    }

    /// The day in which what arrives at `time` works: the next one where the market is closed for the day.
    fn day_at(&mut self, time: Timestamp) -> Option<Hours> {
        let session = self.trading.session_at(time).or_else(|| self.trading.next_session(time))?;
        Some(self.day_of(session))
    }

    /// The part of a bar in which orders meet it; none where it is outside sessions.
    fn within(&mut self, bar: &Bar) -> Option<InSession> {
        let session = match self.trading.session_at(bar.open_at) {
            Some(session) => session,
            None => self.trading.next_session(bar.open_at).filter(|next| next.close <= bar.known_at)?,
        };
        let known_at = if bar.known_at <= session.close {
            bar.known_at
        } else {
            // Of a bar of several sessions that is the last one that is over.
            self.trading.previous_close(bar.known_at).map_or(session.close, |close| close.max(session.close))
        };
        let bar = Bar { open_at: bar.open_at.max(session.open), known_at, ..*bar };
        Some(InSession { bar, day: self.day_of(session) })
    }
}

/// The hours of all instruments.
#[derive(Debug, Clone, Default)]
pub(super) struct Timetable {
    /// Of each instrument; nothing at all where none has a calendar.
    each: Vec<Option<TradingHours>>,
    /// Of each instrument; nothing at all where none is ever halted.
    halts: Vec<Halts>,
    /// The end of the last bar that outlasted its session: what became of orders in it is known no earlier.
    pub known_from: Timestamp,
}

impl Timetable {
    /// Of `count` instruments, with the calendars of the first of them, and their halts.
    pub fn new<'c>(calendars: impl Iterator<Item = Option<&'c Arc<Calendar>>>, halts: &[Halt], count: usize) -> Self {
        let mut each: Vec<_> = calendars.map(|calendar| calendar.map(TradingHours::new)).collect();
        if each.iter().any(Option::is_some) {
            each.resize(count, None);
        } else {
            each.clear();
        }
        Self { each, halts: Halts::of(halts, count), known_from: Timestamp::MIN }
    }

    /// Whether all instruments trade whenever there are data.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.each.is_empty() && self.halts.is_empty()
    }

    /// The halts of each instrument; nothing at all where there are none.
    pub fn halts(&self) -> &[Halts] {
        &self.halts
    }

    /// Those of one.
    pub fn halts_mut(&mut self, instrument: usize) -> Option<&mut Halts> {
        self.halts.get_mut(instrument)
    }

    /// Whether anything says when an instrument does not trade.
    pub fn keeps(&self, instrument: usize) -> bool {
        self.each.get(instrument).is_some_and(Option::is_some)
            || self.halts.get(instrument).is_some_and(|halts| !halts.is_empty())
    }

    /// Of each instrument.
    pub fn each(&self) -> &[Option<TradingHours>] {
        &self.each
    }

    /// Of an instrument, where it has a calendar.
    #[inline]
    pub fn of(&mut self, instrument: usize) -> Option<&mut TradingHours> {
        self.each.get_mut(instrument)?.as_mut()
    }

    /// Rows from outside sessions, of each instrument that has a calendar.
    pub fn outside(&self) -> Vec<Option<usize>> {
        self.each.iter().map(|hours| hours.as_ref().map(|hours| hours.outside)).collect()
    }
}

impl Session {
    /// The doors of an instrument's floor are opened or closed, as its calendar and its halts have it at `now`.
    pub(super) fn keep_hours(&mut self, instrument: usize, now: Timestamp) {
        self.keep_halts(instrument, now);
        let Some(hours) = self.timetable.of(instrument) else { return };
        let floor = &mut self.venue.floors[instrument];
        match hours.trading.session_at(now) {
            None => floor.close_doors(),
            Some(session) if hours.session.is_some_and(|before| before.open == session.open) => {}
            Some(session) => {
                let goes_on = hours.session.is_some_and(|before| before.close == session.open);
                hours.session = Some(session);
                let first_of_day = hours.day_of(session).open == session.open;
                if goes_on { floor.go_on(first_of_day) } else { floor.open_doors(first_of_day) }
            }
        }
    }

    /// The same for data: those from outside sessions and from halts are counted.
    pub(super) fn keep_hours_of(&mut self, arrival: &Arrival) {
        let super::Event { time, instrument, kind } = arrival.event;
        self.count_halted(arrival);
        let Some(hours) = self.timetable.of(instrument) else { return self.keep_halts(instrument, time) };
        if kind == EventKind::Bar {
            let Some(bar) = self.feed.line(instrument).bar(arrival.row) else { return };
            match hours.within(bar) {
                Some(met) => hours.last_bar_of = Some(met.day.date),
                None => hours.outside += 1,
            }
        } else if !hours.trading.is_open(time) {
            hours.outside += arrival.end - arrival.row;
        }
        self.keep_hours(instrument, time);
    }

    /// A bar is over: the orders that may meet it do.
    pub(super) fn meet_bar(&mut self, instrument: usize, row: usize) {
        let line = self.feed.line(instrument);
        let Some(bar) = line.bar(row).copied() else { return };
        let met = match self.timetable.of(instrument) {
            None => {
                let last = ends_day(line.bar(row + 1).map(|next| next.open_at), bar.open_at);
                Some((bar, last.then_some(bar.open_at)))
            }
            // The close is the last price of all: whoever is there before it takes part.
            Some(hours) => hours.within(&bar).map(|InSession { bar, day }| {
                let last = bar.known_at >= day.close;
                (bar, last.then_some(Timestamp(bar.known_at.0.saturating_sub(1))))
            }),
        };
        let Some((met, closes_for)) = met else { return };
        let Some(met) = self.timetable.traded(instrument, met) else { return };
        if met.known_at < bar.known_at {
            self.timetable.known_from = self.timetable.known_from.max(bar.known_at);
        }
        let floor = &mut self.venue.floors[instrument];
        floor.at_row(0, row);
        floor.on_bar(&met, closes_for);
    }

    /// When orders meet the open of `bar`, if they do.
    pub(super) fn opens_at(&mut self, instrument: usize, bar: &Bar) -> Option<Timestamp> {
        let opens_at = match self.timetable.of(instrument) {
            None => bar.open_at,
            Some(hours) => hours.within(bar)?.bar.open_at,
        };
        (!self.timetable.is_halted(instrument, opens_at)).then_some(opens_at)
    }

    /// The bar at `row` as orders meet its open, and whether it is the first of a day.
    pub(super) fn opening_bar(&mut self, instrument: usize, row: usize) -> Option<(Bar, bool)> {
        let line = self.feed.line(instrument);
        let bar = *line.bar(row)?;
        match self.timetable.of(instrument) {
            None => {
                let before = row.checked_sub(1).and_then(|k| line.bar(k)).map_or(Timestamp::MIN, |before| before.open_at);
                Some((bar, ends_day(Some(bar.open_at), before)))
            }
            Some(hours) => {
                let InSession { bar, day } = hours.within(&bar)?;
                Some((bar, hours.last_bar_of != Some(day.date)))
            }
        }
    }

    /// When the day ends in which an order works that arrives at `time`; none where the market never opens again.
    pub(super) fn day_ends(&mut self, instrument: usize, time: Timestamp) -> Option<Timestamp> {
        match self.timetable.of(instrument) {
            None => Some(Timestamp((time.0.div_euclid(DAY) + 1).saturating_mul(DAY))),
            Some(hours) => hours.day_at(time).map(|day| day.close),
        }
    }

    /// Puts the close of the day on the agenda, where an order waits for it.
    pub(super) fn expect_close(&mut self, instrument: usize, now: Timestamp) {
        let Some(hours) = self.timetable.of(instrument) else { return };
        if !self.venue.floors[instrument].awaits_close() {
            return;
        }
        let Some(close) = hours.day_at(now).map(|day| day.close) else { return };
        if hours.close_due != Some(close) {
            hours.close_due = Some(close);
            self.agenda.put(close, Phase::Closes, Due::Close(instrument));
        }
    }

    /// The day of an instrument closes.
    pub(super) fn close_day(&mut self, instrument: usize, at: Timestamp) {
        // The close of the bar that is under way is that of the day.
        if self.venue.floors[instrument].by_bars() && self.outlasting(instrument, at).is_some() {
            return;
        }
        self.keep_halts(instrument, at);
        let Some(hours) = self.timetable.of(instrument) else { return };
        let traded = hours.session.is_some_and(|session| session.close == at);
        self.venue.floors[instrument].close_at(at, traded);
    }

    /// Till when a day order works on after `at`, when its day closes: to the end of the bar that is under way then, which may
    /// still fill it within the day.
    pub(super) fn works_till(&mut self, id: OrderId, at: Timestamp) -> Option<Timestamp> {
        if self.timetable.is_empty() {
            return None;
        }
        let order = self.blotter.order(id.0).filter(|order| order.time_in_force == TimeInForce::Day)?;
        let instrument = order.instrument;
        if self.venue.floors[instrument].by_bars() { self.outlasting(instrument, at) } else { None }
    }

    /// The end of the bar that is under way at `close`, when its day closes.
    fn outlasting(&mut self, instrument: usize, close: Timestamp) -> Option<Timestamp> {
        let row = self.next_bar(instrument)?;
        let bar = *self.feed.line(instrument).bar(row)?;
        let met = self.timetable.of(instrument)?.within(&bar)?;
        (met.day.close == close && met.bar.open_at < close).then_some(bar.known_at)
    }
}

/// Whether `next`, if anything, comes on another day of UTC than `this`.
fn ends_day(next: Option<Timestamp>, this: Timestamp) -> bool {
    next.is_none_or(|next| next.0.div_euclid(DAY) != this.0.div_euclid(DAY))
}
