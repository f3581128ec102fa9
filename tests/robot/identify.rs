//! Fits: what the data determine, what priors hold, what ends at a bound.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::identify::{Effort, Problem, State, fit};
use trueup::sim2real::{Assembly, ChannelWeight, Measured, Part, Recording, Seed, Simulator, Thetas, Twin, Typical};

const TRUTH: [f64; 4] = [0.10, 0.30, 2.5, 1.0];

/// What a joint with the parameters `truth` would have measured, to the last bit.
fn exact(truth: &[f64]) -> Recording<Commands> {
    let time: Vec<f64> = (0..1_500).map(|i| f64::from(i) * 4e-3).collect();
    let commands = time.iter().map(|t| 1.5 * (2.1 * t).sin() + 0.8 * (5.3 * t).cos()).collect();
    let mut recording = Recording { name: "exact".into(), time, stimulus: Commands(commands), measured: Vec::new() };
    let simulator = Assembly::new(Joint::new(Axis::Rotary, [1.0; 4], [0.3; 4]), MECHANISMS);
    let lane: Vec<f64> = truth.iter().copied().chain([0.05, 0.0]).collect();
    let samples = simulator.rollout(&Thetas::single(&lane), &recording, 0..1_500, Seed(0))[0][0].samples.clone();
    let samples = samples.into_iter().map(Some).collect();
    recording.measured = vec![Measured { channel: "position".into(), unit: "rad".into(), samples }];
    recording
}

fn weights() -> Vec<ChannelWeight> {
    vec![ChannelWeight { channel: "position".into(), noise: 1e-3 }]
}

#[test]
fn recovers_the_parameters_behind_exact_data() {
    let recording = exact(&TRUTH);
    let simulator = Assembly::new(Joint::new(Axis::Rotary, [0.12, 0.25, 2.8, 1.0], [0.3, 0.3, 0.3, 0.0]), MECHANISMS);
    let (parts, weights) = ([Part::whole(&recording)], weights());
    let problem = Problem { simulator: &simulator, parts: &parts, weights: &weights, seed: Seed(0) };
    let start: Vec<f64> = simulator.parameters().iter().map(|p| p.nominal).collect();
    let found = fit(&problem, std::slice::from_ref(&start), &[0, 1, 2], &State::estimated(&problem), Effort::Thorough);
    for (k, truth) in TRUTH.into_iter().enumerate().take(3) {
        assert!((found.values[k] / truth - 1.0).abs() < 2e-3, "{k}: {:?}", found.values);
        assert!(found.std[k] > 0.0 && found.std[k] < 0.02 * truth);
    }
    assert_eq!((found.rank, found.values[3], found.std[3]), (3, 1.0, 0.0));
    let covariance = found.covariance.unwrap();
    assert!((covariance[(0, 0)].sqrt() - found.std[0]).abs() < 1e-12 * found.std[0]);
    assert!(found.at_bound.is_empty());
}

/// Torques and gain can all be multiplied by the same factor: data determine three combinations of the four, and the
/// prior decides the fourth.
#[test]
fn reveals_what_the_data_do_not_determine() {
    let recording = exact(&TRUTH);
    let simulator = Assembly::new(Joint::new(Axis::Rotary, [0.12, 0.25, 2.8, 1.0], [0.3, 0.3, 0.3, 0.05]), MECHANISMS);
    let (parts, weights) = ([Part::whole(&recording)], weights());
    let problem = Problem { simulator: &simulator, parts: &parts, weights: &weights, seed: Seed(0) };
    let start: Vec<f64> = simulator.parameters().iter().map(|p| p.nominal).collect();
    let found = fit(&problem, std::slice::from_ref(&start), &[0, 1, 2, 3], &State::estimated(&problem), Effort::Thorough);
    assert_eq!(found.rank, 3, "{:?}", found.std);
    let ratio = |k: usize| found.values[k] / found.values[3] / TRUTH[k];
    assert!((0..3).all(|k| (ratio(k) - 1.0).abs() < 2e-3), "{:?}", found.values);
    // The prior's 5 % is all that holds the gain.
    assert!((0.03..0.06).contains(&(found.std[3] / found.values[3])), "{:?}", found.std);
}

#[test]
fn says_which_parameters_ended_at_a_bound() {
    let recording = exact(&TRUTH);
    let plain = Assembly::new(Joint::new(Axis::Rotary, TRUTH, [0.3, 0.3, 0.3, 0.0]), MECHANISMS);
    let candidates = plain.candidates(std::slice::from_ref(&recording));
    let friction = candidates.iter().find(|c| c.about.name == "coulomb_friction").unwrap();
    let simulator = plain.with(friction);
    let (parts, weights) = ([Part::whole(&recording)], weights());
    let problem = Problem { simulator: &simulator, parts: &parts, weights: &weights, seed: Seed(0) };
    let start: Vec<f64> = TRUTH.into_iter().chain([friction.form.parameters[0].starts[0]]).collect();
    let found = fit(&problem, std::slice::from_ref(&start), &[0, 1, 2, 4], &State::estimated(&problem), Effort::Thorough);
    assert_eq!(found.at_bound, [4], "{:?}", found.values);
}

/// Steps of an axis with dry friction, as a sensor with even noise of 9 mm shows them. Gives the noise's standard deviation too.
fn rubbing_axis(simulator: &Assembly<Joint>, lane: &[f64], seed: u64) -> (Recording<Commands>, f64) {
    let mut drawn = seed;
    let mut chance = move || {
        drawn = drawn.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        2.0 * ((drawn >> 11) as f64 / (1_u64 << 53) as f64) - 1.0
    };
    let mut held = 0.0;
    let mut command = |row: i32| {
        held = if row % 250 == 0 { chance() } else { held };
        held
    };
    let commands = Commands((0..4_000).map(&mut command).collect());
    let time = (0..4_000).map(|row| f64::from(row) * 2e-3).collect();
    let mut recording = Recording { name: "axis".into(), time, stimulus: commands, measured: Vec::new() };
    let samples = simulator.rollout(&Thetas::single(lane), &recording, 0..4_000, Seed(0))[0][0].samples.clone();
    let samples = samples.into_iter().map(|q| Some(q + 9e-3 * chance())).collect();
    recording.measured = vec![Measured { channel: "position".into(), unit: "m".into(), samples }];
    (recording, 9e-3 / 3.0_f64.sqrt())
}

/// What an axis with dry friction makes of a first velocity is not what a smooth one would: before long it stands still, and where the
/// initial state is moved as far as a linear plant would have it, no step of the parameters does any good.
#[test]
fn a_fit_finds_back_from_an_initial_state_that_dry_friction_makes_something_else_of() {
    const AXIS: [f64; 4] = [1.4, 6.0, 0.0, 9.0];
    let friction = MECHANISMS.iter().find(|m| m.about().name == "coulomb_friction").unwrap();
    let form = friction.forms(&Typical::default()).remove(0);
    let simulator = Assembly::new(Joint::new(Axis::Linear, AXIS, [0.2, 0.2, 0.0, 0.0]), MECHANISMS).with_mechanism(
        *friction,
        0,
        form.parameters,
    );
    let lane: Vec<f64> = AXIS.into_iter().chain([1.0, 0.0, 0.0]).collect();
    for seed in 1..8 {
        let (recording, noise) = rubbing_axis(&simulator, &lane, seed);
        let (parts, weights) = ([Part::whole(&recording)], [ChannelWeight { channel: "position".into(), noise }]);
        let problem = Problem { simulator: &simulator, parts: &parts, weights: &weights, seed: Seed(0) };
        for (initial, torque) in [(vec![-0.03, 0.37], 0.8), (vec![0.04, -0.5], 0.8), (vec![0.04, -0.5], 0.16)] {
            let mut state = State::estimated(&problem);
            state.values[0] = initial;
            let start = [1.44, 7.34, 0.0, 9.0, torque];
            let found = fit(&problem, &[start.to_vec()], &[0, 1, 4], &state, Effort::Thorough);
            let left = found.residual.norm_squared() / found.residual.len() as f64;
            assert!(left < 1.05, "{left} times the noise of recording {seed}: {:?}", found.values);
            assert!((found.values[4] - 1.0).abs() < 0.03, "recording {seed}: {:?}", found.values);
        }
    }
}
