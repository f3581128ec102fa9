//! Recordings of systems the project has not made. They are not part of it: where they are not at hand beside it, these
//! tests say so and pass.

#![cfg(feature = "io")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop where it fails")]

use std::path::{Path, PathBuf};

use trueup::io::TwinFile;
use trueup::market::{Execution, execution_twin};
use trueup::robot::{joint_assembly, joint_recordings};
use trueup::sim2real::Seed;
use trueup::sim2real::diagnose::{ChannelFit, Diagnosis, Effect, Verdict, diagnose};
use trueup::sim2real::{Assembly, Recording};

/// The folder of recordings; none, which is said, where it is not at hand.
fn shared(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
    if !folder.is_dir() {
        println!("SKIPPED: there is no ../shared/data/{name}");
        return None;
    }
    Some(folder)
}

fn named(diagnosis: &Diagnosis) -> Vec<&str> {
    let mut names: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.mechanism.as_str()).collect();
    names.sort_unstable();
    names
}

/// What was named beside what the mid does after orders, which nobody knows of the agents of this exchange.
fn beside_impact(diagnosis: &Diagnosis) -> Vec<&str> {
    named(diagnosis).into_iter().filter(|name| !name.ends_with("_impact")).collect()
}

fn fit<'a>(diagnosis: &'a Diagnosis, channel: &str) -> &'a ChannelFit {
    let fit = diagnosis.fit.iter().find(|fit| fit.channel == channel).unwrap();
    println!("{}\n{fit:#?}", diagnosis.summary);
    fit
}

/// The pair its authors report: 20.4 N of Coulomb friction and an offset of -3.2 N.
/// Janot, Gautier & Brunot, Workshop on Nonlinear System Identification Benchmarks (2019).
#[test]
fn the_positioning_axis_has_dry_friction_and_an_offset() {
    let Some(folder) = shared("robot/emps") else { return };
    let twin = TwinFile::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/real_recordings/emps.toml")).unwrap();
    let assembly = joint_assembly(&twin).unwrap();
    let recordings = joint_recordings(&twin, &[folder.join("train.csv")]).unwrap();
    let held_out = joint_recordings(&twin, &[folder.join("test_pulses.csv")]).unwrap();
    let outcome = diagnose(&assembly, &recordings, &held_out, Seed(0), &|_, _, _| {});
    let found = &outcome.diagnosis;
    let fit = fit(found, "position");
    // Windows tell dry friction, be it with a load or without; of an offset and a gain that is off to one side, which come to
    // the same where one mostly goes that way, either may be named.
    let told = |names: &[&str]| {
        let said = |effect: &Effect| {
            names.contains(&effect.mechanism.as_str()) || effect.rivals.iter().any(|r| names.contains(&r.mechanism.as_str()))
        };
        found.effects.iter().filter(|effect| said(effect)).count()
    };
    assert_eq!((told(&["coulomb_friction"]), told(&["constant_load"])), (1, 1), "{}", found.summary);
    // Its encoder counts in steps far below anything that matters, which is seen.
    assert!(named(found).contains(&"quantization") && found.effects.len() == 3, "{}", found.summary);
    assert!(fit.nominal_rmse > 0.05 && fit.trued_rmse < 0.007, "{} m, {} m", fit.nominal_rmse, fit.trued_rmse);
    assert!(fit.improvement_ci95[0] > 0.0);
}

fn paper_log(name: &str) -> Option<(Assembly<Execution>, Vec<Recording<trueup::market::OrderLog>>)> {
    let folder = shared("market/abides")?.join(name);
    let twin = TwinFile::read(folder.join("twin.toml")).unwrap();
    Some(execution_twin(&twin, &[folder]).unwrap())
}

/// An agent-based exchange with a latency of 1 ms: `half_spread` and `book_walk` are all there is between mid and fill.
#[test]
fn the_paper_log_of_market_orders_names_spread_and_book() {
    let Some((twin, recordings)) = paper_log("01_market_lat1ms_q50") else { return };
    let outcome = diagnose(&twin, &recordings, &[], Seed(0), &|_, _, _| {});
    let found = &outcome.diagnosis;
    let fit = fit(found, "cost");
    assert_eq!(beside_impact(found), ["book_walk", "half_spread"], "{}", found.summary);
    assert!(matches!(found.verdict, Verdict::Named | Verdict::Ambiguous), "{}", found.summary);
    assert!(fit.nominal_mae > 0.1 && fit.trued_mae < 0.01, "{} bps, {} bps", fit.nominal_mae, fit.trued_mae);
}

/// The same with a latency of 250 ms, which is named too.
#[test]
fn the_paper_log_with_latency_names_that_too() {
    let Some((twin, recordings)) = paper_log("02_market_lat250ms_q50") else { return };
    let outcome = diagnose(&twin, &recordings, &[], Seed(0), &|_, _, _| {});
    let found = &outcome.diagnosis;
    let fit = fit(found, "cost");
    assert_eq!(beside_impact(found), ["book_walk", "command_delay", "half_spread", "stale_quotes"], "{}", found.summary);
    // What its orders say they saw is as old as they take to arrive.
    for name in ["command_delay", "stale_quotes"] {
        let delay = found.effects.iter().find(|effect| effect.mechanism == name).unwrap();
        assert!((delay.parameters["seconds"].value - 0.25).abs() < 0.03, "{delay:?}");
    }
    assert!(fit.trued_mae < 0.01 && fit.nominal_mae > 0.1, "{} bps, {} bps", fit.nominal_mae, fit.trued_mae);
}

/// Without the right name in the registry, no wrong one is given instead.
#[test]
fn the_paper_log_is_unexplained_without_the_walk_through_the_book() {
    let Some((twin, recordings)) = paper_log("01_market_lat1ms_q50") else { return };
    let blind = twin.excluding(&["book_walk".to_owned()]);
    let found = diagnose(&blind, &recordings, &[], Seed(0), &|_, _, _| {}).diagnosis;
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.summary);
}
