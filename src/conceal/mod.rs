//! The generator: small recordings in which an effect is concealed, for demonstrations, data sets and blind trials.
//!
//! It shares no code with the plants and mechanisms that diagnose, integrates in other ways and with steps at least ten
//! times finer, and states each effect in another functional form. Truth and candidate of one form would make every figure
//! too good.

pub mod bars;
pub mod benchmark;
mod catalogue;
pub mod exchange;
pub mod servo;
mod table;

pub use catalogue::{Content, Set, catalogue};
pub use table::{Column, Table};
