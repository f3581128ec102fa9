//! Margin: what equity the positions require, and what to close where it falls short.

use std::cmp::Reverse;

use crate::market::{Cash, MoneyError, Quantity, Side};

use super::{Fraction, Ledger, Position, Requirement, Terms};

/// An account's equity beside what its positions require, in the base currency.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Margin {
    /// Cash and positions.
    pub equity: Cash,
    /// Required to open what is held.
    pub required_initial: Cash,
    /// Required to keep it.
    pub required_maintenance: Cash,
}

impl Margin {
    /// Equity beyond the initial requirement: what new positions may require; below 0 where none may be opened.
    ///
    /// # Errors
    /// If 128 bits do not hold it.
    pub fn excess(&self) -> Result<Cash, MoneyError> {
        self.equity.minus(self.required_initial)
    }

    /// Whether equity is below what it takes to keep the positions.
    #[must_use]
    pub fn is_below_maintenance(&self) -> bool {
        self.equity < self.required_maintenance
    }
}

/// A part of a position to be closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Closing {
    /// Number of the instrument.
    pub instrument: usize,
    /// Which way: a long position is sold.
    pub side: Side,
    /// How much, above 0, in whole lots.
    pub quantity: Quantity,
}

impl Ledger {
    /// Equity and what the positions require.
    ///
    /// The value of a position is taken to the base currency, rounded down, and its requirement rounded up, to 1e-18. Long
    /// and short positions in different instruments do not offset each other.
    ///
    /// # Errors
    /// If a currency has no rate, or 128 bits do not hold a sum.
    pub fn margin(&self) -> Result<Margin, MoneyError> {
        let (mut required_initial, mut required_maintenance) = (Cash::ZERO, Cash::ZERO);
        for (position, terms) in self.positions.iter().zip(&self.terms).filter(|(position, _)| position.quantity.0 != 0) {
            let Requirement { initial, maintenance } = requirement(terms, position.quantity);
            required_initial = required_initial.plus(self.required(position, position.quantity, initial)?)?;
            required_maintenance = required_maintenance.plus(self.required(position, position.quantity, maintenance)?)?;
        }
        Ok(Margin { equity: self.equity()?, required_initial, required_maintenance })
    }

    /// The initial margin that `quantity` of an instrument, negative when short, requires at its mark, in the base currency; none
    /// where there is no such instrument.
    ///
    /// # Errors
    /// If its currency has no rate, or 128 bits do not hold it.
    pub fn initial_margin_of(&self, instrument: usize, quantity: Quantity) -> Result<Cash, MoneyError> {
        let (Some(position), Some(terms)) = (self.positions.get(instrument), self.terms.get(instrument)) else {
            return Ok(Cash::ZERO);
        };
        self.required(position, quantity, requirement(terms, quantity).initial)
    }

    /// What to close so that equity is no longer below maintenance, at the present marks and without costs; nothing where it
    /// is not. Where equity is below 0, no closing mends that, and all is closed.
    ///
    /// Positions are closed one after the other, that which requires the most maintenance margin first, of two alike the
    /// instrument that comes first, and of each no more lots than it takes. `lots` are the instruments' lot sizes; of
    /// a position that is no whole number of lots the rest stays.
    ///
    /// # Errors
    /// As [`Ledger::margin`].
    pub fn liquidation(&self, lots: &[Quantity]) -> Result<Vec<Closing>, MoneyError> {
        let margin = self.margin()?;
        let mut missing = margin.required_maintenance.minus(margin.equity)?;
        let mut by_requirement = Vec::new();
        for (instrument, position) in self.positions.iter().enumerate().filter(|(_, position)| position.quantity.0 != 0) {
            let fraction = requirement(&self.terms[instrument], position.quantity).maintenance;
            by_requirement.push((Reverse(self.required(position, position.quantity, fraction)?), instrument, fraction));
        }
        by_requirement.sort_unstable();
        let mut closings = Vec::new();
        for (Reverse(required), instrument, fraction) in by_requirement {
            if missing <= Cash::ZERO || required == Cash::ZERO {
                break;
            }
            let position = &self.positions[instrument];
            let lot = lots.get(instrument).map_or(1, |lot| lot.0.max(1));
            let held = position.quantity.abs().0;
            let released = |lots: i64| required.minus(self.required(position, Quantity(held - lots * lot), fraction)?);
            // The least number of lots that releases enough, or all of them.
            let (mut enough, mut too_few) = (held / lot, 0);
            while enough - too_few > 1 {
                let middle = too_few + (enough - too_few) / 2;
                if released(middle)? < missing { too_few = middle } else { enough = middle }
            }
            if enough > 0 {
                missing = missing.minus(released(enough)?)?;
                let side = if position.quantity.0 > 0 { Side::Sell } else { Side::Buy };
                closings.push(Closing { instrument, side, quantity: Quantity(enough * lot) });
            }
        }
        Ok(closings)
    }

    /// What `quantity` of a position, either way, requires in the base currency.
    fn required(&self, position: &Position, quantity: Quantity, fraction: Fraction) -> Result<Cash, MoneyError> {
        let value = position.amount(position.mark.unwrap_or_default(), quantity)?;
        fraction.of_rounded_up(self.in_base(position.currency, Cash(value.0.saturating_abs()))?)
    }
}

/// What the terms require of a position of that sign.
fn requirement(terms: &Terms, quantity: Quantity) -> Requirement {
    if quantity.0 < 0 { terms.short } else { terms.long }
}
