//! Why an order was refused, or works no longer.

use std::fmt;

use serde::Serialize;

/// Why an order was refused before it was sent, or works no longer although some of it is left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// There is no instrument of that number.
    UnknownInstrument,
    /// The quantity is 0 or negative.
    NoQuantity,
    /// The quantity is no whole number of lots.
    OffLot,
    /// A price is not above 0, or not on a tick.
    OffTick,
    /// The instrument has had no price yet.
    NoPrice,
    /// It would take what is held beyond the run's largest leverage.
    Leverage,
    /// It requires more initial margin than the equity is above that of what is held.
    Margin,
    /// It is for the open or the close, and nothing tells what that was: neither bars nor a calendar, or no price was
    /// known at it.
    NoAuction,
    /// It could not wait, and came while the market was closed.
    MarketClosed,
    /// It came while trading was halted, and could not wait or was not to.
    Halted,
    /// Its time was over before it was sent.
    Late,
    /// It is linked with orders of another instrument, or with none.
    Unlinked,
    /// There is no order of that number that works.
    UnknownOrder,
    /// It would have taken, and must not.
    PostOnly,
    /// It could not be filled whole at once.
    FillOrKill,
    /// Its time was over.
    TimeInForce,
    /// There was nothing to close.
    ReduceOnly,
    /// There was no volume for the rest of it.
    NoVolume,
    /// An order it was linked with was filled, or will never be.
    Linked,
    /// Its owner asked.
    Asked,
    /// The account could not carry it any longer.
    Liquidated,
    /// After a split its price is on no tick, or its quantity no whole number of lots.
    Split,
    /// It is about an order of the broker's.
    NotOwn,
    /// It is larger than the largest order allowed.
    OrderLimit,
    /// It could take what is held beyond the largest position allowed.
    PositionLimit,
    /// There were as many orders within a minute as are allowed.
    OrderRate,
    /// Trading has stopped: too much was lost.
    LossLimit,
    /// The session was stopped.
    Stopped,
}

impl Reason {
    /// Its word in tables and summaries.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::UnknownInstrument => "unknown_instrument",
            Self::NoQuantity => "no_quantity",
            Self::OffLot => "off_lot",
            Self::OffTick => "off_tick",
            Self::NoPrice => "no_price",
            Self::Leverage => "leverage",
            Self::Margin => "margin",
            Self::NoAuction => "no_auction",
            Self::MarketClosed => "market_closed",
            Self::Halted => "halted",
            Self::Late => "late",
            Self::Unlinked => "unlinked",
            Self::UnknownOrder => "unknown_order",
            Self::PostOnly => "post_only",
            Self::FillOrKill => "fill_or_kill",
            Self::TimeInForce => "time_in_force",
            Self::ReduceOnly => "reduce_only",
            Self::NoVolume => "no_volume",
            Self::Linked => "linked",
            Self::Asked => "asked",
            Self::Liquidated => "liquidated",
            Self::Split => "split",
            Self::NotOwn => "not_own",
            Self::OrderLimit => "order_limit",
            Self::PositionLimit => "position_limit",
            Self::OrderRate => "order_rate",
            Self::LossLimit => "loss_limit",
            Self::Stopped => "stopped",
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::UnknownInstrument => "there is no such instrument",
            Self::NoQuantity => "the quantity is not above 0",
            Self::OffLot => "the quantity is no whole number of lots",
            Self::OffTick => "a price is not above 0 or not on a tick",
            Self::NoPrice => "the instrument has had no price yet",
            Self::Leverage => "it would exceed the run's largest leverage",
            Self::Margin => "it requires more initial margin than there is",
            Self::NoAuction => "it is for the open or the close, which its data do not tell",
            Self::MarketClosed => "it could not wait, and came while the market was closed",
            Self::Halted => "it came while trading was halted",
            Self::Late => "its time was over before it was sent",
            Self::Unlinked => "it is linked with no order of its instrument",
            Self::UnknownOrder => "no order of that number works",
            Self::PostOnly => "it would have taken, and is post-only",
            Self::FillOrKill => "it could not be filled whole at once",
            Self::TimeInForce => "its time was over",
            Self::ReduceOnly => "there was nothing to close",
            Self::NoVolume => "there was no volume for the rest of it",
            Self::Linked => "an order it was linked with was filled, or never will be",
            Self::Asked => "its owner asked",
            Self::Liquidated => "the account could not carry it any longer",
            Self::Split => "a split took it off ticks or lots",
            Self::NotOwn => "it is about an order of the broker's",
            Self::OrderLimit => "it is larger than the largest order allowed",
            Self::PositionLimit => "it could exceed the largest position allowed",
            Self::OrderRate => "there were as many orders within a minute as are allowed",
            Self::LossLimit => "trading has stopped: too much was lost",
            Self::Stopped => "the session was stopped",
        })
    }
}
