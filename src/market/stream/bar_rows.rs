//! Bars: `ts, open, high, low, close, volume`.

use crate::io::{FeedFormat, Increase, InputError, Layout, Place, Stamp, Table, TimeFormat, not_increasing};
use crate::market::row_check::{check_bar, is_bar};
use crate::market::{Bar, Finding, Price};
use crate::sim2real::Timestamp;

use super::decode::{Decode, Emit, Fault, number, price, time};

/// Reads bars. The one at hand is held back where its time names its open: it ends, at the latest, where the next begins.
pub(in crate::market) struct BarRows {
    ts: &'static str,
    time: TimeFormat,
    stamp: Stamp,
    interval: i64,
    scale: f64,
    /// The time of the row before, and where it stands: in a table before, or in the one at hand.
    before: Option<Timestamp>,
    before_at: Place,
    before_row: Option<usize>,
    held: Option<(usize, Bar)>,
    /// The bars of the table at hand. All are made before any is given out: to copy what was written number by number just now takes
    /// longer than to make it.
    made: Vec<(usize, Bar)>,
}

/// Prices and volume.
const VALUES: [&str; 5] = ["open", "high", "low", "close", "volume"];

impl BarRows {
    /// Bars of `interval` [ns], stamped at `stamp`.
    pub(in crate::market) fn new(format: &FeedFormat, stamp: Stamp, interval: i64) -> Self {
        let (time, scale) = (format.time, format.price_scale);
        let (ts, before_at, made) = (Self::time_column(format), Place::File, Vec::new());
        Self { ts, time, stamp, interval, scale, before: None, before_at, before_row: None, held: None, made }
    }

    /// The column with the time of a bar.
    pub(in crate::market) fn time_column(format: &FeedFormat) -> &'static str {
        if format.layout == Layout::Lean { "ts_exchange_local" } else { "ts" }
    }

    /// When the bar of a row begins and ends, as long as the interval.
    #[inline(always)]
    fn span(&self, at: Timestamp) -> (Timestamp, Timestamp) {
        match self.stamp {
            Stamp::Open => (at, at + self.interval),
            Stamp::Close => (self.before.map_or(at + -self.interval, |before| before.max(at + -self.interval)), at),
        }
    }

    /// The bar of a row that is sound, as nearly all are; none where [`bar_or_fault`](Self::bar_or_fault) has something to say.
    #[inline(always)]
    fn bar(&self, at: Timestamp, values: &[Vec<Option<f64>>; 5], row: usize) -> Option<Bar> {
        let number = |k: usize| values[k].get(row).copied().flatten();
        let price = |k: usize| {
            let value = number(k).filter(|value| *value > 0.0)?;
            Price::nearest(value * self.scale).ok()
        };
        let (open_at, known_at) = self.span(at);
        let (open, high, low, close, volume) = (price(0)?, price(1)?, price(2)?, price(3)?, number(4)?);
        Some(Bar { open_at, known_at, open, high, low, close, volume }).filter(is_bar)
    }

    /// The same of any row, with what is wrong with it. It is apart, as what may be a fault takes longer to be handed on than a bar
    /// to be made.
    #[cold]
    fn bar_or_fault(&self, at: Timestamp, values: &[Vec<Option<f64>>; 5], row: usize) -> Result<Bar, Fault> {
        let [opens, highs, lows, closes, volumes] = values;
        let (open_at, known_at) = self.span(at);
        let bar = Bar {
            open_at,
            known_at,
            open: price("open", opens, row, self.scale)?,
            high: price("high", highs, row, self.scale)?,
            low: price("low", lows, row, self.scale)?,
            close: price("close", closes, row, self.scale)?,
            volume: number("volume", volumes, row)?,
        };
        check_bar(row, &bar).map_err(|error| Fault::broken(error, self.scale))?;
        Ok(bar)
    }

    /// The time of a row, which comes after the one before.
    #[cold]
    fn time_or_fault(&self, table: &Table, times: &[Option<Timestamp>], row: usize) -> Result<Timestamp, Fault> {
        let at = time(self.ts, times, row)?;
        match self.before {
            Some(before) if at <= before => Err(self.not_after(table, at, before)),
            _ => Ok(at),
        }
    }

    fn not_after(&self, table: &Table, at: Timestamp, before: Timestamp) -> Fault {
        let (column, place) = (self.ts, self.before_row.map_or(self.before_at, |row| table.place(row)));
        let finding = if at == before { Finding::Duplicate } else { Finding::Late };
        Fault::new(finding, move |table, row| not_increasing(table, column, row, &at, (&before, place), Increase::Strictly))
    }

    /// Makes the bars of a table.
    fn make(&mut self, table: &Table, emit: &mut Emit<'_, Bar>) -> Result<(), InputError> {
        let times = table.times_with_holes(self.ts, &self.time)?;
        let [open, high, low, close, volume] = VALUES.map(|name| table.floats(name));
        let values = [open?, high?, low?, close?, volume?];
        for row in 0..table.rows() {
            let at = match times[row] {
                Some(at) if self.before.is_none_or(|before| before < at) => at,
                _ => match emit.sound(row, self.time_or_fault(table, &times, row))? {
                    Some(at) => at,
                    None => continue,
                },
            };
            let bar = match self.bar(at, &values, row) {
                None => emit.sound(row, self.bar_or_fault(at, &values, row))?,
                sound => sound,
            };
            (self.before, self.before_row) = (Some(at), Some(row));
            // A bar that is left out ends the one before it all the same.
            if let Some((held_at, mut held)) = self.held.take() {
                held.known_at = held.known_at.min(at);
                self.made.push((held_at, held));
            }
            match (bar, self.stamp, times.get(row + 1)) {
                // The one that ends it is at hand, as nearly always.
                (Some(mut bar), Stamp::Open, Some(Some(next))) if *next > at => {
                    bar.known_at = bar.known_at.min(*next);
                    self.made.push((row, bar));
                }
                (Some(bar), Stamp::Open, _) => self.held = Some((row, bar)),
                (Some(bar), Stamp::Close, _) => self.made.push((row, bar)),
                (None, ..) => {}
            }
        }
        Ok(())
    }
}

impl Decode<Bar> for BarRows {
    fn columns(&self) -> Vec<&str> {
        [self.ts].into_iter().chain(VALUES).collect()
    }

    fn order_column(&self) -> &str {
        self.ts
    }

    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, Bar>) -> Result<(), InputError> {
        self.made.clear();
        self.make(table, emit)?;
        if let Some(row) = self.before_row.take() {
            self.before_at = table.place(row);
        }
        emit.push_all(&self.made)
    }

    fn last(&mut self) -> Vec<Bar> {
        self.held.take().into_iter().map(|(_, bar)| bar).collect()
    }
}
