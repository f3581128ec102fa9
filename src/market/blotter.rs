//! What became of each order: the record a run leaves, in the form of an execution log.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::sim2real::Timestamp;

use super::{Cash, EventKind, OrderId, OrderKind, Price, Quantity, Reason, Role, Side, TimeInForce};

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
    /// Under way when the data ended, filled in part or not at all.
    Unfilled,
    /// Filled whole.
    Filled,
    /// Filled in part or not at all; the rest was cancelled.
    Cancelled,
    /// Refused by the venue.
    Rejected,
    /// Filled in part or not at all when its time was over.
    Expired,
}

impl Status {
    /// How far an order came that ended for `reason`.
    #[must_use]
    pub fn ended(reason: Reason) -> Self {
        match reason {
            Reason::PostOnly | Reason::FillOrKill | Reason::MarketClosed | Reason::Halted => Self::Rejected,
            Reason::TimeInForce => Self::Expired,
            _ => Self::Cancelled,
        }
    }

    /// Its word in tables.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Unfilled => "unfilled",
            Self::Filled => "filled",
            Self::Cancelled => "cancelled",
            Self::Rejected => "rejected",
            Self::Expired => "expired",
        }
    }
}

/// Who sent an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sender {
    /// The strategy.
    #[default]
    Strategy,
    /// The broker, to close what the account cannot carry.
    Broker,
}

impl Sender {
    /// Its word in tables.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Strategy => "strategy",
            Self::Broker => "broker",
        }
    }
}

/// An order that was sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Order {
    /// Its id, from 1 in the order of decisions; those of orders that were refused are missing.
    pub order_id: u64,
    /// Who sent it.
    pub sender: Sender,
    /// Number of the instrument.
    pub instrument: usize,
    /// When it was decided; it is sent at once.
    pub decided_at: Timestamp,
    /// When it arrives at the venue.
    pub arrives_at: Timestamp,
    /// When it trades, and at which prices: as it was last changed.
    pub kind: OrderKind,
    /// For how long it works.
    pub time_in_force: TimeInForce,
    /// Which way.
    pub side: Side,
    /// How much; after a split in new units, as is what was filled and the price at decision.
    pub quantity: Quantity,
    /// Close or mid when it was decided.
    pub decision_price: Price,
    /// Best bid when it was decided [currency], where quotes are known.
    pub seen_bid: Option<f64>,
    /// Best ask when it was decided [currency], where quotes are known.
    pub seen_ask: Option<f64>,
    /// How far it came.
    pub status: Status,
    /// Why it works no longer, where some of it is left.
    pub reason: Option<Reason>,
    /// How much was filled.
    pub filled: Quantity,
}

/// A fill.
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
    /// The price at decision, as it was when it was filled.
    pub decision_price: Price,
    /// Base currency for one unit of the instrument's, as far as it was known; 1 where they are the same.
    pub rate: f64,
    /// What it realised on a position it closed, before its fee; none where it closed nothing.
    pub realised: Option<Cash>,
    /// What it cost against the price at decision.
    pub cost: FillCost,
    /// Why it was filled then and at that price.
    pub why: Why,
}

/// Why an order was filled when it was, and at the price it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Why {
    /// As what it met the market.
    pub role: Role,
    /// What kind of data brought it about.
    pub data: EventKind,
    /// Which row of these data of its instrument, from 0.
    pub row: usize,
    /// Open or mid it met [currency].
    pub met: f64,
    /// Lowest and highest price the data show for that time, moved by `displaced`: where it might have been filled at best and at
    /// worst.
    pub band: [Price; 2],
    /// By how much own orders had moved the market up in which it waited; 0 without a law that says so.
    pub displaced: Price,
    /// What stood ahead of it when it joined the queue [units]; 0 where it took.
    pub queued_behind: f64,
}

/// What a fill cost against the price at decision, a positive number being a loss [currency of the instrument]; the parts and the fee add
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
    /// Orders sent, in the order of decisions: their ids increase.
    pub orders: Vec<Order>,
    /// Fills, in the order in which they became known.
    pub fills: Vec<Fill>,
    /// Ids of the mechanisms that act on prices, in their order.
    pub conceding: Vec<&'static str>,
    /// What each of these added to the price of each fill [currency]: fill by fill.
    pub terms: Vec<f64>,
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

    /// The order of that id.
    #[must_use]
    pub fn order(&self, id: u64) -> Option<&Order> {
        self.orders.get(self.place(OrderId(id))?)
    }

    /// Where the order of that id is.
    pub(super) fn place(&self, id: OrderId) -> Option<usize> {
        // Most often no order before it was refused.
        let guess = (id.0 as usize).wrapping_sub(1);
        if self.orders.get(guess).is_some_and(|order| order.order_id == id.0) {
            return Some(guess);
        }
        self.orders.binary_search_by_key(&id.0, |order| order.order_id).ok()
    }

    /// What each mechanism added to the price of fill `k`, against the order positive [currency], by its id.
    pub fn terms_of(&self, k: usize) -> impl Iterator<Item = (&'static str, f64)> {
        let count = self.conceding.len();
        self.conceding.iter().copied().zip(self.terms.iter().skip(k * count).copied())
    }

    /// Number of orders sent that came as far as `status`.
    #[must_use]
    pub fn count(&self, status: Status) -> usize {
        self.orders.iter().filter(|order| order.status == status).count()
    }
}
