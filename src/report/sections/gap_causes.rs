//! What made the gap between a backtest and a paper log.

use minijinja::{Value, context};

use crate::report::quantity::decimals;
use crate::report::reconcile::{GapCause, ReconcilePage};
use crate::report::section::{ReportError, Section, fill};

use super::answer::width;

pub(in crate::report) struct GapCauses<'a> {
    pub page: &'a ReconcilePage,
}

impl Section for GapCauses<'_> {
    fn id(&self) -> &'static str {
        "causes"
    }

    fn title(&self) -> &'static str {
        "What made the gap"
    }

    fn render(&self) -> Result<String, ReportError> {
        let causes = &self.page.causes;
        if causes.is_empty() {
            return Ok(String::new());
        }
        let largest = causes.iter().map(|cause| cause.amount.abs()).fold(0.0, f64::max);
        let row = |cause: &GapCause| {
            context! {
                name => &cause.name,
                words => &cause.words,
                amount => decimals(cause.amount, 2),
                interval => cause.interval.map(|[low, high]| format!("{} to {}", decimals(low, 2), decimals(high, 2))),
                orders => cause.orders,
                width => width(cause.amount.abs(), largest),
                gain => cause.amount > 0.0,
            }
        };
        let rows: Vec<Value> = causes.iter().map(row).collect();
        let total: f64 = causes.iter().map(|cause| cause.amount).sum();
        fill(
            "gap_causes.html",
            include_str!("../templates/gap_causes.html"),
            context! { rows => rows, currency => &self.page.currency, total => decimals(total, 2) },
        )
    }
}
