//! Round trips: from flat to flat.

use crate::market::{ActionKind, BookedAction, Cash, Fill, MoneyError, Multiplier, Position, Quantity, Record, Side};
use crate::sim2real::Timestamp;

/// A position from the fill that opened it to the fill that closed it or turned it round. What is added to it and what is
/// taken off on the way belongs to the same trip, at average cost, as in the ledger: the gains of all trips add up to what
/// the account gained, to the last unit, dividends and charges left aside. A fill that turns a position round ends one trip and
/// begins the next, its fee divided by quantity. After a split a trip goes on in new units, as if it had been entered in
/// them; what is paid for fractions leaves it. Prices are per unit, and amounts have the multiplier in them, both in the
/// instrument's currency.
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
    /// What one unit of the instrument's currency was worth at the last fill, or at the end where something is still held
    /// [currency of the run].
    pub rate: f64,
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
        let mut actions = record.account.actions.iter().peekable();
        for (number, fill) in record.blotter.fills.iter().enumerate() {
            while let Some(action) = actions.next_if(|action| action.fills <= number) {
                split(action, &mut trips, &mut under_way)?;
            }
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
                    let multiplier = positions.get(fill.instrument).map_or(Multiplier::default(), |p| p.multiplier);
                    trips.push(Trip::entered_by(fill, multiplier));
                }
                if let Some(trip) = trips.get_mut(k) {
                    trip.enter(fill, fill.quantity.0 - closing, fill.fee.minus(closing_fee)?)?;
                }
            }
        }
        actions.try_for_each(|action| split(action, &mut trips, &mut under_way))?;
        let end = record.equity.last().map(|point| point.time);
        let closed = |trip: &Trip| -> Option<Result<Self, MoneyError>> {
            let position = positions.get(trip.instrument)?;
            let rate = if trip.held() == 0 { trip.rate } else { record.rate_of(position.currency) };
            Some(trip.closed(position, end).map(|closed| Self { rate, ..closed }))
        };
        trips.iter().filter_map(closed).collect()
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

/// Tells the trip under way in the instrument of a split in new units.
fn split(action: &BookedAction, trips: &mut [Trip], under_way: &mut [Option<usize>]) -> Result<(), MoneyError> {
    let ActionKind::Split { new, old } = action.action.kind else { return Ok(()) };
    let Some(current) = under_way.get_mut(action.action.instrument) else { return Ok(()) };
    let Some(trip) = current.and_then(|k| trips.get_mut(k)) else { return Ok(()) };
    trip.entered = trip.entered * i128::from(new) / i128::from(old);
    // The rest has left, for cash.
    trip.exited = trip.entered - i128::from(action.after.abs().0);
    let paid = if trip.side == Side::Buy { action.received } else { Cash::ZERO.minus(action.received)? };
    trip.exit_value = trip.exit_value.plus(paid)?;
    if action.after == Quantity::ZERO {
        trip.last_at = action.action.at;
        *current = None;
    }
    Ok(())
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
    multiplier: Multiplier,
    /// Of its last fill.
    rate: f64,
}

impl Trip {
    fn entered_by(fill: &Fill, multiplier: Multiplier) -> Self {
        Self {
            multiplier,
            rate: fill.rate,
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
        self.entry_value = self.entry_value.plus(self.value(fill, quantity)?)?;
        self.count(fill, fee)
    }

    fn exit(&mut self, fill: &Fill, quantity: i64, fee: Cash) -> Result<(), MoneyError> {
        self.exited += i128::from(quantity);
        self.exit_value = self.exit_value.plus(self.value(fill, quantity)?)?;
        self.count(fill, fee)
    }

    fn value(&self, fill: &Fill, quantity: i64) -> Result<Cash, MoneyError> {
        worth(fill.price * Quantity(quantity), self.multiplier)
    }

    fn count(&mut self, fill: &Fill, fee: Cash) -> Result<(), MoneyError> {
        self.fees = self.fees.plus(fee)?;
        (self.last_at, self.rate) = (fill.filled_at, fill.rate);
        self.fills += 1;
        Ok(())
    }

    /// The trip as it ended, or as it stands at `end` with the mark of its `position`.
    fn closed(&self, position: &Position, end: Option<Timestamp>) -> Result<RoundTrip, MoneyError> {
        let held = self.held();
        let still = worth(position.mark.unwrap_or_default() * Quantity(held), self.multiplier)?;
        let left = self.exit_value.plus(still)?;
        let gross = match self.side {
            Side::Buy => left.minus(self.entry_value)?,
            Side::Sell => self.entry_value.minus(left)?,
        };
        let exited_at = (held == 0).then_some(self.last_at);
        // Units of cash over units of quantity are units of price.
        let units = self.multiplier.get() as f64;
        let average = |value: Cash, quantity: i128| value.0 as f64 / quantity as f64 / 1e9 / units;
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
            rate: self.rate,
            fills: self.fills,
        })
    }
}

/// `amount` so many times.
fn worth(amount: Cash, multiplier: Multiplier) -> Result<Cash, MoneyError> {
    amount.0.checked_mul(multiplier.get().into()).map(Cash).ok_or(MoneyError::Overflow)
}
