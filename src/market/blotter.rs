//! What became of each order: the record a run leaves, in the form of an execution log.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use crate::sim2real::Timestamp;

use super::{Cash, Price, Quantity, Side};

/// Why an order was refused before it was sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// There is no instrument of that number.
    UnknownInstrument,
    /// The quantity is 0 or negative.
    NoQuantity,
    /// The quantity is no whole number of lots.
    OffLot,
    /// The instrument has had no price yet.
    NoPrice,
    /// It would take what is held beyond the run's largest leverage.
    Leverage,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::UnknownInstrument => "there is no such instrument",
            Self::NoQuantity => "the quantity is not above 0",
            Self::OffLot => "the quantity is no whole number of lots",
            Self::NoPrice => "the instrument has had no price yet",
            Self::Leverage => "it would exceed the run's largest leverage",
        })
    }
}

/// An order that was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rejection {
    /// When it was decided.
    pub decided_at: Timestamp,
    /// Number of the instrument asked for.
    pub instrument: usize,
    /// Which way.
    pub side: Side,
    /// How much.
    pub quantity: Quantity,
    /// Why.
    pub reason: Reason,
}

/// How far an order came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// On its way when the data ended: it met no market.
    Unfilled,
    /// Filled whole.
    Filled,
    /// Filled in part or not at all; the rest was cancelled.
    Cancelled,
}

impl Status {
    /// Its word in tables.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Unfilled => "unfilled",
            Self::Filled => "filled",
            Self::Cancelled => "cancelled",
        }
    }
}

/// An order that was sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Order {
    /// Its id, from 1 in the order of decisions.
    pub order_id: u64,
    /// Number of the instrument.
    pub instrument: usize,
    /// When it was decided; it is sent at once.
    pub decided_at: Timestamp,
    /// Which way.
    pub side: Side,
    /// How much.
    pub quantity: Quantity,
    /// Close or mid when it was decided.
    pub decision_price: Price,
    /// Best bid when it was decided [currency], where quotes are known.
    pub seen_bid: Option<f64>,
    /// Best ask when it was decided [currency], where quotes are known.
    pub seen_ask: Option<f64>,
    /// How far it came.
    pub status: Status,
    /// How much was filled.
    pub filled: Quantity,
}

/// A fill. All of them take liquidity: there are market orders only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fill {
    /// Its id, from 1 in the order of fills.
    pub fill_id: u64,
    /// The order it belongs to.
    pub order_id: u64,
    /// Number of the instrument.
    pub instrument: usize,
    /// When.
    pub filled_at: Timestamp,
    /// Which way.
    pub side: Side,
    /// How much.
    pub quantity: Quantity,
    /// At which price.
    pub price: Price,
    /// Fee.
    pub fee: Cash,
    /// What it realised on a position it closed, before its fee; none where it closed nothing.
    pub realised: Option<Cash>,
    /// What it cost against the price at decision.
    pub cost: FillCost,
}

/// What a fill cost against the price at decision, a positive number being a loss [currency]; the parts and the fee add
/// up to its implementation shortfall.
///
/// Source: Perold, "The implementation shortfall: paper versus reality", Journal of Portfolio Management 14 (1988).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct FillCost {
    /// The market moved between decision and arrival: from the last close or mid to the open or mid that was met.
    pub timing: f64,
    /// What mechanisms, and the spread of a fill at the touch, added to the price that was met.
    pub spread_and_impact: f64,
    /// The price was moved to a tick.
    pub rounding: f64,
}

/// All that was recorded of orders.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Blotter {
    /// Orders sent, in the order of decisions; order id `k` is at `k - 1`.
    pub orders: Vec<Order>,
    /// Fills, in the order of time.
    pub fills: Vec<Fill>,
    /// What each mechanism added to the prices of all fills, by its id: a loss is positive [currency].
    pub concessions: BTreeMap<&'static str, f64>,
    /// The first orders that were refused, at most [`Blotter::REJECTIONS_KEPT`].
    pub rejections: Vec<Rejection>,
    /// Number of all orders refused, by reason.
    pub rejected: BTreeMap<Reason, usize>,
}

impl Blotter {
    /// How many refused orders are kept with all they asked for; a strategy may ask in vain at every bar.
    pub const REJECTIONS_KEPT: usize = 1_000;

    pub(super) fn reject(&mut self, rejection: Rejection) {
        *self.rejected.entry(rejection.reason).or_default() += 1;
        if self.rejections.len() < Self::REJECTIONS_KEPT {
            self.rejections.push(rejection);
        }
    }

    /// The order of that id, found in the order of ids, or wherever else it stands.
    #[must_use]
    pub fn order(&self, order_id: u64) -> Option<&Order> {
        match self.orders.binary_search_by_key(&order_id, |order| order.order_id) {
            Ok(at) => self.orders.get(at),
            Err(_) => self.orders.iter().find(|order| order.order_id == order_id),
        }
    }

    /// Number of orders sent that came as far as `status`.
    #[must_use]
    pub fn count(&self, status: Status) -> usize {
        self.orders.iter().filter(|order| order.status == status).count()
    }
}
