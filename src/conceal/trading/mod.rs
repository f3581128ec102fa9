//! The blind benchmark of markets: days of orders, each with something concealed in how they were executed, or with nothing.
//!
//! [`draw`] makes case `index` of a seed: a day to learn from and another to test on, what the twin says, and the [`Label`] that
//! tells what was concealed. The tape comes of processes (price, volatility, spread, depth, trades), not of a venue; orders are
//! executed by the generator's own code, and each effect has another functional form than any registry states.

mod case;
mod client;
mod climate;
mod draw;
mod effect;
mod excitation;
mod executed;
mod floor;
mod foreign;
mod noise;
mod plan;
mod recipe;
mod resting;
mod size;
mod tables;
mod tape;
mod truth;
mod wake;

pub use case::{Assumed, Day, Depth, Label, TradingCase, World};
pub use draw::draw;

#[cfg(test)]
mod tests;
