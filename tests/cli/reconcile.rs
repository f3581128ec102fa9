//! `trueup reconcile` as it is called: what it prints, writes and ends with.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use trueup::io::{OutputFolder, OutputTable, Overwrite, Table, TimeFormat};
use trueup::sim2real::Timestamp;

struct Scene(tempfile::TempDir);

impl Scene {
    /// A backtest of the project's own bars, and one of the same strategy under other costs and a delay: the paper log.
    fn new() -> Self {
        let scene = Self(tempfile::tempdir().unwrap());
        let bars = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/bars");
        std::fs::copy(bars.join("bars.parquet"), scene.path("bars.parquet")).unwrap();
        let run = std::fs::read_to_string(bars.join("run.toml")).unwrap();
        std::fs::write(scene.path("run.toml"), &run).unwrap();
        let dearer = run.replace("bps = 1.0", "bps = 2.5").replace("per_share = 0.005", "per_share = 0.01");
        assert_ne!(run, dearer);
        std::fs::write(scene.path("dearer.toml"), dearer).unwrap();
        for (run, out) in [("run.toml", "own"), ("dearer.toml", "paper")] {
            assert_eq!(scene.call(&["backtest", run, "--out", out]).status.code(), Some(0));
        }
        scene
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn call(&self, arguments: &[&str]) -> Output {
        Command::cargo_bin("trueup").unwrap().current_dir(self.0.path()).args(arguments).output().unwrap()
    }

    fn reconciled(&self, more: &[&str]) -> (Option<i32>, String, String) {
        let first = ["reconcile", "--backtest", "own"];
        let output = self.call(&[&first, more].concat());
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (output.status.code(), text(output.stdout), text(output.stderr))
    }
}

const PAPER: [&str; 3] = ["--paper", "paper/orders.parquet", "paper/fills.parquet"];

#[test]
fn a_backtest_reconciles_with_itself_whatever_the_bounds() {
    let scene = Scene::new();
    let own = ["--paper", "own/orders.parquet", "own/fills.parquet", "--run", "run.toml"];
    let none =
        ["--tolerance", "unmatched=0", "--tolerance", "price_bps=0", "--tolerance", "fee_bps=0", "--tolerance", "gap=0"];
    let (code, told, errors) = scene.reconciled(&[&own[..], &none].concat());
    assert_eq!((code, errors.as_str()), (Some(0), ""), "{told}");
    assert!(told.starts_with("All 195 orders are in both. Profit and loss is the same"), "{told}");
    assert!(!told.contains("is it the run that made the backtest"), "{told}");
}

#[test]
fn what_parts_further_than_a_bound_fails_and_says_why() {
    let scene = Scene::new();
    std::fs::write(scene.path("bounds.toml"), "unmatched = 0\nmean_price_bps = 1.0\nfee_bps = 0.1\n").unwrap();
    let more = ["--run", "run.toml", "--tolerance", "bounds.toml", "--tolerance", "fee_bps=1", "--out", "told"];
    let (code, told, errors) = scene.reconciled(&[&PAPER[..], &more].concat());
    assert_eq!((code, errors.as_str()), (Some(1), ""), "{told}");
    let junit = std::fs::read_to_string(scene.path("told/junit.xml")).unwrap();
    assert!(junit.contains("tests=\"3\" failures=\"1\"") && junit.contains("name=\"mean_price_bps\">"), "{junit}");
    let page = std::fs::read_to_string(scene.path("told/report.html")).unwrap();
    assert!(page.contains("1 beyond bounds") && page.contains("What made the gap"));
    let found: serde_json::Value =
        serde_json::from_slice(&std::fs::read(scene.path("told/reconcile.json")).unwrap()).unwrap();
    assert_eq!((&found["schema"], &found["counts"]["pairs"]), (&"trueup.reconcile/1".into(), &195.into()));
    let causes: Vec<&str> =
        found["gaps"][0]["causes"].as_array().unwrap().iter().map(|cause| cause["cause"].as_str().unwrap()).collect();
    assert_eq!(causes, ["sizing", "price", "fees"]);
    // Half of the difference of a commission of half a cent a share, and 1.5 bps of price.
    let mean =
        found["orders"].as_array().unwrap().iter().map(|order| order["price_bps"].as_f64().unwrap()).sum::<f64>() / 195.0;
    assert!((mean - 1.5).abs() < 0.05, "{mean}");

    let before = std::fs::read(scene.path("told/report.html")).unwrap();
    let (code, _, errors) = scene.reconciled(&[&PAPER[..], &["--out", "told"]].concat());
    assert!(code == Some(2) && errors.contains("--force"), "{errors}");
    assert_eq!(std::fs::read(scene.path("told/report.html")).unwrap(), before);
}

/// Times of another zone are put right by themselves; other offsets only where the user says that they are of clocks.
#[test]
fn a_zone_is_put_right_and_a_clock_where_it_is_said_to_be_one() {
    let scene = Scene::new();
    let tables = ["orders", "fills"].map(|what| Table::read(scene.path(&format!("own/{what}.parquet"))).unwrap());
    let shifted = |seconds: i64| {
        let of = |table: &Table, columns: [&str; 5]| {
            let time = |column: &str| table.times(column, &TimeFormat::default()).unwrap();
            let moved = time(columns[0]).into_iter().map(|at| at + seconds * Timestamp::NANOS);
            let text = |column: &str| table.texts_complete(column).unwrap();
            let mut out = OutputTable::new().times(columns[0], moved);
            for column in &columns[1..4] {
                out = out.texts(column, text(column));
            }
            out.texts(columns[4], text(columns[4]))
        };
        let mut folder = OutputFolder::create(scene.path("shifted"), Overwrite::Force).unwrap();
        let orders = of(&tables[0], ["decided_at", "order_id", "symbol", "side", "qty"]);
        let orders = orders.texts("type", tables[0].texts_complete("type").unwrap());
        folder.table("orders.parquet", &orders).unwrap();
        folder.table("fills.parquet", &of(&tables[1], ["filled_at", "order_id", "qty", "price", "fee"])).unwrap();
        folder.finish().unwrap();
    };
    let reconciled = |more: &[&str]| {
        let paper = ["--paper", "shifted/orders.parquet", "shifted/fills.parquet", "--run", "run.toml", "--json"];
        let (code, told, errors) = scene.reconciled(&[&paper[..], more].concat());
        assert_eq!((code, errors.as_str()), (Some(0), ""));
        let found: serde_json::Value = serde_json::from_str(&told).unwrap();
        let moved =
            found["notes"].as_array().unwrap().iter().any(|note| note.as_str().unwrap().contains("its times are moved"));
        (found["counts"]["pairs"].as_u64().unwrap(), moved, found["gaps"][0]["causes"].as_array().unwrap().len())
    };
    shifted(5 * 3_600);
    assert_eq!(reconciled(&[]), (195, true, 0));
    shifted(70);
    let (pairs, moved, causes) = reconciled(&[]);
    assert!(pairs == 195 && !moved && causes > 0);
    assert_eq!(reconciled(&["--correct-clock"]), (195, true, 0));
}

#[test]
fn an_order_that_is_missing_is_told() {
    let scene = Scene::new();
    let csv = "order_id,symbol,decided_at,side,qty,type\na,XYZ,2024-08-05T14:52:00Z,buy,100,market\n";
    std::fs::write(scene.path("orders.csv"), csv).unwrap();
    std::fs::write(scene.path("fills.csv"), "order_id,filled_at,qty,price,fee\na,2024-08-05T14:53:00Z,100,100,1\n").unwrap();
    let given = ["--paper", "orders.csv", "fills.csv", "--tolerance", "unmatched=0.5", "--json"];
    let (code, told, errors) = scene.reconciled(&given);
    assert_eq!((code, errors.as_str()), (Some(1), ""));
    let found: serde_json::Value = serde_json::from_str(&told).unwrap();
    let counts = &found["counts"];
    assert_eq!((&counts["pairs"], &counts["only_backtest"]), (&1.into(), &194.into()), "{counts}");
}

#[test]
fn bad_input_is_told_with_what_would_be_right() {
    let scene = Scene::new();
    std::fs::write(scene.path("bad.toml"), "pricebps = 1\n").unwrap();
    std::fs::write(scene.path("other.toml"), std::fs::read_to_string(scene.path("run.toml")).unwrap().replace("XYZ", "ABC"))
        .unwrap();
    let tried: [(&[&str], &str); 7] = [
        (&["--tolerance", "price=1"], "there is no bound `price`"),
        (&["--tolerance", "price_bps=-1"], "has to be a number of at least 0"),
        (&["--tolerance", "price_bps=NaN"], "has to be a number of at least 0"),
        (&["--tolerance", "bad.toml"], "pricebps"),
        (&["--tolerance", "gone.toml"], "gone.toml"),
        (&["--format", "alpacca"], "did you mean `alpaca`?"),
        (&["--run", "gone.toml"], "gone.toml"),
    ];
    for (more, expected) in tried {
        let (code, told, errors) = scene.reconciled(&[&PAPER[..], more].concat());
        assert_eq!((code, told.as_str()), (Some(2), ""), "{more:?}");
        assert!(errors.contains(expected) && errors.contains("hint:"), "{more:?}: {errors}");
    }
    let (code, told, errors) = scene.reconciled(&[&PAPER[..], &["--run", "other.toml"]].concat());
    assert_eq!((code, told.as_str()), (Some(2), ""));
    assert!(errors.contains("the run trades nothing of the paper log: XYZ") && errors.contains("it has `ABC`"), "{errors}");
    // Another run than the one that made the backtest is found out by what it makes of the backtest's own orders.
    let (_, told, _) = scene.reconciled(&[&PAPER[..], &["--run", "dearer.toml"]].concat());
    assert!(told.replace("\n  ", " ").contains("is it the run that made the backtest?"), "{told}");
    let output = scene.call(&["reconcile", "--backtest", ".", "--paper", "paper"]);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && errors.contains("there is no orders table"), "{errors}");
}

/// An engine of others, once as an ideal venue and once with 300 ms of latency and a tick of slippage in three of ten orders: both
/// are found, beside the order that the end of the data kept from its fill; no spread is, for both pay it.
#[test]
fn latency_and_slippage_of_another_engine_are_found() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/market");
    let logs = data.join("logs/nautilus_example");
    if !logs.exists() {
        println!("skipped: there is no {}", logs.display());
        return;
    }
    let scene = Scene(tempfile::tempdir().unwrap());
    let of = |which: &str| {
        ["orders", "fills"].map(|what| logs.join(format!("{which}_{what}_report.csv")).to_str().unwrap().to_owned())
    };
    let ([orders, fills], [late_orders, late_fills]) = (of("ideal"), of("lat300ms_slip30"));
    let imported = scene.call(&["data", "import", &orders, &fills, "--out", "own"]);
    assert_eq!(imported.status.code(), Some(0));
    let quotes = data.join("binance_20240808/usdm_btcusdt_book_ticker.parquet");
    let run = format!(
        "[run]\nseed = 1\ncash = 10_000_000\ncurrency = \"USDT\"\n\n[[instrument]]\nsymbol = \"BTCUSDT-PERP.BINANCE\"\n\
         tick_size = 0.1\nlot_size = 0.001\n\n[[data]]\nsymbol = \"BTCUSDT-PERP.BINANCE\"\nquotes = \"{}\"\n\
         layout = \"binance_book_ticker\"\nclock_offset = \"estimate\"\n\n[strategy]\nkind = \"buy_and_hold\"\n\n\
         [[mechanism]]\nname = \"half_spread\"\nfraction = 1.0\n\n[[mechanism]]\nname = \"commission\"\nbps = 1.8\n",
        quotes.display()
    );
    std::fs::write(scene.path("run.toml"), run).unwrap();
    let (code, told, errors) = scene.reconciled(&["--paper", &late_orders, &late_fills, "--run", "run.toml", "--json"]);
    assert_eq!((code, errors.as_str()), (Some(0), ""));
    let found: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(found["counts"]["pairs"], 24);
    let causes = found["gaps"][0]["causes"].as_array().unwrap();
    let amount = |name: &str| {
        causes.iter().find(|cause| cause["cause"] == name).map_or(0.0, |cause| cause["amount"].as_f64().unwrap())
    };
    println!("{causes:#?}");
    assert!(amount("latency").abs() > 1.0 && amount("queue_fill").abs() > 1.0);
    // A tick of 0.1 on half a coin, in three of ten of 24 orders, is 0.36.
    assert!((-0.8..-0.1).contains(&amount("impact")), "{}", amount("impact"));
    assert!(amount("spread").abs() < 0.1 && amount("signal") == 0.0 && amount("sizing") == 0.0);
}

/// The loop closes: on orders that no diagnosis has seen, what the backtest left out of an exchange of agents with 250 ms of
/// latency makes a gap; with the mechanisms that diagnosis names there (tests/real_recordings.rs) the simulator makes of every order
/// what the exchange made of it.
#[test]
fn with_what_was_left_out_the_gap_of_held_out_orders_closes() {
    let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/market/abides/02_market_lat250ms_q50");
    if !log.exists() {
        println!("skipped: there is no {}", log.display());
        return;
    }
    let scene = Scene(tempfile::tempdir().unwrap());
    let run = format!(
        // The last 30 % in time of the log.
        "[run]\nseed = 1\ncash = 1_000_000_000\ncurrency = \"USD\"\nmax_leverage = 100.0\nstart = \"2021-02-05T10:55:20Z\"\n\n\
         [[instrument]]\nsymbol = \"ABM\"\ntick_size = 0.01\nlot_size = 1\n\n\
         [[data]]\nsymbol = \"ABM\"\nquotes = \"{}\"\n\n[strategy]\nkind = \"buy_and_hold\"\n",
        log.join("quotes.parquet").display()
    );
    let found = "\n[[mechanism]]\nname = \"half_spread\"\nfraction = 1.0\n\n[[mechanism]]\nname = \"book_walk\"\nfraction = 1.0\n\n\
                 [[mechanism]]\nname = \"command_delay\"\nseconds = 0.25\n";
    std::fs::write(scene.path("before.toml"), &run).unwrap();
    std::fs::write(scene.path("after.toml"), run + found).unwrap();
    let [orders, fills] = ["orders.csv", "fills.csv"].map(|name| log.join(name).to_str().unwrap().to_owned());
    let gap = |run: &str| {
        let output = scene.call(&["reconcile", "--run", run, "--paper", &orders, &fills, "--json"]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let differ = found["orders"].as_array().unwrap().iter().filter(|order| order["price_bps"] != 0.0).count();
        (found["counts"]["pairs"].as_u64().unwrap(), differ, found["gaps"][0]["gap"].as_f64().unwrap())
    };
    let (before, after) = (gap("before.toml"), gap("after.toml"));
    println!("orders, of these at another price, gap: {before:?} before, {after:?} after");
    assert!(before.0 > 150 && before.1 > 30 && before.2.abs() > 10.0, "{before:?}");
    assert_eq!((after.0, after.1, after.2), (before.0, 0, 0.0));
}
