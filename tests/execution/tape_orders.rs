//! Orders made out of a tape's files: what is written, whether a diagnosis reads it, and what is said of bad files.

#![cfg(feature = "io")]
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use trueup::io::{InputError, OutputFolder, Overwrite, Table, TwinFile};
use trueup::market::tape_orders::{LeftOut, Selection, TapeFolder, TapeReading, TapeSettings, TapeSources, Thinning};
use trueup::market::{Quantity, execution_twin};
use trueup::sim2real::diagnose::{Diagnosis, Verdict, diagnose};
use trueup::sim2real::{Seed, Timestamp};

/// Asks of 1 at 101 and 2 at 102, a bid of 9 at 99; 2.5 are bought a second later, all within one stamp.
const ORDERS: &str = "ts,order_id,action,side,price,size\n\
    1000000000,1,add,ask,101,1\n1000000000,2,add,ask,102,2\n1000000000,3,add,ask,105,5\n1000000000,4,add,bid,99,9\n\
    2000000000,9,add,bid,110,2.5\n2000000000,1,delete,ask,101,0\n2000000000,9,change,bid,110,1.5\n\
    2000000000,2,change,ask,102,0.5\n2000000000,9,delete,bid,110,0\n\
    3000000000,10,add,ask,101,7\n9000000000,11,add,bid,98,1\n";
/// The same market as trades beside quotes.
const TRADES: &str = "ts,price,size,aggressor\n\
    2000000000,101,1,buy\n2000000000,102,1.5,buy\n4000000000,99,1,sell\n4000000000,98.5,1,\n";
const QUOTES: &str = "ts,bid,bid_size,ask,ask_size,ask2,ask2_size\n\
    1000000000,99,9,101,1,102,2\n2000000000,99,9,102,0.5,105,5\n9000000000,99,9,102,0.5,105,5\n";

struct Scene(TempDir);

impl Scene {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            fs::write(folder.path().join(name), text).unwrap();
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn import(&self, files: &[&str], selection: Selection) -> Result<(TapeReading, PathBuf), InputError> {
        let paths: Vec<PathBuf> = files.iter().map(|name| self.path(name)).collect();
        let out = self.path("out");
        import(&paths, &out, TapeSettings { apart: 0, ..TapeSettings::default() }, selection).map(|reading| (reading, out))
    }

    /// The error of these files, with the folder's path left out.
    fn error(&self, files: &[&str]) -> String {
        let error = self.import(files, Selection::default()).unwrap_err().to_string();
        assert!(!self.path("out").exists(), "nothing half written");
        let folder = self.0.path().display().to_string();
        error.replace(&format!("{folder}/"), "").replace(&folder, "FOLDER")
    }
}

fn import(paths: &[PathBuf], out: &Path, settings: TapeSettings, selection: Selection) -> Result<TapeReading, InputError> {
    let sources = TapeSources::find(paths)?;
    let output = OutputFolder::create(out, Overwrite::Refuse)?;
    let mut folder = TapeFolder::create(output, "XYZ", settings.levels, selection)?;
    let reading = sources.read(settings, &mut folder)?;
    folder.finish(&sources, &reading)?;
    Ok(reading)
}

/// What each order of a written folder costs beyond the touch [bps], by the twin that is written beside it.
fn costs(out: &Path) -> Vec<Option<f64>> {
    let twin = TwinFile::read(out.join("assumed.toml")).unwrap();
    let (_, recordings) = execution_twin(&twin, &[out.to_path_buf()]).unwrap();
    recordings[0].channel("cost").unwrap().samples.clone()
}

/// The book is that before the order, though all of it has one stamp.
#[test]
fn an_order_and_its_executions_are_written_beside_the_book_it_met() {
    let scene = Scene::new(&[("tape.csv", ORDERS)]);
    let (reading, out) = scene.import(&["tape.csv"], Selection::default()).unwrap();
    assert_eq!((reading.counts.orders, reading.counts.fills, reading.notes.len()), (1, 2, 0));
    let orders = Table::read(out.join("orders.parquet")).unwrap();
    assert_eq!(orders.texts_complete("type").unwrap(), ["market"]);
    assert_eq!(orders.times("decided_at", &Default::default()).unwrap(), [Timestamp(1_999_999_999)]);
    assert_eq!(orders.floats_complete("qty").unwrap(), [2.5]);
    let fills = Table::read(out.join("fills.parquet")).unwrap();
    assert_eq!(fills.floats_complete("price").unwrap(), [101.0, 102.0]);
    let quotes = Table::read(out.join("quotes.parquet")).unwrap();
    assert_eq!(quotes.floats("ask").unwrap(), [Some(101.0), Some(102.0), Some(101.0), Some(101.0)]);
    assert_eq!(quotes.floats("ask2_size").unwrap(), [Some(2.0), Some(5.0), Some(0.5), Some(0.5)]);
    // (1 * 101 + 1.5 * 102) / 2.5 = 101.6 against a touch of 101 and a mid of 100.
    let cost = costs(&out)[0].unwrap();
    assert!((cost - 60.0).abs() < 1e-9, "{cost}");
}

#[test]
fn trades_beside_quotes_are_the_same_order_and_the_twin_knows_tick_and_lot() {
    let scene = Scene::new(&[("t.csv", TRADES), ("q.csv", QUOTES)]);
    let (reading, out) = scene.import(&["t.csv", "q.csv"], Selection::default()).unwrap();
    assert_eq!((reading.counts.orders, reading.counts.left_out(LeftOut::NoAggressor)), (2, 1));
    assert_eq!(reading.counts.at_touch, 2, "the quote of the same stamp is not the one that was met");
    assert_eq!(costs(&out).iter().map(|cost| (cost.unwrap() * 1e6).round() / 1e6).collect::<Vec<_>>(), [60.0, 0.0]);
    let twin = TwinFile::read(out.join("assumed.toml")).unwrap();
    let instrument = &twin.instruments[0];
    // Of 99, 98.5, 101, 102; and of 1 and 1.5.
    assert_eq!((instrument.tick_size, instrument.lot_size), (0.5, 0.5));
    // 4.5 in 8 s.
    assert!((instrument.average_daily_volume.unwrap() - 4.5 / 8.0 * 86_400.0).abs() < 1e-6);
    let again = Scene::new(&[("t.csv", TRADES), ("q.csv", QUOTES)]);
    let (_, other) = again.import(&["t.csv", "q.csv"], Selection::default()).unwrap();
    for name in trueup::market::tape_orders::TAPE_FILES {
        assert_eq!(fs::read(out.join(name)).unwrap(), fs::read(other.join(name)).unwrap(), "{name}");
    }
}

#[test]
fn what_is_asked_for_is_written_and_no_more() {
    let trades: String = (0..40).map(|k| format!("{},101,{},buy\n", 2_000_000_000_i64 + k * 1_000, k + 1)).collect();
    let trades = format!("ts,price,size,aggressor\n{trades}");
    let ids = |selection: Selection| {
        let scene = Scene::new(&[("t.csv", &trades), ("q.csv", QUOTES)]);
        let (_, out) = scene.import(&["t.csv", "q.csv"], selection).unwrap();
        let ids = Table::read(out.join("orders.parquet")).unwrap().texts_complete("order_id").unwrap();
        let fills = Table::read(out.join("fills.parquet")).unwrap().texts_complete("order_id").unwrap();
        assert_eq!(ids, fills);
        ids.iter().map(|id| id.parse().unwrap()).collect::<Vec<u32>>()
    };
    let whole = Selection::default();
    assert_eq!(ids(whole).len(), 40);
    assert_eq!(ids(Selection { thinning: Thinning::Every(15), ..whole }), [1, 16, 31]);
    assert_eq!(ids(Selection { thinning: Thinning::AtMost(5), ..whole }), [1, 9, 17, 25, 33]);
    let smallest = Quantity::nearest(38.5).unwrap();
    assert_eq!(ids(Selection { smallest, ..whole }), [39, 40]);
    let (start, end) = (Timestamp(2_000_001_500), Timestamp(2_000_004_000));
    assert_eq!(ids(Selection { start, end, ..whole }), [3, 4, 5]);
}

#[test]
fn files_that_make_no_tape_are_refused_with_a_remedy() {
    let scene = Scene::new(&[
        ("t.csv", TRADES),
        ("again.csv", TRADES),
        ("q.csv", QUOTES),
        ("orders.csv", ORDERS),
        ("bars.csv", "ts,open,high,low,close,volume\n1,1,1,1,1,1\n"),
        ("empty.csv", "ts,price,size\n"),
        ("snapshot.csv", "local_ns,exch_T_ms,last_update_id,side,price,qty\n1,1,1,bid,1,1\n"),
        ("nobody.csv", "ts,price,size\n2000000000,101,1\n"),
        ("early.csv", "ts,price,size,aggressor\n1,101,1,buy\n"),
        ("crossed.csv", "ts,bid,bid_size,ask,ask_size\n1000000000,103,9,101,1\n1500000000,102,9,101,1\n"),
        ("cut.csv", "ts,price,size,aggressor\n2000000000,101,1,buy\n2000000001,10"),
        ("word.csv", "ts,price,size,aggressor\n2000000000,many,1,buy\n"),
    ]);
    let mut told = String::new();
    for files in [
        &["t.csv"][..],
        &["q.csv"],
        &["t.csv", "again.csv", "q.csv"],
        &["orders.csv", "q.csv"],
        &["bars.csv"],
        &["empty.csv", "q.csv"],
        &["t.csv", "snapshot.csv"],
        &["nobody.csv", "q.csv"],
        &["early.csv", "q.csv"],
        &["t.csv", "crossed.csv"],
        &["cut.csv", "q.csv"],
        &["word.csv", "q.csv"],
        &["missing.csv"],
    ] {
        told += &format!("{}\n{}\n\n", files.join(" "), scene.error(files));
    }
    insta::assert_snapshot!(told);
}

/// Rows that cannot be are left out and counted, and the others count.
#[test]
fn rows_that_cannot_be_are_counted() {
    let trades =
        "ts,price,size,aggressor\n2000000000,101,1,buy\n2500000000,101,-1,buy\n3000000000,0,1,buy\n4000000000,102,1,buy\n";
    let quotes = "ts,bid,bid_size,ask,ask_size\n1000000000,99,9,101,1\n1500000000,102,9,101,1\n9000000000,99,9,101,1\n";
    let scene = Scene::new(&[("t.csv", trades), ("q.csv", quotes)]);
    let (reading, _) = scene.import(&["t.csv", "q.csv"], Selection::default()).unwrap();
    assert_eq!((reading.counts.orders, reading.counts.at_touch, reading.counts.worse_than_touch), (2, 1, 1));
    assert_eq!(
        reading.notes,
        [
            "trades: 1 of 4 rows have a price that cannot be, and are left out",
            "trades: 1 of 4 rows have a size that cannot be, and are left out",
            "quotes: 1 of 3 rows have a bid above the ask or levels out of order, and are left out",
        ]
    );
}

#[test]
fn a_tape_of_parquet_is_refused_wherever_it_is_cut() {
    let scene = Scene::new(&[("t.csv", TRADES), ("q.csv", QUOTES)]);
    let (_, out) = scene.import(&["t.csv", "q.csv"], Selection::default()).unwrap();
    let whole = fs::read(out.join("trades.parquet")).unwrap();
    fs::remove_dir_all(&out).unwrap();
    for part in 1..10 {
        fs::write(scene.path("cut.parquet"), &whole[..whole.len() * part / 10]).unwrap();
        let told = scene.error(&["cut.parquet", "q.csv"]);
        assert!(told.starts_with("cut.parquet: "), "{told}");
    }
}

/// The folder of real tapes; none, which is said, where it is not at hand.
fn shared(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/market").join(name);
    if !folder.is_dir() {
        println!("SKIPPED: there is no ../shared/data/market/{name}");
        return None;
    }
    Some(folder)
}

/// The diagnosis of a real tape's orders against the touch.
fn diagnosed(folder: &Path, selection: Selection) -> (TapeReading, Diagnosis) {
    let scratch = tempfile::tempdir().unwrap();
    let out = scratch.path().join("out");
    let reading = import(&[folder.to_path_buf()], &out, TapeSettings::default(), selection).unwrap();
    let twin = TwinFile::read(out.join("assumed.toml")).unwrap();
    let (assembly, recordings) = execution_twin(&twin, &[out]).unwrap();
    (reading, diagnose(&assembly, &recordings, &[], Seed(0), &|_, _, _| {}).diagnosis)
}

/// Five hours of Bitstamp, order by order: what the touch leaves out is the walk through the book, to the last digit.
#[test]
fn the_orders_of_an_order_by_order_tape_name_the_walk_through_the_book() {
    let Some(folder) = shared("bitstamp_l3_2015") else { return };
    let (reading, found) = diagnosed(&folder, Selection::default());
    assert_eq!((reading.counts.orders, reading.counts.market), (368, 287));
    let names: Vec<&str> = found.effects.iter().map(|effect| effect.mechanism.as_str()).collect();
    assert_eq!((names, found.verdict), (vec!["book_walk"], Verdict::Named), "{}", found.summary);
    let fit = found.fit.iter().find(|fit| fit.channel == "cost").unwrap();
    assert!(fit.improvement_ci95[0] > 0.9 && fit.trued_mae < 1e-6, "{fit:?}");
}

/// Six minutes of Binance's futures: trades beside a book that is told every 50 ms, and the best of it at once.
#[test]
fn the_orders_of_trades_beside_a_book_name_the_walk_through_the_book() {
    let Some(folder) = shared("binance_20240808") else { return };
    let (reading, found) = diagnosed(&folder, Selection::default());
    let counts = &reading.counts;
    assert!(counts.orders > 1_900 && counts.at_touch * 1_000 > counts.orders * 995, "{counts:?}");
    assert!(counts.left_out(LeftOut::SharedStamp) > 100 && counts.left_out(LeftOut::TooSoon) > 3_000, "{counts:?}");
    let names: Vec<&str> = found.effects.iter().map(|effect| effect.mechanism.as_str()).collect();
    assert_eq!((names, found.verdict), (vec!["book_walk"], Verdict::Named), "{}", found.summary);
    assert!((found.effects[0].parameters["fraction"].value - 1.0).abs() < 0.05, "{:?}", found.effects[0]);
    let fit = found.fit.iter().find(|fit| fit.channel == "cost").unwrap();
    assert!(fit.improvement_ci95[0] > 0.3, "{fit:?}");
}
