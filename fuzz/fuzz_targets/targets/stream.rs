//! Market data as streams, in every layout, and tables in pieces. The first bytes say how the file is written and read, the
//! rest is the file.

use std::fmt::Debug;
use std::path::Path;

use trueup::io::{ClockOffset, FeedClock, FeedFormat, FeedRules, Layout, OnBad, Renames, Stamp, Table, TableChunks};
use trueup::market::{Dated, FileStream, Stream};
use trueup::sim2real::Timestamp;

use super::scene::{Scene, shown};

/// In every kind of data that the layout has.
pub fn target(scene: &Scene, bytes: &[u8]) {
    let Some(([layout, how, rows], rest)) = bytes.split_first_chunk() else { return };
    // The same bytes are a file of changes and, up to a line of `=`, a snapshot.
    let cut = rest.windows(3).position(|three| three == b"==\n");
    let (snapshot, file) = cut.map_or((None, rest), |at| (Some(&rest[..at]), &rest[at + 3..]));
    let path = scene.write("a.csv", file);
    let mut format = format(*layout, *how);
    format.snapshot = snapshot.map(|bytes| scene.write("snapshot.csv", bytes));
    let (rows, minute) = (usize::from(*rows) % 7 + 1, Some(60 * Timestamp::NANOS));
    same(rows, |rows| FileStream::bars(&path, &format, minute, rows));
    same(rows, |rows| FileStream::quotes(&path, &format, minute, rows));
    same(rows, |rows| FileStream::trades(&path, &format, rows));
    same(rows, |rows| FileStream::depth(&path, &format, rows));
    same(rows, |rows| FileStream::order_events(&path, &format, rows));
}

/// Holds a stream to its contract, and to be the same whatever is read at a time, where it can be read.
fn same<T: Dated + Debug + PartialEq, S: Stream<T>, E: std::fmt::Display>(
    rows: usize,
    open: impl Fn(usize) -> Result<S, E>,
) {
    let read = |rows: usize| {
        let (mut stream, mut all) = (shown(open(rows))?, Vec::new());
        while shown(stream.refill(&mut all))? {}
        assert!(all.windows(2).all(|pair| pair[0].known_at() <= pair[1].known_at()), "out of order");
        assert!(all.iter().all(|row| row.time() <= row.known_at()), "known before it happened");
        Some(all)
    };
    if let (Some(whole), Some(pieces)) = (read(TableChunks::ROWS), read(rows)) {
        assert_eq!(whole, pieces, "not the same in pieces");
    }
}

fn format(layout: u8, how: u8) -> FeedFormat {
    let layout = Layout::ALL[usize::from(layout) % Layout::ALL.len()];
    let flag = |bit: u8| how & bit != 0;
    let own = layout.is_own() && flag(8);
    FeedFormat {
        stamp: Some(if flag(1) { Stamp::Close } else { Stamp::Open }),
        clock: FeedClock {
            known_at: own.then(|| "known_at".to_owned()),
            offset: if flag(2) && (own || layout.has_local_clock()) {
                ClockOffset::Estimated
            } else {
                ClockOffset::default()
            },
        },
        rules: FeedRules {
            on_bad: if flag(4) { OnBad::Drop } else { OnBad::Refuse },
            reorder: flag(16).then_some(1_000),
            max_gap: flag(32).then_some(5),
            until: flag(64).then_some(Timestamp(100)),
        },
        ..FeedFormat::of_layout(layout)
    }
}

/// Tables in pieces: the first byte says the format and how many rows a piece has.
pub fn chunks(scene: &Scene, bytes: &[u8]) {
    let Some((how, rest)) = bytes.split_first() else { return };
    let ending = ["csv", "csv.gz", "parquet", "arrow"][usize::from(how % 4)];
    let path = scene.write(&format!("a.{ending}"), rest);
    let rows = usize::from(how / 4) % 9 + 1;
    let whole = shown(Table::read(&path));
    if let (Some(whole), Some(pieces)) = (whole, in_pieces(&path, rows)) {
        let texts = |table: &Table| -> Vec<Option<Vec<Option<String>>>> {
            table.names().into_iter().map(|name| shown(table.texts(name))).collect()
        };
        assert_eq!(pieces.iter().map(Table::rows).sum::<usize>(), whole.rows());
        let places: Vec<_> = pieces.iter().flat_map(|piece| (0..piece.rows()).map(|row| piece.place(row))).collect();
        assert_eq!(places, (0..whole.rows()).map(|row| whole.place(row)).collect::<Vec<_>>());
        let joined = pieces
            .iter()
            .map(texts)
            .reduce(|all, next| all.into_iter().zip(next).map(|(all, next)| Some([all?, next?].concat())).collect());
        let whole = texts(&whole);
        // A column that cannot be converted as a whole may be in a piece, and the other way round never.
        for (whole, joined) in whole.into_iter().zip(joined.unwrap_or_default()) {
            assert!(whole.is_none() || whole == joined, "not the same in pieces");
        }
    }
}

fn in_pieces(path: &Path, rows: usize) -> Option<Vec<Table>> {
    let mut chunks = shown(TableChunks::open(path, &Renames::new(), rows))?;
    let mut all = Vec::new();
    while let Some(table) = shown(chunks.next_table())? {
        assert!((1..=rows).contains(&table.rows()));
        all.push(table);
    }
    Some(all)
}
