//! What a step of an environment of robots costs a lane [ns of processor time], over 4,096 lanes, resets of lanes whose episode is over
//! among them: without mechanisms, with a delay, noise and randomization, and with what only laws can run.
#![allow(missing_docs, clippy::expect_used, reason = "a bench has no users, and ends where an environment cannot be made")]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use trueup::rl::{Actions, Buffers, Options, Space, VecEnv, Which};
use trueup::robot::ENVIRONMENTS;

const LANES: usize = 4_096;

/// A delay of two steps at the most, noise, and three parameters drawn in each episode.
const WIRED: &str = "
[[mechanism]]
name = \"command_delay\"
seconds = 0.02
[[mechanism]]
name = \"noise\"
std = 0.01
[[randomize.parameter]]
mechanism = \"command_delay\"
parameter = \"seconds\"
distribution = \"uniform\"
low = 0.0
high = 0.04
[[randomize.parameter]]
mechanism = \"noise\"
parameter = \"std\"
distribution = \"uniform\"
low = 0.0
high = 0.02
";
const GRAVITY: &str = "
[[randomize.parameter]]
parameter = \"gravity\"
distribution = \"uniform\"
low = 0.9
high = 1.1
relative = true
";
const FRICTION: &str = "
[[mechanism]]
name = \"coulomb_friction\"
torque = 0.05
[[mechanism]]
name = \"actuator_lag\"
time_constant = 0.01
";

/// An environment, actions for it, and where it writes.
struct Play {
    env: Box<dyn VecEnv>,
    out: Buffers,
    over: Vec<bool>,
    left: Vec<i64>,
    right: Vec<f32>,
}

impl Play {
    fn new(id: &str, options: &Options) -> Self {
        let entry = ENVIRONMENTS.iter().find(|entry| entry.id == id).expect("an environment of this id");
        let mut env = (entry.make)(LANES, options).expect("options that are right");
        let mut out = Buffers::of(&*env);
        let seeds: Vec<u64> = (0..LANES as u64).collect();
        env.reset(Which::All, Some(&seeds), &Options::new(), &mut out.observations).expect("nominal options");
        // Which way each lane is pushed is no pattern that a processor could foretell.
        let left: Vec<i64> = seeds.iter().map(|k| ((k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) & 1) as i64).collect();
        let right = left.iter().map(|way| *way as f32 * 2.0 - 1.0).collect();
        Self { env, out, over: vec![false; LANES], left, right }
    }

    fn step(&mut self) {
        self.left.rotate_left(1);
        self.right.rotate_left(1);
        let actions = match self.env.about().action {
            Space::Box(_) => Actions::Continuous(&self.right),
            _ => Actions::Discrete(&self.left),
        };
        self.env.step(actions, &mut self.out.out()).expect("a step");
        let ends = self.out.terminated.iter().zip(&self.out.truncated);
        self.over.iter_mut().zip(ends).for_each(|(over, (terminated, truncated))| *over = *terminated | *truncated);
        if self.over.contains(&true) {
            let which = Which::Mask(&self.over);
            self.env.reset(which, None, &Options::new(), &mut self.out.observations).expect("nominal options");
        }
    }
}

fn steps(criterion: &mut Criterion) {
    let twin = |text: String| Options::new().with("twin", text);
    let rows = [
        ("cart_pole", "trueup/CartPole-v0", Options::new()),
        ("cart_pole_delay_noise_randomized", "trueup/CartPole-v0", twin(format!("{WIRED}{GRAVITY}"))),
        ("cart_pole_by_laws", "trueup/CartPole-v0", twin(format!("{FRICTION}{WIRED}{GRAVITY}"))),
        ("pendulum", "trueup/Pendulum-v0", Options::new()),
        ("pendulum_by_laws", "trueup/Pendulum-v0", twin(format!("{FRICTION}{WIRED}{GRAVITY}"))),
        ("servo_bare", "trueup/Servo-v0", Options::new().with("mechanisms", false)),
        ("servo", "trueup/Servo-v0", Options::new()),
    ];
    let mut group = criterion.benchmark_group("step_of_4096_lanes");
    group.throughput(Throughput::Elements(LANES as u64)).sample_size(20);
    for (name, id, options) in &rows {
        let mut play = Play::new(id, options);
        group.bench_function(*name, |bencher| {
            bencher.iter(|| {
                play.step();
                black_box(play.out.rewards[0])
            });
        });
    }
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
