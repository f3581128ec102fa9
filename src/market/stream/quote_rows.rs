//! Quotes: `ts, bid, bid_size, ask, ask_size` and deeper levels, and Binance's best bid and ask.

use crate::io::{FeedFormat, InputError, Layout, Table, TimeFormat, TimeUnit};
use crate::market::row_check::check_quote;
use crate::market::{Book, Finding, Level};

use super::Known;
use super::clocks::Clocks;
use super::decode::{Decode, Emit, Fault, scaled};

/// Reads quotes.
pub(in crate::market) struct QuoteRows {
    clocks: Clocks,
    /// Price and size of bid and ask, level by level.
    levels: Vec<[[String; 2]; 2]>,
    scale: f64,
}

impl QuoteRows {
    pub(in crate::market) fn new(format: &FeedFormat) -> Self {
        let scale = format.price_scale;
        if format.layout == Layout::BinanceBookTicker {
            let (event, local) = (("exch_T_ms", TimeUnit::Milliseconds), ("local_ns", TimeUnit::Nanoseconds));
            let levels = vec![[["bid_px", "bid_sz"], ["ask_px", "ask_sz"]].map(|side| side.map(str::to_owned))];
            return Self { clocks: Clocks::of_layout(event, local, format), levels, scale };
        }
        let level = |k: usize| {
            let number = if k == 1 { String::new() } else { k.to_string() };
            ["bid", "ask"].map(|side| [format!("{side}{number}"), format!("{side}{number}_size")])
        };
        Self { clocks: Clocks::declared("ts", format), levels: (1..=Book::DEPTH).map(level).collect(), scale }
    }
}

/// The columns of one level of one side.
struct LevelColumns<'a> {
    names: &'a [String; 2],
    prices: Vec<Option<f64>>,
    sizes: Vec<Option<f64>>,
}

impl LevelColumns<'_> {
    /// The level in row `row`: none where it is not there.
    fn level(&self, row: usize, scale: f64) -> Result<Option<Level>, Fault> {
        let cell = |values: &[Option<f64>]| values.get(row).copied().flatten();
        let (price, size) = (cell(&self.prices), cell(&self.sizes));
        for (name, value, finding) in [(&self.names[0], price, Finding::Price), (&self.names[1], size, Finding::Size)] {
            if let Some(value) = value.filter(|value| *value < 0.0) {
                let hint = "0 or an empty cell is a side that is not there; drop the row or correct it";
                return Err(Fault::cell(finding, name, "expected a number that is not negative", value, hint));
            }
        }
        let Some(price) = price else { return Ok(None) };
        let level = Level { price: scaled(price, scale), size: size.unwrap_or(f64::INFINITY) };
        Ok((level.price > 0.0 && level.size > 0.0).then_some(level))
    }
}

/// Puts the levels of a side into `into`, up to the first that is not there.
fn fill(into: &mut Vec<Level>, side: &[LevelColumns<'_>], row: usize, scale: f64) -> Result<(), Fault> {
    into.clear();
    for (k, columns) in side.iter().enumerate() {
        // What is behind an empty level is read, so that it is held to be no nonsense, and left alone.
        if let Some(level) = columns.level(row, scale)?
            && into.len() == k
        {
            into.push(level);
        }
    }
    Ok(())
}

/// Counts what is worth telling of a sound quote.
pub(super) fn told(bids: &[Level], asks: &[Level]) -> Option<Finding> {
    match (bids.first(), asks.first()) {
        (None, None) => Some(Finding::Halt),
        (Some(bid), Some(ask)) if bid.price == ask.price => Some(Finding::Locked),
        (Some(_), Some(_)) => None,
        _ => Some(Finding::OneSided),
    }
}

impl Decode<Known<Book>> for QuoteRows {
    fn columns(&self) -> Vec<&str> {
        self.clocks.columns().chain(self.levels.iter().flatten().flatten().map(String::as_str)).collect()
    }

    fn clocks(&self) -> Option<[(&str, TimeFormat); 2]> {
        self.clocks.both()
    }

    fn order_column(&self) -> &str {
        self.clocks.order_column()
    }

    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, Known<Book>>) -> Result<(), InputError> {
        let times = self.clocks.times(table)?;
        let mut sides = [Vec::new(), Vec::new()];
        for (k, level) in self.levels.iter().enumerate() {
            for (side, names) in sides.iter_mut().zip(level) {
                // The first level must be there; a deeper one where either side has it.
                if k == 0 || table.has(&names[0]) {
                    side.push(LevelColumns { names, prices: table.floats(&names[0])?, sizes: table.floats(&names[1])? });
                }
            }
        }
        let (mut bids, mut asks) = (Vec::new(), Vec::new());
        for row in 0..table.rows() {
            let Some((time, known_at)) = self.clocks.at(&times, row, emit)? else { continue };
            let filled = fill(&mut bids, &sides[0], row, self.scale)
                .and_then(|()| fill(&mut asks, &sides[1], row, self.scale))
                .and_then(|()| check_quote(row, &bids, &asks).map_err(|error| Fault::broken(error, self.scale)));
            if emit.sound(row, filled)?.is_none() {
                continue;
            }
            if let Some(finding) = told(&bids, &asks) {
                emit.found(finding);
            }
            emit.push(row, Known { known_at, what: Book::new(time, &bids, &asks) })?;
        }
        Ok(())
    }
}
