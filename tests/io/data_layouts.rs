//! The layouts of others: what their rows mean, on rows written here, and on files of theirs where there are any.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use trueup::io::{ClockOffset, FeedClock, FeedFormat, FeedRules, Layout, OnBad, Stamp, TimeFormat};
use trueup::market::{DepthAction, DepthChange, Finding, History, OrderAction, OrderEvent, Price, Side};
use trueup::sim2real::Timestamp;

/// A file of the market's data that are not part of the project, where it is there.
fn theirs(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/market").join(name);
    if !path.exists() {
        println!("skipped: there is no {}", path.display());
    }
    path.exists().then_some(path)
}

struct Files(tempfile::TempDir);

impl Files {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

fn estimated(layout: Layout) -> FeedFormat {
    let clock = FeedClock { known_at: None, offset: ClockOffset::Estimated };
    FeedFormat { clock, ..FeedFormat::of_layout(layout) }
}

/// Makes a change in a book.
fn apply(change: &DepthChange, bids: &mut BTreeMap<Price, f64>, asks: &mut BTreeMap<Price, f64>) {
    let side = if change.side == Side::Buy { bids } else { asks };
    match change.action {
        DepthAction::Clear => side.clear(),
        DepthAction::Set if change.size == 0.0 => drop(side.remove(&change.price)),
        DepthAction::Set => drop(side.insert(change.price, change.size)),
    }
}

/// The best levels of a book that such changes make.
fn best(changes: &[DepthChange]) -> (Option<f64>, Option<f64>, usize) {
    let (mut bids, mut asks) = (BTreeMap::new(), BTreeMap::new());
    changes.iter().for_each(|change| apply(change, &mut bids, &mut asks));
    let bid = bids.last_key_value().map(|(price, _)| price.to_f64());
    let ask = asks.first_key_value().map(|(price, _)| price.to_f64());
    (bid, ask, bids.len() + asks.len())
}

const UPDATES: &str = "local_ns,exch_T_ms,exch_E_ms,first_update_id,last_update_id,prev_update_id,side,price,qty\n";
const SNAPSHOT: &str = "local_ns,exch_T_ms,exch_E_ms,last_update_id,side,price,qty\n";

#[test]
fn a_binance_book_begins_with_its_snapshot_and_counts_what_is_missing() {
    let files = Files::new();
    // The snapshot arrives at 3.5 ms and holds update 12; of the update 10 to 14 more is in it than not, but not all.
    let snapshot = files.write(
        "snapshot.csv",
        &format!("{SNAPSHOT}3500000,3,3,12,bid,100,1\n3500000,3,3,12,bid,99,2\n3500000,3,3,12,ask,101,3\n"),
    );
    let updates = files.write(
        "updates.csv",
        &(UPDATES.to_owned()
            + "1000000,1,1,5,9,4,bid,98,9\n"
            + "2000000,2,2,10,14,9,bid,100,0\n2000000,2,2,10,14,9,ask,100.5,4\n"
            + "4000000,4,4,15,16,14,bid,99.5,5\n"
            + "5000000,5,5,19,20,18,ask,100.5,0\n"),
    );
    let format = FeedFormat { snapshot: Some(snapshot.clone()), ..FeedFormat::of_layout(Layout::BinanceDepth) };
    let history = History::read_depth(&updates, &format).unwrap();
    let (depth, notes) = (history.depth(), &history.notes()[0]);
    assert_eq!(depth[..2].iter().map(|change| change.action).collect::<Vec<_>>(), [DepthAction::Clear; 2]);
    let counts = [Finding::BeforeSnapshot, Finding::AwaitedSnapshot, Finding::MissedUpdates].map(|f| notes.count(f));
    assert_eq!((counts, notes.rows(), notes.kept()), ([1, 2, 1], 5, 2 + 3 + 4));
    let known: Vec<i64> = depth.iter().map(|change| change.known_at.0).collect();
    assert_eq!(known, [3_500_000, 3_500_000, 3_500_000, 3_500_000, 3_500_000, 3_500_000, 3_500_000, 4_000_000, 5_000_000]);
    assert_eq!(
        (depth[5].time, best(&depth[..5]), best(depth)),
        (Timestamp(2_000_000), (Some(100.0), Some(101.0), 3), (Some(99.5), Some(101.0), 3))
    );
    // A snapshot from before the updates: what lies between is missing.
    let old = files.write("old.csv", &format!("{SNAPSHOT}500000,0,0,2,bid,100,1\n"));
    let format = FeedFormat { snapshot: Some(old), ..format };
    assert_eq!(History::read_depth(&updates, &format).unwrap().notes()[0].count(Finding::MissedUpdates), 2);
    let two = files.write("two.csv", &format!("{SNAPSHOT}1,0,0,2,bid,100,1\n1,0,0,3,bid,100,1\n"));
    let error = History::read_depth(&updates, &FeedFormat { snapshot: Some(two), ..format }).unwrap_err().to_string();
    assert!(error.contains("two.csv: row 3, column `last_update_id`: expected the same number"), "{error}");
}

#[test]
fn binance_trades_name_the_maker_and_the_other_side_took() {
    let files = Files::new();
    let header = "local_ns,exch_T_ms,exch_E_ms,trade_id,price,qty,buyer_is_maker,type\n";
    let rows = "1500000,1,1,7,100,2,true,MARKET\n2500000,2,2,8,101,3,false,MARKET\n";
    let format = FeedFormat::of_layout(Layout::BinanceTrades);
    let history = History::read_trades(files.write("t.csv", &format!("{header}{rows}")), &format).unwrap();
    let took: Vec<_> = history.prints().iter().map(|print| print.aggressor).collect();
    assert_eq!(took, [Some(Side::Sell), Some(Side::Buy)]);
    assert_eq!((history.prints()[0].time, history.print_known_at(0)), (Timestamp(1_000_000), Some(Timestamp(1_500_000))));
    let again = files.write("again.csv", &format!("{header}{rows}3500000,3,3,8,101,3,false,MARKET\n"));
    let error = History::read_trades(&again, &format).unwrap_err().to_string();
    assert!(error.contains("row 4, column `trade_id`: expected more than 8, found 8"), "{error}");
    let rules = FeedRules { on_bad: OnBad::Drop, ..FeedRules::default() };
    let history = History::read_trades(&again, &FeedFormat { rules, ..format }).unwrap();
    assert_eq!((history.prints().len(), history.notes()[0].count(Finding::Duplicate)), (2, 1));
}

#[test]
fn real_binance_files_agree_with_each_other() {
    let name = |what: &str| theirs(&format!("binance_20240808/usdm_btcusdt_{what}.parquet"));
    let all = [name("depth_updates"), name("depth_snapshot"), name("book_ticker"), name("trades")];
    let [Some(updates), Some(snapshot), Some(ticker), Some(trades)] = all else { return };
    let strict = FeedFormat { snapshot: Some(snapshot.clone()), ..FeedFormat::of_layout(Layout::BinanceDepth) };
    let error = History::read_depth(&updates, &strict).unwrap_err().to_string();
    assert!(error.contains("expected a time no earlier than"), "the local clock runs behind: {error}");
    let format = FeedFormat { snapshot: Some(snapshot), ..estimated(Layout::BinanceDepth) };
    let book = History::read_depth(&updates, &format).unwrap();
    let notes = &book.notes()[0];
    println!("{}", notes.lines().join("\n"));
    // 6,551 updates without a break, of which 4 are in the snapshot; the offset by a query of the same file elsewhere.
    assert_eq!((notes.rows(), notes.count(Finding::MissedUpdates), notes.clock_offset()), (443_521, 0, Some(1_272_156_851)));
    let left_out = notes.count(Finding::BeforeSnapshot);
    assert_eq!(notes.kept(), 443_521 - left_out + 2_002);
    assert!(left_out > 0);
    assert!(book.depth().iter().all(|change| change.known_at >= change.time));
    // The book of the depth stream has the best bid and ask that the other stream tells of.
    let quotes = History::read_quotes(&ticker, &estimated(Layout::BinanceBookTicker)).unwrap();
    let prints = History::read_trades(&trades, &estimated(Layout::BinanceTrades)).unwrap();
    assert_eq!((quotes.quotes().len(), prints.prints().len()), (66_089, 21_313));
    println!("{:?} {:?}", quotes.notes()[0].lines(), prints.notes()[0].lines());
    let numbers = |path: &Path, column: &str| {
        let table = trueup::io::Table::read(path).unwrap();
        table.integers(column).unwrap().into_iter().flatten().collect::<Vec<i64>>()
    };
    let (updates, tickers) = (numbers(&updates, "last_update_id"), numbers(&ticker, "update_id"));
    let (mut bids, mut asks) = (BTreeMap::new(), BTreeMap::new());
    let (mut agree, mut compared) = (0, 0);
    let changes = &book.depth()[2_002..];
    let numbers = &updates[updates.len() - changes.len()..];
    for change in &book.depth()[..2_002] {
        apply(change, &mut bids, &mut asks);
    }
    for (k, change) in changes.iter().enumerate() {
        apply(change, &mut bids, &mut asks);
        // Once an update is whole, the last ticker with no later number has the best bid and ask of the book.
        if numbers.get(k + 1) == Some(&numbers[k]) {
            continue;
        }
        let Some(ticker) = tickers.partition_point(|number| *number <= numbers[k]).checked_sub(1) else { continue };
        let quote = quotes.quotes().all().get(ticker).unwrap();
        let best = (bids.last_key_value().map(|(price, _)| *price), asks.first_key_value().map(|(price, _)| *price));
        let nearest = |price: Option<f64>| price.map(|price| Price::nearest(price).unwrap());
        compared += 1;
        agree += usize::from(best == (nearest(quote.bid()), nearest(quote.ask())));
    }
    println!("after {agree} of {compared} updates the book has the best bid and ask that the other stream tells of");
    assert!(compared > 6_000 && agree == compared, "{agree} of {compared}");
    let counts = |history: &History| Finding::ALL.map(|finding| history.notes()[0].count(finding)).iter().sum::<u64>();
    println!("found {} {}", counts(&quotes), counts(&prints));
}

const LEAN_TICKS: &str = "ts_exchange_local,bid_x10000,bid_sz,ask_x10000,ask_sz,exchange,quote_condition,suspicious\n";

fn new_york(layout: Layout) -> FeedFormat {
    let time = TimeFormat { zone: "America/New_York".parse().unwrap(), ..TimeFormat::default() };
    FeedFormat { time, ..FeedFormat::of_layout(layout) }
}

#[test]
fn a_lean_tick_tells_of_one_side_and_the_other_stays() {
    let files = Files::new();
    let path = files.write(
        "q.csv",
        &(LEAN_TICKS.to_owned()
            + "2013-10-07 09:30:00.1,1800000,3,0,0,Q,1,0\n2013-10-07 09:30:00.2,0,0,1800200,5,P,1,0\n"
            + "2013-10-07 09:30:00.3,1900000,1,0,0,Q,1,1\n2013-10-07 09:30:00.4,1800200,4,0,0,P,1,0\n"
            + "2013-10-07 09:30:00.5,1800300,4,0,0,P,1,0\n2013-10-07 09:30:00.6,0,0,1800400,6,P,1,0\n"),
    );
    let format = new_york(Layout::Lean);
    let error = History::read_quotes(&path, &format).unwrap_err().to_string();
    assert!(error.contains("row 6, column `ask_x10000`: the bid is above the ask, found 1800200"), "{error}");
    let rules = FeedRules { on_bad: OnBad::Drop, ..FeedRules::default() };
    let history = History::read_quotes(&path, &FeedFormat { rules, ..format }).unwrap();
    let all = history.quotes().all();
    let shown: Vec<(String, Option<f64>, Option<f64>)> =
        (0..all.len()).map(|k| all.get(k).unwrap()).map(|q| (q.time.to_string(), q.bid(), q.ask())).collect();
    let at = |text: &str, bid: f64, ask: f64| (format!("2013-10-07T13:30:00.{text}00Z"), Some(bid), Some(ask));
    assert_eq!(shown[0], ("2013-10-07T13:30:00.100Z".to_owned(), Some(180.0), None));
    assert_eq!(shown[1..], [at("2", 180.0, 180.02), at("4", 180.02, 180.02), at("6", 180.03, 180.04)]);
    let counts = [Finding::OneSided, Finding::Suspicious, Finding::Crossed, Finding::Locked];
    assert_eq!(counts.map(|finding| history.notes()[0].count(finding)), [1, 1, 1, 1]);
}

#[test]
fn a_lean_quote_bar_is_known_when_it_ends() {
    let files = Files::new();
    let header = "ts_exchange_local,bid_o,bid_h,bid_l,bid_c,bid_sz,ask_o,ask_h,ask_l,ask_c,ask_sz\n";
    let row = "2013-10-07 09:30:00,1,1,1,1672700,100,2,2,2,1674100,600\n";
    let path = files.write("q.csv", &format!("{header}{row}"));
    let format = new_york(Layout::Lean);
    assert!(History::read_quotes(&path, &format).unwrap_err().to_string().contains("how long a quote bar is"));
    let history = History::read_quote_bars(&path, &format, Some(60 * Timestamp::NANOS)).unwrap();
    let quote = history.quotes().all().get(0).unwrap();
    assert_eq!((quote.time.to_string(), quote.mid()), ("2013-10-07T13:31:00Z".to_owned(), Some(167.34)));
}

#[test]
fn real_lean_files_are_read() {
    let name = |what: &str| theirs(&format!("lean/{what}.parquet"));
    let all = [
        name("spy_minute_trade_bars_x10000"),
        name("spy_minute_quote_bars_x10000"),
        name("ibm_tick_quotes"),
        name("spy_tick_trades"),
    ];
    let [Some(bars), Some(quote_bars), Some(ticks), Some(trades)] = all else { return };
    let format = new_york(Layout::Lean);
    assert_eq!(format.stamp, Some(Stamp::Open));
    let minute = Some(60 * Timestamp::NANOS);
    let history = History::read_bars(&bars, &format, minute).unwrap();
    assert_eq!((history.bars().len(), history.bars()[0].open.to_f64()), (5_786, 167.65));
    assert_eq!(history.bars()[0].open_at.to_string(), "2013-10-04T08:06:00Z");
    let quoted = History::read_quote_bars(&quote_bars, &format, minute).unwrap();
    assert_eq!((quoted.quotes().len(), quoted.notes()[0].count(Finding::Locked)), (6_373, 114));
    let rules = FeedRules { on_bad: OnBad::Drop, ..FeedRules::default() };
    let ticks = History::read_quotes(&ticks, &FeedFormat { rules, ..format.clone() }).unwrap();
    let notes = &ticks.notes()[0];
    println!("{}", notes.lines().join("\n"));
    assert_eq!((notes.rows(), notes.count(Finding::Suspicious)), (575_589, 3));
    assert_eq!(notes.kept() + notes.count(Finding::Crossed) + 3, 575_589);
    let prints = History::read_trades(&trades, &format).unwrap();
    assert_eq!((prints.prints().len(), prints.notes()[0].count(Finding::Suspicious)), (1_887_450, 10));
}

/// A generated day in Databento's layout: its columns, prices in 1e-9, `N` and the largest integer where there is nothing.
fn databento(files: &Files) -> PathBuf {
    let none = i64::MAX;
    let rows = [
        (1, 'R', 'N', none, 0, 0),
        (2, 'A', 'B', 100_000_000_000, 10, 1),
        (3, 'A', 'A', 100_250_000_000, 5, 2),
        (4, 'A', 'B', 99_750_000_000, 4, 3),
        // Part of order 1 is cancelled; order 3 moves up and grows.
        (5, 'C', 'B', 100_000_000_000, 4, 1),
        (6, 'M', 'B', 100_000_000_000, 8, 3),
        // A sell of 6 takes order 1: the trade, the fill, and the cancel that takes it from the book.
        (7, 'T', 'A', 100_000_000_000, 6, 0),
        (7, 'F', 'B', 100_000_000_000, 6, 1),
        (7, 'C', 'B', 100_000_000_000, 6, 1),
        // One that nobody knows, one that a modify adds.
        (8, 'C', 'A', 101_000_000_000, 6, 77),
        (9, 'M', 'A', 100_500_000_000, 3, 4),
        (10, 'T', 'N', 100_250_000_000, 1, 0),
        (11, 'R', 'N', none, 0, 0),
    ];
    let mut text =
        "ts_recv,ts_event,rtype,publisher_id,instrument_id,action,side,price,size,channel_id,order_id,flags\n".to_owned();
    for (t, action, side, price, size, id) in rows {
        let event = 1_700_000_000_000_000_000_i64 + t * 1_000_000;
        text += &format!("{},{event},160,1,42,{action},{side},{price},{size},0,{id},128\n", event + 250);
    }
    files.write("mbo.csv", &text)
}

#[test]
fn databento_messages_become_orders_and_trades() {
    let files = Files::new();
    let path = databento(&files);
    let format = FeedFormat::of_layout(Layout::DatabentoMbo);
    let history = History::read_order_events(&path, &format).unwrap();
    let shown = |event: &OrderEvent| (event.id, event.action, event.side, event.price.to_f64(), event.size);
    let events: Vec<_> = history.order_events().iter().map(shown).collect();
    assert_eq!(
        events,
        [
            (1, OrderAction::Add, Side::Buy, 100.0, 10.0),
            (2, OrderAction::Add, Side::Sell, 100.25, 5.0),
            (3, OrderAction::Add, Side::Buy, 99.75, 4.0),
            (1, OrderAction::Change, Side::Buy, 100.0, 6.0),
            (3, OrderAction::Change, Side::Buy, 100.0, 8.0),
            (1, OrderAction::Delete, Side::Buy, 100.0, 0.0),
            (4, OrderAction::Add, Side::Sell, 100.5, 3.0),
            (2, OrderAction::Delete, Side::Sell, 100.25, 0.0),
            (3, OrderAction::Delete, Side::Buy, 100.0, 0.0),
            (4, OrderAction::Delete, Side::Sell, 100.5, 0.0),
        ]
    );
    let notes = &history.notes()[0];
    assert_eq!((notes.count(Finding::OtherKind), notes.count(Finding::UnknownOrder)), (3, 1));
    let first = history.order_events()[0];
    assert_eq!(first.known_at - first.time, 250);
    let trades = History::read_trades(&path, &format).unwrap();
    let prints: Vec<_> = trades.prints().iter().map(|print| (print.price, print.size, print.aggressor)).collect();
    assert_eq!(prints, [(100.0, 6.0, Some(Side::Sell)), (100.25, 1.0, None)]);
}

#[test]
fn real_bitstamp_orders_rest_and_leave() {
    let Some(path) = theirs("bitstamp_l3_2015/orders_2015-05-01.parquet") else { return };
    let history = History::read_order_events(&path, &FeedFormat::of_layout(Layout::BitstampL3)).unwrap();
    let (events, notes) = (history.order_events(), &history.notes()[0]);
    println!("{}", notes.lines().join("\n"));
    // Of 24,894 created, 602 changed and 24,918 deleted: 4 changed and 187 deleted were never created, 21 were deleted
    // twice, 1 was changed after that; counted by another program.
    assert_eq!((notes.rows(), notes.count(Finding::UnknownOrder)), (50_414, 4 + 187 + 21 + 1));
    assert_eq!(events.len(), 50_414 - 213);
    assert_eq!((events[0].price.to_f64(), events[0].size, events[0].side), (236.47, 2.0, Side::Buy));
    let late = events.iter().filter(|event| event.action == OrderAction::Add).map(|event| event.known_at - event.time);
    assert_eq!(late.max(), Some(1_288_000_000));
}

#[test]
fn a_layout_that_has_no_such_data_is_refused() {
    let files = Files::new();
    let path = files.write("a.csv", "ts\n1\n");
    let format = FeedFormat::of_layout(Layout::BitstampL3);
    let error = History::read_trades(&path, &format).unwrap_err().to_string();
    assert!(error.contains("the layout `bitstamp_l3` has no trades") && error.contains("`binance_trades`"), "{error}");
    assert!(History::read_bars(&path, &format, None).is_err() && History::read_depth(&path, &format).is_err());
}
