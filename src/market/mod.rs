//! Markets: what is traded, the backtest that trades it, and `execution`, the plant every order meets.

mod book;
mod covariate;
mod execution;
mod instrument;
mod log_entry;
#[cfg(feature = "io")]
mod log_folder;
pub mod mechanism;
mod order;
mod order_log;
mod own_print;
mod price_assumption;
mod quote;
mod tape;
#[cfg(feature = "io")]
mod tape_file;
#[cfg(feature = "io")]
mod twin;

pub use book::{Book, Level, Walk};
pub use execution::{Execution, ExecutionEffect, Met, Report, cost_bps, fee_bps};
pub use instrument::Instrument;
pub use log_entry::{LogError, LogTable, LoggedFill, LoggedOrder, OrderType};
#[cfg(feature = "io")]
pub use log_folder::{LogSettings, read_log};
pub use mechanism::MECHANISMS;
pub use order::{InFlight, Posted, Side};
pub use order_log::{LogMarket, OrderLog};
pub use own_print::{Piece, own_print, shown_delay};
pub use price_assumption::PriceAssumption;
pub use quote::{Quote, QuoteSlice, Quotes};
pub use tape::{Print, Seen, Tape, TapeBar};
#[cfg(feature = "io")]
pub use tape_file::{TapeFiles, read_tape};
#[cfg(feature = "io")]
pub use twin::{execution_assembly, execution_logs, execution_twin};
