//! **trueup** reconciles a simulation with the actual: where a simulation and a real recording differ, it locates the
//! mismatch, says what physics was left out, models it, and shows the fit improve on data it has not seen.
//!
//! One core ([`sim2real`]) serves two thin domains, [`market`] and [`robot`]. Files are read and written by `io` alone,
//! results are shown by [`report`], and [`conceal`] makes recordings in which an effect is hidden, sharing no code with
//! what has to find it.

#![deny(missing_docs)]
#![forbid(unsafe_code)]

#[cfg(feature = "cli")]
pub mod cli;
pub mod conceal;
#[cfg(feature = "io")]
pub mod io;
pub mod market;
pub mod report;
pub mod robot;
pub mod sim2real;
#[path = "../strategies/mod.rs"]
pub mod strategies;
