//! Logs of paper and live trading: what brokers and bots write down of their orders, read exactly and with all that was odd.

mod clock;
mod finding;
#[cfg(feature = "io")]
pub mod import;
mod log;
mod order_words;
#[cfg(feature = "io")]
mod tables;

pub use clock::{PaperClock, TimeColumn, TimeMeaning, resolution};
pub use finding::{FindingKind, FindingSummary, PaperFinding, PaperFindings, SourcePlace};
pub use log::{Charge, FillOrigin, Liquidity, PaperFill, PaperLog, PaperOrder};
pub use order_words::{OrderWords, PaperStatus};
#[cfg(feature = "io")]
pub use tables::PaperSummary;
