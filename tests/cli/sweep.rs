//! Sweeps as their users meet them: what is tried, what is written, and that nothing but the values decides.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fs;
use std::path::Path;

use crate::command_scene::Folder;
use trueup::io::Table;

/// A folder with the bars of the examples and a run that ends with `sweep`.
fn scene(sweep: &str) -> Folder {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join("bars");
    let run = fs::read_to_string(source.join("run.toml")).unwrap();
    let folder = Folder::with(&[("run.toml", &format!("{run}\n{sweep}"))]);
    fs::copy(source.join("bars.parquet"), folder.path("bars.parquet")).unwrap();
    folder
}

const GRID: &str = "
[sweep]
metric = 'total_return'
[sweep.ranges]
'strategy.fast' = { from = 5, to = 20, step = 5 }
'strategy.slow' = [15, 40]
mechanism.half_spread.bps = { from = 0.5, to = 2.0, log = true, count = 2 }
";

#[test]
fn a_grid_is_tried_whole_and_each_run_is_what_a_backtest_of_it_is() {
    let scene = scene(GRID);
    let found = scene.json("sweep run.toml --out s");
    let count = |key: &str| found[key].as_u64().unwrap();
    // 4 x 2 x 2 runs; with slow = 15, fast may be 5 and 10 only.
    assert_eq!([count("runs"), count("done"), count("invalid"), count("failed")], [16, 12, 4, 0]);
    assert_eq!((found["schema"].as_str(), found["deflated_sharpe"].is_null()), (Some("trueup.sweep/1"), true));
    let best = &found["best"][0];
    let values = &best["values"];
    let run = fs::read_to_string(scene.path("run.toml")).unwrap();
    let run = run
        .replace("fast = 10", &format!("fast = {}", values["strategy.fast"]))
        .replace("slow = 50", &format!("slow = {}", values["strategy.slow"]))
        .replace("bps = 1.0", &format!("bps = {}", values["mechanism.half_spread.bps"]));
    fs::write(scene.path("best.toml"), run).unwrap();
    let alone = scene.json("backtest best.toml");
    assert_eq!(alone["metrics"]["total_return"].as_f64(), best["value"].as_f64(), "{best}");
    assert_eq!(alone["metrics"]["costs"]["fees"].as_f64(), best["metrics"]["costs.fees"].as_f64());

    let table = Table::read(scene.path("s/sweep.parquet")).unwrap();
    let returns = table.floats("total_return").unwrap();
    assert_eq!((returns.len(), returns.iter().flatten().count()), (16, 12));
    let largest = returns.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
    assert_eq!(Some(largest), best["value"].as_f64());
    let page = String::from_utf8(scene.bytes("s/report.html")).unwrap();
    assert!(page.contains("class=\"heat\"") && page.contains("<svg") && !page.contains("NaN"));
}

#[test]
fn a_sweep_is_the_same_at_any_number_of_threads_and_when_it_goes_on() {
    let scene = scene(GRID);
    let first = scene.run("sweep run.toml --out a --threads 1");
    assert_eq!((first.0, scene.run("sweep run.toml --out b --threads 3").0), (0, 0), "{}", first.2);
    for name in ["sweep.parquet", "sweep.json", "report.html"] {
        assert_eq!(scene.bytes(&format!("a/{name}")), scene.bytes(&format!("b/{name}")), "{name}");
    }
    // Killed in the middle of the seventh line.
    let text = String::from_utf8(scene.bytes("a/sweep.jsonl")).unwrap();
    let ends: Vec<usize> = text.match_indices('\n').map(|(at, _)| at + 1).collect();
    assert_eq!(ends.len(), 17);
    fs::create_dir(scene.path("c")).unwrap();
    fs::write(scene.path("c/sweep.jsonl"), &text[..ends[6] + 20]).unwrap();
    let err = scene.refused("sweep run.toml --out c");
    assert!(err.contains("--resume goes on with it"), "{err}");
    assert_eq!(scene.run("sweep run.toml --out c --resume").0, 0);
    assert_eq!(scene.bytes("a/sweep.parquet"), scene.bytes("c/sweep.parquet"));
    assert_eq!(scene.bytes("a/sweep.json"), scene.bytes("c/sweep.json"));
    // What was done is taken from the journal and not run again.
    let forged = text.replacen("\"total_return\":", "\"total_return\":1e3,\"was\":", 1);
    fs::create_dir(scene.path("d")).unwrap();
    fs::write(scene.path("d/sweep.jsonl"), &forged).unwrap();
    assert_eq!(scene.json("sweep run.toml --out d --resume")["best"][0]["value"].as_f64(), Some(1e3));
    // Another sweep is not gone on with.
    let run = fs::read_to_string(scene.path("run.toml")).unwrap();
    fs::write(scene.path("run.toml"), run.replace("[15, 40]", "[15, 41]")).unwrap();
    fs::create_dir(scene.path("e")).unwrap();
    fs::write(scene.path("e/sweep.jsonl"), &text).unwrap();
    assert!(scene.refused("sweep run.toml --out e --resume").contains("holds another sweep"));
}

#[test]
fn draws_do_not_depend_on_how_many_there_are() {
    let random = |runs: usize| {
        format!(
            "[sweep]\nmethod = 'random'\nruns = {runs}\nseed = 5\nmetric = 'total_return'\n[sweep.ranges]\n'strategy.fast' = {{ from = 2, to = 20 }}\n'mechanism.half_spread.bps' = {{ from = 0.1, to = 10.0, log = true }}\n"
        )
    };
    let column = |runs: usize, name: &str| {
        let scene = scene(&random(runs));
        assert_eq!(scene.run("sweep run.toml --out s").0, 0);
        Table::read(scene.path("s/sweep.parquet")).unwrap().floats(name).unwrap()
    };
    for name in ["strategy.fast", "mechanism.half_spread.bps", "total_return"] {
        let (few, many) = (column(5, name), column(9, name));
        assert_eq!(few[..], many[..5], "{name}");
    }
    let spreads = column(9, "mechanism.half_spread.bps");
    assert!(spreads.iter().flatten().all(|bps| (0.1..=10.0).contains(bps)));
}

#[test]
fn kinds_of_strategies_keep_their_own_parameters() {
    let scene = scene(
        "[sweep]\nmetric = 'total_return'\n[sweep.ranges]\n'strategy.kind' = ['sma_cross', 'buy_and_hold']\n'strategy.fast' = [5, 10]\n'strategy.weight' = [0.5, 0.9]\n",
    );
    let found = scene.json("sweep run.toml --out s");
    // Four of one, and two of the other, which has no averages.
    assert_eq!((found["runs"].as_u64(), found["done"].as_u64()), (Some(6), Some(6)));
}

#[test]
fn a_backtest_has_no_use_for_the_section() {
    let (with, without) = (scene(GRID), scene(""));
    assert_eq!(with.json("backtest run.toml")["metrics"], without.json("backtest run.toml")["metrics"]);
}

#[test]
fn what_cannot_be_swept_over_is_said_with_place_and_remedy() {
    let mut said = String::new();
    for (metric, ranges) in [
        ("metric = 'total_return'", "'strategy.fsat' = [1, 2]"),
        ("metric = 'total_return'", "'strategy.fast' = []"),
        ("metric = 'total_return'", "'strategy.fast' = 5"),
        ("metric = 'total_return'", "'strategy.fast' = { from = 9, to = 3 }"),
        ("metric = 'total_return'", "'strategy.fast' = { from = 'a', to = 3 }"),
        ("metric = 'total_return'", "'strategy.fast' = { from = 1, to = 3, stepp = 1 }"),
        ("metric = 'total_return'", "'strategy.fast' = [1.5, 2.5]"),
        ("metric = 'total_return'", "'strategy.kind' = ['sma_corss']"),
        ("metric = 'total_return'", "'strategy.weight' = { from = 0.1, to = 0.9 }"),
        ("metric = 'total_return'", "'mechanism.half_spred.bps' = [1.0]"),
        ("metric = 'total_return'", "'mechanism.half_spread.bsp' = [1.0]"),
        ("metric = 'total_return'", "'mechanism.half_spread.bps' = [-1.0]"),
        ("metric = 'total_return'", "'data.XYZ.stamp' = ['open', 'close']"),
        ("metric = 'total_return'", "'run.currency' = ['USD']"),
        ("metric = 'total_return'", "'strategie.fast' = [1]"),
        ("metric = 'sharp'", "'strategy.fast' = [1, 2]"),
        ("method = 'random'", "'strategy.fast' = [1, 2]"),
        ("runs = 5", "'strategy.fast' = [1, 2]"),
        ("metric = 'total_return'", ""),
    ] {
        let scene = scene(&format!("[sweep]\n{metric}\n[sweep.ranges]\n{ranges}\n"));
        said += &format!("{metric}, {ranges}\n{}\n", scene.refused("sweep run.toml --out s"));
        assert!(!scene.path("s").exists(), "something was written");
    }
    said += &scene("").refused("sweep run.toml");
    insta::assert_snapshot!("refused", said);
}

#[test]
fn the_table_and_the_help_are_as_they_are() {
    let scene = scene(GRID);
    let (code, out, err) = scene.run("sweep run.toml");
    assert_eq!((code, err.as_str()), (0, ""));
    insta::assert_snapshot!("told", out);
    insta::assert_snapshot!("help", scene.run("sweep --help").1);
}
