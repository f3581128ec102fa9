//! Market data as streams: a few rows at a time, in the order in which they could be known.

#[cfg(feature = "io")]
mod bar_rows;
#[cfg(feature = "io")]
mod between;
#[cfg(feature = "io")]
mod binance_depth;
#[cfg(feature = "io")]
mod bitstamp;
#[cfg(feature = "io")]
mod clocks;
#[cfg(feature = "io")]
mod databento;
#[cfg(feature = "io")]
mod decode;
#[cfg(feature = "io")]
mod depth_rows;
#[cfg(feature = "io")]
mod file_stream;
#[cfg(feature = "io")]
mod lean;
#[cfg(feature = "io")]
mod order_rows;
mod order_step;
#[cfg(feature = "io")]
mod print_rows;
#[cfg(feature = "io")]
mod quote_rows;
#[cfg(feature = "io")]
mod read_ahead;
#[cfg(feature = "io")]
mod sequence;
mod stored;
#[cfg(feature = "io")]
mod table_rows;

use crate::sim2real::Timestamp;

use super::{Bar, Book, DataNotes, DepthChange, HistoryError, OrderEvent, Print};

#[cfg(feature = "io")]
pub(super) use bar_rows::BarRows;
#[cfg(feature = "io")]
pub(super) use between::Between;
#[cfg(feature = "io")]
pub use file_stream::FileStream;
#[cfg(feature = "io")]
pub(super) use file_stream::{PIECE, bars_of};
pub use order_step::{Departure, NumberedPrint, OrderStep};
#[cfg(feature = "io")]
pub(super) use read_ahead::ReadAhead;
pub use stored::Stored;
#[cfg(feature = "io")]
pub(super) use table_rows::{TableRows, check_rows};

/// A source of rows of market data.
///
/// # Contract
/// - Rows come in the order in which they could be known: no row has an earlier [`Dated::known_at`] than one before it.
/// - No row is known before it happened.
/// - After an end or an error, nothing comes any more.
pub trait Stream<T: Dated>: Send {
    /// Appends the next rows to `into`, at least one unless at the end. False at the end, when nothing is appended.
    ///
    /// # Errors
    /// Data that cannot be read or cannot be.
    fn refill(&mut self, into: &mut Vec<T>) -> Result<bool, StreamError>;

    /// What was found in its rows so far, where it keeps count of that.
    fn notes(&self) -> Option<&DataNotes> {
        None
    }
}

/// What carries the two times of the market.
pub trait Dated {
    /// When it happened, by the exchange's clock.
    fn time(&self) -> Timestamp;

    /// When it could be known; never before it happened.
    fn known_at(&self) -> Timestamp;
}

/// A thing that has the time when it happened, and when it could be known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known<T> {
    /// When it could be known.
    pub known_at: Timestamp,
    /// The thing, with the time when it happened.
    pub what: T,
}

/// Why a stream gives no more.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StreamError {
    /// A file that cannot be read, or holds what cannot be: with file, row, column, value and remedy.
    #[cfg(feature = "io")]
    #[error(transparent)]
    Input(#[from] crate::io::InputError),
    /// Rows in memory that cannot be.
    #[error(transparent)]
    History(#[from] HistoryError),
}

impl Dated for Bar {
    fn time(&self) -> Timestamp {
        self.open_at
    }

    fn known_at(&self) -> Timestamp {
        self.known_at
    }
}

impl Dated for Known<Book> {
    fn time(&self) -> Timestamp {
        self.what.time
    }

    fn known_at(&self) -> Timestamp {
        self.known_at
    }
}

impl Dated for Known<Print> {
    fn time(&self) -> Timestamp {
        self.what.time
    }

    fn known_at(&self) -> Timestamp {
        self.known_at
    }
}

impl Dated for DepthChange {
    fn time(&self) -> Timestamp {
        self.time
    }

    fn known_at(&self) -> Timestamp {
        self.known_at
    }
}

impl Dated for OrderEvent {
    fn time(&self) -> Timestamp {
        self.time
    }

    fn known_at(&self) -> Timestamp {
        self.known_at
    }
}
