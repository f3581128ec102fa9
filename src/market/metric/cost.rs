//! What trading cost, by kind.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::market::Record;

use super::defined;

/// What all fills cost, in the currency of the run at the rates of the fills, against the prices at which they were decided: a positive number is a loss. The parts add up to
/// the implementation shortfall of what was filled; what was not filled is in the counts.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Costs {
    /// The market moved between decision and arrival [currency]. With bars: from the close that decided to the open that
    /// was met.
    pub timing: f64,
    /// What the spread and impacts added to the open or mid that was met [currency].
    pub spread_and_impact: f64,
    /// Of that, what each mechanism added, by its id [currency]; the rest is the spread of fills that began at the touch.
    pub mechanisms: BTreeMap<&'static str, f64>,
    /// Prices were moved to a tick, against the order [currency].
    pub rounding: f64,
    /// Fees [currency].
    pub fees: f64,
    /// All of these [currency].
    pub shortfall: f64,
    /// Value traded, at the prices of the decisions [currency].
    pub decided_value: f64,
    /// The shortfall in bps of that value.
    pub shortfall_bps: Option<f64>,
}

impl Costs {
    /// The costs of all fills of `record`.
    #[must_use]
    pub fn of(record: &Record) -> Self {
        let blotter = &record.blotter;
        let mut costs = Self::default();
        for fill in &blotter.fills {
            costs.timing += fill.cost.timing * fill.rate;
            costs.spread_and_impact += fill.cost.spread_and_impact * fill.rate;
            costs.rounding += fill.cost.rounding * fill.rate;
            costs.fees += fill.fee.to_f64() * fill.rate;
            costs.decided_value += (fill.decision_price * fill.quantity).to_f64() * record.worth_of_one(fill);
        }
        costs.mechanisms.clone_from(&blotter.concessions);
        costs.shortfall = costs.timing + costs.spread_and_impact + costs.rounding + costs.fees;
        costs.shortfall_bps = defined(costs.shortfall / costs.decided_value * 1e4);
        costs
    }
}
