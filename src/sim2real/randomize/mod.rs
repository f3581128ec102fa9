//! Randomization.
pub mod image;
