//! What the market does after an order: how far the mid goes with it, how that depends on its size, how it fades once the orders
//! that follow are taken out, and how long signs and how large sizes go on.
//!
//! The estimators take orders as the market felt them ([`Felt`]) and the mid as it was shown ([`MidTrack`]). Each gives an
//! interval by resampling blocks of time ([`Estimated`]), and nothing where the tape is too short for one.

mod blocks;
mod lagged;
mod mids;
mod moves;
mod power_law;
mod runs;
mod signs;
#[cfg(test)]
mod simulated;
mod tail;

pub use blocks::Estimated;
pub use lagged::{Propagator, propagator};
pub use mids::{Felt, MidTrack};
pub use moves::{MeanMove, SizeBin, SizeResponse, mean_moves, size_response};
pub use runs::{OrderRun, runs};
pub use signs::{SignMemory, sign_memory};
pub use tail::{Tail, hill};
