//! What it costs to hold: positions are charged for the time they were held, by the same mechanisms that charge fills.

use crate::sim2real::Timestamp;

use super::backtest::BacktestError;
use super::session::Session;
use super::{Cash, InFlight, LedgerError, Quantity, Role, Side};

/// Length of a day of UTC [ns].
const DAY: i64 = 86_400 * Timestamp::NANOS;

/// Since when each position has not been charged.
#[derive(Debug, Clone)]
pub(super) struct Carry {
    since: Vec<Timestamp>,
    /// When all are charged next.
    pub next: Timestamp,
}

impl Carry {
    pub fn new(instruments: usize) -> Self {
        Self { since: vec![Timestamp::MIN; instruments], next: Timestamp::MIN }
    }
}

impl Session {
    /// Charges all positions once a day of UTC, at the first event of the next. So it is with exchange calendars too: what is
    /// charged goes by the time held, over nights and weekends, and not by when it is booked.
    #[inline]
    pub(super) fn carry_over(&mut self, now: Timestamp) -> Result<(), BacktestError> {
        if now < self.carry.next || self.venue.charges.is_empty() {
            return Ok(());
        }
        self.carry.next = Timestamp((now.0.div_euclid(DAY) + 1).saturating_mul(DAY));
        self.charge_all(now)
    }

    /// Charges all positions up to `now`.
    pub(super) fn charge_all(&mut self, now: Timestamp) -> Result<(), BacktestError> {
        (0..self.carry.since.len()).try_for_each(|instrument| self.charge_held(instrument, now))
    }

    /// Charges what is held of `instrument` for the time since it was charged last: to be done before it changes.
    pub(super) fn charge_held(&mut self, instrument: usize, now: Timestamp) -> Result<(), BacktestError> {
        if self.venue.charges.is_empty() {
            return Ok(());
        }
        // Word of a fill may come after the day it belongs to was charged.
        let since = self.carry.since[instrument];
        if now <= since {
            return Ok(());
        }
        self.carry.since[instrument] = now;
        let position = self.ledger.positions()[instrument];
        let Some(mark) = position.mark.filter(|_| position.quantity != Quantity::ZERO) else { return Ok(()) };
        let side = if position.quantity > Quantity::ZERO { Side::Buy } else { Side::Sell };
        let mid = mark.to_f64();
        let held = InFlight::market(side, position.quantity.abs().to_f64(), since, mid, mid).as_a(Role::Holder);
        let held = held.of(position.multiplier);
        let place = || format!("{} at {now}", self.setup.instruments[instrument].symbol);
        let failed = |error| BacktestError::Money { place: place(), error };
        let mut sums = Vec::with_capacity(self.venue.charges.len());
        self.venue.floors[instrument].charge(&held, mid, now, |_, sum| sums.push(sum));
        let mut booked = Cash::ZERO;
        for (sum, kind) in sums.into_iter().zip(&self.venue.charges) {
            // Sums are rounded, so that what all charge together is rounded once.
            let sum = Cash::nearest(sum).map_err(failed)?;
            let amount = sum.minus(booked).map_err(failed)?;
            booked = sum;
            self.ledger.charge(instrument, amount, *kind).map_err(|error| match error {
                LedgerError::Money(error) => failed(error),
                other => BacktestError::Account { place: place(), error: other },
            })?;
        }
        Ok(())
    }
}
