//! Orders out of order-by-order data: who came and met the other side, and which executions were theirs.

use std::collections::{BTreeMap, HashMap, VecDeque};

use crate::market::{Departure, OrderAction, OrderStep, Price, Print, Quantity, Side};
use crate::sim2real::Timestamp;

use super::book::{TapeBook, exact_size};
use super::found::{LeftOut, TapeCounts, TapeFill, TapeOrder, TapeOrderKind, TapeSink};

/// How long the two halves of an execution may lie apart, and what is told of an order after it is gone [ns].
const WINDOW: i64 = Timestamp::NANOS;

/// How long an order may meet the other side without an execution, before what it meets counts as gone [ns]. The package
/// ob-analytics (P. Stubbings) pairs executions within the same five seconds.
const PATIENCE: i64 = 5 * Timestamp::NANOS;

/// By how much the two halves of one execution may differ [units of 1e-9]: sizes of 1e-8 that the exchange has rounded twice.
const ROUNDING: i64 = 20;

/// An order that is in the book, or about to take from it.
#[derive(Debug, Clone, Copy)]
struct Live {
    side: Side,
    price: Price,
    size: Quantity,
    /// Number of its arrival, which counts anew where its price changes.
    arrival: u64,
    /// Whether it is displayed: one that meets the other side is not, until what is left of it rests.
    shown: bool,
}

/// An order that met the other side when it came.
#[derive(Debug, Clone)]
struct Taker {
    id: u64,
    arrival: u64,
    side: Side,
    limit: Price,
    quantity: Quantity,
    came_at: Timestamp,
    last_at: Timestamp,
    touch: Option<[Price; 2]>,
    fills: Vec<TapeFill>,
    /// When it left, or rested.
    done_at: Option<Timestamp>,
    /// Whether one of its executions has no other half.
    incomplete: bool,
}

/// One half of an execution: an order that became less.
#[derive(Debug, Clone, Copy)]
struct Half {
    at: Timestamp,
    arrival: u64,
    /// The last arrival before it was told.
    after: u64,
    side: Side,
    price: Price,
    amount: Quantity,
    told: Told,
}

/// How it is told that an order became less.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Told {
    /// It left, and was filled.
    Filled,
    /// It stays with less: an execution, or its owner has made it smaller.
    Smaller,
    /// It left, and nobody says how.
    Gone,
}

/// Reads order-by-order events in the order in which they became known.
///
/// An execution is told twice: the resting order becomes less, and so does the one that took, by the same amount, within a
/// second. The later of the two took; the price is the earlier one's. An order that meets the other side when it comes is not
/// displayed until it has taken what it can: the book is the one that others left.
#[derive(Debug, Default)]
pub(super) struct ByOrder {
    book: TapeBook,
    levels: usize,
    live: HashMap<u64, Live>,
    takers: VecDeque<Taker>,
    halves: VecDeque<Half>,
    /// Trades that are held back, since the first half of one may be told after a later one.
    prints: BTreeMap<(Timestamp, u64), Print>,
    arrivals: u64,
    now: Option<Timestamp>,
    changed: bool,
}

impl ByOrder {
    pub(super) fn new(levels: usize) -> Self {
        Self { levels, ..Self::default() }
    }

    /// Takes in an event.
    pub(super) fn step<S: TapeSink>(
        &mut self,
        step: OrderStep,
        counts: &mut TapeCounts,
        sink: &mut S,
    ) -> Result<(), S::Error> {
        let (event, at) = (step.event, step.event.known_at);
        if self.now.is_none_or(|now| at > now) {
            self.end_of_instant(counts, sink)?;
            self.now = Some(at);
            self.expire(at, counts, sink)?;
        }
        let size = exact_size(event.size);
        match (event.action, self.live.get(&event.id).copied()) {
            (OrderAction::Change, Some(live)) if live.price != event.price => {
                self.leave(event.id, at);
                self.arrive(event.id, (event.side, event.price, size), at);
            }
            (OrderAction::Change, Some(live)) if size < live.size => {
                self.lessen(event.id, live, Quantity(live.size.0 - size.0), (at, Told::Smaller), counts);
            }
            (OrderAction::Change, Some(live)) => {
                if live.shown {
                    self.book.add(live.side, live.price, Quantity(size.0 - live.size.0));
                    self.changed = true;
                }
                self.live.insert(event.id, Live { size, ..live });
            }
            (OrderAction::Delete, Some(live)) => {
                if step.departure != Some(Departure::Withdrawn) {
                    let told = if step.departure.is_some() { Told::Filled } else { Told::Gone };
                    self.lessen(event.id, live, live.size, (at, told), counts);
                }
                self.leave(event.id, at);
            }
            (OrderAction::Add | OrderAction::Change, _) => {
                self.leave(event.id, at);
                self.arrive(event.id, (event.side, event.price, size), at);
            }
            (OrderAction::Delete, None) => {}
        }
        self.rest_what_meets_nothing(at);
        Ok(())
    }

    /// Gives out what is left.
    pub(super) fn finish<S: TapeSink>(&mut self, counts: &mut TapeCounts, sink: &mut S) -> Result<(), S::Error> {
        self.end_of_instant(counts, sink)?;
        if let Some(now) = self.now {
            self.takers.iter_mut().for_each(|taker| taker.done_at = taker.done_at.or(Some(now)));
            self.expire(Timestamp(now.0.saturating_add(2 * WINDOW + 1)), counts, sink)?;
        }
        Ok(())
    }

    fn arrive(&mut self, id: u64, (side, price, size): (Side, Price, Quantity), at: Timestamp) {
        self.arrivals += 1;
        let arrival = self.arrivals;
        let meets = self.book.is_met_by(side, price);
        if meets {
            let touch = self.book.touch();
            self.takers.push_back(Taker {
                id,
                arrival,
                side,
                limit: price,
                quantity: size,
                came_at: at,
                last_at: at,
                touch,
                fills: Vec::new(),
                done_at: None,
                incomplete: false,
            });
        } else {
            self.book.add(side, price, size);
            self.changed = true;
        }
        self.live.insert(id, Live { side, price, size, arrival, shown: !meets });
    }

    /// Takes an order out, with what is left of it.
    fn leave(&mut self, id: u64, at: Timestamp) {
        let Some(live) = self.live.remove(&id) else { return };
        if live.shown {
            self.book.add(live.side, live.price, Quantity(-live.size.0));
            self.changed = true;
        }
        if let Some(taker) = taker(&mut self.takers, live.arrival) {
            taker.done_at = taker.done_at.or(Some(at));
        }
    }

    /// An order becomes less: one half of an execution, whose other half may have been told already.
    fn lessen(&mut self, id: u64, live: Live, amount: Quantity, (at, told): (Timestamp, Told), counts: &mut TapeCounts) {
        if live.shown {
            self.book.add(live.side, live.price, Quantity(-amount.0));
            self.changed = true;
        }
        self.live.insert(id, Live { size: Quantity(live.size.0 - amount.0), ..live });
        // What exact numbers do not tell from nothing was not executed.
        if amount <= Quantity::ZERO {
            return;
        }
        let half =
            Half { at, arrival: live.arrival, after: self.arrivals, side: live.side, price: live.price, amount, told };
        let other = self.halves.iter().rposition(|other| are_one(other, &half));
        match other.and_then(|place| self.halves.remove(place)) {
            Some(other) => self.execute(other, half, counts),
            None => self.halves.push_back(half),
        }
    }

    fn execute(&mut self, first: Half, second: Half, counts: &mut TapeCounts) {
        let (maker, took) = if first.arrival < second.arrival { (first, second) } else { (second, first) };
        let print =
            Print { time: first.at, price: maker.price.to_f64(), size: took.amount.to_f64(), aggressor: Some(took.side) };
        self.arrivals += 1;
        self.prints.insert((first.at, self.arrivals), print);
        match taker(&mut self.takers, took.arrival) {
            Some(taker) => {
                taker.last_at = second.at;
                taker.fills.push(TapeFill { filled_at: first.at, quantity: took.amount, price: maker.price });
            }
            None => counts.leave(LeftOut::NotMarketable),
        }
    }

    /// Orders that have taken what there was within their limits rest with what is left.
    fn rest_what_meets_nothing(&mut self, at: Timestamp) {
        for place in 0..self.takers.len() {
            let Some(taker) = self.takers.get(place).filter(|taker| taker.done_at.is_none()) else { continue };
            let half_told = |half: &Half| half.side != taker.side && taker.side.accepts(half.price, taker.limit);
            if self.book.is_met_by(taker.side, taker.limit) || self.halves.iter().any(half_told) {
                continue;
            }
            self.rest(place, at);
        }
    }

    /// The order at this place of the takers is displayed from now on.
    fn rest(&mut self, place: usize, at: Timestamp) {
        let Some(taker) = self.takers.get_mut(place) else { return };
        taker.done_at = Some(at);
        if let Some(live) = self.live.get_mut(&taker.id).filter(|live| live.arrival == taker.arrival) {
            live.shown = true;
            self.book.add(live.side, live.price, live.size);
            self.changed = true;
        }
    }

    /// What is settled by now: halves without another, orders in wait of nothing, and orders that are done.
    fn expire<S: TapeSink>(&mut self, now: Timestamp, counts: &mut TapeCounts, sink: &mut S) -> Result<(), S::Error> {
        while let Some(half) = self.halves.front().copied().filter(|half| now - half.at > WINDOW) {
            self.halves.pop_front();
            match taker(&mut self.takers, half.arrival) {
                Some(taker) => taker.incomplete |= half.told != Told::Gone,
                None if half.told == Told::Filled => counts.leave(LeftOut::UnknownTaker),
                None => {}
            }
        }
        for place in 0..self.takers.len() {
            let waits = |taker: &&Taker| taker.done_at.is_none() && now - taker.last_at > PATIENCE;
            if let Some((side, limit)) = self.takers.get(place).filter(waits).map(|taker| (taker.side, taker.limit)) {
                self.drop_ghosts(side.opposite(), limit, counts);
                self.rest(place, now);
            }
        }
        while let Some(done) = self.takers.pop_front_if(|taker| taker.done_at.is_some_and(|done_at| now - done_at > WINDOW))
        {
            give(done, counts, sink)?;
        }
        // Beyond two windows nothing earlier can come any more: one between the halves, one in which they are waited for.
        while let Some(entry) = self.prints.first_entry().filter(|entry| now - entry.key().0 > 2 * WINDOW) {
            counts.prints += 1;
            sink.print(entry.remove())?;
        }
        Ok(())
    }

    /// Resting orders of `side` that a limit has met for long: the file does not tell that they left.
    fn drop_ghosts(&mut self, side: Side, limit: Price, counts: &mut TapeCounts) {
        for live in self.live.values_mut().filter(|live| live.shown && live.side == side) {
            if side.opposite().accepts(live.price, limit) {
                live.shown = false;
                self.book.add(side, live.price, Quantity(-live.size.0));
                self.changed = true;
                counts.leave(LeftOut::Ghost);
            }
        }
    }

    fn end_of_instant<S: TapeSink>(&mut self, counts: &mut TapeCounts, sink: &mut S) -> Result<(), S::Error> {
        let Some(now) = self.now.filter(|_| std::mem::take(&mut self.changed)) else { return Ok(()) };
        counts.quotes += 1;
        sink.quote(now, &self.book.top(Side::Buy, self.levels), &self.book.top(Side::Sell, self.levels))
    }
}

/// The taker of that arrival, while it is known.
fn taker(takers: &mut VecDeque<Taker>, arrival: u64) -> Option<&mut Taker> {
    let place = takers.binary_search_by_key(&arrival, |taker| taker.arrival).ok()?;
    takers.get_mut(place)
}

/// Whether two halves are of one execution.
fn are_one(earlier: &Half, later: &Half) -> bool {
    earlier.side != later.side
        && (earlier.amount.0 - later.amount.0).abs() <= ROUNDING
        && later.side.accepts(earlier.price, later.price)
        // Nobody executes against an order that came later.
        && later.arrival <= earlier.after
        && later.at - earlier.at <= WINDOW
}

/// Gives out an order that is done, where it can be used.
fn give<S: TapeSink>(taker: Taker, counts: &mut TapeCounts, sink: &mut S) -> Result<(), S::Error> {
    let why = match (taker.fills.is_empty(), taker.incomplete, taker.touch) {
        (_, true, _) => Some(LeftOut::UnknownCounterpart),
        (true, ..) => Some(LeftOut::NotExecuted),
        (.., None) => Some(LeftOut::NoBook),
        _ => None,
    };
    let Some(touch) = taker.touch.filter(|_| why.is_none()) else {
        counts.leave(why.unwrap_or(LeftOut::NoBook));
        return Ok(());
    };
    let mut fills = taker.fills;
    fills.sort_by_key(|fill| fill.filled_at);
    let filled = fills.iter().map(|fill| fill.quantity.0).fold(0, i64::saturating_add);
    let whole = taker.quantity.0 - filled <= ROUNDING;
    let order = TapeOrder {
        id: i64::try_from(taker.id).unwrap_or(i64::MAX),
        side: taker.side,
        quantity: if whole { Quantity(filled) } else { taker.quantity },
        decided_at: taker.came_at + -1,
        kind: if whole { TapeOrderKind::Market } else { TapeOrderKind::Limit(taker.limit) },
        touch,
        fills,
    };
    counts.take(&order);
    sink.order(order)
}
