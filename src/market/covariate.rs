//! What the residuals of an order log may depend on: the columns of tests of what is left.

use crate::sim2real::{Recording, Timestamp};

use super::volatility_regime::restless;
use super::{Book, InFlight, OrderLog, Seen, Side, Tape};

/// The name of the column that tells purchases, 1, from sales, -1.
pub(super) const SIDE: &str = "side";

/// Values by name, one a row; what nothing is known of has no column, and an order of which a value is not known, and a look at the
/// market, have the median of the others, which speaks for no dependence.
///
/// Book and sizes are those the order found as far as its stamps tell ([`OrderLog::shown_delay`]). Units: times [s],
/// sizes [units], prices [currency], moves and returns [bps].
pub(super) fn covariates(recording: &Recording<OrderLog>) -> Vec<(&'static str, Vec<f64>)> {
    let log = &recording.stimulus;
    let tick_size = log.instrument().tick_size;
    let rows = 0..log.orders().len();
    let by_order = |value: &dyn Fn(&InFlight) -> Option<f64>| log.orders().iter().map(value).collect::<Vec<_>>();
    let by_book = |value: &dyn Fn(&InFlight, &Book) -> Option<f64>| {
        let of = |row: usize| value(&log.orders()[row], &log.tape().book(log.seen_on_arrival(row))?);
        rows.clone().map(of).collect::<Vec<_>>()
    };
    let decided: Vec<Timestamp> = log.orders().iter().map(|order| order.decided_at).collect();
    let restless = restless(log.tape(), &decided).map_or_else(Vec::new, |all| all.into_iter().map(Some).collect());
    let columns = [
        ("quantity / size at the touch", by_book(&|order, book| Some(order.quantity / touch_size(order, book)?))),
        ("size at the touch", by_book(&touch_size)),
        ("gap to the second level", by_book(&gap)),
        ("quoted spread", by_book(&|_, book| Some(2.0 * book.half_spread()).filter(|_| book.mid().is_some()))),
        ("imbalance of the touch", by_book(&imbalance)),
        ("quantity", by_order(&|order| Some(order.quantity))),
        (SIDE, by_order(&|order| Some(order.side.sign()))),
        ("volatility before", by_order(&|order| volatility(log.tape(), order.decided_at))),
        ("probability of the restless regime", restless),
        ("own flow over 60 s before", own_flow(log.orders(), 60.0).into_iter().map(Some).collect()),
        ("return over 10 s before", by_order(&|order| move_over(log.tape(), order, -10.0, 0.0))),
        ("return over 60 s before", by_order(&|order| move_over(log.tape(), order, -60.0, 0.0))),
        ("time of day", by_order(&|order| Some(time_of_day(order.decided_at)))),
        ("number of the order", rows.clone().map(|row| Some(row as f64)).collect()),
        ("price", by_order(&|order| Some(order.mid))),
        ("price within its unit", by_order(&|order| Some(order.mid.rem_euclid(1.0)))),
        ("touch within 5 ticks", by_book(&|order, book| Some(within_ticks(touch(order, book)?, 5.0, tick_size)))),
        ("touch within 10 ticks", by_book(&|order, book| Some(within_ticks(touch(order, book)?, 10.0, tick_size)))),
        ("assumed price within 5 ticks", by_order(&|order| Some(within_ticks(order.assumed, 5.0, tick_size)))),
        ("assumed price within 10 ticks", by_order(&|order| Some(within_ticks(order.assumed, 10.0, tick_size)))),
        ("assumed price within 100 ticks", by_order(&|order| Some(within_ticks(order.assumed, 100.0, tick_size)))),
        ("time within a second", by_order(&|order| Some(within(order.decided_at, 1.0)))),
        ("time within 10 s", by_order(&|order| Some(within(order.decided_at, 10.0)))),
        ("time within a minute", by_order(&|order| Some(within(order.decided_at, 60.0)))),
        ("time within five minutes", by_order(&|order| Some(within(order.decided_at, 300.0)))),
        ("time within an hour", by_order(&|order| Some(within(order.decided_at, 3_600.0)))),
        ("return over 1 s after", by_order(&|order| move_over(log.tape(), order, 0.0, 1.0))),
        ("return over 10 s after", by_order(&|order| move_over(log.tape(), order, 0.0, 10.0))),
    ];
    let by_row = |values: Vec<Option<f64>>| {
        let of = |row| log.order_of(row).and_then(|number| values.get(number).copied().flatten());
        complete((0..log.rows()).map(of).collect())
    };
    // What the market did within a second of a stamp that was cut may have come before the decision: that costs depend on it says
    // nothing but that.
    let known = |name: &str| !log.stamps_are_cut() || !name.ends_with("after");
    let columns = columns.into_iter().filter(|(name, _)| known(name));
    columns.filter_map(|(name, values)| Some((name, by_row(values)?))).collect()
}

/// The values with the median of the known in place of the unknown; none where nothing is known.
fn complete(values: Vec<Option<f64>>) -> Option<Vec<f64>> {
    let mut known: Vec<f64> = values.iter().flatten().copied().filter(|v| v.is_finite()).collect();
    known.sort_by(f64::total_cmp);
    let median = *known.get(known.len() / 2)?;
    Some(values.into_iter().map(|value| value.filter(|v| v.is_finite()).unwrap_or(median)).collect())
}

/// The best price that the order could take.
fn touch(order: &InFlight, book: &Book) -> Option<f64> {
    book.opposite(order.side).first().map(|level| level.price)
}

fn touch_size(order: &InFlight, book: &Book) -> Option<f64> {
    book.opposite(order.side).first().map(|level| level.size).filter(|size| size.is_finite())
}

fn gap(order: &InFlight, book: &Book) -> Option<f64> {
    match book.opposite(order.side) {
        [first, second, ..] => Some(order.side.sign() * (second.price - first.price)),
        _ => None,
    }
}

/// How much more is displayed on the order's own side, from -1 to 1.
fn imbalance(order: &InFlight, book: &Book) -> Option<f64> {
    let size = |side| book.opposite(side).first().map(|level| level.size);
    let (ask, bid) = (size(Side::Buy)?, size(Side::Sell)?);
    Some(order.side.sign() * (bid - ask) / (bid + ask))
}

fn mid_at(tape: &Tape, time: Timestamp) -> Option<f64> {
    tape.mid(Seen::at(time))
}

/// Move of the mid from `from` to `to` [s] after the decision, against the order positive [bps].
fn move_over(tape: &Tape, order: &InFlight, from: f64, to: f64) -> Option<f64> {
    let start = mid_at(tape, order.decided_at.plus_seconds(from))?;
    let end = mid_at(tape, order.decided_at.plus_seconds(to))?;
    Some(order.side.sign() * (end - start) / start * 1e4)
}

/// Mean size of the moves of the mid over 10 s, in the five minutes before `time` [bps].
fn volatility(tape: &Tape, time: Timestamp) -> Option<f64> {
    let mids: Vec<f64> = (0..=30).filter_map(|k| mid_at(tape, time.plus_seconds(-10.0 * f64::from(k)))).collect();
    let moves = mids.windows(2).map(|pair| ((pair[0] - pair[1]) / pair[1]).abs() * 1e4);
    (mids.len() > 1).then(|| moves.sum::<f64>() / (mids.len() - 1) as f64)
}

/// Quantity bought less quantity sold over `seconds` [s] before each order, on its own side positive [units].
fn own_flow(orders: &[InFlight], seconds: f64) -> Vec<f64> {
    let signed = |order: &InFlight| order.side.sign() * order.quantity;
    let flow = |(row, order): (usize, &InFlight)| {
        let since = order.decided_at.plus_seconds(-seconds);
        let past = orders[..row].iter().rev().take_while(|earlier| earlier.decided_at >= since);
        order.side.sign() * past.map(signed).sum::<f64>()
    };
    orders.iter().enumerate().map(flow).collect()
}

/// Where in a step of so many ticks a `price` lies [ticks].
fn within_ticks(price: f64, step: f64, tick_size: f64) -> f64 {
    (price / tick_size).round().rem_euclid(step)
}

/// Where in a period of so many seconds `time` lies [s].
fn within(time: Timestamp, seconds: f64) -> f64 {
    time.0.rem_euclid((seconds * Timestamp::NANOS as f64) as i64) as f64 * 1e-9
}

/// Seconds since midnight, UTC [s].
fn time_of_day(time: Timestamp) -> f64 {
    time.0.rem_euclid(86_400 * Timestamp::NANOS) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_values_take_the_median_and_unknown_columns_go() {
        assert_eq!(complete(vec![Some(1.0), None, Some(3.0), Some(2.0)]), Some(vec![1.0, 2.0, 3.0, 2.0]));
        assert_eq!(complete(vec![None, None]), None);
    }

    #[test]
    fn the_touch_is_that_of_the_side_an_order_takes() {
        let level = |price| crate::market::Level { price, size: 1.0 };
        let mut quotes = crate::market::Quotes::with_depth(1);
        quotes.push(Timestamp(0), &[level(99.98)], &[level(100.03)]);
        let quote = quotes.all().get(0).unwrap();
        let within = |side| {
            let order = InFlight::market(side, 1.0, Timestamp(1), 100.0, 100.0);
            touch(&order, &quote.book()).map(|price| within_ticks(price, 5.0, 0.01))
        };
        assert_eq!([within(Side::Buy), within(Side::Sell)], [Some(3.0), Some(3.0)]);
        assert_eq!(within_ticks(100.05, 5.0, 0.01), 0.0);
    }

    #[test]
    fn own_flow_counts_on_the_orders_own_side() {
        let order = |side, quantity, s| InFlight::market(side, quantity, Timestamp(0).plus_seconds(s), 1.0, 1.0);
        let orders = [
            order(Side::Buy, 10.0, 0.0),
            order(Side::Sell, 4.0, 30.0),
            order(Side::Sell, 1.0, 50.0),
            order(Side::Buy, 1.0, 100.0),
        ];
        assert_eq!(own_flow(&orders, 60.0), [0.0, -10.0, -6.0, -1.0]);
        assert_eq!(time_of_day(Timestamp(86_400 * Timestamp::NANOS + 5)), 5e-9);
    }
}
