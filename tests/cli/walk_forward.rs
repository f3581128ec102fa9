//! Walk-forward as its users meet it: nothing of a test reaches its choice, and a test begins with the past and no more.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fmt::Write as _;
use std::fs;

use crate::command_scene::Folder;
use serde_json::Value;
use trueup::io::Table;

const HOUR: i64 = 3_600_000_000_000;
const DAY: i64 = 24 * HOUR;

/// Hourly bars of forty days; from hour `changed` on another walk goes on.
fn bars(changed: Option<i64>) -> String {
    let mut text = "ts,open,high,low,close,volume\n".to_owned();
    let (mut state, mut close) = (11_u64, 100.0);
    for hour in 0..960 {
        if Some(hour) == changed {
            state ^= 0x5555_5555_5555;
        }
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let open: f64 = close;
        close =
            (open * (1.0 + 0.004 * (((state >> 33) % 201) as f64 / 100.0 - 1.0 + 0.3 * (hour as f64 / 37.0).sin())) * 100.0)
                .round()
                / 100.0;
        let (high, low) = (open.max(close), open.min(close));
        writeln!(text, "{},{open},{high},{low},{close},1000", hour * HOUR).unwrap();
    }
    text
}

const RUN: &str = "
[run]
seed = 7
cash = 1_000_000
currency = 'USD'
[[instrument]]
symbol = 'XYZ'
tick_size = 0.01
[[data]]
symbol = 'XYZ'
bars = 'bars.csv'
stamp = 'open'
interval = '1h'
[strategy]
kind = 'sma_cross'
fast = 3
slow = 30
short = true
[[mechanism]]
name = 'half_spread'
bps = 1.0
";

const SWEEP: &str = "
[sweep]
metric = 'total_return'
[sweep.ranges]
'strategy.fast' = [2, 5, 12, 25]
'strategy.slow' = [24, 30, 40]
[sweep.walk_forward]
train = '16d'
test = '6d'
purge = '1d'
embargo = '12h'
";

fn scene(sweep: &str, changed: Option<i64>) -> Folder {
    Folder::with(&[("bars.csv", &bars(changed)), ("run.toml", &format!("{RUN}{sweep}"))])
}

fn windows(found: &Value) -> &Vec<Value> {
    found["windows"].as_array().unwrap()
}

#[test]
fn no_choice_knows_its_test() {
    let as_it_is = scene(SWEEP, None).json("walk-forward run.toml");
    let starts: Vec<i64> = windows(&as_it_is).iter().map(|w| w["test_start"].as_i64().unwrap()).collect();
    assert_eq!(starts, [17 * DAY + 13 * HOUR, 23 * DAY + 13 * HOUR, 29 * DAY + 13 * HOUR, 35 * DAY + 13 * HOUR]);
    for (k, start) in starts.iter().enumerate() {
        let end = windows(&as_it_is)[k]["train_end"].as_i64().unwrap();
        assert_eq!(start - end, 36 * HOUR, "purge and embargo");
        // What is known from the end of the training on is another walk: all that goes into the choices before stays.
        let other = scene(SWEEP, Some(end / HOUR)).json("walk-forward run.toml");
        for (now, then) in windows(&other).iter().zip(windows(&as_it_is)).take(k + 1) {
            assert_eq!(now["chosen"], then["chosen"], "window {k}");
        }
        assert_ne!(windows(&other)[k]["out_of_sample"], windows(&as_it_is)[k]["out_of_sample"]);
    }
    let choices: std::collections::BTreeSet<u64> =
        windows(&as_it_is).iter().map(|w| w["chosen"]["run"].as_u64().unwrap()).collect();
    assert!(choices.len() > 1, "the same everywhere would show nothing");
}

#[test]
fn a_choice_is_the_best_of_a_sweep_of_its_training() {
    let scene = scene(SWEEP, None);
    let found = scene.json("walk-forward run.toml");
    let window = &windows(&found)[1];
    // Bars known from start on, and before end.
    let between = "cash = 1_000_000\nstart = '1970-01-07T01:00:00Z'\nend = '1970-01-23T01:00:00Z'";
    assert_eq!(
        [&window["train_start"], &window["train_end"]].map(|t| t.as_i64().unwrap()),
        [6 * DAY + HOUR, 22 * DAY + HOUR]
    );
    fs::write(scene.path("train.toml"), format!("{RUN}{SWEEP}").replace("cash = 1_000_000", between)).unwrap();
    let sweep = scene.json("sweep train.toml");
    assert_eq!(sweep["best"][0]["values"], window["chosen"]["values"]);
    assert_eq!(sweep["best"][0]["value"], window["chosen"]["value"]);
}

#[test]
fn tests_in_a_row_are_one_account_that_begins_flat() {
    let scene = scene(SWEEP, None);
    let found = scene.json("walk-forward run.toml --out w");
    let mut cash = 1e6;
    for window in windows(&found) {
        let figure = |name: &str| window["out_of_sample"][name].as_f64().unwrap();
        assert_eq!(figure("initial_equity"), cash);
        cash = figure("final_equity");
    }
    assert_eq!(found["out_of_sample"]["final_equity"].as_f64(), Some(cash));
    let table = Table::read(scene.path("w/equity.parquet")).unwrap();
    let equity = table.floats_complete("equity").unwrap();
    // From the first test to the end of the data, one point an hour.
    assert_eq!(equity.len(), 960 - (17 * 24 + 13) + 1);
    assert_eq!(equity[0], 1e6);
    // Thirty bars and more before the first decision without the past; with it the first test trades at once.
    assert!(equity[..20].iter().any(|e| *e != 1e6), "{:?}", &equity[..20]);
    let page = fs::read_to_string(scene.path("w/report.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("Windows") && !page.contains("NaN"));
    assert_eq!(Table::read(scene.path("w/windows.parquet")).unwrap().floats_complete("in_sample").unwrap().len(), 4);
}

/// A strategy that looks back on nothing needs no past: its test is a backtest of that time.
#[test]
fn a_test_is_a_backtest_of_its_time() {
    let sweep = "[sweep]\nmetric = 'total_return'\n[sweep.ranges]\n'strategy.weight' = [0.5]\n[sweep.walk_forward]\ntrain = '16d'\ntest = '10d'\n";
    let hold = |text: &str| {
        text.replace("kind = 'sma_cross'\nfast = 3\nslow = 30\nshort = true", "kind = 'buy_and_hold'\nweight = 0.5")
    };
    let scene = scene(sweep, None);
    fs::write(scene.path("run.toml"), hold(&format!("{RUN}{sweep}"))).unwrap();
    let found = scene.json("walk-forward run.toml");
    let between = "cash = 1_000_000\nstart = '1970-01-17T01:00:00Z'\nend = '1970-01-27T01:00:00Z'";
    fs::write(scene.path("test.toml"), hold(&RUN.replace("cash = 1_000_000", between))).unwrap();
    let alone = scene.json("backtest test.toml");
    for name in ["total_return", "turnover", "exposure", "final_equity"] {
        assert_eq!(alone["metrics"][name], windows(&found)[0]["out_of_sample"][name], "{name}");
    }
}

#[test]
fn a_walk_is_the_same_at_any_number_of_threads_and_is_told_in_a_table() {
    let scene = scene(SWEEP, None);
    assert_eq!(scene.json("walk-forward run.toml --threads 1"), scene.json("walk-forward run.toml --threads 3"));
    let (code, out, err) = scene.run("walk-forward run.toml");
    assert_eq!((code, err.as_str()), (0, ""));
    insta::assert_snapshot!("told", out);
    insta::assert_snapshot!("help", scene.run("walk-forward --help").1);
}

#[test]
fn what_cannot_be_walked_is_said_with_place_and_remedy() {
    let mut said = String::new();
    for (from, to) in [
        ("train = '16d'", "train = '60d'"),
        ("train = '16d'", "train = '0d'"),
        ("train = '16d'", "train = 'long'"),
        ("test = '6d'", "tset = '6d'"),
        ("metric = 'total_return'", "metric = 'sharpe'"),
        ("[sweep.walk_forward]\ntrain = '16d'\ntest = '6d'\npurge = '1d'\nembargo = '12h'\n", ""),
    ] {
        assert!(SWEEP.contains(from));
        let scene = scene(&SWEEP.replace(from, to), None);
        let (code, out, err) = scene.run("walk-forward run.toml --out w");
        assert_eq!((code, out.as_str()), (2, ""), "{err}");
        assert!(err.contains("\n  hint: ") && !scene.path("w").exists(), "{err}");
        said += &err;
    }
    insta::assert_snapshot!("refused", said);
}
