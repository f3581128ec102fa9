//! What stood between decision and fill.

use minijinja::{Value, context};

use crate::report::backtest::BacktestPage;
use crate::report::section::{ReportError, Section, fill};

pub(in crate::report) struct Assumptions<'a> {
    pub page: &'a BacktestPage,
}

impl Section for Assumptions<'_> {
    fn id(&self) -> &'static str {
        "assumptions"
    }

    fn title(&self) -> &'static str {
        "Assumptions in force"
    }

    fn render(&self) -> Result<String, ReportError> {
        let rows: Vec<Value> =
            self.page.in_force.iter().map(|a| context! { name => &a.name, setting => &a.setting }).collect();
        fill("assumptions.html", include_str!("../templates/assumptions.html"), context! { rows => rows })
    }
}
