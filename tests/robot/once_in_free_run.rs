//! Cases of the blind benchmark, of development seeds and of test seeds that are spent, in which a free run or windows that start afresh
//! once led to a wrong answer, each for a reason of its own.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use trueup::sim2real::diagnose::Verdict;

use super::once_wrong::{names, tried};

/// Windows start afresh so often that hardly anything of a hysteresis is seen in them: what fits them to the noise, and a free run
/// worse than the hysteresis does, is not what is missing.
/// Nor is what does a little worse there at more than twice the length.
#[test]
fn what_fits_windows_alone_does_not_displace_what_explains_a_free_run() {
    let trial = tried(1007, 87);
    assert_eq!(names(&trial), ["hysteresis"]);
    assert_ne!(trial.verdict, Verdict::Unexplained);
}

/// A free run that parts early leads no fit back; windows that start afresh do.
#[test]
fn windows_bring_a_twin_near_what_it_does_not_follow() {
    let trial = tried(67, 74);
    assert_eq!((names(&trial), trial.verdict), (vec!["observation_delay"], Verdict::Named));
}

/// Cogging on an axis that stays where it comes to rest: the winding's warmth shows in free run alone, and there no fit finds it but
/// the one that windows began.
#[test]
#[ignore = "takes half a minute: `./x test --test robot -- --ignored`"]
fn what_windows_fitted_for_nothing_begins_a_free_run() {
    assert_eq!(names(&tried(78, 8)), ["cogging", "thermal_derating"]);
}

/// Cogging alone, which windows show; followed from the start on, the axis came to the right tooth with a compliance in its drive, too,
/// of which windows show nothing.
#[test]
#[ignore = "takes half a minute: `./x test --test robot -- --ignored`"]
fn what_brings_a_free_run_to_the_right_tooth_by_chance_is_not_named() {
    assert_eq!(names(&tried(76, 7)), ["cogging"]);
}

/// Teeth of a motor on an axis that adds up what they do: a free run came to another number of them, and left a little that is slower than
/// noise; windows tell the number, and hardly that there are any.
#[test]
fn what_gains_too_little_on_windows_begins_a_free_run() {
    assert_eq!(names(&tried(1026, 360)), ["cogging"]);
}

/// Axes that add up commands of which none is quite as late as the one before: a free run goes astray, and came back by teeth and by a
/// spring beside a late sensor. Windows show the late command, and nothing besides.
#[test]
fn what_leads_a_free_run_back_by_chance_is_not_there() {
    is_a_late_command(1024, 56);
}

#[test]
#[ignore = "takes half a minute: `./x test --test robot -- --ignored`"]
fn nor_is_what_leads_another_one_back() {
    is_a_late_command(1029, 145);
}

fn is_a_late_command(seed: u64, index: usize) {
    let trial = tried(seed, index);
    assert_eq!(names(&trial), ["command_delay"], "{:?}", trial.found);
    assert_ne!(trial.verdict, Verdict::Unexplained);
}
