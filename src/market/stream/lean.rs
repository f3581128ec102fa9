//! Quotes and trades as QuantConnect's Lean keeps them: local times, prices x10000, and rows flagged as suspicious.
//!
//! Source: the readme files of Lean's `Data` folder, and its types `Tick` and `QuoteBar`.

use crate::io::{FeedFormat, InputError, Table, TimeFormat};
use crate::market::row_check::{can_be_price, check_quote};
use crate::market::{Book, Finding, Level, Print};
use crate::sim2real::Timestamp;

use super::Known;
use super::decode::{Decode, Emit, Fault, number, scaled, size, time};
use super::print_rows::{above_zero, trade_price};
use super::quote_rows::told;

/// The time of a row, local to the exchange: of a tick its own, of a bar that of its start.
const TS: &str = "ts_exchange_local";
const SUSPICIOUS: &str = "suspicious";
/// What a unit of the prices of ticks is worth [currency]: their columns' names say it.
const TICK_SCALE: f64 = 1e-4;
/// Price and size of bid and ask.
const TICKS: [[&str; 2]; 2] = [["bid_x10000", "bid_sz"], ["ask_x10000", "ask_sz"]];
const CLOSES: [[&str; 2]; 2] = [["bid_c", "bid_sz"], ["ask_c", "ask_sz"]];

/// Reads quotes: of ticks, or the last ones of quote bars, known when the bar ends.
///
/// A tick tells of one side: the other, with a price of 0, stays as it was quoted last, by whichever exchange. The quotes of
/// several exchanges may so cross each other.
pub(in crate::market) struct LeanQuotes {
    time: TimeFormat,
    interval: Option<i64>,
    scale: f64,
    sides: [Option<Level>; 2],
}

impl LeanQuotes {
    pub(in crate::market) fn new(format: &FeedFormat, interval: Option<i64>) -> Self {
        Self { time: format.time, interval, scale: format.price_scale, sides: [None; 2] }
    }

    /// When the row that is stamped `at` was known: where it is a bar of that length.
    fn ends(table: &Table, at: Timestamp, bars: bool, interval: Option<i64>) -> Result<Timestamp, InputError> {
        match (bars, interval) {
            (false, _) => Ok(at),
            (true, Some(interval)) => Ok(at + interval),
            (true, None) => {
                Err(InputError::new(table.path(), "nothing says how long a quote bar is, after which it is known")
                    .hint("declare it: interval = \"1m\" in [[data]]"))
            }
        }
    }
}

/// The level in a row: none where the price or the size is 0.
fn level(names: [&str; 2], values: &[Vec<Option<f64>>; 2], row: usize, scale: f64) -> Result<Option<Level>, Fault> {
    let price = number(names[0], &values[0], row)?;
    if price < 0.0 {
        let hint = "0 is a side that the row does not tell of; drop the row or correct it";
        return Err(Fault::cell(Finding::Price, names[0], "expected a number that is not negative", price, hint));
    }
    let level = Level { price: scaled(price, scale), size: size(names[1], &values[1], row, 1.0)? };
    if level.price > 0.0 && !can_be_price(level.price) {
        let message = "expected a price of at most 9.2e9";
        return Err(Fault::cell(Finding::Price, names[0], message, level.price, "is `price_scale` right?"));
    }
    Ok((level.price > 0.0 && level.size > 0.0).then_some(level))
}

/// Which rows are flagged as suspicious.
fn flags(table: &Table) -> Result<Vec<bool>, InputError> {
    if !table.has(SUSPICIOUS) {
        return Ok(vec![false; table.rows()]);
    }
    let flagged = |word: Option<String>| word.is_some_and(|word| !matches!(word.as_str(), "0" | "false" | "False"));
    Ok(table.texts(SUSPICIOUS)?.into_iter().map(flagged).collect())
}

impl Decode<Known<Book>> for LeanQuotes {
    fn columns(&self) -> Vec<&str> {
        [TS, SUSPICIOUS].into_iter().chain(TICKS.into_iter().chain(CLOSES).flatten()).collect()
    }

    fn order_column(&self) -> &str {
        TS
    }

    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, Known<Book>>) -> Result<(), InputError> {
        let bars = !table.has(TICKS[0][0]) && table.has(CLOSES[0][0]);
        let (names, scale) = if bars { (CLOSES, self.scale) } else { (TICKS, TICK_SCALE) };
        let times = table.times_with_holes(TS, &self.time)?;
        let [bid, ask] = names.map(|side| Ok::<_, InputError>([table.floats(side[0])?, table.floats(side[1])?]));
        let (values, flags) = ([bid?, ask?], flags(table)?);
        for (row, flagged) in flags.into_iter().enumerate() {
            if flagged {
                emit.found(Finding::Suspicious);
                continue;
            }
            let read = time(TS, &times, row).and_then(|at| {
                let side = |k: usize| level(names[k], &values[k], row, scale);
                Ok((at, [side(0)?, side(1)?]))
            });
            let Some((at, levels)) = emit.sound(row, read)? else { continue };
            let time = Self::ends(table, at, bars, self.interval)?;
            match levels {
                // A tick of neither side empties both; a bar tells of both always.
                [None, None] => self.sides = levels,
                _ if bars => self.sides = levels,
                [bid, ask] => self.sides = [bid.or(self.sides[0]), ask.or(self.sides[1])],
            }
            let [bid, ask] = &self.sides;
            let (bids, asks) = (bid.as_slice(), ask.as_slice());
            let sound = check_quote(row, bids, asks).map_err(|_| {
                let hint = "quotes of several exchanges may cross: on_bad = \"drop\" leaves them out";
                let price = asks.first().map_or(0.0, |level| level.price / scale);
                // In the file's own unit, without what the division adds.
                let price = (price * 1e6).round() / 1e6;
                Fault::cell(Finding::Crossed, names[1][0], "the bid is above the ask", price, hint)
            });
            if emit.sound(row, sound)?.is_none() {
                continue;
            }
            if let Some(finding) = told(bids, asks) {
                emit.found(finding);
            }
            emit.push(row, Known { known_at: time, what: Book::new(time, bids, asks) })?;
        }
        Ok(())
    }
}

/// Reads trades.
pub(in crate::market) struct LeanPrints {
    time: TimeFormat,
}

impl LeanPrints {
    pub(in crate::market) fn new(format: &FeedFormat) -> Self {
        Self { time: format.time }
    }
}

impl Decode<Known<Print>> for LeanPrints {
    fn columns(&self) -> Vec<&str> {
        vec![TS, "price_x10000", "qty", SUSPICIOUS]
    }

    fn order_column(&self) -> &str {
        TS
    }

    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, Known<Print>>) -> Result<(), InputError> {
        let times = table.times_with_holes(TS, &self.time)?;
        let (prices, sizes, flags) = (table.floats("price_x10000")?, table.floats("qty")?, flags(table)?);
        for (row, flagged) in flags.into_iter().enumerate() {
            if flagged {
                emit.found(Finding::Suspicious);
                continue;
            }
            let print = time(TS, &times, row).and_then(|time| {
                let price = trade_price("price_x10000", &prices, row, TICK_SCALE)?;
                let size = above_zero(Finding::Size, "qty", &sizes, row)?;
                Ok(Known { known_at: time, what: Print { time, price, size, aggressor: None } })
            });
            if let Some(print) = emit.sound(row, print)? {
                emit.push(row, print)?;
            }
        }
        Ok(())
    }
}
