//! A recording that holds what the twin does not read: when its drive was switched off.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fmt::Write as _;

use crate::command_scene::Folder;

const TWIN: &str = r#"
[twin]
model = "joint"
[parameters]
inertia = { value = 0.11, unit = "kg m^2", uncertainty = 0.2 }
viscous_friction = { value = 0.25, unit = "N m s/rad", uncertainty = 0.2 }
gravity_torque = { value = 2.6, unit = "N m", uncertainty = 0.2 }
gain = { value = 1.0, unit = "N m per unit", uncertainty = 0.0 }
[channels]
command = { column = "u" }
position = { column = "q", unit = "rad" }
"#;

/// An arm of which the drive is off now and then, by steps of .1 ms of the bare equation of motion, and columns that say nothing.
fn recorded(phase: f64) -> String {
    let (mut q, mut v) = (0.0_f64, 0.0_f64);
    let mut text = "t,u,q,enabled,volts,blinks,row,note\n".to_owned();
    for row in 0..4_000 {
        let t = f64::from(row) * 5e-3;
        let u = 2.2 * (1.9 * t + phase).sin() + 1.1 * (5.3 * t).cos();
        let enabled = (0.71 * t + phase).sin() + (0.43 * t).cos() > -0.4;
        let noise = 1e-3 * ((f64::from(row) * 12.9898 + phase).sin() * 43_758.545_3).fract();
        let volts = 7.2 + 0.05 * (0.9 * t).sin();
        let blinks = (row / 211) % 2;
        writeln!(text, "{t:.3},{u:.6},{:.6},{},{volts:.3},{blinks},{row},none", q + noise, u8::from(enabled)).unwrap();
        for _ in 0..50 {
            let torque = if enabled { u } else { 0.0 } - 0.22 * v - 2.7 * q.sin();
            v += 1e-4 * torque / 0.12;
            q += 1e-4 * v;
        }
    }
    text
}

#[test]
fn a_column_that_tells_when_the_twin_errs_is_told_though_no_twin_reads_it() {
    let (train, test) = (recorded(0.0), recorded(1.3));
    let folder = Folder::with(&[("twin.toml", TWIN), ("train.csv", &train), ("test.csv", &test)]);
    let (code, out, err) = folder.run("diagnose twin.toml --recording train.csv --holdout test.csv --out out");
    assert_eq!(code, 0, "{err}");
    let told = "enabled, a column the twin does not read: parameters of their own below and above 0.500 explain ";
    assert!(out.contains(told), "{out}");
    let found: serde_json::Value = serde_json::from_slice(&folder.bytes("out/diagnosis.json")).unwrap();
    let columns = found["where"]["columns"].as_array().unwrap();
    assert_eq!((columns.len(), columns[0]["column"].as_str()), (1, Some("enabled")), "{columns:?}");
    assert!(columns[0]["explains"].as_f64().unwrap() > 0.8, "{columns:?}");
    let page = String::from_utf8(folder.bytes("out/report.html")).unwrap();
    assert!(page.contains("<code>enabled</code> is below and above"), "the page tells it too");
}
