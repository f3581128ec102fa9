//! What a backtest on streamed ticks holds in memory does not grow with their number.

#![cfg(all(feature = "cli", target_os = "linux"))]
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use trueup::io::{OutputTable, Overwrite, write_table};
use trueup::sim2real::Timestamp;

const RUN: &str = "
[run]
seed = 1
cash = 1_000_000
currency = 'USD'
stream = true

[[instrument]]
symbol = 'XYZ'
tick_size = 0.01

[[data]]
symbol = 'XYZ'
quotes = 'quotes.parquet'

[strategy]
kind = 'buy_and_hold'

[[mechanism]]
name = 'half_spread'
fraction = 1.0
";

/// Writes `rows` quotes, ten a second.
fn write_quotes(path: &Path, rows: usize) {
    let bid = |k: usize| 100.0 + ((k / 7) % 50) as f64 * 0.01;
    let table = OutputTable::new()
        .times("ts", (0..rows).map(|k| Timestamp(k as i64 * Timestamp::NANOS / 10)))
        .floats("bid", (0..rows).map(bid))
        .floats("bid_size", (0..rows).map(|k| (1 + k % 9) as f64 * 100.0))
        .floats("ask", (0..rows).map(|k| bid(k) + 0.02))
        .floats("ask_size", (0..rows).map(|k| (1 + k % 8) as f64 * 100.0));
    write_table(path, &table, Overwrite::Refuse).unwrap();
}

/// The most memory a backtest of so many quotes held at once [MB].
fn most_held(rows: usize) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    write_quotes(&folder.path().join("quotes.parquet"), rows);
    fs::write(folder.path().join("run.toml"), RUN).unwrap();
    let mut child = Command::new(assert_cmd::cargo::cargo_bin!("trueup"))
        .current_dir(folder.path())
        .args(["backtest", "run.toml", "--json"])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut most = 0.0_f64;
    loop {
        // It is the most so far: what is read last, shortly before the end, counts.
        let text = fs::read_to_string(&status).unwrap_or_default();
        let held = text
            .lines()
            .find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.trim().parse::<f64>().ok());
        most = most.max(held.unwrap_or_default() / 1024.0);
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success());
            return most;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn ticks_of_any_number_are_run_in_the_same_memory() {
    let [short, long] = [300_000, 3_000_000].map(most_held);
    println!("300,000 quotes: {short:.0} MB; 3,000,000 quotes: {long:.0} MB");
    assert!(short > 1.0 && long < 200.0 && long < 1.25 * short + 8.0, "{short} MB, {long} MB");
}
