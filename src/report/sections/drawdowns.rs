//! The deepest falls, with their dates.

use minijinja::{Value, context};

use crate::report::backtest::BacktestPage;
use crate::report::quantity::{fine, span};
use crate::report::section::{ReportError, Section, fill};

use super::dates::Dates;

pub(in crate::report) struct Drawdowns<'a> {
    pub page: &'a BacktestPage,
}

impl Section for Drawdowns<'_> {
    fn id(&self) -> &'static str {
        "drawdowns"
    }

    fn title(&self) -> &'static str {
        "Drawdowns"
    }

    fn render(&self) -> Result<String, ReportError> {
        if self.page.drawdowns.is_empty() {
            return Ok(String::new());
        }
        let dates = Dates::over(self.page);
        let rows: Vec<Value> = self
            .page
            .drawdowns
            .iter()
            .map(|fall| {
                context! {
                    depth => fine(fall.depth),
                    peak => dates.known(fall.peak_at),
                    trough => dates.known(fall.trough_at),
                    recovered => fall.recovered_at.map(|at| dates.known(at)),
                    length => span(fall.seconds),
                }
            })
            .collect();
        fill("drawdowns.html", include_str!("../templates/drawdowns.html"), context! { rows => rows, zone => dates.zone() })
    }
}
