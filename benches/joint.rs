//! What a tick of a joint costs: with 0, 3 and 6 mechanisms, over 1 and 16 lanes. The reference in the same run is the bare
//! equation of motion in a loop of its own.
#![allow(missing_docs, clippy::expect_used, reason = "a bench has no users, and ends where the registry lacks a row")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::{Assembly, Plant, Recording, Seed, Simulator, Thetas, Twin};

const ROWS: usize = 10_000;

fn recording() -> Recording<Commands> {
    let time: Vec<f64> = (0..ROWS).map(|i| i as f64 * 1e-3).collect();
    let commands = time.iter().map(|t| 2.0 * (1.3 * t).sin() + (7.0 * t).cos()).collect();
    Recording { name: "bench".into(), stimulus: Commands(commands), measured: vec![], time }
}

/// The joint with the first `count` mechanisms of the registry, each at a start.
fn assembly(count: usize) -> (Assembly<Joint>, Vec<f64>) {
    let plant = Joint::new(Axis::Rotary, [0.11, 0.25, 2.7, 1.0], [0.2; 4]);
    let mut theta: Vec<f64> = plant.parameters().iter().map(|p| p.nominal).collect();
    let mut assembly = Assembly::new(plant, MECHANISMS);
    let recording = [recording()];
    for name in ["coulomb_friction", "stiffness", "dead_zone", "quadratic_drag", "bias", "command_delay"].iter().take(count)
    {
        let candidates = assembly.candidates(&recording);
        let candidate = candidates.iter().find(|c| c.about.name == *name).expect("a mechanism of the registry");
        theta.extend(candidate.form.parameters.iter().map(|p| p.starts[0]));
        assembly = assembly.with(candidate);
    }
    theta.extend([0.1, 0.0]);
    (assembly, theta)
}

fn rollouts(criterion: &mut Criterion) {
    let recording = recording();
    let mut group = criterion.benchmark_group("joint_tick");
    group.throughput(Throughput::Elements(ROWS as u64)).sample_size(20);
    group.bench_function("equation_of_motion_alone", |b| {
        b.iter(|| {
            let (mut q, mut v) = (0.1_f64, 0.0_f64);
            for u in &recording.stimulus.0 {
                q += 0.5e-3 * v;
                v += 1e-3 * (u - 0.25 * v - 2.7 * q.sin()) / 0.11;
                q += 0.5e-3 * v;
            }
            black_box((q, v))
        });
    });
    for mechanisms in [0, 3, 6] {
        let (assembly, theta) = assembly(mechanisms);
        for lanes in [1, 16] {
            let thetas = Thetas::from_lanes(&vec![theta.clone(); lanes]);
            group.bench_function(BenchmarkId::new(format!("{mechanisms}_mechanisms"), format!("{lanes}_lanes")), |b| {
                b.iter(|| black_box(assembly.rollout(&thetas, &recording, 0..ROWS, Seed(1))));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, rollouts);
criterion_main!(benches);
