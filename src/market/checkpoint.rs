//! Checkpoints and forks: a run that goes on from where it was, and one that goes on with another fill.
//!
//! A [`Checkpoint`] does not hold a run's state but its moment, and a digest of the state. A run depends on nothing but its
//! setup, data and seed, so going on from a checkpoint is running up to that moment once more, at the speed of the engine, and
//! holding the state to be the same to the last bit: a file that was written by another version of the program, or data that have
//! changed since, are found out and not gone on from. In memory a [fork](Session::fork) is at once.

use std::fmt::{self, Write};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::sim2real::Timestamp;

use super::{Event, OrderId, Price, Quantity, Session, Strategy};

/// A moment of a run, told so exactly that a run which comes to it again is known to be the same.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// Events the strategy had seen.
    pub events: usize,
    /// When the last of them was [ns since 1970, UTC]; none before the first.
    pub time: Option<i64>,
    /// SHA-256, in hexadecimal digits, of the state: account, orders, fills, refusals, equity, what is under way, what is known.
    pub state: String,
}

/// Up to where a run goes before it is saved or forked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// The strategy has seen so many events.
    Events(usize),
    /// It has seen all data before that time.
    Before(Timestamp),
    /// It has asked for that order.
    Sent(OrderId),
}

/// How an order is filled when it is filled next, instead of how it would be. What is left of it works on.
///
/// Its fee is that of the fill it replaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AnotherFill {
    /// How much; none for all that is left of the order, which more than is left comes to as well.
    pub quantity: Option<Quantity>,
    /// At which price.
    pub price: Price,
}

/// A fork that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ForkError {
    /// No such order was sent so far.
    #[error("there is no order {0} up to here\nhint: orders.parquet of the run lists them; fork after it was sent")]
    UnknownOrder(u64),
    /// A quantity or price the instrument does not have.
    #[error("{what} {value} cannot be a fill's\nhint: prices are above 0 and on a tick, quantities above 0 and whole lots")]
    Increment {
        /// "price" or "quantity".
        what: &'static str,
        /// What was found.
        value: f64,
    },
    /// A run that comes to another state than its checkpoint.
    #[error(
        "after {events} events the run is not what it was when it was saved\nhint: the data, the run or the program have changed since; run it from the start"
    )]
    Changed {
        /// Events up to the checkpoint.
        events: usize,
    },
    /// A run that ends before its checkpoint.
    #[error("the run ends after {found} events, before its checkpoint at {events}\nhint: the data have changed since")]
    Ended {
        /// Events up to the checkpoint.
        events: usize,
        /// Events there are.
        found: usize,
    },
}

/// Takes text and keeps its digest.
struct Digested(Sha256);

impl Write for Digested {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

impl Session {
    /// The moment it is at.
    #[must_use]
    pub fn checkpoint(&self) -> Checkpoint {
        let mut digested = Digested(Sha256::new());
        // Texts of floating-point numbers are exact: they are read back as the same bits.
        let under_way = (&self.sent, &self.agenda, &self.mail, &self.known);
        let told = write!(digested, "{:?}{:?}{:?}{:?}", self.ledger, self.blotter, self.equity, under_way);
        debug_assert!(told.is_ok(), "a digest takes any text");
        let state = digested.0.finalize().iter().fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        });
        Checkpoint { events: self.events(), time: self.equity.end().map(|time| time.0), state }
    }

    /// Whether it has come to `moment`.
    #[must_use]
    pub fn is_at(&self, moment: Moment) -> bool {
        match moment {
            Moment::Events(events) => self.events() >= events,
            Moment::Before(time) => self.next_time().is_none_or(|next| next >= time),
            Moment::Sent(id) => self.blotter.place(id).is_some(),
        }
    }

    /// Runs up to `moment`, and gives whether it came to it before its data ended.
    ///
    /// # Errors
    /// As [`Session::step`].
    pub fn run_to(&mut self, moment: Moment, strategy: &mut dyn Strategy) -> Result<bool, super::BacktestError> {
        while !self.is_at(moment) {
            let event: Option<Event> = self.step(strategy)?;
            if event.is_none() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Holds it to be at `checkpoint`, to the last bit.
    ///
    /// # Errors
    /// If it is not.
    pub fn check(&self, checkpoint: &Checkpoint) -> Result<(), ForkError> {
        let (events, found) = (checkpoint.events, self.events());
        if found < events {
            return Err(ForkError::Ended { events, found });
        }
        if self.checkpoint() == *checkpoint { Ok(()) } else { Err(ForkError::Changed { events }) }
    }

    /// From here on, order `id` is filled otherwise when it is filled next.
    ///
    /// # Errors
    /// If no such order was sent, or the instrument has no such price or quantity.
    pub fn fill_instead(&mut self, id: OrderId, instead: AnotherFill) -> Result<(), ForkError> {
        let unknown = ForkError::UnknownOrder(id.0);
        let order = self.blotter.order(id.0).ok_or(unknown)?;
        let increments = self.setup.increments[order.instrument];
        if instead.price.0 <= 0 || !increments.on_tick(instead.price) {
            return Err(ForkError::Increment { what: "price", value: instead.price.to_f64() });
        }
        if let Some(quantity) = instead.quantity.filter(|q| *q <= Quantity::ZERO || !increments.holds(*q)) {
            return Err(ForkError::Increment { what: "quantity", value: quantity.to_f64() });
        }
        let instrument = order.instrument;
        self.venue.floors[instrument].fill_instead(id, instead);
        Ok(())
    }
}
