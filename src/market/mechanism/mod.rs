//! What may stand between an order's decision and its fill: one file each, one row each in [`MECHANISMS`].

mod book_walk;
mod commission;
mod half_spread;
mod linear_impact;
mod participation_cap;
mod sqrt_impact;

pub use book_walk::BookWalk;
pub use commission::Commission;
pub use half_spread::HalfSpread;
pub use linear_impact::LinearImpact;
pub use participation_cap::ParticipationCap;
pub use sqrt_impact::SqrtImpact;

use crate::sim2real::{Registry, mechanism::CommandDelay};

use super::Execution;

/// The market's registry.
pub static MECHANISMS: Registry<Execution> = &[
    &CommandDelay { longest: 60.0, starts: &[0.001, 0.01, 0.05, 0.1, 0.25, 0.5, 1.0], smooth: false },
    &ParticipationCap,
    &HalfSpread,
    &BookWalk,
    &SqrtImpact,
    &LinearImpact,
    &Commission,
];
