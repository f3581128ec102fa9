//! Logs of paper and live orders, one kind of file a target: JSON, XML, databases and tables. What is read is the same when it is
//! written and read again.

use trueup::io::Overwrite::Force;
use trueup::io::write_table;
use trueup::market::paper::import::{ImportSettings, import};
use trueup::market::paper::{PaperLog, SourcePlace};

use super::scene::{Scene, shown};

/// Alpaca, Binance, CCXT, and pages, arrays and lines.
pub fn json(scene: &Scene, bytes: &[u8]) {
    same(scene, "log.json", bytes);
}

/// Flex queries.
pub fn xml(scene: &Scene, bytes: &[u8]) {
    same(scene, "log.xml", bytes);
}

/// freqtrade and hummingbot.
pub fn sqlite(scene: &Scene, bytes: &[u8]) {
    same(scene, "log.sqlite", bytes);
}

/// nautilus, hftbacktest, hummingbot's trades, freqtrade's exports and our own.
pub fn table(scene: &Scene, bytes: &[u8]) {
    same(scene, "log.csv", bytes);
}

fn same(scene: &Scene, name: &str, bytes: &[u8]) {
    let path = scene.write(name, bytes);
    let settings = ImportSettings { zone: "America/New_York".parse().ok(), ..ImportSettings::default() };
    let Some(log) = shown(import(&[path], &settings)) else { return };
    let (orders, fills) = (scene.path("again/orders.csv"), scene.path("again/fills.csv"));
    for (path, table) in [(&orders, log.orders_table()), (&fills, log.fills_table())] {
        write_table(path, &table, Force).expect("room for a file");
    }
    let again = shown(import(&[orders, fills], &ImportSettings::default())).expect("a log that was written is read");
    assert_eq!(rows(again), rows(log), "not the same again");
}

/// Its rows without where they stood.
fn rows(mut log: PaperLog) -> impl PartialEq + std::fmt::Debug {
    log.orders.iter_mut().for_each(|order| order.place = SourcePlace::default());
    log.fills.iter_mut().for_each(|fill| fill.place = SourcePlace::default());
    (log.orders, log.fills)
}
