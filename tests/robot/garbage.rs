//! Diagnoses of recordings that mean nothing: random commands, random samples, twins that diverge. None may panic, none may
//! put a number where there is none, and none may be surer than certain.
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use proptest::prelude::*;
use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::diagnose::{Diagnosis, Verdict, calibrate, diagnose};
use trueup::sim2real::{Assembly, Measured, Recording, Seed};

/// What a sensor or a sender of commands may do.
#[derive(Debug, Clone)]
enum Signal {
    Constant(f64),
    Noise(f64, u64),
    Walk(f64, u64),
    Steps(f64, u64),
    Spikes(f64, u64),
}

/// A number between -1 and 1 for each row.
fn drawn(seed: u64, row: usize) -> f64 {
    let mixed = (seed ^ (row as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    let mixed = (mixed ^ (mixed >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    (mixed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

impl Signal {
    /// Whether its squares may be larger than numbers go.
    fn overflows(&self) -> bool {
        let (Signal::Constant(size)
        | Signal::Noise(size, _)
        | Signal::Walk(size, _)
        | Signal::Steps(size, _)
        | Signal::Spikes(size, _)) = *self;
        size > 1e100
    }

    fn rows(&self, count: usize) -> Vec<f64> {
        let rows = 0..count;
        match *self {
            Signal::Constant(value) => vec![value; count],
            Signal::Noise(size, seed) => rows.map(|row| size * drawn(seed, row)).collect(),
            Signal::Walk(size, seed) => rows
                .scan(0.0, |at, row| {
                    *at += size * drawn(seed, row);
                    Some(*at)
                })
                .collect(),
            Signal::Steps(size, seed) => rows.map(|row| (size * drawn(seed, row / 16)).round()).collect(),
            Signal::Spikes(size, seed) => {
                rows.map(|row| if drawn(seed, row) > 0.9 { size * drawn(seed + 1, row) } else { 0.0 }).collect()
            }
        }
    }
}

fn signal() -> impl Strategy<Value = Signal> {
    let size = || prop_oneof![4 => 1e-3..10.0_f64, 1 => Just(1e-12), 1 => Just(1e9), 1 => Just(1e150)];
    prop_oneof![
        size().prop_map(Signal::Constant),
        Just(Signal::Constant(0.0)),
        (size(), any::<u64>()).prop_map(|(size, seed)| Signal::Noise(size, seed >> 1)),
        (size(), any::<u64>()).prop_map(|(size, seed)| Signal::Walk(size, seed >> 1)),
        (size(), any::<u64>()).prop_map(|(size, seed)| Signal::Steps(size, seed >> 1)),
        (size(), any::<u64>()).prop_map(|(size, seed)| Signal::Spikes(size, seed >> 1)),
    ]
}

/// A recording of `rows` rows; of the samples, that part is lost.
fn recording(commands: &Signal, samples: &Signal, rows: usize, lost: f64, uneven: bool) -> Recording<Commands> {
    let step = |row: usize| if uneven { 0.004 * (1.0 + 0.9 * drawn(7, row)) } else { 0.004 };
    let time = (0..rows).scan(0.0, |t, row| {
        *t += step(row);
        Some(*t)
    });
    let samples = samples.rows(rows).into_iter().enumerate();
    let samples = samples.map(|(row, y)| (drawn(11, row) * 0.5 + 0.5 >= lost).then_some(y)).collect();
    Recording {
        name: "garbage".into(),
        time: time.collect(),
        stimulus: Commands(commands.rows(rows)),
        measured: vec![Measured { channel: "position".into(), unit: "rad".into(), samples }],
    }
}

/// Whether a diagnosis says nothing that is not so, and can be read again unless squares of what it is about overflow.
fn honest(diagnosis: &Diagnosis, overflows: bool) -> Result<(), TestCaseError> {
    for effect in &diagnosis.effects {
        let known = effect.confidence + effect.rivals.iter().map(|r| r.confidence).sum::<f64>();
        prop_assert!((0.0..=1.0).contains(&effect.confidence), "{effect:?}");
        prop_assert!(known.is_finite() && effect.rivals.iter().all(|r| (0.0..=1.0).contains(&r.confidence)), "{effect:?}");
        prop_assert!(effect.parameters.values().all(|p| p.value.is_finite()), "{effect:?}");
    }
    for fit in &diagnosis.fit {
        let [low, high] = fit.improvement_ci95;
        prop_assert!(low <= high && high <= 1.0, "{fit:?}");
    }
    prop_assert!(diagnosis.parameters.values().all(|p| p.value.is_finite()), "{:?}", diagnosis.parameters);
    prop_assert!(
        !diagnosis.summary.is_empty() && !["NaN", "inf "].iter().any(|w| diagnosis.summary.contains(w)),
        "{}",
        diagnosis.summary
    );
    let written = serde_json::to_string(diagnosis).unwrap();
    let read = serde_json::from_str::<Diagnosis>(&written);
    if !overflows {
        prop_assert_eq!(read.map(|d| d.verdict).map_err(|e| format!("{e}: {written}")), Ok(diagnosis.verdict));
    }
    Ok(())
}

/// The random case in which what was found ran away on held-out data, so that nothing could be said of how much it helps.
#[test]
fn what_runs_away_on_held_out_data_helps_less_than_anything() {
    let twin = Assembly::new(Joint::new(Axis::Rotary, [0.1, -30.0, 2.0, 1.0], [0.2, 0.2, 0.2, 0.1]), MECHANISMS);
    let (commands, samples) = (
        Signal::Steps(2.449_315_945_511_510_3, 739_594_159_844_898_838),
        Signal::Steps(6.906_936_388_566_288, 7_591_308_859_643_756_258),
    );
    let fitted = [recording(&commands, &samples, 59, 0.0, true)];
    let outcome = diagnose(&twin, &fitted, &[], Seed(1), &|_, _, _| ());
    honest(&outcome.diagnosis, false).unwrap();
    for fit in &outcome.diagnosis.fit {
        assert!(fit.trued_rmse.is_finite() || fit.improvement_ci95 == [f64::NEG_INFINITY; 2], "{fit:?}");
    }
}

/// The random case in which a twin that ran away was told of as an error of NaN.
#[test]
fn a_twin_that_runs_away_has_no_error_that_could_be_told() {
    let twin = Assembly::new(Joint::new(Axis::Rotary, [0.1, 0.2, 2.0, 1.0], [0.2, 0.2, 0.2, 0.1]), MECHANISMS);
    let samples = Signal::Noise(1.183_994_505_400_809_2, 92_926_148_743_455_256);
    let fitted = [recording(&Signal::Constant(1e150), &samples, 36, 0.0, true)];
    let outcome = diagnose(&twin, &fitted, &[], Seed(1), &|_, _, _| ());
    honest(&outcome.diagnosis, true).unwrap();
    let fits = &outcome.diagnosis.fit;
    assert!(
        fits.iter().all(|f| !f.nominal_rmse.is_nan() && !f.recalibrated_rmse.is_nan() && !f.trued_rmse.is_nan()),
        "{fits:?}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn garbage_is_diagnosed_without_a_panic_or_a_number_that_is_none(
        commands in signal(),
        samples in signal(),
        rows in prop_oneof![1 => 1..12_usize, 3 => 12..160_usize],
        lost in prop_oneof![3 => Just(0.0), 1 => 0.0..1.0_f64, 1 => Just(1.0)],
        uneven in any::<bool>(),
        inertia in prop_oneof![Just(0.1), Just(1e-9), Just(1e6)],
        friction in prop_oneof![Just(0.2), Just(-30.0), Just(0.0)],
    ) {
        let twin = Assembly::new(Joint::new(Axis::Rotary, [inertia, friction, 2.0, 1.0], [0.2, 0.2, 0.2, 0.1]), MECHANISMS);
        let fitted = [recording(&commands, &samples, rows, lost, uneven)];
        let outcome = diagnose(&twin, &fitted, &[], Seed(1), &|_, _, _| ());
        honest(&outcome.diagnosis, commands.overflows() || samples.overflows())?;
        if lost == 1.0 {
            prop_assert_eq!(outcome.diagnosis.verdict, Verdict::NotExcited, "nothing was measured");
        }
        let calibration = calibrate(&twin, &fitted, &[], Seed(1), &|_, _, _| ());
        prop_assert!(calibration.values.iter().all(|value| value.is_finite()), "{:?}", calibration.values);
    }
}
