//! Reports: self-contained HTML pages that open without a network, and are the same bytes for the same input.
//!
//! A page is a [`Page`] of [`Section`]s; each section is one struct in `sections/x.rs` beside its template
//! `templates/x.html`. Only `plot` knows the plotting library.

mod backtest;
mod data_time;
mod decimate;
mod diagnosis;
mod fan;
mod figures;
mod page;
mod plot;
mod proof;
pub(crate) mod quantity;
mod reconcile;
mod regimes;
mod rollout;
mod section;
mod sections;
mod sweep;

pub use backtest::{
    BacktestPage, Cost, DrawsPart, Exposure, Fall, FigureGroup, Fill, InForce, Input, Metric, MonthReturn, Trade,
};
pub use diagnosis::diagnosis_page;
pub use fan::{Fan, FanBand, FanTime};
pub use figures::{Abscissa, DiagnosisFigures, Trace};
pub use page::{Badge, Page, Tone};
pub use proof::{ConfusionTable, ProofFailure, ProofFigure, ProofPage};
pub use reconcile::{GapCause, ReconcilePage, ReconcileTable};
pub use regimes::{RegimesPage, Segment};
pub use rollout::RolloutPage;
pub use section::{ReportError, Section};
pub use sweep::{HeatMap, Listing, Scatter, SweepPage, WalkForwardPage};
