//! Bars: `ts, open, high, low, close, volume`.

use crate::io::{FeedFormat, Increase, InputError, Layout, Place, Stamp, Table, TimeFormat, not_increasing};
use crate::market::row_check::check_bar;
use crate::market::{Bar, Finding};
use crate::sim2real::Timestamp;

use super::decode::{Decode, Emit, Fault, number, price, time};

/// Reads bars. The one at hand is held back where its time names its open: it ends, at the latest, where the next begins.
pub(in crate::market) struct BarRows {
    ts: &'static str,
    time: TimeFormat,
    stamp: Stamp,
    interval: i64,
    scale: f64,
    before: Option<(Timestamp, Place)>,
    held: Option<(usize, Bar)>,
}

/// Prices and volume.
const VALUES: [&str; 5] = ["open", "high", "low", "close", "volume"];

impl BarRows {
    /// Bars of `interval` [ns], stamped at `stamp`.
    pub(in crate::market) fn new(format: &FeedFormat, stamp: Stamp, interval: i64) -> Self {
        let (time, scale) = (format.time, format.price_scale);
        Self { ts: Self::time_column(format), time, stamp, interval, scale, before: None, held: None }
    }

    /// The column with the time of a bar.
    pub(in crate::market) fn time_column(format: &FeedFormat) -> &'static str {
        if format.layout == Layout::Lean { "ts_exchange_local" } else { "ts" }
    }

    /// The bar of a row, as long as the interval.
    #[inline(always)]
    fn bar(&self, at: Timestamp, values: &[Vec<Option<f64>>; 5], row: usize) -> Result<Bar, Fault> {
        let [opens, highs, lows, closes, volumes] = values;
        let (open_at, known_at) = match self.stamp {
            Stamp::Open => (at, at + self.interval),
            Stamp::Close => (self.before.map_or(at + -self.interval, |(before, _)| before.max(at + -self.interval)), at),
        };
        let bar = Bar {
            open_at,
            known_at,
            open: price("open", opens, row, self.scale)?,
            high: price("high", highs, row, self.scale)?,
            low: price("low", lows, row, self.scale)?,
            close: price("close", closes, row, self.scale)?,
            volume: number("volume", volumes, row)?,
        };
        match check_bar(row, &bar) {
            Ok(()) => Ok(bar),
            Err(error) => Err(Fault::broken(error, self.scale)),
        }
    }

    /// The time of a row, which comes after the one before.
    #[inline(always)]
    fn time(&self, times: &[Option<Timestamp>], row: usize) -> Result<Timestamp, Fault> {
        let at = time(self.ts, times, row)?;
        match self.before {
            Some((before, place)) if at <= before => Err(self.not_after(at, before, place)),
            _ => Ok(at),
        }
    }

    #[cold]
    fn not_after(&self, at: Timestamp, before: Timestamp, place: Place) -> Fault {
        let column = self.ts;
        let finding = if at == before { Finding::Duplicate } else { Finding::Late };
        Fault::new(finding, move |table, row| not_increasing(table, column, row, &at, (&before, place), Increase::Strictly))
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
        let times = table.times_with_holes(self.ts, &self.time)?;
        let [open, high, low, close, volume] = VALUES.map(|name| table.floats(name));
        let values = [open?, high?, low?, close?, volume?];
        for row in 0..table.rows() {
            let Some(at) = emit.sound(row, self.time(&times, row))? else { continue };
            let bar = emit.sound(row, self.bar(at, &values, row))?;
            self.before = Some((at, table.place(row)));
            // A bar that is left out ends the one before it all the same.
            if let Some((held_at, mut held)) = self.held.take() {
                held.known_at = held.known_at.min(at);
                emit.push(held_at, held)?;
            }
            match (bar, self.stamp, times.get(row + 1)) {
                // The one that ends it is at hand, as nearly always.
                (Some(mut bar), Stamp::Open, Some(Some(next))) if *next > at => {
                    bar.known_at = bar.known_at.min(*next);
                    emit.push(row, bar)?;
                }
                (Some(bar), Stamp::Open, _) => self.held = Some((row, bar)),
                (Some(bar), Stamp::Close, _) => emit.push(row, bar)?,
                (None, ..) => {}
            }
        }
        Ok(())
    }

    fn last(&mut self) -> Vec<Bar> {
        self.held.take().into_iter().map(|(_, bar)| bar).collect()
    }
}
