//! CSV, plain and compressed.

use trueup::io::Table;

use super::scene::{Scene, shown};
use super::table::every_column;

pub fn plain(scene: &Scene, bytes: &[u8]) {
    if let Some(table) = shown(Table::read(scene.write("a.csv", bytes))) {
        every_column(scene, &table);
    }
}

pub fn compressed(scene: &Scene, bytes: &[u8]) {
    if let Some(table) = shown(Table::read(scene.write("a.csv.gz", bytes))) {
        every_column(scene, &table);
    }
}
