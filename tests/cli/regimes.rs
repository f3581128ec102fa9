//! `trueup regimes` from outside.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may stop where it fails")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(assert_cmd::cargo::cargo_bin!("trueup"))
        .current_dir(folder)
        .arg("regimes")
        .args(arguments)
        .env_remove("RUST_BACKTRACE")
        .output()
        .unwrap()
}

fn nile() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/nile.csv")
}

fn json(output: &Output) -> Value {
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn the_nile_falls_in_1899_by_any_method() {
    let folder = tempfile::tempdir().unwrap();
    let nile = nile();
    for method in ["pelt", "bocpd", "cusum"] {
        let found = json(&run(folder.path(), &[nile.to_str().unwrap(), "--states", "2", "--changes", method, "--json"]));
        assert_eq!(found["schema"], "trueup.regimes/1");
        assert_eq!((&found["column"], &found["rows"]), (&"flow".into(), &100.into()));
        let first = found["changes"][0]["time"].as_str().unwrap();
        let year: u32 = first[..4].parse().unwrap();
        // Cumulative sums tell only when it had begun to drift, against the first twenty years.
        assert!((1896..=1899).contains(&year), "{method}: {found}");
        assert!(method == "cusum" || (first == "1899-01-01T00:00:00Z" && found["changes"][0]["row"] == 28));
        let shares: f64 = found["states"].as_array().unwrap().iter().map(|s| s["share"].as_f64().unwrap()).sum();
        let now: f64 = found["states"].as_array().unwrap().iter().map(|s| s["now"].as_f64().unwrap()).sum();
        assert!((shares - 1.0).abs() < 1e-12 && (now - 1.0).abs() < 1e-12);
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn it_tells_people_what_it_tells_programs() {
    let told = run(Path::new("."), &[nile().to_str().unwrap()]);
    let text = String::from_utf8(told.stdout).unwrap();
    assert!(text.contains("States of `flow`, 100 rows") && text.contains("1899-01-01T00:00:00Z"), "{text}");
    assert!(text.contains("Numbers of states that were tried") && text.contains("Nothing was written"), "{text}");
}

#[test]
fn a_model_and_states_are_written_and_not_over_others() {
    let folder = tempfile::tempdir().unwrap();
    let nile = nile();
    let arguments = [nile.to_str().unwrap(), "--states", "2", "--out", "found"];
    assert_eq!(run(folder.path(), &arguments).status.code(), Some(0));
    let text = std::fs::read_to_string(folder.path().join("found/model.toml")).unwrap();
    let model: trueup::sim2real::regime::HiddenMarkov = toml::from_str(&text).unwrap();
    assert_eq!(model.states(), 2);
    let table = trueup::io::Table::read(folder.path().join("found/states.parquet")).unwrap();
    assert_eq!(table.names(), ["ts", "value", "state", "by_then_0", "by_then_1"]);
    assert_eq!(table.rows(), 100);
    let page = std::fs::read_to_string(folder.path().join("found/report.html")).unwrap();
    assert!(page.contains("flow: 2 states and") && page.contains("1899-01-01T00:00:00Z") && !page.contains("NaN"), "{page}");
    let refused = run(folder.path(), &arguments);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--force"));
    let again: Vec<&str> = arguments.into_iter().chain(["--force"]).collect();
    assert_eq!(run(folder.path(), &again).status.code(), Some(0));
}

/// Prices that double and halve, by hand; and lost ones.
#[test]
fn returns_are_of_logarithms() {
    let folder = tempfile::tempdir().unwrap();
    let prices = (0..40).map(|k| if k % 7 == 6 { String::new() } else { (100 << (k % 2)).to_string() });
    let text = format!("t,close,volume\n{}", prices.enumerate().map(|(k, p)| format!("{k},{p},1\n")).collect::<String>());
    std::fs::write(folder.path().join("prices.csv"), text).unwrap();
    let found = json(&run(folder.path(), &["prices.csv", "--returns", "--states", "1", "--json"]));
    assert_eq!((&found["column"], &found["rows"]), (&"close".into(), &39.into()));
    let std = found["states"][0]["std"].as_f64().unwrap();
    assert!((std - 2.0_f64.ln()).abs() < 0.02, "{std}");
    std::fs::write(folder.path().join("zero.csv"), "t,close\n0,1\n1,0\n2,3\n").unwrap();
    let told = run(folder.path(), &["zero.csv", "--returns"]);
    let told = String::from_utf8_lossy(&told.stderr).into_owned();
    assert!(told.contains("zero.csv: row 3, column `close`") && told.contains("hint:"), "{told}");
}

#[test]
fn what_it_refuses() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("two.csv", "a,b\n1,2\n2,3\n");
    write("constant.csv", &format!("x\n{}", "5\n".repeat(50)));
    write("coin.csv", &format!("x\n{}", "0\n1\n".repeat(25)));
    write("short.csv", "x\n1\n2\n");
    for (arguments, told) in [
        (vec!["two.csv"], "which column is the series"),
        (vec!["two.csv", "--column", "c"], "`c`"),
        (vec!["constant.csv"], "is 5 throughout"),
        (vec!["coin.csv", "--states", "3"], "3 states of a series that has 2 different values"),
        (vec!["short.csv"], "2 samples, where at least"),
        (vec!["coin.csv", "--states", "0"], "expected `auto` or a whole number from 1 to 50"),
        (vec!["missing.csv"], "missing.csv"),
    ] {
        let ran = run(folder.path(), &arguments);
        let error = String::from_utf8_lossy(&ran.stderr).into_owned();
        assert_eq!(ran.status.code(), Some(2), "{arguments:?}: {error}");
        assert!(error.contains(told), "{arguments:?}: {error}");
    }
}
