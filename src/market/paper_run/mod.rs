//! A paper run: a strategy against the paper venue, driven by a clock, with a journal that survives whatever stops it.
//!
//! The engine is the backtest's own [`Session`](super::Session) on streams. What it is given is in the journal first, and what it
//! does follows from what it was given alone; so a session that was killed is brought back by running the journal once more, and
//! what it does then is held to be what the journal says it did.

mod entry;
mod file_feed;
mod limits;
mod line_feed;
mod paper_log;
mod prepare;
mod stopping;
mod stored_row;
mod trading;

pub use entry::{FeedFrom, Stop, StopReason};
pub use limits::{Loss, OnLoss, PaperSettings};
pub use line_feed::{BadRows, LineSource, LinesSeen, NextLine};
pub use paper_log::Replayed;
pub use prepare::{JournalUse, Opened, PaperFeed, PreparedPaper};
pub use trading::{PaperSession, PaperStatus};
