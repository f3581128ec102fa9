//! `trueup data import` as its users meet it: what is printed, what is written, and what is refused.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;
use trueup::market::paper::import::FORMATS;

/// A folder with a copy of a sample, and what the command did there: exit code, output, errors.
struct Scene(TempDir);

impl Scene {
    fn new(samples: &[&str]) -> Self {
        let folder = TempDir::new().unwrap();
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/io/paper_samples");
        for name in samples {
            fs::copy(source.join(name), folder.path().join(name)).unwrap();
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, arguments: &str) -> (i32, String, String) {
        let mut command = Command::cargo_bin("trueup").unwrap();
        let words = format!("data import {arguments}");
        let output = command.current_dir(&self.0).args(words.split_whitespace()).output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

#[test]
fn a_log_is_told_and_nothing_is_written_unasked() {
    let scene = Scene::new(&["alpaca_orders.json", "alpaca_activities.json"]);
    let (code, out, err) = scene.run("alpaca_orders.json alpaca_activities.json");
    assert_eq!((code, err.as_str()), (0, ""));
    insta::assert_snapshot!("told", out);
    assert_eq!(scene.names(), ["alpaca_activities.json", "alpaca_orders.json"]);
}

#[test]
fn tables_and_findings_are_written_once_and_read_again() {
    let scene = Scene::new(&["flex.xml"]);
    let import = "flex.xml --zone America/New_York --out log";
    let (code, _, err) = scene.run(import);
    assert_eq!((code, err.as_str()), (0, ""));
    let files = ["orders.parquet", "fills.parquet", "findings.json"].map(|name| scene.path("log").join(name));
    let written = files.each_ref().map(|path| fs::read(path).unwrap());
    let findings: Value = serde_json::from_slice(&written[2]).unwrap();
    assert_eq!((&findings["schema"], &findings["format"]), (&"trueup.paper_log/1".into(), &"ibkr_flex".into()));
    assert_eq!(findings["findings"][0]["kind"], "unread_row");
    assert_eq!(findings["findings"][0]["findings"][0]["place"]["column"], "tradePrice");
    // What is there is replaced when that is asked for, and then by the same.
    let (code, out, err) = scene.run(import);
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.contains("orders.parquet: the file exists already") && err.contains("--force"), "{err}");
    assert_eq!(scene.run(&format!("{import} --force")).0, 0);
    assert_eq!(files.each_ref().map(|path| fs::read(path).unwrap()), written);
    let (code, out, _) = scene.run("log --json");
    let again: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, &again["format"], &again["orders"], &again["fills"]), (0, &"trueup".into(), &2.into(), &3.into()));
    // A diagnosis reads them, and misses no column.
    assert_eq!(again["span"], findings["span"]);
}

#[test]
fn every_format_is_named_by_the_help_and_described() {
    let (_, help, _) = Scene::new(&[]).run("--help");
    let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/paper_logs.md")).unwrap();
    for format in FORMATS {
        assert!(words.contains(format.id), "{}", format.id);
        assert!(page.contains(&format!("### `{}`\n", format.id)), "{}", format.id);
    }
}

#[test]
fn what_cannot_be_meant_is_refused_with_a_remedy() {
    let scene = Scene::new(&["flex.xml", "ccxt_orders.json"]);
    fs::write(scene.path("symbols.toml"), "[symbol]\n").unwrap();
    let mut told = String::new();
    for arguments in [
        "flex.xml",
        "flex.xml --zone America/NewYork",
        "flex.xml --zone America/New_York --fee-rate CHF=1",
        "flex.xml --format ibkr",
        "ccxt_orders.json --format freqtrade",
        "ccxt_orders.json --symbols symbols.toml",
        "missing.json",
        "",
    ] {
        let (code, out, err) = scene.run(&format!("{arguments} --out log"));
        assert_eq!((code, out.as_str()), (2, ""), "{arguments}");
        told += &format!("$ trueup data import {arguments}\n{err}\n");
    }
    insta::assert_snapshot!("refused", told);
    assert_eq!(scene.names(), ["ccxt_orders.json", "flex.xml", "symbols.toml"]);
}

const TAPE: &str = "ts,order_id,action,side,price,size\n\
    1000000000,1,add,ask,101,1\n1000000000,2,add,ask,102,2\n1000000000,4,add,bid,99,9\n\
    2000000000,9,add,bid,110,2.5\n2000000000,1,delete,ask,101,0\n2000000000,9,change,bid,110,1.5\n\
    2000000000,2,change,ask,102,0.5\n2000000000,9,delete,bid,110,0\n3000000000,10,add,bid,102,0.5\n\
    3500000000,7,delete,bid,98,0\n9000000000,11,add,bid,98,1\n";

#[test]
fn the_orders_of_a_tape_are_told_and_written_with_a_twin() {
    let scene = Scene::new(&[]);
    fs::write(scene.path("events.csv"), TAPE).unwrap();
    let (code, told, err) = scene.run("--tape events.csv");
    assert_eq!((code, err.as_str(), scene.names()), (0, "", vec!["events.csv".to_owned()]));
    let (code, out, err) = scene.run("--tape events.csv --symbol XYZ --out tape");
    assert_eq!((code, err.as_str()), (0, ""));
    insta::assert_snapshot!("tape", format!("{told}\n{out}"));
    let (code, out, err) = scene.run("--tape events.csv --out tape");
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.contains("orders.parquet: the file exists already") && err.contains("--force"), "{err}");
    let (code, json, _) = scene.run("--tape events.csv --out tape --force --json");
    let findings: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((code, &findings["schema"], &findings["counts"]["orders"]), (0, &"trueup.tape_orders/1".into(), &1.into()));
    assert_eq!((&findings["left_out"][0]["reason"], &findings["written"]), (&"not_executed".into(), &1.into()));
    let (_, json, _) = scene.run("--tape events.csv --json");
    let counted: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&counted["counts"], counted.get("written")), (&findings["counts"], None), "nothing was written");
}

#[test]
fn what_cannot_be_meant_of_a_tape_is_refused_with_a_remedy() {
    let scene = Scene::new(&[]);
    fs::write(scene.path("events.csv"), TAPE).unwrap();
    fs::write(scene.path("nobody.csv"), TAPE.lines().take(4).collect::<Vec<_>>().join("\n")).unwrap();
    let mut told = String::new();
    for arguments in [
        "--tape nobody.csv",
        "--tape events.csv --min-size 100",
        "--tape events.csv --min-size 0",
        "--tape events.csv --levels 11",
        "--tape events.csv --every 2 --at-most 5",
        "--tape events.csv --every 0",
        "--tape events.csv --apart soon",
        "--tape events.csv --start 2020-01-01T00:00:00Z --end 2019-01-01T00:00:00Z",
        "--tape events.csv --start yesterday",
        "--tape events.csv --zone Europe/Berlin",
        "events.csv --symbol XYZ",
    ] {
        let (code, out, err) = scene.run(&format!("{arguments} --out tape"));
        assert_eq!((code, out.as_str()), (2, ""), "{arguments}");
        told += &format!("$ trueup data import {arguments}\n{err}\n");
    }
    insta::assert_snapshot!("tape_refused", told);
    assert_eq!(scene.names(), ["events.csv", "nobody.csv"]);
}
