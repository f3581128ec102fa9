//! Diagnoses of recordings in which the generator concealed an effect, in laws and with integrators of its own.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails where a value is missing")]

use rand_distr::{Distribution, StandardNormal};
use rayon::ThreadPoolBuilder;
use trueup::conceal::servo::{Excitation, Servo, ServoEffect};
use trueup::conceal::{Column, Table};
use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::diagnose::{Effect, Evidence, Outcome, Verdict, calibrate, diagnose};
use trueup::sim2real::{Assembly, Measured, Recording, Seed};

fn column(table: &Table, name: &str) -> Vec<f64> {
    match table.columns().iter().find(|(other, _)| other == name) {
        Some((_, Column::Real(values))) => values.clone(),
        other => panic!("no column of numbers {name}: {other:?}"),
    }
}

/// A recording of the generator, `rows` long.
fn recording(effects: &[ServoEffect], excitation: Excitation, seed: u64, rows: usize) -> Recording<Commands> {
    let table = Servo { rows, ..Servo::default() }.with(effects).record(excitation, Seed(seed));
    let samples = column(&table, "q").into_iter().map(Some).collect();
    Recording {
        name: format!("{excitation:?}"),
        time: column(&table, "t"),
        stimulus: Commands(column(&table, "u")),
        measured: vec![Measured { channel: "position".into(), unit: "rad".into(), samples }],
    }
}

fn twin() -> Assembly<Joint> {
    Assembly::new(Joint::new(Axis::Rotary, [0.11, 0.25, 2.7, 1.0], [0.2, 0.2, 0.2, 0.0]), MECHANISMS)
}

fn diagnosed(twin: &Assembly<Joint>, effects: &[ServoEffect], seed: u64) -> Outcome<Assembly<Joint>> {
    let fitted = [recording(effects, Excitation::SinesAndSteps, seed, 3_000)];
    let held_out = [recording(effects, Excitation::ChirpAndSteps, seed + 1, 3_000)];
    diagnose(twin, &fitted, &held_out, Seed(1), &|_, _, _| ())
}

fn names(outcome: &Outcome<Assembly<Joint>>) -> Vec<String> {
    let mut names: Vec<String> = outcome.diagnosis.effects.iter().map(|e| e.mechanism.clone()).collect();
    names.sort();
    names
}

#[test]
fn every_effect_of_the_generator_is_named() {
    for (k, effect) in ServoEffect::TYPICAL.into_iter().enumerate() {
        let outcome = diagnosed(&twin(), &[effect], 40 + 2 * k as u64);
        // A spring that hardens has two right names: what is left of either is an error of form.
        let springs = ["cubic_stiffness", "stiffness"];
        // In open loop and from rest a late command and a late sensor are the same: both must be told.
        let delays = ["command_delay", "observation_delay"];
        if effect.mechanism() == delays[0] {
            let found = &outcome.diagnosis.effects[0];
            let told = [found.mechanism.as_str(), found.rivals[0].mechanism.as_str()];
            assert!(
                delays.iter().all(|delay| told.contains(delay)) && names(&outcome).len() == 1,
                "{:#?}",
                outcome.diagnosis
            );
        } else if matches!(effect, ServoEffect::HardeningSpring { .. }) {
            let named = names(&outcome);
            assert!(named.len() == 1 && springs.contains(&named[0].as_str()), "{:#?}", outcome.diagnosis);
            assert!(matches!(outcome.diagnosis.verdict, Verdict::Named | Verdict::Ambiguous));
        } else {
            assert_eq!(names(&outcome), [effect.mechanism()], "{:#?}", outcome.diagnosis);
            assert_eq!(outcome.diagnosis.verdict, Verdict::Named, "{}", outcome.diagnosis.summary);
        }
        let fit = &outcome.diagnosis.fit[0];
        assert!(fit.trued_rmse < 0.5 * fit.recalibrated_rmse, "{}: {fit:?}", effect.mechanism());
        assert!(outcome.diagnosis.checks.placebo_p.unwrap() <= 0.01);
    }
}

#[test]
fn nothing_is_named_where_only_parameters_are_off() {
    for seed in [70, 72, 74] {
        let outcome = diagnosed(&twin(), &[], seed);
        assert_eq!(outcome.diagnosis.verdict, Verdict::NoMismatch, "{:#?}", outcome.diagnosis);
        assert!(outcome.diagnosis.effects.is_empty());
        let fit = &outcome.diagnosis.fit[0];
        assert!(fit.recalibrated_rmse < 1.3 * fit.noise_floor && fit.nominal_rmse > 3.0 * fit.noise_floor);
    }
}

/// What is simulated foretells no noise; were what is measured taken for the motion, noise that remembers itself would foretell
/// itself, and a complete diagnosis would be called unexplained.
#[test]
fn noise_that_remembers_itself_is_not_foretold_by_the_motion() {
    for (seed, remembers) in [(120, 0.9_f64), (122, 0.75)] {
        let mut rng = Seed(seed).stream("coloured");
        let mut recorded = |excitation, seed| {
            let mut recording = recording(&[ServoEffect::TYPICAL[0]], excitation, seed, 5_000);
            let mut noise = 0.0;
            for sample in recording.measured[0].samples.iter_mut().flatten() {
                let fresh: f64 = StandardNormal.sample(&mut rng);
                noise = remembers * noise + (1.0 - remembers * remembers).sqrt() * 0.006 * fresh;
                *sample += noise;
            }
            [recording]
        };
        let fitted = recorded(Excitation::SinesAndSteps, seed);
        let held_out = recorded(Excitation::ChirpAndSteps, seed + 1);
        let outcome = diagnose(&twin(), &fitted, &held_out, Seed(1), &|_, _, _| ());
        assert_eq!(names(&outcome), ["coulomb_friction"], "{:#?}", outcome.diagnosis);
        assert!(matches!(outcome.diagnosis.verdict, Verdict::Named | Verdict::Ambiguous), "{}", outcome.diagnosis.summary);
        let notes = &outcome.diagnosis.checks.notes;
        let foretold = notes.iter().find_map(|note| note.strip_prefix("a regression on the motion foretells ")).unwrap();
        let percent: f64 = foretold.split(' ').next().unwrap().parse().unwrap();
        assert!(percent < 10.0, "{foretold}");
    }
}

#[test]
fn two_effects_are_both_named() {
    let pair = [ServoEffect::TYPICAL[1], ServoEffect::TYPICAL[6]];
    let mut expected = pair.map(|e| e.mechanism().to_owned());
    expected.sort();
    let outcome = diagnosed(&twin(), &pair, 80);
    // In open loop and from rest a late command and a late sensor are the same.
    let told = |effect: &Effect| {
        let rivals: Vec<&str> = effect.rivals.iter().map(|r| r.mechanism.as_str()).collect();
        if rivals.contains(&"command_delay") { "command_delay".to_owned() } else { effect.mechanism.clone() }
    };
    let mut named: Vec<String> = outcome.diagnosis.effects.iter().map(told).collect();
    named.sort();
    assert_eq!(named, expected, "{:#?}", outcome.diagnosis);
}

/// What a small offset leaves is one thing that stays as it is, however many rows it lasts: by it alone the large effect beside it
/// would hardly be worth its constants.
#[test]
fn a_first_effect_that_a_slow_one_hides_is_named_with_it() {
    let pair = [ServoEffect::SoftDriver { limit: 1.3 }, ServoEffect::HangingLoad { torque: 0.02 }];
    let outcome = diagnosed(&twin(), &pair, 140);
    let found = names(&outcome);
    assert!(found.contains(&"saturation".to_owned()) && found.len() == 2, "{:#?}", outcome.diagnosis);
    // A small load, a small offset of the sensor and its drift are hardly to be told from each other.
    let other = outcome.diagnosis.effects.iter().find(|e| e.mechanism != "saturation").unwrap();
    let told = std::iter::once(&other.mechanism).chain(other.rivals.iter().map(|r| &r.mechanism));
    assert!(told.into_iter().any(|name| name == "constant_load"), "{:#?}", outcome.diagnosis);
}

/// Friction that breaks away a little later than it slides is Coulomb's to within these data, and is not excluded by them.
#[test]
fn a_general_law_is_listed_unless_it_is_excluded() {
    let told = |breakaway| {
        let outcome = diagnosed(&twin(), &[ServoEffect::BristleFriction { coulomb: 0.18, breakaway }], 150);
        let effect = outcome.diagnosis.effects[0].clone();
        let rivals: Vec<String> = effect.rivals.iter().map(|r| r.mechanism.clone()).collect();
        (effect.mechanism, rivals)
    };
    let (name, rivals) = told(0.22);
    assert!(name == "stribeck_friction" || rivals.contains(&"stribeck_friction".to_owned()), "{name} {rivals:?}");
    assert_eq!(told(0.27).0, "stribeck_friction");
}

/// With its law taken out of the registry, an effect must not be given another's name.
#[test]
fn an_effect_outside_the_registry_is_not_explained_away() {
    // Without the law, and without those that hold it as a special case or come to the same.
    let families: [(usize, &[&str]); 2] = [
        (0, &["coulomb_friction", "stribeck_friction", "load_friction", "hysteresis", "backlash"]),
        (2, &["saturation", "thermal_derating", "rate_limit"]),
    ];
    for (k, family) in families {
        let effect = ServoEffect::TYPICAL[k];
        let unknown: Vec<String> = family.iter().map(|id| (*id).to_owned()).collect();
        let outcome = diagnosed(&twin().excluding(&unknown), &[effect], 90 + 2 * k as u64);
        assert!(
            matches!(outcome.diagnosis.verdict, Verdict::Unexplained | Verdict::NotExcited),
            "{}: {:#?}",
            effect.mechanism(),
            outcome.diagnosis
        );
    }
}

#[test]
fn the_same_bits_at_any_number_of_threads() {
    let effect = [ServoEffect::TYPICAL[0]];
    let with_threads = |threads| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| diagnosed(&twin(), &effect, 100))
    };
    let one = with_threads(1);
    for threads in [2, 5] {
        let many = with_threads(threads);
        assert_eq!(one.diagnosis, many.diagnosis);
        assert_eq!(one.comparisons, many.comparisons);
        assert_eq!(
            one.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>(),
            many.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        );
    }
}

#[test]
fn a_calibration_finds_the_parameters_behind_a_recording() {
    let truth = Servo::default();
    let fitted = [recording(&[], Excitation::SinesAndSteps, 110, 3_000)];
    let calibration = calibrate(&twin(), &fitted, &[], Seed(1), &|_, _, _| ());
    for (k, expected) in [truth.inertia, truth.viscous_friction, truth.gravity_torque].into_iter().enumerate() {
        // The gain is not free here, so everything is known in units of it.
        let expected = expected / truth.gain;
        let (value, std) = (calibration.values[k], calibration.std[k]);
        assert!((value - expected).abs() < 4.0 * std + 0.01 * expected, "{k}: {value} +- {std}, not {expected}");
    }
}

/// A joint that hardly slows down forgets its velocity later than the recording ends: windows of two such times would be the
/// recording itself, and all would be sought twice in the same errors.
#[test]
fn windows_that_cut_nothing_are_not_followed() {
    let recordings = [recording(&[], Excitation::SinesAndSteps, 111, 3_000)];
    let window = |friction: f64| {
        // Nothing draws it to one place.
        let joint = Assembly::new(Joint::new(Axis::Rotary, [0.11, friction, 0.0, 1.0], [0.2, 0.2, 0.0, 0.0]), MECHANISMS);
        Evidence::divide(&joint, &recordings, &[]).window
    };
    let short = window(0.25).unwrap();
    assert!((0.3..2.0).contains(&short), "{short}");
    assert_eq!(window(0.005), None);
}
