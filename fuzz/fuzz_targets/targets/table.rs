//! Tables of whatever format: every column in every type, and written and read again.

use std::path::Path;

use trueup::io::{
    Increase, OutputTable, Table, TimeFormat, TimeUnit, Values, check_increasing, check_not_negative, check_positive,
    common_spacing,
};

use super::scene::{Scene, shown};

/// Converts every column of `table` to all it can be, and holds what is read to be read again from each format.
pub fn every_column(scene: &Scene, table: &Table) {
    let mut written = OutputTable::new();
    for (number, name) in table.names().into_iter().enumerate() {
        let floats = shown(table.floats(name));
        shown(table.floats_complete(name));
        shown(table.texts_complete(name));
        if let Some(floats) = &floats {
            shown(check_positive(table, name, floats));
            shown(check_not_negative(table, name, floats));
        }
        if let Some(times) = shown(table.times(name, &TimeFormat::default())) {
            shown(check_increasing(table, name, &times, Increase::Strictly));
            let _ = common_spacing(&times);
        }
        let local = TimeFormat { unit: TimeUnit::Seconds, zone: "America/New_York".parse().expect("a zone") };
        let columns = [
            shown(table.texts(name)).map(Values::Texts),
            floats.map(Values::Floats),
            shown(table.integers(name)).map(Values::Integers),
            shown(table.times_with_holes(name, &local)).map(Values::Times),
        ];
        for (kind, values) in columns.into_iter().enumerate().filter_map(|(kind, values)| Some((kind, values?))) {
            // The name itself once; the other types beside it.
            let name = if kind == 0 { name.to_owned() } else { format!("{number} {kind}") };
            if !table.has(&name) || kind == 0 {
                written = written.with(&name, values);
            }
        }
    }
    for format in ["again.csv", "again.parquet"] {
        read_again(scene, format, &written);
    }
}

/// Holds a table that is written to be read as it was.
fn read_again(scene: &Scene, name: &str, written: &OutputTable) {
    if *written == OutputTable::new() {
        return;
    }
    let bytes = written.bytes(Path::new(name)).expect("what was read can be written");
    let table = Table::read(scene.write(name, &bytes)).expect("what was written can be read");
    let mut read = OutputTable::new();
    for (name, values) in written.columns() {
        let values = match values {
            Values::Texts(_) => Values::Texts(table.texts(name).expect("texts")),
            Values::Floats(_) => Values::Floats(table.floats(name).expect("numbers")),
            Values::Integers(_) => Values::Integers(table.integers(name).expect("integers")),
            Values::Times(_) => Values::Times(table.times_with_holes(name, &TimeFormat::default()).expect("times")),
        };
        read = read.with(name, values);
    }
    assert_eq!(&read, written, "{name} is not read as it was written");
}
