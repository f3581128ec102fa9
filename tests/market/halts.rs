//! Halts: nothing is filled in them, whatever the data; what waits meets the first price after them.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::sync::Arc;

use crate::market_scene::{Busy, Plan, event, fills, instrument, limit, quantity, quotes, settings, status, stop, venue};
use crate::ways_scene::same_every_way;
use proptest::prelude::*;
use trueup::market::{
    AuditSettings, AuditVerdict, Backtest, BacktestError, Bar, Calendar, DepthAction, DepthChange, Halt, History, Level,
    Matching, Orders, Price, Print, Quotes, Reason, Record, Settings, Side, Status, Strategy, Ticket, TimeInForce, View,
    WhileHalted, audit,
};
use trueup::sim2real::{Seed, Timestamp};

const SECOND: i64 = Timestamp::NANOS;

fn halt(from: i64, to: i64) -> Halt {
    Halt { instrument: 0, from: Timestamp(from), to: Timestamp(to), reason: Some("news".into()) }
}

fn halted(halts: Vec<Halt>, halted: WhileHalted) -> Settings {
    Settings { halts, matching: Matching { halted, ..Matching::default() }, max_leverage: 1e3, ..settings() }
}

fn run_in(history: History, settings: Settings, mut plan: Plan) -> Record {
    let backtest = Backtest::new(vec![instrument("A")], vec![history], venue(&[]), settings).unwrap();
    backtest.run(&mut plan).unwrap()
}

/// Quotes every ten seconds, a cent higher each time; trading is halted from 25 s to 45 s.
fn rising() -> History {
    let rows: Vec<_> = (0..8).map(|k| (10 * k * SECOND, 99.0 + 0.01 * k as f64, 101.0 + 0.01 * k as f64)).collect();
    quotes(&rows)
}

fn run(plan: Plan) -> Record {
    run_in(rising(), halted(vec![halt(25 * SECOND, 45 * SECOND)], WhileHalted::Rest), plan)
}

#[test]
fn what_comes_in_a_halt_meets_the_first_price_after_it() {
    let buy = || Ticket::market(0, Side::Buy, quantity(1.0));
    let record = run(event(1).submit(buy()).at(3).submit(buy()).at(4).submit(buy()));
    // Those of 30 s and 40 s wait for the quote of 50 s.
    assert_eq!(fills(&record), [(10 * SECOND, 1.0, 101.01), (50 * SECOND, 1.0, 101.05), (50 * SECOND, 1.0, 101.05)]);
    assert_eq!(record.halts[0].rows, 2);
    let immediate = |time| run(event(3).submit(buy().working(time))).blotter.orders[0];
    for time in [TimeInForce::ImmediateOrCancel, TimeInForce::FillOrKill] {
        let order = immediate(time);
        assert_eq!((order.status, order.reason), (Status::Rejected, Some(Reason::Halted)));
    }
}

#[test]
fn a_run_may_refuse_what_comes_in_a_halt() {
    let plan = event(1).submit(limit(Side::Buy, 1.0, 98.0)).at(3).submit(limit(Side::Buy, 1.0, 98.5));
    let plan = plan.at(3).submit(Ticket::market(0, Side::Buy, quantity(1.0))).at(5).submit(limit(Side::Buy, 1.0, 98.7));
    let record = run_in(rising(), halted(vec![halt(25 * SECOND, 45 * SECOND)], WhileHalted::Refuse), plan);
    assert_eq!(status(&record), [Status::Unfilled, Status::Rejected, Status::Rejected, Status::Unfilled]);
    assert_eq!(fills(&record), []);
}

#[test]
fn orders_may_be_taken_back_and_changed_while_trading_is_halted() {
    let plan = event(0).submit(limit(Side::Buy, 1.0, 98.0)).submit(limit(Side::Buy, 1.0, 98.5));
    let record = run(plan.at(3).cancel(1).replace(2, None, Some(101.5)));
    assert_eq!(record.blotter.orders[0].reason, Some(Reason::Asked));
    assert_eq!(fills(&record), [(50 * SECOND, 1.0, 101.05)], "its new limit takes when trading goes on");
}

#[test]
fn nothing_is_set_off_or_reached_by_what_a_halt_shows() {
    // Quotes and trades far through both orders come in the halt alone.
    let row = |k: i64, bid: f64, ask: f64| (10 * k * SECOND, bid, ask);
    let rows = [row(0, 99.0, 101.0), row(3, 80.0, 81.0), row(5, 99.0, 101.0), row(6, 99.0, 101.0)];
    let print = Print { time: Timestamp(31 * SECOND), price: 80.0, size: 9.0, aggressor: Some(Side::Sell) };
    let history = || quotes(&rows).with_prints(vec![print]).unwrap();
    let plan = || event(0).submit(limit(Side::Buy, 5.0, 98.0)).submit(stop(Side::Sell, 5.0, 97.0));
    let with = |halts| fills(&run_in(history(), halted(halts, WhileHalted::Rest), plan())).len();
    assert_eq!((with(vec![]), with(vec![halt(25 * SECOND, 45 * SECOND)])), (2, 0));
}

#[test]
fn a_bar_that_begins_in_a_halt_is_met_by_nobody_and_one_that_ends_in_it_before_it() {
    let bar = |k: i64, open: f64, low: f64| {
        let [open, low] = [open, low].map(|p| Price::nearest(p).unwrap());
        let (open_at, known_at) = (Timestamp(60 * k * SECOND), Timestamp(60 * (k + 1) * SECOND));
        Bar { open_at, known_at, open, high: open, low, close: open, volume: 1e3 }
    };
    let history = || {
        let bars =
            vec![bar(0, 100.0, 100.0), bar(1, 100.0, 95.0), bar(2, 90.0, 85.0), bar(3, 100.0, 100.0), bar(4, 70.0, 70.0)];
        History::new(bars, Quotes::default()).unwrap()
    };
    // From within the second bar to within the third: the third begins in it.
    let settings = halted(vec![halt(90 * SECOND, 150 * SECOND)], WhileHalted::Rest);
    let plan =
        event(0).submit(limit(Side::Buy, 1.0, 96.0)).submit(limit(Side::Buy, 1.0, 91.0)).submit(limit(Side::Buy, 1.0, 80.0));
    let mut plan = plan.at(1).submit(Ticket::market(0, Side::Buy, quantity(1.0)));
    let backtest = Backtest::new(vec![instrument("A")], vec![history()], venue(&[]), settings).unwrap();
    let record = backtest.run(&mut plan).unwrap();
    let found: Vec<_> = fills(&record).into_iter().map(|(at, _, price)| (at / SECOND, price)).collect();
    // Asked at 120 s, the market order meets the fourth bar; the second bid waits for the fifth.
    assert_eq!(found, [(90, 96.0), (180, 100.0), (240, 70.0), (240, 70.0)]);
    // It is known when its bar is.
    assert_eq!(plan.notices[0].0.0 / SECOND, 120);
    assert_eq!(record.halts[0].rows, 1);
}

#[test]
fn a_close_that_is_halted_has_no_auction() {
    let calendar =
        "name = 'x'\nsource = 'a test'\nzone = 'UTC'\n[[session]]\ndays = ['thu']\nopen = '00:00'\nclose = '00:01'\n";
    let calendars = vec![Some(Arc::new(Calendar::parse(calendar).unwrap()))];
    let ticket = Ticket::new(0, Side::Buy, quantity(1.0), trueup::market::OrderKind::MarketOnClose);
    let of = |halts| {
        let settings = Settings { calendars: calendars.clone(), ..halted(halts, WhileHalted::Rest) };
        run_in(rising(), settings, event(0).submit(ticket)).blotter.orders[0].reason
    };
    assert_eq!((of(vec![]), of(vec![halt(55 * SECOND, 90 * SECOND)])), (None, Some(Reason::NoAuction)));
}

/// Notes what it is told of halts.
#[derive(Default)]
struct Told(Vec<(i64, Option<(i64, String)>)>);

impl Strategy for Told {
    fn name(&self) -> &str {
        "told"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, _: &mut Orders) {
        let halt = view.halt(0).map(|halt| (halt.since.0 / SECOND, halt.reason.unwrap_or_default().to_owned()));
        self.0.push((view.now().0 / SECOND, halt));
    }
}

#[test]
fn a_halt_is_known_when_it_begins() {
    let settings = halted(vec![halt(25 * SECOND, 45 * SECOND)], WhileHalted::Rest);
    let mut told = Told::default();
    Backtest::new(vec![instrument("A")], vec![rising()], venue(&[]), settings).unwrap().run(&mut told).unwrap();
    let found: Vec<bool> = told.0.iter().map(|(_, halt)| halt.is_some()).collect();
    assert_eq!(found, [false, false, false, true, true, false, false, false]);
    assert_eq!(told.0[3].1, Some((25, "news".to_owned())));
}

#[test]
fn halts_that_cannot_be_are_refused() {
    let error = |halts| {
        let settings = halted(halts, WhileHalted::Rest);
        Backtest::new(vec![instrument("A")], vec![rising()], venue(&[]), settings).unwrap_err().to_string()
    };
    insta::assert_snapshot!(error(vec![halt(30, 30)]), @"
    the halt of A from 1970-01-01T00:00:00.000000030Z: it ends at 1970-01-01T00:00:00.000000030Z, which is no later
    hint: swap or correct `from` and `to`
    ");
    insta::assert_snapshot!(error(vec![halt(0, 30), halt(40, 50), halt(10, 20)]), @"
    the halt of A from 1970-01-01T00:00:00.000000010Z: there is one from 1970-01-01T00:00:00Z to 1970-01-01T00:00:00.000000030Z already
    hint: write halts that overlap as one, with the first beginning and the last end
    ");
    assert!(error(vec![Halt { instrument: 3, ..halt(0, 1) }]).contains("there is no such instrument"));
}

/// A market of bars, quotes, quotes and trades, or a book, from steps of time [s] and price [cents].
fn market(kind: usize, steps: &[(i64, i64)]) -> History {
    let (mut time, mut cents, mut before) = (0, 10_000_i64, None);
    let (mut bars, mut quotes, mut prints, mut depth) = (Vec::new(), Quotes::with_depth(1), Vec::new(), Vec::new());
    let price = |cents: i64| Price(cents * 10_000_000);
    for (passed, step) in steps {
        let (open_at, open) = (Timestamp(time), price(cents));
        time += passed * SECOND;
        cents += step;
        let (at, close) = (Timestamp(time), price(cents));
        bars.push(Bar { open_at, known_at: at, open, high: open.max(close), low: open.min(close), close, volume: 50.0 });
        let side = |cents: i64| [Level { price: cents as f64 / 100.0, size: 20.0 }];
        quotes.push(at, &side(cents - 1), &side(cents + 1));
        prints.push(Print { time: at + 7, price: cents as f64 / 100.0, size: 30.0, aggressor: None });
        let mut set = |side, cents: i64, size| {
            let action = DepthAction::Set;
            depth.push(DepthChange { time: at, known_at: at, side, action, price: price(cents), size });
        };
        if let Some(old) = before.replace(cents) {
            set(Side::Buy, old - 1, 0.0);
            set(Side::Sell, old + 1, 0.0);
        }
        set(Side::Buy, cents - 1, 20.0);
        set(Side::Sell, cents + 1, 20.0);
    }
    match kind {
        0 => History::new(bars, Quotes::default()),
        1 => History::new(Vec::new(), quotes),
        2 => History::new(Vec::new(), quotes).and_then(|history| history.with_prints(prints)),
        _ => History::default().with_depth(depth),
    }
    .unwrap()
}

/// Halts one after the other, from pauses between them and their lengths [s].
fn one_after_another(pauses: &[(i64, i64)]) -> Vec<Halt> {
    let mut time = 0;
    let one = |(pause, length): &(i64, i64)| {
        let from = time + pause * SECOND + 3;
        time = from + length * SECOND;
        halt(from, time)
    };
    pauses.iter().map(one).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]
    #[test]
    fn nothing_is_filled_in_a_halt(
        steps in proptest::collection::vec((1..60_i64, -5..6_i64), 10..90),
        pauses in proptest::collection::vec((0..300_i64, 1..300_i64), 1..6),
        kind in 0..4_usize,
        refuse in any::<bool>(),
        hours in any::<bool>(),
        audited in proptest::bool::weighted(0.1),
    ) {
        let halts = one_after_another(&pauses);
        let settings = halted(halts.clone(), if refuse { WhileHalted::Refuse } else { WhileHalted::Rest });
        let history = market(kind, &steps);
        // With days of its own or without, a market that never closes is halted alike.
        let always = Arc::new(Calendar::built_in("always").unwrap());
        let of = |settings| {
            let calendars = if hours { vec![Some(Arc::clone(&always))] } else { Vec::new() };
            let settings = Settings { calendars, ..settings };
            Backtest::new(vec![instrument("A")], vec![history.clone()], venue(&[]), settings).unwrap()
        };
        let backtest = of(settings);
        let record = backtest.run(&mut Busy::default()).unwrap();
        let within = |time: Timestamp| halts.iter().find(|halt| halt.from <= time && time < halt.to);
        for fill in &record.blotter.fills {
            // Of a bar that ends in a halt: what was traded before.
            let found = within(fill.filled_at).filter(|halt| kind > 0 || fill.filled_at != halt.from);
            prop_assert!(found.is_none(), "{fill:?} in {found:?}");
        }
        for order in &record.blotter.orders {
            let refused = order.reason == Some(Reason::Halted);
            prop_assert_eq!(refused, refuse && within(order.arrives_at).is_some(), "{:?}", order);
        }
        same_every_way(&backtest, &record, &Busy::default(), 7);
        // Halts that nothing comes in change nothing.
        let later = Timestamp(1_000_000 * SECOND);
        let never = of(halted(vec![halt(later.0, later.0 + 1)], WhileHalted::Refuse)).run(&mut Busy::default()).unwrap();
        let bare = of(halted(Vec::new(), WhileHalted::Rest)).run(&mut Busy::default()).unwrap();
        prop_assert_eq!(Record { halts: Vec::new(), ..never }, bare);
        if audited {
            let make = |_: &[History]| -> Result<Box<dyn Strategy>, BacktestError> { Ok(Box::new(Busy::default())) };
            let found = audit(&backtest, make, AuditSettings { cuts: 6, seed: Seed(3) }, &|_, _| {}).unwrap();
            prop_assert_eq!(found.verdict, AuditVerdict::Clean, "{}", found.summary);
        }
    }
}
