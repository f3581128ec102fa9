//! Recordings of a sensor that counts, in decimals that are not whole counts: what it repeats is not lost, and what is fitted to it is fitted
//! without its steps, which have no slope to follow.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::arm_scene::{ARM, SPACING, twin};
use trueup::robot::Commands;
use trueup::sim2real::diagnose::{Verdict, calibrate, diagnose};
use trueup::sim2real::{Recording, Seed};

/// A turn in 4096 counts [rad].
const STEP: f64 = std::f64::consts::TAU / 4096.0;

/// An arm by short steps of the midpoint rule, its angle counted and written down to six decimals. There is no noise beside the steps.
fn recorded(name: &str, salt: u64) -> Recording<Commands> {
    pulled(name, salt, 0.0, 0.0)
}

/// The same with a load that pulls one way [N m], and what is counted off by up to so many steps.
fn pulled(name: &str, salt: u64, load: f64, noise: f64) -> Recording<Commands> {
    let (mut q, mut v) = (0.0_f64, 0.0_f64);
    crate::arm_scene::recorded(name, salt, [("position", "rad")], |command, chance| {
        let off = if noise > 0.0 { noise * chance.draw() } else { 0.0 };
        let read = ((q / STEP + off).round() * STEP * 1e6).round() / 1e6;
        let [inertia, viscous, gravity] = ARM;
        let faster = |q: f64, v: f64| (command - load - viscous * v - gravity * q.sin()) / inertia;
        for _ in 0..40 {
            let h = SPACING / 40.0;
            let (middle, speed) = (q + 0.5 * h * v, v + 0.5 * h * faster(q, v));
            q += h * speed;
            v += h * faster(middle, speed);
        }
        [read]
    })
}

#[test]
fn counts_are_steps_and_their_twin_is_right_and_can_be_fitted_again() {
    let [train, test] = [("train", 1), ("test", 2)].map(|(name, salt)| [recorded(name, salt)]);
    let outcome = diagnose(&twin(), &train, &test, Seed(0), &|_, _, _| {});
    let found = &outcome.diagnosis;
    assert_eq!(found.verdict, Verdict::Named, "{}", found.summary);
    assert_eq!(found.effects.len(), 1, "{}", found.summary);
    assert_eq!(found.effects[0].mechanism, "quantization", "{}", found.summary);
    let step = found.effects[0].parameters["step"].value;
    assert!((step / STEP - 1.0).abs() < 1e-4, "{step}");
    // What is rounded as it is differs in the counts alone that are almost the next.
    let fit = &found.fit[0];
    assert!(fit.trued_rmse < 0.7 * fit.noise_floor && fit.trued_mae < 0.2 * fit.noise_floor, "{fit:?}");

    // The same twin as its file gives it, by a fifth off.
    let off: Vec<f64> = outcome.values.iter().enumerate().map(|(k, v)| if k < 3 { 1.2 * v } else { *v }).collect();
    let again = calibrate(&outcome.trued.with_values(&off), &train, &test, Seed(0), &|_, _, _| {});
    for (k, value) in again.values.iter().enumerate() {
        assert!((value / outcome.values[k] - 1.0).abs() < 1e-3, "{:?} against {:?}", again.values, outcome.values);
    }
    let fit = &again.fit[0];
    assert!(fit.recalibrated_rmse < 0.7 * fit.noise_floor, "{fit:?}");
}

/// Counts are seen whatever else there is; that the twin explains the rest is said only where it does.
#[test]
fn what_counts_do_not_explain_is_said() {
    let [train, test] = [("train", 1, 0.0), ("test", 2, 0.3)].map(|(name, salt, load)| [pulled(name, salt, load, 0.7)]);
    let outcome = diagnose(&twin(), &train, &test, Seed(0), &|_, _, _| {});
    let found = &outcome.diagnosis;
    let names: Vec<&str> = found.effects.iter().map(|effect| effect.mechanism.as_str()).collect();
    assert_eq!((found.verdict, names), (Verdict::Named, vec!["quantization"]), "{}", found.summary);
    assert!(found.summary.contains("explains what was fitted and not what was held out"), "{}", found.summary);
}
