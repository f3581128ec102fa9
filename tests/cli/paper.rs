//! `trueup paper`: the same bits as a backtest, whatever stops it and however often.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::io::Write as _;
use std::time::{Duration, Instant};

use crate::command_scene::Folder;
use crate::session_scene::{RUN, Walk, entries, fed, interrupt, is_closed, paper, scene, until_it_trades};

/// Runs a session that is killed at random instants until it comes to its end; gives how often it was killed.
fn killed_over_and_over(folder: &Folder, out: &str, arguments: &str, feed: Option<&[String]>, walk: &mut Walk) -> usize {
    let (mut kills, begun) = (0, Instant::now());
    loop {
        assert!(begun.elapsed() < Duration::from_secs(900), "it comes to no end");
        if is_closed(folder, out) {
            return kills;
        }
        let journal = folder.path(&format!("{out}/journal.jsonl"));
        let resume = if journal.exists() { "--resume" } else { "" };
        let known = if journal.exists() { entries(folder, out, "line").len() } else { 0 };
        let mut child = paper(folder, &format!("--out {out} {arguments} {resume}"));
        let mut input = child.stdin.take().unwrap();
        let rows = feed.map(<[String]>::to_vec).unwrap_or_default();
        let feeder = std::thread::spawn(move || {
            for (k, row) in rows.iter().enumerate() {
                // Who feeds begins anew: what is known already comes at once, what is new in its own time.
                if k > known && k.is_multiple_of(10) {
                    std::thread::sleep(Duration::from_millis(4));
                }
                if writeln!(input, "{row}").is_err() {
                    return;
                }
            }
        });
        // Longer each time: what was done before is done again first, and takes as long as the machine lets it.
        let life = Duration::from_millis(20 + walk.next(200) + 60 * kills as u64);
        let until = Instant::now() + life;
        let ended = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break Some(status);
            }
            if Instant::now() >= until {
                break None;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        if ended.is_none() {
            // SIGKILL: nothing of the process gets to say a word.
            child.kill().unwrap();
            kills += 1;
        }
        let output = child.wait_with_output().unwrap();
        feeder.join().unwrap();
        if ended.is_none() && kills.is_multiple_of(4) {
            holds_what_it_rests_on(folder, out, &format!("{out}-after-{kills}"), feed.is_some());
        }
        if let Some(status) = ended {
            assert!(status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            assert!(is_closed(folder, out));
            return kills;
        }
    }
}

/// A journal alone is enough to come to every order and fill in it: what they follow from was there before them.
fn holds_what_it_rests_on(folder: &Folder, out: &str, into: &str, lines: bool) {
    let [orders, fills] = ["order", "fill"].map(|kind| entries(folder, out, kind).len());
    if orders == 0 {
        return;
    }
    let feed = if lines { "--feed -" } else { "" };
    let (code, _, err) = folder.run(&format!("paper run.toml --out {out} {feed} --export {into}"));
    assert_eq!(code, 0, "{err}");
    let summary: serde_json::Value = serde_json::from_slice(&folder.bytes(&format!("{into}/run.json"))).unwrap();
    let counted = |what: &str| summary["counts"][what].as_u64().unwrap() as usize;
    assert!(counted("orders") >= orders && counted("fills") >= fills, "{}", summary["counts"]);
}

fn same_tables(folder: &Folder, one: &str, other: &str) {
    for table in ["orders.parquet", "fills.parquet", "equity.parquet"] {
        let [one, other] = [one, other].map(|out| folder.bytes(&format!("{out}/{table}")));
        assert!(one == other, "{table}");
    }
}

#[test]
fn killed_at_any_instant_it_comes_to_the_same_orders_and_fills() {
    let (folder, lines) = scene();
    assert_eq!(folder.run("backtest run.toml --out backtest").0, 0);
    let (code, _, err) = folder.run("paper run.toml --out undisturbed --speed max");
    assert_eq!(code, 0, "{err}");
    same_tables(&folder, "backtest", "undisturbed");
    let [orders, fills] = ["order", "fill"].map(|kind| entries(&folder, "undisturbed", kind));
    assert!(orders.len() > 100 && fills.len() > 20, "{} orders, {} fills", orders.len(), fills.len());

    let mut walk = Walk(20_240_308);
    let mut kills = 0;
    // 1500 s of quotes at this speed take two and a half seconds.
    let ways = [
        ("killed-files", "--speed 600", None),
        ("killed-synced", "--speed 600 --sync always", None),
        ("killed-lines", "--feed -", Some(lines.as_slice())),
        ("killed-lines-synced", "--feed - --sync always", Some(lines.as_slice())),
    ];
    // A fast machine comes to the end before it has been killed often: then once more.
    for (round, (out, arguments, feed)) in (0..5).flat_map(|round| ways.map(|way| (round, way))) {
        if round > 0 && kills >= 30 {
            break;
        }
        let out = &if round == 0 { out.to_owned() } else { format!("{out}-{round}") };
        let times = killed_over_and_over(&folder, out, arguments, feed, &mut walk);
        println!("{out}: killed {times} times, {} orders, {} fills", orders.len(), fills.len());
        same_tables(&folder, "backtest", out);
        // None lost, none twice, and each after the same event.
        assert_eq!(entries(&folder, out, "order"), orders, "{out}");
        assert_eq!(entries(&folder, out, "fill"), fills, "{out}");
        kills += times;
    }
    println!("killed {kills} times in all");
    assert!(kills >= 30, "{kills}");
    let (code, told, err) = folder.run("reconcile --backtest backtest --paper killed-lines");
    assert!(code == 0 && told.contains("Profit and loss is the same"), "{told}{err}");
}

#[test]
fn rows_that_cannot_be_are_told_with_line_key_and_value_and_left_out() {
    let (folder, lines) = scene();
    assert_eq!(folder.run("backtest run.toml --out backtest").0, 0);
    let mut odd = lines.clone();
    let at = "\"symbol\": \"A\", \"kind\": \"quote\", \"ts\": 1709908300000000000, ";
    let sizes = "\"bid_size\": 1, \"ask\": 100, \"ask_size\": 1}";
    let bad = [
        "nonsense".to_owned(),
        "[1, 2]".to_owned(),
        format!("{{{at}\"bid\": -3, {sizes}"),
        format!("{{{at}\"bid\": \"x\", {sizes}"),
        format!("{{{at}\"bid\": 101, {sizes}"),
        format!("{{{at}{sizes}"),
        "{\"symbol\": \"AA\", \"kind\": \"quote\", \"ts\": 1}".to_owned(),
        "{\"symbol\": \"A\", \"kind\": \"trade\", \"ts\": 1}".to_owned(),
        "{\"symbol\": \"A\", \"kind\": \"quote\", \"ts\": 1, \"bid\": 1, \"bid_size\": 1, \"ask\": 2, \"ask_size\": 1}"
            .to_owned(),
        "{\"symbol\": \"A\", \"ts\": 1}".to_owned(),
        "{\"symbol\": \"A\", \"kind\": \"quote\"}".to_owned(),
    ];
    let place = 400;
    bad.iter().rev().for_each(|row| odd.insert(place, row.clone()));
    let (code, told, err) = fed(&folder, "--out odd --feed -", &odd);
    assert_eq!(code, 0, "{err}");
    assert_eq!(err.matches("left out: ").count(), bad.len(), "{err}");
    insta::assert_snapshot!("left_out", err);
    assert!(told.contains(&format!("{} taken, {} left out, 0 known already", lines.len(), bad.len())), "{told}");
    same_tables(&folder, "backtest", "odd");

    let (code, told, err) = fed(&folder, "--out strict --feed - --strict", &odd);
    assert_eq!((code, told.as_str()), (2, ""));
    assert!(err.contains("standard input:401:") && err.contains("hint: "), "{err}");
}

#[test]
fn what_is_beyond_a_limit_is_refused_with_a_reason_of_its_own() {
    let (folder, _) = scene();
    let with = |name: &str, paper: &str| std::fs::write(folder.path(name), format!("{RUN}\n[paper]\n{paper}")).unwrap();
    let summary = |out: &str| String::from_utf8(folder.bytes(&format!("{out}/run.json"))).unwrap();
    let cases = [
        ("order", "max_order = 10", "order_limit"),
        ("position", "max_position = 30", "position_limit"),
        ("value", "max_position_value = 3_000", "position_limit"),
        ("rate", "orders_a_minute = 5", "order_rate"),
    ];
    for (out, paper, reason) in cases {
        with("limited.toml", paper);
        let (code, told, err) = folder.run(&format!("paper limited.toml --speed max --out {out}"));
        assert_eq!(code, 0, "{err}");
        assert!(summary(out).contains(reason) && told.contains("Orders refused: "), "{told}");
        let refusals = entries(&folder, out, "refusal");
        assert!(!refusals.is_empty() && refusals.iter().all(|entry| entry.contains(reason)), "{out}");
        // A minute of the feed has no more orders than are allowed.
        if out == "rate" {
            let at =
                |entry: &String| serde_json::from_str::<serde_json::Value>(entry).unwrap()["order"]["decided_at"].as_i64();
            let times: Vec<i64> = entries(&folder, out, "order").iter().filter_map(at).collect();
            assert!(times.len() > 5 && times.windows(6).all(|six| six[5] - six[0] >= 60_000_000_000));
        }
    }
    // Limits that nothing comes near change no bit.
    with("wide.toml", "max_order = 1e6\nmax_position = 1e6\norders_a_minute = 100_000\nmax_loss = 1e6\nmax_drawdown = 1e6");
    assert_eq!(folder.run("paper wide.toml --speed max --out wide").0, 0);
    assert_eq!(folder.run("backtest run.toml --out backtest").0, 0);
    same_tables(&folder, "backtest", "wide");
}

#[test]
fn trading_stops_where_too_much_was_lost() {
    let (folder, _) = scene();
    for (on_loss, flat) in [("cancel", false), ("flatten", true)] {
        let paper = format!("{RUN}\n[paper]\nmax_drawdown = 20\non_loss = \"{on_loss}\"\n");
        std::fs::write(folder.path("loss.toml"), paper).unwrap();
        let (code, _, err) = folder.run(&format!("paper loss.toml --speed max --out {on_loss}"));
        assert_eq!(code, 0, "{err}");
        assert!(err.contains("trading stopped at ") && err.contains("`max_drawdown` allows 20"), "{err}");
        let orders = entries(&folder, on_loss, "order");
        let markets = orders.iter().filter(|order| order.contains("\"type\":\"market\"")).count();
        assert_eq!(markets > 0, flat, "{on_loss}");
        if flat {
            let mut held = std::collections::BTreeMap::<String, i64>::new();
            for fill in entries(&folder, on_loss, "fill") {
                let fill = serde_json::from_str::<serde_json::Value>(&fill).unwrap()["fill"].clone();
                let sign = if fill["side"] == "buy" { 1 } else { -1 };
                *held.entry(fill["symbol"].to_string()).or_default() += sign * fill["qty"].as_i64().unwrap();
            }
            assert!(held.values().all(|held| *held == 0), "{held:?}");
        }
    }
}

#[test]
fn ctrl_c_and_the_kill_file_end_it_with_nothing_left_working() {
    let (folder, lines) = scene();
    std::fs::write(folder.path("run.toml"), format!("{RUN}\n[paper]\nkill_file = \"stop\"\n")).unwrap();
    for (out, arguments, by_file) in
        [("interrupted", "--speed 300", false), ("killed", "--speed 300", true), ("waiting", "--feed -", false)]
    {
        let mut child = paper(&folder, &format!("--out {out} {arguments}"));
        let mut input = child.stdin.take().unwrap();
        if out == "waiting" {
            input.write_all((lines[..800].join("\n") + "\n").as_bytes()).unwrap();
        }
        until_it_trades(&folder, out);
        if by_file {
            std::fs::write(folder.path("stop"), "").unwrap()
        } else {
            interrupt(&child)
        }
        let output = child.wait_with_output().unwrap();
        let told = String::from_utf8(output.stdout).unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let why = if by_file { "the kill file appeared" } else { "it was interrupted" };
        assert!(told.contains(&format!("The session has ended: {why}.")), "{told}");
        assert!(is_closed(&folder, out));
        let summary: serde_json::Value = serde_json::from_slice(&folder.bytes(&format!("{out}/run.json"))).unwrap();
        assert_eq!(summary["counts"]["unfilled"], 0, "{}", summary["counts"]);
        let refused = folder.refused(&format!("paper run.toml --out {out} {arguments} --resume"));
        assert!(refused.contains("exists") || refused.contains("has ended") || refused.contains("kill file"), "{refused}");
        if by_file {
            assert!(folder.refused("paper run.toml --out more").contains("the kill file is there already"));
            std::fs::remove_file(folder.path("stop")).unwrap();
        }
    }
}

#[test]
fn another_run_is_not_gone_on_with_and_damage_is_told() {
    let (folder, _) = scene();
    let mut child = paper(&folder, "--out log --speed 300");
    until_it_trades(&folder, "log");
    assert!(folder.refused("paper run.toml --out log --resume").contains("another process writes this journal"));
    child.kill().unwrap();
    child.wait().unwrap();
    let journal = folder.path("log/journal.jsonl");
    assert!(folder.refused("paper run.toml --out log").contains("--resume"));
    assert!(folder.refused("paper run.toml --out log --feed - --resume").contains("the files of RUN.toml"));
    assert!(folder.refused("paper run.toml --out nowhere --resume").contains("cannot be read"));

    // The tables as far as it came, and the session as it was.
    let before = std::fs::read(&journal).unwrap();
    assert_eq!(folder.run("paper run.toml --out log --export so-far").0, 0);
    assert!(folder.path("so-far/fills.parquet").exists() && std::fs::read(&journal).unwrap() == before);

    std::fs::write(folder.path("run.toml"), RUN.replace("seed = 11", "seed = 12")).unwrap();
    assert!(folder.refused("paper run.toml --out log --resume").contains("another RUN.toml"));
    std::fs::write(folder.path("run.toml"), RUN).unwrap();

    let quotes = String::from_utf8(folder.bytes("a.csv")).unwrap();
    let changed = quotes.replacen(",100.", ",99.", 1);
    std::fs::write(folder.path("a.csv"), changed).unwrap();
    assert!(folder.refused("paper run.toml --out log --resume --speed max").contains("have changed since"));
    std::fs::write(folder.path("a.csv"), quotes).unwrap();

    let mut damaged = before.clone();
    damaged[before.len() / 2] ^= 1;
    std::fs::write(&journal, &damaged).unwrap();
    let refused = folder.refused("paper run.toml --out log --resume");
    assert!(refused.contains("journal.jsonl:") && refused.contains("damaged"), "{refused}");

    // An outcome that was changed, with the checksum made right again: the engine does not do what the log says.
    let text = String::from_utf8(before.clone()).unwrap();
    let line = text.lines().find(|line| line[9..].starts_with("{\"order\"")).unwrap();
    let other = line[9..].replace("\"side\":\"buy\"", "\"side\":\"BUY\"").replace("\"side\":\"sell\"", "\"side\":\"SELL\"");
    let other = format!("{:08x} {other}", crc32fast::hash(other.as_bytes()));
    std::fs::write(&journal, text.replacen(line, &other, 1)).unwrap();
    let refused = folder.refused("paper run.toml --out log --resume --speed max");
    assert!(refused.contains("does not do what it did"), "{refused}");

    // Torn anywhere, it is cut and gone on with.
    std::fs::write(&journal, &before[..before.len() - 7]).unwrap();
    let (code, _, err) = folder.run("paper run.toml --out log --resume --speed max");
    assert!(code == 0 && err.contains("were torn, and are cut") && err.contains("resumed after "), "{err}");
    assert_eq!(folder.run("backtest run.toml --out backtest").0, 0);
    same_tables(&folder, "backtest", "log");
}

#[test]
fn limits_that_cannot_be_are_told_with_their_place() {
    let (folder, _) = scene();
    let cases = [
        "max_order = 0",
        "max_loss = -1",
        "max_position = nan",
        "max_postion = 3",
        "on_loss = \"panic\"",
        "orders_a_minute = 0",
    ];
    let mut told = String::new();
    for paper in cases {
        std::fs::write(folder.path("bad.toml"), format!("{RUN}\n[paper]\n{paper}\n")).unwrap();
        told += &folder.refused("paper bad.toml --out bad");
        assert!(!folder.path("bad").exists());
    }
    insta::assert_snapshot!("limits_refused", told);
}

#[test]
fn every_kind_of_row_is_on_standard_input_what_it_is_in_a_file() {
    let start = 1_709_908_200_000_000_000_i64;
    let (mut files, mut rows) = ([String::new(), String::new(), String::new()], Vec::new());
    files[0] += "ts,open,high,low,close,volume\n";
    files[1] += "ts,price,size,aggressor\n";
    files[2] += "ts,side,price,size\n";
    let mut walk = Walk(5);
    for k in 0..200_i64 {
        let ts = start + k * 60_000_000_000;
        let [open, close] = [0, 0].map(|_: i32| 100 + walk.next(9));
        let (high, low, volume) = (open.max(close) + 1, open.min(close) - 1, walk.next(500));
        files[0] += &format!("{ts},{open}.5,{high}.5,{low}.5,{close}.5,{volume}\n");
        rows.push((ts + 60_000_000_000, format!(
            "\"symbol\": \"A\", \"kind\": \"bar\", \"ts\": {ts}, \"open\": {open}.5, \"high\": {high}.5, \"low\": {low}.5, \"close\": {close}.5, \"volume\": {volume}"
        )));
        let (ts, size) = (ts + 1_000_000_000, 1 + walk.next(50));
        files[1] += &format!("{ts},99.75,{size},sell\n");
        rows.push((ts, format!("\"symbol\": \"B\", \"kind\": \"trade\", \"ts\": {ts}, \"price\": 99.75, \"size\": {size}, \"aggressor\": \"sell\"")));
        for (side, price) in [("buy", "99.75"), ("sell", "100.25")] {
            let ts = ts + 5;
            files[2] += &format!("{ts},{side},{price},{size}\n");
            rows.push((ts, format!("\"symbol\": \"B\", \"kind\": \"depth\", \"ts\": \"{ts}\", \"side\": \"{side}\", \"price\": {price}, \"size\": {size}")));
        }
    }
    rows.sort_by_key(|(time, _)| *time);
    let lines: Vec<String> = rows.iter().map(|(_, row)| format!("{{{row}}}")).collect();
    let run = RUN.split("[[data]]").next().unwrap().to_owned()
        + "[[data]]\nsymbol = \"A\"\nbars = \"bars.csv\"\nstamp = \"open\"\ninterval = \"1m\"\n[[data]]\nsymbol = \"B\"\ntrades = \"trades.csv\"\n\
           [[data]]\nsymbol = \"B\"\nbook = \"book.csv\"\n[strategy]\nkind = \"sma_cross\"\nfast = 3\nslow = 7\n";
    let [bars, trades, book] = &files;
    let folder = Folder::with(&[("run.toml", &run), ("bars.csv", bars), ("trades.csv", trades), ("book.csv", book)]);
    assert_eq!(folder.run("backtest run.toml --out backtest").0, 0);
    for file in ["bars.csv", "trades.csv", "book.csv"] {
        std::fs::remove_file(folder.path(file)).unwrap();
    }
    let (code, told, err) = fed(&folder, "--out lines --feed -", &lines);
    assert_eq!((code, err.as_str()), (0, ""), "{told}");
    assert!(entries(&folder, "lines", "fill").len() > 10);
    same_tables(&folder, "backtest", "lines");
}
