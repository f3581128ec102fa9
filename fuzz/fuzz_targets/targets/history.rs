//! Market data: bars, quotes and trades. The first byte says how the file is written, the rest is the file.

use trueup::io::{FeedFormat, Stamp, TimeFormat, TimeUnit};
use trueup::market::{History, TapeFiles, read_tape};
use trueup::sim2real::Timestamp;

use super::scene::{Scene, shown};

/// As a backtest reads them.
pub fn target(scene: &Scene, bytes: &[u8]) {
    let Some((how, rest)) = bytes.split_first() else { return };
    let (path, format) = (scene.write("a.csv", rest), format(*how));
    let interval = (how & 16 != 0).then_some(60 * Timestamp::NANOS);
    if let Some(history) = shown(History::read_bars(&path, &format, interval)) {
        assert!(history.bars().windows(2).all(|pair| pair[0].known_at <= pair[1].open_at));
        let (from, to) = (history.bars()[0].open_at, history.bars()[0].known_at);
        assert!(from < to && !history.within(from, to).bars().is_empty());
    }
    if let Some(history) = shown(History::read_quotes(&path, &format)) {
        let all = history.quotes().all();
        assert!((0..all.len()).map_while(|k| all.get(k)).all(|quote| quote.mid().is_none_or(f64::is_finite)));
    }
}

/// As a twin's tape has them.
pub fn tape(scene: &Scene, bytes: &[u8]) {
    let Some((how, rest)) = bytes.split_first() else { return };
    let (path, format) = (scene.write("a.csv", rest), format(*how));
    for files in [
        TapeFiles { quotes: Some(&path), ..TapeFiles::default() },
        TapeFiles { trades: Some(&path), ..TapeFiles::default() },
        TapeFiles { bars: Some(&path), ..TapeFiles::default() },
    ] {
        shown(read_tape(files, &format));
    }
}

fn format(how: u8) -> FeedFormat {
    FeedFormat {
        stamp: Some(if how & 1 == 0 { Stamp::Open } else { Stamp::Close }),
        time: TimeFormat {
            unit: if how & 2 == 0 { TimeUnit::Nanoseconds } else { TimeUnit::Seconds },
            zone: if how & 4 == 0 { "UTC" } else { "Europe/London" }.parse().expect("a zone"),
        },
        price_scale: if how & 8 == 0 { 1.0 } else { 1e-4 },
        ..FeedFormat::default()
    }
}
