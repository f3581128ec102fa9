//! What a strategy asks for: an order, with all that says how it is to be worked.

use crate::sim2real::Timestamp;

use super::account::Ratio;
use super::{Increments, Price, Quantity, Reason, Side};

/// The number of an order within its run, from 1 in the order in which they were asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct OrderId(pub u64);

/// When an order trades, and at which prices.
///
/// Source: the order types of FIX 5.0 (tag 40, `OrdType`) and of the exchanges' rule books; Harris, *Trading and Exchanges*
/// (2003), chapter 4.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrderKind {
    /// Takes what there is, at once.
    Market,
    /// Trades at `price` or better.
    Limit {
        /// The worst price it trades at.
        price: Price,
    },
    /// Becomes a market order when the market reaches `trigger`.
    Stop {
        /// Price that sets it off: from below for a buy, from above for a sell.
        trigger: Price,
    },
    /// Becomes a limit order when the market reaches `trigger`.
    StopLimit {
        /// Price that sets it off.
        trigger: Price,
        /// The worst price it trades at then.
        price: Price,
    },
    /// A stop that follows the market at a distance while it moves away, and stays while it comes back.
    TrailingStop {
        /// Distance of the trigger from the best price since it arrived.
        distance: Price,
    },
    /// Takes part in the next opening: the first bar of a session, or with quotes and a calendar the first price after it
    /// opens.
    MarketOnOpen,
    /// Takes part in the next opening, at `price` or better.
    LimitOnOpen {
        /// The worst price it trades at.
        price: Price,
    },
    /// Takes part in the close of the session: the last bar of it, or with quotes and a calendar the last price known then.
    MarketOnClose,
    /// Takes part in the close of the session, at `price` or better.
    LimitOnClose {
        /// The worst price it trades at.
        price: Price,
    },
}

impl OrderKind {
    /// Its word in logs.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Market => "market",
            Self::Limit { .. } => "limit",
            Self::Stop { .. } => "stop",
            Self::StopLimit { .. } => "stop_limit",
            Self::TrailingStop { .. } => "trailing_stop",
            Self::MarketOnOpen => "market_on_open",
            Self::LimitOnOpen { .. } => "limit_on_open",
            Self::MarketOnClose => "market_on_close",
            Self::LimitOnClose { .. } => "limit_on_close",
        }
    }

    /// Whether it takes part in an opening or a close, and in nothing else.
    #[must_use]
    pub fn is_for_auction(self) -> bool {
        matches!(self, Self::MarketOnOpen | Self::LimitOnOpen { .. } | Self::MarketOnClose | Self::LimitOnClose { .. })
    }

    /// The worst price it may trade at, where it has one.
    #[inline]
    #[must_use]
    pub fn limit(self) -> Option<Price> {
        match self {
            Self::Limit { price }
            | Self::StopLimit { price, .. }
            | Self::LimitOnOpen { price }
            | Self::LimitOnClose { price } => Some(price),
            _ => None,
        }
    }

    /// The price that sets it off, where it has a fixed one.
    #[must_use]
    pub fn trigger(self) -> Option<Price> {
        match self {
            Self::Stop { trigger } | Self::StopLimit { trigger, .. } => Some(trigger),
            _ => None,
        }
    }

    /// Every price it names.
    pub(super) fn prices(self) -> impl Iterator<Item = Price> {
        let distance = match self {
            Self::TrailingStop { distance } => Some(distance),
            _ => None,
        };
        [self.limit(), self.trigger(), distance].into_iter().flatten()
    }

    /// The same with every price as it is after a split, where all are on a tick then.
    pub(super) fn split(self, ratio: Ratio, increments: Increments) -> Option<Self> {
        let of = |price| ratio.price_on_tick(price, increments);
        Some(match self {
            Self::Limit { price } => Self::Limit { price: of(price)? },
            Self::Stop { trigger } => Self::Stop { trigger: of(trigger)? },
            Self::StopLimit { trigger, price } => Self::StopLimit { trigger: of(trigger)?, price: of(price)? },
            Self::TrailingStop { distance } => Self::TrailingStop { distance: of(distance)? },
            Self::LimitOnOpen { price } => Self::LimitOnOpen { price: of(price)? },
            Self::LimitOnClose { price } => Self::LimitOnClose { price: of(price)? },
            Self::Market | Self::MarketOnOpen | Self::MarketOnClose => self,
        })
    }

    /// The same with the limit moved to `price`; unchanged where it has none.
    #[must_use]
    pub fn at(self, price: Price) -> Self {
        match self {
            Self::Limit { .. } => Self::Limit { price },
            Self::StopLimit { trigger, .. } => Self::StopLimit { trigger, price },
            Self::LimitOnOpen { .. } => Self::LimitOnOpen { price },
            Self::LimitOnClose { .. } => Self::LimitOnClose { price },
            Self::Stop { .. } => Self::Stop { trigger: price },
            other => other,
        }
    }
}

/// For how long an order works. FIX tag 59, `TimeInForce`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TimeInForce {
    /// Until it is filled or cancelled.
    #[default]
    GoodTillCancelled,
    /// To the close of the day of trading, the next where the market is closed; without a calendar to the end of the day of
    /// UTC.
    Day,
    /// To an instant, from which on it works no longer.
    GoodTillDate(Timestamp),
    /// What cannot be filled when it arrives is cancelled.
    ImmediateOrCancel,
    /// Filled whole when it arrives, or not at all.
    FillOrKill,
}

impl TimeInForce {
    /// Its word in logs.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::GoodTillCancelled => "gtc",
            Self::Day => "day",
            Self::GoodTillDate(_) => "gtd",
            Self::ImmediateOrCancel => "ioc",
            Self::FillOrKill => "fok",
        }
    }
}

/// Conditions an order may carry. FIX tag 18, `ExecInst`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Condition {
    /// None.
    #[default]
    None,
    /// Refused where it would take: it adds liquidity or nothing.
    PostOnly,
    /// Never more than closes what is held when it trades.
    ReduceOnly,
}

/// What an order has to do with others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Link {
    /// Nothing.
    #[default]
    Alone,
    /// One cancels the other: what one of the group fills, the others no longer do.
    OneCancelsOther {
        /// Number of the group: the id of its first order.
        group: OrderId,
    },
    /// It waits for `parent`: it works for as much as that has filled, and is in a group with its siblings.
    ChildOf {
        /// The order it waits for, which is also the number of the group.
        parent: OrderId,
    },
}

/// An order a strategy asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ticket {
    /// Number of the instrument.
    pub instrument: usize,
    /// Which way.
    pub side: Side,
    /// How much.
    pub quantity: Quantity,
    /// When it trades, and at which prices.
    pub kind: OrderKind,
    /// For how long.
    pub time_in_force: TimeInForce,
    /// On which condition.
    pub condition: Condition,
    /// With which others.
    pub link: Link,
}

impl Ticket {
    /// An order that works until it is filled or cancelled, without conditions.
    #[must_use]
    pub fn new(instrument: usize, side: Side, quantity: Quantity, kind: OrderKind) -> Self {
        let (time_in_force, condition, link) = Default::default();
        Self { instrument, side, quantity, kind, time_in_force, condition, link }
    }

    /// A market order.
    #[must_use]
    pub fn market(instrument: usize, side: Side, quantity: Quantity) -> Self {
        Self::new(instrument, side, quantity, OrderKind::Market)
    }

    /// A limit order.
    #[must_use]
    pub fn limit(instrument: usize, side: Side, quantity: Quantity, price: Price) -> Self {
        Self::new(instrument, side, quantity, OrderKind::Limit { price })
    }

    /// A stop order.
    #[must_use]
    pub fn stop(instrument: usize, side: Side, quantity: Quantity, trigger: Price) -> Self {
        Self::new(instrument, side, quantity, OrderKind::Stop { trigger })
    }

    /// The same, working for as long as `time_in_force` says.
    #[must_use]
    pub fn working(mut self, time_in_force: TimeInForce) -> Self {
        self.time_in_force = time_in_force;
        self
    }

    /// The same, on a condition.
    #[must_use]
    pub fn on(mut self, condition: Condition) -> Self {
        self.condition = condition;
        self
    }

    /// The same, with others.
    #[must_use]
    pub fn linked(mut self, link: Link) -> Self {
        self.link = link;
        self
    }
}

/// The three orders of a bracket: an entry, and the two exits that wait for it, of which one cancels the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bracket {
    /// The entry.
    pub entry: OrderId,
    /// The exit with a gain: a limit order.
    pub take_profit: OrderId,
    /// The exit with a loss: a stop order.
    pub stop_loss: OrderId,
}

/// What a strategy asks for at one event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// A new order.
    Submit(OrderId, Ticket),
    /// To take an order back.
    Cancel(OrderId),
    /// To change an order: it loses its place in the queue unless only its quantity shrinks.
    Replace {
        /// The order.
        id: OrderId,
        /// Quantity in all, what was filled included; none for the same.
        quantity: Option<Quantity>,
        /// New limit, or trigger of a stop; none for the same.
        price: Option<Price>,
    },
    /// To be woken at an instant.
    Wake(Timestamp),
    /// Nothing: what was asked for is beyond a limit, and is refused.
    Refused {
        /// Number of the instrument.
        instrument: usize,
        /// Which way.
        side: Side,
        /// How much.
        quantity: Quantity,
        /// Which limit.
        reason: Reason,
    },
}
