//! Trades: `ts, price, size, aggressor`, and Binance's.

use crate::io::{FeedFormat, InputError, Layout, Table, TimeFormat, TimeUnit};
use crate::market::row_check::can_be_price;
use crate::market::{Finding, Print, Side};

use super::clocks::Clocks;
use super::decode::{Decode, Emit, Fault, number, scaled};
use super::{Dated, Known, NumberedPrint};

/// Reads trades.
pub(in crate::market) struct PrintRows {
    clocks: Clocks,
    binance: bool,
    scale: f64,
    /// The number of the last trade, where trades are numbered.
    last_id: i64,
}

impl PrintRows {
    pub(in crate::market) fn new(format: &FeedFormat) -> Self {
        let binance = format.layout == Layout::BinanceTrades;
        let (event, local) = (("exch_T_ms", TimeUnit::Milliseconds), ("local_ns", TimeUnit::Nanoseconds));
        let clocks = match binance {
            true => Clocks::of_layout(event, local, format),
            false => Clocks::declared("ts", format),
        };
        Self { clocks, binance, scale: format.price_scale, last_id: i64::MIN }
    }

    /// Names of size and of who took.
    fn names(&self) -> [&'static str; 2] {
        if self.binance { ["qty", "buyer_is_maker"] } else { ["size", "aggressor"] }
    }

    /// The side that took, where a word says it. Feeds have words of their own for trades of auctions and the like: of
    /// those no side is known.
    fn aggressor(&self, word: Option<&str>) -> Option<Side> {
        match word? {
            // Where the buyer made the market, the seller took.
            "true" | "True" | "1" if self.binance => Some(Side::Sell),
            "false" | "False" | "0" if self.binance => Some(Side::Buy),
            word => Side::of_word(word),
        }
    }
}

/// A number above 0.
pub(super) fn above_zero(finding: Finding, column: &str, values: &[Option<f64>], row: usize) -> Result<f64, Fault> {
    let value = number(column, values, row)?;
    if value > 0.0 {
        return Ok(value);
    }
    let hint = "was a fill value written where nothing was known? Then drop the row";
    Err(Fault::cell(finding, column, "expected a number above 0", value, hint))
}

/// The price of a trade, in `scale` [currency].
pub(super) fn trade_price(column: &str, values: &[Option<f64>], row: usize, scale: f64) -> Result<f64, Fault> {
    let price = scaled(above_zero(Finding::Price, column, values, row)?, scale);
    if can_be_price(price) {
        return Ok(price);
    }
    let message = "expected a price above 0 and at most 9.2e9";
    Err(Fault::cell(Finding::Price, column, message, price, "is `price_scale` right?"))
}

impl<T: From<NumberedPrint> + Dated + Clone + PartialEq> Decode<T> for PrintRows {
    fn columns(&self) -> Vec<&str> {
        let own = self.binance.then_some("trade_id").into_iter().chain(["price"]).chain(self.names());
        self.clocks.columns().chain(own).collect()
    }

    fn clocks(&self) -> Option<[(&str, TimeFormat); 2]> {
        self.clocks.both()
    }

    fn order_column(&self) -> &str {
        self.clocks.order_column()
    }

    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, T>) -> Result<(), InputError> {
        let times = self.clocks.times(table)?;
        let [size, aggressor] = self.names();
        let (prices, sizes) = (table.floats("price")?, table.floats(size)?);
        let words = if self.binance || table.has(aggressor) { Some(table.texts(aggressor)?) } else { None };
        let ids = if self.binance { Some(table.integers("trade_id")?) } else { None };
        for row in 0..table.rows() {
            let Some((time, known_at)) = self.clocks.at(&times, row, emit)? else { continue };
            let id = ids.as_ref().and_then(|ids| ids.get(row).copied().flatten());
            if let Some(id) = id.filter(|id| *id <= self.last_id) {
                let hint = "each trade has its own number, and they increase: was a part of the file appended twice?";
                let last = self.last_id;
                let fault = Fault::new(Finding::Duplicate, move |table, row| {
                    table.error("trade_id", row, format!("expected more than {last}")).found(id).hint(hint)
                });
                emit.sound(row, Err::<(), Fault>(fault))?;
                continue;
            }
            self.last_id = id.unwrap_or(self.last_id);
            let print = trade_price("price", &prices, row, self.scale).and_then(|price| {
                let word = words.as_ref().and_then(|words| words.get(row)?.as_deref());
                let size = above_zero(Finding::Size, size, &sizes, row)?;
                Ok(Print { time, price, size, aggressor: self.aggressor(word) })
            });
            if let Some(what) = emit.sound(row, print)? {
                emit.push(row, NumberedPrint { print: Known { known_at, what }, number: id }.into())?;
            }
        }
        Ok(())
    }
}
