//! What own orders move is met by own orders that wait: after purchases the market is higher for them, and they are matched there.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::market_scene::{
    Busy, Plan, event, fills, instrument, limit, of, quantity, quotes, settings, sized_quotes, stop, venue,
};
use crate::ways_scene::same_every_way;
use proptest::prelude::{Just, ProptestConfig, Strategy as Drawn, prop_assert, prop_assert_eq, prop_oneof, proptest};
use trueup::market::{
    AuditSettings, AuditVerdict, Backtest, BacktestError, DepthAction, DepthChange, History, Instrument, News, Notice,
    OrderId, Orders, Price, Print, Quantity, Record, Role, Settings, Side, Strategy, Ticket, TimeInForce, View, audit,
};
use trueup::sim2real::{Parameter, Seed, Simulator, Timestamp};

const SECOND: i64 = Timestamp::NANOS;

/// A purchase of a hundredth of a day's volume moves the price by 10 bps.
const PERMANENT: (&str, &str, f64) = ("permanent_impact", "linear", 1_000.0);

fn traded() -> Instrument {
    Instrument { average_daily_volume: Some(1e6), ..instrument("A") }
}

fn run(history: History, parts: &[(&str, &str, f64)], strategy: &mut dyn Strategy) -> Record {
    backtest(history, parts).run(strategy).unwrap()
}

fn backtest(history: History, parts: &[(&str, &str, f64)]) -> Backtest {
    let settings = Settings { max_leverage: 1e3, ..settings() };
    let plain = venue(parts);
    // What moves back does so within 20 s.
    let recovery = |p: &Parameter| if p.name == "recovery" { 20.0 } else { p.nominal };
    let values: Vec<f64> = plain.parameters().iter().map(recovery).collect();
    Backtest::new(vec![traded()], vec![history], plain.with_values(&values), settings).unwrap()
}

/// Time, side and price of the fills of the limit order that `record` began with.
fn made(record: &Record) -> Vec<(i64, Side, f64)> {
    let limits = |id| record.blotter.order(id).unwrap().kind.limit().is_some();
    let own = record.blotter.fills.iter().filter(|fill| limits(fill.order_id));
    own.map(|fill| (fill.filled_at.0, fill.side, fill.price.to_f64())).collect()
}

fn sold(time: i64, price: f64, size: f64) -> Print {
    Print { time: Timestamp(time), price, size, aggressor: Some(Side::Sell) }
}

/// Buys 10,000 at once, having put `resting` there first.
fn after_buying(resting: Ticket) -> Plan {
    event(0).submit(resting).at(1).submit(Ticket::market(0, Side::Buy, quantity(10_000.0)))
}

#[test]
fn a_sale_that_waits_is_nearer_after_purchases_and_a_purchase_further() {
    // 99.99 to 100.01; what is bought moves it by 0.10. Then it falls to 99.89, 99.91.
    let rows = || {
        let still = (0..5).map(|k| (k * SECOND, 99.99, 100.01));
        let fallen = (5..8).map(|k| (k * SECOND, 99.89, 99.91));
        quotes(&still.chain(fallen).collect::<Vec<_>>())
    };
    let sale = |parts: &[_]| made(&run(rows(), parts, &mut after_buying(limit(Side::Sell, 5.0, 100.08))));
    assert_eq!(sale(&[]), []);
    // The bid is 100.09 from the next quote on: it takes that, less half of what it moves back.
    assert_eq!(sale(&[PERMANENT]), [(2 * SECOND, Side::Sell, 100.08)]);
    let purchase = |price: f64, parts: &[_]| made(&run(rows(), parts, &mut after_buying(limit(Side::Buy, 5.0, price))));
    assert_eq!(purchase(99.95, &[]), [(5 * SECOND, Side::Buy, 99.95)]);
    // The ask falls to 100.01 in the market that was moved.
    assert_eq!(purchase(99.95, &[PERMANENT]), []);
    // As far away as it is then, it is filled again.
    let further = |parts: &[_]| {
        let history = quotes(&[(0, 99.99, 100.01), (SECOND, 99.99, 100.01), (2 * SECOND, 99.80, 99.85)]);
        made(&run(history, parts, &mut after_buying(limit(Side::Buy, 5.0, 99.95))))
    };
    assert_eq!(further(&[PERMANENT]), [(2 * SECOND, Side::Buy, 99.95)]);
}

#[test]
fn what_moves_back_lets_orders_be_where_they_were() {
    let rows: Vec<_> = [0, 1, 2, 100, 200].iter().map(|k| (k * SECOND, 99.99, 100.01)).collect();
    let history = |at: i64| quotes(&rows).with_prints(vec![sold(at * SECOND + 1, 99.99, 150.0)]).unwrap();
    // 100 stand ahead of a bid at 99.99: a sale of 150 reaches it, but not while the market is ten ticks higher.
    let transient = ("transient_impact", "exponential", 1_000.0);
    let of = |at| made(&run(history(at), &[transient], &mut after_buying(limit(Side::Buy, 5.0, 99.99))));
    assert_eq!(of(2), []);
    assert_eq!(of(100), [(100 * SECOND + 1, Side::Buy, 99.99)]);
    assert_eq!(made(&run(history(2), &[], &mut after_buying(limit(Side::Buy, 5.0, 99.99)))).len(), 1);
}

#[test]
fn a_queue_is_that_of_the_level_as_far_away_as_the_order_now_is() {
    // A bid at 99.95, nine ticks below the best; 70 are displayed four ticks lower than that.
    let change = |time: i64, side, price: f64, size| {
        let (time, price) = (Timestamp(time * SECOND), Price::nearest(price).unwrap());
        DepthChange { time, known_at: time, side, action: DepthAction::Set, price, size }
    };
    let book = vec![
        change(0, Side::Sell, 100.01, 2e4),
        change(0, Side::Buy, 99.99, 40.0),
        change(0, Side::Buy, 99.95, 10.0),
        change(0, Side::Buy, 99.85, 70.0),
        change(1, Side::Sell, 100.02, 1.0),
        change(2, Side::Sell, 100.02, 2.0),
        change(9, Side::Sell, 100.02, 3.0),
    ];
    let prints = vec![sold(3 * SECOND, 99.95, 60.0), sold(4 * SECOND, 99.85, 60.0), sold(5 * SECOND, 99.85, 13.0)];
    let history = || History::default().with_depth(book.clone()).unwrap().with_prints(prints.clone()).unwrap();
    let of = |parts: &[_]| {
        let record = run(history(), parts, &mut after_buying(limit(Side::Buy, 5.0, 99.95)));
        let made = record.blotter.fills.iter().filter(|fill| fill.why.role == Role::Maker);
        made.map(|f| (f.filled_at.0 / SECOND, f.quantity.to_f64(), f.why.queued_behind)).collect::<Vec<_>>()
    };
    assert_eq!(of(&[]), [(3, 5.0, 10.0)]);
    assert_eq!(of(&[PERMANENT]), [(5, 3.0, 70.0)]);
}

#[test]
fn bars_are_moved_as_the_market_stands_when_they_open() {
    // 100 flat; what is bought at the open of the second bar moves all by 0.10.
    let history = || of(&[[100.0, 100.02, 99.98, 100.0]; 5]);
    let plan = |resting| event(0).submit(Ticket::market(0, Side::Buy, quantity(10_000.0))).submit(resting);
    let made = |parts: &[_], resting| made(&run(history(), parts, &mut plan(resting)));
    let minute = crate::market_scene::MINUTE;
    assert_eq!(made(&[], limit(Side::Sell, 5.0, 100.09)), []);
    assert_eq!(made(&[PERMANENT], limit(Side::Sell, 5.0, 100.09)), [(2 * minute, Side::Sell, 100.09)]);
    assert_eq!(made(&[], limit(Side::Buy, 5.0, 99.99)), [(2 * minute, Side::Buy, 99.99)]);
    assert_eq!(made(&[PERMANENT], limit(Side::Buy, 5.0, 99.99)), []);
    // A stop to buy is set off by what was bought, and pays what it finds moved: 0.10.
    let stopped = |parts: &[_]| fills(&run(history(), parts, &mut plan(stop(Side::Buy, 5.0, 100.05)))).len();
    assert_eq!((stopped(&[]), stopped(&[PERMANENT])), (1, 2));
}

#[test]
fn a_limit_is_used_up_by_what_an_order_moves_itself() {
    // The ask is 100.01. Ten ticks of room are what 20,000 pay in the mean: then the market is twice as far.
    let rows: Vec<_> = (0..4).map(|k| (k * SECOND, 99.99, 1e6, 100.01, 1e6)).collect();
    let of = |ticket| {
        let record = run(sized_quotes(&rows), &[PERMANENT], &mut event(0).submit(ticket));
        fills(&record).iter().map(|fill| fill.1).sum::<f64>()
    };
    assert_eq!(of(limit(Side::Buy, 15_000.0, 100.11)), 15_000.0);
    assert_eq!(of(limit(Side::Buy, 90_000.0, 100.11)), 20_000.0);
    let whole = |units| limit(Side::Buy, units, 100.11).working(TimeInForce::FillOrKill);
    assert_eq!((of(whole(20_000.0)), of(whole(20_001.0))), (20_000.0, 0.0));
}

/// Trades as it is told, one thing an event, and is flat at the end.
#[derive(Clone)]
struct RoundTrip {
    steps: Vec<(u8, u32, i64)>,
    events: usize,
}

impl Strategy for RoundTrip {
    fn name(&self) -> &str {
        "round trip"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let over = self.events.saturating_sub(self.steps.len());
        if let Some((kind, units, ticks)) = self.steps.get(self.events) {
            let (side, units) = ([Side::Buy, Side::Sell][usize::from(kind % 2)], f64::from(*units));
            match kind / 2 {
                0 => _ = orders.submit(Ticket::market(0, side, quantity(units))),
                _ => _ = orders.submit(limit(side, units, 100.0 + 0.01 * *ticks as f64)),
            }
        } else if over == 1 {
            view.orders(0).iter().for_each(|order| orders.cancel(order.id));
        } else if over == 4 && view.position(0) != Quantity::ZERO {
            let held = view.position(0);
            let side = if held > Quantity::ZERO { Side::Sell } else { Side::Buy };
            orders.submit(Ticket::market(0, side, held.abs()));
        }
        self.events += 1;
    }
}

/// Quotes on both sides, and takes now and then.
#[derive(Default)]
struct Active {
    orders: [Option<OrderId>; 2],
    events: usize,
}

impl Strategy for Active {
    fn name(&self) -> &str {
        "active"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        self.events += 1;
        if self.events.is_multiple_of(4) {
            let side = if self.events.is_multiple_of(12) { Side::Sell } else { Side::Buy };
            orders.submit(Ticket::market(0, side, quantity(700.0)));
        }
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
        assert!(!matches!(notice.news, News::Filled { quantity, .. } if quantity.0 <= 0));
    }
}

/// A market of random quotes and trades at them.
fn random_market() -> impl Drawn<Value = History> {
    proptest::collection::vec((1..50_i64, -2..3_i64, 1..4_i64, 1..200_u32, 0..4_u8, 1..150_u32), 5..80).prop_map(|steps| {
        let (mut time, mut bid) = (0, 10_000_i64);
        let (mut rows, mut prints) = (Vec::new(), Vec::new());
        for (gap, step, spread, size, trade, traded) in steps {
            time += gap * SECOND;
            bid += step;
            let (b, a) = (bid as f64 / 100.0, (bid + spread) as f64 / 100.0);
            rows.push((time, b, f64::from(size), a, f64::from(size)));
            let print = |price, aggressor| Print {
                time: Timestamp(time + SECOND / 2),
                price,
                size: f64::from(traded),
                aggressor: Some(aggressor),
            };
            match trade {
                1 => prints.push(print(b, Side::Sell)),
                2 => prints.push(print(a, Side::Buy)),
                _ => {}
            }
        }
        sized_quotes(&rows).with_prints(prints).unwrap()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]
    /// Whoever rested was filled where the moved market was, and at its limit; a law of no size moves no bit.
    #[test]
    fn nothing_is_filled_outside_the_moved_market(
        history in random_market(),
        law in prop_oneof![Just("linear"), Just("square_root"), Just("exponential")],
        bps in 1.0..5_000.0_f64,
        audited in proptest::bool::weighted(0.2),
    ) {
        let name = if law == "exponential" { "transient_impact" } else { "permanent_impact" };
        let of = |parts: &[(&str, &str, f64)]| run(history.clone(), parts, &mut Active::default());
        let record = of(&[(name, law, bps)]);
        for fill in &record.blotter.fills {
            let why = fill.why;
            let quote = history.quotes().all().get(why.row).unwrap();
            let moved = [quote.bid(), quote.ask()].map(|p| Price::nearest(p.unwrap()).unwrap().plus(why.displaced));
            prop_assert_eq!(why.band, moved);
            if why.role == Role::Maker {
                let within = match fill.side {
                    Side::Buy => fill.price >= moved[0],
                    Side::Sell => fill.price <= moved[1],
                };
                prop_assert!(within, "{:?} at {} in {:?}", fill.side, fill.price.to_f64(), why);
            }
        }
        if audited {
            let backtest = backtest(history.clone(), &[(name, law, bps)]);
            let make = |_: &[History]| -> Result<Box<dyn Strategy>, BacktestError> { Ok(Box::new(Active::default())) };
            let found = audit(&backtest, make, AuditSettings { cuts: 5, seed: Seed(1) }, &|_, _| {}).unwrap();
            prop_assert_eq!(found.verdict, AuditVerdict::Clean, "{}", found.summary);
        }
        let (bare, nothing) = (of(&[]), of(&[(name, law, 0.0)]));
        prop_assert_eq!(&bare.equity, &nothing.equity);
        prop_assert_eq!(&bare.blotter.fills, &nothing.blotter.fills);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    /// On streams, stopped and forked a run with all that is remembered of own orders comes to the same.
    #[test]
    fn it_is_the_same_every_way(history in random_market(), at_a_time in 1..9_usize) {
        let parts = [("queue_position", "", 0.7), ("stale_quotes", "", 2.5), ("transient_impact", "exponential", 40_000.0)];
        let backtest = backtest(history, &parts);
        let record = backtest.run(&mut Busy::default()).unwrap();
        same_every_way(&backtest, &record, &Busy::default(), at_a_time);
    }

    /// In a market that stands still nobody gains from what own orders move, be they market orders or limits, nearer or further.
    #[test]
    fn no_round_trip_gains_from_own_impact(
        steps in proptest::collection::vec((0..4_u8, 1..9_000_u32, -40..41_i64), 1..25),
        law in prop_oneof![Just("linear"), Just("square_root"), Just("exponential")],
        bps in 100.0..6_000.0_f64,
        depth in prop_oneof![Just(1e7), Just(2_000.0)],
    ) {
        let rows: Vec<_> = (0..steps.len() as i64 + 8).map(|k| (k * 3 * SECOND, 99.995, depth, 100.005, depth)).collect();
        let name = if law == "exponential" { "transient_impact" } else { "permanent_impact" };
        let settings = Settings { max_leverage: 1e6, ..settings() };
        let plain = venue(&[(name, law, bps)]);
        let recovery = |p: &Parameter| if p.name == "recovery" { 20.0 } else { p.nominal };
        let values: Vec<f64> = plain.parameters().iter().map(recovery).collect();
        let fine = Instrument { tick_size: 0.005, ..traded() };
        let backtest = Backtest::new(vec![fine], vec![sized_quotes(&rows)], plain.with_values(&values), settings).unwrap();
        let record = backtest.run(&mut RoundTrip { steps, events: 0 }).unwrap();
        prop_assert_eq!(record.ledger.positions()[0].quantity, Quantity::ZERO);
        prop_assert!(record.ledger.equity().unwrap() <= record.ledger.opening(), "{:?}", fills(&record));
    }
}
