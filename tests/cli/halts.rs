//! Halts as a run declares them: what came in them is told, and entries that cannot be are refused.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::command_scene::Folder;

const RUN: &str = "
[run]
seed = 1
cash = 1_000
currency = 'USD'
[[instrument]]
symbol = 'X'
tick_size = 0.01
[[data]]
symbol = 'X'
quotes = 'quotes.csv'
[strategy]
kind = 'buy_and_hold'
[[halt]]
";
const QUOTES: &str = "ts,bid,bid_size,ask,ask_size\n2024-07-01T10:00:00Z,99,9,101,9\n2024-07-01T10:00:10Z,99,9,101,9\n\
                      2024-07-01T10:00:20Z,89,9,91,9\n2024-07-01T10:00:30Z,79,9,81,9\n";

#[test]
fn a_run_declares_its_halts_and_tells_what_came_in_them() {
    let written = "symbol = 'X'\nfrom = 2024-07-01T09:59:50Z\nto = 2024-07-01T10:00:15Z\nreason = 'LULD'\n";
    let in_a_file = "file = 'halts.csv'\nzone = 'America/New_York'\ncolumns = { from = 'begun' }\n";
    let halts = "symbol,begun,to,reason\nOTHER,2024-07-01T06:00:00,2024-07-01T07:00:00,\n\
                 X,2024-07-01T05:59:50,2024-07-01T06:00:15,LULD\n";
    for entry in [written, in_a_file] {
        let run = format!("{RUN}{entry}");
        let folder = Folder::with(&[("run.toml", &run), ("quotes.csv", QUOTES), ("halts.csv", halts)]);
        let found = folder.json("backtest run.toml --out out");
        let expected = serde_json::json!([{
            "symbol": "X", "from": "2024-07-01T09:59:50Z", "to": "2024-07-01T10:00:15Z", "reason": "LULD", "rows": 2,
            "orders": 1, "refused": 0
        }]);
        println!("{}", found["halts"]);
        assert_eq!(found["halts"].as_array().unwrap().len(), 1);
        for key in ["symbol", "reason", "rows", "orders", "refused"] {
            assert_eq!(found["halts"][0][key], expected[0][key], "{key}");
        }
        assert_eq!(found["counts"]["fills"], 1);
        let named = |input: &serde_json::Value| input["path"] == "halts.csv";
        assert_eq!(found["inputs"].as_array().unwrap().iter().any(named), entry == in_a_file);
    }
}

#[test]
fn entries_that_cannot_be_are_said_with_place_and_remedy() {
    let error = |entry: &str, halts: &str| {
        let run = format!("{RUN}{entry}\n");
        Folder::with(&[("run.toml", &run), ("quotes.csv", QUOTES), ("halts.csv", halts)])
            .refused("backtest run.toml --out out")
    };
    let (from, to) = ("from = 2024-07-01T10:00:00Z\n", "to = 2024-07-01T10:00:05Z\n");
    insta::assert_snapshot!(error(&format!("symbol = 'Y'\n{from}{to}"), ""), @"
    error: run.toml:15:1: there is no [[instrument]] with the symbol `Y`
      hint: there are `X`
    ");
    insta::assert_snapshot!(error(&format!("symbol = 'X'\n{}{}", from.replace("00Z", "09Z"), to), ""), @"
    error: run.toml:17:1: expected an end after the beginning, 2024-07-01T10:00:09Z, found 2024-07-01T10:00:05Z
      hint: swap or correct them
    ");
    insta::assert_snapshot!(error("symbol = 'X'", ""), @"
    error: run.toml:14:1: expected `symbol`, `from` and `to`, or a `file`
      hint: a file has these columns, and may have `reason`
    ");
    insta::assert_snapshot!(error("symbol = 'X'\nfile = 'halts.csv'", ""), @"
    error: run.toml:14:1: a `file` says all of its halts itself
      hint: drop `symbol`, `from`, `to` and `reason`
    ");
    insta::assert_snapshot!(error(&format!("symbol = 'X'\n{from}{to}zone = 'UTC'"), ""), @"
    error: run.toml:14:1: only a `file` has `zone`, `time_unit` and `columns`
      hint: drop them, or name a file
    ");
    insta::assert_snapshot!(error("file = 'halts.csv'", "symbol,from,to\nX,2024-07-01T10:00:00Z,2024-07-01T10:00:00Z\n"), @"
    error: halts.csv: row 2, column `to`: expected an end after the beginning, 2024-07-01T10:00:00Z, found 2024-07-01T10:00:00Z
      hint: swap or correct them; are both in the same zone?
    ");
    insta::assert_snapshot!(error("file = 'halts.csv'", "symbol,from\nX,2024-07-01T10:00:00Z\n"), @"
    error: halts.csv: there is no column `to`
      hint: the file has the columns `symbol` and `from`
    ");
    let one = format!("symbol = 'X'\n{from}{to}");
    insta::assert_snapshot!(error(&format!("{one}[[halt]]\n{one}"), ""), @"
    error: run.toml:14:3: the halt of X from 2024-07-01T10:00:00Z: there is one from 2024-07-01T10:00:00Z to 2024-07-01T10:00:05Z already
      hint: write halts that overlap as one, with the first beginning and the last end
    ");
    insta::assert_snapshot!(error("file = 'halt.csv'", ""), @"
    error: run.toml:15:1: names the file halt.csv, but there is no such file
      hint: did you mean ./halts.csv?
    ");
}
