//! Bad market data: each kind is refused with place, value and remedy, or left out and counted, as the run declares.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::path::PathBuf;

use trueup::io::{ClockOffset, FeedClock, FeedFormat, FeedRules, InputError, Layout, OnBad, Stamp};
use trueup::market::{DataNotes, Finding, History, Side};
use trueup::sim2real::Timestamp;

const SECOND: i64 = Timestamp::NANOS;

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

fn lenient(format: &FeedFormat) -> FeedFormat {
    FeedFormat { rules: FeedRules { on_bad: OnBad::Drop, ..format.rules }, ..format.clone() }
}

type Read = fn(&PathBuf, &FeedFormat) -> Result<History, InputError>;

const BARS: Read = |path, format| History::read_bars(path, format, Some(60 * SECOND));
const QUOTES: Read = |path, format| History::read_quotes(path, format);
const TRADES: Read = |path, format| History::read_trades(path, format);
const DEPTH: Read = |path, format| History::read_depth(path, format);
const ORDERS: Read = |path, format| History::read_order_events(path, format);

/// How many rows of any kind there are.
fn rows(history: &History) -> usize {
    let quoted = history.bars().len() + history.quotes().len() + history.prints().len();
    quoted + history.depth().len() + history.order_events().len()
}

/// Holds the row on line 3 of `text` to be refused with `message`, and left out and counted as `finding` where the run says
/// so: the others stay.
fn refused(read: Read, format: &FeedFormat, text: &str, message: &str, finding: Finding) {
    let file = file(text);
    let error = read(&file.path, format).unwrap_err().to_string();
    assert!(error.contains(message) && error.contains("row 3") && error.contains("hint:"), "{error}\nis not {message}");
    let history = read(&file.path, &lenient(format)).unwrap();
    let notes = &history.notes()[0];
    let all = text.lines().count() as u64 - 1;
    assert_eq!((notes.count(finding), notes.rows(), notes.kept()), (1, all, all - 1), "{text}");
    assert_eq!(rows(&history) as u64, all - 1);
    assert!(notes.lines()[0].contains(finding.title()), "{:?}", notes.lines());
}

fn stamped() -> FeedFormat {
    FeedFormat { stamp: Some(Stamp::Close), ..FeedFormat::default() }
}

#[test]
fn bars_that_cannot_be() {
    let minute = |k: i64, rest: &str| format!("{},{rest}\n", k * 60 * SECOND);
    let with = |bad: String| {
        format!("ts,open,high,low,close,volume\n{}{bad}{}", minute(0, "10,12,9,11,5"), minute(2, "10,12,9,11,5"))
    };
    for (bad, message, finding) in [
        (minute(1, "10,12,9,nan,5"), "column `close`: expected a number, found NaN", Finding::Missing),
        (minute(1, "13,12,9,11,5"), "column `open`: expected low <= open, close <= high, found 13", Finding::Price),
        (minute(1, "10,12,0,11,5"), "column `low`: expected a price greater than 0, found 0", Finding::Price),
        (minute(1, "10,12,9,11,-5"), "column `volume`: expected a volume of 0 or more, found -5", Finding::Size),
        (minute(0, "10,12,9,11,5"), "column `ts`: expected more than the 1970-01-01T00:00:00Z of row 2", Finding::Duplicate),
        (minute(-1, "10,12,9,11,5"), "column `ts`: expected more than the 1970-01-01T00:00:00Z of row 2", Finding::Late),
        (",10,12,9,11,5\n".to_owned(), "column `ts`: expected a time, found an empty cell", Finding::Missing),
    ] {
        refused(BARS, &stamped(), &with(bad), message, finding);
    }
}

#[test]
fn a_bar_ends_where_the_next_begins_even_if_that_one_is_left_out() {
    let file = file(&format!(
        "ts,open,high,low,close,volume\n0,10,12,9,11,5\n{},10,12,9,nan,5\n{},10,12,9,11,5\n",
        30 * SECOND,
        60 * SECOND
    ));
    let format = lenient(&FeedFormat { stamp: Some(Stamp::Open), ..FeedFormat::default() });
    let history = History::read_bars(&file.path, &format, Some(30 * SECOND)).unwrap();
    let ends: Vec<i64> = history.bars().iter().map(|bar| bar.known_at.0 / SECOND).collect();
    assert_eq!(ends, [30, 90]);
}

#[test]
fn quotes_that_cannot_be() {
    for (bad, message, finding) in [
        ("2,101,5,99,6,,\n", "column `ask`: no such quote can be, found 99", Finding::Crossed),
        ("2,99,5,101,6,100,1\n", "column `ask2`: no such quote can be, found 100", Finding::Crossed),
        ("2,-99,5,101,6,,\n", "column `bid`: expected a number that is not negative, found -99", Finding::Price),
        ("2,99,-5,101,6,,\n", "column `bid_size`: expected a number that is not negative, found -5", Finding::Size),
        ("0,99,5,101,6,,\n", "column `ts`: expected at least the 1970-01-01T00:00:00.000000001Z of row 2", Finding::Late),
        ("2,99,5,1e11,6,,\n", "column `ask`: no such quote can be, found 100000000000", Finding::Price),
    ] {
        let text = format!("ts,bid,bid_size,ask,ask_size,ask2,ask2_size\n1,99,5,101,6,102,1\n{bad}3,98,5,101,6,102,1\n");
        refused(QUOTES, &FeedFormat::default(), &text, message, finding);
    }
}

#[test]
fn quotes_worth_telling_of_are_kept_and_counted() {
    // Locked; one-sided, by 0 and by NaN; a halt; the same again.
    let file = file(
        "ts,bid,bid_size,ask,ask_size\n1,99,5,101,6\n2,100,5,100,6\n3,0,0,101,6\n4,99,5,nan,\n5,,,,\n6,99,5,101,6\n6,99,5,101,6\n",
    );
    let history = History::read_quotes(&file.path, &FeedFormat::default()).unwrap();
    let notes = &history.notes()[0];
    let counts = [Finding::Locked, Finding::OneSided, Finding::Halt, Finding::Repeated].map(|finding| notes.count(finding));
    assert_eq!((counts, history.quotes().len()), ([1, 2, 1, 1], 7));
    let halt = history.quotes().all().get(4).unwrap();
    assert!(halt.bids.is_empty() && halt.asks.is_empty(), "nothing trades in a halt");
}

#[test]
fn trades_that_cannot_be() {
    for (bad, message, finding) in [
        ("2,nan,1,buy\n", "column `price`: expected a number, found NaN", Finding::Missing),
        ("2,0,1,buy\n", "column `price`: expected a number above 0, found 0", Finding::Price),
        ("2,1e11,1,buy\n", "column `price`: expected a price above 0 and at most 9.2e9", Finding::Price),
        ("2,9,-1,buy\n", "column `size`: expected a number above 0, found -1", Finding::Size),
        ("0,9,1,buy\n", "column `ts`: expected at least", Finding::Late),
    ] {
        let text = format!("ts,price,size,aggressor\n1,9,1,sell\n{bad}3,9,1,auction\n");
        refused(TRADES, &FeedFormat::default(), &text, message, finding);
    }
    // Two trades may be alike: they are counted, and kept.
    let file = file("ts,price,size\n1,9,1\n1,9,1\n");
    let history = History::read_trades(&file.path, &FeedFormat::default()).unwrap();
    assert_eq!((history.prints().len(), history.notes()[0].count(Finding::Repeated)), (2, 1));
}

#[test]
fn changes_of_books_that_cannot_be() {
    for (bad, message, finding) in [
        ("2,middle,9,1,set\n", "column `side`: expected `bid` or `ask`, found \"middle\"", Finding::Word),
        ("2,bid,9,1,put\n", "column `action`: expected `set` or `clear`, found \"put\"", Finding::Word),
        ("2,bid,,1,set\n", "column `price`: expected a number, found an empty cell", Finding::Missing),
        ("2,bid,-9,1,set\n", "column `price`: expected a price greater than 0, found -9", Finding::Price),
        ("2,bid,9,-1,set\n", "column `size`: expected a size that is not negative, found -1", Finding::Size),
        ("0,bid,9,1,set\n", "column `ts`: expected at least", Finding::Late),
    ] {
        let text = format!("ts,side,price,size,action\n1,ask,,,clear\n{bad}3,ask,9,0,set\n");
        refused(DEPTH, &FeedFormat::default(), &text, message, finding);
    }
}

#[test]
fn order_events_that_cannot_be() {
    let format = FeedFormat::of_layout(Layout::TrueupOrders);
    for (bad, message, finding) in [
        (
            "2,7,add,bid,9,1\n",
            "column `order_id`: expected an order that is not in the book yet, found 7",
            Finding::Duplicate,
        ),
        ("2,-7,add,bid,9,1\n", "column `order_id`: expected an id that is not negative, found -7", Finding::Word),
        ("2,8,move,bid,9,1\n", "column `action`: expected `add`, `change` or `delete`, found \"move\"", Finding::Word),
        ("2,8,add,bid,9,0\n", "column `size`: expected a size above 0, found 0", Finding::Size),
        ("2,8,add,bid,nan,1\n", "column `price`: expected a number, found NaN", Finding::Missing),
    ] {
        let text = format!("ts,order_id,action,side,price,size\n1,7,add,bid,9,1\n{bad}3,7,change,bid,9,0.5\n");
        refused(ORDERS, &format, &text, message, finding);
    }
    // Orders that were placed before the file begins, and such as are gone.
    let file = file(
        "ts,order_id,action,side,price,size\n1,7,delete,bid,9,1\n2,8,add,ask,9,1\n3,8,delete,ask,9,1\n4,8,delete,ask,9,1\n",
    );
    let history = History::read_order_events(&file.path, &format).unwrap();
    assert_eq!((history.order_events().len(), history.notes()[0].count(Finding::UnknownOrder)), (2, 2));
}

/// Times of quotes [s] as they come out, and what was found.
fn times(seconds: &[i64], rules: FeedRules) -> Result<(Vec<i64>, DataNotes), String> {
    let rows: String = seconds.iter().map(|second| format!("{},9,1\n", second * SECOND)).collect();
    let file = file(&format!("ts,price,size\n{rows}"));
    let format = FeedFormat { rules, ..FeedFormat::default() };
    let history = History::read_trades(&file.path, &format).map_err(|error| error.to_string())?;
    Ok((history.prints().iter().map(|print| print.time.0 / SECOND).collect(), history.notes()[0].clone()))
}

#[test]
fn rows_out_of_order_are_put_in_order_within_the_window_that_is_declared() {
    let strict = FeedRules::default();
    let within = FeedRules { reorder: Some(2 * SECOND), ..strict };
    assert!(times(&[1, 3, 2, 4], strict).unwrap_err().contains("row 4, column `ts`: expected at least"));
    let (order, notes) = times(&[1, 3, 2, 4], within).unwrap();
    assert_eq!((order, notes.count(Finding::Reordered)), (vec![1, 2, 3, 4], 1));
    let error = times(&[1, 5, 2, 6], within).unwrap_err();
    assert!(error.contains("row 4, column `ts`: expected at least the 1970-01-01T00:00:05Z of row 3"), "{error}");
    let (order, notes) = times(&[1, 5, 2, 6], FeedRules { on_bad: OnBad::Drop, ..within }).unwrap();
    assert_eq!((order, notes.count(Finding::Late)), (vec![1, 5, 6], 1));
}

#[test]
fn gaps_and_symbols_that_vanish_are_counted() {
    let rules = FeedRules { max_gap: Some(5 * SECOND), until: Some(Timestamp(100 * SECOND)), ..FeedRules::default() };
    let (_, notes) = times(&[1, 2, 20, 21, 40], rules).unwrap();
    assert_eq!((notes.count(Finding::Gap), notes.longest_silence(), notes.ended_early()), (2, 19 * SECOND, true));
    let lines = notes.lines().join("\n");
    assert!(lines.contains("the longest silence is 19 s") && lines.contains("they end early, at 1970-01-01T00:00:40Z"));
    assert!(!times(&[1, 98], rules).unwrap().1.ended_early());
}

#[test]
fn clocks_that_go_back_or_do_not_agree() {
    let format =
        |offset| FeedFormat { clock: FeedClock { known_at: Some("seen".to_owned()), offset }, ..FeedFormat::default() };
    // The exchange's clock goes back: the rows are in the order in which they were known.
    let back = file("ts,seen,price,size\n5,10,9,1\n4,11,9,1\n6,12,9,1\n");
    let history = History::read_trades(&back.path, &format(ClockOffset::default())).unwrap();
    assert_eq!((history.prints().len(), history.notes()[0].count(Finding::ClockBack)), (3, 1));
    assert_eq!((history.prints()[0].time, history.print_known_at(0)), (Timestamp(5), Some(Timestamp(10))));
    // The local clock runs behind by 3: refused, mended, corrected by what is declared, or by what is estimated.
    let behind = file("ts,seen,price,size\n5,4,9,1\n10,7,9,1\n20,19,9,1\n");
    let error = History::read_trades(&behind.path, &format(ClockOffset::default())).unwrap_err().to_string();
    assert!(
        error.contains("row 2, column `seen`: expected a time no earlier than 1970-01-01T00:00:00.000000005Z"),
        "{error}"
    );
    assert!(error.contains("clock_offset = \"estimate\""));
    let read = |format: &FeedFormat| {
        let history = History::read_trades(&behind.path, format).unwrap();
        let times: Vec<i64> = (0..history.prints().len()).map(|row| history.print_known_at(row).unwrap().0).collect();
        (times, history.notes()[0].count(Finding::KnownEarly), history.notes()[0].clock_offset())
    };
    assert_eq!(read(&lenient(&format(ClockOffset::default()))), (vec![5, 10, 20], 3, Some(0)));
    assert_eq!(read(&format(ClockOffset::Declared(5))), (vec![9, 12, 24], 0, Some(5)));
    assert_eq!(read(&format(ClockOffset::Estimated)), (vec![7, 10, 22], 0, Some(3)));
    let one_clock =
        FeedFormat { clock: FeedClock { known_at: None, offset: ClockOffset::Estimated }, ..FeedFormat::default() };
    assert!(History::read_trades(&behind.path, &one_clock).unwrap_err().to_string().contains("there is no second clock"));
}

#[test]
fn the_sides_of_a_book_and_of_a_taker_are_what_they_are_called() {
    let file = file("ts,side,price,size\n1,Bid,9,1\n2,sell,10,1\n");
    let history = History::read_depth(&file.path, &FeedFormat::default()).unwrap();
    assert_eq!(history.depth().iter().map(|change| change.side).collect::<Vec<_>>(), [Side::Buy, Side::Sell]);
}
