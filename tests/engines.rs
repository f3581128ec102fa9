//! Recordings as engines of rigid bodies make them: semi-implicit steps of 2 ms, which show positions by half a step ahead of what
//! moves them.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::diagnose::{Outcome, Verdict, diagnose};
use trueup::sim2real::{Assembly, Measured, Recording, Seed, Simulator};

/// Inertia [kg m^2], viscous friction [N m s/rad] and torque of gravity [N m] of the arm.
const ARM: [f64; 3] = [0.096, 0.25, 2.35];
/// Step of the engine, and what rows are apart [s].
const STEP: f64 = 2e-3;
const SPACING: f64 = 4e-3;

/// An arm by semi-implicit steps, with so much dry friction [N m]: velocities first, and positions by the new velocities.
fn recorded(name: &str, friction: f64, salt: u64) -> Recording<Commands> {
    let mut drawn = salt;
    let mut chance = move || {
        drawn = drawn.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        2.0 * ((drawn >> 11) as f64 / (1_u64 << 53) as f64) - 1.0
    };
    let waves: Vec<[f64; 3]> = (1..8).map(|k| [0.5, 0.3 * f64::from(k) + 0.1 * chance(), 3.0 * chance()]).collect();
    let (mut q, mut v, mut held) = (0.0_f64, 0.0_f64, 0.0);
    let (mut commands, mut samples) = (Vec::new(), Vec::new());
    let time: Vec<f64> = (0..3_000).map(|row| SPACING * f64::from(row)).collect();
    for (row, t) in time.iter().enumerate() {
        held = if row % 250 == 0 { chance() } else { held };
        let command = held + waves.iter().map(|[height, rate, phase]| height * (6.0 * rate * t + phase).sin()).sum::<f64>();
        commands.push(command);
        // A noise of 0.5 mrad.
        samples.push(Some(q + 8.7e-4 * chance()));
        for _ in 0..(SPACING / STEP).round() as usize {
            let [inertia, viscous, gravity] = ARM;
            let free = (inertia * v + STEP * (command - gravity * q.sin())) / (inertia + STEP * viscous);
            let most = STEP * friction / (inertia + STEP * viscous);
            v = free - free.clamp(-most, most);
            q += STEP * v;
        }
    }
    let measured = vec![Measured { channel: "position".into(), unit: "rad".into(), samples }];
    Recording { name: name.into(), time, stimulus: Commands(commands), measured }
}

fn diagnosed(friction: f64) -> Outcome<Assembly<Joint>> {
    let nominal = [0.11, 0.22, 2.6, 1.0];
    let twin = Assembly::new(Joint::new(Axis::Rotary, nominal, [0.2, 0.2, 0.2, 0.0]), MECHANISMS);
    let [train, test] = [("train", 1), ("test", 2)].map(|(name, salt)| recorded(name, friction, salt));
    diagnose(&twin, &[train], &[test], Seed(0), &|_, _, _| {})
}

/// The lead that a trued twin has, and what the notes say of it.
fn lead(outcome: &Outcome<Assembly<Joint>>) -> (f64, String) {
    let at = outcome.trued.parameters().iter().position(|p| p.name == "lead").unwrap();
    (outcome.values[at], outcome.diagnosis.checks.notes.join("\n"))
}

#[test]
fn half_a_step_of_an_engine_is_no_effect() {
    let outcome = diagnosed(0.0);
    assert_eq!(outcome.diagnosis.verdict, Verdict::NoMismatch, "{}", outcome.diagnosis.summary);
    let (lead, notes) = lead(&outcome);
    assert!((lead - 0.5 * STEP).abs() < 0.1e-3, "{lead}");
    assert!(notes.contains("a matter of the record, not of the joint"), "{notes}");
}

#[test]
fn what_an_engine_has_besides_is_named_alone() {
    let outcome = diagnosed(0.15);
    let found = &outcome.diagnosis;
    assert_eq!(found.verdict, Verdict::Named, "{}", found.summary);
    assert_eq!(found.effects.len(), 1, "{}", found.summary);
    assert_eq!(found.effects[0].mechanism, "coulomb_friction", "{}", found.summary);
    let (lead, _) = lead(&outcome);
    assert!((lead - 0.5 * STEP).abs() < 0.1e-3, "{lead}");
}
