//! What trading cost, by kind.

use serde::Serialize;

use crate::market::Blotter;

use super::defined;

/// What all fills cost against the prices at which they were decided: a positive number is a loss. The parts add up to
/// the implementation shortfall of what was filled; what was not filled is in the counts.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Costs {
    /// The market moved between decision and arrival [currency]. With bars: from the close that decided to the open that
    /// was met.
    pub timing: f64,
    /// What the spread and impacts added to the open or mid that was met [currency].
    pub spread_and_impact: f64,
    /// Prices were moved to a tick, against the order [currency].
    pub rounding: f64,
    /// Fees [currency].
    pub fees: f64,
    /// All of these [currency].
    pub shortfall: f64,
    /// All of these, in bps of the value traded at the prices of the decisions.
    pub shortfall_bps: Option<f64>,
}

impl Costs {
    /// The costs of all fills of `blotter`.
    #[must_use]
    pub fn of(blotter: &Blotter) -> Self {
        let (mut costs, mut decided) = (Self::default(), 0.0);
        for fill in &blotter.fills {
            costs.timing += fill.cost.timing;
            costs.spread_and_impact += fill.cost.spread_and_impact;
            costs.rounding += fill.cost.rounding;
            costs.fees += fill.fee.to_f64();
            if let Some(order) = blotter.orders.get(fill.order_id as usize - 1) {
                decided += (order.decision_price * fill.quantity).to_f64();
            }
        }
        costs.shortfall = costs.timing + costs.spread_and_impact + costs.rounding + costs.fees;
        costs.shortfall_bps = defined(costs.shortfall / decided * 1e4);
        costs
    }
}
