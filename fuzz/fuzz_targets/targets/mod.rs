//! What is done with some bytes: a file a reader, and one for the engine that matches orders. The fuzzer runs these, and so does a test (`tests/io/reader_seeds.rs`).

mod account;
mod columnar;
mod csv;
mod equations;
mod history;
mod journal;
mod json_row;
mod matching;
mod orders;
mod paper;
mod paper_log;
mod run;
mod scene;
mod stream;
mod table;
mod tape_orders;
mod trajectory;
mod twin;
mod unit;

pub use scene::Scene;

/// A target: its name, and what it does with some bytes in a folder of its own.
pub type Target = (&'static str, fn(&Scene, &[u8]));

/// The targets, by their names, which are those of their folders in `fuzz/seeds`.
pub const TARGETS: [Target; 24] = [
    ("account", account::target),
    ("arrow", columnar::arrow),
    ("chunks", stream::chunks),
    ("csv", csv::plain),
    ("equations", equations::target),
    ("gzip", csv::compressed),
    ("history", history::target),
    ("journal", journal::target),
    ("json_row", json_row::target),
    ("matching", matching::target),
    ("orders", orders::target),
    ("paper_json", paper::json),
    ("paper_log", paper_log::target),
    ("paper_sqlite", paper::sqlite),
    ("paper_table", paper::table),
    ("paper_xml", paper::xml),
    ("parquet", columnar::parquet),
    ("run", run::target),
    ("stream", stream::target),
    ("tape", history::tape),
    ("tape_orders", tape_orders::target),
    ("trajectory", trajectory::target),
    ("twin", twin::target),
    ("unit", unit::target),
];
