//! What may stand between an order's decision and its fill: one file each, one row each in [`MECHANISMS`].

mod half_spread;

pub use half_spread::HalfSpread;

use crate::sim2real::{Registry, mechanism::CommandDelay};

use super::Execution;

/// The market's registry.
pub static MECHANISMS: Registry<Execution> =
    &[&CommandDelay { longest: 60.0, starts: &[0.001, 0.01, 0.05, 0.1, 0.25, 0.5, 1.0], smooth: false }, &HalfSpread];
