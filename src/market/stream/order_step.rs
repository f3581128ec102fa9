//! Rows with what a file says beyond the event: how an order left, and the number of a trade.

use super::{Dated, Known};
use crate::market::{OrderEvent, Print};
use crate::sim2real::Timestamp;

/// How an order left the book.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Departure {
    /// What was left of it was executed.
    Filled,
    /// What was left of it was taken back.
    Withdrawn,
}

/// An event of an order with what the file says of its leaving.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderStep {
    /// The event.
    pub event: OrderEvent,
    /// How the order left; none where it stays, or the file does not say.
    pub departure: Option<Departure>,
}

impl From<OrderEvent> for OrderStep {
    fn from(event: OrderEvent) -> Self {
        Self { event, departure: None }
    }
}

impl From<OrderStep> for OrderEvent {
    fn from(step: OrderStep) -> Self {
        step.event
    }
}

impl Dated for OrderStep {
    fn time(&self) -> Timestamp {
        self.event.time
    }

    fn known_at(&self) -> Timestamp {
        self.event.known_at
    }
}

/// A trade with its number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberedPrint {
    /// The trade.
    pub print: Known<Print>,
    /// Its number, where trades have one.
    pub number: Option<i64>,
}

impl From<NumberedPrint> for Known<Print> {
    fn from(numbered: NumberedPrint) -> Self {
        numbered.print
    }
}

impl Dated for NumberedPrint {
    fn time(&self) -> Timestamp {
        self.print.what.time
    }

    fn known_at(&self) -> Timestamp {
        self.print.known_at
    }
}
