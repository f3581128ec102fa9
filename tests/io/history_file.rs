//! Bars and quotes from files: their two times, and every way in which a file can be wrong.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::path::PathBuf;

use trueup::io::{FeedFormat, Stamp, TimeFormat};
use trueup::market::History;
use trueup::sim2real::Timestamp;

struct File {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

fn file(text: &str) -> File {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("data.csv");
    std::fs::write(&path, text).unwrap();
    File { _folder: folder, path }
}

fn bars_format() -> FeedFormat {
    FeedFormat { stamp: Some(Stamp::Open), ..FeedFormat::default() }
}

fn bars(rows: &str) -> Result<History, String> {
    read_bars(rows, &bars_format(), None)
}

fn read_bars(rows: &str, format: &FeedFormat, interval: Option<i64>) -> Result<History, String> {
    let file = file(&format!("ts,open,high,low,close,volume\n{rows}"));
    History::read_bars(&file.path, format, interval).map_err(|error| error.to_string())
}

fn quotes(text: &str) -> Result<History, String> {
    let file = file(text);
    History::read_quotes(&file.path, &FeedFormat::default()).map_err(|error| error.to_string())
}

const MINUTE: i64 = 60 * Timestamp::NANOS;

#[test]
fn bars_are_known_at_their_end_in_the_zone_declared() {
    let new_york = TimeFormat { zone: "America/New_York".parse().unwrap(), ..TimeFormat::default() };
    let format = FeedFormat { time: new_york, price_scale: 1e-4, ..bars_format() };
    let rows = "2013-10-07 09:30:00,1689300,1689400,1689000,1689100,5\n2013-10-07 09:31:00,1689100,1689100,1689100,1689100,0\n\
                2013-10-08 09:30:00,1689100,1689100,1689100,1689100,0\n2013-10-08 09:31:00,1689100,1689100,1689100,1689100,1\n";
    let history = read_bars(rows, &format, None).unwrap();
    let times: Vec<(String, String)> =
        history.bars().iter().map(|bar| (bar.open_at.to_string(), bar.known_at.to_string())).collect();
    assert_eq!(times[0], ("2013-10-07T13:30:00Z".into(), "2013-10-07T13:31:00Z".into()));
    assert_eq!(times[1].1, "2013-10-07T13:32:00Z", "the night is no bar");
    assert_eq!(history.bars()[0].open.0, 168_930_000_000);
    let closed = FeedFormat { stamp: Some(Stamp::Close), ..format };
    let history = read_bars(rows, &closed, Some(MINUTE)).unwrap();
    assert_eq!(history.bars()[2].open_at.to_string(), "2013-10-08T13:29:00Z");
    assert_eq!(history.bars()[2].known_at.to_string(), "2013-10-08T13:30:00Z");
}

#[test]
fn bars_that_cannot_be_name_row_column_value_and_remedy() {
    let row = |k: i64, rest: &str| format!("{},{rest}\n", k * MINUTE);
    let fault = |rows: &[String]| bars(&rows.concat()).unwrap_err();
    let good = row(0, "10,12,9,11,5");
    for (bad, place) in [
        (row(1, "13,12,9,11,5"), "row 3, column `open`: expected low <= open, close <= high, found 13"),
        (row(1, "10,12,9,8,5"), "row 3, column `close`"),
        (row(1, "10,8,9,10,5"), "row 3, column `high`"),
        (row(1, "10,12,-9,11,5"), "row 3, column `low`: expected a price greater than 0, found -9"),
        (row(1, "10,12,9,,5"), "row 3, column `close`: expected a number, found an empty cell"),
        (row(1, "10,12,9,nan,5"), "row 3, column `close`"),
        (row(1, "10,12,9,inf,5"), "row 3, column `close`"),
        (row(1, "10,12,9,11,-5"), "row 3, column `volume`: expected a volume of 0 or more, found -5"),
        (row(0, "10,12,9,11,5"), "row 3, column `ts`"),
        (row(-1, "10,12,9,11,5"), "row 3, column `ts`"),
        (row(1, "1e10,1e10,1e10,1e10,5"), "row 3, column `open`: expected a price of at most 9.2e9"),
    ] {
        let error = fault(&[good.clone(), bad]);
        assert!(error.contains(place) && error.contains("hint:"), "{error}");
    }
    assert!(fault(std::slice::from_ref(&good)).contains("interval = \"1m\""));
    assert!(read_bars(&good, &bars_format(), Some(MINUTE)).is_ok());
    let hours = read_bars(&(good.clone() + &row(1, "10,12,9,11,5")), &bars_format(), Some(60 * MINUTE)).unwrap_err();
    assert!(hours.contains("most bars are 60 s apart, but `interval` says 3600 s"), "{hours}");
    assert!(read_bars(&good, &FeedFormat::default(), None).unwrap_err().contains("stamp = \"open\""));
    let file = file("ts,open,high,low,volume\n0,1,1,1,1\n");
    let missing = History::read_bars(&file.path, &bars_format(), Some(MINUTE)).unwrap_err().to_string();
    assert!(missing.contains("there is no column `close`"), "{missing}");
}

#[test]
fn quotes_have_as_many_levels_as_there_are_columns_and_zero_is_an_empty_side() {
    let text = "ts,bid,bid_size,ask,ask_size,bid2,bid2_size,ask2,ask2_size\n\
                1,99,5,101,6,98,7,102,8\n1,0,0,101,6,,,,\n2,99,,0,0,98,7,,\n3,99,0,101,5,98,7,,\n";
    let history = quotes(text).unwrap();
    let all = history.quotes().all();
    let sides = |k: usize| {
        let quote = all.get(k).unwrap();
        (quote.bids.len(), quote.asks.len(), quote.mid())
    };
    assert_eq!(sides(0), (2, 2, Some(100.0)));
    assert_eq!(sides(1), (0, 1, None));
    assert_eq!(sides(2), (2, 0, None));
    assert_eq!(sides(3), (0, 1, None), "a level of size 0 is not there, nor what is behind it");
    assert_eq!(all.get(2).unwrap().bids[0].size, f64::INFINITY);
}

#[test]
fn quotes_that_cannot_be_name_row_column_value_and_remedy() {
    let fault = |rows: &str| {
        quotes(&format!("ts,bid,bid_size,ask,ask_size,ask2,ask2_size\n1,99,5,101,6,102,1\n{rows}")).unwrap_err()
    };
    for (bad, place) in [
        ("2,101,5,99,6,,\n", "row 3, column `ask`"),
        ("2,-99,5,101,6,,\n", "row 3, column `bid`"),
        ("2,99,-5,101,6,,\n", "row 3, column `bid_size`"),
        ("2,99,5,101,6,100,1\n", "row 3, column `ask2`"),
        ("0,99,5,101,6,,\n", "row 3, column `ts`"),
    ] {
        let error = fault(bad);
        assert!(error.contains(place) && error.contains("hint:"), "{error}");
    }
    assert!(quotes("ts,bid,bid_size,ask\n1,1,1,2\n").unwrap_err().contains("there is no column `ask_size`"));
}
