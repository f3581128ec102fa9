//! What trading cost, by kind.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::market::Blotter;

use super::defined;

/// What all fills cost against the prices at which they were decided: a positive number is a loss. The parts add up to
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
    /// The costs of all fills of `blotter`.
    #[must_use]
    pub fn of(blotter: &Blotter) -> Self {
        let mut costs = Self::default();
        for fill in &blotter.fills {
            costs.timing += fill.cost.timing;
            costs.spread_and_impact += fill.cost.spread_and_impact;
            costs.rounding += fill.cost.rounding;
            costs.fees += fill.fee.to_f64();
            if let Some(order) = blotter.order(fill.order_id) {
                costs.decided_value += (order.decision_price * fill.quantity).to_f64();
            }
        }
        costs.mechanisms.clone_from(&blotter.concessions);
        costs.shortfall = costs.timing + costs.spread_and_impact + costs.rounding + costs.fees;
        costs.shortfall_bps = defined(costs.shortfall / costs.decided_value * 1e4);
        costs
    }
}
