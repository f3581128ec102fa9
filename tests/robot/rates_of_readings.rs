//! A drive that tells its speed from its encoder tells it with the encoder's faults, and late; a tachometer beside the encoder does
//! neither.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::arm_scene::{ARM, SPACING, twin};
use trueup::robot::{Commands, Joint};
use trueup::sim2real::diagnose::{Outcome, Verdict, diagnose};
use trueup::sim2real::{Assembly, Recording, Seed};

/// What an encoder reads at an angle, and by how much its readings change with that.
type Encoder = fn(f64) -> [f64; 2];

fn too_long(y: f64) -> [f64; 2] {
    [1.01 * y, 1.01]
}

fn off_its_axis(y: f64) -> [f64; 2] {
    let y_and_phase: f64 = y + 0.6;
    [y + 0.01 * y_and_phase.sin(), 1.0 + 0.01 * y_and_phase.cos()]
}

fn true_to_it(y: f64) -> [f64; 2] {
    [y, 1.0]
}

/// Where a speed comes from.
#[derive(Clone, Copy, PartialEq)]
enum Speed {
    Tachometer,
    /// The rate of what the encoder reads.
    Readings,
    /// Differences of what the encoder reads, through a filter of that time constant [s].
    Filtered(f64),
}

/// An arm read by `encoder`, by the fourth-order method of Runge and Kutta, and its speed.
fn recorded(name: &str, encoder: Encoder, speed: Speed, salt: u64) -> Recording<Commands> {
    let (mut q, mut v, mut filtered, mut last) = (0.0_f64, 0.0_f64, 0.0, None);
    crate::arm_scene::recorded(name, salt, [("position", "rad"), ("velocity", "rad/s")], |command, chance| {
        let [read, slope] = encoder(q);
        let read = read + 8.7e-4 * chance.draw();
        let told = match speed {
            Speed::Tachometer => v + 1.7e-2 * chance.draw(),
            Speed::Readings => slope * v + 1.7e-2 * chance.draw(),
            Speed::Filtered(time) => {
                let difference = last.map_or(0.0, |last| (read - last) / SPACING);
                filtered += (1.0 - f64::exp(-SPACING / time)) * (difference - filtered);
                filtered
            }
        };
        last = Some(read);
        (q, v) = moved(q, v, command);
        [read, told]
    })
}

/// Angle and speed a row later.
fn moved(mut q: f64, mut v: f64, command: f64) -> (f64, f64) {
    let [inertia, viscous, gravity] = ARM;
    let slope = |q: f64, v: f64| [v, (command - viscous * v - gravity * q.sin()) / inertia];
    let h = 0.25 * SPACING;
    for _ in 0..4 {
        let a = slope(q, v);
        let b = slope(q + 0.5 * h * a[0], v + 0.5 * h * a[1]);
        let c = slope(q + 0.5 * h * b[0], v + 0.5 * h * b[1]);
        let d = slope(q + h * c[0], v + h * c[1]);
        q += h / 6.0 * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0]);
        v += h / 6.0 * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1]);
    }
    (q, v)
}

fn diagnosed(encoder: Encoder, speed: Speed) -> Outcome<Assembly<Joint>> {
    let [train, test] = [("train", 1), ("test", 2)].map(|(name, salt)| recorded(name, encoder, speed, salt));
    diagnose(&twin(), &[train], &[test], Seed(0), &|_, _, _| {})
}

/// The values of the only effect named, which is `mechanism`.
fn named(outcome: &Outcome<Assembly<Joint>>, mechanism: &str) -> Vec<(String, f64)> {
    let found = &outcome.diagnosis;
    assert_eq!(found.verdict, Verdict::Named, "{}", found.summary);
    assert_eq!(found.effects.len(), 1, "{}", found.summary);
    assert_eq!(found.effects[0].mechanism, mechanism, "{}", found.summary);
    found.effects[0].parameters.iter().map(|(name, value)| (name.clone(), value.value)).collect()
}

#[test]
fn a_speed_from_an_encoder_that_counts_too_much_is_too_high() {
    let values = named(&diagnosed(too_long, Speed::Readings), "scale");
    assert!(
        matches!(&values[..], [(name, error)] if name == "error_with_rate" && (error - 0.01).abs() < 5e-4),
        "{values:?}"
    );
}

#[test]
fn a_speed_from_an_eccentric_encoder_swings() {
    let values = named(&diagnosed(off_its_axis, Speed::Readings), "eccentricity");
    let off = [("cosine_with_rate", 0.6_f64.sin()), ("sine_with_rate", 0.6_f64.cos())];
    for ((name, value), (own, part)) in values.iter().zip(off) {
        assert!(name == own && (value - 0.01 * part).abs() < 5e-4, "{values:?}");
    }
}

#[test]
fn a_tachometer_beside_it_is_right() {
    for (encoder, mechanism) in [(too_long as Encoder, "scale"), (off_its_axis, "eccentricity")] {
        let values = named(&diagnosed(encoder, Speed::Tachometer), mechanism);
        assert!(values.iter().all(|(name, _)| !name.ends_with("_with_rate")), "{values:?}");
    }
}

#[test]
fn a_filtered_speed_is_late() {
    let values = named(&diagnosed(true_to_it, Speed::Filtered(0.01)), "velocity_filter");
    // A difference is late by half of what rows are apart; this filter holds what it is given until the next row, and is early by as much.
    assert!(matches!(&values[..], [(name, time)] if name == "time_constant" && (time - 0.01).abs() < 5e-4), "{values:?}");
}
