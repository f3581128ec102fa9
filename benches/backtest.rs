//! Nanoseconds a bar of the event loop with `sma_cross`, beside a fused loop that only computes the two averages.
//!
//! `cargo bench --bench backtest`; divide the time of an iteration by 1,000,000 bars.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use trueup::market::{Backtest, Bar, Cash, Execution, History, Instrument, MECHANISMS, Price, Quotes, Settings};
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

fn backtest() -> Option<Backtest> {
    let history = History::new(bars(), Quotes::default()).ok()?;
    let instrument = Instrument {
        symbol: "XYZ".into(),
        tick_size: 0.01,
        lot_size: 1.0,
        average_daily_volume: None,
        daily_volatility: None,
    };
    let settings = Settings::with_cash(Cash::nearest(1e6).ok()?);
    Backtest::new(vec![instrument], vec![history], Assembly::new(Execution, MECHANISMS), settings).ok()
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
    group.bench_function("sma_cross backtest", |b| {
        b.iter_batched(
            || strategies::build(&table),
            |strategy| strategy.ok().and_then(|mut strategy| backtest.run(strategy.as_mut()).ok()),
            BatchSize::PerIteration,
        );
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
