//! The audit for lookahead: every leak that is planted is found, and what is clean passes.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::sync::atomic::{AtomicUsize, Ordering};

use trueup::market::{
    Audit, AuditSettings, AuditVerdict, Backtest, BacktestError, Bar, Cash, Engine, Execution, Fill, FillCost, History,
    Impossible, Instrument, Level, MECHANISMS, Orders, Price, Quantity, Quotes, Settings, Side, Strategy, Subject, View,
    audit, audit_engine,
};
use trueup::sim2real::{Assembly, Seed, Timestamp};
use trueup::strategies;

const MINUTE: i64 = 60 * Timestamp::NANOS;

/// Closes of a smooth wave on a walk of a linear congruential generator [cents].
fn walk(count: usize) -> Vec<f64> {
    let mut state = 7_u64;
    let mut price = 10_000.0;
    let step = |k: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        price += ((state >> 33) % 61) as f64 - 30.0 + 8.0 * (k as f64 / 30.0).sin();
        price / 100.0
    };
    (0..count).map(step).collect()
}

/// Minute bars that open a little off the close before, in days of 200 with a night between.
fn bars(closes: &[f64]) -> Vec<Bar> {
    let at = |k: usize| Timestamp(((k / 200) * 1_440 + k % 200) as i64 * MINUTE);
    let bar = |k: usize| {
        let open = Price::nearest(closes[k.saturating_sub(1)] + if k.is_multiple_of(2) { 0.02 } else { -0.03 }).unwrap();
        let close = Price::nearest(closes[k]).unwrap();
        let (high, low) = (open.max(close), open.min(close));
        Bar { open_at: at(k), known_at: at(k) + MINUTE, open, high, low, close, volume: 1_000.0 }
    };
    (0..closes.len()).map(bar).collect()
}

fn barred() -> History {
    History::new(bars(&walk(1_000)), Quotes::default()).unwrap()
}

fn backtest(histories: Vec<History>) -> Backtest {
    let instrument = |symbol: &str| Instrument {
        symbol: symbol.into(),
        tick_size: 0.01,
        lot_size: 1.0,
        average_daily_volume: None,
        daily_volatility: None,
    };
    let instruments = ["A", "B"][..histories.len()].iter().map(|s| instrument(s)).collect();
    let settings = Settings { max_leverage: 4.0, ..Settings::with_cash(Cash::nearest(1e6).unwrap()) };
    Backtest::new(instruments, histories, Assembly::new(Execution, MECHANISMS), settings).unwrap()
}

const SETTINGS: AuditSettings = AuditSettings { cuts: 24, seed: Seed(3) };

fn audited<S: Strategy + 'static>(histories: Vec<History>, make: impl Fn(&[History]) -> S + Sync) -> Audit {
    let boxed = |histories: &[History]| Ok::<Box<dyn Strategy>, BacktestError>(Box::new(make(histories)));
    audit(&backtest(histories), boxed, SETTINGS, &|_, _| {}).unwrap()
}

fn registered(histories: Vec<History>, text: &str, engine: Engine<'_>) -> Audit {
    let table: toml::Table = toml::from_str(text).unwrap();
    let make = |_: &[History]| Ok::<_, BacktestError>(strategies::build(&table).unwrap());
    audit_engine(&backtest(histories), make, engine, SETTINGS, &|_, _| {}).unwrap()
}

const CROSS: &str = "kind = 'sma_cross'\nfast = 3\nslow = 9\nshort = true";

fn as_it_is(backtest: &Backtest, strategy: &mut dyn Strategy) -> Result<trueup::market::Record, BacktestError> {
    backtest.run(strategy)
}

#[test]
fn what_is_clean_passes() {
    for text in [CROSS, "kind = 'buy_and_hold'"] {
        let audit = registered(vec![barred(), barred()], text, &as_it_is);
        assert_eq!((audit.verdict, audit.impossible, audit.cuts.len()), (AuditVerdict::Clean, 0, 24), "{}", audit.summary);
        assert_eq!(audit.untold, ["A", "B"]);
    }
    let audit = registered(vec![barred()], CROSS, &as_it_is);
    assert!(audit.decisions > 50 && audit.fills > 50, "{} decisions, {} fills", audit.decisions, audit.fills);
    assert!(audit.summary.starts_with("No lookahead was found: after none of 24 instants"), "{}", audit.summary);
}

/// Long while a price is above the mean of those around it: `ahead` of them are yet to come.
struct Centered {
    closes: Vec<Price>,
    ahead: usize,
    events: usize,
}

impl Strategy for Centered {
    fn name(&self) -> &str {
        "centered"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let (k, ahead) = (self.events, self.ahead);
        self.events += 1;
        let window = &self.closes[k.saturating_sub(5)..(k + 1 + ahead).min(self.closes.len())];
        let mean = window.iter().map(|p| p.0).sum::<i64>() / window.len() as i64;
        let target = if view.price(0).unwrap().0 > mean { 100.0 } else { 0.0 };
        orders.to_position(view, 0, Quantity::nearest(target).unwrap());
    }
}

fn closes(histories: &[History]) -> Vec<Price> {
    histories[0].bars().iter().map(|bar| bar.close).collect()
}

#[test]
fn a_centered_window_is_found_out_and_one_of_the_past_is_not() {
    let of = |ahead| audited(vec![barred()], move |histories| Centered { closes: closes(histories), ahead, events: 0 });
    let audit = of(5);
    assert_eq!(audit.verdict, AuditVerdict::Lookahead);
    let (cut, _, found) = audit.first().unwrap();
    assert!(found.time <= cut.at && cut.at.0 - found.time.0 <= 5 * MINUTE, "it sees five minutes ahead: {found:?}");
    assert_eq!((found.subject, found.instrument.as_deref()), (Subject::Request, Some("A")));
    assert!(found.was != found.became, "{found:?}");
    // A single bar ahead is enough.
    assert_eq!(of(1).verdict, AuditVerdict::Lookahead);
    assert_eq!(of(0).verdict, AuditVerdict::Clean);
}

/// Long while a price is below the mean of the whole sample.
struct Normalized {
    mean: i64,
}

impl Strategy for Normalized {
    fn name(&self) -> &str {
        "normalized"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let target = if view.price(0).unwrap().0 < self.mean { 100.0 } else { 0.0 };
        orders.to_position(view, 0, Quantity::nearest(target).unwrap());
    }
}

#[test]
fn normalization_by_the_full_sample_is_found_out() {
    let mean = |all: &[Price]| all.iter().map(|p| p.0).sum::<i64>() / all.len() as i64;
    let audit = audited(vec![barred()], |histories| Normalized { mean: mean(&closes(histories)) });
    assert_eq!(audit.verdict, AuditVerdict::Lookahead, "{}", audit.summary);
    let audit = audited(vec![barred()], |histories| Normalized { mean: mean(&closes(histories)[..1]) });
    assert_eq!(audit.verdict, AuditVerdict::Clean, "{}", audit.summary);
}

/// An engine that fills each order at once, at the close it was decided on.
fn at_the_same_close(backtest: &Backtest, strategy: &mut dyn Strategy) -> Result<trueup::market::Record, BacktestError> {
    let mut record = backtest.run(strategy)?;
    let fill = |order: &trueup::market::Order| Fill {
        fill_id: order.order_id,
        order_id: order.order_id,
        instrument: order.instrument,
        filled_at: order.decided_at,
        side: order.side,
        quantity: order.quantity,
        price: order.decision_price,
        fee: Cash::default(),
        decision_price: order.decision_price,
        rate: 1.0,
        realised: None,
        cost: FillCost::default(),
        why: trueup::market::Why {
            role: trueup::market::Role::Taker,
            data: trueup::market::EventKind::Bar,
            row: 0,
            met: 0.0,
            band: [order.decision_price; 2],
            displaced: Price(0),
            queued_behind: 0.0,
        },
    };
    record.blotter.fills = record.blotter.orders.iter().map(fill).collect();
    Ok(record)
}

#[test]
fn fills_at_the_close_that_was_seen_are_found_out() {
    let audit = registered(vec![barred()], CROSS, &at_the_same_close);
    assert_eq!(audit.verdict, AuditVerdict::Lookahead, "{}", audit.summary);
    let seen = audit.impossible_fills.iter().filter(|fault| fault.fault == Impossible::SeenPrice).count();
    assert!(seen >= 12, "at every instant that is a time of orders: {seen}");
    assert_eq!(audit.first(), None, "no decision depends on the future");
}

#[test]
fn fills_that_cannot_be_are_found_out() {
    let spoilt = |spoil: fn(&mut Fill)| {
        move |backtest: &Backtest, strategy: &mut dyn Strategy| {
            let mut record = backtest.run(strategy)?;
            // Runs that were cut off may have less.
            record.blotter.fills.get_mut(20).into_iter().for_each(spoil);
            Ok(record)
        }
    };
    for (spoil, expected, verdict) in [
        ((|f| f.filled_at = Timestamp(0)) as fn(&mut Fill), Impossible::BeforeDecision, AuditVerdict::Lookahead),
        (
            |f| f.filled_at = f.filled_at + 86_400 * 300 * Timestamp::NANOS,
            Impossible::NoMarket,
            AuditVerdict::ImpossibleFills,
        ),
        (
            |f| f.price = Price(f.price.0 - f.side.sign() as i64 * 5 * 1_000_000_000),
            Impossible::OutsideRange,
            AuditVerdict::ImpossibleFills,
        ),
    ] {
        let audit = registered(vec![barred()], CROSS, &spoilt(spoil));
        let faults: Vec<Impossible> = audit.impossible_fills.iter().map(|fault| fault.fault).collect();
        assert_eq!((faults, audit.verdict), (vec![expected], verdict), "{}", audit.summary);
        assert_eq!(audit.impossible_fills[0].fill_id, 21);
    }
    // What mechanisms add to the price that was met is no fault, however large.
    let conceded = |f: &mut Fill| {
        f.price = Price(f.price.0 + f.side.sign() as i64 * 5 * 1_000_000_000);
        f.cost.spread_and_impact += 5.0 * f.quantity.to_f64();
    };
    assert_eq!(registered(vec![barred()], CROSS, &spoilt(conceded)).impossible, 0);
}

/// Bars, and quotes every ten seconds that pass through their opens and closes; the bars are said to be known `late` bars
/// after they end.
fn quoted(late: i64) -> History {
    let bars = bars(&walk(1_000));
    let mut quotes = Quotes::with_depth(1);
    for bar in &bars {
        for k in 0..6 {
            let part = (k as f64 + 1.0) / 6.0;
            let mid = bar.open.to_f64() + part * (bar.close.to_f64() - bar.open.to_f64());
            let level = |price: f64| [Level { price, size: 50.0 }];
            quotes.push(bar.open_at + k * MINUTE / 6, &level(mid - 0.01), &level(mid + 0.01));
        }
    }
    let stamped =
        bars.iter().map(|bar| Bar { open_at: bar.open_at + late * MINUTE, known_at: bar.known_at + late * MINUTE, ..*bar });
    History::new(stamped.collect(), quotes).unwrap()
}

#[test]
fn a_bar_stamped_at_its_open_is_found_out_where_there_are_quotes() {
    let audit = registered(vec![quoted(0)], CROSS, &as_it_is);
    assert_eq!(
        (audit.verdict, audit.known_early.len(), audit.untold.len()),
        (AuditVerdict::Clean, 0, 0),
        "{}",
        audit.summary
    );
    let audit = registered(vec![quoted(-1)], CROSS, &as_it_is);
    assert_eq!(audit.verdict, AuditVerdict::Lookahead);
    assert_eq!((audit.known_early.len(), audit.known_early[0].seconds), (1, 60.0), "{}", audit.summary);
    assert!(audit.known_early[0].nearer_later > 900, "{:?}", audit.known_early);
    // Known too late is no lookahead.
    assert_eq!(registered(vec![quoted(1)], CROSS, &as_it_is).verdict, AuditVerdict::Clean);
}

/// Orders by a counter that outlives the run.
struct Moody<'a>(&'a AtomicUsize);

impl Strategy for Moody<'_> {
    fn name(&self) -> &str {
        "moody"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let target = if self.0.fetch_add(1, Ordering::Relaxed).is_multiple_of(7) { 10.0 } else { 0.0 };
        orders.to_position(view, 0, Quantity::nearest(target).unwrap());
    }
}

#[test]
fn a_strategy_that_keeps_a_state_from_run_to_run_is_told_apart_from_lookahead() {
    static MOODS: AtomicUsize = AtomicUsize::new(0);
    let audit = audited(vec![barred()], |_| Moody(&MOODS));
    assert_eq!((audit.verdict, audit.cuts.len()), (AuditVerdict::NotRepeatable, 0));
    assert!(audit.summary.starts_with("Two runs of moody on the same data differ"), "{}", audit.summary);
}

/// Trades whatever happens to any instrument, and heeds what is held of all.
struct Cross;

impl Strategy for Cross {
    fn name(&self) -> &str {
        "cross"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let held = view.position(0).0 + view.position(1).0;
        let side = if held > 0 { Side::Sell } else { Side::Buy };
        orders.market(view.event().instrument, side, Quantity::nearest(3.0).unwrap());
    }
}

/// A fill at the open of a bar that is under way is the past, though the bar is not known yet.
#[test]
fn what_was_filled_in_a_bar_under_way_is_no_lookahead() {
    let shifted: Vec<Bar> = barred()
        .bars()
        .iter()
        .map(|bar| Bar { open_at: bar.open_at + MINUTE / 3, known_at: bar.known_at + MINUTE / 3, ..*bar })
        .collect();
    let histories = vec![barred(), History::new(shifted, Quotes::default()).unwrap()];
    let audit = audited(histories, |_| Cross);
    assert_eq!(audit.verdict, AuditVerdict::Clean, "{}", audit.summary);
    assert!(audit.decisions > 1_000);
}

#[test]
fn an_audit_is_the_same_at_any_number_of_threads() {
    let one = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| audited(vec![barred()], |histories| Centered { closes: closes(histories), ahead: 2, events: 0 }))
    };
    assert_eq!(one(1), one(3));
}

mod command {
    use std::path::Path;

    use assert_cmd::Command;

    fn ran(arguments: &str) -> (i32, String, String) {
        let output = Command::new(assert_cmd::cargo::cargo_bin!("trueup"))
            .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join("bars"))
            .args(arguments.split_whitespace())
            .env_remove("RUST_BACKTRACE")
            .output()
            .unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
    }

    #[test]
    fn a_run_is_audited_from_the_command_line() {
        let (code, out, err) = ran("audit run.toml --cuts 6");
        assert_eq!((code, err.as_str()), (0, ""));
        insta::assert_snapshot!("clean", out);
        let (code, out, _) = ran("audit run.toml --cuts 6 --json");
        let json: serde_json::Value = serde_json::from_str(&out).unwrap();
        assert_eq!((code, json["schema"].as_str(), json["verdict"].as_str()), (0, Some("trueup.audit/1"), Some("clean")));
        assert_eq!(json["cuts"].as_array().map(Vec::len), Some(6));
        assert_eq!(out, ran("audit run.toml --cuts 6 --json --threads 1").1, "the same at any number of threads");
        let (code, out, _) = ran("audit --help");
        assert_eq!(code, 0);
        insta::assert_snapshot!("help", out);
        let (code, out, err) = ran("audit none.toml");
        assert_eq!((code, out.as_str()), (2, ""));
        insta::assert_snapshot!("missing", err);
        assert_eq!(ran("audit run.toml --cuts 0").0, 2);
    }
}
