//! A book of Binance futures: its snapshot and the updates that go on from there.
//!
//! Source: Binance, "How to manage a local order book correctly" of the USD-margined futures. An update whose last number is
//! below the snapshot's is in the snapshot already. Each update names the last number of the one before it: where that is
//! another, some are missing, and the book is in doubt until each level has been told anew.

use std::path::Path;

use crate::io::{FeedFormat, InputError, Table, TimeFormat, TimeUnit};
use crate::market::{DepthAction, DepthChange, Finding, Price, Side};
use crate::sim2real::Timestamp;

use super::clocks::Clocks;
use super::decode::{Decode, Emit, Fault, price, size};
use super::depth_rows::book_side;

/// Reads updates, and puts the snapshot where it belongs.
///
/// Updates that came before the snapshot did, and are not in it, can be applied only with it: they count as known from then
/// on. Without a snapshot the book begins empty.
pub(in crate::market) struct BinanceDepth {
    clocks: Clocks,
    scale: f64,
    snapshot: Option<Snapshot>,
    /// The last number of the update at hand, and that of the one before it.
    update: Option<i64>,
    /// Whether the snapshot was given out.
    begun: bool,
}

/// A whole book, and the number of the last update that is in it.
struct Snapshot {
    last_update: i64,
    known_at: Timestamp,
    levels: Vec<DepthChange>,
}

impl BinanceDepth {
    /// Reads the snapshot at once, where the format names one.
    ///
    /// # Errors
    /// What cannot be read of it; levels without a price above 0, and rows of several snapshots.
    pub(in crate::market) fn new(format: &FeedFormat) -> Result<Self, InputError> {
        let (event, local) = (("exch_T_ms", TimeUnit::Milliseconds), ("local_ns", TimeUnit::Nanoseconds));
        let clocks = Clocks::of_layout(event, local, format);
        let snapshot = format.snapshot.as_ref().map(|path| Snapshot::read(path, &clocks, format)).transpose()?;
        Ok(Self { clocks, scale: format.price_scale, snapshot, update: None, begun: false })
    }

    /// Gives the snapshot out, and `row` is the first row after it.
    fn begin(&mut self, row: usize, emit: &mut Emit<'_, DepthChange>) -> Result<(), InputError> {
        self.begun = true;
        let Some(snapshot) = &mut self.snapshot else { return Ok(()) };
        for change in std::mem::take(&mut snapshot.levels) {
            emit.push(row, change)?;
        }
        Ok(())
    }
}

impl Snapshot {
    fn read(path: &Path, clocks: &Clocks, format: &FeedFormat) -> Result<Self, InputError> {
        let table = Table::read_with(path, &format.columns)?;
        let placed = |row: usize, fault: Fault| fault.at(&table, row);
        let times = clocks.times(&table)?;
        let known_at = clocks.known_at(&times, 0).map_err(|fault| placed(0, fault))?;
        // The exchange's clock is told in whole milliseconds, the local one in nanoseconds.
        let time = clocks.happened_at(&times, 0).map_err(|fault| placed(0, fault))?.min(known_at);
        let (sides, prices, sizes) = (table.texts("side")?, table.floats("price")?, table.floats("qty")?);
        let numbers = table.integers("last_update_id")?;
        let mut levels: Vec<DepthChange> = [Side::Buy, Side::Sell]
            .map(|side| DepthChange { time, known_at, side, action: DepthAction::Clear, price: Price(0), size: 0.0 })
            .to_vec();
        for row in 0..table.rows() {
            if numbers[row].is_none() || numbers[row] != numbers[0] {
                let found = numbers[row].map_or_else(|| "an empty cell".to_owned(), |number| number.to_string());
                let error = table.error("last_update_id", row, "expected the same number in all rows of a snapshot");
                return Err(error.found(found).hint("give a file with one snapshot"));
            }
            let level = book_side("side", &sides, row).and_then(|side| {
                let (price, size) = (price("price", &prices, row, format.price_scale)?, size("qty", &sizes, row, 1.0)?);
                Ok(DepthChange { time, known_at, side, action: DepthAction::Set, price, size })
            });
            levels.push(level.map_err(|fault| placed(row, fault))?);
        }
        Ok(Self { last_update: numbers.first().copied().flatten().unwrap_or_default(), known_at, levels })
    }
}

impl Decode<DepthChange> for BinanceDepth {
    fn columns(&self) -> Vec<&str> {
        self.clocks.columns().chain(["last_update_id", "prev_update_id", "side", "price", "qty"]).collect()
    }

    fn clocks(&self) -> Option<[(&str, TimeFormat); 2]> {
        self.clocks.both()
    }

    fn order_column(&self) -> &str {
        self.clocks.order_column()
    }

    fn decode(&mut self, table: &Table, emit: &mut Emit<'_, DepthChange>) -> Result<(), InputError> {
        let times = self.clocks.times(table)?;
        let (sides, prices, sizes) = (table.texts("side")?, table.floats("price")?, table.floats("qty")?);
        let (lasts, befores) = (table.integers("last_update_id")?, table.integers("prev_update_id")?);
        for row in 0..table.rows() {
            let number = |column: &str, values: &[Option<i64>]| {
                values.get(row).copied().flatten().ok_or_else(|| Fault::missing(column, "an integer"))
            };
            let numbers = number("last_update_id", &lasts).and_then(|u| Ok((u, number("prev_update_id", &befores)?)));
            let Some((update, before)) = emit.sound(row, numbers)? else { continue };
            let held = self.snapshot.as_ref().map_or(i64::MIN, |snapshot| snapshot.last_update);
            if !self.begun && update < held {
                self.update = Some(update);
                emit.found(Finding::BeforeSnapshot);
                continue;
            }
            // The rows of one update follow each other.
            if self.update != Some(update) {
                // The first update after the snapshot goes on from it, or from what it holds.
                let missed = self.update.map_or(self.snapshot.is_some() && before > held, |last| last != before);
                if missed {
                    emit.found(Finding::MissedUpdates);
                }
                self.update = Some(update);
            }
            let Some((time, mut known_at)) = self.clocks.at(&times, row, emit)? else { continue };
            if !self.begun {
                self.begin(row, emit)?;
            }
            if let Some(snapshot) = self.snapshot.as_ref().filter(|snapshot| known_at < snapshot.known_at) {
                known_at = snapshot.known_at;
                emit.found(Finding::AwaitedSnapshot);
            }
            let change = book_side("side", &sides, row).and_then(|side| {
                let (price, size) = (price("price", &prices, row, self.scale)?, size("qty", &sizes, row, 1.0)?);
                Ok(DepthChange { time, known_at, side, action: DepthAction::Set, price, size })
            });
            if let Some(change) = emit.sound(row, change)? {
                emit.push(row, change)?;
            }
        }
        Ok(())
    }

    fn last(&mut self) -> Vec<DepthChange> {
        // No update came after the snapshot.
        let snapshot = self.snapshot.as_mut().filter(|_| !self.begun);
        snapshot.map(|snapshot| std::mem::take(&mut snapshot.levels)).unwrap_or_default()
    }
}
