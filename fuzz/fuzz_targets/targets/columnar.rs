//! Parquet and Arrow IPC.

use trueup::io::Table;

use super::scene::{Scene, shown};
use super::table::every_column;

pub fn parquet(scene: &Scene, bytes: &[u8]) {
    if let Some(table) = shown(Table::read(scene.write("a.parquet", bytes))) {
        every_column(scene, &table);
    }
}

pub fn arrow(scene: &Scene, bytes: &[u8]) {
    if let Some(table) = shown(Table::read(scene.write("a.arrow", bytes))) {
        every_column(scene, &table);
    }
}
