//! What a whole diagnosis of one joint costs: two recordings of 6,000 samples, every mechanism of the registry. The
//! reference in the same run is the refit of the twin's own parameters alone; recordings ten times as long must cost no more
//! than ten times as much.
#![allow(missing_docs, clippy::panic, reason = "a bench has no users, and ends where the generator lacks a column")]

use std::hint::black_box;
use std::sync::Mutex;
use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use trueup::conceal::servo::{Excitation, Servo, ServoEffect};
use trueup::conceal::{Column, Table};
use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::diagnose::{calibrate, diagnose};
use trueup::sim2real::{Assembly, Measured, Recording, Seed};

fn column(table: &Table, name: &str) -> Vec<f64> {
    match table.columns().iter().find(|(other, _)| other == name) {
        Some((_, Column::Real(values))) => values.clone(),
        other => panic!("no column of numbers {name}: {other:?}"),
    }
}

fn recording(effects: &[ServoEffect], excitation: Excitation, rows: usize) -> Recording<Commands> {
    let table = Servo { rows, ..Servo::default() }.with(effects).record(excitation, Seed(1));
    let samples = column(&table, "q").into_iter().map(Some).collect();
    Recording {
        name: format!("{excitation:?}"),
        time: column(&table, "t"),
        stimulus: Commands(column(&table, "u")),
        measured: vec![Measured { channel: "position".into(), unit: "rad".into(), samples }],
    }
}

fn recordings(effects: &[ServoEffect], rows: usize) -> [Recording<Commands>; 2] {
    [Excitation::SinesAndSteps, Excitation::ChirpAndSteps].map(|e| recording(effects, e, rows))
}

/// Says once what each step of a diagnosis takes.
fn tell_steps(twin: &Assembly<Joint>, recordings: &[Recording<Commands>]) {
    let steps: Mutex<Vec<(String, Instant)>> = Mutex::new(Vec::new());
    let begun = Instant::now();
    let told = |step: &str, _: usize, _: usize| {
        if let Ok(mut steps) = steps.lock() {
            steps.push((step.to_owned(), Instant::now()));
        }
    };
    black_box(diagnose(twin, recordings, &[], Seed(1), &told));
    let ended = Instant::now();
    let steps = steps.into_inner().unwrap_or_default();
    println!("one effect, step by step:");
    for (k, (step, at)) in steps.iter().enumerate() {
        let next = steps.get(k + 1).map_or(ended, |(_, at)| *at);
        println!("  {:>8.1} ms  {step}", 1e3 * (next - *at).as_secs_f64());
    }
    println!("  {:>8.1} ms  in all", 1e3 * (ended - begun).as_secs_f64());
}

fn diagnoses(criterion: &mut Criterion) {
    let twin = Assembly::new(Joint::new(Axis::Rotary, [0.11, 0.25, 2.7, 1.0], [0.2, 0.2, 0.2, 0.0]), MECHANISMS);
    let friction = [ServoEffect::TYPICAL[0]];
    tell_steps(&twin, &recordings(&friction, 6_000));
    let mut group = criterion.benchmark_group("diagnosis_2x6000");
    group.sample_size(10);
    let one = recordings(&friction, 6_000);
    group.bench_function("refit_alone", |b| {
        b.iter(|| black_box(calibrate(&twin, &one, &[], Seed(1), &|_, _, _| ())));
    });
    group.bench_function("one_effect", |b| {
        b.iter(|| black_box(diagnose(&twin, &one, &[], Seed(1), &|_, _, _| ())));
    });
    let nothing = recordings(&[], 6_000);
    group.bench_function("no_effect", |b| {
        b.iter(|| black_box(diagnose(&twin, &nothing, &[], Seed(1), &|_, _, _| ())));
    });
    group.finish();
    let mut group = criterion.benchmark_group("diagnosis_2x60000");
    group.sample_size(10);
    let longer = recordings(&friction, 60_000);
    group.bench_function("one_effect", |b| {
        b.iter(|| black_box(diagnose(&twin, &longer, &[], Seed(1), &|_, _, _| ())));
    });
    group.finish();
}

criterion_group!(benches, diagnoses);
criterion_main!(benches);
