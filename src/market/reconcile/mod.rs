//! Paper against backtest: which order is which, where the two part, and what made the gap of profit and loss.
//!
//! Orders of both logs are paired up without shared ids ([`Alignment`]), beside a difference of clocks. What a pair made
//! differs by its decision (signal, data, sizing) or by its execution (queue and fill, latency, spread, impact, fees). The two are
//! told apart by what the backtest's own simulator makes of the paper log's orders ([`replay`]): backtest to replay is decision,
//! replay to paper execution. Everything is in exact amounts, so that causes sum to the gap to the last unit ([`Cause`]).

mod align;
mod bands;
mod causes;
mod clock;
mod difference;
mod divergence;
mod gap;
mod life;
mod listings;
mod page;
mod reconciliation;
mod replay;
mod showing;
mod tolerance;
mod words;

pub use align::Alignment;
pub use bands::{Bands, Outside};
pub use causes::{Cause, Split};
pub use clock::{ClockDifference, clock_difference};
pub use difference::OrderDifference;
pub use divergence::Divergence;
pub use gap::{CauseAmount, CurrencyGap};
pub use life::{Life, Lives, Piece, lives};
pub use listings::{TitledListing, listings};
pub use page::reconcile_page;
pub use reconciliation::{Compared, ReconcileCounts, Reconciliation, reconcile};
pub use replay::{Replay, ReplayError, ReplayNote, differs, replay};
pub use showing::{Histories, Showing};
pub use tolerance::{Checked, Tolerance, assert_reconciles};
pub use words::name as cause_name;
