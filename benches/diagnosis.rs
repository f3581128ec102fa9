//! What a whole diagnosis of one joint costs: two recordings of 6,000 samples, every mechanism of the registry. The
//! reference in the same run is the refit of the twin's own parameters alone.
#![allow(missing_docs, clippy::panic, reason = "a bench has no users, and ends where the generator lacks a column")]

use std::hint::black_box;

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

fn recording(effects: &[ServoEffect], excitation: Excitation) -> Recording<Commands> {
    let table = Servo::default().with(effects).record(excitation, Seed(1));
    let samples = column(&table, "q").into_iter().map(Some).collect();
    Recording {
        name: format!("{excitation:?}"),
        time: column(&table, "t"),
        stimulus: Commands(column(&table, "u")),
        measured: vec![Measured { channel: "position".into(), unit: "rad".into(), samples }],
    }
}

fn diagnoses(criterion: &mut Criterion) {
    let twin = Assembly::new(Joint::new(Axis::Rotary, [0.11, 0.25, 2.7, 1.0], [0.2, 0.2, 0.2, 0.0]), MECHANISMS);
    let mut group = criterion.benchmark_group("diagnosis_2x6000");
    group.sample_size(10);
    let friction = ServoEffect::TYPICAL[0];
    let recordings = [Excitation::SinesAndSteps, Excitation::ChirpAndSteps].map(|e| recording(&[friction], e));
    group.bench_function("refit_alone", |b| {
        b.iter(|| black_box(calibrate(&twin, &recordings, &[], Seed(1), &|_, _, _| ())));
    });
    group.bench_function("one_effect", |b| {
        b.iter(|| black_box(diagnose(&twin, &recordings, &[], Seed(1), &|_, _, _| ())));
    });
    let nothing = [Excitation::SinesAndSteps, Excitation::ChirpAndSteps].map(|e| recording(&[], e));
    group.bench_function("no_effect", |b| {
        b.iter(|| black_box(diagnose(&twin, &nothing, &[], Seed(1), &|_, _, _| ())));
    });
    group.finish();
}

criterion_group!(benches, diagnoses);
criterion_main!(benches);
