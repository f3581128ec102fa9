//! What a step of equations costs: Duffing's oscillator as a user writes it, over 1 and 16 lanes. The references in the same run
//! are the same Runge-Kutta step in Rust, and for a pendulum the joint that is built in.
#![allow(missing_docs, clippy::expect_used, reason = "a bench has no users")]

use std::hint::black_box;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use trueup::robot::{
    Attachment, Axis, Commands, Driving, EQUATIONS_MECHANISMS, EquationSystem, Equations, InputVariable, Joint, MECHANISMS,
    OutputVariable, StateVariable,
};
use trueup::sim2real::{Assembly, Parameter, Recording, Seed, Simulator, Thetas};

const ROWS: usize = 10_000;
const STEP: f64 = 1e-3;

fn recording() -> Recording<Driving> {
    let time: Vec<f64> = (0..ROWS).map(|i| i as f64 * STEP).collect();
    let commands: Vec<f64> = time.iter().map(|t| 2.0 * (1.3 * t).sin() + (7.0 * t).cos()).collect();
    Recording { name: "bench".into(), stimulus: Driving::new(&time, &[(commands, false)]), measured: vec![], time }
}

/// A mass with damping and the given effort of its spring.
fn oscillator(spring: &str) -> Equations {
    let state = |name: &str| StateVariable { name: name.into(), unit: String::new(), initial: 0.0, std: None };
    let system = EquationSystem {
        states: vec![state("x"), state("v")],
        inputs: vec![InputVariable { name: "u".into(), unit: String::new(), interpolated: false }],
        parameters: [("d", 0.4), ("k", 9.0), ("k3", 20.0), ("m", 0.7)]
            .map(|(name, value)| Parameter::new(name, "", value))
            .to_vec(),
        rates: vec![("x".into(), "v".into()), ("v".into(), format!("(u - d*v - ({spring}))/m"))],
        outputs: vec![OutputVariable { name: "y".into(), unit: String::new(), expression: "x".into() }],
        attach: Some(Attachment { position: "x".into(), velocity: "v".into(), inertia: "m".into() }),
        ..EquationSystem::default()
    };
    Equations::new(system, STEP).expect("equations of an oscillator")
}

fn steps(criterion: &mut Criterion) {
    let recording = recording();
    let mut group = criterion.benchmark_group("equations_step");
    group.throughput(Throughput::Elements(ROWS as u64)).sample_size(20);
    group.bench_function("written_in_rust", |b| {
        b.iter(|| {
            let (mut x, mut v) = (0.1_f64, 0.0_f64);
            for u in recording.stimulus.as_ref() {
                let a = |x: f64, v: f64| (u - 0.4 * v - 9.0 * x - 20.0 * x * x * x) / 0.7;
                let (k1, l1) = (v, a(x, v));
                let (k2, l2) = (v + 0.5 * STEP * l1, a(x + 0.5 * STEP * k1, v + 0.5 * STEP * l1));
                let (k3, l3) = (v + 0.5 * STEP * l2, a(x + 0.5 * STEP * k2, v + 0.5 * STEP * l2));
                let (k4, l4) = (v + STEP * l3, a(x + STEP * k3, v + STEP * l3));
                x += STEP / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                v += STEP / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
            }
            black_box(x)
        });
    });
    let assembly = Assembly::new(oscillator("k*x + k3*x^3"), EQUATIONS_MECHANISMS);
    for lanes in [1, 16] {
        let theta = [0.4, 9.0, 20.0, 0.7, 0.1, 0.0];
        let thetas = Thetas::from_lanes(&vec![theta; lanes]);
        group.throughput(Throughput::Elements((ROWS * lanes) as u64));
        group.bench_with_input(BenchmarkId::new("lanes", lanes), &thetas, |b, thetas| {
            b.iter(|| black_box(assembly.rollout(thetas, &recording, 0..ROWS, Seed(0))));
        });
    }
    group.finish();
}

/// Nanoseconds a step and lane, the least of several runs.
fn least(lanes: usize, mut run: impl FnMut()) -> f64 {
    let once = |_| {
        let begun = Instant::now();
        run();
        begun.elapsed().as_secs_f64()
    };
    1e9 * (0..20).map(once).fold(f64::INFINITY, f64::min) / (ROWS * lanes) as f64
}

/// A pendulum written down beside the joint that is built in, whose step needs one sine and not four.
fn pendulum(criterion: &mut Criterion) {
    let driving = recording();
    let joint = Joint::new(Axis::Rotary, [0.7, 0.4, 9.0, 1.0], [0.1; 4]);
    let commands = Recording {
        name: driving.name.clone(),
        time: driving.time.clone(),
        stimulus: Commands(driving.stimulus.as_ref().to_vec()),
        measured: vec![],
    };
    let built_in = Assembly::new(joint, MECHANISMS);
    let written = Assembly::new(oscillator("k*sin(x)"), EQUATIONS_MECHANISMS);
    let mut group = criterion.benchmark_group("pendulum_step");
    group.sample_size(20);
    for lanes in [1, 16] {
        let of_joint = Thetas::from_lanes(&vec![[0.7, 0.4, 9.0, 1.0, 0.1, 0.0]; lanes]);
        let of_equations = Thetas::from_lanes(&vec![[0.4, 9.0, 20.0, 0.7, 0.1, 0.0]; lanes]);
        let joint = || drop(black_box(built_in.rollout(&of_joint, &commands, 0..ROWS, Seed(0))));
        let equations = || drop(black_box(written.rollout(&of_equations, &driving, 0..ROWS, Seed(0))));
        let (of_built_in, of_written) = (least(lanes, joint), least(lanes, equations));
        let ratio = of_written / of_built_in;
        println!(
            "{lanes} lanes: {of_built_in:.1} ns a step and lane built in, {of_written:.1} ns written: {ratio:.1} times"
        );
        group.throughput(Throughput::Elements((ROWS * lanes) as u64));
        group.bench_function(BenchmarkId::new("built_in", lanes), |b| b.iter(joint));
        group.bench_function(BenchmarkId::new("written", lanes), |b| b.iter(equations));
    }
    group.finish();
}

criterion_group!(benches, steps, pendulum);
criterion_main!(benches);
