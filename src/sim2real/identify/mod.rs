//! Estimates of parameters from recordings: what a simulator has to be told to follow them best.
//!
//! [`fit`] is an output-error fit: the simulator runs free and its outputs are compared with the measured ones. Parameters
//! that the output depends on smoothly are found by Levenberg-Marquardt, those on which it jumps without derivatives.

pub(crate) mod columns;
mod derivative_free;
mod initial_state;
mod least_squares;
mod normal;
mod problem;

pub use derivative_free::{fit, minimize};
pub use initial_state::State;
pub use least_squares::{Effort, Fit, fit_from, fit_smooth};
pub use problem::{Block, Evaluation, Problem};
