//! Sessions of `trueup paper`: a market of two instruments, and what is done to the process.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::command_scene::Folder;

/// Rows of each instrument in the larger scene.
pub const ROWS: usize = 1_500;

/// A walk that is the same at each call.
pub struct Walk(pub u64);

impl Walk {
    pub fn next(&mut self, of: u64) -> u64 {
        // Source: Knuth, "The Art of Computer Programming", volume 2, 3.3.4, the multiplier of MMIX.
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % of
    }
}

/// A row of quotes: time [ns], bid and ask [cents], sizes.
pub type Quote = (i64, u64, u64, u64, u64);

/// Quotes about once a second.
pub fn quotes(seed: u64) -> Vec<Quote> {
    let (mut walk, mut time, mut bid) = (Walk(seed), 1_709_908_200_000_000_000_i64, 10_000_u64);
    let quote = |_| {
        time += 500_000_000 + walk.next(1_000) as i64 * 1_000_000;
        bid = (bid + walk.next(7)).saturating_sub(3).max(5_000);
        (time, bid, bid + 1 + walk.next(2), 1 + walk.next(90), 1 + walk.next(90))
    };
    (0..ROWS).map(quote).collect()
}

pub fn price(cents: u64) -> String {
    format!("{}.{:02}", cents / 100, cents % 100)
}

pub fn csv(quotes: &[Quote]) -> String {
    quotes.iter().fold("ts,bid,bid_size,ask,ask_size\n".to_owned(), |mut text, (ts, bid, ask, bids, asks)| {
        let _ = writeln!(text, "{ts},{},{bids},{},{asks}", price(*bid), price(*ask));
        text
    })
}

/// The rows of both instruments as they come on standard input, numbered.
pub fn lines(all: &[(&str, Vec<Quote>)]) -> Vec<String> {
    let mut rows: Vec<(Quote, &str)> = all.iter().flat_map(|(s, quotes)| quotes.iter().map(|q| (*q, *s))).collect();
    rows.sort_by_key(|((time, ..), _)| *time);
    let line = |(k, ((ts, bid, ask, bids, asks), symbol)): (usize, &(Quote, &str))| {
        let (bid, ask, seq) = (price(*bid), price(*ask), k + 1);
        format!(
            "{{\"seq\": {seq}, \"symbol\": \"{symbol}\", \"kind\": \"quote\", \"ts\": {ts}, \"bid\": {bid}, \"bid_size\": {bids}, \"ask\": {ask}, \"ask_size\": {asks}}}"
        )
    };
    rows.iter().enumerate().map(line).collect()
}

pub const RUN: &str = r#"
[run]
seed = 11
cash = 1_000_000
currency = "USD"
max_leverage = 4

[[instrument]]
symbol = "A"
tick_size = 0.01
lot_size = 1

[[instrument]]
symbol = "B"
tick_size = 0.01
lot_size = 1

[[data]]
symbol = "A"
quotes = "a.csv"

[[data]]
symbol = "B"
quotes = "b.csv"

[strategy]
kind = "market_making"
gamma = 0.001
kappa = 50.0
sigma = 0.02
max_inventory = 100
size = 20
horizon = 3600
step = 2

[latency]
order = { kind = "uniform", least = 0.1, most = 0.4 }

[[mechanism]]
name = "commission"
bps = 0.5
"#;

pub fn scene() -> (Folder, Vec<String>) {
    let [a, b] = [3, 8].map(quotes);
    let folder = Folder::with(&[("run.toml", RUN), ("a.csv", &csv(&a)), ("b.csv", &csv(&b))]);
    let lines = lines(&[("A", a), ("B", b)]);
    (folder, lines)
}

pub fn paper(folder: &Folder, arguments: &str) -> Child {
    Command::new(assert_cmd::cargo::cargo_bin!("trueup"))
        .current_dir(folder.path(""))
        .args(format!("paper run.toml {arguments}").split_whitespace())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// The entries of a journal of one kind.
pub fn entries(folder: &Folder, out: &str, kind: &str) -> Vec<String> {
    let text = String::from_utf8_lossy(&folder.bytes(&format!("{out}/journal.jsonl"))).into_owned();
    let begins = format!("{{\"{kind}\"");
    let whole = &text[..text.rfind('\n').map_or(0, |end| end + 1)];
    whole.lines().filter_map(|line| line.get(9..)).filter(|entry| entry.starts_with(&begins)).map(str::to_owned).collect()
}

pub fn is_closed(folder: &Folder, out: &str) -> bool {
    folder.path(&format!("{out}/journal.jsonl")).exists() && !entries(folder, out, "closed").is_empty()
}

/// Feeds lines to a session on standard input, and gives its exit code and what it said.
pub fn fed(folder: &Folder, arguments: &str, lines: &[String]) -> (i32, String, String) {
    let mut child = paper(folder, arguments);
    let mut input = child.stdin.take().unwrap();
    let text = lines.join("\n") + "\n";
    let feeder = std::thread::spawn(move || drop(input.write_all(text.as_bytes())));
    let output = child.wait_with_output().unwrap();
    feeder.join().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// Waits until a session has sent some orders.
pub fn until_it_trades(folder: &Folder, out: &str) {
    let begun = Instant::now();
    while !folder.path(&format!("{out}/journal.jsonl")).exists() || entries(folder, out, "order").len() < 5 {
        assert!(begun.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(10));
    }
}

pub fn interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
}
