//! Cases of the blind benchmark, of development seeds and of test seeds that are spent, that were once answered wrongly, each for
//! a reason of its own.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use trueup::proof::{Case, Domain, Trial};
use trueup::sim2real::Seed;
use trueup::sim2real::diagnose::Verdict;

fn tried(seed: u64, index: usize) -> Trial {
    Case::draw(Domain::Robot, Seed(seed), index).tried(&|| 0.0).unwrap()
}

fn names(trial: &Trial) -> Vec<&str> {
    let mut names: Vec<&str> = trial.found.iter().map(|found| found.mechanism.as_str()).collect();
    names.sort_unstable();
    names
}

/// A saturation beside a small constant load: what the second would take away hides how much the first explains.
#[test]
fn a_first_effect_is_followed_while_more_than_noise_is_left() {
    let trial = tried(42, 88);
    assert!(names(&trial).contains(&"saturation"), "{:?}", trial.found);
}

/// Elements that yield one after the other are not quite a loop of one law: what that leaves is no third effect.
#[test]
fn a_third_name_does_not_stand_for_the_form_of_the_first_two() {
    let trial = tried(45, 133);
    assert_eq!(names(&trial), ["eccentricity", "hysteresis"]);
    assert_ne!(trial.verdict, Verdict::Unexplained);
}

/// What begins to yield at once leaves no second law and no unexplained rest where the knee of its loop may have any shape.
#[test]
fn a_loop_may_have_any_knee() {
    let trial = tried(1005, 82);
    assert_eq!(names(&trial), ["hysteresis", "payload_change"]);
    assert_ne!(trial.verdict, Verdict::Unexplained);
}

/// A run of samples lost at one end: what is told of the first moments must not go astray on the few samples next to it.
#[test]
fn a_stop_is_found_though_a_run_of_samples_is_lost() {
    let trial = tried(45, 41);
    assert_eq!(names(&trial), ["dropout", "end_stop"]);
}

/// A wider law is no mechanism of its own: sought beside the others it took the place of one of them, and a cubic stiffness was
/// lost.
#[test]
fn a_wider_law_takes_no_other_mechanisms_place() {
    let trial = tried(45, 48);
    assert_eq!(names(&trial), ["cubic_stiffness", "eccentricity"]);
}
