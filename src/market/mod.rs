//! Markets: what is traded, the backtest that trades it, and `execution`, the plant every order meets.

mod book;
mod execution;
mod instrument;
pub mod mechanism;
mod order;
mod order_log;

pub use book::{Book, Level};
pub use execution::{Execution, ExecutionEffect, Met, Report};
pub use instrument::Instrument;
pub use mechanism::MECHANISMS;
pub use order::{InFlight, Posted, Side};
pub use order_log::OrderLog;
