//! Logs that are cut, doubled, contradictory or no logs at all; and that what is imported is the same when it is written and
//! imported again.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails where a value is missing")]

use std::fs;
use std::path::{Path, PathBuf};

use crate::paper_scene::{Written, new_york, read, sample};
use proptest::prelude::*;
use trueup::io::{OutputFolder, Overwrite, TwinFile};
use trueup::market::paper::import::{FORMATS, ImportSettings, SymbolMap, import};
use trueup::market::paper::{
    Charge, FillOrigin, FindingKind, Liquidity, OrderWords, PaperFill, PaperLog, PaperOrder, PaperStatus, SourcePlace,
};
use trueup::market::{Cash, Price, Quantity, Side, execution_logs};
use trueup::sim2real::Timestamp;

const ORDERS: &str = "order_id,symbol,decided_at,side,qty,type,limit_price\n\
                      a,X,2024-03-08T15:00:00Z,buy,10,limit,100.5\n\
                      b,X,2024-03-08T15:01:00Z,sell,5,market,\n";
const FILLS: &str =
    "order_id,filled_at,qty,price,fee\na,2024-03-08T15:00:01Z,10,100.25,0.01\nb,2024-03-08T15:01:01Z,5,100,0\n";

fn log(orders: &str, fills: &str) -> Written {
    Written::new("orders.csv", orders).and("fills.csv", fills)
}

#[test]
fn files_that_are_cut_off_are_refused_with_their_place() {
    let plain = ImportSettings::default();
    let cut = log(ORDERS, &FILLS[..FILLS.len() - 8]);
    let mut told = vec![cut.error(&plain)];
    let json = fs::read_to_string(sample("alpaca_activities.json")).unwrap();
    told.push(Written::new("a.json", &json[..700]).error(&plain));
    let xml = fs::read_to_string(sample("flex.xml")).unwrap();
    told.push(Written::new("a.xml", &xml[..1500]).error(&new_york()));
    // Of newline JSON only the line that is cut is lost.
    let lines = fs::read_to_string(sample("binance_stream.jsonl")).unwrap();
    let cut = Written::new("a.jsonl", &lines[..lines.len() - 100]);
    told.extend(cut.unread());
    insta::assert_snapshot!(told.join("\n"), @r#"
    fills.csv: row 3: expected 5 cells, as in the header, found 3
      hint: was the file cut off while it was written?
    a.json:4:136: expected JSON (EOF while parsing a string)
      hint: the file is cut off: fetch it again
    a.xml:9:196: expected well-formed XML (syntax error: tag not closed: `>` not found before end of input)
      hint: the file is cut off or damaged: fetch it again
    a.jsonl: row 4: expected a JSON object (EOF while parsing a string), found "{\"stream\":\"listenKey\",\"data\":{\"e\":\"executionReport\",\"E\":1709"
    "#);
    // What a database has lost is not made up.
    let database = Written::database("a.sqlite", "CREATE TABLE orders (ft_order_side, ft_pair, order_id, ft_trade_id)");
    let bytes = fs::read(database.path().join("a.sqlite")).unwrap();
    assert!(Written::new("a.sqlite", &bytes[..bytes.len() / 2]).error(&plain).contains("expected an SQLite database"));
}

#[test]
fn rows_that_cannot_be_read_are_told_one_by_one() {
    let orders = format!(
        "{ORDERS}c,X,2024-03-08T15:02:00Z,hold,1,market,\nd,X,noon,buy,1,market,\ne,X,2024-03-08T15:02:00Z,buy,\"1,5\",market,\n\
                          f,X,2024-03-08T15:02:00Z,buy,99999999999,market,\n,X,2024-03-08T15:02:00Z,buy,1,market,\n"
    );
    let fills = format!(
        "{FILLS}b,2024-03-08T15:01:02Z,5,$100,0\nb,2024-03-08T15:01:02Z,-5,100,0\nb,2024-03-08T15:01:02Z,5,,0\nb,,5,100,0\n"
    );
    insta::assert_snapshot!(log(&orders, &fills).unread().join("\n"), @r#"
    orders.csv: row 4, column `side`: expected a side, buy or sell, found "hold"
    orders.csv: row 5, column `decided_at`: expected nanoseconds since 1970 or a time by RFC 3339, found "noon"
    orders.csv: row 6, column `qty`: expected a decimal number, found "1,5"
    orders.csv: row 7, column `qty`: the number is beyond what is held, found "99999999999"
    orders.csv: row 8, column `order_id`: expected a value, the cell is empty
    fills.csv: row 4, column `price`: expected a decimal number, found "$100"
    fills.csv: row 5, column `qty`: expected a quantity above 0, found "-5"
    fills.csv: row 6, column `price`: expected a value, the cell is empty
    fills.csv: row 7, column `filled_at`: expected a value, the cell is empty
    "#);
}

#[test]
fn what_contradicts_itself_is_counted_with_both_places() {
    let orders = "order_id,symbol,decided_at,side,qty,type,filled_qty\n\
                  a,X,2024-03-08T15:00:00Z,buy,10,limit,9\nb,X,2024-03-08T15:01:00Z,sell,5,market,1\n\
                  a,X,2024-03-08T15:00:00Z,buy,10,limit,9\nb,X,2024-03-08T15:01:00Z,sell,6,market,1\n\
                  c,X,2024-03-08T15:03:00Z,buy,1,market,1\n";
    let fills = "order_id,fill_id,filled_at,qty,price,fee,symbol\n\
                 a,1,2024-03-08T15:00:01Z,6,100.25,0,X\na,1,2024-03-08T15:00:01Z,6,100.25,0,X\na,1,2024-03-08T15:00:01Z,7,100.25,0,X\n\
                 a,2,2024-03-08T14:59:59Z,6,100.25,0,X\nz,3,2024-03-08T15:00:01Z,1,100,0,X\n,4,2024-03-08T15:00:01Z,1,100,0,X\n";
    let log = log(orders, fills).import(&ImportSettings::default()).unwrap();
    use FindingKind as F;
    let found = |kind| log.findings.count(kind);
    assert_eq!((log.orders.len(), log.fills.len()), (3, 4));
    assert_eq!((found(F::Duplicate), found(F::RestatedOrder), found(F::ConflictingFill)), (2, 1, 1));
    assert_eq!((found(F::FillWithoutOrder), found(F::OrderWithoutFill), found(F::FilledOtherwise)), (2, 2, 1));
    assert_eq!((found(F::Overfilled), found(F::TimesOutOfOrder), found(F::UnreadRow)), (1, 1, 0));
    let early = log.findings.of(F::TimesOutOfOrder)[0].to_string();
    assert!(early.contains("is filled 1.000000 s before its first time"), "{early}");
}

#[test]
fn a_format_is_told_by_content_or_refused_with_what_was_looked_for() {
    let plain = ImportSettings::default();
    let unknown = Written::new("a.csv", "x,y\n1,2\n").error(&plain);
    for format in FORMATS {
        assert!(unknown.contains(format.id), "{}", format.id);
    }
    assert!(
        unknown.starts_with("the log is of no format that is known") || unknown.contains("with the keys x, y"),
        "{unknown}"
    );
    let both = import(&[sample("ccxt_orders.json"), sample("binance_stream.jsonl")], &plain).unwrap_err().to_string();
    assert!(both.contains("of several formats: binance (") && both.contains("hint: name the files of one log"), "{both}");
    let with = |format: &str| ImportSettings { format: Some(format.into()), ..ImportSettings::default() };
    assert_eq!(
        import(&[sample("ccxt_orders.json"), sample("binance_stream.jsonl")], &with("ccxt")).unwrap().orders.len(),
        3
    );
    let wrong = import(&[sample("ccxt_orders.json")], &with("alpaca")).unwrap_err().to_string();
    assert!(
        wrong.contains("this is no log of alpaca") && wrong.contains("known by orders with `client_order_id`"),
        "{wrong}"
    );
    let mistyped = import(&[sample("ccxt_orders.json")], &with("alpacca")).unwrap_err().to_string();
    assert!(mistyped.contains("did you mean `alpaca`?"), "{mistyped}");
    let empty = tempfile::tempdir().unwrap();
    assert!(import(&[empty.path().to_path_buf()], &plain).unwrap_err().to_string().contains("hint: logs are"));
    assert!(import(&[PathBuf::from("no/such/log.json")], &plain).is_err());
}

#[test]
fn a_day_without_fills_is_a_log() {
    let log = log(ORDERS, "order_id,filled_at,qty,price,fee\n").import(&ImportSettings::default()).unwrap();
    assert_eq!((log.orders.len(), log.fills.len()), (2, 0));
    let folder = tempfile::tempdir().unwrap();
    let again = read(&[write(&log, folder.path(), "parquet")]);
    assert_eq!(without_places(again), without_places(log));
}

/// Writes a log as the command does; gives the folder.
fn write(log: &PaperLog, folder: &Path, ending: &str) -> PathBuf {
    let path = folder.join("log");
    let mut output = OutputFolder::create(&path, Overwrite::Force).unwrap();
    output.table(&format!("orders.{ending}"), &log.orders_table()).unwrap();
    output.table(&format!("fills.{ending}"), &log.fills_table()).unwrap();
    output.finish().unwrap();
    path
}

/// What must be the same in another file: not where things stood, nor what was odd in reading.
fn without_places(mut log: PaperLog) -> (Vec<PaperOrder>, Vec<PaperFill>) {
    log.orders.iter_mut().for_each(|order| order.place = SourcePlace::default());
    log.fills.iter_mut().for_each(|fill| fill.place = SourcePlace::default());
    (log.orders, log.fills)
}

#[test]
fn a_diagnosis_reads_the_same_from_a_log_that_was_imported() {
    let set = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/execution");
    let folder = tempfile::tempdir().unwrap();
    let imported = write(&read(std::slice::from_ref(&set)), folder.path(), "parquet");
    let twin = TwinFile::read(set.join("twin.toml")).unwrap();
    let [ours, theirs] = [imported, set].map(|folder| execution_logs(&twin, &[folder]).unwrap().remove(0));
    assert_eq!((ours.time, ours.measured), (theirs.time, theirs.measured));
}

#[test]
fn every_sample_is_the_same_when_written_and_imported_again() {
    let samples: [&[&str]; 6] = [
        &["alpaca_orders.json", "alpaca_activities.json"],
        &["flex.xml"],
        &["trades_pure_mm.csv"],
        &["binance_stream.jsonl"],
        &["ccxt_orders.json"],
        &["alpaca_orders.json"],
    ];
    for names in samples {
        let paths: Vec<PathBuf> = names.iter().map(|name| sample(name)).collect();
        let log = import(&paths, &new_york()).unwrap();
        let meanings = |log: &PaperLog| -> Vec<_> { log.clocks.iter().map(|clock| (clock.column, clock.meaning)).collect() };
        for ending in ["parquet", "csv"] {
            let folder = tempfile::tempdir().unwrap();
            let again = read(&[write(&log, folder.path(), ending)]);
            let (mut ours, mut theirs) = (meanings(&log), meanings(&again));
            ours.sort_by_key(|(column, _)| *column);
            theirs.sort_by_key(|(column, _)| *column);
            assert_eq!(ours, theirs, "{names:?}");
            assert_eq!(without_places(again), without_places(log.clone()), "{names:?} as {ending}");
        }
    }
}

fn word() -> impl Strategy<Value = String> {
    "[A-Za-z0-9/:.\",]{1,8}"
}

fn nano() -> impl Strategy<Value = i64> {
    prop_oneof![1..1_000_000_000_000_i64, 1..i64::MAX, (1..100_000_i64).prop_map(|cents| cents * 10_000_000)]
}

prop_compose! {
    fn any_order()(
        (symbol, sell, quantity, kind) in (word(), any::<bool>(), proptest::option::of(nano()), 0..12_usize),
        (limit, stop, average, filled) in (proptest::option::of(nano()), proptest::option::of(nano()), proptest::option::of(nano()), proptest::option::of(nano())),
        times in proptest::array::uniform3(proptest::option::of(any::<i64>())),
        status in 0..8_usize,
        texts in proptest::array::uniform6(proptest::option::of(word())),
    ) -> PaperOrder {
        let mut order = PaperOrder::new("", &symbol, if sell { Side::Sell } else { Side::Buy }, SourcePlace::default());
        order.quantity = quantity.map(Quantity);
        order.kind = OrderWords::NAMED.get(kind).cloned().or((kind == 10).then(|| OrderWords::Other("iceberg".into())));
        (order.limit_price, order.stop_price, order.average_price) = (limit.map(Price), stop.map(Price), average.map(Price));
        (order.seen_bid, order.seen_ask) = (order.limit_price, order.stop_price);
        order.filled = filled.map(Quantity);
        [order.decided_at, order.submitted_at, order.ended_at] = times.map(|time| time.map(Timestamp));
        use PaperStatus::{Cancelled, Expired, Filled, Open, Other, Rejected, Replaced};
        order.status = [Open, Filled, Cancelled, Rejected, Expired, Replaced, Other("odd".into())].get(status).cloned();
        let [tif, client, by, parent, strategy, tag] = texts;
        (order.time_in_force, order.client_id, order.replaced_by) = (tif, client, by);
        (order.parent, order.strategy, order.tag) = (parent, strategy, tag);
        order
    }
}

prop_compose! {
    fn any_fill()(
        (symbol, order, side) in (word(), proptest::option::of(word()), 0..3_usize),
        (at, quantity, price) in (any::<i64>(), nano(), nano()),
        charge in proptest::option::of((any::<i64>(), 0..5_u32, proptest::option::of(word()))),
        (currency, role, total, apart) in (proptest::option::of(word()), 0..3_usize, any::<bool>(), any::<bool>()),
    ) -> PaperFill {
        let mut fill = PaperFill::new(&symbol, Timestamp(at), Quantity(quantity), Price(price), SourcePlace::default());
        fill.order_id = order;
        fill.side = [Side::Buy, Side::Sell].get(side).copied();
        fill.currency = currency;
        fill.liquidity = [Liquidity::Maker, Liquidity::Taker].get(role).copied();
        fill.charged = charge.map(|(amount, power, currency)| Charge { amount: Cash(i128::from(amount) * 10_i128.pow(3 * power)), currency });
        fill.fee = fill.charged.as_ref().filter(|_| !apart).map(|charge| charge.amount);
        // The total of an order that nothing else tells of.
        if total && fill.order_id.is_some() {
            fill.origin = FillOrigin::OrderTotal;
        }
        fill
    }
}

prop_compose! {
    /// A log whose ids are its own, in the order in which an import leaves it.
    fn any_log()(orders in proptest::collection::vec(any_order(), 1..12), fills in proptest::collection::vec(any_fill(), 0..12)) -> PaperLog {
        let mut log = PaperLog { orders, fills, ..PaperLog::default() };
        log.orders.iter_mut().enumerate().for_each(|(k, order)| order.id = format!("o{k}"));
        for (k, fill) in log.fills.iter_mut().enumerate() {
            fill.id = Some(format!("f{k}"));
            fill.order_id = fill.order_id.as_ref().map(|id| format!("{id}-{k}"));
        }
        log.orders.sort_by_key(|order| order.first_time().unwrap_or(Timestamp::MAX));
        log.fills.sort_by_key(|fill| fill.filled_at);
        log
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn whatever_is_written_is_imported_the_same(log in any_log(), parquet in any::<bool>()) {
        let folder = tempfile::tempdir().unwrap();
        let again = read(&[write(&log, folder.path(), if parquet { "parquet" } else { "csv" })]);
        prop_assert_eq!(again.findings.count(FindingKind::UnreadRow), 0);
        prop_assert_eq!(without_places(again), without_places(log));
    }

    #[test]
    fn garbage_is_refused_or_read_and_never_panics(
        (name, at, bytes) in (0..6_usize, any::<prop::sample::Index>(), proptest::collection::vec(any::<u8>(), 0..40)),
        cut in any::<bool>(),
    ) {
        let names = ["alpaca_orders.json", "flex.xml", "trades_pure_mm.csv", "binance_stream.jsonl", "ccxt_orders.json", "alpaca_activities.json"];
        let mut whole = fs::read(sample(names[name])).unwrap();
        let at = at.index(whole.len());
        let end = if cut { whole.len() } else { (at + bytes.len()).min(whole.len()) };
        whole.splice(at..end, bytes);
        let settings = ImportSettings { symbols: SymbolMap::of([("SPY".into(), "S".into())]), ..new_york() };
        let written = Written::new(names[name], &whole);
        if let Err(error) = written.import(&settings) {
            prop_assert!(!error.to_string().is_empty());
        }
    }
}
