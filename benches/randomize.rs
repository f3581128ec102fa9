//! How long draws take: 20 parameters for 4,096 environments, on one core. A control step of 4,096 environments takes some
//! milliseconds, which a reset may not add to.

#![allow(missing_docs, clippy::panic, reason = "a bench has no users, and ends where its randomizer is none")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::RngExt as _;
use trueup::sim2real::randomize::{Correlation, Distribution, Level, Occasion, Randomized, Randomizer, Redraw, Target};
use trueup::sim2real::{Parameter, Seed};

const PARAMETERS: usize = 20;
const ENVIRONMENTS: usize = 4_096;

fn randomizer(kinds: &[Distribution], correlations: Vec<Correlation>) -> Randomizer {
    let one = |k: usize| Randomized {
        target: Target::own(&format!("p{k}")),
        parameter: Parameter::named(format!("p{k}"), "", 1.0),
        distribution: kinds[k % kinds.len()].clone(),
        relative: k % 2 == 1,
        at: Redraw::Reset,
    };
    Randomizer::new((0..PARAMETERS).map(one).collect(), correlations).unwrap_or_else(|error| panic!("{error}"))
}

fn draws(criterion: &mut Criterion) {
    let uniform = Distribution::Uniform { low: 0.8, high: 1.2 };
    let logarithmic = Distribution::LogUniform { low: 0.5, high: 2.0 };
    let normal = Distribution::Normal { mean: 1.0, std: 0.1 };
    let truncated = Distribution::TruncatedNormal { mean: 1.0, std: 0.5, low: 0.1, high: 2.0 };
    let neighbours = (1..PARAMETERS).map(|k| Correlation {
        between: [Target::own(&format!("p{}", k - 1)), Target::own(&format!("p{k}"))],
        coefficient: 0.4,
    });
    let rows = [
        ("uniform", randomizer(std::slice::from_ref(&uniform), Vec::new())),
        // As robots' tables have them: half of them uniform, the others by factors and Gaussian.
        ("mixed", randomizer(&[uniform.clone(), logarithmic.clone(), uniform.clone(), normal.clone()], Vec::new())),
        ("log_uniform", randomizer(&[logarithmic], Vec::new())),
        ("normal", randomizer(std::slice::from_ref(&normal), Vec::new())),
        ("truncated_normal", randomizer(&[truncated], Vec::new())),
        ("correlated_normal", randomizer(&[normal], neighbours.clone().collect())),
        ("correlated_uniform", randomizer(&[uniform], neighbours.collect())),
    ];
    let mut group = criterion.benchmark_group("draws_of_20_parameters_for_4096_environments");
    group.throughput(Throughput::Elements((PARAMETERS * ENVIRONMENTS) as u64));
    let episodes: Vec<u64> = vec![3; ENVIRONMENTS];
    for (name, randomizer) in &rows {
        for level in [1.0, 0.5] {
            let mut table = randomizer.nominal(ENVIRONMENTS);
            let full = Level::new(level).unwrap_or(Level::FULL);
            group.bench_function(BenchmarkId::new(*name, level), |bencher| {
                bencher.iter(|| {
                    randomizer.draw(&mut table, Seed(7), Occasion::Reset, 0, black_box(&episodes), full);
                    black_box(table.values()[0])
                });
            });
        }
    }
    // What a generator with a state would cost, one for each environment.
    group.bench_function("uniform_by_a_named_stream_an_environment", |bencher| {
        let mut values = vec![0.0; PARAMETERS * ENVIRONMENTS];
        bencher.iter(|| {
            for environment in 0..ENVIRONMENTS {
                let mut stream = Seed(7).stream(&format!("environment {environment}"));
                (0..PARAMETERS).for_each(|k| values[k * ENVIRONMENTS + environment] = stream.random_range(0.8..1.2));
            }
            black_box(values[0])
        });
    });
    group.finish();
}

criterion_group!(benches, draws);
criterion_main!(benches);
