//! What following a series costs: ns an observation of the filter, of run lengths, of cumulative sums and of a drift window, and
//! seconds of a fit and of a division. The reference in the same run is a sum of the same rows.
#![allow(missing_docs, clippy::expect_used, reason = "a bench has no users, and its models are valid")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use trueup::sim2real::Seed;
use trueup::sim2real::regime::{
    Assumed, Cost, Cusum, CusumSettings, Degrees, Division, DriftWindow, Emission, Family, Filter, HiddenMarkov,
    Observations, Penalty, Prior, RunLengths, Settings, Spread, fit,
};

const ROWS: usize = 100_000;

fn model(width: usize, degrees: Option<f64>) -> HiddenMarkov {
    let state = |mean: f64, deviation: f64| Emission {
        mean: vec![mean; width],
        spread: Spread::Diagonal(vec![deviation * deviation; width]),
        degrees,
    };
    let states = vec![state(0.05, 0.5), state(0.0, 1.2), state(-0.2, 3.0)];
    let transition = vec![vec![0.98, 0.015, 0.005], vec![0.03, 0.95, 0.02], vec![0.02, 0.08, 0.9]];
    HiddenMarkov::new(vec![0.6, 0.3, 0.1], transition, states).expect("a model")
}

fn online(criterion: &mut Criterion) {
    let series = model(1, None).simulate(ROWS, Seed(1)).values;
    let mut group = criterion.benchmark_group("regime_row");
    group.throughput(Throughput::Elements(ROWS as u64)).sample_size(20);
    group.bench_function("sum_of_the_rows", |b| b.iter(|| black_box(&series).iter().sum::<f64>()));
    for (name, model) in
        [("gaussian", model(1, None)), ("student_t", model(1, Some(5.0))), ("gaussian_4_columns", model(4, None))]
    {
        let series = model.simulate(ROWS, Seed(1)).values;
        group.bench_function(BenchmarkId::new("filter_3_states", name), |b| {
            let mut filter = Filter::new(model.clone());
            b.iter(|| {
                for row in series.chunks_exact(model.width()) {
                    black_box(filter.step(row).expect("a row"));
                }
            });
        });
    }
    for most in [50, 200] {
        let assumed = Assumed { most, ..Assumed::every(250.0, Prior::weak(0.0, 1.0)) };
        group.bench_function(BenchmarkId::new("run_lengths", most), |b| {
            b.iter(|| {
                let mut lengths = RunLengths::new(assumed.clone()).expect("settings");
                for value in &series[..ROWS / 10] {
                    black_box(lengths.step(*value).expect("a row"));
                }
            });
        });
    }
    group.bench_function("cumulative_sum", |b| {
        let settings = CusumSettings::for_false_alarms_every(500.0, 0.0, 1.2, 0.5).expect("settings");
        let mut cusum = Cusum::new(settings).expect("settings");
        b.iter(|| series.iter().filter(|x| cusum.step(**x).expect("a row").is_some()).count());
    });
    group.bench_function("drift_window_100_of_500", |b| {
        let mut drift = DriftWindow::new(&series[..500], 100, 0.001).expect("settings");
        b.iter(|| series.iter().filter(|x| drift.step(**x).expect("a row")).count());
    });
    group.finish();
}

fn whole_series(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("regime_series");
    group.sample_size(10).measurement_time(Duration::from_secs(15));
    let million = model(1, None).simulate(1_000_000, Seed(2)).values;
    group.bench_function("sum_of_1000000_rows", |b| b.iter(|| black_box(&million).iter().sum::<f64>()));
    let series = [Observations::of(&million).expect("a series")];
    group.bench_function("fit_3_states_1000000_rows", |b| {
        b.iter(|| black_box(fit(&series, &Settings::new(3)).expect("a fit")));
    });
    let short = [series[0].slice(0, 20_000)];
    group.bench_function("fit_3_states_of_student_t_20000_rows", |b| {
        let settings = Settings { family: Family::StudentT(Degrees::Fitted), ..Settings::new(3) };
        b.iter(|| black_box(fit(&short, &settings).expect("a fit")));
    });
    group.bench_function("viterbi_1000000_rows", |b| {
        b.iter(|| black_box(model(1, None).viterbi(series[0]).expect("a path")))
    });
    for (name, cost) in [("mean", Cost::Mean), ("mean_and_variance", Cost::MeanAndVariance)] {
        let division = Division { cost, penalty: Penalty::Mbic, shortest: 5 };
        group.bench_function(BenchmarkId::new("division_100000_rows", name), |b| {
            b.iter(|| black_box(division.divide(&million[..ROWS]).expect("a division")));
        });
    }
    group.finish();
}

criterion_group!(benches, online, whole_series);
criterion_main!(benches);
