//! Rows of a feed as lines of JSON.

use trueup::io::JsonRow;

use super::scene::{Scene, shown};
use super::table::every_column;

pub fn target(scene: &Scene, bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    for (k, line) in text.lines().enumerate().take(20) {
        let Some(row) = shown(JsonRow::read("feed", k + 1, line)) else { continue };
        shown(row.text("symbol"));
        shown(row.count("seq"));
        let Some(table) = shown(row.table(&["symbol", "kind", "seq"])) else { continue };
        assert_eq!(table.rows(), 1);
        every_column(scene, &table);
    }
}
