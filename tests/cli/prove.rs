//! The blind benchmark from outside: seals before answers, and an interruption that changes nothing.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;
use sha2::{Digest, Sha256};
use tempfile::TempDir;

fn trueup(folder: &Path, line: &str) -> (i32, String, String) {
    let mut command = Command::cargo_bin("trueup").unwrap();
    let ran = command.current_dir(folder).args(line.split_whitespace()).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (ran.status.code().unwrap(), text(ran.stdout), text(ran.stderr))
}

/// A journal without the times, which are of no two runs the same.
fn timeless(path: &Path) -> Vec<Value> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    for trial in lines.iter_mut().filter_map(|line| line.get_mut("trial")) {
        trial["seconds"] = Value::Null;
    }
    lines
}

fn timeless_summary(path: &Path) -> Value {
    let mut summary: Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    summary["figures"].as_array_mut().unwrap().retain(|figure| figure["name"] != "time of a diagnosis");
    summary
}

#[test]
fn a_run_that_was_cut_short_goes_on_to_the_same_end() {
    let root = TempDir::new().unwrap();
    let folder = root.path();
    let (code, out, err) = trueup(folder, "prove --cases 3 --seed 1 --out whole --keep");
    assert_eq!(code, 0, "{err}");
    for name in ["cases.jsonl", "summary.json", "figures.md", "README.md", "report.html"] {
        assert!(folder.join("whole").join(name).is_file() && out.contains(name), "{name}");
    }

    // The seals stand in the first line, and each label fits its own.
    let lines = timeless(&folder.join("whole/cases.jsonl"));
    assert_eq!((lines.len(), lines[0]["seed"].as_u64()), (4, Some(1)));
    let mut seals = String::new();
    for (line, seal) in lines[1..].iter().zip(lines[0]["seals"].as_array().unwrap()) {
        let sealed = format!("{}{}", line["salt"].as_str().unwrap(), line["label"].as_str().unwrap());
        let hash: String = Sha256::digest(sealed).iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(seal.as_str().unwrap(), hash);
        seals += &hash;
    }
    let all: String = Sha256::digest(seals).iter().map(|byte| format!("{byte:02x}")).collect();
    let told = out.find(&all).unwrap();
    assert!(told < out.find("Figures").unwrap(), "the seal is told before any figure");

    // What is kept is what a user would bring.
    let (code, _, err) = trueup(
        &folder.join("whole/cases/002"),
        "calibrate twin.toml --recording train.csv --holdout test.csv --out calibrated.toml",
    );
    assert_eq!(code, 0, "{err}");
    let label = fs::read_to_string(folder.join("whole/cases/002/label.json")).unwrap();
    assert_eq!(label.trim_end(), lines[3]["label"].as_str().unwrap());

    // Killed while it wrote the last line.
    let text = fs::read_to_string(folder.join("whole/cases.jsonl")).unwrap();
    let last = text.trim_end().rfind('\n').unwrap() + 1;
    fs::create_dir(folder.join("cut")).unwrap();
    fs::write(folder.join("cut/cases.jsonl"), &text[..last + 200]).unwrap();
    let (code, out, err) = trueup(folder, "prove --cases 3 --seed 1 --out cut --threads 1");
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.contains("--resume goes on with it"), "{err}");
    let (code, _, err) = trueup(folder, "prove --cases 3 --seed 2 --out cut --resume");
    assert!(code == 2 && err.contains("holds 3 cases of seed 1"), "{err}");
    let (code, out, err) = trueup(folder, "prove --cases 3 --seed 1 --out cut --resume --threads 1");
    assert!(code == 0 && out.contains("2 of them diagnosed already"), "{out}{err}");
    assert_eq!(timeless(&folder.join("cut/cases.jsonl")), lines);
    let done = fs::read_to_string(folder.join("cut/cases.jsonl")).unwrap();
    assert!(done.starts_with(&text[..last]), "what was done is as it was, to the byte");
    let summaries = ["whole", "cut"].map(|name| timeless_summary(&folder.join(name).join("summary.json")));
    assert_eq!(summaries[0], summaries[1]);

    // A label that is changed after the fact is found out.
    fs::remove_file(folder.join("cut/summary.json")).unwrap();
    let forged = done.replacen("\\\"snr\\\":", "\\\"snr\\\":1", 1);
    fs::write(folder.join("cut/cases.jsonl"), forged).unwrap();
    fs::create_dir(folder.join("forged")).unwrap();
    fs::rename(folder.join("cut/cases.jsonl"), folder.join("forged/cases.jsonl")).unwrap();
    let (code, _, err) = trueup(folder, "prove --cases 3 --seed 1 --out forged --resume");
    assert!(code == 2 && err.contains("case 0: the label is not the one that was sealed"), "{err}");
}

/// Markets are sealed, diagnosed and taken up again as joints are, and what is kept is what a user would bring.
#[test]
fn a_benchmark_of_markets_goes_on_to_the_same_end_and_keeps_what_a_user_would_bring() {
    let root = TempDir::new().unwrap();
    let folder = root.path();
    let (code, out, err) = trueup(folder, "prove --domain market --cases 2 --seed 1 --out whole --keep");
    assert!(code == 0 && out.contains("stays or fades") && out.contains("mids alone"), "{out}{err}");
    let lines = timeless(&folder.join("whole/cases.jsonl"));
    assert_eq!((lines.len(), lines[0]["domain"].as_str()), (3, Some("market")));

    // The same log from files as from memory: what is said of it is the same to the last digit.
    let kept = folder.join("whole/cases/000");
    let (code, out, err) = trueup(&kept, "diagnose twin.toml --recording train --holdout test --json");
    assert_eq!(code, 0, "{err}");
    let said: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(said["verdict"], lines[1]["trial"]["verdict"]);
    let names = |effects: &Value, key: &str| -> Vec<String> {
        effects.as_array().unwrap().iter().map(|effect| effect[key].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(names(&said["effects"], "mechanism"), names(&lines[1]["trial"]["found"], "mechanism"));
    let cost = said["fit"].as_array().unwrap().iter().find(|fit| fit["channel"] == "cost").unwrap();
    assert_eq!(cost["trued_rmse"], lines[1]["trial"]["held_out"]["trued"]);
    let label = fs::read_to_string(kept.join("label.json")).unwrap();
    assert_eq!(label.trim_end(), lines[1]["label"].as_str().unwrap());
    let twin = fs::read_to_string(kept.join("twin.toml")).unwrap();
    assert!(!twin.contains("mechanism") && !twin.contains("live") && !twin.contains("paper"), "twins do not tell: {twin}");

    // A run of joints is not taken up as one of markets.
    let text = fs::read_to_string(folder.join("whole/cases.jsonl")).unwrap();
    let last = text.trim_end().rfind('\n').unwrap() + 1;
    fs::create_dir(folder.join("cut")).unwrap();
    fs::write(folder.join("cut/cases.jsonl"), &text[..last + 200]).unwrap();
    let (code, _, err) = trueup(folder, "prove --domain robot --cases 2 --seed 1 --out cut --resume");
    assert!(code == 2 && err.contains("holds cases of another domain: market"), "{err}");
    let (code, out, err) = trueup(folder, "prove --domain market --cases 2 --seed 1 --out cut --resume --threads 1");
    assert!(code == 0 && out.contains("1 of them diagnosed already"), "{out}{err}");
    assert_eq!(timeless(&folder.join("cut/cases.jsonl")), lines);
}

#[test]
fn what_cannot_be_proved_is_said() {
    let root = TempDir::new().unwrap();
    let (code, out, err) = trueup(root.path(), "prove --domain weather");
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.contains("weather") && err.contains("market"), "{err}");
    let (code, _, err) = trueup(root.path(), "prove --cases 0");
    assert!(code == 2 && err.contains("--cases"), "{err}");
    let (code, _, err) = trueup(root.path(), "prove --resume --force");
    assert!(code == 2 && err.contains("--force"), "{err}");
    fs::write(root.path().join("file"), "").unwrap();
    let (code, _, err) = trueup(root.path(), "prove --cases 1 --out file");
    assert!(code == 2 && err.contains("expected a folder"), "{err}");
    assert_eq!(fs::read_dir(root.path()).unwrap().count(), 1, "nothing was written");
}
