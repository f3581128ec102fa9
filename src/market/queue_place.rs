//! Places in queues, as a log and its tape tell of them: what traded at the price of a resting order before it was filled itself.

use crate::sim2real::Timestamp;

use super::censored::{Bounds, Spread};
use super::{InFlight, LoggedFill, LoggedOrder, OrderType, Print, Role, Seen, Side, Tape};

/// With fewer orders that tell of their places nothing is told of places; how sure these make it is asked besides.
const ENOUGH: usize = 8;
/// What is known to have stood ahead at the least tells something where that is no less than this part of what was displayed.
const TELLING: f64 = 0.5;
/// Places are told of where a mean of their own makes them so much likelier than none, in twice the logarithm (three standard
/// errors), and where that mean is this part of what was displayed.
const CERTAIN: f64 = 9.0;
const WORTH_TELLING: f64 = 0.05;

/// The place in its queue of an order that rested at the best price of its own side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// The order, as of when it was decided.
    pub order: InFlight,
    /// What was displayed where it joined [units].
    pub displayed: f64,
    /// What stood ahead of it beside that, as a part of it.
    pub beyond: f64,
}

/// What the places of a log tell.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) enum Places {
    /// The orders stood where they were thought to, or there are too few to ask.
    #[default]
    Silent,
    /// So many orders were filled at rest, and of no more than so many the place is known.
    Unknown {
        /// Orders filled at rest.
        filled: usize,
        /// Those whose place is known.
        known: usize,
    },
    /// Orders were filled although less had traded than was displayed, on average by this part of it: others ahead of them gave up.
    Early(f64),
    /// More stood ahead than was displayed.
    Late(Vec<Place>),
}

impl Places {
    /// Of limit orders, each with its `fills`. Stamps of fills may be too early by `rounding` [ns].
    pub fn of(orders: &[LoggedOrder], fills: &[Vec<&LoggedFill>], tape: &Tape, rounding: i64) -> Self {
        let known = orders.iter().zip(fills).filter_map(|(order, fills)| ahead(order, fills, tape, rounding));
        let known: Vec<Ahead> = known.filter(|one| one.most.is_finite() || one.least > TELLING * one.displayed).collect();
        if known.len() < ENOUGH {
            let filled = orders.iter().zip(fills).filter(|(order, fills)| rested(order) && !fills.is_empty()).count();
            return if filled < ENOUGH { Self::Silent } else { Self::Unknown { filled, known: known.len() } };
        }
        let bounds: Vec<Bounds> = known.iter().map(Ahead::beyond).collect();
        let Some((own, none)) = Spread::fit(&bounds, None).zip(Spread::fit(&bounds, Some(0.0))) else { return Self::Silent };
        let likelier = 2.0 * (own.log_likelihood - none.log_likelihood);
        if likelier < CERTAIN || own.mean.abs() < WORTH_TELLING {
            return Self::Silent;
        }
        if own.mean < 0.0 {
            return Self::Early(-own.mean);
        }
        let place = |(one, beyond): (&Ahead, f64)| Place { order: one.order, displayed: one.displayed, beyond };
        let mut places: Vec<Place> = known.iter().zip(own.values(&bounds)).map(place).collect();
        places.sort_by_key(|place| place.order.decided_at);
        Self::Late(places)
    }

    /// The places, where they tell of something that a place further back could say.
    pub fn told(&self) -> &[Place] {
        if let Self::Late(places) = self { places } else { &[] }
    }

    /// What a reader should know of them.
    pub fn note(&self) -> Option<String> {
        match self {
            Self::Silent | Self::Late(_) => None,
            Self::Unknown { filled, known } => Some(format!(
                "where orders stood in their queues is not known: of {filled} that were filled at rest {known} tell of it; to the \
                 others the market came before what was displayed ahead of them had traded, or the tape does not show what had"
            )),
            Self::Early(part) => Some(format!(
                "resting orders were filled although {:.0} % of what was displayed ahead of them had not traded: others gave up their \
                 places, which a queue model says, not a mechanism",
                100.0 * part
            )),
        }
    }
}

/// What stood ahead of an order, as far as the tape tells.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ahead {
    /// The order, as of when it was decided.
    order: InFlight,
    /// What was displayed where it joined [units].
    displayed: f64,
    /// What stood ahead of it at the least, and at the most [units]; infinite where that is not known.
    least: f64,
    most: f64,
}

impl Ahead {
    /// What stood ahead beside what was displayed, as a part of it.
    fn beyond(&self) -> Bounds {
        (self.least / self.displayed - 1.0, self.most / self.displayed - 1.0)
    }
}

fn rested(order: &LoggedOrder) -> bool {
    matches!(&order.kind, OrderType::Other(kind) if kind == "limit")
}

/// What stood ahead of `order`, which joined the best price of its own side: all that was taken there before somebody filled it.
/// Where the market left that price first, no less than was taken until then.
fn ahead(order: &LoggedOrder, fills: &[&LoggedFill], tape: &Tape, rounding: i64) -> Option<Ahead> {
    let first = fills.first().filter(|_| rested(order))?;
    let (limit, decided) = (first.price, order.decided_at);
    let book = tape.book(Seen::at(decided))?;
    let joined = book.opposite(order.side.opposite()).first().filter(|level| close(level.price, limit))?;
    let displayed = Some(joined.size).filter(|size| size.is_finite() && *size > 0.0)?;
    let filled = first.filled_at + rounding + STAMP;
    let left = left_at(tape, order.side, limit, decided, filled);
    let (before, last) = taken(tape.prints(), order.side, limit, decided, left.map_or(filled, |at| Timestamp(at.0 - 1)));
    let whole = first.quantity >= order.quantity;
    let (least, most) = match (left, whole) {
        (Some(_), _) => (before + last, f64::INFINITY),
        // It was filled, and nobody who took is known.
        (None, _) if last < first.quantity => return None,
        // Who got the rest of what somebody took stood behind all the rest of it; who was filled whole may have stood further ahead.
        (None, true) => (before, before + last - first.quantity),
        (None, false) => (before + last - first.quantity, before + last - first.quantity),
    };
    let sent = InFlight::market(order.side, order.quantity, decided, limit, book.mid()?).as_a(Role::Maker);
    Some(Ahead { order: sent, displayed, least, most })
}

/// By how much a stamp may have been rounded [ns]: the step of a 64-bit float at today's count of nanoseconds.
const STAMP: i64 = 256;

/// When the best price of an order's own side left its `limit`, or the other side came to it, if by a time: then a queue is gone.
fn left_at(tape: &Tape, side: Side, limit: f64, from: Timestamp, to: Timestamp) -> Option<Timestamp> {
    let times = tape.quotes().times();
    let (first, end) = (times.partition_point(|at| *at <= from), times.partition_point(|at| *at <= to));
    let quotes = tape.quotes().between(first, end.max(first));
    let worse = |price: f64, than: f64| side.sign() * (price - than) < 0.0 && !close(price, than);
    let gone = |k: &usize| {
        let Some(quote) = quotes.get(*k) else { return false };
        let (own, other) = match side {
            Side::Buy => (quote.bid(), quote.ask()),
            Side::Sell => (quote.ask(), quote.bid()),
        };
        own.is_none_or(|own| worse(own, limit)) || other.is_some_and(|other| !worse(limit, other))
    };
    (0..quotes.len()).find(gone).and_then(|k| quotes.times().get(k).copied())
}

/// What was taken at `limit` from an order's side: before the last time, and then [units].
fn taken(prints: &[Print], side: Side, limit: f64, from: Timestamp, to: Timestamp) -> (f64, f64) {
    let (first, end) = (prints.partition_point(|p| p.time <= from), prints.partition_point(|p| p.time <= to));
    let met = |print: &&Print| close(print.price, limit) && print.aggressor.is_none_or(|taker| taker != side);
    let met: Vec<&Print> = prints[first..end.max(first)].iter().filter(met).collect();
    let last = met.last().map(|print| print.time);
    let sum = |at_last: bool| met.iter().filter(|p| (Some(p.time) == last) == at_last).map(|print| print.size).sum();
    (sum(false), sum(true))
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * b.abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{Level, Quotes};

    fn at(seconds: f64) -> Timestamp {
        Timestamp(0).plus_seconds(seconds)
    }

    fn tape(asks: &[(f64, f64)], trades: &[(f64, f64)]) -> Tape {
        let mut quotes = Quotes::with_depth(1);
        for (time, ask) in asks {
            quotes.push(at(*time), &[Level { price: 100.0, size: 40.0 }], &[Level { price: *ask, size: 40.0 }]);
        }
        let sold =
            |(time, size): &(f64, f64)| Print { time: at(*time), price: 100.0, size: *size, aggressor: Some(Side::Sell) };
        Tape::new(quotes, trades.iter().map(sold).collect(), Vec::new())
    }

    fn order() -> LoggedOrder {
        LoggedOrder {
            id: "1".into(),
            side: Side::Buy,
            quantity: 30.0,
            decided_at: at(1.0),
            kind: OrderType::Other("limit".into()),
            seen_mid: None,
        }
    }

    fn filled(time: f64, quantity: f64) -> LoggedFill {
        LoggedFill { order_id: "1".into(), filled_at: at(time), quantity, price: 100.0, fee: 0.0 }
    }

    /// What stood ahead of an order, at the least and at the most.
    fn bounds(asks: &[(f64, f64)], trades: &[(f64, f64)], fill: &LoggedFill) -> Option<Bounds> {
        ahead(&order(), &[fill], &tape(asks, trades), 0).map(|ahead| (ahead.least, ahead.most))
    }

    const CALM: [(f64, f64); 2] = [(0.0, 100.01), (20.0, 100.01)];

    #[test]
    fn what_traded_before_it_stood_ahead_of_it() {
        // Of the 15 sold last it got 10.
        let trades = [(0.5, 500.0), (2.0, 50.0), (3.0, 15.0)];
        assert_eq!(bounds(&CALM, &trades, &filled(3.0, 10.0)), Some((55.0, 55.0)));
        // Filled whole it stood somewhere between.
        assert_eq!(bounds(&CALM, &[(2.0, 50.0), (3.0, 34.0)], &filled(3.0, 30.0)), Some((50.0, 54.0)));
        assert_eq!(bounds(&CALM, &[(2.0, 50.0)], &filled(3.0, 30.0)), Some((0.0, 20.0)));
        // A fill that nobody on the tape has brought tells nothing.
        assert_eq!(bounds(&CALM, &[(2.0, 5.0)], &filled(3.0, 30.0)), None);
        let market = LoggedOrder { kind: OrderType::Market, ..order() };
        assert_eq!(ahead(&market, &[&filled(3.0, 10.0)], &tape(&CALM, &trades), 0), None);
        assert_eq!(ahead(&order(), &[], &tape(&CALM, &trades), 0), None);
    }

    #[test]
    fn of_a_queue_that_the_market_has_left_no_more_is_known_than_what_was_taken_before() {
        for ask in [100.0, 99.99] {
            let crossed = [(0.0, 100.01), (2.5, ask)];
            let known = bounds(&crossed, &[(2.0, 50.0), (3.0, 15.0)], &filled(3.0, 10.0));
            assert_eq!(known, Some((50.0, f64::INFINITY)), "{ask}");
        }
    }

    /// What each of `filled` tells of an order that was filled in part of the 60 that were sold at its price, where 40 were displayed.
    fn told(filled: &[f64]) -> Places {
        let fills: Vec<LoggedFill> = filled_parts(filled);
        let of_order: Vec<Vec<&LoggedFill>> = fills.iter().map(|fill| vec![fill]).collect();
        Places::of(&vec![order(); fills.len()], &of_order, &tape(&CALM, &[(2.0, 20.0), (3.0, 40.0)]), 0)
    }

    fn filled_parts(quantities: &[f64]) -> Vec<LoggedFill> {
        quantities.iter().map(|quantity| filled(3.0, *quantity)).collect()
    }

    #[test]
    fn a_few_places_that_are_known_exactly_tell_that_more_stood_ahead() {
        // 56 to 40 stood ahead of them.
        let places = told(&[4.0, 8.0, 9.0, 11.0, 13.0, 15.0, 16.0, 20.0]);
        let Places::Late(places) = &places else { panic!("{places:?}") };
        assert_eq!(places.len(), 8);
        let mean = places.iter().map(|place| place.beyond).sum::<f64>() / 8.0;
        assert!((mean - 0.2).abs() < 1e-9 && places.iter().all(|place| place.displayed == 40.0), "{places:?}");
        // 48 to 32: on average as many as were displayed.
        assert_eq!(told(&[12.0, 16.0, 17.0, 19.0, 21.0, 23.0, 24.0, 28.0]), Places::Silent);
    }

    #[test]
    fn that_places_are_not_known_is_said_where_many_orders_were_filled() {
        let tape = tape(&[(0.0, 100.01), (2.5, 100.0), (20.0, 100.0)], &[]);
        let fill = filled(3.0, 30.0);
        let of = |count: usize| Places::of(&vec![order(); count], &vec![vec![&fill]; count], &tape, 0);
        assert_eq!(of(40), Places::Unknown { filled: 40, known: 0 });
        assert!(of(40).note().is_some_and(|note| note.contains("of 40 that were filled at rest 0 tell of it")));
        assert_eq!(of(3), Places::Silent);
        let market = LoggedOrder { kind: OrderType::Market, ..order() };
        assert_eq!(Places::of(&vec![market; 40], &vec![vec![&fill]; 40], &tape, 0), Places::Silent);
    }
}
