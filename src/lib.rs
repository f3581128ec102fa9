//! **trueup** reconciles a simulation with the actual: where a simulation and a real recording differ, it locates the
//! mismatch, says what physics was left out, models it, and shows the fit improve on data it has not seen.
//!
//! One core ([`sim2real`]) serves two thin domains.

#![deny(missing_docs)]
#![forbid(unsafe_code)]

#[cfg(feature = "io")]
pub mod io;
pub mod market;
pub mod sim2real;
#[path = "../strategies/mod.rs"]
pub mod strategies;
