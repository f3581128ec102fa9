//! Bad input, each kind of it, gives an error with place, value and hint; and no input whatever gives a panic.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop where it fails")]

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;

use crate::scene::Scene;
use proptest::prelude::*;
use trueup::io::{
    Increase, Need, OutputTable, Overwrite, Table, TimeFormat, TimeUnit, check_increasing, check_not_negative,
    check_positive, read_trajectory, write_table,
};
use trueup::sim2real::Timestamp;

fn table(scene: &Scene, name: &str) -> Table {
    Table::read(scene.path(name)).unwrap()
}

/// A name with blanks and a mark of the byte order, which belong to it.
const NOTE: &str = "\u{feff}note \n";

fn sample() -> OutputTable {
    OutputTable::new()
        .times("ts", [Timestamp(1_612_517_760_002_000_050), Timestamp(1_612_517_761_000_000_000)])
        .floats("price", [Some(1000.25), None])
        .integers("size", [100, -3])
        .texts("side", [Some("buy, \"now\"".to_owned()), None])
        .texts(NOTE, [Some(" \n".to_owned()), Some("\u{feff}'".to_owned())])
}

#[test]
fn a_table_reads_back_as_it_was_written_in_every_format() {
    let scene = Scene::new();
    for name in ["a.csv", "a.parquet"] {
        write_table(scene.path(name), &sample(), Overwrite::Refuse).unwrap();
        let table = table(&scene, name);
        assert_eq!((table.rows(), table.names()), (2, vec!["ts", "price", "size", "side", NOTE]));
        let format = TimeFormat { zone: chrono_tz::Tz::America__New_York, unit: TimeUnit::Seconds };
        let times = table.times("ts", &format).unwrap();
        assert_eq!(times, [Timestamp(1_612_517_760_002_000_050), Timestamp(1_612_517_761_000_000_000)], "{name}");
        assert_eq!(table.floats("price").unwrap(), [Some(1000.25), None]);
        assert_eq!(table.floats("size").unwrap(), [Some(100.0), Some(-3.0)]);
        assert_eq!(table.integers("size").unwrap(), [Some(100), Some(-3)]);
        assert_eq!(table.texts("size").unwrap(), [Some("100".to_owned()), Some("-3".to_owned())]);
        assert_eq!(table.texts("side").unwrap(), [Some("buy, \"now\"".to_owned()), None]);
        assert_eq!(table.texts(NOTE).unwrap(), [Some(" \n".to_owned()), Some("\u{feff}'".to_owned())]);
        let bytes = fs::read(scene.path(name)).unwrap();
        assert_eq!(sample().bytes(Path::new(name)).unwrap(), bytes, "the same table, other bytes");
    }
    let mut zip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    zip.write_all(&fs::read(scene.path("a.csv")).unwrap()).unwrap();
    let zipped = zip.finish().unwrap();
    let scene = scene.with("b.csv.gz", &zipped).with("cut.csv.gz", &zipped[..zipped.len() / 2]);
    assert_eq!(table(&scene, "b.csv.gz").floats("price").unwrap(), [Some(1000.25), None]);
    insta::assert_snapshot!(scene.shown(Table::read(scene.path("cut.csv.gz"))), @"
    cut.csv.gz: expected a whole gzip file (incomplete deflate stream)
      hint: the file is truncated, corrupt or not compressed: copy or write it again
    ");
}

/// Time that grows with the square of the number of columns would be minutes here.
#[test]
fn a_wide_table_is_read_in_time() {
    let header: Vec<String> = (0..200_000).map(|k| format!("c{k}")).collect();
    let scene = Scene::new().with("wide.csv", format!("{}\n{}\n", header.join(","), vec!["1"; 200_000].join(",")));
    assert_eq!(table(&scene, "wide.csv").floats("c199999").unwrap(), [Some(1.0)]);
}

#[test]
fn cells_that_do_not_fit_are_shown_with_row_and_column() {
    let scene = Scene::new().with("a.csv", "t,q,n,id\n0,1,1,a\n\n1,abc,1.5,\n2,inf,x,c\n3,,,d\n4,NaN,1.0,7\n");
    let a = table(&scene, "a.csv");
    insta::assert_snapshot!(scene.shown(a.floats("q")), @r#"
    a.csv: row 4, column `q`: expected a number, found "abc"
      hint: leave the cell empty where a sample was lost
    "#);
    insta::assert_snapshot!(scene.shown(a.integers("n")), @r#"
    a.csv: row 4, column `n`: expected an integer, found "1.5"
      hint: round the column, or write it without a fraction
    "#);
    insta::assert_snapshot!(scene.shown(a.texts_complete("id")), @"
    a.csv: row 4, column `id`: expected a text, found an empty cell
      hint: this column must be complete: fill the cell or drop the row
    ");
    insta::assert_snapshot!(scene.shown(a.times("id", &TimeFormat::default())), @r#"
    a.csv: row 2, column `id`: expected a time, found "a"
      hint: times are integers (nanoseconds since 1970 in UTC, or the `time_unit` declared) or texts such as 2024-03-08T14:30:00.5Z or, in the `zone` declared, 2024-03-08 09:30:00
    "#);
    insta::assert_snapshot!(scene.shown(a.floats("Q2")), @"
    a.csv: there is no column `Q2`
      hint: did you mean `q`? The file has the columns `t`, `q`, `n` and `id`
    ");
    let scene = scene.with("b.csv", "q,x\n1,-1e-3\n-inf,2\n,\n");
    insta::assert_snapshot!(scene.shown(table(&scene, "b.csv").floats("q")), @r#"
    b.csv: row 3, column `q`: expected a finite number, found "-inf"
      hint: leave the cell empty where a sample was lost
    "#);
    insta::assert_snapshot!(scene.shown(table(&scene, "b.csv").floats_complete("x")), @"
    b.csv: row 4, column `x`: expected a number, found an empty cell
      hint: this column must be complete: fill the cell or drop the row
    ");
}

#[test]
fn columns_are_held_to_signs_and_order() {
    let scene = Scene::new().with("a.csv", "t,p\n0,1\n1,0\n1,-0.01\n0.5,2\n");
    let a = table(&scene, "a.csv");
    let (t, p) = (a.floats_complete("t").unwrap(), a.floats("p").unwrap());
    insta::assert_snapshot!(scene.shown(check_increasing(&a, "t", &t, Increase::Strictly)), @"
    a.csv: row 4, column `t`: expected more than the 1 of row 3, found 1
      hint: two rows have the same value: drop one, or write the column with more digits
    ");
    insta::assert_snapshot!(scene.shown(check_increasing(&a, "t", &t, Increase::OrStays)), @"
    a.csv: row 5, column `t`: expected at least the 1 of row 4, found 0.5
      hint: sort the rows by this column; was a second recording appended?
    ");
    insta::assert_snapshot!(scene.shown(check_positive(&a, "p", &p)), @"
    a.csv: row 3, column `p`: expected a number greater than 0, found 0
      hint: correct the value or drop the row; is another column meant?
    ");
    insta::assert_snapshot!(scene.shown(check_not_negative(&a, "p", &p)), @"
    a.csv: row 4, column `p`: expected a number that is not negative, found -0.01
      hint: correct the value or drop the row; is another column meant?
    ");
}

#[test]
fn files_that_are_no_tables_are_refused() {
    let scene = Scene::new()
        .with("empty.csv", "")
        .with("empty.parquet", "")
        .with("header.csv", "t,q\n")
        .with("ragged.csv", "t,q\n0,1\n1,2,3\n")
        .with("short.csv", "t,q\n0,1\n1\n")
        .with("twice.csv", "t,q,t\n0,1,2\n")
        .with("semicolons.csv", "t;q\n0;1\n")
        .with("latin.csv", b"t,q\n0,\xe9\n")
        .with("notes.txt", "t,q\n0,1\n")
        .with("zipped.csv", [0x1f, 0x8b, 8, 0, 0xff]);
    let read = |name: &str| scene.shown(Table::read(scene.path(name)));
    insta::assert_snapshot!(read("empty.csv"), @"
    empty.csv: the file is empty
      hint: expected a header row and data rows
    ");
    insta::assert_snapshot!(read("empty.parquet"), @"
    empty.parquet: expected a whole Parquet file (parquet: File out of specification: A Parquet file must contain a header and footer with at least 12 bytes)
      hint: the file is truncated, corrupt or of another format: copy or write it again
    ");
    insta::assert_snapshot!(read("header.csv"), @"
    header.csv: row 1: the file has a header but no rows
      hint: was the recording cut off before its first sample?
    ");
    insta::assert_snapshot!(read("ragged.csv"), @"
    ragged.csv: row 3: expected 2 cells, as in the header, found 3
      hint: does a cell hold a comma (a decimal comma, say)? Then it belongs in quotes
    ");
    insta::assert_snapshot!(read("short.csv"), @"
    short.csv: row 3: expected 2 cells, as in the header, found 1
      hint: was the file cut off while it was written?
    ");
    insta::assert_snapshot!(read("twice.csv"), @"
    twice.csv: two columns are named `t`
      hint: rename or drop one of them
    ");
    insta::assert_snapshot!(scene.shown(table(&scene, "semicolons.csv").floats("t")), @"
    semicolons.csv: there is no column `t`
      hint: cells are separated by commas; was the file written with another separator?
    ");
    insta::assert_snapshot!(read("latin.csv"), @"
    latin.csv: row 2: expected UTF-8 text, found byte 0xe9
      hint: save the file as UTF-8
    ");
    insta::assert_snapshot!(read("notes.txt"), @"
    notes.txt: the ending of the name says no format that is read
      hint: tables are .csv, .csv.gz, .parquet, .arrow, .ipc or .feather
    ");
    insta::assert_snapshot!(read("zipped.csv"), @"
    zipped.csv: row 1: expected UTF-8 text, found byte 0x8b
      hint: this is compressed by gzip: name it .csv.gz
    ");
    insta::assert_snapshot!(read("raged.csv"), @"
    raged.csv: there is no such file
      hint: did you mean ragged.csv?
    ");
    insta::assert_snapshot!(read("none/a.csv"), @"
    none/a.csv: there is no such file
      hint: there is no folder none either
    ");
    std::fs::create_dir(scene.0.path().join("few")).unwrap();
    let missing = |name: &str| scene.shown(Table::read(scene.0.path().join("few").join(name)));
    insta::assert_snapshot!(missing("quotes.csv"), @"
    few/quotes.csv: there is no such file
      hint: in the folder few nothing is there
    ");
    for name in ["a.csv", "b.csv", "c.csv", "d.csv", "e.csv", "f.csv", "g.csv"] {
        std::fs::write(scene.0.path().join("few").join(name), "").unwrap();
    }
    insta::assert_snapshot!(missing("quotes.csv"), @"
    few/quotes.csv: there is no such file
      hint: in the folder few there are a.csv, b.csv, c.csv, d.csv, e.csv and 2 more
    ");
    insta::assert_snapshot!(scene.shown(Table::read(scene.0.path())), @"
    FOLDER: expected a file, found a folder
      hint: name a file in it
    ");
}

#[test]
fn parquet_is_refused_wherever_it_is_cut() {
    let whole = sample().bytes(Path::new("a.parquet")).unwrap();
    for cut in [1, 4, 12, whole.len() / 2, whole.len() - 9, whole.len() - 1] {
        let scene = Scene::new().with("a.parquet", &whole[..cut]);
        let shown = scene.shown(Table::read(scene.path("a.parquet")));
        assert!(shown.starts_with("a.parquet: expected a whole Parquet file ("), "{shown}");
        assert!(
            shown.ends_with("hint: the file is truncated, corrupt or of another format: copy or write it again"),
            "{shown}"
        );
    }
    let empty = OutputTable::new().floats("t", Vec::<f64>::new());
    let scene = Scene::new().with("a.parquet", empty.bytes(Path::new("a.parquet")).unwrap());
    insta::assert_snapshot!(scene.shown(Table::read(scene.path("a.parquet"))), @"
    a.parquet: the file has columns but no rows
      hint: was the recording cut off before its first sample?
    ");
}

#[test]
fn renamed_columns_are_read_by_the_contracts_name_and_errors_speak_the_files() {
    let scene = Scene::new().with("a.csv", "when,ts,price_x10000\n2021-03-14 02:30:00,1,abc\n");
    let renames =
        |pairs: &[(&str, &str)]| pairs.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect::<BTreeMap<_, _>>();
    let a = Table::read_with(scene.path("a.csv"), &renames(&[("ts", "when"), ("price", "price_x10000")])).unwrap();
    assert_eq!(a.names(), ["ts", "price"]);
    assert!(a.has("price") && !a.has("prise"));
    let format = TimeFormat { zone: chrono_tz::Tz::America__New_York, unit: TimeUnit::Nanoseconds };
    insta::assert_snapshot!(scene.shown(a.times("ts", &format)), @r#"
    a.csv: row 2, column `when`: expected a time that exists in America/New_York, found "2021-03-14 02:30:00"
      hint: the clocks skip this time when summer time begins: is another `zone` meant?
    "#);
    insta::assert_snapshot!(scene.shown(a.floats("price")), @r#"
    a.csv: row 2, column `price_x10000`: expected a number, found "abc"
      hint: leave the cell empty where a sample was lost
    "#);
    insta::assert_snapshot!(scene.shown(a.check_renames(&["ts", "close"])), @"
    a.csv: `columns` renames to `price`, which nothing reads
      hint: there are `ts` and `close`
    ");
    let wrong = renames(&[("ts", "wen")]);
    insta::assert_snapshot!(scene.shown(Table::read_with(scene.path("a.csv"), &wrong)), @"
    a.csv: there is no column `wen`
      hint: `columns` says that `ts` is here called `wen`; did you mean `when`?
    ");
}

const JOINT: &[(&str, &str, Need)] =
    &[("command", "u", Need::EveryRow), ("position", "q", Need::SomeRows), ("velocity", "qd", Need::Nothing)];

#[test]
fn trajectories_need_a_time_that_goes_on_and_a_command_throughout() {
    let read = |text: &str| {
        let scene = Scene::new().with("a.csv", text);
        scene.shown(read_trajectory(scene.path("a.csv"), JOINT))
    };
    insta::assert_snapshot!(read("t,u,q\n0,0,0\n1,0,0\n1,0,0\n"), @"
    a.csv: row 4, column `t`: expected more than the 1 of row 3, found 1
      hint: two rows have the same value: drop one, or write the column with more digits
    ");
    insta::assert_snapshot!(read("t,u,q\n0,0,0\n2,0,0\n1,0,0\n"), @"
    a.csv: row 4, column `t`: expected more than the 2 of row 3, found 1
      hint: sort the rows by this column; was a second recording appended?
    ");
    insta::assert_snapshot!(read("t,u,q\n0,0,0\n,0,0\n"), @"
    a.csv: row 3, column `t`: expected a number, found an empty cell
      hint: this column must be complete: fill the cell or drop the row
    ");
    insta::assert_snapshot!(read("t,u,q\n0,0,0\n1,NaN,0\n"), @"
    a.csv: row 3, column `u`: expected a number, found NaN
      hint: this column must be complete: fill the cell or drop the row
    ");
    insta::assert_snapshot!(read("t,u,q\n0,0,0\n"), @"
    a.csv: expected at least 2 rows, found 1
      hint: one sample says nothing about what happens between samples
    ");
    insta::assert_snapshot!(read("time,u,q\n0,0,0\n"), @"
    a.csv: there is no column `t`
      hint: a trajectory has its time in seconds in the column `t`; the file has the columns `time`, `u` and `q`
    ");
    insta::assert_snapshot!(read("t,u,x\n0,0,0\n1,0,0\n"), @"
    a.csv: there is no column `q`
      hint: the file has the columns `t`, `u` and `x`
    ");
    insta::assert_snapshot!(read("t,u,q\n0,0,\n1,0,NaN\n"), @"
    a.csv: column `q`: expected at least one number, found none
      hint: every sample is lost: name another column, or leave the channel out
    ");
    let scene = Scene::new().with("a.csv", "t,u,q\n0,1,0\n1,2,\n");
    let trajectory = read_trajectory(scene.path("a.csv"), JOINT).unwrap();
    assert_eq!((trajectory.time.as_slice(), trajectory.complete("command")), (&[0.0, 1.0][..], Some(vec![1.0, 2.0])));
    assert_eq!((trajectory.column("position"), trajectory.complete("position")), (Some(&[Some(0.0), None][..]), None));
    assert_eq!(trajectory.column("velocity"), None);
}

/// Asks everything of a table; whether it answers or refuses is all the same.
fn ask(path: &Path) {
    let _ = read_trajectory(path, JOINT);
    let Ok(table) = Table::read(path) else { return };
    for name in table.names() {
        let floats = table.floats(name);
        let _ = (table.floats_complete(name), table.integers(name), table.texts(name));
        let _ = table.times(name, &TimeFormat { unit: TimeUnit::Seconds, zone: chrono_tz::Tz::Europe__London });
        if let Ok(values) = floats {
            let _ = (check_positive(&table, name, &values), check_not_negative(&table, name, &values));
        }
    }
}

/// A place and a byte to put there.
fn damage() -> impl Strategy<Value = Vec<(prop::sample::Index, u8)>> {
    prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_bytes_make_a_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let scene = Scene::new();
        for name in ["a.csv", "a.csv.gz", "a.parquet", "a.arrow"] {
            fs::write(scene.path(name), &bytes).unwrap();
            ask(&scene.path(name));
        }
    }

    #[test]
    fn no_csv_makes_a_reader_panic(text in "[tuq]{1,2}(,[tuq\"]{1,2}){0,2}\r?\n([-0-9.eE\"nai:TZ ]{0,6}[,\n\r\"]){0,40}") {
        let scene = Scene::new().with("a.csv", &text);
        ask(&scene.path("a.csv"));
    }

    #[test]
    fn no_damaged_parquet_makes_a_reader_panic(places in damage()) {
        let mut bytes = sample().bytes(Path::new("a.parquet")).unwrap();
        for (at, byte) in places {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        let scene = Scene::new().with("a.parquet", &bytes);
        ask(&scene.path("a.parquet"));
    }

    #[test]
    fn floats_survive_csv_bit_by_bit(values in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO, 1..20)) {
        let scene = Scene::new();
        write_table(scene.path("a.csv"), &OutputTable::new().floats("x", values.iter().copied()), Overwrite::Refuse).unwrap();
        let back = table(&scene, "a.csv").floats_complete("x").unwrap();
        let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(bits(&back), bits(&values));
    }
}
