//! Regimes of a series: which state it is in, when it changed, and whether it still is what it was.
mod baum_welch;
mod decode;
mod emission;
mod error;
mod filter;
mod hidden_markov;
mod moments;
mod observations;
mod starts;
mod trellis;

pub use baum_welch::{Collapse, Degrees, Family, Fit, Settings, fit, fit_states};
pub use emission::{Emission, Spread};
pub use error::RegimeError;
pub use filter::Filter;
pub use hidden_markov::{Drawn, HiddenMarkov};
pub use observations::Observations;
