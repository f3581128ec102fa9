//! Backtests on streams: the same as on whole histories, bit by bit, with only what lies around the present in memory.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use crate::market_scene::{Busy, MINUTE, instrument, settings, venue, whole_bar};
use crate::ways_scene::same_every_way;
use proptest::prelude::*;
use trueup::market::{
    Backtest, BacktestError, Bar, Book, DepthAction, DepthChange, History, HistoryError, Known, Latencies, Latency, Level,
    OrderAction, OrderEvent, Price, Print, Quotes, Record, Settings, Side, Sources, Stream, StreamError,
};
use trueup::sim2real::{Seed, Timestamp};

/// All data of one instrument.
#[derive(Debug, Clone, Default)]
struct Rows {
    bars: Vec<Bar>,
    quotes: Vec<Known<Book>>,
    prints: Vec<Known<Print>>,
    depth: Vec<DepthChange>,
    orders: Vec<OrderEvent>,
}

impl Rows {
    fn history(&self) -> History {
        let mut quotes = Quotes::with_depth(1);
        for Known { known_at, what } in &self.quotes {
            quotes.push(*known_at, what.opposite(Side::Sell), what.opposite(Side::Buy));
        }
        let known = self.prints.iter().map(|print| print.known_at).collect();
        History::new(self.bars.clone(), quotes)
            .and_then(|h| h.with_prints_known_at(self.prints.iter().map(|print| print.what).collect(), known))
            .and_then(|h| h.with_depth(self.depth.clone()))
            .and_then(|h| h.with_order_events(self.orders.clone()))
            .unwrap()
    }
}

/// Steps of a walk: time since the row before, price in cents, size, how late it was known.
type Steps = Vec<(i64, i64, u32, i64)>;

fn steps() -> impl Strategy<Value = Steps> {
    proptest::collection::vec((prop_oneof![Just(0_i64), 1..90_i64], -3..4_i64, 1..50_u32, 0..30_i64), 0..80)
}

/// Times, prices around 100, sizes and times of being known, which do not go back.
fn walk(steps: &Steps) -> Vec<(Timestamp, f64, f64, Timestamp)> {
    let (mut time, mut cents, mut known) = (0, 10_000, 0);
    let of = |(wait, move_by, size, late): &(i64, i64, u32, i64)| {
        (time, cents) = (time + wait * Timestamp::NANOS, cents + move_by);
        known = known.max(time + late * Timestamp::NANOS / 10);
        (Timestamp(time), cents as f64 / 100.0, f64::from(*size), Timestamp(known))
    };
    steps.iter().map(of).collect()
}

/// An instrument with data of the kinds asked for.
fn rows(kinds: [bool; 4], all: [Steps; 4]) -> Rows {
    let [bars, quotes, prints, book] = all.map(|steps| walk(&steps));
    let mut rows = Rows::default();
    if kinds[0] {
        let bar = |(k, (_, price, size, _)): (usize, &(Timestamp, f64, f64, Timestamp))| {
            whole_bar(k as i64, [*price, price + 0.05, price - 0.04, price + 0.01], *size)
        };
        rows.bars = bars.iter().enumerate().map(bar).collect();
    }
    if kinds[1] {
        let level = |price: f64, size: f64| [Level { price, size }];
        let quote = |(time, price, size, _): &(Timestamp, f64, f64, Timestamp)| Known {
            known_at: *time,
            what: Book::new(*time, &level(price - 0.01, *size), &level(price + 0.01, 9.0)),
        };
        rows.quotes = quotes.iter().map(quote).collect();
    }
    if kinds[2] {
        let print = |(time, price, size, known_at): &(Timestamp, f64, f64, Timestamp)| Known {
            known_at: *known_at,
            what: Print { time: *time, price: *price, size: *size, aggressor: Some(Side::Sell) },
        };
        rows.prints = prints.iter().map(print).collect();
    }
    let side = |k: usize| if k.is_multiple_of(2) { Side::Buy } else { Side::Sell };
    for (k, (time, price, size, known_at)) in book.into_iter().enumerate() {
        let (side, price) = (side(k), Price::nearest(price - side(k).sign() * 0.05).unwrap());
        if kinds[3] {
            rows.depth.push(DepthChange { time, known_at, side, action: DepthAction::Set, price, size });
        } else if !kinds[1] {
            let action = OrderAction::Add;
            rows.orders.push(OrderEvent { time, known_at, id: k as u64, action, side, price, size });
        }
    }
    rows
}

fn of_latency(seconds: f64) -> Settings {
    let feed = Latency::Constant { seconds };
    let order = Latency::Uniform { least: 0.0, most: 2.0 };
    Settings { seed: Seed(4), latencies: Latencies { feed, order, ..Latencies::default() }, ..settings() }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 160, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_run_on_streams_is_the_run_on_whole_histories(
        kinds in proptest::collection::vec(any::<[bool; 4]>(), 1..3),
        drawn in proptest::collection::vec([steps(), steps(), steps(), steps()], 2),
        at_a_time in 1..12_usize,
        seconds in prop_oneof![Just(0.0), Just(0.5), Just(75.0)],
    ) {
        let all: Vec<Rows> = kinds.iter().zip(drawn).map(|(kinds, drawn)| rows(*kinds, drawn)).collect();
        let instruments: Vec<_> = ["A", "B"][..all.len()].iter().map(|symbol| instrument(symbol)).collect();
        let parts = [("half_spread", "bps", 1.0)];
        let whole = Backtest::new(instruments, all.iter().map(Rows::history).collect(), venue(&parts), of_latency(seconds));
        if let Ok(whole) = whole {
            let record = whole.run(&mut Busy::default()).unwrap();
            same_every_way(&whole, &record, &Busy::default(), at_a_time);
        }
    }
}

#[test]
fn there_must_be_data_and_as_many_streams_as_instruments() {
    let backtest = Backtest::streaming(vec![instrument("A")], venue(&[]), settings()).unwrap();
    assert_eq!(backtest.start_on(vec![Sources::default()]).err(), Some(BacktestError::NoData));
    assert_eq!(backtest.start_on(Vec::new()).err(), Some(BacktestError::Unmatched { instruments: 1, histories: 0 }));
}

/// Bars made as they are asked for, some at a time; it counts those that are given.
struct Made {
    next: i64,
    end: i64,
    given: Arc<AtomicUsize>,
}

impl Stream<Bar> for Made {
    fn refill(&mut self, into: &mut Vec<Bar>) -> Result<bool, StreamError> {
        let rows = self.next..self.end.min(self.next + 100);
        self.next = rows.end;
        self.given.fetch_add(rows.clone().count(), Relaxed);
        into.extend(rows.clone().map(|k| {
            let price = 100.0 + (k % 17) as f64;
            whole_bar(k, [price, price + 1.0, price - 1.0, price], 500.0)
        }));
        Ok(!rows.is_empty())
    }
}

#[test]
fn no_more_is_read_than_the_present_needs() {
    let given = Arc::new(AtomicUsize::new(0));
    let backtest = Backtest::streaming(vec![instrument("A")], venue(&[]), settings()).unwrap();
    let bars: Box<dyn Stream<Bar>> = Box::new(Made { next: 0, end: 100_000, given: given.clone() });
    let mut session = backtest.start_on(vec![Sources { bars: Some(bars), ..Sources::default() }]).unwrap();
    let mut busy = Busy::default();
    for k in 0..5_000 {
        assert_eq!(session.step(&mut busy).unwrap().unwrap().time, Timestamp((k + 1) * MINUTE));
        let ahead = given.load(Relaxed) as i64 - (k + 1);
        assert!((1..=101).contains(&ahead), "{ahead} rows were read ahead");
    }
    assert_eq!(session.progress(), (5_000, None));
}

/// A curve of a point a second is small, and its ends and extremes are those of the whole.
#[test]
fn a_thin_equity_curve_tells_of_the_same_fall() {
    let every = Some(60 * MINUTE);
    let run = |equity_every| {
        let given = Arc::new(AtomicUsize::new(0));
        let bars: Box<dyn Stream<Bar>> = Box::new(Made { next: 0, end: 3_000, given });
        let backtest =
            Backtest::streaming(vec![instrument("A")], venue(&[]), Settings { equity_every, ..settings() }).unwrap();
        let mut session = backtest.start_on(vec![Sources { bars: Some(bars), ..Sources::default() }]).unwrap();
        let mut busy = Busy::default();
        while session.step(&mut busy).unwrap().is_some() {}
        session.finish().unwrap()
    };
    let (whole, thin) = (run(None), run(every));
    assert_eq!((whole.equity.len(), &whole.blotter, &whole.ledger), (3_000, &thin.blotter, &thin.ledger));
    assert!(thin.equity.len() <= 4 * 51, "{}", thin.equity.len());
    let ends = |record: &Record| {
        let equity = record.equity.iter().map(|point| point.equity);
        (
            record.equity[0],
            *record.equity.last().unwrap(),
            equity.clone().fold(f64::MAX, f64::min),
            equity.fold(f64::MIN, f64::max),
        )
    };
    assert_eq!(ends(&whole), ends(&thin));
    let refused = Backtest::streaming(vec![instrument("A")], venue(&[]), Settings { equity_every: Some(0), ..settings() });
    assert_eq!(refused.err(), Some(BacktestError::EquityEvery(0)));
}

/// Rows that cannot be, some way into a stream, end the run there with what is wrong with them.
#[test]
fn a_stream_that_breaks_off_ends_the_run_with_its_error() {
    struct Broken(bool);
    impl Stream<Bar> for Broken {
        fn refill(&mut self, into: &mut Vec<Bar>) -> Result<bool, StreamError> {
            if std::mem::replace(&mut self.0, true) {
                let (found, before) = (Timestamp(0), Timestamp(1));
                return Err(HistoryError::Time { what: "bar", row: 9, found, before }.into());
            }
            into.extend((0..9).map(|k| whole_bar(k, [100.0; 4], 1.0)));
            Ok(true)
        }
    }
    let backtest = Backtest::streaming(vec![instrument("A")], venue(&[]), settings()).unwrap();
    let sources = Sources { bars: Some(Box::new(Broken(false))), ..Sources::default() };
    let mut session = backtest.start_on(vec![sources]).unwrap();
    let mut busy = Busy::default();
    let error = loop {
        match session.step(&mut busy) {
            Ok(event) => assert!(event.is_some()),
            Err(error) => break error,
        }
    };
    assert_eq!(busy.events, 7, "the ninth bar is at hand, but not what follows it");
    assert!(error.to_string().starts_with("bar 9: its time"), "{error}");
}
