//! Runs that stop, go on, part, or read their data while they go, as users meet them.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fs;
use std::path::Path;

use crate::command_scene::Folder;
use serde_json::Value;
use trueup::io::{RunFile, Table};
use trueup::market::{prepare_run, streams_as_well};
use trueup::strategies;

/// A folder with the bars of the examples, and a run of them that was changed from one text to another.
fn scene(changes: &[(&str, &str)]) -> Folder {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join("bars");
    let run = fs::read_to_string(source.join("run.toml")).unwrap();
    let run = changes.iter().fold(run, |run, (from, to)| {
        assert!(run.contains(from), "{run}");
        run.replacen(from, to, 1)
    });
    let folder = Folder::with(&[("run.toml", &run)]);
    fs::copy(source.join("bars.parquet"), folder.path("bars.parquet")).unwrap();
    folder
}

/// A summary without what says of what files it was made.
fn results(mut summary: Value) -> Value {
    summary.as_object_mut().unwrap().remove("inputs");
    summary
}

#[test]
fn a_run_whose_data_are_streamed_is_the_same() {
    let (whole, streamed) =
        (scene(&[]), scene(&[("[run]", "[run]\nstream = true"), ("[[data]]", "[[data]]\ninterval = \"1m\"")]));
    let (one, other) = (whole.json("backtest run.toml --out a"), streamed.json("backtest run.toml --out a"));
    assert_eq!(one["inputs"][1], other["inputs"][1], "the rows are counted when they are read");
    assert_eq!(results(one), results(other));
    for table in ["orders", "fills", "equity", "trades"] {
        let name = format!("a/{table}.parquet");
        assert_eq!(whole.bytes(&name), streamed.bytes(&name), "{table}");
    }
    let spans = [("[run]", "[run]\nstart = \"2024-08-06T00:00:00Z\"\nend = \"2024-08-07T00:00:00Z\"")];
    let (whole, streamed) =
        (scene(&spans), scene(&[spans[0], ("[run]", "[run]\nstream = true"), ("[[data]]", "[[data]]\ninterval = \"1m\"")]));
    let (one, other) = (whole.json("backtest run.toml"), streamed.json("backtest run.toml"));
    assert_eq!(one["metrics"], other["metrics"]);
    let error = scene(&[("[run]", "[run]\nstream = true")]).refused("backtest run.toml");
    assert!(error.contains("needs their `stamp` and their `interval`"), "{error}");
}

/// What goes through its data once reads them while it goes, wherever that takes nothing twice; what is told is what a run on data
/// held in memory tells.
#[test]
fn a_run_through_its_data_is_that_of_data_in_memory() {
    let spans = [("[run]", "[run]\nstart = \"2024-08-06T00:00:00Z\"\nend = \"2024-08-07T00:00:00Z\"")];
    for changes in [&[][..], &spans] {
        let scene = scene(changes);
        let file = RunFile::read(scene.path("run.toml")).unwrap();
        assert!(streams_as_well(&file));
        let prepared = prepare_run(&file).unwrap();
        let mut settings: toml::Table = file.strategy_settings().unwrap();
        settings.insert("kind".to_owned(), file.strategy.clone().into());
        let record = prepared.backtest.run(strategies::build(&settings).unwrap().as_mut()).unwrap();
        let outputs = prepared.outputs(&record).unwrap();
        // What lies behind its end is not read: that is all there is to tell them apart by.
        let told = |mut summary: Value| {
            if !changes.is_empty() {
                summary.as_object_mut().unwrap().remove("data").unwrap();
                summary["inputs"][1].as_object_mut().unwrap().remove("rows").unwrap();
            }
            summary
        };
        let whole = told(serde_json::from_str(&outputs.json().unwrap()).unwrap());
        for threads in [1, 2] {
            assert_eq!(told(scene.json(&format!("backtest run.toml --threads {threads} --out a{threads}"))), whole);
            assert_eq!(Table::read(scene.path(&format!("a{threads}/equity.parquet"))).unwrap().rows(), record.equity.len());
        }
        let (code, text, _) = scene.run("backtest run.toml");
        assert!(code == 0 && text.starts_with(&outputs.page.title[..20]), "{text}");
    }
    let csv = scene(&[("bars.parquet", "bars.csv")]);
    fs::write(csv.path("bars.csv"), "ts,open,high,low,close,volume\n0,1,1,1,1,1\n60000000000,1,1,1,1,1\n").unwrap();
    assert!(!streams_as_well(&RunFile::read(csv.path("run.toml")).unwrap()), "a text would be read twice");
}

#[test]
fn a_thin_equity_curve_has_few_points() {
    let scene = scene(&[("[run]", "[run]\nequity_every = \"1d\"")]);
    scene.json("backtest run.toml --out a");
    let rows = Table::read(scene.path("a/equity.parquet")).unwrap().rows();
    assert!((2..=80).contains(&rows), "{rows}");
    let error = self::scene(&[("[run]", "[run]\nequity_every = \"now\"")]).refused("backtest run.toml");
    assert!(error.contains("run.toml:") && error.contains("expected a span of time"), "{error}");
}

#[test]
fn a_run_that_was_stopped_goes_on_and_ends_the_same() {
    let scene = scene(&[]);
    let whole = scene.json("backtest run.toml");
    for (k, moment) in ["event:700", "order:3", "2024-08-07T15:00:00Z"].into_iter().enumerate() {
        let (code, out, err) = scene.run(&format!("backtest run.toml --save c{k}.json --at {moment}"));
        assert_eq!((code, err.as_str()), (0, ""));
        assert!(out.starts_with("Stopped after ") && out.contains(&format!("--resume c{k}.json")), "{out}");
        assert_eq!(scene.json(&format!("backtest run.toml --resume c{k}.json")), whole, "{moment}");
    }
    // Nothing is written over unasked.
    let error = scene.refused("backtest run.toml --save c0.json --at event:9");
    assert!(error.contains("c0.json"), "{error}");
    let error = scene.refused("backtest run.toml --save c9.json --at event:999999999");
    assert!(error.contains("before the moment of --at") && !scene.path("c9.json").exists(), "{error}");
    let (code, _, err) = scene.run("backtest run.toml --save c9.json --at never");
    assert!(code == 2 && err.contains("expected event:5000"), "{err}");
}

#[test]
fn what_has_changed_since_is_not_gone_on_from() {
    let scene = scene(&[]);
    assert_eq!(scene.run("backtest run.toml --save c.json --at event:700").0, 0);
    let saved = String::from_utf8(scene.bytes("c.json")).unwrap();
    let refused = |saved: &str| {
        fs::write(scene.path("d.json"), saved).unwrap();
        scene.refused("backtest run.toml --resume d.json")
    };
    let of_state = saved.rfind("\"state\"").unwrap() + 12;
    let digit = if &saved[of_state..=of_state] == "0" { "1" } else { "0" };
    let other = format!("{}{digit}{}", &saved[..of_state], &saved[of_state + 1..]);
    assert!(refused(&other).contains("not what it was when it was saved"));
    assert!(refused("{}").contains("no checkpoint"));
    assert!(refused(&saved.replacen("\"seed\": ", "\"seed\": 1", 1)).contains("saved with seed 1"));
    let error = scene.refused("backtest run.toml --resume nowhere.json");
    assert!(error.contains("nowhere.json: cannot be read"), "{error}");
    let run = String::from_utf8(scene.bytes("run.toml")).unwrap();
    fs::write(scene.path("run.toml"), format!("{run}\n# Another word.\n")).unwrap();
    assert!(scene.refused("backtest run.toml --resume c.json").contains("`run.toml` has changed since"));
}

#[test]
fn a_fork_shows_what_another_fill_would_have_done() {
    let scene = scene(&[]);
    let run = scene.json("backtest run.toml --out run");
    let fills = Table::read(scene.path("run/fills.parquet")).unwrap();
    let price = fills.floats("price").unwrap()[0].unwrap();
    let (code, out, err) = scene.run(&format!("backtest run.toml --out fork --fork 1 --fill-price {:.2}", price + 1.0));
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("run") && out.contains("fork") && out.contains("Total return"), "{out}");
    let forked = Table::read(scene.path("fork/fills.parquet")).unwrap();
    assert!((forked.floats("price").unwrap()[0].unwrap() - price - 1.0).abs() < 1e-9);
    assert_eq!(forked.floats("met").unwrap()[0], fills.floats("met").unwrap()[0], "it met the same market");
    let summary: Value = serde_json::from_slice(&scene.bytes("fork/run.json")).unwrap();
    let equity = |summary: &Value| summary["metrics"]["final_equity"].as_f64().unwrap();
    assert!(equity(&summary) != equity(&run));
    let error = scene.refused("backtest run.toml --fork 99999 --fill-price 100");
    assert!(error.contains("there is no order 99999"), "{error}");
    let error = scene.refused("backtest run.toml --fork 1 --fill-price 100.001");
    assert!(error.contains("price 100.001 cannot be a fill's"), "{error}");
}
