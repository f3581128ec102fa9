//! What is made of small tapes: in memory, and as files.

use std::cmp::Ordering;
use std::convert::Infallible;

use proptest::prelude::*;

use super::book::{TapeBook, exact_size};
use super::by_order::ByOrder;
use super::by_trade::ByTrade;
use super::*;
use crate::market::{
    Departure, Known, Level, NumberedPrint, OrderAction, OrderEvent, OrderStep, Price, Print, Quantity, Side,
};
use crate::sim2real::Timestamp;

const MS: i64 = 1_000_000;

/// Keeps everything.
#[derive(Debug, Default)]
struct Kept {
    /// Milliseconds, best bid, best ask.
    quotes: Vec<(i64, Option<f64>, Option<f64>)>,
    prints: Vec<Print>,
    orders: Vec<TapeOrder>,
}

impl TapeSink for Kept {
    type Error = Infallible;

    fn quote(&mut self, time: Timestamp, bids: &[Level], asks: &[Level]) -> Result<(), Infallible> {
        let best = |levels: &[Level]| levels.first().map(|level| level.price);
        self.quotes.push((time.0 / MS, best(bids), best(asks)));
        Ok(())
    }

    fn print(&mut self, print: Print) -> Result<(), Infallible> {
        self.prints.push(print);
        Ok(())
    }

    fn order(&mut self, order: TapeOrder) -> Result<(), Infallible> {
        self.orders.push(order);
        Ok(())
    }
}

/// At a millisecond, what becomes of an order: its side, price and what is left of it.
fn step(ms: i64, id: u64, action: OrderAction, side: Side, price: f64, size: f64) -> OrderStep {
    let (at, price) = (Timestamp(ms * MS), Price::nearest(price).unwrap());
    OrderEvent { time: at, known_at: at, id, action, side, price, size }.into()
}

fn leaves(ms: i64, id: u64, side: Side, price: f64, how: Departure) -> OrderStep {
    OrderStep { departure: Some(how), ..step(ms, id, OrderAction::Delete, side, price, 0.0) }
}

fn read(steps: &[OrderStep]) -> (Kept, TapeCounts) {
    let (mut found, mut counts, mut kept) = (ByOrder::new(5), TapeCounts::default(), Kept::default());
    for step in steps {
        found.step(*step, &mut counts, &mut kept).unwrap();
    }
    found.finish(&mut counts, &mut kept).unwrap();
    (kept, counts)
}

use Departure::{Filled, Withdrawn};
use OrderAction::{Add, Change, Delete};
use Side::{Buy, Sell};

/// Asks of 1 at 101, 2 at 102 and 5 at 105, a bid of 9 at 99.
fn resting() -> Vec<OrderStep> {
    vec![
        step(0, 1, Add, Sell, 101.0, 1.0),
        step(0, 2, Add, Sell, 102.0, 2.0),
        step(0, 3, Add, Sell, 105.0, 5.0),
        step(0, 4, Add, Buy, 99.0, 9.0),
    ]
}

fn fills(order: &TapeOrder) -> Vec<(i64, f64, f64)> {
    order.fills.iter().map(|fill| (fill.filled_at.0 / MS, fill.quantity.to_f64(), fill.price.to_f64())).collect()
}

#[test]
fn an_order_and_all_its_executions_are_found_whichever_half_is_told_first() {
    let mut steps = resting();
    steps.extend([
        step(1_000, 9, Add, Buy, 110.0, 2.5),
        // The one who takes is told of first.
        step(1_100, 9, Change, Buy, 110.0, 1.5),
        leaves(1_102, 1, Sell, 101.0, Filled),
        // And second.
        step(1_130, 2, Change, Sell, 102.0, 0.5),
        leaves(1_131, 9, Buy, 110.0, Filled),
        step(9_000, 10, Add, Buy, 98.0, 1.0),
    ]);
    let (kept, counts) = read(&steps);
    let [order] = &kept.orders[..] else { unreachable!("{kept:?}") };
    assert_eq!((order.id, order.side, order.quantity, order.kind), (9, Buy, Quantity(2_500_000_000), TapeOrderKind::Market));
    assert_eq!(order.decided_at, Timestamp(1_000 * MS - 1), "before all that has its stamp");
    assert_eq!(order.touch.map(Price::to_f64), [99.0, 101.0]);
    assert_eq!(fills(order), [(1_100, 1.0, 101.0), (1_130, 1.5, 102.0)]);
    assert_eq!(order.first_fill_beside_touch(), Ordering::Equal);
    assert_eq!((counts.orders, counts.market, counts.fills, counts.prints, counts.at_touch), (1, 1, 2, 2, 1));
    assert_eq!(
        kept.prints.iter().map(|p| (p.time.0 / MS, p.size, p.aggressor)).collect::<Vec<_>>(),
        [(1_100, 1.0, Some(Buy)), (1_130, 1.5, Some(Buy))]
    );
    // It is never displayed: the book is what others left, and never crosses.
    assert_eq!(
        kept.quotes,
        [
            (0, Some(99.0), Some(101.0)),
            (1_102, Some(99.0), Some(102.0)),
            (1_130, Some(99.0), Some(102.0)),
            (9_000, Some(99.0), Some(102.0)),
        ]
    );
    assert!(counts.lines().is_empty(), "{:?}", counts.lines());
}

#[test]
fn what_is_left_of_an_order_within_its_limit_rests_once_it_has_taken_the_rest() {
    let mut steps = resting();
    steps.extend([
        step(1_000, 9, Add, Buy, 101.5, 4.0),
        // For two milliseconds nothing is left that it would meet, and its own half is not told yet.
        leaves(1_100, 1, Sell, 101.0, Filled),
        step(1_102, 9, Change, Buy, 101.5, 3.0),
        leaves(5_000, 9, Buy, 101.5, Withdrawn),
    ]);
    let (kept, counts) = read(&steps);
    let [order] = &kept.orders[..] else { unreachable!("{kept:?}") };
    assert_eq!((order.kind, order.quantity.to_f64()), (TapeOrderKind::Limit(Price(101_500_000_000)), 4.0));
    assert_eq!((fills(order), counts.market), (vec![(1_100, 1.0, 101.0)], 0));
    assert_eq!(
        kept.quotes[1..],
        [(1_100, Some(99.0), Some(102.0)), (1_102, Some(101.5), Some(102.0)), (5_000, Some(99.0), Some(102.0)),]
    );
}

#[test]
fn an_order_that_is_moved_into_the_other_side_takes_from_then_on() {
    let mut steps = resting();
    steps.extend([
        step(10, 9, Add, Buy, 98.0, 1.0),
        // Moved, and made smaller at once: that is no execution.
        step(2_000, 9, Change, Buy, 101.0, 0.75),
        leaves(2_100, 9, Buy, 101.0, Filled),
        step(2_101, 1, Change, Sell, 101.0, 0.25),
    ]);
    let (kept, counts) = read(&steps);
    assert_eq!(kept.orders.iter().map(fills).collect::<Vec<_>>(), [vec![(2_100, 0.75, 101.0)]]);
    assert_eq!((kept.orders[0].decided_at, counts.fills), (Timestamp(2_000 * MS - 1), 1));
}

#[test]
fn what_cannot_be_used_is_counted_by_its_reason() {
    let count = |steps: &[OrderStep], why: LeftOut| {
        let (kept, counts) = read(&[resting(), steps.to_vec()].concat());
        assert_eq!((kept.orders.len(), counts.orders), (0, 0), "{why:?}");
        assert_eq!(counts.left_out(why), 1, "{why:?}: {:?}", counts.lines());
    };
    let comes = step(1_000, 9, Add, Buy, 101.0, 1.0);
    // It was executed against an order that is not in the file.
    count(&[comes, leaves(1_100, 9, Buy, 101.0, Filled)], LeftOut::UnknownCounterpart);
    count(&[comes, step(1_100, 9, Change, Buy, 101.0, 0.5)], LeftOut::UnknownCounterpart);
    count(&[leaves(1_100, 1, Sell, 101.0, Filled)], LeftOut::UnknownTaker);
    count(&[comes, leaves(1_100, 9, Buy, 101.0, Withdrawn)], LeftOut::NotExecuted);
    // Where a file does not say why an order left, it may have been withdrawn.
    count(&[comes, step(1_100, 9, Delete, Buy, 101.0, 0.0)], LeftOut::NotExecuted);
    let no_bid = [leaves(900, 4, Buy, 99.0, Withdrawn), comes, leaves(1_100, 9, Buy, 101.0, Filled)];
    count(&[&no_bid[..], &[leaves(1_101, 1, Sell, 101.0, Filled)]].concat(), LeftOut::NoBook);
}

#[test]
fn what_is_met_for_seconds_and_never_executed_is_taken_out_of_the_book() {
    let mut steps = resting();
    steps.extend([step(1_000, 9, Add, Buy, 101.0, 1.0), step(7_000, 10, Add, Buy, 90.0, 1.0)]);
    let (kept, counts) = read(&steps);
    assert_eq!((counts.left_out(LeftOut::Ghost), counts.left_out(LeftOut::NotExecuted)), (1, 1));
    assert_eq!(kept.quotes.last(), Some(&(7_000, Some(101.0), Some(102.0))), "what was met is gone, and the order rests");
}

fn trade(ms: i64, number: i64, side: Option<Side>, price: f64, size: f64) -> NumberedPrint {
    let time = Timestamp(ms * MS);
    let print = Known { known_at: time, what: Print { time, price, size, aggressor: side } };
    NumberedPrint { print, number: Some(number) }
}

fn of_trades(trades: &[NumberedPrint]) -> (Kept, TapeCounts) {
    of_trades_apart(trades, 0)
}

fn of_trades_apart(trades: &[NumberedPrint], apart: i64) -> (Kept, TapeCounts) {
    let mut book = TapeBook::default();
    book.set(Buy, Price(99_000_000_000), exact_size(1.0));
    book.set(Sell, Price(101_000_000_000), exact_size(1.0));
    let (mut found, mut counts, mut kept) = (ByTrade::new(apart), TapeCounts::default(), Kept::default());
    for trade in trades {
        found.trade(trade, &book, &mut counts, &mut kept).unwrap();
    }
    found.end_run(&mut counts, &mut kept).unwrap();
    (kept, counts)
}

#[test]
fn trades_of_one_stamp_one_side_and_neighbouring_numbers_are_one_order() {
    let (kept, counts) = of_trades(&[
        trade(10, 1, Some(Buy), 101.0, 1.0),
        trade(10, 2, Some(Buy), 101.0, 2.0),
        trade(10, 3, Some(Buy), 102.0, 4.0),
        trade(11, 4, Some(Buy), 103.0, 8.0),
        trade(12, 5, Some(Sell), 98.5, 16.0),
    ]);
    let orders: Vec<(i64, f64, usize, Ordering)> = kept
        .orders
        .iter()
        .map(|order| (order.id, order.quantity.to_f64(), order.fills.len(), order.first_fill_beside_touch()))
        .collect();
    assert_eq!(orders, [(1, 7.0, 3, Ordering::Equal), (4, 8.0, 1, Ordering::Greater), (5, 16.0, 1, Ordering::Greater)]);
    assert_eq!((kept.orders[0].decided_at, kept.orders[0].done_at()), (Timestamp(10 * MS - 1), Timestamp(10 * MS)));
    assert_eq!((counts.prints, counts.fills, counts.at_touch, counts.worse_than_touch), (5, 5, 1, 2));
}

#[test]
fn a_second_order_of_one_stamp_is_left_out_and_so_is_what_stands_beside_a_gap() {
    // The other side; a better price after a worse one; a number that is missing; nobody who took.
    let other = of_trades(&[trade(10, 1, Some(Buy), 101.0, 1.0), trade(10, 2, Some(Sell), 99.0, 1.0)]);
    assert_eq!((other.0.orders.len(), other.1.left_out(LeftOut::SharedStamp)), (1, 1));
    let better = of_trades(&[trade(10, 1, Some(Sell), 98.0, 1.0), trade(10, 2, Some(Sell), 99.0, 1.0)]);
    assert_eq!((better.0.orders.len(), better.1.left_out(LeftOut::SharedStamp)), (1, 1));
    let missing = of_trades(&[trade(10, 1, Some(Buy), 101.0, 1.0), trade(10, 3, Some(Buy), 101.0, 1.0)]);
    assert_eq!((missing.0.orders.len(), missing.1.left_out(LeftOut::MissingTrade)), (0, 2));
    let between = of_trades(&[trade(10, 1, Some(Buy), 101.0, 1.0), trade(20, 3, Some(Buy), 101.0, 1.0)]);
    assert_eq!((between.0.orders.len(), between.1.left_out(LeftOut::MissingTrade)), (2, 0));
    let nobody = of_trades(&[trade(10, 1, None, 101.0, 1.0), trade(20, 2, Some(Buy), 1e12, 1.0)]);
    assert_eq!((nobody.0.orders.len(), nobody.0.prints.len()), (0, 2));
    assert_eq!((nobody.1.left_out(LeftOut::NoAggressor), nobody.1.left_out(LeftOut::Unfit)), (1, 1));
}

#[test]
fn an_order_too_soon_after_a_trade_is_left_out_where_that_is_asked_for() {
    let trades: Vec<NumberedPrint> =
        [10, 14, 19, 23].into_iter().enumerate().map(|(k, ms)| trade(ms, k as i64, Some(Buy), 101.0, 1.0)).collect();
    let (kept, counts) = of_trades_apart(&trades, 5 * MS);
    assert_eq!(kept.orders.iter().map(|order| order.id).collect::<Vec<_>>(), [0, 2], "however it came to be the one before");
    assert_eq!((counts.left_out(LeftOut::TooSoon), kept.prints.len()), (2, 4));
    assert_eq!(of_trades(&trades).0.orders.len(), 4);
}

/// Whatever happens to orders: the book that is told never crosses and never goes back in time, and an order is executed after it
/// came, against prices within its limit, and never beyond its quantity.
fn obeys(steps: &[OrderStep]) -> Result<(), TestCaseError> {
    let (kept, counts) = read(steps);
    prop_assert!(kept.quotes.windows(2).all(|pair| pair[0].0 < pair[1].0));
    for (at, bid, ask) in &kept.quotes {
        prop_assert!(bid.zip(*ask).is_none_or(|(bid, ask)| bid < ask), "crossed at {at}: {bid:?}, {ask:?}");
    }
    for order in &kept.orders {
        prop_assert!(!order.fills.is_empty() && order.filled() <= order.quantity, "{order:?}");
        prop_assert!(order.fills.iter().all(|fill| fill.filled_at > order.decided_at && fill.quantity > Quantity::ZERO));
        if let TapeOrderKind::Limit(limit) = order.kind {
            prop_assert!(order.fills.iter().all(|fill| order.side.accepts(fill.price, limit)), "{order:?}");
        }
    }
    prop_assert!(kept.prints.windows(2).all(|pair| pair[0].time <= pair[1].time));
    let fills: usize = kept.orders.iter().map(|order| order.fills.len()).sum();
    prop_assert_eq!((counts.fills, counts.orders), (fills as u64, kept.orders.len() as u64));
    Ok(())
}

proptest! {
    #[test]
    fn whatever_happens_to_orders_the_tape_obeys(
        events in prop::collection::vec((0..2_500_i64, 1..9_u64, 0..4_usize, any::<bool>(), 97..104_i64, 1..4_u32), 1..120),
    ) {
        let mut ms = 0;
        let mut steps = Vec::new();
        for (later, id, what, buys, price, size) in events {
            // Many events of one stamp, and now and then a pause.
            ms += (later - 1_500).max(0);
            let side = if buys { Buy } else { Sell };
            steps.push(match what {
                0 => step(ms, id, Add, side, price as f64, f64::from(size)),
                1 => step(ms, id, Change, side, price as f64, f64::from(size)),
                2 => leaves(ms, id, side, price as f64, Filled),
                _ => step(ms, id, Delete, side, price as f64, 0.0),
            });
        }
        obeys(&steps)?;
    }
}
