//! Places in queues, as a log and its tape tell of them: what traded at the price of a resting order before it was filled itself.

use crate::sim2real::Timestamp;

use super::{InFlight, LoggedFill, LoggedOrder, OrderType, Print, Role, Seen, Side, Tape};

/// With fewer orders of a known place nothing is told of places.
const ENOUGH: usize = 25;
/// A place is known where it lies between bounds that are no further apart than this part of what was displayed.
const KNOWN_TO: f64 = 0.2;
/// More than was displayed stood ahead where it did by so many standard errors, and by this part of it.
const CERTAIN: f64 = 4.0;
const WORTH_TELLING: f64 = 0.05;
/// What stood ahead of one order counts for no more than so many times what stood ahead of the middle one.
const USUAL: f64 = 5.0;

/// The place in its queue of an order that rested at the best price of its own side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    /// The order, as of when it was decided.
    pub order: InFlight,
    /// When it was filled first.
    pub filled_at: Timestamp,
    /// What was displayed where it joined [units].
    pub displayed: f64,
    /// What stood ahead of it beside that, as a part of it.
    pub beyond: f64,
}

/// What the places of a log tell.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) enum Places {
    /// There are too few that are known, or the orders stood where they were thought to.
    #[default]
    Silent,
    /// Orders were filled although less had traded than was displayed, on average by this part of it: others ahead of them gave up.
    Early(f64),
    /// More stood ahead than was displayed.
    Late(Vec<Place>),
}

impl Places {
    /// Of limit orders, each with its `fills`. Stamps of fills may be too early by `rounding` [ns].
    pub fn of(orders: &[LoggedOrder], fills: &[Vec<&LoggedFill>], tape: &Tape, rounding: i64) -> Self {
        let known = orders.iter().zip(fills).filter_map(|(order, fills)| place(order, fills, tape, rounding));
        let mut places: Vec<Place> = known.collect();
        places.sort_by_key(|place| place.order.decided_at);
        let Some((mean, error)) = mean(&places) else { return Self::Silent };
        if mean.abs() < WORTH_TELLING + CERTAIN * error {
            return Self::Silent;
        }
        if mean > 0.0 { Self::Late(places) } else { Self::Early(-mean) }
    }

    /// The places, where they tell of something that a place further back could say.
    pub fn told(&self) -> &[Place] {
        if let Self::Late(places) = self { places } else { &[] }
    }

    /// What a reader should know of them.
    pub fn note(&self) -> Option<String> {
        let Self::Early(part) = self else { return None };
        Some(format!(
            "resting orders were filled although {:.0} % of what was displayed ahead of them had not traded: others gave up their \
             places, which a queue model says, not a mechanism",
            100.0 * part
        ))
    }
}

/// What stood ahead beside what was displayed, on average, and its standard error; none of few orders.
fn mean(places: &[Place]) -> Option<(f64, f64)> {
    if places.len() < ENOUGH {
        return None;
    }
    let mut ahead: Vec<f64> = places.iter().map(|place| 1.0 + place.beyond).collect();
    ahead.sort_by(f64::total_cmp);
    let most = USUAL * ahead[ahead.len() / 2];
    let beyond = || ahead.iter().map(|ahead| ahead.min(most) - 1.0);
    let count = places.len() as f64;
    let mean = beyond().sum::<f64>() / count;
    let variance = beyond().map(|beyond| (beyond - mean).powi(2)).sum::<f64>() / (count - 1.0);
    Some((mean, (variance / count).sqrt()))
}

/// The place of `order`, where the tape tells it: it joined the best price of its own side, which was never left until somebody
/// who took filled it.
fn place(order: &LoggedOrder, fills: &[&LoggedFill], tape: &Tape, rounding: i64) -> Option<Place> {
    let first = fills.first().filter(|_| order.kind == OrderType::Other("limit".to_owned()))?;
    let (limit, decided) = (first.price, order.decided_at);
    let book = tape.book(Seen::at(decided))?;
    let joined = book.opposite(order.side.opposite()).first().filter(|level| close(level.price, limit))?;
    let displayed = Some(joined.size).filter(|size| size.is_finite() && *size > 0.0)?;
    let until = first.filled_at + rounding + STAMP;
    if left(tape, order.side, limit, decided, until) {
        return None;
    }
    let (before, last) = traded(tape.prints(), order.side, limit, decided, until)?;
    let most = before + last - first.quantity;
    // Who got the rest of what somebody took stood behind all the rest of it; who was filled whole may have stood further ahead.
    let least = if first.quantity < order.quantity { most } else { before };
    let known = most >= least && most - least <= KNOWN_TO * displayed;
    let mid = book.mid().filter(|_| known)?;
    Some(Place {
        order: InFlight::market(order.side, order.quantity, decided, limit, mid).as_a(Role::Maker),
        filled_at: first.filled_at,
        displayed,
        beyond: 0.5 * (least + most) / displayed - 1.0,
    })
}

/// By how much a stamp may have been rounded [ns]: the step of a 64-bit float at today's count of nanoseconds.
const STAMP: i64 = 256;

/// Whether the best price of an order's own side left its `limit`, or the other side came to it, by a time: then a queue is gone.
fn left(tape: &Tape, side: Side, limit: f64, from: Timestamp, to: Timestamp) -> bool {
    let times = tape.quotes().times();
    let (first, end) = (times.partition_point(|at| *at <= from), times.partition_point(|at| *at <= to));
    let quotes = tape.quotes().between(first, end.max(first));
    let worse = |price: f64, than: f64| side.sign() * (price - than) < 0.0 && !close(price, than);
    (0..quotes.len()).filter_map(|k| quotes.get(k)).any(|quote| {
        let (own, other) = match side {
            Side::Buy => (quote.bid(), quote.ask()),
            Side::Sell => (quote.ask(), quote.bid()),
        };
        own.is_none_or(|own| worse(own, limit)) || other.is_some_and(|other| !worse(limit, other))
    })
}

/// What was taken at `limit` from an order's side: before the last time, and then [units]; none where nothing was.
fn traded(prints: &[Print], side: Side, limit: f64, from: Timestamp, to: Timestamp) -> Option<(f64, f64)> {
    let (first, end) = (prints.partition_point(|p| p.time <= from), prints.partition_point(|p| p.time <= to));
    let met = |print: &&Print| close(print.price, limit) && print.aggressor.is_none_or(|taker| taker != side);
    let met: Vec<&Print> = prints[first..end.max(first)].iter().filter(met).collect();
    let last = met.last()?.time;
    let sum = |at_last: bool| met.iter().filter(|print| (print.time == last) == at_last).map(|print| print.size).sum();
    Some((sum(false), sum(true)))
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

    #[test]
    fn what_traded_before_it_stood_ahead_of_it() {
        let tape = tape(&[(0.0, 100.01), (20.0, 100.01)], &[(0.5, 500.0), (2.0, 50.0), (3.0, 15.0)]);
        // Of the 15 sold last it got 10: 55 stood ahead, 40 of them displayed.
        let place = place(&order(), &[&filled(3.0, 10.0)], &tape, 0).expect("a place");
        assert_eq!((place.displayed, place.beyond), (40.0, 0.375));
        // Filled whole it stood somewhere between 50 and 50 + 40 - 30: known to no more than that.
        let whole = |size| tape_and_place(size, 30.0);
        assert_eq!(whole(34.0).map(|place| place.beyond), Some(0.5 * (50.0 + 54.0) / 40.0 - 1.0));
        assert_eq!(whole(60.0), None);
    }

    fn tape_and_place(size: f64, quantity: f64) -> Option<Place> {
        let tape = tape(&[(0.0, 100.01), (20.0, 100.01)], &[(2.0, 50.0), (3.0, size)]);
        place(&order(), &[&filled(3.0, quantity)], &tape, 0)
    }

    #[test]
    fn a_queue_that_the_market_has_left_tells_nothing() {
        let trades = [(2.0, 50.0), (3.0, 15.0)];
        let fill = filled(3.0, 10.0);
        for ask in [100.0, 99.99] {
            let crossed = tape(&[(0.0, 100.01), (2.5, ask)], &trades);
            assert_eq!(place(&order(), &[&fill], &crossed, 0), None, "{ask}");
        }
        let market = LoggedOrder { kind: OrderType::Market, ..order() };
        let calm = tape(&[(0.0, 100.01)], &trades);
        assert_eq!(place(&market, &[&fill], &calm, 0), None);
        assert_eq!(place(&order(), &[], &calm, 0), None);
    }

    #[test]
    fn chance_is_no_place() {
        let place = |beyond: f64| Place {
            order: InFlight::market(Side::Buy, 1.0, at(0.0), 1.0, 1.0),
            filled_at: at(0.0),
            displayed: 1.0,
            beyond,
        };
        let mean_of = |of: &dyn Fn(usize) -> f64| mean(&(0..100).map(|k| place(of(k))).collect::<Vec<_>>());
        assert_eq!(mean_of(&|_| 0.5), Some((0.5, 0.0)));
        let (mean, error) = mean_of(&|k| if k % 2 == 0 { 1.0 } else { -1.0 }).expect("enough");
        assert!(mean.abs() < CERTAIN * error);
        assert_eq!(super::mean(&[place(1.0)]), None);
    }
}
