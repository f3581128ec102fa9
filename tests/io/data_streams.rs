//! Market data as streams: the same rows as of the whole file, in order, in memory that does not grow with the file.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test fails where a value is missing")]

use std::fmt::Debug;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use proptest::prelude::*;
use trueup::io::{FeedFormat, FeedRules, Layout, OnBad, Stamp, TableChunks};
use trueup::market::{Dated, FileStream, Finding, History, Stored, Stream, StreamError};
use trueup::sim2real::Timestamp;

const SECOND: i64 = Timestamp::NANOS;

/// All rows of a stream, or why it gives no more.
fn drained<T: Dated + Debug>(mut stream: impl Stream<T>) -> Result<Vec<T>, StreamError> {
    let mut rows = Vec::new();
    loop {
        let before = rows.len();
        let more = stream.refill(&mut rows)?;
        assert_eq!(more, rows.len() > before, "rows come until there are none");
        if !more {
            break;
        }
    }
    assert!(!stream.refill(&mut rows)?, "the end stays the end");
    assert!(rows.windows(2).all(|pair| pair[0].known_at() <= pair[1].known_at()));
    assert!(rows.iter().all(|row| row.time() <= row.known_at()));
    Ok(rows)
}

/// Holds a stream to give the same whatever the number of rows it reads at a time.
fn same_in_pieces<T: Dated + Debug + PartialEq, S: Stream<T>>(open: impl Fn(usize) -> S) -> Vec<T> {
    let whole = drained(open(TableChunks::ROWS)).unwrap();
    for rows in [1, 2, 3, 7, 50] {
        assert_eq!(drained(open(rows)).unwrap(), whole, "{rows} rows at a time");
    }
    whole
}

fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn lenient(format: FeedFormat) -> FeedFormat {
    let rules = FeedRules { on_bad: OnBad::Drop, reorder: Some(3 * SECOND), ..format.rules };
    FeedFormat { rules, ..format }
}

#[test]
fn bars_are_the_same_in_pieces_and_reach_no_further_than_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "ts,open,high,low,close,volume\n".to_owned();
    for k in 0..40_i64 {
        // Some minutes are missing, one bar comes early, one cannot be.
        let minute = k + k / 7 * 3;
        let second = 60 * minute - i64::from(k == 20) * 25;
        let close = if k == 11 { "nan".to_owned() } else { format!("{}", 11 + k % 2) };
        writeln!(text, "{},10,12,9,{close},5", second * SECOND).unwrap();
    }
    let path = write(folder.path(), "bars.csv", &text);
    for stamp in [Stamp::Open, Stamp::Close] {
        let rules = FeedRules { on_bad: OnBad::Drop, ..FeedRules::default() };
        let format = FeedFormat { stamp: Some(stamp), rules, ..FeedFormat::default() };
        let bars = same_in_pieces(|rows| FileStream::bars(&path, &format, Some(60 * SECOND), rows).unwrap());
        assert_eq!(bars.len(), 39);
        assert!(bars.windows(2).all(|pair| pair[0].known_at <= pair[1].open_at));
        assert!(bars.iter().any(|bar| bar.known_at - bar.open_at == 35 * SECOND));
        assert_eq!(History::read_bars(&path, &format, Some(60 * SECOND)).unwrap().bars(), bars);
        assert_eq!(History::read_bars(&path, &format, None).unwrap().bars(), bars, "most are a minute apart");
    }
    let format = FeedFormat { stamp: Some(Stamp::Open), ..FeedFormat::default() };
    let error = FileStream::bars(&path, &format, None, 10).unwrap_err().to_string();
    assert!(error.contains("needs their `stamp` and their `interval`"), "{error}");
}

#[test]
fn quotes_trades_and_books_are_the_same_in_pieces() {
    let folder = tempfile::tempdir().unwrap();
    let (mut quotes, mut trades) = ("ts,bid,bid_size,ask,ask_size\n".to_owned(), "ts,price,size,aggressor\n".to_owned());
    let mut depth = "ts,side,price,size\n".to_owned();
    let mut orders = "ts,order_id,action,side,price,size\n".to_owned();
    for k in 0..120_i64 {
        // Times go back by 2 s now and then, and once by more than is put in order.
        let second = k - 2 * i64::from(k % 9 == 0) - 6 * i64::from(k == 50);
        let ts = (100 + second) * SECOND;
        let crossed = if k % 17 == 3 { 98 } else { 101 };
        writeln!(quotes, "{ts},99,5,{crossed},{}", k % 5).unwrap();
        writeln!(trades, "{ts},{},{},buy", 100 + k % 3, k % 4).unwrap();
        writeln!(depth, "{ts},{},{},{}", ["bid", "ask"][k as usize % 2], 90 + k % 20, k % 6).unwrap();
        let action = ["add", "change", "delete", "delete"][k as usize % 4];
        writeln!(orders, "{ts},{},{action},bid,{},{}", k / 4, 90 + k % 20, 1 + k % 6).unwrap();
    }
    let format = lenient(FeedFormat::default());
    let path = write(folder.path(), "quotes.csv", &quotes);
    let rows = same_in_pieces(|rows| FileStream::quotes(&path, &format, None, rows).unwrap());
    let history = History::read_quotes(&path, &format).unwrap();
    let notes = &history.notes()[0];
    assert_eq!(rows.len(), history.quotes().len());
    assert!([Finding::Crossed, Finding::Reordered, Finding::Late].iter().all(|finding| notes.count(*finding) > 0));
    let path = write(folder.path(), "trades.csv", &trades);
    let rows = same_in_pieces(|rows| FileStream::trades(&path, &format, rows).unwrap());
    let prints = History::read_trades(&path, &format).unwrap();
    assert_eq!(rows.iter().map(|row| row.what).collect::<Vec<_>>(), prints.prints());
    let path = write(folder.path(), "depth.csv", &depth);
    let rows = same_in_pieces(|rows| FileStream::depth(&path, &format, rows).unwrap());
    assert_eq!(rows, History::read_depth(&path, &format).unwrap().depth());
    let path = write(folder.path(), "orders.csv", &orders);
    let format = lenient(FeedFormat::of_layout(Layout::TrueupOrders));
    let rows = same_in_pieces(|rows| FileStream::order_events(&path, &format, rows).unwrap());
    assert_eq!(rows, History::read_order_events(&path, &format).unwrap().order_events());
}

#[test]
fn an_error_ends_a_stream_and_names_the_row_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "trades.csv", "ts,price,size\n1,9,1\n2,9,1\n3,9,1\n2,9,1\n5,9,1\n");
    let mut stream = FileStream::trades(&path, &FeedFormat::default(), 3).unwrap();
    let mut rows = Vec::new();
    assert!(stream.refill(&mut rows).unwrap());
    let error = stream.refill(&mut rows).unwrap_err();
    let StreamError::Input(input) = &error else { unreachable!("of a file") };
    assert_eq!((input.path.as_path(), input.column.as_deref()), (path.as_path(), Some("ts")));
    let text = "row 5, column `ts`: expected at least the 1970-01-01T00:00:00.000000003Z of row 4, found 1970-01-01T00:00:00.000000002Z";
    assert!(error.to_string().contains(text), "{error}");
    assert!(!stream.refill(&mut rows).unwrap() && rows.len() == 3);
}

#[test]
fn rows_in_memory_are_a_stream_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "depth.csv", "ts,side,price,size\n1,bid,9,1\n2,bid,9,1\n3,ask,10,1\n");
    let rows = History::read_depth(&path, &FeedFormat::default()).unwrap().depth().to_vec();
    assert_eq!(drained(Stored::new(rows.clone(), 2).unwrap()).unwrap(), rows);
    let back: Vec<_> = rows.into_iter().rev().collect();
    assert!(Stored::new(back, 2).unwrap_err().to_string().contains("does not follow"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Whatever the order in the file and the window: what comes out is in order, the same in pieces, and no row is lost
    /// without being counted.
    #[test]
    fn any_order_is_put_in_order_or_counted(seconds in prop::collection::vec(0_i64..30, 1..40), window in 1_i64..20, rows in 1_usize..9) {
        let folder = tempfile::tempdir().unwrap();
        let text: String = seconds.iter().enumerate().map(|(k, s)| format!("{},{},1\n", s * SECOND, k + 1)).collect();
        let path = write(folder.path(), "trades.csv", &("ts,price,size\n".to_owned() + &text));
        let rules = FeedRules { on_bad: OnBad::Drop, reorder: Some(window * SECOND), ..FeedRules::default() };
        let format = FeedFormat { rules, ..FeedFormat::default() };
        let given = drained(FileStream::trades(&path, &format, rows).unwrap()).unwrap();
        let whole = History::read_trades(&path, &format).unwrap();
        prop_assert_eq!(given.iter().map(|row| row.what).collect::<Vec<_>>(), whole.prints());
        // By the definition: a row is late where it is more than the window behind the latest before it.
        let mut newest = i64::MIN;
        let late = seconds.iter().filter(|s| { let late = newest.saturating_sub(window) > **s; newest = newest.max(**s); late }).count();
        prop_assert_eq!(whole.notes()[0].count(Finding::Late), late as u64);
        prop_assert_eq!(given.len() + late, seconds.len());
        prop_assert!(given.windows(2).all(|p| p[0].known_at < p[1].known_at || p[0].what.price < p[1].what.price), "rows of one time stay as they came");
    }
}

const PATH: &str = "TRUEUP_TEST_STREAMS";

/// What the process has had in memory at most [kB], where the system tells.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Runs in a process of its own, which the test below starts.
#[test]
#[ignore = "started by `what_a_stream_holds_does_not_grow_with_the_file`"]
fn streams_and_says_its_peak() {
    let Some(path) = std::env::var_os(PATH) else { return };
    let rules = FeedRules { reorder: Some(SECOND), ..FeedRules::default() };
    let mut stream = FileStream::trades(path, &FeedFormat { rules, ..FeedFormat::default() }, TableChunks::ROWS).unwrap();
    let (mut rows, mut count) = (Vec::new(), 0_u64);
    while stream.refill(&mut rows).unwrap() {
        count += rows.len() as u64;
        rows.clear();
    }
    assert_eq!(count, stream.notes().rows());
    println!("peak {}", peak().unwrap_or_default());
}

#[test]
fn what_a_stream_holds_does_not_grow_with_the_file() {
    if peak().is_none() {
        println!("skipped: this system does not tell the peak of a process");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let [once, ten_times] = [150_000_i64, 1_500_000].map(|count| {
        let path = folder.path().join(format!("{count}.csv"));
        let mut file = std::io::BufWriter::new(std::fs::File::create(&path).unwrap());
        writeln!(file, "ts,price,size,aggressor").unwrap();
        (0..count).for_each(|k| writeln!(file, "{},{},{},buy", k * 1_000_000, 100 + k % 9, 1 + k % 7).unwrap());
        drop(file);
        let mut child = Command::new(std::env::current_exe().unwrap());
        child.args(["--exact", "data_streams::streams_and_says_its_peak", "--ignored", "--nocapture"]);
        let output = child.env(PATH, &path).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let found = text.lines().find_map(|line| line.split("peak ").nth(1)?.trim().parse::<u64>().ok());
        let size = std::fs::metadata(&path).unwrap().len() / 1024;
        let found = found.unwrap_or_else(|| panic!("the child says no peak: {text}"));
        println!("{count} trades, {size} kB: peak {found} kB");
        found
    });
    assert!(ten_times < once + 12_000, "{once} kB grow to {ten_times} kB");
}
