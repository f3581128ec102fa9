//! Changes of a book, price by price: `ts, side, price, size`, optional `action`.

use crate::io::{FeedFormat, InputError, Table, TimeFormat};
use crate::market::{DepthAction, DepthChange, Price, Side};

use super::clocks::Clocks;
use super::decode::{Decode, Emit, Fault, price, size};

/// Reads changes of a book in the contract's layout.
pub(in crate::market) struct DepthRows {
    clocks: Clocks,
    scale: f64,
}

impl DepthRows {
    pub(in crate::market) fn new(format: &FeedFormat) -> Self {
        Self { clocks: Clocks::declared("ts", format), scale: format.price_scale }
    }
}

/// The side of a book that a word names: `bid` and `ask`, or which way the orders there trade.
pub(super) fn book_side(column: &str, words: &[Option<String>], row: usize) -> Result<Side, Fault> {
    let word = words.get(row).and_then(Option::as_deref);
    match word.map(str::to_ascii_lowercase).as_deref() {
        Some("bid" | "b" | "buy") => Ok(Side::Buy),
        Some("ask" | "a" | "sell") => Ok(Side::Sell),
        _ => Err(Fault::word(column, word, "`bid` or `ask`")),
    }
}

/// What becomes of the level of a row; where the file has no such column, it is set.
fn action(words: Option<&[Option<String>]>, row: usize) -> Result<DepthAction, Fault> {
    let Some(words) = words else { return Ok(DepthAction::Set) };
    match words.get(row).and_then(Option::as_deref) {
        Some("set") => Ok(DepthAction::Set),
        Some("clear") => Ok(DepthAction::Clear),
        word => Err(Fault::word("action", word, "`set` or `clear`")),
    }
}

impl Decode<DepthChange> for DepthRows {
    fn columns(&self) -> Vec<&str> {
        self.clocks.columns().chain(["side", "price", "size", "action"]).collect()
    }

    fn clocks(&self) -> Option<[(&str, TimeFormat); 2]> {
        self.clocks.both()
    }

    fn order_column(&self) -> &str {
        self.clocks.order_column()
    }

    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, DepthChange>) -> Result<(), InputError> {
        let times = self.clocks.times(table)?;
        let (sides, prices, sizes) = (table.texts("side")?, table.floats("price")?, table.floats("size")?);
        let actions = if table.has("action") { Some(table.texts("action")?) } else { None };
        for row in 0..table.rows() {
            let Some((time, known_at)) = self.clocks.at(&times, row, emit)? else { continue };
            let change = book_side("side", &sides, row).and_then(|side| {
                let action = action(actions.as_deref(), row)?;
                let (price, size) = match action {
                    DepthAction::Clear => (Price(0), 0.0),
                    DepthAction::Set => (price("price", &prices, row, self.scale)?, size("size", &sizes, row, 1.0)?),
                };
                Ok(DepthChange { time, known_at, side, action, price, size })
            });
            if let Some(change) = emit.sound(row, change)? {
                emit.push(row, change)?;
            }
        }
        Ok(())
    }
}
