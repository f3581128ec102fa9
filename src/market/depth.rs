//! What happens in an order book: level by level (L2), or order by order (L3).

use crate::sim2real::Timestamp;

use super::{Price, Side};

/// What becomes of a level, or of a side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DepthAction {
    /// The level displays the size from now on; 0 takes it away.
    Set,
    /// The whole side is empty from now on: what a snapshot begins with. Price and size say nothing.
    Clear,
}

/// A change of what is displayed at one price: by-price data, L2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthChange {
    /// When it happened, by the exchange's clock.
    pub time: Timestamp,
    /// When it could be known; never before it happened.
    pub known_at: Timestamp,
    /// The side of the book: [`Side::Buy`] for bids, [`Side::Sell`] for asks.
    pub side: Side,
    /// What becomes of it.
    pub action: DepthAction,
    /// The price of the level.
    pub price: Price,
    /// What is displayed there from now on [units].
    pub size: f64,
}

/// What becomes of a resting order of others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrderAction {
    /// It joins the end of the queue at its price.
    Add,
    /// Its size changes; it keeps its place where it shrinks, and joins the end where it grows or its price changes.
    Change,
    /// It leaves, cancelled or filled.
    Delete,
}

/// What happens to one resting order of others: by-order data, L3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderEvent {
    /// When it happened, by the exchange's clock.
    pub time: Timestamp,
    /// When it could be known; never before it happened.
    pub known_at: Timestamp,
    /// The exchange's id of the order.
    pub id: u64,
    /// What becomes of it.
    pub action: OrderAction,
    /// The side it rests on: [`Side::Buy`] for bids.
    pub side: Side,
    /// Its limit.
    pub price: Price,
    /// What is left of it from now on [units].
    pub size: f64,
}
