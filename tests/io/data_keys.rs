//! The keys of [[data]]: what they become, and how each is refused where it does not belong.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use trueup::io::{ClockOffset, FeedRules, Layout, OnBad, RunFile, Stamp};
use trueup::sim2real::Timestamp;

const SECOND: i64 = Timestamp::NANOS;

/// A run whose one section of data has these keys; the files are there, and empty.
fn run(keys: &str) -> Result<RunFile, String> {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.csv", "b.csv"] {
        std::fs::write(folder.path().join(name), "").unwrap();
    }
    let text = format!(
        "[run]\nseed = 1\ncash = 1\ncurrency = 'USD'\nend = 2024-01-02T00:00:00Z\n[[instrument]]\nsymbol = 'X'\ntick_size = 0.01\n\
         lot_size = 1\n[strategy]\nkind = 'buy_and_hold'\n[[data]]\nsymbol = 'X'\n{keys}\n"
    );
    let path = folder.path().join("run.toml");
    std::fs::write(&path, text).unwrap();
    RunFile::read(&path).map_err(|error| error.to_string())
}

#[test]
fn the_keys_become_a_format() {
    let keys = "book = 'a.csv'\nlayout = 'binance_depth'\nsnapshot = 'b.csv'\nclock_offset = 'estimate'\non_bad = 'drop'\n\
                reorder = '500ms'\nmax_gap = '5m'";
    let file = run(keys).unwrap();
    let format = &file.data[0].format;
    assert_eq!((format.layout, format.clock.offset), (Layout::BinanceDepth, ClockOffset::Estimated));
    let rules = FeedRules {
        on_bad: OnBad::Drop,
        reorder: Some(SECOND / 2),
        max_gap: Some(300 * SECOND),
        until: Some(Timestamp(1_704_153_600 * SECOND)),
    };
    assert_eq!(format.rules, rules);
    assert!(format.snapshot.as_ref().unwrap().ends_with("b.csv") && format.snapshot.as_ref().unwrap().is_absolute());
    let format = &run("trades = 'a.csv'\nknown_at = 'seen'\nclock_offset = 1.28").unwrap().data[0].format;
    assert_eq!(format.clock.known_at.as_deref(), Some("seen"));
    assert_eq!(format.clock.offset, ClockOffset::Declared(1_280_000_000));
    assert_eq!((format.layout, format.rules.on_bad), (Layout::Trueup, OnBad::Refuse));
    let format = &run("bars = 'a.csv'\nlayout = 'lean'\nzone = 'America/New_York'").unwrap().data[0].format;
    assert_eq!((format.stamp, format.price_scale), (Some(Stamp::Open), 1e-4));
    let format = &run("bars = 'a.csv'\nlayout = 'lean'\nzone = 'UTC'\nprice_scale = 1").unwrap().data[0].format;
    assert_eq!(format.price_scale, 1.0);
    assert_eq!(
        run("quotes = 'a.csv'\nlayout = 'lean'\nzone = 'UTC'\ninterval = '1m'").unwrap().data[0].interval,
        Some(60 * SECOND)
    );
}

#[test]
fn keys_that_do_not_belong_are_refused_at_their_place() {
    for (keys, message) in [
        ("book = 'a.csv'\nlayout = 'binance'", "15:10: unknown value `binance`"),
        ("quotes = 'a.csv'\nlayout = 'binance_depth'", "15:1: a file of `quotes` is not of the layout `binance_depth`"),
        ("book = 'a.csv'\nsnapshot = 'b.csv'", "15:1: only the layout `binance_depth` has a `snapshot`"),
        (
            "book = 'a.csv'\nlayout = 'binance_depth'\nsnapshot = 'c.csv'",
            "16:1: names the file c.csv, but there is no such file",
        ),
        ("trades = 'a.csv'\nlayout = 'binance_trades'\nknown_at = 'x'", "16:1: the layout says when a row was known"),
        ("bars = 'a.csv'\nstamp = 'open'\nknown_at = 'x'", "16:1: a bar is known when it ends"),
        ("trades = 'a.csv'\nclock_offset = 1", "15:1: there is no second clock to be offset"),
        ("trades = 'a.csv'\nknown_at = 'x'\nclock_offset = 'guess'", "16:16: expected a clock offset, found \"guess\""),
        ("trades = 'a.csv'\nknown_at = 'x'\nclock_offset = nan", "16:16: expected a clock offset, found NaN"),
        ("bars = 'a.csv'\nstamp = 'open'\nreorder = '1s'", "16:1: bars are not put in order"),
        ("trades = 'a.csv'\nreorder = '0s'", "15:11: expected a span of time, found \"0s\""),
        ("trades = 'a.csv'\nmax_gap = '1 week'", "15:11: expected a span of time"),
        ("trades = 'a.csv'\non_bad = 'ignore'", "15:10: unknown value `ignore`"),
        ("trades = 'a.csv'\nlayout = 'lean'", "15:1: the times of the layout `lean` are local, and nothing says where"),
        (
            "bars = 'a.csv'\nlayout = 'lean'\nzone = 'UTC'\nstamp = 'close'",
            "17:1: the layout `lean` stamps a bar at its open",
        ),
        ("book = 'a.csv'\nlayout = 'databento_mbo'\nprice_scale = 2", "16:1: the layout says what a price is worth"),
        ("trades = 'a.csv'\ninterval = '1m'", "15:1: only bars have an `interval`"),
    ] {
        let error = run(keys).unwrap_err();
        assert!(error.contains(&format!("run.toml:{message}")) && error.contains("hint:"), "{keys}\n{error}");
    }
}
