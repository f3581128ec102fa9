//! Rows of market data as a journal holds them: exact, and one form for each kind.

use serde::{Deserialize, Serialize};

use crate::market::stream::Known;
use crate::market::{Bar, Book, DepthAction, DepthChange, Level, OrderAction, OrderEvent, Price, Print, Side};
use crate::sim2real::Timestamp;

/// A row of market data. Times are [ns since 1970, UTC]; prices of bars and books by price are whole 1e-9, others the nearest
/// floating-point numbers, as the engine has them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum StoredRow {
    Bar { open_at: i64, known_at: i64, prices: [i64; 4], volume: f64 },
    Quote { time: i64, known_at: i64, bids: Vec<StoredLevel>, asks: Vec<StoredLevel> },
    Trade { time: i64, known_at: i64, price: f64, size: f64, buy: Option<bool> },
    Depth { time: i64, known_at: i64, buy: bool, clear: bool, price: i64, size: f64 },
    Order { time: i64, known_at: i64, id: u64, action: StoredAction, buy: bool, price: i64, size: f64 },
}

/// Price and size; none for a size the data do not know.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredLevel(f64, Option<f64>);

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum StoredAction {
    Add,
    Change,
    Delete,
}

/// What a journal can hold.
pub(super) trait Storable: Clone + Send {
    fn stored(&self) -> StoredRow;
}

fn is_buy(side: Side) -> bool {
    side == Side::Buy
}

impl Storable for Bar {
    fn stored(&self) -> StoredRow {
        let Self { open_at, known_at, open, high, low, close, volume } = *self;
        StoredRow::Bar { open_at: open_at.0, known_at: known_at.0, prices: [open.0, high.0, low.0, close.0], volume }
    }
}

impl Storable for Known<Book> {
    fn stored(&self) -> StoredRow {
        let level = |level: &Level| StoredLevel(level.price, Some(level.size).filter(|size| size.is_finite()));
        let levels = |side| self.what.opposite(side).iter().map(level).collect();
        let (bids, asks) = (levels(Side::Sell), levels(Side::Buy));
        StoredRow::Quote { time: self.what.time.0, known_at: self.known_at.0, bids, asks }
    }
}

impl Storable for Known<Print> {
    fn stored(&self) -> StoredRow {
        let Print { time, price, size, aggressor } = self.what;
        StoredRow::Trade { time: time.0, known_at: self.known_at.0, price, size, buy: aggressor.map(is_buy) }
    }
}

impl Storable for DepthChange {
    fn stored(&self) -> StoredRow {
        let Self { time, known_at, side, action, price: Price(price), size } = *self;
        let (Timestamp(time), Timestamp(known_at), clear) = (time, known_at, action == DepthAction::Clear);
        StoredRow::Depth { time, known_at, buy: is_buy(side), clear, price, size }
    }
}

impl Storable for OrderEvent {
    fn stored(&self) -> StoredRow {
        let Self { time, known_at, id, action, side, price: Price(price), size } = *self;
        let action = match action {
            OrderAction::Add => StoredAction::Add,
            OrderAction::Change => StoredAction::Change,
            OrderAction::Delete => StoredAction::Delete,
        };
        StoredRow::Order { time: time.0, known_at: known_at.0, id, action, buy: is_buy(side), price, size }
    }
}
