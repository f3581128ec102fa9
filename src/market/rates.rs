//! What foreign currencies are worth: rates as they become known, and what is looked at when something became known.

use crate::sim2real::Timestamp;

use super::account::Rate;
use super::backtest::BacktestError;
use super::session::Session;
use super::{Arrival, Multiplier, Price};

impl Session {
    /// Takes the rates that are known by `now`.
    #[inline]
    pub(super) fn look_up_rates(&mut self, now: Timestamp) {
        let Some(keeping) = &mut self.keeping else { return };
        if now < keeping.next_rate {
            return;
        }
        keeping.next_rate = Timestamp::MAX;
        for (k, rate) in keeping.account.rates.iter().enumerate() {
            let Rate::Known(rates) = rate else { continue };
            let from = &mut keeping.rows[k];
            let known = rates[*from..].iter().take_while(|(at, _)| *at <= now).count();
            *from += known;
            if let Some((_, rate)) = from.checked_sub(1).filter(|_| known > 0).and_then(|row| rates.get(row)) {
                // The account was held to rates above 0.
                drop(self.ledger.set_rate(k + 1, *rate));
            }
            if let Some((at, _)) = rates.get(*from) {
                keeping.next_rate = keeping.next_rate.min(*at);
            }
        }
    }

    /// Data became known: rates, marks of the time before a split, and margin are looked at.
    pub(super) fn keep_account(&mut self, arrival: &Arrival) -> Result<(), BacktestError> {
        let event = arrival.event;
        self.look_up_rates(event.time);
        self.mark_as_split(arrival).map_err(|error| self.money(event, error))?;
        let Some(keeping) = &self.keeping else { return Ok(()) };
        if let (Some(currency), Some(price)) = (keeping.tells[event.instrument], self.known[event.instrument].mark) {
            let place = || format!("{} at {}", self.setup.instruments[event.instrument].symbol, event.time);
            let set = self.ledger.set_rate(currency, price);
            set.map_err(|error| BacktestError::Account { place: place(), error })?;
        }
        if keeping.margin { self.call_margin(event) } else { Ok(()) }
    }

    /// What one unit of an instrument at a price of 1 is worth [base currency]; 0 where its currency has no rate yet.
    pub(super) fn worth_of_one(&self, instrument: usize) -> f64 {
        let position = &self.ledger.positions()[instrument];
        multiplied(self.rate_of(position.currency), position.multiplier)
    }

    /// What one unit of a currency is worth [base currency]; 0 where it has no rate yet.
    pub(super) fn rate_of(&self, currency: usize) -> f64 {
        if currency == 0 { 1.0 } else { self.ledger.balances()[currency].rate.map_or(0.0, Price::to_f64) }
    }
}

/// `rate` for so many units.
pub(super) fn multiplied(rate: f64, multiplier: Multiplier) -> f64 {
    rate * multiplier.get() as f64
}
