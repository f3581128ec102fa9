//! The blind benchmark: cases whose labels are sealed, diagnosed, unsealed and scored.
//!
//! [`twin`] and [`recordings`] make of a concealed [`Case`](crate::conceal::benchmark::Case) what a user would bring to a
//! diagnosis; [`tried`] diagnoses it, and runs the baselines beside it; a [`Journal`] holds what was said beside what was
//! true, [`Sealed`] before; a [`Summary`] is what all that amounts to.

mod case;
mod confusion;
mod figure;
mod journal;
mod markdown;
mod oracle;
mod page;
mod regression;
mod reliability;
mod score;
mod seal;
mod summary;
mod table;
mod terms;
mod trial;
mod wilson;

pub use case::{recordings, twin};
pub use confusion::Confusion;
pub use figure::{Figure, Goal, Standing, Unit};
pub use journal::{Header, JOURNAL, Journal, JournalError, Line};
pub use markdown::{figures_table, readme};
pub use oracle::OracleFit;
pub use reliability::{Bin, Reliability};
pub use score::Entry;
pub use seal::{Sealed, seal, seal_of_all};
pub use summary::{Failure, SUMMARY, Summary, TEST_SEEDS};
pub use trial::{Fitted, Found, HeldOut, Trial, tried};
pub use wilson::wilson;
