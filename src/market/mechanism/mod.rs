//! What may stand between an order's decision and its fill, and what a position costs: one file each, one row each in
//! [`MECHANISMS`].

mod adverse_selection;
mod book_walk;
mod borrow_fee;
mod charging;
mod commission;
mod funding;
mod half_spread;
mod linear_impact;
mod lot_size;
mod need;
mod participation_cap;
mod permanent_impact;
mod propagator;
mod queue_position;
#[cfg(test)]
mod retune_tests;
#[cfg(test)]
mod schedule;
mod sqrt_impact;
mod stale_quotes;
mod textbook_slippage;
mod transient_impact;
mod volatility_slippage;

pub use adverse_selection::AdverseSelection;
pub use book_walk::BookWalk;
pub use borrow_fee::BorrowFee;
pub use charging::{Charging, charge_kind};
pub use commission::Commission;
pub use funding::Funding;
pub use half_spread::HalfSpread;
pub use linear_impact::LinearImpact;
pub use lot_size::LotSize;
pub use need::{Demanding, Lack, Need, needs};
pub use participation_cap::ParticipationCap;
pub use permanent_impact::PermanentImpact;
pub use queue_position::QueuePosition;
pub use sqrt_impact::SqrtImpact;
pub use stale_quotes::StaleQuotes;
pub use textbook_slippage::TextbookSlippage;
pub use transient_impact::TransientImpact;
pub use volatility_slippage::VolatilitySlippage;

use crate::sim2real::{Registry, mechanism::CommandDelay};

use super::Execution;

/// The market's registry.
pub static MECHANISMS: Registry<Execution> = &[
    &CommandDelay { longest: 60.0, starts: &[0.001, 0.01, 0.05, 0.1, 0.25, 0.5, 1.0], holds: false },
    &ParticipationCap,
    &LotSize,
    &HalfSpread,
    &BookWalk,
    &SqrtImpact,
    &LinearImpact,
    &PermanentImpact,
    &TransientImpact,
    &VolatilitySlippage,
    &AdverseSelection,
    &QueuePosition,
    &TextbookSlippage,
    &StaleQuotes,
    &Commission,
    &BorrowFee,
    &Funding,
];

/// Those of the registry that charge for what is held.
pub static CHARGING: &[&dyn Charging] = &[&BorrowFee, &Funding];

/// Those of the registry that can do nothing without some data.
pub static DEMANDING: &[&dyn Demanding] = &[
    &ParticipationCap,
    &HalfSpread,
    &BookWalk,
    &SqrtImpact,
    &LinearImpact,
    &PermanentImpact,
    &TransientImpact,
    &VolatilitySlippage,
    &QueuePosition,
    &TextbookSlippage,
];
