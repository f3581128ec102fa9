//! Accounts of runs as RUN.toml and its files declare them: a run of everything through the command, and what is refused.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fmt::Write as _;

use crate::command_scene::Folder;
use serde_json::Value;
use trueup::io::Table;

const RUN: &str = r#"
[run]
seed = 7
cash = 100_000
currency = "USD"
max_leverage = 2.0

[[instrument]]
symbol = "S"
tick_size = 0.01
multiplier = 10
margin = "regulation_t"

[[instrument]]
symbol = "F"
tick_size = 0.01
currency = "EUR"
margin = { initial = 0.4, maintenance = 0.3 }

[[rate]]
currency = "EUR"
file = "eurusd.csv"

[[data]]
symbol = "S"
bars = "s.csv"
stamp = "open"

[[data]]
symbol = "F"
bars = "f.csv"
stamp = "open"

[[data]]
symbol = "S"
actions = "s_actions.csv"

[[data]]
symbol = "F"
actions = "f_actions.csv"
zone = "Europe/London"
columns = { ts = "ex" }

[strategy]
kind = "buy_and_hold"
weight = 1.9
"#;

fn bars(prices: &[(f64, f64)]) -> String {
    let mut text = String::from("ts,open,high,low,close,volume\n");
    for (k, (open, close)) in prices.iter().enumerate() {
        let (high, low) = (open.max(*close), open.min(*close));
        writeln!(text, "1970-01-01T00:{k:02}:00Z,{open},{high},{low},{close},1000").unwrap();
    }
    text
}

fn folder(run: &str) -> Folder {
    let s = bars(&[(50.0, 50.0), (50.0, 50.0), (25.0, 25.0), (25.0, 25.0), (25.0, 25.0), (25.0, 25.0)]);
    let f = bars(&[(20.0, 20.0), (20.0, 20.0), (20.0, 20.0), (20.0, 20.0), (20.0, 4.0), (4.0, 4.0)]);
    Folder::with(&[
        ("run.toml", run),
        ("s.csv", &s),
        ("f.csv", &f),
        ("eurusd.csv", "ts,price\n1970-01-01T00:00:00Z,1.25\n1970-01-01T00:03:30Z,1.2\n"),
        ("s_actions.csv", "ts,kind,amount,new,old\n1970-01-01T00:02:00Z,split,,2,1\n"),
        // London was an hour ahead of UTC that winter.
        ("f_actions.csv", "ex,kind,amount,withholding\n1970-01-01 01:03:00,dividend,0.1,0.25\n"),
    ])
}

/// 190 contracts of 500 and 3,800 shares of 25 are bought, 95,000 each. A dividend of 380 EUR less 95 is received. At 4 EUR
/// and 1.20 equity is 27,382 and 23,750 + 5,472 are required: 1,840 at 62.50 a contract of now 250 are 30.
#[test]
fn a_run_of_everything_by_hand() {
    let folder = folder(RUN);
    let (code, _, err) = folder.run("backtest run.toml --out out");
    assert_eq!((code, err.as_str()), (0, ""));
    let run: Value = serde_json::from_slice(&folder.bytes("out/run.json")).unwrap();
    let number = |value: &Value| (value.as_f64().unwrap() * 1e6).round() / 1e6;
    let (metrics, counts) = (&run["metrics"], &run["counts"]);
    assert_eq!(number(&metrics["final_equity"]), 27_382.0);
    assert_eq!((number(&metrics["dividends"]), number(&metrics["withheld"])), (380.0 * 1.2, 95.0 * 1.2));
    assert_eq!(
        (&counts["margin_calls"], &counts["broker_orders"], &counts["corporate_actions"]),
        (&1.into(), &1.into(), &2.into())
    );
    let [usd, eur] = [0, 1].map(|k| &run["account"][k]);
    assert_eq!((number(&usd["cash"]), number(&usd["holdings"])), (12_500.0, 87_500.0));
    assert_eq!((number(&eur["cash"]), number(&eur["holdings"]), number(&eur["rate"])), (-75_715.0, 15_200.0, 1.2));
    assert_eq!((number(&eur["dividends"]), number(&eur["withheld"])), (380.0, 95.0));
    assert_eq!((&run["instruments"][1]["currency"], number(&run["instruments"][0]["position"])), (&"EUR".into(), 350.0));
    // Every file is accounted for, and the zone of the ex-dates is not that of the months.
    let inputs: Vec<&str> = run["inputs"].as_array().unwrap().iter().map(|input| input["path"].as_str().unwrap()).collect();
    assert_eq!(inputs, ["run.toml", "s.csv", "f.csv", "s_actions.csv", "f_actions.csv", "eurusd.csv"]);
    assert_eq!(run["zone"], "UTC");
    let orders = Table::read(folder.path("out/orders.parquet")).unwrap();
    assert_eq!(orders.texts_complete("sent_by").unwrap(), ["strategy", "strategy", "broker"]);
    assert_eq!(orders.floats_complete("qty").unwrap(), [190.0, 3_800.0, 30.0], "the first was done before the split");
    let trades = Table::read(folder.path("out/trades.parquet")).unwrap();
    assert_eq!(trades.texts_complete("currency").unwrap(), ["USD", "EUR"]);
    assert_eq!(trades.floats_complete("gross").unwrap().iter().map(|g| g.round()).collect::<Vec<_>>(), [0.0, -60_800.0]);
    let page = String::from_utf8(folder.bytes("out/report.html")).unwrap();
    for told in ["Margin calls", "Cash in EUR", "Tax withheld", "as they were printed"] {
        assert!(page.contains(told), "{told}");
    }
    assert_eq!(folder.run("audit run.toml").0, 0, "no decision rests on a later dividend, split or rate");
}

/// The same account as the price of an instrument tells the rate, and as a sweep tries it.
#[test]
fn a_rate_may_be_the_price_of_an_instrument_and_a_margin_be_swept_over() {
    let run = RUN.replace("file = \"eurusd.csv\"", "symbol = \"EURUSD\"").replace(
        "[[rate]]",
        "[[instrument]]\nsymbol = \"EURUSD\"\ntick_size = 0.0001\n\n[[data]]\nsymbol = \"EURUSD\"\nbars = \"fx.csv\"\nstamp = \"open\"\n\n[[rate]]",
    );
    let folder = folder(&run.replace("weight = 1.9", "weight = 0.3"));
    std::fs::write(
        folder.path("fx.csv"),
        bars(&[(1.25, 1.25), (1.25, 1.25), (1.25, 1.2), (1.2, 1.2), (1.2, 1.2), (1.2, 1.2)]),
    )
    .unwrap();
    let run = folder.json("backtest run.toml");
    assert_eq!(run["account"][1]["rate"], 1.2);
    let swept =
        format!("{}\n[sweep]\nmetric = \"final_equity\"\n[sweep.ranges]\n\"instrument.S.multiplier\" = [10, 20]\n", RUN);
    let (code, out, err) = self::folder(&swept).run("sweep run.toml --json");
    assert_eq!(code, 0, "{out}{err}");
    assert!(out.contains("27382"), "{out}");
}

/// What is said of the run with `from` changed to `to` in one of its files.
fn said(file: &str, from: &str, to: &str) -> String {
    let folder = folder(RUN);
    let text = std::fs::read_to_string(folder.path(file)).unwrap();
    assert!(text.contains(from), "{from}");
    std::fs::write(folder.path(file), text.replace(from, to)).unwrap();
    folder.refused("backtest run.toml --out out")
}

#[test]
fn what_cannot_be_is_refused_with_its_place_and_a_remedy() {
    let run = "run.toml";
    let (s, f, rate) = ("s_actions.csv", "f_actions.csv", "eurusd.csv");
    let all = [
        said(run, "multiplier = 10", "multiplier = 0"),
        said(run, "multiplier = 10", "multiplier = 2.5"),
        said(run, "\"regulation_t\"", "\"regulation_x\""),
        said(run, "maintenance = 0.3", "maintenance = 30"),
        said(run, "maintenance = 0.3", "maintenance = 0.5"),
        said(run, "maintenance = 0.3", "maintenence = 0.3"),
        said(run, "maintenance = 0.3", "maintenance = 0.3, short_maintenance = 0.45"),
        said(run, "currency = \"EUR\"\nfile", "currency = \"EUT\"\nfile"),
        said(run, "currency = \"EUR\"\nfile", "currency = \"USD\"\nfile"),
        said(run, "[[rate]]\ncurrency = \"EUR\"\nfile = \"eurusd.csv\"\n", ""),
        said(run, "file = \"eurusd.csv\"", "value = 0.0"),
        said(run, "file = \"eurusd.csv\"", "file = \"eurusd.csv\"\nvalue = 1.1"),
        said(run, "file = \"eurusd.csv\"", "value = 1.1\nzone = \"Europe/London\""),
        said(run, "file = \"eurusd.csv\"", "file = \"eurusd.cvs\""),
        said(run, "file = \"eurusd.csv\"", "symbol = \"F\""),
        said(run, "file = \"eurusd.csv\"", "symbol = \"G\""),
        said(run, "actions = \"s_actions.csv\"", "actions = \"s_actions.csv\"\nstamp = \"open\""),
        said(rate, "1.25", "-1.25"),
        said(rate, "00:03:30Z", "00:00:00Z"),
        said(s, "split", "spilt"),
        said(s, "2,1", "2,0"),
        said(s, "2,1", "2.5,1"),
        said(s, "2,1", ",1"),
        said(s, "split,,", "split,0.5,"),
        said(s, "00:02:00Z", "00:02:30Z"),
        said(f, "0.1,", ","),
        said(f, "0.1,", "-0.1,"),
        said(f, "0.25", "25"),
        said(f, "ex,", "ts,"),
    ];
    insta::assert_snapshot!("refused", all.join("\n"));
}

#[test]
fn a_twin_has_no_account() {
    let twin = "[twin]\nmodel = \"execution\"\n[assumptions]\nprice = \"mid\"\n[[instrument]]\nsymbol = \"S\"\ntick_size = 0.01\n\
                multiplier = 10\n[market]\nbars = \"s.csv\"\nstamp = \"open\"\n";
    let folder = Folder::with(&[("twin.toml", twin), ("s.csv", "")]);
    std::fs::create_dir(folder.path("log")).unwrap();
    let said = folder.refused("diagnose twin.toml --recording log --out found");
    assert!(said.contains("twin.toml:8:1: only a run has the key `multiplier`"), "{said}");
}
