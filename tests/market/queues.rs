//! Resting orders in the book: queues, trades, depth, and messages that take their time.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::market_scene::{Plan, event, fills, limit, quantity, quotes, run, run_plan, run_with, settings, sized_quotes};
use proptest::prelude::{Just, ProptestConfig, Strategy as Drawn, prop_assert, prop_assert_eq, prop_oneof, proptest};
use trueup::market::{
    DepthAction, DepthChange, EventKind, History, Latencies, Latency, Matching, News, Notice, OrderAction, OrderEvent,
    Orders, Price, Print, QueueModel, Settings, Side, Strategy, Ticket, View,
};
use trueup::sim2real::Timestamp;

fn at(price: f64) -> Price {
    Price::nearest(price).unwrap()
}

fn print(time: i64, price: f64, size: f64, aggressor: Side) -> Print {
    Print { time: Timestamp(time), price, size, aggressor: Some(aggressor) }
}

fn change(time: i64, side: Side, price: f64, size: f64) -> DepthChange {
    let (time, price) = (Timestamp(time), at(price));
    DepthChange { time, known_at: time, side, action: DepthAction::Set, price, size }
}

fn by_queue(queue: QueueModel) -> Settings {
    Settings { matching: Matching { queue, ..Matching::default() }, ..settings() }
}

fn latencies(feed: f64, order: f64, response: f64) -> Settings {
    let constant = |seconds| Latency::Constant { seconds };
    let [feed, order, response] = [feed, order, response].map(constant);
    Settings { latencies: Latencies { feed, order, response, ..Latencies::default() }, ..settings() }
}

#[test]
fn trades_use_up_the_queue_and_then_reach_the_order() {
    // 100 stand ahead at 99; 60 and 30 are sold there, then 25: 15 of them reach us.
    let rows: Vec<_> = (0..9).map(|t| (t * 10, 99.0, 101.0)).collect();
    let prints = vec![
        print(15, 99.0, 60.0, Side::Sell),
        print(25, 101.0, 500.0, Side::Buy),
        print(35, 99.0, 30.0, Side::Sell),
        print(45, 99.0, 25.0, Side::Sell),
        print(55, 99.0, 3.0, Side::Sell),
        print(65, 98.99, 1.0, Side::Sell),
    ];
    let history = quotes(&rows).with_prints(prints).unwrap();
    let record = run(history, &[], event(0).submit(limit(Side::Buy, 40.0, 99.0)));
    assert_eq!(fills(&record), [(45, 15.0, 99.0), (55, 3.0, 99.0), (65, 22.0, 99.0)]);
    let why = record.blotter.fills[0].why;
    assert_eq!((why.queued_behind, why.data), (100.0, EventKind::Quote));
}

#[test]
fn the_exit_of_a_bracket_stands_behind_what_is_there_when_its_entry_fills() {
    let rows: Vec<_> = (0..6).map(|t| (t * 10, 99.0, 101.0)).collect();
    let bought = |time, size| print(time, 101.0, size, Side::Buy);
    let history = quotes(&rows).with_prints(vec![bought(15, 60.0), bought(25, 30.0), bought(35, 13.0)]).unwrap();
    let entry = Ticket::market(0, Side::Buy, quantity(5.0));
    let record = run(history, &[], event(0).bracket(entry, at(101.0), at(90.0)));
    // 100 are displayed: 90 are bought from those, and of 13 more three are left for us.
    assert_eq!(fills(&record), [(0, 5.0, 101.0), (35, 3.0, 101.0)]);
}

#[test]
fn an_order_inside_the_spread_has_nobody_ahead() {
    let history = quotes(&[(0, 99.0, 101.0), (10, 99.0, 101.0), (20, 99.0, 101.0)])
        .with_prints(vec![print(15, 100.0, 3.0, Side::Sell)])
        .unwrap();
    let record = run(history, &[], event(0).submit(limit(Side::Buy, 5.0, 100.0)));
    assert_eq!(fills(&record), [(15, 3.0, 100.0)]);
}

#[test]
fn what_is_cancelled_is_shared_by_the_model_of_the_queue() {
    // 100 ahead, then 100 more behind; 100 are cancelled. In proportion half of them were ahead; then 60 are sold.
    let rows = [
        (0, 99.0, 100.0, 101.0, 1.0),
        (10, 99.0, 200.0, 101.0, 1.0),
        (20, 99.0, 100.0, 101.0, 1.0),
        (30, 99.0, 100.0, 101.0, 1.0),
    ];
    let of = |queue| {
        let history = sized_quotes(&rows).with_prints(vec![print(25, 99.0, 60.0, Side::Sell)]).unwrap();
        fills(&run_with(vec![history], &[], by_queue(queue), event(0).submit(limit(Side::Buy, 50.0, 99.0))))
    };
    assert_eq!(of(QueueModel::Proportional), [(25, 10.0, 99.0)]);
    assert_eq!(of(QueueModel::Trades), []);
    assert_eq!(
        of(QueueModel::Power { exponent: 2.0 }),
        [(25, 10.0, 99.0)],
        "as much ahead as behind: half, whatever the power"
    );
}

/// One instrument by price: a book of two levels a side, and then changes.
fn book(changes: Vec<DepthChange>) -> History {
    let start = [(Side::Buy, 99.0, 50.0), (Side::Buy, 98.0, 70.0), (Side::Sell, 101.0, 40.0), (Side::Sell, 102.0, 80.0)];
    let mut all: Vec<DepthChange> = start.iter().map(|(side, price, size)| change(0, *side, *price, *size)).collect();
    all.extend(changes);
    History::default().with_depth(all).unwrap()
}

#[test]
fn a_book_is_shown_whole_when_all_of_an_instant_is_in() {
    let mut plan = event(0).submit(Ticket::market(0, Side::Buy, quantity(10.0)));
    let history =
        book(vec![change(5, Side::Buy, 99.0, 0.0), change(5, Side::Sell, 101.0, 0.0), change(5, Side::Sell, 100.0, 9.0)]);
    let record = run_plan(vec![history], &[], settings(), &mut plan);
    assert_eq!(record.held.events, 2, "four changes at once, then three");
    assert_eq!(fills(&record), [(0, 10.0, 101.0)]);
}

#[test]
fn a_walk_through_the_book_pays_level_by_level() {
    let parts = [("half_spread", "fraction", 1.0), ("book_walk", "", 1.0)];
    let record = run(
        book(vec![change(5, Side::Buy, 99.0, 51.0)]),
        &parts,
        event(0).submit(Ticket::market(0, Side::Buy, quantity(60.0))),
    );
    let expected = (40.0 * 101.0 + 20.0 * 102.0) / 60.0;
    assert!((fills(&record)[0].2 - expected).abs() < 1e-8, "{:?}", fills(&record));
}

#[test]
fn by_order_data_say_who_stood_ahead() {
    let order = |time: i64, id, action, side, price: f64, size| {
        let (time, price) = (Timestamp(time), at(price));
        OrderEvent { time, known_at: time, id, action, side, price, size }
    };
    let events = vec![
        order(0, 1, OrderAction::Add, Side::Buy, 99.0, 10.0),
        order(0, 2, OrderAction::Add, Side::Buy, 99.0, 20.0),
        order(0, 3, OrderAction::Add, Side::Sell, 101.0, 20.0),
        // We join behind 30. Then somebody joins behind us, and leaves: that says nothing of those ahead.
        order(10, 4, OrderAction::Add, Side::Buy, 99.0, 500.0),
        order(20, 4, OrderAction::Delete, Side::Buy, 99.0, 0.0),
        // The first ahead is cancelled, the second grows, which puts it behind us.
        order(30, 1, OrderAction::Delete, Side::Buy, 99.0, 0.0),
        order(40, 2, OrderAction::Change, Side::Buy, 99.0, 25.0),
        order(60, 3, OrderAction::Delete, Side::Sell, 101.0, 0.0),
    ];
    let history =
        History::default().with_order_events(events).unwrap().with_prints(vec![print(50, 99.0, 4.0, Side::Sell)]).unwrap();
    let record = run(history, &[], event(0).submit(limit(Side::Buy, 6.0, 99.0)));
    assert_eq!(fills(&record), [(50, 4.0, 99.0)]);
    assert_eq!(record.blotter.fills[0].why.queued_behind, 30.0);
}

#[test]
fn every_way_takes_its_time() {
    let second = Timestamp::NANOS;
    let rows: Vec<_> = (0..10).map(|k| (k * second, 99.0 + k as f64, 101.0 + k as f64)).collect();
    let mut plan = event(0).submit(Ticket::market(0, Side::Buy, quantity(1.0)));
    let record = run_plan(vec![quotes(&rows)], &[], latencies(0.5, 0.75, 2.5), &mut plan);
    // Seen at 0.5 s, there at 1.25 s, where the quote of 1 s stands, known at 3.75 s.
    let order = record.blotter.orders[0];
    assert_eq!((order.decided_at.0, order.arrives_at.0), (second / 2, second / 4 * 5));
    assert_eq!(fills(&record), [(second / 4 * 5, 1.0, 102.0)]);
    assert_eq!(plan.notices.iter().map(|(at, _)| at.0).collect::<Vec<_>>(), [second / 4 * 15]);
    // Quotes are seen half a second late: the first that knows of the position is that of 4 s, or the fifth.
    assert_eq!(plan.positions, [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]);
}

#[test]
fn a_cancel_may_come_too_late() {
    let second = Timestamp::NANOS;
    let rows = [(0, 99.0, 101.0), (second, 99.0, 101.0), (second + 1, 97.0, 98.0), (2 * second, 97.0, 98.0)];
    let cancelled_at = |seconds: f64| {
        let plan = event(0).submit(limit(Side::Buy, 1.0, 99.0)).at(1).cancel(1);
        fills(&run_with(vec![quotes(&rows)], &[], latencies(0.0, seconds, 0.0), plan)).len()
    };
    assert_eq!((cancelled_at(0.0), cancelled_at(0.25)), (0, 1));
}

/// Two-sided quoting: joins the best on both sides, and moves its orders when the market moves.
#[derive(Default)]
struct Maker {
    orders: [Option<trueup::market::OrderId>; 2],
    fills: usize,
}

impl Strategy for Maker {
    fn name(&self) -> &str {
        "maker"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        for (own, side) in self.orders.iter_mut().zip([Side::Buy, Side::Sell]) {
            let Some(best) = view.best(0, side) else { continue };
            let working = own.and_then(|id| view.orders(0).iter().find(|order| order.id == id));
            match working.map(|order| order.kind.limit()) {
                Some(Some(price)) if price == best => {}
                Some(_) => orders.replace(own.unwrap(), None, Some(best)),
                None => *own = Some(orders.submit(Ticket::limit(0, side, quantity(3.0), best))),
            }
        }
    }
    fn on_notice(&mut self, _: &View<'_>, notice: &Notice, _: &mut Orders) {
        self.fills += usize::from(matches!(notice.news, News::Filled { .. }));
    }
}

/// A market of random quotes and trades within them.
fn random_market() -> impl Drawn<Value = History> {
    proptest::collection::vec((1..50_i64, -2..3_i64, 1..4_i64, 1..200_u32, 1..200_u32, 0..4_u8, 1..150_u32), 5..120)
        .prop_map(|steps| {
            let (mut time, mut bid) = (0, 10_000_i64);
            let (mut rows, mut prints) = (Vec::new(), Vec::new());
            for (gap, step, spread, bid_size, ask_size, trade, size) in steps {
                time += gap;
                bid = (bid + step).max(100);
                let (b, a) = (bid as f64 / 100.0, (bid + spread) as f64 / 100.0);
                rows.push((time, b, f64::from(bid_size), a, f64::from(ask_size)));
                match trade {
                    1 => prints.push(print(time, b, f64::from(size), Side::Sell)),
                    2 => prints.push(print(time, a, f64::from(size), Side::Buy)),
                    _ => {}
                }
            }
            sized_quotes(&rows).with_prints(prints).unwrap()
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// Whatever comes: a maker is filled at its limit, never better or worse; nobody holds what was not filled; what works
    /// is what was sent and is not over; and the same seed gives the same bits.
    #[test]
    fn a_maker_is_filled_at_its_limits_and_the_account_adds_up(
        history in random_market(),
        order in 0.0..3e-7_f64,
        model in prop_oneof![Just(QueueModel::Trades), Just(QueueModel::Proportional), Just(QueueModel::Log)],
    ) {
        let settings = Settings { latencies: latencies(0.0, order, order).latencies, max_leverage: 1e3, ..by_queue(model) };
        let once = || {
            let instruments = vec![crate::market_scene::instrument("A")];
            let backtest = trueup::market::Backtest::new(instruments, vec![history.clone()], crate::market_scene::venue(&[]), settings.clone());
            backtest.unwrap().run(&mut Maker::default()).unwrap()
        };
        let record = once();
        let (mut cash, mut held) = (record.ledger.opening().0, 0_i128);
        for fill in &record.blotter.fills {
            let order = record.blotter.order(fill.order_id).unwrap();
            prop_assert!(fill.why.queued_behind >= 0.0 && fill.quantity.0 > 0);
            prop_assert!(fill.filled_at >= order.arrives_at);
            let signed = i128::from(fill.quantity.signed(fill.side).0);
            cash -= signed * i128::from(fill.price.0);
            held += signed;
        }
        prop_assert_eq!(record.ledger.cash().0, cash);
        prop_assert_eq!(i128::from(record.ledger.positions()[0].quantity.0), held);
        for order in &record.blotter.orders {
            let filled: i64 = record.blotter.fills.iter().filter(|f| f.order_id == order.order_id).map(|f| f.quantity.0).sum();
            prop_assert_eq!(filled, order.filled.0);
            prop_assert!(order.filled <= order.quantity);
        }
        prop_assert_eq!(&record, &once());
    }
}

#[test]
fn plans_are_quiet_without_orders() {
    let record = run(book(Vec::new()), &[], Plan::default());
    assert_eq!(record.blotter.orders.len(), 0);
}

/// Ten short over midnight, of which five are bought back 30 s before it; word of that may come after the day was charged.
#[test]
fn a_position_is_not_charged_twice_where_word_of_a_fill_comes_late() {
    let day = 86_400;
    let rows: Vec<_> = [0, 60, day - 30, day + 10, day + 60].iter().map(|s| (s * Timestamp::NANOS, 100.0, 100.0)).collect();
    let order = |side, units| Ticket::market(0, side, quantity(units));
    let plan = event(0).submit(order(Side::Sell, 10.0)).at(2).submit(order(Side::Buy, 5.0));
    let charged = |response| {
        let record =
            run_with(vec![quotes(&rows)], &[("borrow_fee", "held", 0.36)], latencies(0.0, 0.0, response), plan.clone());
        record.ledger.income()[0].charges.total().unwrap().to_f64()
    };
    // 0.001 a day of 1,000, and then of 500. What its owner does not know of yet is charged as it was.
    let expected = |whole: f64, half: f64| 0.001 * (1_000.0 * whole + 500.0 * half) / 86_400.0;
    let [soon, late] = [charged(0.0), charged(60.0)];
    assert!((soon - expected(86_370.0, 90.0)).abs() < 1e-8, "{soon}");
    assert!((late - expected(86_410.0, 50.0)).abs() < 1e-8, "{late}");
}

#[test]
fn reports_do_not_overtake_each_other() {
    let second = Timestamp::NANOS;
    let rows: Vec<_> = (0..400).map(|k| (k * second, 99.0, 101.0)).collect();
    let response = Latency::Exponential { least: 0.0, mean: 30.0 };
    let settings = Settings { latencies: Latencies { response, ..Latencies::default() }, ..settings() };
    let mut plan = (0..100).fold(event(0), |plan, k| plan.at(k).submit(Ticket::market(0, Side::Buy, quantity(1.0))));
    let record = run_plan(vec![quotes(&rows)], &[], Settings { max_leverage: 1e3, ..settings }, &mut plan);
    let ids: Vec<u64> = plan.notices.iter().map(|(_, notice)| notice.order_id.0).collect();
    assert!(ids.len() > 50 && ids.is_sorted(), "{ids:?}");
    let filled: Vec<i64> = record.blotter.fills.iter().map(|fill| fill.filled_at.0).collect();
    assert!(filled.len() == 100 && filled.is_sorted());
}
