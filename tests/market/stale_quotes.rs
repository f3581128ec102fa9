//! Quotes that are older than the backtest thinks: a run decides as much later, and a log that says what was seen tells of it.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::market_scene::{Busy, event, fills, instrument, quantity, quotes, run_plan, settings, venue};
use trueup::io::TwinFile;
use trueup::market::{
    Backtest, Execution, History, Latencies, Latency, Level, LogMarket, LoggedFill, LoggedOrder, MECHANISMS, OrderLog,
    OrderType, Orders, PriceAssumption, Quotes, Record, Settings, Side, Strategy, Tape, Ticket, View, execution_logs,
};
use trueup::sim2real::diagnose::{Diagnosis, Verdict, diagnose};
use trueup::sim2real::{Assembly, Recording, Seed, Timestamp, check_mechanism};

const SECOND: i64 = Timestamp::NANOS;

fn fed(seconds: f64) -> Settings {
    let feed = Latency::Constant { seconds };
    Settings { latencies: Latencies { feed, ..Latencies::default() }, max_leverage: 1e3, ..settings() }
}

/// Quotes at uneven times, whose mids go up and down by a tick; the spread is two.
fn wandering(rows: i64) -> History {
    let (mut state, mut time, mut tick) = (7_u64, 0, 10_000_i64);
    let mut quotes = Quotes::with_depth(1);
    for _ in 0..rows {
        // Park & Miller.
        state = state * 48_271 % 2_147_483_647;
        time += SECOND / 5 + (state % 1_000) as i64 * SECOND / 700;
        tick += [1, -1, 2, -2][(state / 1_000 % 4) as usize];
        let level = |tick: i64| [Level { price: tick as f64 / 100.0, size: 1e6 }];
        quotes.push(Timestamp(time), &level(tick - 1), &level(tick + 1));
    }
    History::new(Vec::new(), quotes).unwrap()
}

#[test]
fn decisions_are_made_as_much_later_on_what_was_there_before() {
    let rows: Vec<_> = (0..6).map(|k| (k * SECOND, 99.0 + k as f64, 101.0 + k as f64)).collect();
    let mut plan = event(1).submit(Ticket::market(0, Side::Buy, quantity(1.0)));
    let record = run_plan(vec![quotes(&rows)], &[("stale_quotes", "", 1.5)], settings(), &mut plan);
    // The quote of 1 s is seen at 2.5 s, where that of 2 s stands.
    let order = record.blotter.orders[0];
    assert_eq!((order.decided_at.0, order.seen_bid), (5 * SECOND / 2, Some(100.0)));
    assert_eq!(fills(&record), [(5 * SECOND / 2, 1.0, 103.0)]);
}

fn busy(parts: &[(&str, &str, f64)], settings: Settings) -> Record {
    let backtest = Backtest::new(vec![instrument("A")], vec![wandering(200)], venue(parts), settings).unwrap();
    backtest.run(&mut Busy::default()).unwrap()
}

#[test]
fn it_is_a_latency_of_the_feed_to_the_bit_and_adds_to_it() {
    let stale = |seconds| busy(&[("stale_quotes", "", seconds)], fed(0.25));
    assert_eq!(stale(0.75), busy(&[], fed(1.0)));
    assert_eq!(stale(0.0), busy(&[], fed(0.25)));
    assert_ne!(stale(0.75).blotter, stale(0.0).blotter);
    assert!(stale(0.75).blotter.fills.len() > 20);
}

/// Buys and sells in turn, at every third quote.
#[derive(Default)]
struct InTurn(usize);

impl Strategy for InTurn {
    fn name(&self) -> &str {
        "in turn"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, _: &View<'_>, orders: &mut Orders) {
        self.0 += 1;
        if self.0.is_multiple_of(3) {
            let side = if self.0.is_multiple_of(2) { Side::Buy } else { Side::Sell };
            orders.submit(Ticket::market(0, side, quantity(10.0)));
        }
    }
}

/// What a run with such a feed leaves, as a log beside the quotes it ran on; `seen` says what becomes of what orders saw.
fn log(parts: &[(&str, &str, f64)], seen: fn(f64) -> Option<f64>) -> Recording<OrderLog> {
    let history = wandering(1_200);
    let backtest = Backtest::new(vec![instrument("A")], vec![history.clone()], venue(parts), fed(0.0)).unwrap();
    let record = backtest.run(&mut InTurn::default()).unwrap();
    let logged = |order: &trueup::market::Order| LoggedOrder {
        id: order.order_id.to_string(),
        side: order.side,
        quantity: order.quantity.to_f64(),
        decided_at: order.decided_at,
        kind: OrderType::Market,
        seen_mid: order.seen_bid.zip(order.seen_ask).and_then(|(bid, ask)| seen(0.5 * (bid + ask))),
    };
    let filled = |fill: &trueup::market::Fill| LoggedFill {
        order_id: fill.order_id.to_string(),
        filled_at: fill.filled_at,
        quantity: fill.quantity.to_f64(),
        price: fill.price.to_f64(),
        fee: 0.0,
    };
    let orders: Vec<LoggedOrder> = record.blotter.orders.iter().map(logged).collect();
    let fills: Vec<LoggedFill> = record.blotter.fills.iter().map(filled).collect();
    let tape = Arc::new(Tape::new(history.quotes().clone(), Vec::new(), Vec::new()));
    let market = LogMarket { instrument: instrument("A"), tape, price: PriceAssumption::Touch, shows_own_orders: None };
    OrderLog::recording("own run", market, &orders, &fills).unwrap()
}

fn diagnosed(recordings: &[Recording<OrderLog>]) -> Diagnosis {
    diagnose(&Assembly::new(Execution, MECHANISMS), recordings, &[], Seed(1), &|_, _, _| ()).diagnosis
}

/// Holds `diagnosis` to name stale quotes of that age [s], to within `room`.
fn names_age(diagnosis: &Diagnosis, age: f64, room: f64) {
    println!("{}", diagnosis.summary);
    let effect = diagnosis.effects.iter().find(|effect| effect.mechanism == "stale_quotes").unwrap();
    let found = effect.parameters["seconds"].value;
    assert!((found - age).abs() <= room, "{found} s, not {age} s");
}

#[test]
fn a_run_on_a_late_feed_is_told_by_what_its_orders_saw() {
    for age in [0.6, 2.5] {
        let log = log(&[("stale_quotes", "", age)], Some);
        let shown = log.stimulus.shown_age().unwrap();
        // The order is decided on the newest row the moment it comes: all ages down to the next quote explain it.
        assert!(shown <= age && shown > age - 0.2, "{shown}");
        check_mechanism(
            *MECHANISMS.iter().find(|m| m.about().name == "stale_quotes").unwrap(),
            &Execution,
            MECHANISMS,
            &log,
        )
        .unwrap();
        let diagnosis = diagnosed(&[log]);
        assert_eq!((diagnosis.verdict, diagnosis.effects.len()), (Verdict::Named, 1), "{diagnosis:#?}");
        names_age(&diagnosis, age, 0.2);
    }
}

#[test]
fn without_what_was_seen_or_where_it_is_timely_nothing_is_said_of_it() {
    for log in [log(&[("stale_quotes", "", 0.6)], |_| None), log(&[], Some)] {
        assert!(log.channel("seen").is_none() && log.stimulus.shown_age().is_none());
        let candidates = Assembly::new(Execution, MECHANISMS);
        let candidates = trueup::sim2real::Twin::candidates(&candidates, &[log]);
        assert!(candidates.iter().all(|candidate| candidate.about.name != "stale_quotes"));
    }
}

#[test]
fn what_was_seen_elsewhere_is_said_and_left_out() {
    let log = log(&[("stale_quotes", "", 0.6)], |mid| Some(mid * 1.01));
    assert!(log.channel("seen").is_none());
    let notes = log.stimulus.notes().join("\n");
    assert!(notes.contains("is not what the tape showed at any one age"), "{notes}");
}

const TWIN: &str =
    "[twin]\nmodel = 'execution'\n[assumptions]\nprice = 'touch'\n[[instrument]]\nsymbol = 'A'\ntick_size = 0.01\n";

/// A folder with what a run on stale quotes leaves, each of whose orders is written with what `seen` makes of it.
fn folder(seen: fn(f64) -> (String, String)) -> tempfile::TempDir {
    let log = log(&[("stale_quotes", "", 0.6)], |_| None);
    let (market, quotes) = (&log.stimulus, log.stimulus.tape().quotes());
    let mut orders = "order_id,symbol,decided_at,side,qty,type,seen_bid,seen_ask\n".to_owned();
    let mut fills = "order_id,filled_at,qty,price,fee\n".to_owned();
    for (k, order) in market.orders().iter().enumerate() {
        let then = market.tape().mid(trueup::market::Seen::at(order.decided_at.plus_seconds(-0.6))).unwrap();
        let (bid, ask) = seen(then);
        orders += &format!("{k},A,{},{},10,market,{bid},{ask}\n", order.decided_at.0, order.side.word());
        fills += &format!("{k},{},10,{},0\n", order.decided_at.0, order.assumed);
    }
    let mut rows = "ts,bid,bid_size,ask,ask_size\n".to_owned();
    for quote in (0..quotes.len()).map(|k| quotes.all().get(k).unwrap()) {
        rows += &format!("{},{},1e6,{},1e6\n", quote.time.0, quote.bid().unwrap(), quote.ask().unwrap());
    }
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("twin.toml", TWIN), ("orders.csv", &orders), ("fills.csv", &fills), ("quotes.csv", &rows)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

#[test]
fn what_was_seen_is_read_from_a_log_and_may_be_missing_but_not_be_words() {
    let read = |seen| {
        let folder = folder(seen);
        let twin = TwinFile::read(folder.path().join("twin.toml")).unwrap();
        execution_logs(&twin, &[folder.path().to_path_buf()])
            .map(|mut logs| logs.remove(0))
            .map_err(|error| error.to_string())
    };
    let both = |mid: f64| ((mid - 0.01).to_string(), (mid + 0.01).to_string());
    let log = read(both).unwrap();
    let shown = log.stimulus.shown_age().unwrap();
    assert!(shown <= 0.6 && shown > 0.4, "{shown}");
    let seen = &log.channel("seen").unwrap().samples;
    assert!(seen.iter().flatten().any(|bps| bps.abs() > 0.5), "ticks of a bp each");
    // A side that was empty, or crossed, is no quote.
    let one_side = |mid: f64| (String::new(), mid.to_string());
    let crossed = |mid: f64| ((mid + 0.01).to_string(), (mid - 0.01).to_string());
    for seen in [one_side as fn(f64) -> (String, String), crossed] {
        assert!(read(seen).unwrap().channel("seen").is_none());
    }
    let error = read(|_| ("soon".to_owned(), "late".to_owned())).unwrap_err();
    assert!(error.contains("orders.csv: row 2, column `seen_bid`") && error.contains("found \"soon\""), "{error}");
}

fn abides(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/market/abides").join(name);
    if !folder.is_dir() {
        println!("skipped: the ABIDES log {name} is not on this machine");
        return None;
    }
    Some(folder)
}

#[test]
fn simulated_clients_saw_quotes_of_one_latency_before() {
    // In a millisecond hardly any quote changes, which tells of nothing.
    for (name, age) in [("01_market_lat1ms_q50", None), ("02_market_lat250ms_q50", Some(0.25_f64))] {
        let Some(folder) = abides(name) else { continue };
        let twin = TwinFile::read(folder.join("twin.toml")).unwrap();
        let log = execution_logs(&twin, &[folder]).unwrap().remove(0);
        println!("{name}: shown age {:?}, notes {:?}", log.stimulus.shown_age(), log.stimulus.notes());
        match (log.stimulus.shown_age(), age) {
            (Some(shown), Some(age)) => assert!((shown - age).abs() < 0.02, "{name}: {shown}"),
            (shown, age) => assert_eq!(shown, age, "{name}"),
        }
    }
}
