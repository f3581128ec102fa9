//! `trueup env` as its users meet it.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop where it fails")]

use assert_cmd::Command;
use serde_json::Value;

fn run(arguments: &str) -> (i32, String, String) {
    let output = Command::new(assert_cmd::cargo::cargo_bin!("trueup"))
        .args(arguments.split_whitespace())
        .env_remove("RUST_BACKTRACE")
        .output()
        .unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn environments_are_listed_for_people_and_programs() {
    let (code, out, err) = run("env list --json");
    assert_eq!((code, err.as_str()), (0, ""));
    let listing: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(listing["schema"], "trueup.environments/1");
    let rows = listing["environments"].as_array().unwrap();
    let ids: Vec<&str> = rows.iter().map(|row| row["id"].as_str().unwrap()).collect();
    for name in ["CartPole", "Pendulum", "Servo", "Trade", "Execute", "MakeMarket"] {
        assert_eq!(ids.iter().filter(|id| **id == format!("trueup/{name}-v0")).count(), 1, "{ids:?}");
    }
    for row in rows {
        assert!(!row["title"].as_str().unwrap().is_empty() && !row["observation"].as_array().unwrap().is_empty());
        assert!(["box", "discrete", "multi_discrete"].contains(&row["action"]["kind"].as_str().unwrap()), "{row}");
        for option in row["options"].as_array().unwrap() {
            assert!(!option["meaning"].as_str().unwrap().is_empty(), "{option}");
            assert!(["make", "reset"].contains(&option["at"].as_str().unwrap()));
        }
    }
    let cart_pole = rows.iter().find(|row| row["id"] == "trueup/CartPole-v0").unwrap();
    assert_eq!(cart_pole["action"]["n"], 2);
    let (code, table, _) = run("env list");
    assert_eq!(code, 0);
    assert!(table.lines().all(|line| line.chars().count() <= 110), "{table}");
    assert!(table.trim_start().starts_with("environment"), "{table}");
}

#[test]
fn a_bench_tells_the_median_and_the_spread() {
    for (arguments, lanes) in [("env bench CartPole-v0", 1), ("env bench trueup/Pendulum-v0 --lanes 64 --threads 2", 64)] {
        let (code, out, err) = run(&format!("{arguments} --rounds 3 --seconds 0.01 --json"));
        assert_eq!((code, err.as_str()), (0, ""), "{arguments}");
        let measured: Value = serde_json::from_str(&out).unwrap();
        assert_eq!((&measured["schema"], &measured["lanes"]), (&"trueup.env_bench/1".into(), &lanes.into()));
        let [least, median, most] = ["least", "median", "most"].map(|key| measured["ns_per_step"][key].as_f64().unwrap());
        assert!(0.0 < least && least <= median && median <= most);
        assert!((measured["steps_per_second"].as_f64().unwrap() * median / 1e9 - 1.0).abs() < 1e-9);
        assert!(measured["steps"].as_u64().unwrap() > 0);
    }
    let (code, out, err) =
        run("env bench Trade-v0 --run data/bars/run.toml --set length=0 --rounds 1 --seconds 0.01 --json");
    assert_eq!((code, err.as_str()), (0, ""));
    assert_eq!(serde_json::from_str::<Value>(&out).unwrap()["id"], "trueup/Trade-v0");
    let (code, out, _) = run("env bench CartPole-v0 --rounds 1 --seconds 0.01");
    assert!(code == 0 && out.starts_with("trueup/CartPole-v0: ") && out.contains(" ns a step ("), "{out}");
}

#[test]
fn what_cannot_be_benched_is_refused_with_a_hint() {
    for (arguments, part) in [
        ("CartPol-v0", "CartPol-v0: there is no environment of this id\n  hint: did you mean `trueup/CartPole-v0`?"),
        ("CartPole-v0 --set nonsense", "--set: expected NAME=VALUE, found \"nonsense\""),
        ("CartPole-v0 --set nonsense=1", "--set: `trueup/CartPole-v0` has no such option"),
        ("Trade-v0 --set length=long", "--set: the value cannot be read, found \"length=long\"\n  hint: "),
        ("Trade-v0 --set length=-1", "option `length` is -1, and must be a whole number"),
        ("CartPole-v0 --run data/bars/run.toml", "--run: `trueup/CartPole-v0` is in no market\n  hint: "),
        ("Trade-v0 --run data/no.toml", "data/no.toml: "),
        ("Trade-v0 --run data/bars/run.toml --set rows=100", "`trueup/Trade-v0` has no option `rows`"),
        ("CartPole-v0 --seconds 0", "--seconds: a round cannot be this long, found 0"),
        ("CartPole-v0 --seconds NaN", "--seconds: a round cannot be this long, found NaN"),
    ] {
        let (code, out, err) = run(&format!("env bench {arguments}"));
        assert_eq!((code, out.as_str()), (2, ""), "{arguments}: {err}");
        assert!(err.contains(part), "{arguments}: {err}");
    }
    assert_eq!(run("env bench CartPole-v0 --lanes 0").0, 2);
}
