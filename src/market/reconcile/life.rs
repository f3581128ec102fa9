//! An order with all that became of it: what two logs are compared by.

use std::collections::HashMap;

use crate::market::paper::{OrderWords, PaperFill, PaperLog, PaperOrder, PaperStatus};
use crate::market::{Cash, MoneyError, Multiplier, Price, Quantity, Side};
use crate::sim2real::Timestamp;

/// One execution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    /// When.
    pub at: Timestamp,
    /// How much [units].
    pub quantity: Quantity,
    /// At which price.
    pub price: Price,
}

/// An order with all that became of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Life {
    /// Its id in its log.
    pub id: String,
    /// What it trades.
    pub symbol: String,
    /// Currency of its prices, where the log says.
    pub currency: Option<String>,
    /// Which way.
    pub side: Side,
    /// The first time that is known of it.
    pub at: Timestamp,
    /// How much was ordered [units], where that is known.
    pub ordered: Option<Quantity>,
    /// What kind it was.
    pub kind: Option<OrderWords>,
    /// Its limit.
    pub limit: Option<Price>,
    /// The price that sets it off.
    pub stop: Option<Price>,
    /// For how long it works, in the log's word.
    pub time_in_force: Option<String>,
    /// When it was taken back, or its time was over.
    pub withdrawn_at: Option<Timestamp>,
    /// Units of the underlying in one unit traded: prices are of one of these.
    pub multiplier: Multiplier,
    /// What was filled [units].
    pub filled: Quantity,
    /// What that came to at its prices, for a multiplier of 1 [currency].
    pub notional: Cash,
    /// Fees [currency].
    pub fees: Cash,
    /// Its executions, in the order of their times.
    pub pieces: Vec<Piece>,
}

impl Life {
    /// What the order is worth where its instrument is at `mark`: what it brought or took, less fees, and what it holds.
    ///
    /// # Errors
    /// If 128 bits do not hold it.
    pub fn worth(&self, mark: Price) -> Result<Cash, MoneyError> {
        let gain = (mark * self.filled).minus(self.notional)?;
        let gain = gain.0.checked_mul(self.multiplier.get().into()).map(Cash).ok_or(MoneyError::Overflow)?;
        let gain = if self.side == Side::Buy { gain } else { Cash::ZERO.minus(gain)? };
        gain.minus(self.fees)
    }

    /// Average price of its executions [currency]; none where there is none.
    #[must_use]
    pub fn average(&self) -> Option<f64> {
        (self.filled > Quantity::ZERO).then(|| self.notional.to_f64() / self.filled.to_f64())
    }

    /// Units of the underlying that were filled.
    #[must_use]
    pub fn underlying(&self) -> f64 {
        self.filled.to_f64() * self.multiplier.get() as f64
    }

    /// What changed hands [currency].
    #[must_use]
    pub fn turnover(&self) -> f64 {
        self.notional.to_f64().abs() * self.multiplier.get() as f64
    }

    /// The first execution.
    #[must_use]
    pub fn first(&self) -> Option<Timestamp> {
        self.pieces.first().map(|piece| piece.at)
    }

    /// Whether it waits at a price of its own.
    #[must_use]
    pub fn rests(&self) -> bool {
        matches!(self.kind, Some(OrderWords::Limit | OrderWords::PostOnly | OrderWords::StopLimit))
    }

    fn of(order: &PaperOrder, at: Timestamp) -> Self {
        let withdrawn = matches!(order.status, Some(PaperStatus::Cancelled | PaperStatus::Expired | PaperStatus::Replaced));
        Self {
            id: order.id.clone(),
            symbol: order.symbol.clone(),
            currency: None,
            side: order.side,
            at,
            ordered: order.quantity,
            kind: order.kind.clone(),
            limit: order.limit_price,
            stop: order.stop_price,
            time_in_force: order.time_in_force.clone(),
            withdrawn_at: order.ended_at.filter(|_| withdrawn),
            multiplier: Multiplier::default(),
            filled: Quantity::ZERO,
            notional: Cash::ZERO,
            fees: Cash::ZERO,
            pieces: Vec::new(),
        }
    }

    /// The same order with its times on another clock.
    #[must_use]
    pub fn with_times(mut self, on: impl Fn(Timestamp) -> Timestamp) -> Self {
        self.at = on(self.at);
        self.withdrawn_at = self.withdrawn_at.map(&on);
        self.pieces.iter_mut().for_each(|piece| piece.at = on(piece.at));
        self
    }

    fn add(&mut self, fill: &PaperFill) -> Result<(), MoneyError> {
        self.filled = self.filled + fill.quantity;
        self.notional = self.notional.plus(fill.price * fill.quantity)?;
        self.fees = self.fees.plus(fill.fee.unwrap_or_default())?;
        self.currency = self.currency.take().or_else(|| fill.currency.clone());
        // Most have but one.
        if self.pieces.is_empty() {
            self.pieces.reserve_exact(1);
        }
        self.pieces.push(Piece { at: fill.filled_at, quantity: fill.quantity, price: fill.price });
        Ok(())
    }
}

/// The orders of a log, and what could not be taken in.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Lives {
    /// In the order of their times.
    pub orders: Vec<Life>,
    /// What was left out or made up, in words with counts.
    pub notes: Vec<String>,
}

/// The orders of `log` with all that became of them.
///
/// A fill without an order is an order of its own, of that quantity, decided when it was filled. What has no time, and fills of
/// which nobody knows the side, are left out and counted.
///
/// # Errors
/// If 128 bits do not hold a sum.
pub fn lives(log: &PaperLog) -> Result<Lives, MoneyError> {
    let (mut orders, mut of_id, mut timeless) = (Vec::with_capacity(log.orders.len()), HashMap::new(), 0_usize);
    let first_fill: HashMap<&str, Timestamp> =
        log.fills.iter().rev().filter_map(|f| Some((f.order_id.as_deref()?, f.filled_at))).collect();
    for order in &log.orders {
        match order.first_time().or_else(|| first_fill.get(order.id.as_str()).copied()) {
            Some(at) => {
                of_id.insert(order.id.as_str(), orders.len());
                orders.push(Life::of(order, at));
            }
            None => timeless += 1,
        }
    }
    let (mut sideless, mut alone, mut feeless) = (0_usize, 0_usize, 0_usize);
    for (k, fill) in log.fills.iter().enumerate() {
        feeless += usize::from(fill.fee.is_none());
        let own = fill.order_id.as_deref().and_then(|id| of_id.get(id)).copied();
        let place = match (own, fill.side) {
            (Some(place), _) => place,
            (None, Some(side)) => {
                alone += 1;
                let id = fill.order_id.clone().unwrap_or_else(|| format!("fill {}", k + 1));
                orders.push(alone_of(fill, id, side));
                if let Some(id) = fill.order_id.as_deref() {
                    of_id.insert(id, orders.len() - 1);
                }
                orders.len() - 1
            }
            (None, None) => {
                sideless += 1;
                continue;
            }
        };
        orders[place].add(fill)?;
    }
    for order in &mut orders {
        order.pieces.sort_by_key(|piece| piece.at);
        // What was filled was ordered, where nobody says how much was.
        order.ordered = order.ordered.or(Some(order.filled).filter(|filled| *filled > Quantity::ZERO));
    }
    orders.sort_by(|a, b| (a.at, &a.symbol, a.ordered, &a.id).cmp(&(b.at, &b.symbol, b.ordered, &b.id)));
    let mut notes = Vec::new();
    let mut note = |count: usize, words: &str| {
        if count > 0 {
            notes.push(format!("{count} {words}"));
        }
    };
    note(timeless, "orders without any time are left out");
    note(alone, "fills whose order is not in the log count as orders of their own");
    note(sideless, "fills of which neither side nor order is known are left out");
    note(feeless, "fills have no fee in the currency of their price, and count as free");
    notes.extend(log.findings.summaries().into_iter().filter(|found| found.kind.bears_on_comparison()).map(|found| {
        let first = found.findings.first().map_or_else(String::new, |first| format!("; the first: {first}"));
        format!("{} ({}{first})", found.says, found.count)
    }));
    Ok(Lives { orders, notes })
}

fn alone_of(fill: &PaperFill, id: String, side: Side) -> Life {
    Life {
        id,
        symbol: fill.symbol.clone(),
        currency: fill.currency.clone(),
        side,
        at: fill.filled_at,
        ordered: None,
        kind: None,
        limit: None,
        stop: None,
        time_in_force: None,
        withdrawn_at: None,
        multiplier: Multiplier::default(),
        filled: Quantity::ZERO,
        notional: Cash::ZERO,
        fees: Cash::ZERO,
        pieces: Vec::new(),
    }
}
