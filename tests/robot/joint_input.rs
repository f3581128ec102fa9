//! Recordings of a joint that no diagnosis can use: each is refused with its place and a remedy.

#![cfg(feature = "io")]
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use trueup::io::TwinFile;
use trueup::robot::{joint_assembly, joint_recordings};
use trueup::sim2real::Seed;
use trueup::sim2real::diagnose::{Verdict, diagnose};

const TWIN: &str = r#"
[twin]
model = "joint"
[parameters]
inertia = { value = 0.11, unit = "kg m^2", uncertainty = 0.2 }
viscous_friction = { value = 0.25, unit = "N m s/rad", uncertainty = 0.2 }
[channels]
command = { column = "u" }
position = { column = "q", unit = "rad" }
"#;

/// A folder with a twin and a recording of 300 rows whose time and position are as given.
fn scene(time: impl Fn(usize) -> f64, position: impl Fn(usize) -> f64) -> (tempfile::TempDir, TwinFile, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "t,u,q\n".to_owned();
    for row in 0..300 {
        writeln!(text, "{},{},{}", time(row), (row as f64 * 0.05).sin(), position(row)).unwrap();
    }
    let recording = folder.path().join("log.csv");
    fs::write(&recording, text).unwrap();
    fs::write(folder.path().join("twin.toml"), TWIN).unwrap();
    let twin = TwinFile::read(folder.path().join("twin.toml")).unwrap();
    (folder, twin, recording)
}

fn refusal(time: impl Fn(usize) -> f64, position: impl Fn(usize) -> f64) -> String {
    let (_folder, twin, recording) = scene(time, position);
    joint_recordings(&twin, &[recording]).unwrap_err().to_string()
}

#[test]
fn milliseconds_are_not_taken_for_seconds() {
    let text = refusal(|row| row as f64 * 4.0, |row| row as f64 * 1e-3);
    assert!(text.contains("`t`") && text.contains("found 4") && text.contains("divide milliseconds by 1000"), "{text}");
}

#[test]
fn a_gap_is_told_with_its_row() {
    let text = refusal(|row| row as f64 * 4e-3 + if row < 200 { 0.0 } else { 1e6 }, |row| row as f64 * 1e-3);
    assert!(text.contains("row 202") && text.contains("cut the recording there"), "{text}");
}

#[test]
fn a_value_that_stands_for_a_lost_sample_is_told_with_its_row() {
    let text = refusal(|row| row as f64 * 4e-3, |row| if row == 7 { 1e308 } else { 0.01 * row as f64 });
    assert!(text.contains("row 9") && text.contains("`q`") && text.contains("hint"), "{text}");
}

/// A joint that never moved says nothing of what its simulator leaves out.
#[test]
fn a_position_that_never_changes_is_not_explained_by_anything() {
    let (_folder, twin, recording) = scene(|row| row as f64 * 4e-3, |_| 0.25);
    let recordings = joint_recordings(&twin, &[recording]).unwrap();
    let outcome = diagnose(&joint_assembly(&twin).unwrap(), &recordings, &[], Seed(1), &|_, _, _| ());
    assert_eq!(outcome.diagnosis.verdict, Verdict::NotExcited);
    assert!(outcome.diagnosis.effects.is_empty());
}
