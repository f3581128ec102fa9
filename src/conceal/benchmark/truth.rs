//! What registries call the numbers of an effect, and when it acted: the one place to adapt where they change names.

use std::collections::BTreeMap;

use super::effect::Effect;
use super::label::Span;
use super::motion::{Drive, Machine, Motion};
use super::scene::Scales;
use super::sensor::{Sensor, merged};

/// True values by the names that a registry's parameters have; where the forms differ too much to compare, none.
pub(super) fn parameters(id: &str, effect: &Effect, scales: &Scales) -> BTreeMap<String, f64> {
    let named: &[(&str, f64)] = match (id, *effect) {
        ("coulomb_friction", Effect::Bristles { sliding, .. }) => &[("torque", sliding)],
        ("stribeck_friction", Effect::Bristles { sliding, breakaway, .. }) => {
            &[("torque", sliding), ("breakaway", breakaway)]
        }
        ("load_friction", Effect::Bristles { load, .. }) => &[("coefficient", load)],
        // The square law that takes as much at the usual speed.
        (_, Effect::Drag { coefficient }) => &[("coefficient", coefficient * scales.speed.powf(-0.1))],
        (_, Effect::Pull { torque, .. }) => &[("torque", torque)],
        // The straight spring that pulls as much at the usual excursion, 3/4 of its square counting (Krylov & Bogolyubov).
        (_, Effect::Spring { rate, reach }) => &[("rate", rate * (1.0 + 0.15 * (scales.reach / reach).powi(2)))],
        (_, Effect::StiffeningSpring { rate, reach }) => &[("rate", rate * (1.0 + 0.33 * (scales.reach / reach).powi(2)))],
        (_, Effect::Magnets { torque, .. }) => &[("torque", torque)],
        (_, Effect::Load { time, inertia, .. }) => &[("time", time), ("inertia", inertia)],
        (_, Effect::Pad { position, .. }) => &[("position", position)],
        ("compliance", Effect::Coupling { stiffness, .. }) => &[("stiffness", stiffness)],
        ("backlash", Effect::Coupling { gap, .. }) => &[("gap", gap)],
        (_, Effect::Yielding { torque, .. }) => &[("torque", torque)],
        (_, Effect::Poles { first, second }) => &[("time_constant", first + second)],
        (_, Effect::Band { width }) => &[("width", width)],
        (_, Effect::Ceiling { limit }) => &[("limit", limit)],
        (_, Effect::Slew { rate }) => &[("rate", rate)],
        (_, Effect::Bus { delay, .. }) => &[("seconds", delay)],
        (_, Effect::Late { delay }) => &[("seconds", delay)],
        (_, Effect::Offset { offset }) => &[("offset", offset)],
        (_, Effect::Counts { step }) => &[("step", step)],
        (_, Effect::Fold { share, .. }) => &[("fraction", share)],
        (_, Effect::Wobble { size, .. }) => &[("amplitude", size)],
        (_, Effect::Stretch { excess, .. }) => &[("factor", 1.0 + excess)],
        _ => &[],
    };
    named.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
}

/// When it began [s], where not from the start.
pub(super) fn onset(effect: &Effect) -> Option<f64> {
    match effect {
        Effect::Load { time, .. } => Some(*time),
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
