//! Bad twins of cart-poles, tanks, equations and closed loops through the real program: exit code 2, file, place, value and
//! hint on standard error, and nothing written.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop where it fails")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use tempfile::TempDir;
use trueup::io::TwinFile;
use trueup::robot::{
    cart_pole_assembly, cart_pole_recordings, equations_assembly, equations_recordings, tanks_assembly, tanks_recordings,
};

const CART_POLE: &str = include_str!("../../fuzz/seeds/twin/cart_pole");
const EQUATIONS: &str = include_str!("../../fuzz/seeds/twin/next");
const SILVERBOX: &str = include_str!("../real_recordings/silverbox.toml");
const TANKS: &str = include_str!("../real_recordings/cascaded_tanks.toml");

/// A folder with a twin and a recording that has every column the twins name.
fn scene(twin: &str) -> TempDir {
    let mut table = String::from("t,u,w,x,a,y,u_v,y_v,pump_u_v,level2_y_v\n");
    for row in 0..120 {
        let (t, s) = (f64::from(row) * 0.02, (f64::from(row) * 0.1).sin());
        writeln!(table, "{t},{s},{s},{s},{s},{s},{s},{s},{s},{}", 5.0 + s).unwrap();
    }
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("train.csv"), table).unwrap();
    fs::write(folder.path().join("twin.toml"), twin).unwrap();
    folder
}

/// `twin`, in which `from` is `to`.
fn changed(twin: &str, from: &str, to: &str) -> TempDir {
    assert!(twin.contains(from), "{from}");
    scene(&twin.replacen(from, to, 1))
}

/// The same in the recording.
fn recorded(folder: TempDir, from: &str, to: &str) -> TempDir {
    let path = folder.path().join("train.csv");
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{from}");
    fs::write(path, text.replacen(from, to, 1)).unwrap();
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// What the program says of it, having written nothing and ended with exit code 2.
fn refused(folder: &TempDir) -> String {
    let output = Command::new(assert_cmd::cargo::cargo_bin!("trueup"))
        .current_dir(folder.path())
        .args(["diagnose", "twin.toml", "--recording", "train.csv", "--out", "found"])
        .env_remove("RUST_BACKTRACE")
        .output()
        .unwrap();
    let (out, err) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert_eq!((output.status.code(), out.as_str()), (Some(2), ""), "{err}");
    assert_eq!(names(folder.path()), ["train.csv", "twin.toml"], "something was written");
    assert!(err.contains("\n  hint: "), "no hint: {err}");
    assert!(!err.contains("panicked"), "{err}");
    err
}

/// What is refused below is refused for what was changed.
#[test]
fn the_twins_are_good_before_they_are_spoilt() {
    for text in [CART_POLE, EQUATIONS, SILVERBOX, TANKS] {
        let folder = scene(text);
        let twin = TwinFile::read(folder.path().join("twin.toml")).unwrap();
        let paths = [folder.path().join("train.csv")];
        match twin.model.as_str() {
            "cart_pole" => drop((cart_pole_recordings(&twin, &paths).unwrap(), cart_pole_assembly(&twin).unwrap())),
            "tanks" => drop(tanks_assembly(&twin, &tanks_recordings(&twin, &paths).unwrap()).unwrap()),
            _ => drop(equations_assembly(&twin, &equations_recordings(&twin, &paths).unwrap()).unwrap()),
        }
    }
}

#[test]
fn cart_poles() {
    let told = [
        changed(CART_POLE, "0.5, unit = \"m\"", "50, unit = \"cm\""),
        changed(CART_POLE, "pole_mass ", "pole_mas "),
        changed(CART_POLE, "cart_mass   = { value = 1.0", "cart_mass   = { value = -1.0"),
        changed(CART_POLE, "angle    = { column = \"a\", unit = \"rad\" }", ""),
        changed(CART_POLE, "unit = \"rad\"", "unit = \"deg\""),
        changed(CART_POLE, "model = \"cart_pole\"", "model = \"cart_pole\"\nstep = 0.1"),
        recorded(scene(CART_POLE), ",a,", ",angle,"),
        recorded(scene(CART_POLE), "\n0,0,", "\n0,NaN,"),
    ];
    insta::assert_snapshot!(told.each_ref().map(refused).join("\n"));
}

#[test]
fn tanks() {
    let told = [
        changed(TANKS, "column = \"level2_y_v\", unit = \"V\"", "column = \"level2_y_v\""),
        changed(TANKS, "unit = \"V^0.5/s\"", "unit = \"m^0.5/s\""),
        changed(TANKS, "lower_outflow = { value = 0.06", "lower_outflow = { value = nan"),
        changed(TANKS, "pump_gain     = { value = 0.04", "pump_gain     = { value = 0"),
        changed(TANKS, "[channels]", "[channels]\nupper = { column = \"x\" }"),
        changed(TANKS, "model = \"tanks\"", "model = \"tanks\"\nstep = -1"),
        recorded(scene(TANKS), "level2_y_v", "level"),
    ];
    insta::assert_snapshot!(told.each_ref().map(refused).join("\n"));
}

#[test]
fn equations() {
    let told = [
        changed(SILVERBOX, "damping*v", "damping*vel"),
        changed(SILVERBOX, "w = \"2*pi*frequency\"", "w = \"2*pi*z\"\nz = \"w\""),
        changed(SILVERBOX, "w^2*(gain*u - y)", "w^2*(gain*u - y"),
        changed(SILVERBOX, "y = \"v\"", "q = \"v\""),
        changed(SILVERBOX, "unit = \"V/s\"", "unit = \"V\""),
        changed(SILVERBOX, "expression = \"y\"", "expression = \"y + u\""),
        changed(SILVERBOX, "velocity = \"v\"", "velocity = \"y\""),
        changed(SILVERBOX, "- damping*v", "- damping*v/y"),
        changed(SILVERBOX, "y = { unit = \"V\" }", "y = { unit = \"V\", initial = inf }"),
        changed(SILVERBOX, "v = { unit", "v = { unti"),
        changed(SILVERBOX, "[definitions]", "[definitions]\nsin = \"1\""),
        changed(EQUATIONS, "u = { column = \"u\"", "u = { column = \"volts\""),
        changed(EQUATIONS, "column = \"w\"", "column = \"w\", command = true"),
        changed(EQUATIONS, "[outputs]", "[derivatives]\nh = \"1\"\n[outputs]"),
        recorded(scene(EQUATIONS), "\n0,0,", "\n0,NaN,"),
    ];
    insta::assert_snapshot!(told.each_ref().map(refused).join("\n"));
}

#[test]
fn controllers() {
    let told = [
        changed(CART_POLE, "kp = 12.0", ""),
        changed(CART_POLE, "kp = 12.0", "kp = nan"),
        changed(CART_POLE, "kd = {", "kdd = {"),
        changed(CART_POLE, "kind = \"pid\"", "kind = \"lqr\""),
        changed(CART_POLE, "limit = 10", "limit = -10"),
        changed(CART_POLE, "period = 0.01", "period = 0"),
        changed(CART_POLE, "derivative = \"error\"", "derivative = \"set point\""),
        changed(CART_POLE, "uncertainty = 0.1 }\nlimit", "uncertainty = -0.1 }\nlimit"),
    ];
    insta::assert_snapshot!(told.each_ref().map(refused).join("\n"));
}
