//! Plants that take minutes: what is slow about them is not what is slow about a servo.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use trueup::robot::{Commands, TANKS_MECHANISMS, Tanks};
use trueup::sim2real::diagnose::{Verdict, diagnose};
use trueup::sim2real::{Assembly, Measured, Recording, Seed};

/// Outflow of the upper tank, inflow and outflow of the lower one [V^0.5/s], and gain of the pump [V/s per unit].
const TANKS: [f64; 4] = [0.08, 0.06, 0.06, 0.05];
/// What rows are apart [s].
const SPACING: f64 = 2.0;

/// Levels by Euler's method at 10 ms, with a pump that follows its command with so long a lag [s].
fn recorded(name: &str, lag: f64, salt: u64) -> Recording<Commands> {
    let rows = 1_200;
    let (mut upper, mut lower, mut pump) = (4.0_f64, 4.5_f64, None);
    let mut drawn = salt;
    let mut chance = move || {
        drawn = drawn.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (drawn >> 11) as f64 / (1_u64 << 53) as f64
    };
    let (mut command, mut commands, mut levels) = (3.0, Vec::new(), Vec::new());
    for row in 0..rows {
        if row % 30 == 0 {
            command = 1.5 + 3.0 * chance();
        }
        commands.push(command);
        levels.push(Some(lower + 0.02 * (chance() - 0.5)));
        for _ in 0..200 {
            let given: &mut f64 = pump.get_or_insert(command);
            *given += 0.01 / lag * (command - *given);
            let [out, into, away, gain] = TANKS;
            let (top, low) = (upper.max(0.0).sqrt(), lower.max(0.0).sqrt());
            upper += 0.01 * (gain * *given - out * top);
            lower += 0.01 * (into * top - away * low);
        }
    }
    Recording {
        name: name.into(),
        time: (0..rows).map(|row| SPACING * f64::from(row)).collect(),
        stimulus: Commands(commands),
        measured: vec![Measured { channel: "level".into(), unit: "V".into(), samples: levels }],
    }
}

#[test]
fn a_pump_that_lags_by_seconds_is_named() {
    let nominal = [0.09, 0.06, 0.055, 0.05];
    let twin = Assembly::new(Tanks::new("V", nominal, [0.3, 0.0, 0.3, 0.02], 0.25), TANKS_MECHANISMS);
    let [train, test] = [("train", 1), ("test", 2)].map(|(name, salt)| recorded(name, 15.0, salt));
    let found = diagnose(&twin, &[train], &[test], Seed(0), &|_, _, _| {}).diagnosis;
    assert_eq!(found.verdict, Verdict::Named, "{}", found.summary);
    assert_eq!(found.effects.len(), 1, "{}", found.summary);
    assert_eq!(found.effects[0].mechanism, "actuator_lag", "{}", found.summary);
    let time = &found.effects[0].parameters["time_constant"];
    assert!((time.value - 15.0).abs() < 4.0 * time.std && time.std < 1.0, "{time:?}");
}
