//! The generator: small recordings in which an effect is concealed, for demonstrations, data sets and blind trials.
//!
//! It shares no code with the plants and mechanisms that diagnose, integrates in other ways and with steps at least ten
//! times finer, and states each effect in another functional form. Truth and candidate of one form would make every figure
//! too good.

pub mod bars;
pub mod benchmark;
mod catalogue;
mod concealed;
pub mod exchange;
mod kind;
pub mod servo;
mod table;
pub mod trading;

pub use catalogue::{Content, Set, catalogue};
pub use concealed::{Concealed, Span};
pub use kind::{Kind, MIX, Null};
pub use table::{Column, Table};
