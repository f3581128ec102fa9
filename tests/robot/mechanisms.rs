//! Every mechanism of motion against an integration of its own: classical Runge-Kutta in steps a tenth as long, or a hundredth,
//! with the law written down anew. The assembly, at 1 ms, is to follow it with the true parameters.
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::{Assembly, Recording, Seed, Simulator, Thetas, Typical};

const ROW: f64 = 4e-3;
const ROWS: usize = 2_500;
/// Inertia, viscous friction, gravity torque and gain of the arm.
const ARM: [f64; 4] = [0.11, 0.25, 2.7, 1.0];
const INERTIA: f64 = ARM[0];
const VISCOUS: f64 = ARM[1];
const GRAVITY: f64 = ARM[2];

/// Position, velocity, and two more numbers that a law may keep: those of a second mass, a level.
type State = [f64; 4];

/// What acts on the arm.
#[derive(Default)]
struct Forces {
    /// All but dry friction [N m].
    net: f64,
    inertia: f64,
    dry: f64,
    /// Rates of the two more numbers.
    more: [f64; 2],
}

/// A law: forces at a time [s], in a state, under a command [N m].
type Law = fn(f64, State, f64) -> Forces;

struct Case {
    mechanism: &'static str,
    form: &'static str,
    values: &'static [f64],
    law: Law,
    /// Largest difference of positions [rad].
    most: f64,
}

fn command(row: usize) -> f64 {
    let t = row as f64 * ROW;
    1.6 * (2.0 * t).sin() + 1.1 * (5.3 * t).sin() + 0.7 * (11.9 * t).sin()
}

/// The arm with `push` besides [N m].
fn plain(x: State, u: f64, push: f64) -> Forces {
    Forces { net: u - VISCOUS * x[1] - GRAVITY * x[0].sin() + push, inertia: INERTIA, ..Forces::default() }
}

/// The arm with `more` of its inertia, which changes by `slope` of it a radian.
fn shaped(x: State, u: f64, more: f64, slope: f64) -> Forces {
    Forces { inertia: INERTIA * (1.0 + more), ..plain(x, u, -0.5 * INERTIA * slope * x[1] * x[1]) }
}

/// The arm with dry friction of `dry` [N m].
fn rubbing(x: State, u: f64, dry: f64) -> Forces {
    Forces { dry, ..plain(x, u, 0.0) }
}

fn rates(t: f64, x: State, u: f64, law: Law) -> State {
    let forces = law(t, x, u);
    let way = if x[1] == 0.0 { forces.net } else { x[1] };
    let held = x[1] == 0.0 && forces.net.abs() <= forces.dry;
    let acceleration = if held { 0.0 } else { (forces.net - forces.dry * way.signum()) / forces.inertia };
    [x[1], acceleration, forces.more[0], forces.more[1]]
}

fn moved(x: State, h: f64, rate: State) -> State {
    [0, 1, 2, 3].map(|k| x[k] + h * rate[k])
}

/// Positions, row by row, in steps of `h` [s]. What dry friction stops within a step stops there.
fn reference(law: Law, h: f64) -> Vec<f64> {
    let mut x = [0.0; 4];
    let count = (ROW / h).round() as usize;
    let mut positions = Vec::with_capacity(ROWS);
    for row in 0..ROWS {
        positions.push(x[0]);
        let u = command(row);
        for sub in 0..count {
            let t = row as f64 * ROW + sub as f64 * h;
            let k1 = rates(t, x, u, law);
            let k2 = rates(t + 0.5 * h, moved(x, 0.5 * h, k1), u, law);
            let k3 = rates(t + 0.5 * h, moved(x, 0.5 * h, k2), u, law);
            let k4 = rates(t + h, moved(x, h, k3), u, law);
            let mean = [0, 1, 2, 3].map(|k| (k1[k] + 2.0 * k2[k] + 2.0 * k3[k] + k4[k]) / 6.0);
            let next = moved(x, h, mean);
            let turned = x[1] * next[1] < 0.0 && law(t, x, u).dry > 0.0;
            x = if turned { [next[0], 0.0, next[2], next[3]] } else { next };
        }
    }
    positions
}

/// Positions as the assembly has them, with the mechanism or with none.
fn assembly(case: &Case, present: bool) -> Vec<f64> {
    let own = [(case.mechanism, case.form, case.values)];
    together(if present { &own } else { &[] })
}

/// The same with several mechanisms, each in a form and with values of its parameters.
fn together(parts: &[(&str, &str, &[f64])]) -> Vec<f64> {
    let time: Vec<f64> = (0..ROWS).map(|row| row as f64 * ROW).collect();
    let stimulus = Commands((0..ROWS).map(command).collect());
    let recording = Recording { name: "trial".into(), stimulus, measured: vec![], time };
    let mut assembly = Assembly::new(Joint::new(Axis::Rotary, ARM, [0.0; 4]), MECHANISMS);
    for (name, form, _) in parts {
        let mechanism = MECHANISMS.iter().find(|m| m.about().name == *name).unwrap();
        let forms = mechanism.forms(&Typical::default());
        let number = forms.iter().position(|own| own.name == *form).unwrap();
        assembly = assembly.with_mechanism(*mechanism, number, forms[number].parameters.clone());
    }
    let values = parts.iter().flat_map(|(.., values)| values.iter());
    let theta: Vec<f64> = ARM.iter().chain(values).chain(&[0.0, 0.0]).copied().collect();
    assembly.rollout(&Thetas::single(&theta), &recording, 0..ROWS, Seed(0))[0][0].samples.clone()
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Effort that holds two masses together, `depth` [rad] inside each other: a spring and a damper that never pull.
fn pushed(depth: f64, rate: f64, stiffness: f64, damping: f64) -> f64 {
    if depth > 0.0 { (stiffness * depth + damping * rate).max(0.0) } else { 0.0 }
}

/// Motor `x[2], x[3]` with `share` of the inertia and friction `dry`, its torque on the link as `transmitted` has it.
fn motor_and_link(x: State, u: f64, share: f64, dry: f64, transmitted: f64) -> Forces {
    let net = u - VISCOUS * x[3] - transmitted;
    // Steep enough to hold, flat enough for the step.
    let rubs = dry * (x[3] / 1e-3).clamp(-1.0, 1.0);
    Forces {
        net: transmitted - GRAVITY * x[0].sin(),
        inertia: (1.0 - share) * INERTIA,
        dry: 0.0,
        more: [x[3], (net - rubs) / (share * INERTIA)],
    }
}

/// A motor with friction `dry` on a shaft of 40 N m/rad.
fn shaft(x: State, u: f64, dry: f64) -> Forces {
    let damping = 0.1 * (40.0 * 0.24 * INERTIA).sqrt();
    motor_and_link(x, u, 0.6, dry, 40.0 * (x[2] - x[0]) + damping * (x[3] - x[1]))
}

/// What the gap's touch transmits from motor to link.
fn touch(x: State, gap: f64, share: f64) -> f64 {
    let reduced = share * (1.0 - share) * INERTIA;
    let (stiffness, damping) = (1e6 * reduced, 2e3 * reduced);
    let (apart, rate) = (x[2] - x[0], x[3] - x[1]);
    pushed(apart - 0.5 * gap, rate, stiffness, damping) - pushed(-apart - 0.5 * gap, -rate, stiffness, damping)
}

fn stribeck(x: State, u: f64, fading: f64) -> Forces {
    rubbing(x, u, 0.15 + 0.1 * fading)
}

/// A shaft of 20 N m/rad that is twice as stiff at 0.03 rad.
fn hardening(twist: f64, rate: f64) -> f64 {
    20.0 * twist * (1.0 + (twist / 0.03).powi(2)) + 0.1 * (20.0 * 0.24 * INERTIA).sqrt() * rate
}

fn bouc_wen(x: State, u: f64, torque: f64, angle: f64, [n, sigma]: [f64; 2]) -> Forces {
    let (w, v) = (x[2], x[1]);
    let power = w.abs().powf(n);
    let rate = (v - sigma * v.abs() * power * w.signum() + (sigma - 1.0) * v * power) / angle;
    Forces { more: [rate, 0.0], ..plain(x, u, -torque * w) }
}

/// Two soft loops side by side.
fn two_loops(x: State, u: f64, [torque, angle]: [f64; 2], [early_torque, early_yield]: [f64; 2]) -> Forces {
    let rate = |w: f64, angle: f64| (x[1] - 0.5 * x[1].abs() * w - 0.5 * x[1] * w.abs()) / angle;
    let more = [rate(x[2], angle), rate(x[3], early_yield)];
    Forces { more, ..plain(x, u, -torque * x[2] - early_torque * x[3]) }
}

fn gears(x: State) -> f64 {
    -GRAVITY * x[0].sin()
}

const CASES: &[Case] = &[
    Case { mechanism: "coulomb_friction", form: "dry", values: &[0.2], law: |_, x, u| rubbing(x, u, 0.2), most: 1e-4 },
    Case {
        mechanism: "coulomb_friction",
        form: "creeping",
        values: &[0.2],
        law: |_, x, u| {
            let net = plain(x, u, 0.0).net;
            plain(x, u, -(0.9 * (INERTIA * 105.0 * x[1] + net)).clamp(-0.2, 0.2))
        },
        most: 1e-4,
    },
    Case {
        mechanism: "coulomb_friction",
        form: "smooth",
        values: &[0.2, 0.1],
        law: |_, x, u| plain(x, u, -0.2 * (x[1] / 0.1).tanh()),
        most: 1e-4,
    },
    Case {
        mechanism: "stribeck_friction",
        form: "gaussian",
        values: &[0.15, 0.1, 0.2],
        law: |_, x, u| stribeck(x, u, (-(x[1] / 0.2).powi(2)).exp()),
        most: 1e-4,
    },
    Case {
        mechanism: "stribeck_friction",
        form: "tustin",
        values: &[0.15, 0.1, 0.2],
        law: |_, x, u| stribeck(x, u, (-(x[1] / 0.2).abs()).exp()),
        most: 1e-4,
    },
    Case {
        mechanism: "load_friction",
        form: "even",
        values: &[0.05, 0.1],
        law: |_, x, u| rubbing(x, u, 0.05 + 0.1 * (u - gears(x)).abs()),
        most: 1e-4,
    },
    Case {
        mechanism: "load_friction",
        form: "stribeck",
        values: &[0.05, 0.1, 0.05, 0.05, 0.2],
        law: |_, x, u| {
            let load = (u - gears(x)).abs();
            rubbing(x, u, 0.05 + 0.1 * load + (-(x[1] / 0.2).powi(2)).exp() * (0.05 + 0.05 * load))
        },
        most: 1e-4,
    },
    Case {
        mechanism: "load_friction",
        form: "directional",
        values: &[0.05, 0.1, 0.2],
        law: |_, x, u| rubbing(x, u, 0.05 + (0.1 * u - 0.2 * gears(x)).abs()),
        most: 1e-4,
    },
    Case {
        mechanism: "quadratic_drag",
        form: "square",
        values: &[0.08],
        law: |_, x, u| plain(x, u, -0.08 * x[1].abs() * x[1]),
        most: 2e-5,
    },
    Case {
        mechanism: "quadratic_drag",
        form: "power",
        values: &[0.08, 2.6],
        law: |_, x, u| plain(x, u, -0.08 * x[1].abs().powf(1.6) * x[1]),
        most: 2e-5,
    },
    Case {
        mechanism: "velocity_curve",
        form: "",
        values: &[-0.4, -0.05, 0.1, 0.2, 3.0],
        law: |_, x, u| {
            let [v, steep, flat] = [x[1], (0.4 - 0.05) / 2.0, (0.2 - 0.1) / 2.0];
            let below = if v < -1.0 { -0.05 + steep * (v + 1.0) } else { 0.05 * v };
            plain(x, u, -if v < 0.0 { below } else { 0.1 * v.min(1.0) + flat * (v - 1.0).max(0.0) })
        },
        most: 1e-4,
    },
    Case {
        mechanism: "inertia_curve",
        form: "turn",
        values: &[0.2, -0.1, 0.05, 0.15],
        law: |_, x, u| {
            let (s, c, s2, c2) = (x[0].sin(), x[0].cos(), (2.0 * x[0]).sin(), (2.0 * x[0]).cos());
            let more = 0.2 * s - 0.1 * c + 0.05 * s2 + 0.15 * c2;
            let slope = 0.2 * c + 0.1 * s + 2.0 * (0.05 * c2 - 0.15 * s2);
            shaped(x, u, more, slope)
        },
        most: 2e-5,
    },
    Case {
        mechanism: "inertia_curve",
        form: "along",
        values: &[0.1, -0.04],
        law: |_, x, u| shaped(x, u, x[0] * (0.1 - 0.04 * x[0]), 0.1 - 0.08 * x[0]),
        most: 2e-5,
    },
    Case { mechanism: "stiffness", form: "straight", values: &[1.5], law: |_, x, u| plain(x, u, -1.5 * x[0]), most: 2e-5 },
    Case {
        mechanism: "stiffness",
        form: "bent",
        values: &[1.5, -0.3],
        law: |_, x, u| plain(x, u, -1.5 * x[0] + 0.3 * x[0].powi(3)),
        most: 2e-5,
    },
    Case {
        mechanism: "cubic_stiffness",
        form: "cube",
        values: &[4.0],
        law: |_, x, u| plain(x, u, -4.0 * x[0].powi(3)),
        most: 2e-5,
    },
    Case {
        mechanism: "cubic_stiffness",
        form: "bent",
        values: &[4.0, -1.5],
        law: |_, x, u| plain(x, u, -4.0 * x[0].powi(3) + 1.5 * x[0].powi(5)),
        most: 2e-5,
    },
    Case {
        mechanism: "cogging",
        form: "per_turn",
        values: &[0.1, -0.07, 24.0],
        law: |_, x, u| plain(x, u, 0.1 * (24.0 * x[0]).sin() - 0.07 * (24.0 * x[0]).cos()),
        most: 1e-4,
    },
    Case {
        mechanism: "cogging",
        form: "per_turn_harmonics",
        values: &[0.1, -0.07, 12.0, 0.03, 0.02],
        law: |_, x, u| {
            let (wave, second) = (12.0 * x[0], 24.0 * x[0]);
            plain(x, u, 0.1 * wave.sin() - 0.07 * wave.cos() + 0.03 * second.sin() + 0.02 * second.cos())
        },
        most: 1e-4,
    },
    Case {
        mechanism: "payload_change",
        form: "together",
        values: &[4.0, 0.3],
        law: |t, x, u| loaded(t, x, u, 4.0, 0.3, 0.3),
        most: 2e-5,
    },
    Case {
        mechanism: "payload_change",
        form: "apart",
        values: &[4.0, 0.3, -0.2],
        law: |t, x, u| loaded(t, x, u, 4.0, 0.3, -0.2),
        most: 1e-4,
    },
    Case {
        mechanism: "end_stop",
        form: "upper",
        values: &[0.5, 300.0, 0.2],
        law: |_, x, u| plain(x, u, -stop(x[0] - 0.5, x[1])),
        most: 1e-3,
    },
    Case {
        mechanism: "end_stop",
        form: "lower",
        values: &[-0.5, 300.0, 0.2],
        law: |_, x, u| plain(x, u, stop(-0.5 - x[0], -x[1])),
        most: 1e-3,
    },
    Case {
        mechanism: "end_stop",
        form: "both",
        values: &[-0.5, 0.6, 300.0, 0.2],
        law: |_, x, u| plain(x, u, stop(-0.5 - x[0], -x[1]) - stop(x[0] - 0.6, x[1])),
        most: 1e-3,
    },
    Case {
        mechanism: "end_stop",
        form: "upper_round",
        values: &[0.5, 1_000.0, 0.4],
        law: |_, x, u| plain(x, u, -round_stop(x[0] - 0.5, x[1])),
        most: 1e-3,
    },
    Case {
        mechanism: "end_stop",
        form: "lower_round",
        values: &[-0.5, 1_000.0, 0.4],
        law: |_, x, u| plain(x, u, round_stop(-0.5 - x[0], -x[1])),
        most: 1e-3,
    },
    Case {
        mechanism: "end_stop",
        form: "both_round",
        values: &[-0.5, 0.6, 1_000.0, 0.4],
        law: |_, x, u| plain(x, u, round_stop(-0.5 - x[0], -x[1]) - round_stop(x[0] - 0.6, x[1])),
        most: 1e-3,
    },
    Case {
        mechanism: "compliance",
        form: "on_link",
        values: &[1.0 / 40.0, 0.6, 0.05],
        law: |_, x, u| shaft(x, u, 0.0),
        most: 1e-4,
    },
    Case {
        mechanism: "compliance",
        form: "on_link_motor_friction",
        values: &[1.0 / 40.0, 0.6, 0.05],
        law: |_, x, u| shaft(x, u, 0.0),
        most: 1e-4,
    },
    Case {
        mechanism: "compliance",
        form: "on_motor",
        values: &[1.0 / 40.0, 0.4, 0.05],
        law: |_, x, u| {
            let damping = 0.1 * (40.0 * 0.24 * INERTIA).sqrt();
            let transmitted = 40.0 * (x[0] - x[2]) + damping * (x[1] - x[3]);
            Forces {
                net: u - VISCOUS * x[1] - transmitted,
                inertia: 0.6 * INERTIA,
                dry: 0.0,
                more: [x[3], (transmitted - GRAVITY * x[2].sin()) / (0.4 * INERTIA)],
            }
        },
        most: 1e-4,
    },
    Case {
        mechanism: "compliance",
        form: "on_link_hardening",
        values: &[1.0 / 20.0, 0.6, 0.05, 0.03],
        law: |_, x, u| motor_and_link(x, u, 0.6, 0.0, hardening(x[2] - x[0], x[3] - x[1])),
        most: 2e-4,
    },
    Case {
        mechanism: "compliance",
        form: "on_motor_hardening",
        values: &[1.0 / 20.0, 0.4, 0.05, 0.03],
        law: |_, x, u| {
            let transmitted = hardening(x[0] - x[2], x[1] - x[3]);
            Forces {
                net: u - VISCOUS * x[1] - transmitted,
                inertia: 0.6 * INERTIA,
                dry: 0.0,
                more: [x[3], (transmitted - GRAVITY * x[2].sin()) / (0.4 * INERTIA)],
            }
        },
        most: 2e-4,
    },
    Case {
        mechanism: "coulomb_friction",
        form: "presliding",
        values: &[0.2, 0.02],
        law: |_, x, u| bouc_wen(x, u, 0.2, 0.02, [1.0, 0.5]),
        most: 1e-4,
    },
    Case {
        mechanism: "stribeck_friction",
        form: "presliding",
        values: &[0.15, 0.1, 0.2, 0.02],
        law: |_, x, u| bouc_wen(x, u, 0.15 + 0.1 * (-(x[1] / 0.2).powi(2)).exp(), 0.02, [1.0, 0.5]),
        most: 2e-4,
    },
    Case {
        mechanism: "load_friction",
        form: "presliding",
        values: &[0.05, 0.1, 0.02],
        law: |_, x, u| bouc_wen(x, u, 0.05 + 0.1 * (u - gears(x)).abs(), 0.02, [1.0, 0.5]),
        most: 2e-4,
    },
    Case {
        mechanism: "hysteresis",
        form: "soft",
        values: &[0.3, 0.1],
        law: |_, x, u| bouc_wen(x, u, 0.3, 0.1, [1.0, 0.5]),
        most: 2e-5,
    },
    Case {
        mechanism: "hysteresis",
        form: "sharp",
        values: &[0.3, 0.1],
        law: |_, x, u| bouc_wen(x, u, 0.3, 0.1, [2.0, 0.5]),
        most: 2e-5,
    },
    Case {
        mechanism: "hysteresis",
        form: "bouc_wen",
        values: &[0.3, 0.1, 0.6, 1.3],
        law: |_, x, u| bouc_wen(x, u, 0.3, 0.1, [0.6, 1.3]),
        most: 2e-5,
    },
    Case {
        mechanism: "hysteresis",
        form: "two_loops",
        values: &[0.2, 0.2, 0.1, 0.15],
        law: |_, x, u| two_loops(x, u, [0.2, 0.2], [0.1, 0.03]),
        most: 5e-5,
    },
    Case {
        mechanism: "backlash",
        form: "gap",
        values: &[0.03, 0.4],
        law: |_, x, u| motor_and_link(x, u, 0.4, 0.0, touch(x, 0.03, 0.4)),
        most: 5e-4,
    },
    Case {
        mechanism: "backlash",
        form: "gap_friction",
        values: &[0.03, 0.4, 0.1],
        law: |_, x, u| motor_and_link(x, u, 0.4, 0.1, touch(x, 0.03, 0.4)),
        most: 5e-4,
    },
    Case {
        mechanism: "backlash",
        form: "gap_spring",
        values: &[0.03, 0.4, 60.0, 0.2],
        law: |_, x, u| {
            let damping = 0.4 * (60.0 * 0.24 * INERTIA).sqrt();
            let (apart, rate) = (x[2] - x[0], x[3] - x[1]);
            let pushes = |depth, rate| pushed(depth, rate, 60.0, damping);
            motor_and_link(x, u, 0.4, 0.0, pushes(apart - 0.015, rate) - pushes(-0.015 - apart, -rate))
        },
        most: 5e-4,
    },
];

fn loaded(t: f64, x: State, u: f64, time: f64, inertia: f64, gravity: f64) -> Forces {
    // A step of the reference ends where the load changes.
    let after = f64::from(u8::from(t >= time - 1e-9));
    let mut forces = plain(x, u, -after * gravity * GRAVITY * x[0].sin());
    forces.inertia *= 1.0 + after * inertia;
    forces
}

/// A stop of 300 N m/rad and a damping ratio of 0.2.
fn stop(depth: f64, rate: f64) -> f64 {
    pushed(depth, rate, 300.0, 0.4 * (300.0 * INERTIA).sqrt())
}

/// Effort of a stop on which more bears the deeper it is met.
fn round_stop(depth: f64, rate: f64) -> f64 {
    1_000.0 * depth.max(0.0).powf(1.5) * (1.0 + 0.4 * rate).max(0.0)
}

#[test]
fn every_mechanism_of_motion_follows_an_integration_of_its_own() {
    let mut report = String::new();
    let mut failed = false;
    for case in CASES {
        // Turns and touches end within a step: there the reference is of first order.
        let abrupt = ["backlash", "coulomb_friction", "load_friction", "stribeck_friction"].contains(&case.mechanism);
        let truth = reference(case.law, if abrupt { 1e-5 } else { 1e-4 });
        let swing = truth.iter().fold(0.0_f64, |most, q| most.max(q.abs()));
        let with = worst(&assembly(case, true), &truth);
        let without = worst(&assembly(case, false), &truth);
        let fine = with < case.most && without > 20.0 * case.most;
        failed |= !fine;
        report += &format!(
            "{:18} {:12} {with:.1e} rad of {swing:.2}, without it {without:.1e}{}\n",
            case.mechanism,
            case.form,
            if fine { "" } else { "  <-" }
        );
    }
    assert!(!failed, "\n{report}");
    println!("{report}");
}

/// Dry friction behind a shaft: that of the motor, at its speed, whichever of the two laws is named first. Friction of the link is another.
#[test]
fn dry_friction_may_be_that_of_the_motor_behind_a_shaft() {
    let friction: [(_, _, &[f64], Law); 2] = [
        ("coulomb_friction", "dry", &[0.3], |_, x, u| shaft(x, u, 0.3)),
        ("stribeck_friction", "gaussian", &[0.2, 0.3, 0.5], |_, x, u| {
            shaft(x, u, 0.2 + 0.3 * (-(x[3] / 0.5).powi(2)).exp())
        }),
    ];
    for (name, form, values, law) in friction {
        let truth = reference(law, 1e-5);
        let beside = |shaft| [(name, form, values), ("compliance", shaft, &[1.0 / 40.0, 0.6, 0.05][..])];
        let [friction, shaft] = beside("on_link_motor_friction");
        let off = worst(&together(&[friction, shaft]), &truth);
        assert!(off < 2e-3, "{name}: {off:.1e} rad");
        assert_eq!(together(&[friction, shaft]), together(&[shaft, friction]), "{name}: whichever is first");
        let of_the_link = worst(&together(&beside("on_link")), &truth);
        assert!(of_the_link > 20e-3, "{name}: {of_the_link:.1e} rad");
    }
}

/// Play acts on commands, so its reference does too: the arm of the reference under commands that were passed through play.
#[test]
fn play_follows_a_recording_of_commands_with_play() {
    const WIDTH: f64 = 0.5;
    let mut passed = 0.0_f64;
    let case = Case { mechanism: "backlash", form: "play", values: &[WIDTH], law: |_, x, u| plain(x, u, 0.0), most: 0.0 };
    let commands = (0..ROWS).map(|row| {
        passed = passed.clamp(command(row) - 0.5 * WIDTH, command(row) + 0.5 * WIDTH);
        passed
    });
    let recording = Recording {
        name: "passed".into(),
        stimulus: Commands(commands.collect()),
        measured: vec![],
        time: (0..ROWS).map(|row| row as f64 * ROW).collect(),
    };
    let bare = Assembly::new(Joint::new(Axis::Rotary, ARM, [0.0; 4]), MECHANISMS);
    let theta: Vec<f64> = ARM.iter().chain(&[0.0, 0.0]).copied().collect();
    let expected = bare.rollout(&Thetas::single(&theta), &recording, 0..ROWS, Seed(0))[0][0].samples.clone();
    assert!(worst(&assembly(&case, true), &expected) < 1e-12);
    assert!(worst(&assembly(&case, false), &expected) > 0.05);
}

/// Every form of every mechanism of motion is held to a reference here.
#[test]
fn no_form_is_left_out() {
    let elsewhere = ["constant_load"];
    for mechanism in MECHANISMS.iter().filter(|m| m.about().site == trueup::sim2real::Site::Plant) {
        for form in mechanism.forms(&Typical::default()) {
            let name = mechanism.about().name;
            let held = CASES.iter().any(|case| case.mechanism == name && case.form == form.name);
            // A wave number on a linear axis is the same law as counts a turn.
            assert!(held || elsewhere.contains(&name) || form.name.starts_with("per_length"), "{name} {}", form.name);
        }
    }
}
