//! What stands ahead of a resting order beside what is displayed: fills move, wherever a queue is known.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::market_scene::{event, fills, limit, quotes, run, run_with, settings, sized_quotes};
use proptest::prelude::{Just, ProptestConfig, Strategy as Drawn, prop_assert, prop_assert_eq, prop_oneof, proptest};
use trueup::market::{
    DepthAction, DepthChange, History, Matching, OrderAction, OrderEvent, Price, Print, QueueModel, Record, Settings, Side,
};
use trueup::sim2real::Timestamp;

fn at(price: f64) -> Price {
    Price::nearest(price).unwrap()
}

fn sold(time: i64, price: f64, size: f64) -> Print {
    Print { time: Timestamp(time), price, size, aggressor: Some(Side::Sell) }
}

fn by_queue(queue: QueueModel) -> Settings {
    Settings { matching: Matching { queue, ..Matching::default() }, ..settings() }
}

/// A bid at 99 behind 100 displayed, of which `behind` adds that part again.
fn joined(history: History, queue: QueueModel, behind: f64) -> Record {
    let plan = event(0).submit(limit(Side::Buy, 40.0, 99.0));
    run_with(vec![history], &[("queue_position", "", behind)], by_queue(queue), plan)
}

#[test]
fn trades_reach_the_order_after_what_is_displayed_and_what_is_not() {
    let rows: Vec<_> = (0..9).map(|t| (t * 10, 99.0, 101.0)).collect();
    let prints = || vec![sold(15, 99.0, 60.0), sold(25, 99.0, 65.0), sold(35, 99.0, 35.0), sold(45, 99.0, 10.0)];
    let of = |behind| joined(quotes(&rows).with_prints(prints()).unwrap(), QueueModel::Proportional, behind);
    // 100 are displayed: 125 sold reach 25 of ours. With half as much again ahead 160 sold reach 10.
    assert_eq!(fills(&of(0.0)), [(25, 25.0, 99.0), (35, 15.0, 99.0)]);
    let half = of(0.5);
    assert_eq!(fills(&half), [(35, 10.0, 99.0), (45, 10.0, 99.0)]);
    assert_eq!(half.blotter.fills[0].why.queued_behind, 150.0);
    assert_eq!(fills(&of(1.0)), []);
}

#[test]
fn what_is_cancelled_is_known_of_what_is_displayed_alone() {
    // All that is displayed is cancelled: what nobody saw stands ahead still.
    let rows = [(0, 99.0, 100.0, 101.0, 1.0), (10, 98.0, 50.0, 101.0, 1.0), (90, 98.0, 50.0, 101.0, 1.0)];
    let history = || sized_quotes(&rows).with_prints(vec![sold(20, 99.0, 30.0), sold(30, 99.0, 30.0)]).unwrap();
    for queue in [QueueModel::Trades, QueueModel::Proportional, QueueModel::Log, QueueModel::Power { exponent: 3.0 }] {
        assert_eq!(fills(&joined(history(), queue, 0.0)), [(20, 30.0, 99.0), (30, 10.0, 99.0)], "{queue}");
        assert_eq!(fills(&joined(history(), queue, 0.5)), [(30, 10.0, 99.0)], "{queue}");
    }
}

#[test]
fn a_price_that_comes_into_view_has_its_queue_and_what_is_added_to_it() {
    // A bid at 98 is below the only level there is; then it is the best.
    let rows = [(0, 99.0, 100.0, 101.0, 1.0), (10, 98.0, 20.0, 101.0, 1.0), (90, 98.0, 20.0, 101.0, 1.0)];
    let history = || sized_quotes(&rows).with_prints(vec![sold(20, 98.0, 35.0)]).unwrap();
    let of = |behind| {
        let plan = event(0).submit(limit(Side::Buy, 40.0, 98.0));
        fills(&run(history(), &[("queue_position", "", behind)], plan))
    };
    assert_eq!((of(0.0), of(0.5)), (vec![(20, 15.0, 98.0)], vec![(20, 5.0, 98.0)]));
}

#[test]
fn whoever_is_passed_by_is_filled_whatever_stood_ahead() {
    let rows = [(0, 99.0, 101.0), (10, 97.0, 98.0), (20, 97.0, 98.0)];
    assert_eq!(fills(&joined(quotes(&rows), QueueModel::Proportional, 9.0)), [(10, 40.0, 99.0)]);
}

#[test]
fn it_holds_in_books_by_price_and_by_order() {
    let depth = |time: i64, side, price: f64, size: f64| {
        let (time, price) = (Timestamp(time), at(price));
        DepthChange { time, known_at: time, side, action: DepthAction::Set, price, size }
    };
    let book = vec![depth(0, Side::Buy, 99.0, 30.0), depth(0, Side::Sell, 101.0, 9.0), depth(80, Side::Sell, 101.0, 8.0)];
    let by_price = History::default().with_depth(book).unwrap();
    let order = |time: i64, id, action, side, price: f64, size| {
        let (time, price) = (Timestamp(time), at(price));
        OrderEvent { time, known_at: time, id, action, side, price, size }
    };
    let events = vec![
        order(0, 1, OrderAction::Add, Side::Buy, 99.0, 30.0),
        order(0, 3, OrderAction::Add, Side::Sell, 101.0, 9.0),
        // Sold: the data say themselves that it is gone.
        order(21, 1, OrderAction::Delete, Side::Buy, 99.0, 0.0),
        order(80, 3, OrderAction::Delete, Side::Sell, 101.0, 0.0),
    ];
    let by_order = History::default().with_order_events(events).unwrap();
    let prints = || vec![sold(20, 99.0, 30.0), sold(30, 99.0, 12.0), sold(40, 99.0, 5.0)];
    for (name, history) in [("by price", by_price), ("by order", by_order)] {
        let of = |behind| fills(&joined(history.clone().with_prints(prints()).unwrap(), QueueModel::Trades, behind));
        assert_eq!(of(0.0), [(30, 12.0, 99.0), (40, 5.0, 99.0)], "{name}");
        assert_eq!(of(0.5), [(40, 2.0, 99.0)], "{name}: 15 more stand ahead");
    }
}

/// A bid joins the best of a market of random quotes, and trades come to it.
fn random_market() -> impl Drawn<Value = History> {
    proptest::collection::vec((1..50_i64, -1..2_i64, 1..200_u32, 0..3_u8, 1..150_u32), 5..60).prop_map(|steps| {
        let (mut time, mut bid) = (0, 10_000_i64);
        let (mut rows, mut prints) = (Vec::new(), Vec::new());
        for (gap, step, size, trade, sold_now) in steps {
            time += gap;
            bid += step;
            rows.push((time, bid as f64 / 100.0, f64::from(size), (bid + 2) as f64 / 100.0, 50.0));
            if trade == 1 {
                prints.push(sold(time, bid as f64 / 100.0, f64::from(sold_now)));
            }
        }
        sized_quotes(&rows).with_prints(prints).unwrap()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// The more stands ahead, the later and the less: at every instant no more is filled than with less ahead; and with nothing
    /// added not a bit is other than without the law.
    #[test]
    fn more_ahead_never_fills_sooner(
        history in random_market(),
        model in prop_oneof![Just(QueueModel::Trades), Just(QueueModel::Proportional), Just(QueueModel::Log)],
        ahead in 0.01..3.0_f64,
    ) {
        let bid = history.quotes().all().get(0).and_then(|quote| quote.bid()).unwrap();
        let of = |parts: &[(&str, &str, f64)]| {
            let plan = event(0).submit(limit(Side::Buy, 40.0, bid));
            run_with(vec![history.clone()], parts, by_queue(model), plan)
        };
        let (bare, nothing, more) = (of(&[]), of(&[("queue_position", "", 0.0)]), of(&[("queue_position", "", ahead)]));
        prop_assert_eq!(&bare.blotter.fills, &nothing.blotter.fills);
        prop_assert_eq!(&bare.equity, &nothing.equity);
        let by = |record: &Record, time: i64| {
            fills(record).iter().filter(|fill| fill.0 <= time).map(|fill| fill.1).sum::<f64>()
        };
        for (time, ..) in fills(&bare).into_iter().chain(fills(&more)) {
            prop_assert!(by(&more, time) <= by(&bare, time));
        }
    }
}
