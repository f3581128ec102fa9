//! Where: since when, at which times and in which states something is missing, and what to record where that cannot be told.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails where a value is missing")]

use trueup::conceal::servo::{Excitation, Servo, ServoEffect};
use trueup::conceal::{Column, Table};
use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::diagnose::{Effect, Outcome, Verdict, diagnose};
use trueup::sim2real::{Assembly, Measured, Recording, Seed, Simulator, Thetas, Twin};

const SPACING: f64 = 4e-3;
const NOISE: f64 = 1e-3;

/// About Gaussian noise of standard deviation 1, fixed.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum
    }
}

fn column(table: &Table, name: &str) -> Vec<f64> {
    match table.columns().iter().find(|(other, _)| other == name) {
        Some((_, Column::Real(values))) => values.clone(),
        other => panic!("no column of numbers {name}: {other:?}"),
    }
}

/// A recording of the generator.
fn generated(effects: &[ServoEffect], excitation: Excitation, seed: u64) -> Recording<Commands> {
    let table = Servo { rows: 3_000, ..Servo::default() }.with(effects).record(excitation, Seed(seed));
    recording(&format!("{excitation:?}"), column(&table, "t"), column(&table, "u"), column(&table, "q"))
}

fn recording(name: &str, time: Vec<f64>, commands: Vec<f64>, positions: Vec<f64>) -> Recording<Commands> {
    let samples = positions.into_iter().map(Some).collect();
    Recording {
        name: name.into(),
        time,
        stimulus: Commands(commands),
        measured: vec![Measured { channel: "position".into(), unit: "rad".into(), samples }],
    }
}

fn joint(values: [f64; 4]) -> Assembly<Joint> {
    Assembly::new(Joint::new(Axis::Rotary, values, [0.2, 0.2, 0.2, 0.0]), MECHANISMS)
}

fn twin() -> Assembly<Joint> {
    joint([0.11, 0.25, 2.7, 1.0])
}

/// What a joint shows that changes its parameters at the given times [s], each with the values it has from then on.
fn changing(changes: &[(f64, [f64; 4])], commands: impl Fn(f64) -> f64, rows: usize, seed: u64) -> Recording<Commands> {
    let time: Vec<f64> = (0..rows).map(|i| i as f64 * SPACING).collect();
    let sent: Vec<f64> = time.iter().map(|t| commands(*t)).collect();
    let blank = recording("made", time.clone(), sent.clone(), vec![0.0; rows]);
    let mut draws = Draws(seed);
    let (mut position, mut velocity) = (0.0, 0.0);
    let mut positions = Vec::new();
    for (k, (start, values)) in changes.iter().enumerate() {
        let end = changes.get(k + 1).map_or(rows, |(next, _)| (next / SPACING).round() as usize);
        let from = (start / SPACING).round() as usize;
        let lane: Vec<f64> = values.iter().copied().chain([position, velocity]).collect();
        let run = joint(*values).rollout(&Thetas::single(&lane), &blank, from..(end + 1).min(rows), Seed(0)).remove(0);
        positions.extend(run[0].samples[..end - from].iter().map(|q| q + NOISE * draws.next()));
        (position, velocity) = (*run[0].samples.last().unwrap(), *run[1].samples.last().unwrap());
    }
    recording("made", time, sent, positions)
}

fn lively(t: f64) -> f64 {
    1.2 * (1.9 * t).sin() + 0.8 * (5.3 * t + 0.5).sin() + 0.5 * (11.0 * t + 1.0).sin()
}

fn diagnosed(effect: ServoEffect, seed: u64) -> Outcome<Assembly<Joint>> {
    let fitted = [generated(&[effect], Excitation::SinesAndSteps, seed)];
    let held_out = [generated(&[effect], Excitation::ChirpAndSteps, seed + 1)];
    diagnose(&twin(), &fitted, &held_out, Seed(1), &|_, _, _| ())
}

fn only(outcome: &Outcome<Assembly<Joint>>) -> &Effect {
    let [effect] = outcome.diagnosis.effects.as_slice() else { panic!("{:#?}", outcome.diagnosis) };
    effect
}

#[test]
fn a_change_of_load_is_dated_before_it_is_named() {
    for date in [5.0, 9.6] {
        let loaded = [(0.0, [0.1, 0.23, 2.5, 1.0]), (date, [0.13, 0.23, 3.2, 1.0])];
        let outcome = diagnose(&twin(), &[changing(&loaded, lively, 4_500, 3)], &[], Seed(1), &|_, _, _| ());
        let onset = outcome.diagnosis.location.onset.unwrap();
        assert!((onset - date).abs() < 0.2, "{onset} s, not {date} s");
    }
    let never = changing(&[(0.0, [0.1, 0.23, 2.5, 1.0])], lively, 4_500, 4);
    let outcome = diagnose(&twin(), &[never], &[], Seed(1), &|_, _, _| ());
    assert_eq!(outcome.diagnosis.location.onset, None);
    assert!(outcome.diagnosis.location.intervals.is_empty(), "{:?}", outcome.diagnosis.location);
}

#[test]
fn a_saturation_acted_where_commands_were_large() {
    let outcome = diagnosed(ServoEffect::TYPICAL[2], 44);
    let effect = only(&outcome);
    let location = effect.location.as_deref().unwrap();
    assert!(location.starts_with("|command| > "), "{location}");
    let limit: f64 = location.trim_start_matches("|command| > ").parse().unwrap();
    // In the rows that are told, commands are large; in the others they are not.
    let recording = generated(&[ServoEffect::TYPICAL[2]], Excitation::SinesAndSteps, 44);
    let told = |t: f64| effect.active.iter().any(|s| (s.start..s.end).contains(&t));
    let rows = recording.time.iter().zip(&recording.stimulus.0);
    let (mut both, mut either) = (0, 0);
    for (t, u) in rows {
        both += usize::from(told(*t) && u.abs() > limit);
        either += usize::from(told(*t) || u.abs() > limit);
    }
    assert!(both as f64 > 0.85 * either as f64, "{both} of {either}: {effect:?}");
    assert!(effect.moved[0].rms > 0.03 && effect.moved[0].unit == "rad", "{:?}", effect.moved);
    assert_eq!(outcome.diagnosis.location.onset, None);
}

#[test]
fn a_load_acted_throughout() {
    let outcome = diagnosed(ServoEffect::TYPICAL[7], 54);
    let effect = only(&outcome);
    assert_eq!((effect.location.as_deref(), effect.active.len()), (Some("throughout"), 0));
}

#[test]
fn lost_samples_are_told_to_the_row() {
    let mut whole = generated(&[], Excitation::SinesAndSteps, 30);
    let lost = [(200, 212), (611, 640), (1_500, 1_509), (2_000, 2_031), (2_700, 2_712)];
    for (from, end) in lost {
        let last = whole.measured[0].samples[from - 1];
        whole.measured[0].samples[from..end].fill(last);
    }
    let held_out = [generated(&[], Excitation::ChirpAndSteps, 31)];
    let outcome = diagnose(&twin(), &[whole.clone()], &held_out, Seed(1), &|_, _, _| ());
    let effect = only(&outcome);
    assert_eq!(effect.mechanism, "dropout");
    assert_eq!(effect.location.as_deref(), Some("at times: 3.1 % of the rows"), "93 of 3,000");
    let told: Vec<(f64, f64)> = effect.active.iter().map(|s| (s.start, s.end)).collect();
    assert_eq!(told, lost.map(|(from, end)| (whole.time[from], whole.time[end])));
}

#[test]
fn drag_acted_where_the_arm_was_fast() {
    let outcome = diagnosed(ServoEffect::TYPICAL[6], 52);
    let effect = only(&outcome);
    assert!(effect.location.as_deref().unwrap().starts_with("|velocity| > 0."), "{effect:?}");
    assert!(!effect.active.is_empty());
}

/// What a joint with a lag of 12 ms shows when it is sent `commands`.
fn lagging(name: &str, time: Vec<f64>, commands: Vec<f64>) -> Recording<Commands> {
    let base = joint([0.1, 0.23, 2.5, 1.0]);
    let lag = base.candidates(&[]).into_iter().find(|c| c.about.name == "actuator_lag").unwrap();
    let blank = recording(name, time.clone(), commands.clone(), vec![0.0; time.len()]);
    let lane = Thetas::single(&[0.1, 0.23, 2.5, 1.0, 0.012, 0.0, 0.0]);
    let run = base.with(&lag).rollout(&lane, &blank, 0..time.len(), Seed(0)).remove(0);
    let mut draws = Draws(5);
    recording(name, time, commands, run[0].samples.iter().map(|q| q + NOISE * draws.next()).collect())
}

#[test]
fn the_next_experiment_tells_what_the_recording_could_not() {
    // Slow commands: a lag and a delay of the same length look alike.
    let time: Vec<f64> = (0..5_000).map(|i| f64::from(i) * SPACING).collect();
    let commands: Vec<f64> = time.iter().map(|t| 0.9 * (0.7 * t).sin() + 0.3 * (1.9 * t + 0.5).sin()).collect();
    let first = lagging("first", time, commands);
    let before = diagnose(&twin(), std::slice::from_ref(&first), &[], Seed(1), &|_, _, _| ());
    assert_eq!(before.diagnosis.verdict, Verdict::Ambiguous, "{}", before.diagnosis.summary);
    let next = before.diagnosis.next_experiment.unwrap();
    assert!(next.gain.unwrap() > 50.0 && next.gain.unwrap() > 20.0 * next.gain_so_far.unwrap(), "{next:?}");
    assert!(next.rivals.contains(&"actuator_lag".to_owned()), "{next:?}");
    // No command tells a delay of the command from one of the sensor.
    let delay = before.diagnosis.effects[0].mechanism.ends_with("_delay");
    assert_eq!(next.what.contains("nothing that can be sent tells"), delay, "{}", next.what);

    let sent = before.excitation.unwrap();
    let largest = |commands: &[f64]| commands.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
    assert!(largest(&sent.command) <= 1.5 * largest(&first.stimulus.0) + 1e-3);
    let second = lagging("second", sent.time, sent.command);
    let after = diagnose(&twin(), &[first, second], &[], Seed(1), &|_, _, _| ());
    assert_eq!(only(&after).mechanism, "actuator_lag", "{}", after.diagnosis.summary);
    assert_eq!(after.diagnosis.verdict, Verdict::Named, "{}", after.diagnosis.summary);
}
