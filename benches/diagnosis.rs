//! What a whole diagnosis of one joint costs: two recordings of 6,000 samples, every mechanism of the registry, step by step,
//! with the memory it takes. The reference in the same run is the refit of the twin's own parameters alone; recordings ten
//! times as long must cost no more than ten times as much.
#![allow(missing_docs, clippy::panic, reason = "a bench has no users, and ends where the generator lacks a column")]

use std::hint::black_box;
use std::sync::Mutex;
use std::time::Instant;

use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
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

/// Most memory this process has had so far [MB], where the system tells.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse::<f64>().ok().map(|kilobytes| kilobytes / 1024.0)
}

/// Diagnoses once and says what each step took; gives the seconds of the whole.
fn tell_steps(what: &str, twin: &Assembly<Joint>, recordings: &[Recording<Commands>]) -> f64 {
    let steps: Mutex<Vec<(String, Instant)>> = Mutex::new(Vec::new());
    let begun = Instant::now();
    let told = |step: &str, done: usize, _: usize| {
        if let Ok(mut steps) = steps.lock() {
            let number = if done > 0 { format!(", {}", done + 1) } else { String::new() };
            steps.push((format!("{step}{number}"), Instant::now()));
        }
    };
    let outcome = diagnose(twin, recordings, &[], Seed(1), &told);
    let ended = Instant::now();
    let steps = steps.into_inner().unwrap_or_default();
    let named: Vec<&str> = outcome.diagnosis.effects.iter().map(|effect| effect.mechanism.as_str()).collect();
    println!("{what}: {:?} {}", outcome.diagnosis.verdict, named.join(", "));
    for (k, (step, at)) in steps.iter().enumerate() {
        let next = steps.get(k + 1).map_or(ended, |(_, at)| *at);
        println!("  {:>9.1} ms  {step}", 1e3 * (next - *at).as_secs_f64());
    }
    let seconds = (ended - begun).as_secs_f64();
    let memory = peak_memory().map_or_else(String::new, |peak| format!(", at most {peak:.0} MB so far"));
    println!("  {:>9.1} ms  in all{memory}", 1e3 * seconds);
    seconds
}

fn diagnoses(criterion: &mut Criterion) {
    let twin = Assembly::new(Joint::new(Axis::Rotary, [0.11, 0.25, 2.7, 1.0], [0.2, 0.2, 0.2, 0.0]), MECHANISMS);
    let friction = [ServoEffect::TYPICAL[0]];
    let one = recordings(&friction, 6_000);
    let nothing = recordings(&[], 6_000);
    tell_steps("nothing missing, 2 x 6,000", &twin, &nothing);
    let short = (0..3).map(|_| tell_steps("one effect, 2 x 6,000", &twin, &one)).fold(f64::INFINITY, f64::min);
    let long = tell_steps("one effect, 2 x 60,000", &twin, &recordings(&friction, 60_000));
    println!("ten times the samples take {:.1} times as long", long / short);
    let mut group = criterion.benchmark_group("diagnosis_2x6000");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group.bench_function("refit_alone", |b| {
        b.iter(|| black_box(calibrate(&twin, &one, &[], Seed(1), &|_, _, _| ())));
    });
    group.bench_function("one_effect", |b| {
        b.iter(|| black_box(diagnose(&twin, &one, &[], Seed(1), &|_, _, _| ())));
    });
    group.bench_function("no_effect", |b| {
        b.iter(|| black_box(diagnose(&twin, &nothing, &[], Seed(1), &|_, _, _| ())));
    });
    group.finish();
}

criterion_group!(benches, diagnoses);
criterion_main!(benches);
