//! Parquet and Arrow columns of every type that is read, and of those that are not.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop where it fails")]

use std::fs::File;
use std::path::Path;

use polars::prelude::*;
use trueup::io::{Renames, Table, TableChunks, TimeFormat, TimeUnit};

const NEW_YORK: TimeFormat = TimeFormat { unit: TimeUnit::Seconds, zone: chrono_tz::Tz::America__New_York };

fn frame() -> DataFrame {
    // 2021-07-01T13:30:00 and 2021-11-07T01:30:00, the latter twice on New York's clocks.
    let seconds = [Some(1_625_146_200_i64), None, Some(1_636_248_600)];
    let scaled = |factor: i64| seconds.map(|s| s.map(|s| s * factor));
    let column = |name: &str, values: [Option<i64>; 3], kind: DataType| {
        Series::new(name.into(), values).cast(&kind).unwrap().into_column()
    };
    let utc = Some(TimeZone::UTC);
    DataFrame::new_infer_height(vec![
        column("s", seconds, DataType::Int64),
        column("ns", scaled(1_000_000_000), DataType::Datetime(polars::prelude::TimeUnit::Nanoseconds, utc.clone())),
        column("us", scaled(1_000_000), DataType::Datetime(polars::prelude::TimeUnit::Microseconds, utc)),
        column("naive", scaled(1_000), DataType::Datetime(polars::prelude::TimeUnit::Milliseconds, None)),
        column("day", [Some(18_809), None, Some(-1)], DataType::Date),
        column("small", [Some(1), None, Some(3)], DataType::UInt32),
        Series::new("f32".into(), [Some(0.5_f32), None, Some(f32::NAN)]).into_column(),
        Series::new("bool".into(), [Some(true), None, Some(false)]).into_column(),
        Series::new("digits".into(), [Some("0.25"), None, Some("1e3")]).into_column(),
        Series::new("length".into(), [Some(1_i64), None, Some(2)])
            .cast(&DataType::Duration(polars::prelude::TimeUnit::Nanoseconds))
            .unwrap()
            .into_column(),
        Series::new_null("nothing".into(), 3).into_column(),
    ])
    .unwrap()
}

fn shown(table: &Table, name: &str) -> Vec<Option<String>> {
    let times = table.times_with_holes(name, &NEW_YORK).unwrap();
    times.into_iter().map(|time| time.map(|t| t.to_string())).collect()
}

fn check(path: &Path) {
    let table = Table::read(path).unwrap();
    let instants = [Some("2021-07-01T13:30:00Z".to_owned()), None, Some("2021-11-07T01:30:00Z".to_owned())];
    for name in ["s", "ns", "us"] {
        assert_eq!(shown(&table, name), instants, "{name}");
    }
    let naive = [Some("2021-07-01T17:30:00Z".to_owned()), None, Some("2021-11-07T05:30:00Z".to_owned())];
    assert_eq!(shown(&table, "naive"), naive);
    let days = [Some("2021-07-01T04:00:00Z".to_owned()), None, Some("1969-12-31T05:00:00Z".to_owned())];
    assert_eq!(shown(&table, "day"), days);
    assert_eq!(table.floats("f32").unwrap(), [Some(0.5), None, None]);
    assert_eq!(table.floats("digits").unwrap(), [Some(0.25), None, Some(1000.0)]);
    assert_eq!(table.integers("small").unwrap(), [Some(1), None, Some(3)]);
    assert_eq!(table.texts("bool").unwrap(), [Some("true".to_owned()), None, Some("false".to_owned())]);
    assert_eq!(table.floats("nothing").unwrap(), [None, None, None]);
    let error = |name: &str| table.floats(name).unwrap_err().to_string().replace(&path.display().to_string(), "FILE");
    assert_eq!(error("naive"), "FILE: column `naive`: expected numbers, found times\n  hint: is another column meant?");
    assert!(table.has("length") && error("length").contains("hint: write it as 64-bit numbers"), "{}", error("length"));
    let hole = table.floats_complete("digits").unwrap_err();
    assert_eq!(hole.place, trueup::io::Place::Row(2));
}

#[test]
fn every_type_is_read_from_parquet_and_from_arrow() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.parquet");
    ParquetWriter::new(File::create(&path).unwrap()).finish(&mut frame()).unwrap();
    check(&path);
    for name in ["a.arrow", "a.ipc", "a.feather"] {
        let path = folder.path().join(name);
        IpcWriter::new(File::create(&path).unwrap()).finish(&mut frame()).unwrap();
        check(&path);
    }
}

#[test]
fn an_arrow_file_is_refused_wherever_it_is_cut() {
    let mut bytes = Vec::new();
    IpcWriter::new(&mut bytes).finish(&mut frame()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for cut in [0, 3, 20, bytes.len() / 2, bytes.len() - 1] {
        let path = folder.path().join("a.arrow");
        std::fs::write(&path, &bytes[..cut]).unwrap();
        assert!(Table::read(&path).unwrap_err().message.starts_with("expected a whole Arrow IPC file"));
    }
}

/// A length that is damaged must not make the decoder ask for more memory than there is, which would end the process.
#[test]
fn a_damaged_byte_of_an_arrow_file_gives_an_error_or_a_table() {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/arrow");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.arrow");
    let mut refused = 0;
    for seed in std::fs::read_dir(seeds).unwrap() {
        let whole = std::fs::read(seed.unwrap().path()).unwrap();
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            // The highest byte of a length becomes the highest there is.
            bytes[at] ^= 0x7f;
            std::fs::write(&path, bytes).unwrap();
            match Table::read(&path) {
                Ok(table) => table.names().into_iter().for_each(|name| drop(table.texts(name))),
                Err(error) => refused += usize::from(error.hint.is_some()),
            }
        }
    }
    assert!(refused > 1_000, "{refused}");
}

/// As above, of a list in a footer.
#[test]
fn a_parquet_footer_with_a_list_beyond_its_end_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.parquet");
    std::fs::write(&path, include_bytes!("../../fuzz/seeds/parquet/long_list")).unwrap();
    let message = Table::read(&path).unwrap_err().message;
    assert!(message.contains("the lists of its footer contradict its length"), "{message}");
}

/// A byte of its levels says that there are fewer values than its footer and its page header do: the decoder gave a column that was
/// shorter than the others. By pieces it is refused too.
#[test]
fn a_parquet_column_with_fewer_values_than_rows_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.parquet");
    std::fs::write(&path, include_bytes!("../../fuzz/seeds/parquet/short_column")).unwrap();
    let whole = Table::read(&path).unwrap_err();
    let piecewise = TableChunks::open(&path, &Renames::default(), 2).unwrap_err();
    for error in [whole, piecewise] {
        assert!(error.message.contains("its columns have fewer values than it has rows"), "{error}");
    }
}

/// Every table below `folder`.
fn tables(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            tables(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "csv" || ending == "parquet") {
            found.push(path);
        }
    }
}

#[test]
fn files_that_others_wrote_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    if !folder.is_dir() {
        println!("skipped: ../shared/data is absent");
        return;
    }
    let mut found = Vec::new();
    tables(&folder, &mut found);
    assert!(!found.is_empty());
    for path in found {
        let table = Table::read(&path).unwrap();
        for name in table.names() {
            table.texts(name).or_else(|_| table.times(name, &NEW_YORK).map(|_| Vec::new())).unwrap();
        }
    }
}
