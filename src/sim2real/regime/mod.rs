//! Regimes of a series: which state it is in, when it changed, and whether it still is what it was.
//!
//! | question | answer |
//! |---|---|
//! | Which of a few states comes back again and again? | [`fit`] a [`HiddenMarkov`] model, follow it online with a [`Filter`] |
//! | How long ago was the last change, right now? | [`RunLengths`], Bayesian |
//! | Has the mean shifted, with a known rate of false alarms? | [`Cusum`] |
//! | When did it change, all told? | a [`Division`] of the series, exact |
//! | Are these two samples of one distribution? | [`kolmogorov_smirnov`], [`wasserstein`]; online a [`DriftWindow`] |
//!
//! What has a `step` is online: what it said of a row, no later row changes by a bit. All else looks at a series from its end.

mod baum_welch;
mod course;
mod cusum;
mod decode;
mod densities;
mod drift;
mod emission;
mod ends;
mod error;
mod filter;
mod hazard;
mod hidden_markov;
mod in_logs;
mod moments;
mod observations;
mod pelt;
mod prior;
mod run_length;
mod runs;
mod settings;
mod starts;
mod strands;
mod trellis;
mod two_sample;
mod viterbi;

pub use baum_welch::{Collapse, Fit, fit, fit_states, refit};
pub use cusum::{Alarm, Cusum, CusumSettings, Shift};
pub use drift::DriftWindow;
pub use emission::{Emission, Spread};
pub use error::RegimeError;
pub use filter::Filter;
pub use hazard::Hazard;
pub use hidden_markov::{Drawn, HiddenMarkov};
pub use observations::Observations;
pub use pelt::{Cost, Divided, Division, Penalty};
pub use prior::Prior;
pub use run_length::{Assumed, RunLengths};
pub use settings::{Degrees, Family, Settings};
pub use two_sample::{Apart, kolmogorov_smirnov, wasserstein};
