//! What becomes of orders: it is on its way for a while, and is booked when it is known.

use super::agenda::{Due, Phase};
use super::backtest::BacktestError;
use super::session::Session;
use super::venue::{Filled, Outcome, What};
use super::{Cash, Fill, FillCost, News, Notice, Quantity, Status, Trade, Why};

impl Session {
    /// Takes what happened on a floor, which its owner will know in a while.
    pub(super) fn settle(&mut self, instrument: usize) -> Result<(), BacktestError> {
        if self.venue.floors[instrument].is_quiet() {
            return Ok(());
        }
        let (mut outcomes, mut terms) = (std::mem::take(&mut self.outcomes), std::mem::take(&mut self.terms));
        self.venue.floors[instrument].drain(&mut outcomes, &mut terms);
        let count = self.venue.conceding.len();
        let mut fills = 0;
        for outcome in &outcomes {
            let mut own: &[f64] = &[];
            if let What::Filled(filled) = outcome.what {
                self.check_price(outcome, &filled)?;
                own = &terms[fills * count..(fills + 1) * count];
                fills += 1;
            }
            self.pend(*outcome, own);
        }
        outcomes.clear();
        terms.clear();
        (self.outcomes, self.terms) = (outcomes, terms);
        Ok(())
    }

    fn check_price(&self, outcome: &Outcome, filled: &Filled) -> Result<(), BacktestError> {
        if filled.price.0 > 0 && filled.model_price.is_finite() {
            return Ok(());
        }
        let symbol = self.setup.instruments[outcome.instrument].symbol.clone();
        Err(BacktestError::ModelPrice { order_id: outcome.id.0, symbol, time: outcome.at, price: filled.model_price })
    }

    /// Sends word of what became of an order.
    pub(super) fn pend(&mut self, outcome: Outcome, terms: &[f64]) {
        let at = self.clocks.response(outcome.at).max(self.timetable.known_from);
        let place = self.mail.put(outcome, terms);
        self.agenda.put(at, Phase::Notices, Due::Notice(place));
    }

    /// What became of an order is known: it is booked.
    pub(super) fn note(&mut self, place: usize) -> Result<Option<Notice>, BacktestError> {
        let Some(outcome) = self.mail.take(place) else { return Ok(None) };
        let Outcome { id, instrument, at, what } = outcome;
        let Some(k) = self.blotter.place(id) else { return Ok(None) };
        let news = match what {
            What::Filled(filled) => {
                self.charge_held(instrument, at)?;
                self.book(k, &outcome, &filled)?;
                self.concede(place, instrument, filled.quantity);
                let order = &self.blotter.orders[k];
                let left = order.quantity - order.filled;
                News::Filled { quantity: filled.quantity, price: filled.price, role: filled.role, left }
            }
            What::Ended(reason) => {
                let order = &mut self.blotter.orders[k];
                (order.status, order.reason) = (Status::ended(reason), Some(reason));
                self.known[instrument].closed(id);
                News::Ended(reason)
            }
            What::SetOff => News::SetOff,
            What::Replaced { quantity, kind } => {
                let order = &mut self.blotter.orders[k];
                (order.quantity, order.kind) = (quantity, kind);
                let left = quantity - order.filled;
                self.known[instrument].changed(id, left, kind);
                News::Replaced
            }
        };
        let side = self.blotter.orders[k].side;
        Ok(Some(Notice { order_id: id, instrument, side, at, news }))
    }

    /// Books what mechanisms added to the price of a fill, whose terms are at a place of the mail.
    pub(super) fn concede(&mut self, place: usize, instrument: usize, quantity: Quantity) {
        let terms = self.mail.terms(place);
        let (one, quantity) = (self.worth_of_one(instrument), quantity.to_f64());
        for (mechanism, term) in self.venue.conceding.iter().zip(terms) {
            *self.blotter.concessions.entry(mechanism).or_default() += term * quantity * one;
        }
        self.blotter.terms.extend_from_slice(terms);
    }

    /// Books a fill of order `k`.
    pub(super) fn book(&mut self, k: usize, outcome: &Outcome, filled: &Filled) -> Result<(), BacktestError> {
        let Outcome { id, instrument, at, .. } = *outcome;
        let rate = self.rate_of(self.ledger.positions()[instrument].currency);
        let order = &mut self.blotter.orders[k];
        let symbol = &self.setup.instruments[instrument].symbol;
        let money = |error| BacktestError::Money { place: format!("order {} for {symbol} at {at}", id.0), error };
        let (side, quantity, price) = (order.side, filled.quantity, filled.price);
        let fee = Cash::nearest(filled.fee).map_err(money)?;
        let closes = self.ledger.positions()[instrument].quantity.signed(side) < Quantity::ZERO;
        let realised = self.ledger.book(&Trade { instrument, side, price, quantity, fee }).map_err(money)?;
        order.filled = order.filled + quantity;
        if order.filled >= order.quantity {
            (order.status, order.reason) = (Status::Filled, None);
        }
        let position = &self.ledger.positions()[instrument];
        let units = quantity.to_f64() * position.multiplier.get() as f64;
        let loss = |from: f64, to: f64| side.sign() * (to - from) * units;
        let cost = FillCost {
            timing: loss(order.decision_price.to_f64(), filled.mid),
            spread_and_impact: loss(filled.mid, filled.model_price),
            rounding: loss(filled.model_price, price.to_f64()),
        };
        self.known[instrument].less(id, quantity);
        let why = Why {
            role: filled.role,
            data: self.data_of[instrument],
            row: filled.row,
            met: filled.mid,
            band: filled.band,
            displaced: filled.displaced,
            queued_behind: filled.queued_behind,
        };
        self.blotter.fills.push(Fill {
            fill_id: self.blotter.fills.len() as u64 + 1,
            order_id: id.0,
            instrument,
            filled_at: at,
            side,
            quantity,
            price,
            fee,
            decision_price: order.decision_price,
            rate,
            realised: closes.then_some(realised),
            cost,
            why,
        });
        Ok(())
    }
}
