//! Market making: where to quote on both sides. The strategy that sends these quotes needs orders that rest.

mod avellaneda_stoikov;

pub use avellaneda_stoikov::{AvellanedaStoikov, Parameters, TwoSided};
