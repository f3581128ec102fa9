//! Tables in pieces: the same rows, places and errors as of the whole, in memory that does not grow with the file.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop where it fails")]

use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use polars::prelude::*;
use trueup::io::{Renames, Table, TableChunks};

/// Rows `from` to before `to` of a made-up tape.
fn frame(from: i64, to: i64) -> DataFrame {
    let texts: Vec<Option<&str>> = (from..to).map(|k| [Some("buy"), Some("sell"), None][k as usize % 3]).collect();
    DataFrame::new_infer_height(vec![
        Series::new("ts".into(), (from..to).map(|k| 1_700_000_000_000_000_000 + k * 1_000).collect::<Vec<i64>>())
            .into_column(),
        Series::new("price".into(), (from..to).map(|k| 100.0 + (k % 977) as f64 * 0.25).collect::<Vec<f64>>()).into_column(),
        Series::new("size".into(), (from..to).map(|k| (k * 7 % 1_013) as f64).collect::<Vec<f64>>()).into_column(),
        Series::new("aggressor".into(), texts).into_column(),
    ])
    .unwrap()
}

fn csv_of(rows: i64, write: &mut dyn std::io::Write) {
    writeln!(write, "ts,price,size,aggressor").unwrap();
    for k in 0..rows {
        let side = ["buy", "sell", ""][k as usize % 3];
        let (price, size) = (100.0 + (k % 977) as f64 * 0.25, k * 7 % 1_013);
        writeln!(write, "{},{price},{size},{side}", 1_700_000_000_000_000_000 + k * 1_000).unwrap();
    }
}

/// Writes `rows` rows in each format; groups and batches are of `group` rows.
fn files(folder: &Path, rows: i64, group: i64) -> Vec<PathBuf> {
    let path = |ending: &str| folder.join(format!("{rows}.{ending}"));
    csv_of(rows, &mut std::io::BufWriter::new(File::create(path("csv")).unwrap()));
    let mut zipped = flate2::write::GzEncoder::new(File::create(path("csv.gz")).unwrap(), flate2::Compression::fast());
    csv_of(rows, &mut std::io::BufWriter::new(&mut zipped));
    zipped.finish().unwrap();
    let pieces = || (0..rows).step_by(group as usize).map(|from| frame(from, rows.min(from + group)));
    let schema = frame(0, 1).schema().clone();
    let writer = ParquetWriter::new(File::create(path("parquet")).unwrap());
    let mut parquet = writer.with_row_group_size(Some(group as usize)).batched(&schema).unwrap();
    for piece in pieces() {
        parquet.write_batch(&piece).unwrap();
    }
    parquet.finish().unwrap();
    // Each chunk of the frame becomes a record batch.
    let mut whole = pieces().reduce(|all, piece| all.vstack(&piece).unwrap()).unwrap();
    let ipc = IpcWriter::new(File::create(path("arrow")).unwrap());
    ipc.with_compression(Some(IpcCompression::LZ4)).finish(&mut whole).unwrap();
    ["csv", "csv.gz", "parquet", "arrow"].map(path).to_vec()
}

/// All cells as texts, each with its place.
fn cells(table: &Table) -> Vec<String> {
    let columns: Vec<_> = table.names().into_iter().map(|name| table.texts(name).unwrap()).collect();
    (0..table.rows())
        .map(|row| format!("{:?} {:?}", table.place(row), columns.iter().map(|c| &c[row]).collect::<Vec<_>>()))
        .collect()
}

fn in_pieces(path: &Path, rows: usize) -> Vec<Vec<String>> {
    let mut chunks = TableChunks::open(path, &Renames::new(), rows).unwrap();
    let mut all = Vec::new();
    while let Some(table) = chunks.next_table().unwrap() {
        all.push(cells(&table));
    }
    assert!(chunks.next_table().unwrap().is_none());
    all
}

#[test]
fn pieces_are_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    for path in files(folder.path(), 1_000, 300) {
        let whole = cells(&Table::read(&path).unwrap());
        assert_eq!(whole.len(), 1_000);
        for rows in [1, 7, 300, 999, 5_000] {
            let pieces = in_pieces(&path, rows);
            assert!(pieces.iter().all(|piece| !piece.is_empty() && piece.len() <= rows));
            assert_eq!(pieces.concat(), whole, "{} at {rows} rows", path.display());
        }
    }
}

#[test]
fn a_row_group_longer_than_what_is_decoded_at_once_is_cut() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.parquet");
    let mut whole = frame(0, 300_000);
    ParquetWriter::new(File::create(&path).unwrap()).with_row_group_size(Some(300_000)).finish(&mut whole).unwrap();
    let mut chunks = TableChunks::open(&path, &Renames::new(), TableChunks::ROWS).unwrap();
    let mut row = 0_i64;
    while let Some(table) = chunks.next_table().unwrap() {
        for ts in table.integers("ts").unwrap() {
            assert_eq!(ts, Some(1_700_000_000_000_000_000 + row * 1_000));
            row += 1;
        }
    }
    assert_eq!(row, 300_000);
}

#[test]
fn dictionaries_and_compressed_batches_are_read_in_pieces() {
    let folder = tempfile::tempdir().unwrap();
    for seed in ["dictionary", "lz4", "plain", "types", "zstd"] {
        let path = folder.path().join(format!("{seed}.arrow"));
        fs::copy(Path::new("fuzz/seeds/arrow").join(seed), &path).unwrap();
        // Columns of types that are not read stay unread in pieces, too.
        let shown = |table: &Table| -> Vec<String> {
            let name = |n: &str| table.texts(n).map_err(|e| e.to_string());
            table.names().into_iter().map(|n| format!("{n} {:?}", name(n))).collect()
        };
        let whole = shown(&Table::read(&path).unwrap());
        let mut chunks = TableChunks::open(&path, &Renames::new(), 1_000).unwrap();
        assert_eq!(shown(&chunks.next_table().unwrap().unwrap()), whole, "{seed}");
    }
}

#[test]
fn a_cut_file_is_refused_wherever_it_is_cut_and_a_damaged_one_gives_an_error_or_tables() {
    let folder = tempfile::tempdir().unwrap();
    for path in files(folder.path(), 60, 20) {
        let bytes = fs::read(&path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let columnar = !name.contains("csv");
        let cut = folder.path().join(format!("cut.{}", name.split_once('.').unwrap().1));
        let read = |bytes: &[u8]| {
            fs::write(&cut, bytes).unwrap();
            let mut chunks = TableChunks::open(&cut, &Renames::new(), 7)?;
            let mut rows = 0;
            while let Some(table) = chunks.next_table()? {
                rows += cells_or_none(&table);
            }
            Ok::<usize, trueup::io::InputError>(rows)
        };
        // The end of a text without a line end may be the end of a number.
        if name.ends_with(".gz") || columnar {
            for length in (0..bytes.len()).step_by(7) {
                assert!(read(&bytes[..length]).is_err(), "{name} cut at {length}");
            }
        }
        if columnar {
            for at in (0..bytes.len()).step_by(3) {
                let mut damaged = bytes.clone();
                damaged[at] ^= 0x55;
                let _ = read(&damaged);
            }
        }
        assert_eq!(read(&bytes).unwrap(), 60);
    }
}

fn cells_or_none(table: &Table) -> usize {
    table.names().into_iter().for_each(|name| drop(table.floats(name)));
    table.rows()
}

#[test]
fn errors_name_rows_of_the_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("a.csv");
    let mut text = "x\n".to_owned() + &"1\n".repeat(99);
    text += "abc\n";
    fs::File::create(&csv).unwrap().write_all(text.as_bytes()).unwrap();
    let parquet = folder.path().join("a.parquet");
    let values: Vec<f64> = (0..100).map(|k| if k == 99 { f64::INFINITY } else { 1.0 }).collect();
    let mut frame = DataFrame::new_infer_height(vec![Series::new("x".into(), values).into_column()]).unwrap();
    ParquetWriter::new(File::create(&parquet).unwrap()).with_row_group_size(Some(30)).finish(&mut frame).unwrap();
    for (path, place) in [(csv, "row 101, column `x`"), (parquet, "row 100, column `x`")] {
        let mut chunks = TableChunks::open(&path, &Renames::new(), 16).unwrap();
        let mut error = None;
        while let Some(table) = chunks.next_table().unwrap() {
            error = error.or(table.floats("x").err());
        }
        assert!(error.unwrap().to_string().contains(place));
    }
    let renames = Renames::from([("ts".to_owned(), "time".to_owned())]);
    let error = TableChunks::open(folder.path().join("a.csv"), &renames, 16).unwrap_err().to_string();
    assert!(error.contains("there is no column `time`"), "{error}");
}

const PATH: &str = "TRUEUP_TEST_READS";

/// What the process has had in memory at most [kB], where the system tells.
fn peak() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Runs in a process of its own, which the test below starts.
#[test]
#[ignore = "started by `what_is_in_memory_does_not_grow_with_the_file`"]
fn reads_in_pieces_and_says_its_peak() {
    let Some(path) = std::env::var_os(PATH) else { return };
    let mut chunks = TableChunks::open(path, &Renames::new(), TableChunks::ROWS).unwrap();
    let mut sum = 0.0;
    while let Some(table) = chunks.next_table().unwrap() {
        sum += table.floats("price").unwrap().into_iter().flatten().sum::<f64>();
        assert_eq!(table.texts("aggressor").unwrap().len(), table.rows());
    }
    assert!(sum > 0.0);
    println!("peak {}", peak().unwrap_or_default());
}

#[test]
fn what_is_in_memory_does_not_grow_with_the_file() {
    if peak().is_none() {
        println!("skipped: this system does not tell the peak of a process");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let [short, long] = [120_000, 1_200_000].map(|rows| files(folder.path(), rows, 40_000));
    for (short, long) in short.iter().zip(&long) {
        let [once, ten_times] = [short, long].map(|path| {
            let mut child = Command::new(std::env::current_exe().unwrap());
            child.args(["--exact", "chunks::reads_in_pieces_and_says_its_peak", "--ignored", "--nocapture"]);
            let output = child.env(PATH, path).output().unwrap();
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            let found = text.lines().find_map(|line| line.split("peak ").nth(1)?.trim().parse::<u64>().ok());
            found.unwrap_or_else(|| panic!("the child says no peak: {text}"))
        });
        let size = fs::metadata(long).unwrap().len() / 1024;
        let name = long.file_name().unwrap().to_string_lossy();
        println!("{name} of {size} kB: peak {once} kB for a tenth of it, {ten_times} kB for the whole");
        // What is in memory of a file that is read whole grows by some 100 MB here.
        assert!(ten_times < once + 12_000, "{name}: {once} kB grow to {ten_times} kB");
    }
}
