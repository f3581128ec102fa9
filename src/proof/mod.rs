//! The blind benchmark: cases whose labels are sealed, diagnosed, unsealed and scored.
//!
//! A [`Case`] of either [`Domain`] is drawn, its label [`Sealed`], what a user would bring of it diagnosed, and the baselines run
//! beside it, which makes a [`Trial`]; a [`Journal`] holds what was said beside what was true; a [`Summary`] is what all that
//! amounts to. What the domains do not share is in `joint` and `trading`.

mod case;
mod confusion;
mod domain;
mod figure;
mod goals;
mod joint;
mod journal;
mod markdown;
mod oracle;
mod page;
mod reliability;
mod score;
mod seal;
mod selection;
mod summary;
mod table;
mod trading;
mod trial;
mod truth;
mod wilson;

pub use case::Case;
pub use confusion::Confusion;
pub use domain::Domain;
pub use figure::{Figure, Goal, Standing, Unit};
pub use journal::{Header, JOURNAL, Journal, JournalError, Line};
pub use markdown::{figures_table, readme};
pub use oracle::OracleFit;
pub use reliability::{Bin, Reliability};
pub use score::Entry;
pub use seal::{Sealed, seal, seal_of_all};
pub use summary::{Failure, SUMMARY, Summary, TEST_SEEDS};
pub use trial::{Fitted, Found, HeldOut, Trial};
pub use truth::Truth;
pub use wilson::wilson;
