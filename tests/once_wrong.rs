//! Cases of development seeds of the blind benchmark that were once answered wrongly, each for a reason of its own.

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
