//! Fits: what the data determine, what priors hold, what ends at a bound.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
use trueup::sim2real::identify::{Effort, Problem, State, fit};
use trueup::sim2real::{Assembly, ChannelWeight, Measured, Part, Recording, Seed, Simulator, Thetas, Twin};

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
