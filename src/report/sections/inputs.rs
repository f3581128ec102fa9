//! What the run was made from.

use minijinja::{Value, context};

use crate::report::backtest::BacktestPage;
use crate::report::quantity::{UNDEFINED, decimals};
use crate::report::section::{ReportError, Section, fill};

pub(in crate::report) struct Inputs<'a> {
    pub page: &'a BacktestPage,
}

impl Section for Inputs<'_> {
    fn id(&self) -> &'static str {
        "inputs"
    }

    fn title(&self) -> &'static str {
        "Inputs"
    }

    fn render(&self) -> Result<String, ReportError> {
        if self.page.inputs.is_empty() {
            return Ok(String::new());
        }
        let rows: Vec<Value> = self
            .page
            .inputs
            .iter()
            .map(|i| {
                let rows = i.rows.map_or_else(|| UNDEFINED.into(), |r| decimals(r as f64, 0));
                context! { name => &i.name, rows => rows, hash => &i.sha256 }
            })
            .collect();
        fill("inputs.html", include_str!("../templates/inputs.html"), context! { rows => rows })
    }
}
