//! Nanoseconds an event of the event loop: bars with `sma_cross` beside a fused loop that only computes the two averages; changes
//! of a book with a resting order on each side and a millisecond of latency beside the book alone; eight feeds merged.
//!
//! `cargo bench --bench backtest`; divide the time of an iteration by 1,000,000 events.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use trueup::market::{
    Backtest, Bar, Cash, DepthAction, DepthBook, DepthChange, Execution, Feed, History, Increments, Instrument, Latencies,
    Latency, MECHANISMS, OrderId, Orders, Price, Quantity, Quotes, Settings, Side, Strategy, Ticket, View,
};
use trueup::sim2real::{Assembly, Timestamp};
use trueup::strategies;

const BARS: usize = 1_000_000;
const FAST: usize = 10;
const SLOW: usize = 50;

/// Minute bars of a random walk in cents, from a linear congruential generator (Knuth's MMIX constants).
fn bars() -> Vec<Bar> {
    const CENT: i64 = 10_000_000;
    let (mut state, mut cents) = (7_u64, 10_000_i64);
    let mut draw = |below: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % below
    };
    (0..BARS as i64)
        .map(|k| {
            let open_at = Timestamp(k * 60 * Timestamp::NANOS);
            let open = Price(cents * CENT);
            cents = (cents + draw(21) as i64 - 10).max(100);
            let close = Price(cents * CENT);
            let (high, low) = (open.max(close), open.min(close));
            Bar { open_at, known_at: open_at + 60 * Timestamp::NANOS, open, high, low, close, volume: draw(1_000) as f64 }
        })
        .collect()
}

fn instrument() -> Instrument {
    Instrument { symbol: "XYZ".into(), tick_size: 0.01, lot_size: 1.0, average_daily_volume: None, daily_volatility: None }
}

/// Changes of a book within fifty ticks of a mid that wanders, one every 100 us.
fn changes() -> Vec<DepthChange> {
    const CENT: i64 = 10_000_000;
    let (mut state, mut mid) = (7_u64, 10_000_i64);
    let mut draw = |below: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % below
    };
    (0..BARS as i64)
        .map(|k| {
            if k % 64 == 0 {
                mid = (mid + draw(3) as i64 - 1).max(1_000);
            }
            let distance = 1 + (draw(50) * draw(50) / 50) as i64;
            let (side, tick) = if draw(2) == 0 { (Side::Buy, mid - distance) } else { (Side::Sell, mid + distance) };
            let size = if draw(4) == 0 { 0.0 } else { draw(1_000) as f64 };
            let time = Timestamp(k * 100_000);
            DepthChange { time, known_at: time, side, action: DepthAction::Set, price: Price(tick * CENT), size }
        })
        .collect()
}

/// Keeps an order five ticks behind the best on each side.
#[derive(Default)]
struct Quoter {
    own: [Option<OrderId>; 2],
}

impl Strategy for Quoter {
    fn name(&self) -> &str {
        "quoter"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        for (own, side) in self.own.iter_mut().zip([Side::Buy, Side::Sell]) {
            let Some(best) = view.best(0, side) else { continue };
            let working = own.and_then(|id| view.orders(0).iter().find(|order| order.id == id));
            match working.and_then(|order| order.kind.limit()) {
                // It moves when the market has gone ten ticks away.
                Some(price) if (price.0 - best.0).abs() < 100_000_000 => {}
                Some(_) => {
                    if let Some(id) = *own {
                        orders.replace(id, None, Some(best));
                    }
                }
                None => *own = Some(orders.submit(Ticket::limit(0, side, Quantity(1_000_000_000), best))),
            }
        }
    }
}

fn quoted() -> Option<Backtest> {
    let history = History::default().with_depth(changes()).ok()?;
    let order = Latency::Constant { seconds: 1e-3 };
    let latencies = Latencies { order: order.clone(), response: order, ..Latencies::default() };
    let settings = Settings { latencies, max_leverage: 10.0, ..Settings::with_cash(Cash::nearest(1e9).ok()?) };
    Backtest::new(vec![instrument()], vec![history], Assembly::new(Execution, MECHANISMS), settings).ok()
}

/// Eight instruments of an eighth of the bars each, a second apart.
fn eight() -> Option<Vec<History>> {
    let all = bars();
    (0..8_i64)
        .map(|k| {
            let shifted = |bar: &Bar| Bar {
                open_at: bar.open_at + k * Timestamp::NANOS,
                known_at: bar.known_at + k * Timestamp::NANOS,
                ..*bar
            };
            History::new(all[..BARS / 8].iter().map(shifted).collect(), Quotes::default()).ok()
        })
        .collect()
}

fn backtest() -> Option<Backtest> {
    let history = History::new(bars(), Quotes::default()).ok()?;
    let settings = Settings::with_cash(Cash::nearest(1e6).ok()?);
    Backtest::new(vec![instrument()], vec![history], Assembly::new(Execution, MECHANISMS), settings).ok()
}

/// The two averages and how often they cross, and nothing else.
fn fused(closes: &[f64]) -> usize {
    let (mut fast, mut slow, mut above, mut crosses) = (0.0, 0.0, false, 0);
    for k in 0..closes.len() {
        fast += closes[k];
        slow += closes[k];
        if k >= FAST {
            fast -= closes[k - FAST];
        }
        if k >= SLOW {
            slow -= closes[k - SLOW];
        }
        if k + 1 >= SLOW {
            let now = fast / FAST as f64 > slow / SLOW as f64;
            crosses += usize::from(now != above);
            above = now;
        }
    }
    crosses
}

fn bench(c: &mut Criterion) {
    let Some(backtest) = backtest() else { return };
    let table: toml::Table = [("kind", toml::Value::from("sma_cross")), ("fast", 10.into()), ("slow", 50.into())]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect();
    let closes: Vec<f64> = backtest.histories()[0].bars().iter().map(|bar| bar.close.to_f64()).collect();
    let mut group = c.benchmark_group("1,000,000 bars");
    group.throughput(Throughput::Elements(BARS as u64)).sample_size(20);
    group.bench_function("fused averages", |b| b.iter(|| fused(black_box(&closes))));
    let run =
        |strategy: Result<Box<dyn Strategy>, _>| strategy.ok().and_then(|mut strategy| backtest.run(strategy.as_mut()).ok());
    group.bench_function("sma_cross backtest, in memory of its own", |b| {
        b.iter_batched(|| strategies::build(&table), run, BatchSize::PerIteration);
    });
    // As a sweep runs one after the other.
    group.bench_function("sma_cross backtest", |b| {
        b.iter_batched(
            || strategies::build(&table),
            |strategy| run(strategy).map(|record| backtest.recycle(record)),
            BatchSize::PerIteration,
        );
    });
    group.finish();
    bench_book(c);
    bench_merge(c);
}

fn bench_book(c: &mut Criterion) {
    let (Some(backtest), Ok(increments)) = (quoted(), Increments::of(&instrument())) else { return };
    let changes = changes();
    let mut group = c.benchmark_group("1,000,000 changes of a book");
    group.throughput(Throughput::Elements(BARS as u64)).sample_size(20);
    group.bench_function("the book alone", |b| {
        b.iter(|| {
            let mut book = DepthBook::new(increments);
            for change in black_box(&changes) {
                book.apply(change);
                book.settle();
            }
            book.best(Side::Buy)
        });
    });
    group.bench_function("queue and 1 ms latency", |b| {
        b.iter_batched(
            Quoter::default,
            |mut strategy| backtest.run(&mut strategy).ok().map(|record| backtest.recycle(record)),
            BatchSize::PerIteration,
        );
    });
    group.finish();
}

fn bench_merge(c: &mut Criterion) {
    let Some(histories) = eight() else { return };
    let mut group = c.benchmark_group("1,000,000 events of eight feeds");
    group.throughput(Throughput::Elements(BARS as u64)).sample_size(20);
    group
        .bench_function("merged", |b| b.iter(|| Feed::new(black_box(&histories)).fold(0, |sum, arrival| sum + arrival.row)));
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
