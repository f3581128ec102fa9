//! What trading cost, by kind.

use minijinja::{Value, context};

use crate::report::backtest::BacktestPage;
use crate::report::quantity::{UNDEFINED, decimals};
use crate::report::section::{ReportError, Section, fill};

use super::answer::width;

pub(in crate::report) struct Costs<'a> {
    pub page: &'a BacktestPage,
}

impl Section for Costs<'_> {
    fn id(&self) -> &'static str {
        "costs"
    }

    fn title(&self) -> &'static str {
        "What trading cost"
    }

    fn render(&self) -> Result<String, ReportError> {
        let costs = &self.page.costs;
        if costs.is_empty() {
            return Ok(String::new());
        }
        let largest = costs.iter().map(|c| c.amount.abs()).fold(0.0, f64::max);
        let money = |amount: f64| if amount.is_finite() { decimals(amount, 2) } else { UNDEFINED.into() };
        let bps = |bps: Option<f64>| bps.filter(|b| b.is_finite()).map_or_else(|| UNDEFINED.into(), |b| decimals(b, 3));
        let rows: Vec<Value> = costs
            .iter()
            .map(|c| {
                context! {
                    kind => &c.kind,
                    amount => money(c.amount),
                    bps => bps(c.bps),
                    width => width(c.amount.abs(), largest),
                    gain => c.amount < 0.0,
                }
            })
            .collect();
        let total: f64 = costs.iter().map(|c| c.amount).sum();
        let total_bps: Option<f64> = costs.iter().map(|c| c.bps).sum();
        fill(
            "costs.html",
            include_str!("../templates/costs.html"),
            context! { rows => rows, currency => &self.page.currency, total => money(total), total_bps => bps(total_bps) },
        )
    }
}
