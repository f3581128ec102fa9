//! The blind benchmark: cases whose labels are sealed, diagnosed, unsealed and scored.
//!
//! [`twin`] and [`recordings`] make of a concealed [`Case`](crate::conceal::benchmark::Case) what a user would bring to a
//! diagnosis.

mod case;

pub use case::{recordings, twin};
