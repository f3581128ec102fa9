//! The sections of the pages: `x.rs` here, `../templates/x.html` there.

mod answer;
mod assumptions;
mod checks;
mod costs;
mod effects;
mod equity;
mod errors;
mod exposure;
mod fills;
mod inputs;
mod metrics;
mod next;
mod orders;
mod parameters;
mod place;
mod ranking;
mod traces;

pub(super) use answer::Answer;
pub(super) use assumptions::Assumptions;
pub(super) use checks::Checks;
pub(super) use costs::Costs;
pub(super) use effects::Effects;
pub(super) use equity::Equity;
pub(super) use errors::Errors;
pub(super) use exposure::ExposurePlot;
pub(super) use fills::Fills;
pub(super) use inputs::Inputs;
pub(super) use metrics::Metrics;
pub(super) use next::Next;
pub(super) use orders::Orders;
pub(super) use parameters::Parameters;
pub(super) use place::Place;
pub(super) use ranking::Ranking;
pub(super) use traces::Traces;
