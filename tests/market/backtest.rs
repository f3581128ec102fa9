//! The backtest as its users meet it: where orders fill, what they cost, and that the account adds up.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::collections::BTreeMap;

use crate::market_scene::{MINUTE, bar, bars, fills, instrument, of, quotes, settings, venue};
use proptest::prelude::*;
use trueup::market::metric::{Costs, Counts, FillBands, Metrics};
use trueup::market::{
    Backtest, Bar, Cash, History, Instrument, Orders, Quantity, Quotes, Reason, Record, Reference, Settings, Side, Status,
    Strategy, View, check_strategy,
};
use trueup::sim2real::{Seed, Timestamp};
use trueup::strategies;

fn minute(k: i64) -> Timestamp {
    Timestamp(k * MINUTE)
}

fn run_with(
    histories: Vec<History>,
    parts: &[(&str, &str, f64)],
    settings: Settings,
    plan: &[(usize, usize, Side, f64)],
) -> Record {
    let instruments = ["A", "B", "C"][..histories.len()].iter().map(|s| instrument(s)).collect();
    Backtest::new(instruments, histories, venue(parts), settings).unwrap().run(&mut Plan::new(plan)).unwrap()
}

fn run(history: History, parts: &[(&str, &str, f64)], plan: &[(usize, usize, Side, f64)]) -> Record {
    run_with(vec![history], parts, settings(), plan)
}

/// Sends given orders at given events, and remembers the positions it was shown.
struct Plan {
    orders: BTreeMap<usize, Vec<(usize, Side, f64)>>,
    events: usize,
    seen: Vec<f64>,
}

impl Plan {
    /// Event, instrument, side and quantity.
    fn new(plan: &[(usize, usize, Side, f64)]) -> Self {
        let mut orders = BTreeMap::<usize, Vec<_>>::new();
        for (event, instrument, side, quantity) in plan {
            orders.entry(*event).or_default().push((*instrument, *side, *quantity));
        }
        Self { orders, events: 0, seen: Vec::new() }
    }
}

impl Strategy for Plan {
    fn name(&self) -> &str {
        "plan"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        self.seen.push(view.position(0).to_f64());
        for (instrument, side, quantity) in self.orders.get(&self.events).into_iter().flatten() {
            orders.market(*instrument, *side, Quantity::nearest(*quantity).unwrap());
        }
        self.events += 1;
    }
}

const WALK: [(f64, f64); 4] = [(10.0, 11.0), (12.0, 13.0), (14.0, 15.0), (16.0, 17.0)];

#[test]
fn an_order_meets_the_next_open_and_never_the_close_it_was_decided_on() {
    let record = run(bars(&WALK), &[], &[(0, 0, Side::Buy, 5.0)]);
    assert_eq!(fills(&record), [(MINUTE, 5.0, 12.0)]);
    let fill = record.blotter.fills[0];
    assert_eq!((fill.cost.timing, fill.cost.spread_and_impact, fill.cost.rounding), (5.0, 0.0, 0.0));
    assert_eq!(record.ledger.equity().unwrap().to_f64(), 100_000.0 + 5.0 * (17.0 - 12.0));
}

#[test]
fn a_result_hangs_on_the_prices_of_its_fills_no_more_than_its_bars_are_wide() {
    let history =
        of(&[[100.0; 4], [101.0, 103.0, 100.5, 102.0], [102.0, 102.0, 102.0, 102.0], [104.0, 105.0, 101.0, 104.0]]);
    let record = run(history, &[], &[(0, 0, Side::Buy, 10.0), (2, 0, Side::Sell, 4.0)]);
    assert_eq!(fills(&record), [(MINUTE, 10.0, 101.0), (3 * MINUTE, 4.0, 104.0)]);
    let FillBands { optimistic, expected, pessimistic } = FillBands::of(&record).unwrap();
    // Bought at 101 where 100.5 to 103 was paid, sold at 104 where 101 to 105 was.
    let gains = [optimistic - expected, expected - pessimistic].map(|gain| (gain * 100.0).round() / 100.0);
    assert_eq!(gains, [10.0 * 0.5 + 4.0 * 1.0, 10.0 * 2.0 + 4.0 * 3.0]);
    let [best, worst] = FillBands::curves(&record);
    let of_each = |k: usize| [best[k] - record.equity[k].equity, record.equity[k].equity - worst[k]].map(f64::round);
    assert_eq!((0..4).map(of_each).collect::<Vec<_>>(), [[0.0, 0.0], [5.0, 20.0], [5.0, 20.0], [9.0, 32.0]]);
}

#[test]
fn a_delayed_order_meets_the_first_bar_that_opens_after_its_arrival() {
    for (seconds, expected) in
        [(0.001, (2 * MINUTE, 5.0, 14.0)), (60.0, (2 * MINUTE, 5.0, 14.0)), (59.0, (2 * MINUTE, 5.0, 14.0))]
    {
        let record = run(bars(&WALK), &[("command_delay", "", seconds)], &[(0, 0, Side::Buy, 5.0)]);
        assert_eq!(fills(&record), [expected], "{seconds} s");
    }
}

#[test]
fn with_quotes_what_carries_the_stamp_of_the_decision_is_met_and_what_carries_that_of_the_arrival_is_not() {
    let second = Timestamp::NANOS;
    let rows = [
        (0, 99.0, 101.0),
        (second, 100.0, 102.0),
        (second, 101.0, 103.0),
        (2 * second, 104.0, 106.0),
        (3 * second, 1.0, 2.0),
    ];
    let at =
        |seconds: f64, event| fills(&run(quotes(&rows), &[("command_delay", "", seconds)], &[(event, 0, Side::Buy, 1.0)]));
    assert_eq!(at(0.0, 0), [(0, 1.0, 101.0)]);
    assert_eq!(at(0.0, 1), [(second, 1.0, 103.0)], "the last of one stamp");
    assert_eq!(at(1.0, 0), [(second, 1.0, 101.0)], "strictly before the arrival");
    assert_eq!(at(1.5, 0), [(1_500_000_000, 1.0, 103.0)]);
    assert_eq!(at(2.0, 0), [(2 * second, 1.0, 103.0)]);
    let sold = run(quotes(&rows), &[], &[(0, 0, Side::Sell, 1.0)]);
    assert_eq!(fills(&sold), [(0, 1.0, 99.0)]);
    assert_eq!((sold.blotter.orders[0].seen_bid, sold.blotter.orders[0].seen_ask), (Some(99.0), Some(101.0)));
}

#[test]
fn an_empty_side_is_waited_for() {
    let rows = [(0, 99.0, 101.0), (1, 99.0, 0.0), (2, 98.0, 0.0), (3, 99.0, 102.0), (4, 99.0, 103.0)];
    assert_eq!(fills(&run(quotes(&rows), &[], &[(1, 0, Side::Buy, 1.0)])), [(3, 1.0, 102.0)]);
    assert_eq!(fills(&run(quotes(&rows), &[], &[(1, 0, Side::Sell, 1.0)])), [(1, 1.0, 99.0)]);
}

#[test]
fn the_reference_is_the_mid_where_a_mechanism_adds_the_spread() {
    let rows = [(0, 99.0, 101.0), (1, 99.0, 101.0)];
    let price = |parts: &[(&str, &str, f64)], reference| {
        fills(&run_with(vec![quotes(&rows)], parts, Settings { reference, ..settings() }, &[(0, 0, Side::Buy, 1.0)]))[0].2
    };
    assert_eq!(price(&[], None), 101.0);
    assert_eq!(price(&[("half_spread", "fraction", 0.5)], None), 100.5);
    assert_eq!(price(&[], Some(Reference::Mid)), 100.0);
    assert_eq!(price(&[("half_spread", "fraction", 0.5)], Some(Reference::Touch)), 101.5);
}

#[test]
fn a_model_price_off_the_tick_is_moved_against_the_order_and_counted_as_rounding() {
    // 1 bp of the last close, 11.00, is 0.0011 above the open of 12.00: 12.01 for a buyer.
    let bought = run(bars(&WALK), &[("half_spread", "bps", 1.0)], &[(0, 0, Side::Buy, 100.0)]);
    assert_eq!(fills(&bought), [(MINUTE, 100.0, 12.01)]);
    let cost = bought.blotter.fills[0].cost;
    assert!((cost.spread_and_impact - 0.11).abs() < 1e-9 && (cost.rounding - 0.89).abs() < 1e-9, "{cost:?}");
    let sold = run(bars(&WALK), &[("half_spread", "bps", 1.0)], &[(0, 0, Side::Sell, 100.0)]);
    assert_eq!(fills(&sold), [(MINUTE, 100.0, 11.99)]);
}

#[test]
fn the_parts_of_the_cost_are_what_was_lost_against_the_prices_of_the_decisions() {
    let parts = [("half_spread", "bps", 7.0), ("commission", "bps", 2.0)];
    let record = run(bars(&WALK), &parts, &[(0, 0, Side::Buy, 100.0), (1, 0, Side::Sell, 100.0)]);
    let costs = Costs::of(&record);
    // On paper: bought at 11 and sold at 13.
    let paper = 100.0 * (13.0 - 11.0);
    let actual = record.ledger.equity().unwrap().to_f64() - 100_000.0;
    assert!((costs.shortfall - (paper - actual)).abs() < 1e-6, "{costs:?}");
    assert!(costs.fees > 0.0);
    assert!((costs.shortfall_bps.unwrap() - costs.shortfall / 2_400.0 * 1e4).abs() < 1e-6);
}

#[test]
fn what_the_volume_does_not_allow_is_cancelled_in_whole_lots() {
    let all = [1_000.0, 105.0, 3.0, 1_000.0].iter().enumerate().map(|(k, v)| bar(k as i64, 10.0, 10.0, *v)).collect();
    let history = History::new(all, Quotes::default()).unwrap();
    let record = run(
        history,
        &[("participation_cap", "", 0.1)],
        &[(0, 0, Side::Buy, 50.0), (1, 0, Side::Buy, 50.0), (2, 0, Side::Buy, 50.0)],
    );
    assert_eq!(fills(&record), [(MINUTE, 10.0, 10.0), (3 * MINUTE, 50.0, 10.0)]);
    let status: Vec<Status> = record.blotter.orders.iter().map(|order| order.status).collect();
    assert_eq!(status, [Status::Cancelled, Status::Cancelled, Status::Filled]);
    assert_eq!(record.ledger.positions()[0].quantity.to_f64(), 60.0);
}

#[test]
fn an_order_alive_at_the_end_is_unfilled() {
    let record = run(bars(&WALK), &[], &[(3, 0, Side::Buy, 1.0)]);
    let counts = Counts::of(&record);
    assert_eq!((counts.orders, counts.unfilled, counts.fills, counts.events), (1, 1, 0, 4));
    let late = run(quotes(&[(0, 99.0, 101.0), (1, 99.0, 101.0)]), &[("command_delay", "", 1.0)], &[(0, 0, Side::Buy, 1.0)]);
    assert_eq!(Counts::of(&late).unfilled, 1);
    let last = run(quotes(&[(0, 99.0, 101.0), (1, 99.0, 101.0)]), &[], &[(1, 0, Side::Buy, 1.0)]);
    assert_eq!(last.equity.last().unwrap().equity, 100_000.0 - 1.0, "half the spread is lost with the last fill");
}

#[test]
fn orders_that_cannot_be_are_refused_with_a_reason() {
    let plan = [
        (0, 0, Side::Buy, 0.0),
        (0, 0, Side::Buy, -1.0),
        (0, 0, Side::Buy, 1.5),
        (0, 9, Side::Buy, 1.0),
        (0, 1, Side::Buy, 1.0),
        (0, 0, Side::Buy, 9_091.0),
        (0, 0, Side::Buy, 9_090.0),
        (0, 0, Side::Sell, 18_181.0),
        (0, 0, Side::Sell, 18_180.0),
    ];
    let late = History::new(vec![bar(2, 10.0, 10.0, 1.0)], Quotes::default()).unwrap();
    let record = run_with(vec![bars(&WALK), late], &[], Settings { max_leverage: 1.0, ..settings() }, &plan);
    let reasons: Vec<Reason> = record.blotter.rejections.iter().map(|r| r.reason).collect();
    use Reason::{Leverage, NoPrice, NoQuantity, OffLot, UnknownInstrument};
    // 100,000 at 11: 9,090 shares, long or short, what is on its way counted; a smaller position is always allowed.
    assert_eq!(reasons, [NoQuantity, NoQuantity, OffLot, UnknownInstrument, NoPrice, Leverage, Leverage]);
    assert_eq!(record.blotter.orders.len(), 2);
    assert_eq!(Counts::of(&record).rejected[&Leverage], 2);
}

#[test]
fn a_fill_at_the_time_of_an_event_is_not_seen_by_it() {
    let other = History::new((0..4).map(|k| bar(k, 5.0, 5.0, 1.0)).collect(), Quotes::default()).unwrap();
    let mut plan = Plan::new(&[(0, 0, Side::Buy, 1.0)]);
    let backtest = Backtest::new(vec![instrument("A"), instrument("B")], vec![bars(&WALK), other], venue(&[]), settings());
    backtest.unwrap().run(&mut plan).unwrap();
    // Decided with A at minute 1 and filled then at the open; B at minute 1 rests on the same instant.
    assert_eq!(plan.seen, [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]);
}

#[test]
fn impacts_use_the_days_that_are_over() {
    let day = 1_440;
    let of_day = |d: i64, volume: f64| (0..3).map(move |k| bar(d * day + k, 100.0, 100.0, volume));
    let all = of_day(0, 100.0).chain(of_day(1, 300.0)).chain(of_day(2, 1e9)).collect();
    let history = History::new(all, Quotes::default()).unwrap();
    // No day is over at the first order: no impact. At the second, 300 a day; at the third, (300 + 900) / 2.
    let plan = [(0, 0, Side::Buy, 3.0), (3, 0, Side::Buy, 3.0), (6, 0, Side::Buy, 3.0)];
    let mut settings = settings();
    settings.max_leverage = 100.0;
    let record = run_with(vec![history], &[("linear_impact", "", 10_000.0)], settings, &plan);
    let prices: Vec<f64> = record.blotter.fills.iter().map(|f| f.price.to_f64()).collect();
    assert_eq!(prices, [100.0, 101.0, 100.5]);
}

#[test]
fn a_price_no_market_has_ends_the_run_with_a_hint() {
    let backtest =
        Backtest::new(vec![instrument("A")], vec![bars(&WALK)], venue(&[("half_spread", "bps", 20_000.0)]), settings());
    let error = backtest.unwrap().run(&mut Plan::new(&[(0, 0, Side::Sell, 1.0)])).unwrap_err().to_string();
    assert!(error.starts_with("order 1 for A at 1970-01-01T00:01:00Z: its mechanisms give a price of -10"), "{error}");
    assert!(error.contains("hint:"));
}

#[test]
fn a_setup_that_cannot_be_is_refused() {
    let error = |instruments: Vec<Instrument>, histories: Vec<History>, settings: Settings| {
        Backtest::new(instruments, histories, venue(&[]), settings).unwrap_err().to_string()
    };
    assert!(error(vec![instrument("A")], vec![], settings()).contains("1 instruments and data for 0"));
    assert!(error(vec![instrument("A")], vec![History::default()], settings()).contains("nothing to run on"));
    let odd = Instrument { tick_size: 0.0, ..instrument("A") };
    assert!(error(vec![odd], vec![bars(&WALK)], settings()).contains("tick_size 0"));
    for bad in [0.0, -1.0, f64::NAN] {
        assert!(
            error(vec![instrument("A")], vec![bars(&WALK)], Settings { max_leverage: bad, ..settings() })
                .contains("max_leverage")
        );
    }
}

#[test]
fn same_seed_same_bits() {
    let parts = [("half_spread", "bps", 3.0), ("commission", "bps", 1.0), ("command_delay", "", 0.5)];
    let plan = [(0, 0, Side::Buy, 7.0), (1, 0, Side::Sell, 9.0)];
    let first = run(bars(&WALK), &parts, &plan);
    assert_eq!(first, run(bars(&WALK), &parts, &plan));
    assert_eq!(Metrics::of(&first).unwrap(), Metrics::of(&run(bars(&WALK), &parts, &plan)).unwrap());
}

/// Shorter runs and longer ones, with fewer orders and more: of what was there before nothing is left.
#[test]
fn a_run_in_the_memory_of_another_is_that_in_memory_of_its_own() {
    let long: Vec<(f64, f64)> = (0..40).map(|k| (10.0 + f64::from(k % 7), 10.0 + f64::from(k % 5))).collect();
    let plan: Vec<_> = (0..30).map(|k| (k, 0, if k % 3 == 0 { Side::Sell } else { Side::Buy }, 5.0)).collect();
    let of = |bars: History| {
        let parts = [("half_spread", "bps", 3.0), ("commission", "bps", 1.0)];
        Backtest::new(vec![instrument("A")], vec![bars], venue(&parts), settings()).unwrap()
    };
    let whole = of(bars(&long));
    let short = whole.on(vec![bars(&WALK)]).unwrap();
    let alone = |bars: &[(f64, f64)], plan: &[_]| of(self::bars(bars)).run(&mut Plan::new(plan)).unwrap();
    let again = |backtest: &Backtest, plan: &[_]| {
        let record = backtest.run(&mut Plan::new(plan)).unwrap();
        backtest.recycle(record.clone());
        record
    };
    let first = again(&whole, &plan);
    assert!(first.blotter.fills.len() > 10, "{}", first.blotter.fills.len());
    assert_eq!(first, alone(&long, &plan));
    assert_eq!(again(&short, &plan[..1]), alone(&WALK, &plan[..1]));
    assert_eq!(again(&whole, &plan), first);
    assert_eq!(again(&whole, &[]), alone(&long, &[]));
    assert_eq!(again(&whole, &plan), first);
}

#[test]
fn metrics_without_trades_are_defined_or_none() {
    let metrics = Metrics::of(&run(bars(&WALK), &[], &[])).unwrap();
    assert_eq!((metrics.total_return, metrics.turnover, metrics.exposure), (Some(0.0), Some(0.0), Some(0.0)));
    assert_eq!((metrics.hit_rate, metrics.returns.sharpe, metrics.max_drawdown, metrics.cagr), (None, None, None, None));
    assert_eq!(metrics.costs.shortfall_bps, None);
}

/// Buys where the price is about to rise: it was given the future by whoever made it.
struct Leak(Vec<Bar>);

impl Strategy for Leak {
    fn name(&self) -> &str {
        "leak"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let now = view.now();
        if let (Some(next), Some(price)) = (self.0.iter().find(|bar| bar.known_at > now), view.price(0))
            && next.close > price
        {
            orders.market(0, Side::Buy, Quantity::nearest(1.0).unwrap());
        }
    }
}

#[test]
fn a_strategy_that_sees_the_future_is_found_out() {
    let error = check_strategy(|histories| Box::new(Leak(histories[0].bars().to_vec())), Seed(1)).unwrap_err();
    assert!(error.to_string().contains("saw the future"), "{error}");
}

/// Decides by a counter that outlives the run.
struct Moody(std::sync::Arc<std::sync::atomic::AtomicUsize>);

impl Strategy for Moody {
    fn name(&self) -> &str {
        "moody"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, _: &View<'_>, orders: &mut Orders) {
        if self.0.fetch_add(1, std::sync::atomic::Ordering::Relaxed).is_multiple_of(7) {
            orders.market(0, Side::Buy, Quantity::nearest(1.0).unwrap());
        }
    }
}

#[test]
fn a_strategy_that_decides_differently_twice_is_found_out() {
    let moods = std::sync::Arc::new(std::sync::atomic::AtomicUsize::new(0));
    let error = check_strategy(|_| Box::new(Moody(moods.clone())), Seed(1)).unwrap_err();
    assert!(error.to_string().contains("two runs"), "{error}");
}

/// A whole run against one written apart from it in Python, in floating point and with numpy:
///
/// ```text
/// close[k] = round(10000 + 1000 sin(k / 40) + 300 sin(k / 7)) cents, k = 0 .. 2999, a minute each; open[k] = close[k - 1]
/// long 0.99 of equity in whole shares while sum(close[k-9..=k]) * 50 > sum(close[k-49..=k]) * 10, else flat
/// fill at open[k + 1] +- 1 bp of close[k], to the cent against the order; fee 0.5 bps of the price before that cent
/// drawdown = max(1 - e / max so far)
/// ```
#[test]
fn a_run_is_as_computed_with_numpy() {
    let cents = |k: i64| (10_000.0 + 1_000.0 * (k as f64 / 40.0).sin() + 300.0 * (k as f64 / 7.0).sin()).round() / 100.0;
    let all = (0..3_000).map(|k| bar(k, cents((k - 1).max(0)), cents(k), 1e6)).collect();
    let history = History::new(all, Quotes::default()).unwrap();
    let settings = Settings::with_cash(Cash::nearest(1e6).unwrap());
    let parts = [("half_spread", "bps", 1.0), ("commission", "bps", 0.5)];
    let backtest = Backtest::new(vec![instrument("A")], vec![history], venue(&parts), settings).unwrap();
    let table = toml::from_str("kind = 'sma_cross'\nfast = 10\nslow = 50").unwrap();
    let record = backtest.run(strategies::build(&table).unwrap().as_mut()).unwrap();
    let metrics = Metrics::of(&record).unwrap();
    assert_eq!(record.blotter.fills.len(), 51);
    for (found, expected) in [
        (metrics.final_equity, 2_908_140.191_522_862),
        (metrics.costs.fees, 4_289.718_477_138),
        (metrics.max_drawdown.unwrap().depth, 0.099_628_428_434_417_1),
        (metrics.turnover.unwrap(), 49.364_240_172_344_545),
    ] {
        assert!((found - expected).abs() <= 1e-9 * expected, "{found} is not {expected}");
    }
    assert_eq!(metrics.max_drawdown.unwrap().trough_at, minute(1_962));
    let returns = metrics.returns;
    assert_eq!((returns.daily_returns, returns.sharpe, metrics.cagr), (2, None, None), "three days make no year");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Over any orders on any walk, what the blotter says and what the account holds are the same to the last unit.
    #[test]
    fn fills_and_account_reconcile(
        walk in proptest::collection::vec((5.0..50.0_f64, 5.0..50.0_f64), 4..40),
        plan in proptest::collection::vec((0..80_usize, 0..2_usize, any::<bool>(), 1..400_i32), 0..60),
    ) {
        let plan: Vec<_> = plan
            .into_iter()
            .map(|(event, k, buy, lots)| (event, k, if buy { Side::Buy } else { Side::Sell }, f64::from(lots)))
            .collect();
        let parts =
            [("half_spread", "bps", 3.3), ("commission", "bps", 1.7), ("participation_cap", "", 0.1), ("command_delay", "", 30.0)];
        let other: Vec<(f64, f64)> = walk.iter().map(|(open, close)| (*close, *open)).collect();
        let record = run_with(vec![bars(&walk), bars(&other)], &parts, settings(), &plan);
        let (mut cash, mut held, mut fees) = (record.ledger.opening().0, [0_i128; 2], 0_i128);
        for fill in &record.blotter.fills {
            let signed = i128::from(fill.quantity.signed(fill.side).0);
            cash -= signed * i128::from(fill.price.0) + fill.fee.0;
            held[fill.instrument] += signed;
            fees += fill.fee.0;
            prop_assert_eq!(fill.price.0 % 10_000_000, 0);
        }
        let positions = record.ledger.positions();
        prop_assert_eq!(record.ledger.cash().0, cash);
        prop_assert_eq!([i128::from(positions[0].quantity.0), i128::from(positions[1].quantity.0)], held);
        let gains: i128 = positions.iter().map(|p| p.realised.0 + p.value().0 - p.basis.0).sum();
        prop_assert_eq!(record.ledger.equity().unwrap().0, record.ledger.opening().0 + gains - fees);
        let metrics = Metrics::of(&record).unwrap();
        prop_assert!(metrics.final_equity.is_finite());
    }
}
