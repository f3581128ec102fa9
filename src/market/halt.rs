//! Halts: times within a session in which an instrument does not trade.
//!
//! - **Orders**: nothing is filled, and nothing is set off. Orders may be taken back and changed; new ones wait, or are refused
//!   ([`WhileHalted`]); those that cannot wait are refused in any case. Orders for a close that comes in a halt end unfilled.
//! - **When trading goes on**, orders that waited meet the first price that is shown from then on, as at an opening, and join the
//!   queues anew: what was displayed before and during the halt is no price of the market after it, but for a book, of which
//!   the data say how it changes. The auction in which trading goes on is in no feed.
//! - **Bars** that begin in a halt are met by nobody. Of one that ends in a halt, what is filled in it was filled before that began,
//!   and is known when the bar is.
//! - **What is known**: a halt is known when it begins; when it ends is not, till it has. Strategies see data of halts as any.
//!
//! Source: the pauses of limit up, limit down (National Market System Plan, 2012) and of single stocks for news (Nasdaq rule 4120,
//! NYSE rule 123D).

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::sim2real::Timestamp;

use super::hours::Timetable;
use super::session::Session;
use super::{Arrival, BacktestError, Bar, EventKind, Instrument, Reason, Record};

/// A time in which an instrument does not trade.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Halt {
    /// Number of the instrument.
    pub instrument: usize,
    /// The first instant at which it does not trade.
    pub from: Timestamp,
    /// The first instant after it at which it trades.
    pub to: Timestamp,
    /// Why, where that is known.
    pub reason: Option<String>,
}

/// What becomes of orders that come in a halt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WhileHalted {
    /// They wait for trading to go on.
    #[default]
    Rest,
    /// They are refused.
    Refuse,
}

/// A halt that is under way, as far as it is known then.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnderHalt<'a> {
    /// When it began.
    pub since: Timestamp,
    /// Why, where that is known.
    pub reason: Option<&'a str>,
}

/// What a run saw of a halt.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HaltSeen {
    /// The halt.
    pub halt: Halt,
    /// Rows of data of its time; of bars, those that begin in it.
    pub rows: usize,
}

/// A halt in `run.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct HaltSummary {
    /// Symbol of the instrument.
    pub symbol: String,
    /// The first instant at which it does not trade.
    pub from: Timestamp,
    /// The first instant after it at which it trades.
    pub to: Timestamp,
    /// Why, where that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Rows of data of its time; of bars, those that begin in it.
    pub rows: usize,
    /// Orders that came in it.
    pub orders: usize,
    /// Those of them that were refused.
    pub refused: usize,
}

impl HaltSummary {
    /// The halts of `record`, in the order in which the run names them.
    #[must_use]
    pub fn of(record: &Record, instruments: &[Instrument]) -> Vec<Self> {
        let one = |seen: &HaltSeen| {
            let Halt { instrument, from, to, ref reason } = seen.halt;
            let came = || {
                let within = from..to;
                let orders = record.blotter.orders.iter().filter(move |order| order.instrument == instrument);
                orders.filter(move |order| within.contains(&order.arrives_at))
            };
            Self {
                symbol: instruments.get(instrument).map(|i| i.symbol.clone()).unwrap_or_default(),
                from,
                to,
                reason: reason.clone(),
                rows: seen.rows,
                orders: came().count(),
                refused: came().filter(|order| order.reason == Some(Reason::Halted)).count(),
            }
        };
        record.halts.iter().map(one).collect()
    }
}

/// Holds `halts` to what they can be: of instruments there are, with an end after the beginning, one at a time.
///
/// # Errors
/// The first halt that is not.
pub(super) fn check_halts(halts: &[Halt], instruments: &[Instrument]) -> Result<(), BacktestError> {
    for (number, halt) in halts.iter().enumerate() {
        let symbol = instruments.get(halt.instrument).map(|instrument| instrument.symbol.clone());
        let refuse = |what: String, hint: &'static str| {
            let symbol = symbol.clone().unwrap_or_else(|| format!("instrument {}", halt.instrument));
            Err(BacktestError::Halt { number, symbol, from: halt.from, what, hint })
        };
        if symbol.is_none() {
            return refuse("there is no such instrument".into(), "halts name instruments by their places");
        }
        if halt.from >= halt.to {
            return refuse(format!("it ends at {}, which is no later", halt.to), "swap or correct `from` and `to`");
        }
        let others = halts[..number].iter().filter(|other| other.instrument == halt.instrument);
        if let Some(other) = others.into_iter().find(|other| other.from < halt.to && halt.from < other.to) {
            let what = format!("there is one from {} to {} already", other.from, other.to);
            return refuse(what, "write halts that overlap as one, with the first beginning and the last end");
        }
    }
    Ok(())
}

/// The halts of one instrument.
#[derive(Debug, Clone, Default)]
pub(super) struct Halts {
    /// In order of time, each with its number in the run.
    all: Vec<(usize, Arc<Halt>)>,
    /// Rows of the time of each.
    rows: Vec<usize>,
}

impl Halts {
    /// The halts of each of `count` instruments; nothing at all where there are none.
    pub fn of(halts: &[Halt], count: usize) -> Vec<Self> {
        let mut each = vec![Self::default(); if halts.is_empty() { 0 } else { count }];
        for (number, halt) in halts.iter().enumerate() {
            if let Some(own) = each.get_mut(halt.instrument) {
                own.all.push((number, Arc::new(halt.clone())));
                own.rows.push(0);
            }
        }
        each.iter_mut().for_each(|own| own.all.sort_by_key(|(_, halt)| halt.from));
        each
    }

    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// The place of the halt that is under way at `time`.
    fn at(&self, time: Timestamp) -> Option<usize> {
        let begun = self.all.partition_point(|(_, halt)| halt.from <= time);
        begun.checked_sub(1).filter(|last| time < self.all[*last].1.to)
    }

    /// The halt that is under way at `time`, as far as it is known then.
    pub fn under_way(&self, time: Timestamp) -> Option<UnderHalt<'_>> {
        let (_, halt) = &self.all[self.at(time)?];
        Some(UnderHalt { since: halt.from, reason: halt.reason.as_deref() })
    }

    /// `bar` as far as there was trading in it; none where it begins in a halt.
    fn traded(&self, bar: Bar) -> Option<Bar> {
        if self.at(bar.open_at).is_some() {
            return None;
        }
        // Up to the very end of a halt there was nothing: what traded in the bar did so before.
        let begun = self.all.partition_point(|(_, halt)| halt.from < bar.known_at);
        let last = begun.checked_sub(1).map(|last| &self.all[last].1).filter(|halt| bar.known_at <= halt.to);
        Some(Bar { known_at: last.map_or(bar.known_at, |halt| halt.from), ..bar })
    }

    fn seen(&self) -> impl Iterator<Item = (usize, HaltSeen)> {
        self.all
            .iter()
            .zip(&self.rows)
            .map(|((number, halt), rows)| (*number, HaltSeen { halt: (**halt).clone(), rows: *rows }))
    }
}

impl Timetable {
    /// What a run saw of its halts, in the order in which it names them.
    pub fn halts_seen(&self) -> Vec<HaltSeen> {
        let mut all: Vec<(usize, HaltSeen)> = self.halts().iter().flat_map(Halts::seen).collect();
        all.sort_by_key(|(number, _)| *number);
        all.into_iter().map(|(_, seen)| seen).collect()
    }

    /// Whether an instrument is halted at `time`.
    pub fn is_halted(&self, instrument: usize, time: Timestamp) -> bool {
        self.halts().get(instrument).is_some_and(|halts| halts.at(time).is_some())
    }

    /// `bar` of an instrument as far as there was trading in it; none where it begins in a halt.
    pub fn traded(&self, instrument: usize, bar: Bar) -> Option<Bar> {
        match self.halts().get(instrument) {
            Some(halts) => halts.traded(bar),
            None => Some(bar),
        }
    }
}

impl Session {
    /// Trading of an instrument stops or goes on, as its halts have it at `now`.
    pub(super) fn keep_halts(&mut self, instrument: usize, now: Timestamp) {
        let Some(halts) = self.timetable.halts().get(instrument).filter(|halts| !halts.is_empty()) else { return };
        let floor = &mut self.venue.floors[instrument];
        if halts.at(now).is_some() { floor.halt() } else { floor.resume() }
    }

    /// Counts data of halts.
    pub(super) fn count_halted(&mut self, arrival: &Arrival) {
        let super::Event { time, instrument, kind } = arrival.event;
        let bar = if kind == EventKind::Bar { self.feed.line(instrument).bar(arrival.row) } else { None };
        let at = bar.map_or(time, |bar| bar.open_at);
        if let Some(halts) = self.timetable.halts_mut(instrument)
            && let Some(place) = halts.at(at)
        {
            halts.rows[place] += arrival.end - arrival.row;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Price;

    fn halt(from: i64, to: i64) -> Halt {
        Halt { instrument: 0, from: Timestamp(from), to: Timestamp(to), reason: None }
    }

    #[test]
    fn a_halt_holds_from_its_beginning_to_before_its_end() {
        let all = [halt(30, 40), halt(10, 20)];
        let halts = Halts::of(&all, 1).remove(0);
        let since = |time| halts.under_way(Timestamp(time)).map(|halt| halt.since.0);
        assert_eq!(
            [9, 10, 19, 20, 29, 30, 39, 40].map(since),
            [None, Some(10), Some(10), None, None, Some(30), Some(30), None]
        );
    }

    #[test]
    fn of_a_bar_there_is_what_was_traded() {
        let all = [halt(10, 20)];
        let halts = Halts::of(&all, 1).remove(0);
        let traded = |open: i64, known: i64| {
            let (open_at, known_at) = (Timestamp(open), Timestamp(known));
            let price = Price(1);
            let bar = Bar { open_at, known_at, open: price, high: price, low: price, close: price, volume: 1.0 };
            halts.traded(bar).map(|bar| bar.known_at.0)
        };
        assert_eq!(traded(0, 10), Some(10));
        assert_eq!([traded(5, 15), traded(5, 20), traded(5, 25)], [Some(10), Some(10), Some(25)]);
        assert_eq!([traded(10, 30), traded(19, 30), traded(20, 30)], [None, None, Some(30)]);
    }
}
