//! Round trips: from flat to flat.

use crate::market::{Cash, Fill, MoneyError, Position, Record, Side};
use crate::sim2real::Timestamp;

/// A position from the fill that opened it to the fill that closed it or turned it round. What is added to it and what is
/// taken off on the way belongs to the same trip, at average cost, as in the ledger: the gains of all trips add up to what
/// the account gained, to the last unit. A fill that turns a position round ends one trip and begins the next, its fee
/// divided by quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoundTrip {
    /// Number of the instrument.
    pub instrument: usize,
    /// How it was entered: bought for a long trip, sold for a short one.
    pub side: Side,
    /// The first fill.
    pub entered_at: Timestamp,
    /// The fill that closed it; none where something is still held.
    pub exited_at: Option<Timestamp>,
    /// From the first fill to the last, or to the end of the data [s].
    pub seconds: f64,
    /// All that was entered [units], above 0; on the way out and in again it counts again.
    pub quantity: f64,
    /// Average price of what was entered [currency].
    pub entry_price: f64,
    /// Average price of what was taken off [currency]; none where nothing was.
    pub exit_price: Option<f64>,
    /// What was entered, at the prices of its fills.
    pub entry_value: Cash,
    /// Gain before fees; of what is still held, at its last price.
    pub gross: Cash,
    /// Fees.
    pub fees: Cash,
    /// Gain after fees.
    pub net: Cash,
    /// Number of fills; one that turned the position round counts in both trips.
    pub fills: usize,
}

impl RoundTrip {
    /// The trips of `record` in the order in which they were entered, those still under way among them.
    ///
    /// # Errors
    /// If an amount of cash is beyond what can be held.
    pub fn of(record: &Record) -> Result<Vec<Self>, MoneyError> {
        let positions = record.ledger.positions();
        let mut trips: Vec<Trip> = Vec::new();
        let mut under_way: Vec<Option<usize>> = vec![None; positions.len()];
        for fill in &record.blotter.fills {
            let Some(current) = under_way.get_mut(fill.instrument) else { continue };
            let held = current.and_then(|k| trips.get(k)).map_or(0, Trip::held);
            let against = current.and_then(|k| trips.get_mut(k)).filter(|trip| trip.side != fill.side);
            let closing = if against.is_some() { fill.quantity.0.min(held) } else { 0 };
            let closing_fee = part(fill.fee, closing, fill.quantity.0);
            if let Some(trip) = against {
                trip.exit(fill, closing, closing_fee)?;
                if closing == held {
                    *current = None;
                }
            }
            if closing < fill.quantity.0 {
                let k = *current.get_or_insert(trips.len());
                if k == trips.len() {
                    trips.push(Trip::entered_by(fill));
                }
                if let Some(trip) = trips.get_mut(k) {
                    trip.enter(fill, fill.quantity.0 - closing, fill.fee.minus(closing_fee)?)?;
                }
            }
        }
        let end = record.equity.last().map(|point| point.time);
        trips.iter().filter_map(|trip| positions.get(trip.instrument).map(|p| trip.closed(p, end))).collect()
    }

    /// `long` or `short`.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self.side {
            Side::Buy => "long",
            Side::Sell => "short",
        }
    }

    /// Gain after fees over what was entered (a fraction).
    #[must_use]
    pub fn growth(&self) -> Option<f64> {
        super::defined(self.net.to_f64() / self.entry_value.to_f64())
    }
}

/// `part` of `whole` of a fee, rounded towards 0 to 1e-18 of the currency.
fn part(fee: Cash, part: i64, whole: i64) -> Cash {
    let (part, whole) = (i128::from(part), i128::from(whole.max(1)));
    Cash(fee.0 / whole * part + fee.0 % whole * part / whole)
}

/// A trip as it is under way. Quantities are in 1e-9 units; on a long trip sums of them are larger than any position.
struct Trip {
    instrument: usize,
    side: Side,
    entered_at: Timestamp,
    last_at: Timestamp,
    entered: i128,
    exited: i128,
    entry_value: Cash,
    exit_value: Cash,
    fees: Cash,
    fills: usize,
}

impl Trip {
    fn entered_by(fill: &Fill) -> Self {
        Self {
            instrument: fill.instrument,
            side: fill.side,
            entered_at: fill.filled_at,
            last_at: fill.filled_at,
            entered: 0,
            exited: 0,
            entry_value: Cash::ZERO,
            exit_value: Cash::ZERO,
            fees: Cash::ZERO,
            fills: 0,
        }
    }

    /// What is held, as positions count it.
    fn held(&self) -> i64 {
        i64::try_from(self.entered - self.exited).unwrap_or(i64::MAX)
    }

    fn enter(&mut self, fill: &Fill, quantity: i64, fee: Cash) -> Result<(), MoneyError> {
        self.entered += i128::from(quantity);
        self.entry_value = self.entry_value.plus(value(fill, quantity))?;
        self.count(fill, fee)
    }

    fn exit(&mut self, fill: &Fill, quantity: i64, fee: Cash) -> Result<(), MoneyError> {
        self.exited += i128::from(quantity);
        self.exit_value = self.exit_value.plus(value(fill, quantity))?;
        self.count(fill, fee)
    }

    fn count(&mut self, fill: &Fill, fee: Cash) -> Result<(), MoneyError> {
        self.fees = self.fees.plus(fee)?;
        self.last_at = fill.filled_at;
        self.fills += 1;
        Ok(())
    }

    /// The trip as it ended, or as it stands at `end` with the mark of its `position`.
    fn closed(&self, position: &Position, end: Option<Timestamp>) -> Result<RoundTrip, MoneyError> {
        let held = self.held();
        let worth = self.exit_value.plus(position.mark.unwrap_or_default() * crate::market::Quantity(held))?;
        let gross = match self.side {
            Side::Buy => worth.minus(self.entry_value)?,
            Side::Sell => self.entry_value.minus(worth)?,
        };
        let exited_at = (held == 0).then_some(self.last_at);
        // Units of cash over units of quantity are units of price.
        let average = |value: Cash, quantity: i128| value.0 as f64 / quantity as f64 / 1e9;
        Ok(RoundTrip {
            instrument: self.instrument,
            side: self.side,
            entered_at: self.entered_at,
            exited_at,
            seconds: exited_at.or(end).unwrap_or(self.last_at).seconds_since(self.entered_at).max(0.0),
            quantity: self.entered as f64 / 1e9,
            entry_price: average(self.entry_value, self.entered),
            exit_price: (self.exited > 0).then(|| average(self.exit_value, self.exited)),
            entry_value: self.entry_value,
            gross,
            fees: self.fees,
            net: gross.minus(self.fees)?,
            fills: self.fills,
        })
    }
}

fn value(fill: &Fill, quantity: i64) -> Cash {
    fill.price * crate::market::Quantity(quantity)
}
