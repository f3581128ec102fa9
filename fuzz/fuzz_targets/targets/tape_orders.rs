//! Tapes of which orders are made: one file, or two with a line `--` between.

use trueup::io::InputError;
use trueup::market::tape_orders::{TapeOrder, TapeSettings, TapeSink, TapeSources};
use trueup::market::{Level, Print};
use trueup::sim2real::Timestamp;

use super::scene::{Scene, shown};

/// Holds what is found to what every tape obeys.
#[derive(Default)]
struct Held {
    quoted_at: Option<Timestamp>,
}

impl TapeSink for Held {
    type Error = InputError;

    fn quote(&mut self, time: Timestamp, bids: &[Level], asks: &[Level]) -> Result<(), InputError> {
        assert!(self.quoted_at.is_none_or(|before| before <= time), "quotes go back");
        assert!(bids.windows(2).all(|pair| pair[0].price > pair[1].price), "bids out of order");
        assert!(asks.windows(2).all(|pair| pair[0].price < pair[1].price), "asks out of order");
        self.quoted_at = Some(time);
        Ok(())
    }

    fn print(&mut self, _print: Print) -> Result<(), InputError> {
        Ok(())
    }

    fn order(&mut self, order: TapeOrder) -> Result<(), InputError> {
        assert!(!order.fills.is_empty() && order.filled() <= order.quantity, "{order:?}");
        assert!(
            order.touch[0] < order.touch[1] && order.fills.iter().all(|fill| fill.filled_at >= order.decided_at),
            "{order:?}"
        );
        Ok(())
    }
}

pub fn target(scene: &Scene, bytes: &[u8]) {
    let cut = bytes.windows(4).position(|four| four == b"\n--\n");
    let (first, second) = cut.map_or((bytes, None), |at| (&bytes[..=at], Some(&bytes[at + 4..])));
    let mut paths = vec![scene.write("a.csv", first)];
    paths.extend(second.map(|second| scene.write("b.csv", second)));
    let read = |sources: TapeSources| sources.read(TapeSettings { levels: 3, apart: 0 }, &mut Held::default());
    shown(TapeSources::find(&paths).and_then(read));
}
