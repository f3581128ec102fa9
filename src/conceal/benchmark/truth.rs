//! What registries call the numbers of an effect, and when it acted: the one place to adapt where they change names.
//!
//! Where a registry's form has another number for the same thing, the true one is that with which it comes closest to the
//! effect over the motion recorded (White, "Maximum likelihood estimation of misspecified models", Econometrica 50 (1982)).

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::effect::Effect;
use super::load::PUT_ON;
use super::motion::{Drive, Machine, Motion};
use super::scene::Scales;
use super::sensor::{Sensor, merged};
use crate::conceal::Span;

/// What an effect met: commands, positions and velocities, row by row.
pub(super) struct Met {
    commands: Vec<f64>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
}

impl Met {
    /// In a recording.
    pub fn of(drive: &Drive, motion: &Motion) -> Self {
        let rows = drive.commands.len();
        let positions: Vec<f64> = (0..rows).map(|row| motion.at(drive.time(row))).collect();
        let speed = |row: usize| (motion.at(drive.time(row) + 1e-3) - motion.at(drive.time(row) - 1e-3)) / 2e-3;
        Self { commands: drive.commands.clone(), velocities: (0..rows).map(speed).collect(), positions }
    }
}

/// True values by the names that a registry's parameters have; where forms differ too much to compare, none.
pub(super) fn parameters(id: &str, effect: &Effect, scales: &Scales, met: &Met) -> BTreeMap<String, f64> {
    let named: Vec<(&str, f64)> = match (id, *effect) {
        ("load_friction", Effect::Bristles { load, .. }) => vec![("load", load)],
        (_, Effect::Bristles { sliding, breakaway, .. }) if breakaway > sliding => {
            vec![("torque", sliding), ("excess", breakaway - sliding)]
        }
        (_, Effect::Bristles { sliding, .. }) => {
            ["torque", "creeping_torque", "smooth_torque"].map(|name| (name, sliding)).to_vec()
        }
        (_, Effect::Drag { coefficient }) => {
            // Beside it, viscous friction is fitted.
            let drag = |v: f64| coefficient * v.abs().powf(1.9).copysign(v);
            let square = closest(&met.velocities, drag, &[&|v| v * v.abs(), &|v| v]);
            vec![("coefficient", square[0]), ("unit_torque", coefficient), ("power", 1.9)]
        }
        (_, Effect::Pull { torque, .. }) => vec![("torque", torque)],
        (_, Effect::Spring { rate, reach }) => {
            let third = 0.1 * rate / (reach * reach);
            let straight = sprung(|q| rate * q + third * q.powi(3), |q| q, scales, met);
            vec![("rate", straight), ("bent_rate", rate), ("third_rate", third)]
        }
        (_, Effect::StiffeningSpring { rate, reach }) => {
            let torque = |q: f64| rate * q.powi(3) * (1.0 + 0.2 * (q / reach).powi(2));
            let cube = sprung(torque, |q| q.powi(3), scales, met);
            vec![("rate", cube), ("bent_rate", rate), ("fifth_rate", 0.2 * rate / (reach * reach))]
        }
        (_, Effect::Magnets { torque, count, phase, .. }) => {
            let number = if scales.arm.linear { "wave_number" } else { "counts" };
            vec![("sine", -torque * phase.cos()), ("cosine", -torque * phase.sin()), (number, count)]
        }
        (_, Effect::Load { time, inertia, gravity }) => {
            let mut values = vec![("time", time + 0.5 * PUT_ON), ("inertia_fraction", inertia / scales.arm.inertia)];
            if scales.arm.gravity_torque > 0.0 {
                values.push(("gravity_fraction", gravity / scales.arm.gravity_torque));
            } else {
                values.push(("fraction", inertia / scales.arm.inertia));
            }
            values
        }
        (_, Effect::Pad { position, side, .. }) => vec![(if side > 0.0 { "upper" } else { "lower" }, position)],
        ("compliance", Effect::Coupling { stiffness, motor_share, .. }) => {
            vec![("compliance", 1.0 / stiffness), ("motor_share", motor_share)]
        }
        (_, Effect::Coupling { gap, motor_share, .. }) => vec![("gap", gap), ("motor_share", motor_share)],
        // The last of its elements hardly yields: what the torque would come to is never seen.
        (_, Effect::Yielding { .. }) => Vec::new(),
        (_, Effect::Poles { first, second }) => vec![("time_constant", first + second), ("total_time", first + second)],
        (_, Effect::Band { width }) => {
            let given = |u: f64| u - width * (u / width).tanh();
            let soft = |u: f64, w: f64| u - u / (u / w).hypot(1.0);
            let hard = |u: f64, w: f64| u.signum() * (u.abs() - w).max(0.0);
            vec![("width", nearest(met, given, hard, width)), ("soft_width", nearest(met, given, soft, width))]
        }
        (_, Effect::Ceiling { limit }) => {
            let given = |u: f64| limit * (u / limit).tanh();
            let soft = |u: f64, l: f64| u / (u / l).hypot(1.0);
            let hard = |u: f64, l: f64| u.clamp(-l, l);
            vec![("limit", nearest(met, given, hard, limit)), ("soft_limit", nearest(met, given, soft, limit))]
        }
        (_, Effect::Slew { rate }) => vec![("rate", rate)],
        (_, Effect::Bus { delay, .. }) => vec![("seconds", delay)],
        // Where nothing pulls an arm to a place, nobody knows at what angle its sensor sits.
        (_, Effect::Wobble { .. }) if scales.arm.adds_up() => Vec::new(),
        _ => of_sensor(effect),
    };
    finite(named)
}

/// The same in forms that have fewer of these names.
pub(super) fn simpler(effect: &Effect, scales: &Scales, met: &Met) -> Vec<BTreeMap<String, f64>> {
    match *effect {
        Effect::Wobble { size, phase, harmonic } if !scales.arm.adds_up() => {
            // One wave a turn takes on what it can of the second.
            let error = |q: f64| size * ((q + phase).sin() + harmonic * (2.0 * q).sin());
            let wave = closest(&met.positions, error, &[&f64::sin, &f64::cos]);
            vec![finite(["sine", "cosine"].into_iter().zip(wave).collect())]
        }
        _ => Vec::new(),
    }
}

fn finite(named: Vec<(&str, f64)>) -> BTreeMap<String, f64> {
    named.into_iter().filter(|(_, value)| value.is_finite()).map(|(name, value)| (name.to_owned(), value)).collect()
}

fn of_sensor(effect: &Effect) -> Vec<(&'static str, f64)> {
    match *effect {
        Effect::Late { delay } => vec![("seconds", delay)],
        Effect::Offset { offset } => vec![("offset", offset)],
        Effect::Creep { size, settling: Some(settling) } => vec![("offset", size), ("time_constant", settling)],
        Effect::Counts { step } => vec![("step", step)],
        Effect::Fold { share, .. } => vec![("fraction", share)],
        Effect::Wobble { size, phase, harmonic } => {
            vec![("sine", size * phase.cos()), ("cosine", size * phase.sin()), ("second_sine", size * harmonic)]
        }
        Effect::Stretch { excess, .. } => vec![("error", excess)],
        _ => Vec::new(),
    }
}

/// The factors with which `forms` together come closest to `given` over the points met; not a number where there are none.
fn closest(points: &[f64], given: impl Fn(f64) -> f64, forms: &[&dyn Fn(f64) -> f64]) -> Vec<f64> {
    let design = DMatrix::from_fn(points.len(), forms.len(), |row, k| forms[k](points[row]));
    let target = DVector::from_iterator(points.len(), points.iter().map(|point| given(*point)));
    let inverse = design.tr_mul(&design).try_inverse();
    inverse.map_or(vec![f64::NAN; forms.len()], |inverse| (inverse * design.tr_mul(&target)).as_slice().to_vec())
}

/// The rate of a spring of one power that comes closest; gravity is fitted beside it, where there is any.
fn sprung(given: impl Fn(f64) -> f64, power: impl Fn(f64) -> f64, scales: &Scales, met: &Met) -> f64 {
    let weight = |q: f64| q.sin();
    let forms: [&dyn Fn(f64) -> f64; 2] = [&power, &weight];
    // However little it swings: a spring that is told from gravity at all leaves it free to take on most of what bends.
    let weighed = scales.arm.gravity_torque > 0.0;
    closest(&met.positions, given, &forms[..if weighed { 2 } else { 1 }])[0]
}

/// The number with which `form` comes closest to `given` over the commands met, looked for about a first guess.
fn nearest(met: &Met, given: impl Fn(f64) -> f64, form: impl Fn(f64, f64) -> f64, about: f64) -> f64 {
    let error = |number: f64| met.commands.iter().map(|u| (form(*u, number) - given(*u)).powi(2)).sum::<f64>();
    // Golden section, in the logarithm.
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = ((0.3 * about).ln(), (3.0 * about).ln());
    for _ in 0..40 {
        let (left, right) = (high - golden * (high - low), low + golden * (high - low));
        if error(left.exp()) < error(right.exp()) { high = right } else { low = left }
    }
    (0.5 * (low + high)).exp()
}

/// When it began [s], where not from the start: of what takes a while, the middle of that.
pub(super) fn onset(effect: &Effect) -> Option<f64> {
    match effect {
        Effect::Load { time, .. } => Some(*time + 0.5 * PUT_ON),
        _ => None,
    }
}

/// Moments closer together than this are one stretch [s].
const GAP: f64 = 0.05;

/// When it acted, where it acts at times only.
pub(super) fn active(effect: &Effect, machine: &Machine, sensor: &Sensor, drive: &Drive, motion: &Motion) -> Vec<Span> {
    let end = drive.time(drive.commands.len().saturating_sub(1));
    let stretches = |acts: &dyn Fn(usize) -> bool| {
        let moments = (0..drive.commands.len()).filter(|row| acts(*row));
        merged(moments.map(|row| Span { start: drive.time(row), end: drive.time(row + 1) }).collect(), GAP)
    };
    match effect {
        Effect::Load { time, .. } if *time < end => vec![Span { start: *time, end }],
        Effect::Pad { .. } => {
            stretches(&|row| machine.load().pad.is_some_and(|pad| pad.touches(motion.at(drive.time(row)))))
        }
        Effect::Ceiling { .. } if machine.driver().has_ceiling() => {
            stretches(&|row| machine.driver().bends(drive.commands[row]))
        }
        Effect::Bursts { .. } => sensor.bursts(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swinging(amplitude: f64) -> Vec<f64> {
        (0..500).map(|k| amplitude * (0.1 * f64::from(k)).sin()).collect()
    }

    /// `q^3` is about `6 (q - sin q)`, and `sin 2 q` about `2 sin q`.
    #[test]
    fn a_form_takes_on_what_it_can_of_what_it_lacks() {
        let points = swinging(0.1);
        let factors = closest(&points, |q| q.powi(3), &[&|q| q, &f64::sin]);
        assert!((factors[0] - 6.0).abs() < 0.02 && (factors[1] + 6.0).abs() < 0.02, "{factors:?}");
        let alone = closest(&points, |q| q.powi(3), &[&|q| q]);
        assert!((alone[0] - 0.0075).abs() < 1e-4, "{alone:?}");
        let wave = closest(&points, |q| (2.0 * q).sin(), &[&f64::sin, &f64::cos]);
        assert!((wave[0] - 2.0).abs() < 0.02 && wave[1].abs() < 1e-3, "{wave:?}");
        assert!(closest(&[0.0; 9], f64::sin, &[&f64::sin])[0].is_nan());
    }
}
