//! Recordings as engines of rigid bodies make them: semi-implicit steps of 2 ms, which show positions by half a step ahead of what
//! moves them.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::arm_scene::{ARM, SPACING, twin};
use trueup::robot::{Commands, Joint};
use trueup::sim2real::diagnose::{Outcome, Verdict, diagnose};
use trueup::sim2real::{Assembly, Recording, Seed, Simulator};

/// Step of the engine [s].
const STEP: f64 = 2e-3;

/// An arm by semi-implicit steps, with so much dry friction [N m]: velocities first, and positions by the new velocities.
fn recorded(name: &str, friction: f64, salt: u64) -> Recording<Commands> {
    let (mut q, mut v) = (0.0_f64, 0.0_f64);
    crate::arm_scene::recorded(name, salt, [("position", "rad")], |command, chance| {
        // A noise of 0.5 mrad.
        let read = q + 8.7e-4 * chance.draw();
        for _ in 0..(SPACING / STEP).round() as usize {
            let [inertia, viscous, gravity] = ARM;
            let free = (inertia * v + STEP * (command - gravity * q.sin())) / (inertia + STEP * viscous);
            let most = STEP * friction / (inertia + STEP * viscous);
            v = free - free.clamp(-most, most);
            q += STEP * v;
        }
        [read]
    })
}

fn diagnosed(friction: f64) -> Outcome<Assembly<Joint>> {
    let [train, test] = [("train", 1), ("test", 2)].map(|(name, salt)| recorded(name, friction, salt));
    diagnose(&twin(), &[train], &[test], Seed(0), &|_, _, _| {})
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
