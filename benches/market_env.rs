//! Nanoseconds a step of market environments: `Trade-v0` on bars without mechanisms, held, turned from long to short and back by chance as
//! in `./x environments`, and traded at every step; the same with costs, latency and randomization; quotes and books; a reset.
//!
//! `cargo bench --bench market_env`; divide the time of an iteration by its steps.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use trueup::market::ENVIRONMENTS;
use trueup::rl::{Actions, Buffers, Options, VecEnv, Which};

const STEPS: u64 = 10_000;

/// What is done at each step.
#[derive(Clone, Copy)]
enum Done {
    /// Nothing is traded.
    Held,
    /// Each action is at one end of its range, by chance: half of the steps trade where there is one.
    Turned,
    /// Actions are anywhere in their range.
    Traded,
}

/// Rows of actions within the space, the same every time, from a linear congruential generator (Knuth's MMIX constants).
fn actions(env: &dyn VecEnv, rows: usize, done: Done) -> Vec<f32> {
    let Some(space) = env.about().action.as_box() else { return Vec::new() };
    let mut state = 7_u64;
    let mut draw = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1_u64 << 24) as f32
    };
    let size = space.size();
    (0..rows * size)
        .map(|k| {
            let (low, high) = (space.low[k % size], space.high[k % size]);
            match done {
                Done::Held => 0.0,
                Done::Turned => {
                    if draw() < 0.5 {
                        low
                    } else {
                        high
                    }
                }
                Done::Traded => low + (high - low) * draw(),
            }
        })
        .collect()
}

/// So many steps, with a reset wherever an episode ends.
fn run(env: &mut dyn VecEnv, rows: &[f32], out: &mut Buffers) -> f64 {
    let size = env.about().action.size();
    let mut sum = 0.0;
    for row in rows.chunks_exact(size) {
        if env.step(Actions::Continuous(row), &mut out.out()).is_err() {
            return f64::NAN;
        }
        sum += out.rewards[0];
        if out.terminated[0] || out.truncated[0] {
            (out.terminated[0], out.truncated[0]) = (false, false);
            let _ = env.reset(Which::All, None, &Options::new(), &mut out.observations);
        }
    }
    sum
}

fn bench(c: &mut Criterion) {
    let costs = || Options::new().with("commission", 0.5).with("latency", 0.2).with("randomization", 1.0);
    let cases = [
        ("Trade-v0 on bars, held", "trueup/Trade-v0", Options::new(), Done::Held),
        ("Trade-v0 on bars, turned by chance", "trueup/Trade-v0", Options::new().with("band", 0.5), Done::Turned),
        ("Trade-v0 on bars, traded at every step", "trueup/Trade-v0", Options::new(), Done::Traded),
        ("Trade-v0 on bars, with costs, latency and randomization", "trueup/Trade-v0", costs(), Done::Traded),
        ("Trade-v0 on quotes", "trueup/Trade-v0", Options::new().with("data", "quotes"), Done::Traded),
        ("Execute-v0 on quotes", "trueup/Execute-v0", Options::new(), Done::Traded),
        ("MakeMarket-v0 on a book", "trueup/MakeMarket-v0", Options::new(), Done::Traded),
        ("Allocate-v0, four instruments", "trueup/Allocate-v0", Options::new(), Done::Traded),
    ];
    let mut group = c.benchmark_group("10,000 steps");
    group.throughput(Throughput::Elements(STEPS)).sample_size(20);
    for (name, id, options, done) in cases {
        let Some(mut env) = ENVIRONMENTS.iter().find(|entry| entry.id == id).and_then(|e| (e.make)(1, &options).ok()) else {
            continue;
        };
        let (rows, mut out) = (actions(&*env, STEPS as usize, done), Buffers::of(&*env));
        if env.reset(Which::All, Some(&[1]), &Options::new(), &mut out.observations).is_err() {
            continue;
        }
        group.bench_function(name, |b| b.iter(|| run(&mut *env, black_box(&rows), &mut out)));
    }
    group.finish();
    let mut group = c.benchmark_group("a reset");
    for (name, id) in [("bars", "trueup/Trade-v0"), ("a book", "trueup/MakeMarket-v0")] {
        let Some(mut env) = ENVIRONMENTS.iter().find(|e| e.id == id).and_then(|e| (e.make)(1, &Options::new()).ok()) else {
            continue;
        };
        let mut out = Buffers::of(&*env);
        group.bench_function(name, |b| {
            b.iter(|| env.reset(Which::All, None, &Options::new(), &mut out.observations).is_ok());
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
