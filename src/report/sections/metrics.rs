//! Key figures of a backtest.

use minijinja::{Value, context};

use crate::report::backtest::{BacktestPage, Metric};
use crate::report::quantity::UNDEFINED;
use crate::report::section::{ReportError, Section, fill};

pub(in crate::report) struct Metrics<'a> {
    pub page: &'a BacktestPage,
}

impl Section for Metrics<'_> {
    fn id(&self) -> &'static str {
        "metrics"
    }

    fn title(&self) -> &'static str {
        "Key figures"
    }

    fn render(&self) -> Result<String, ReportError> {
        let metrics: Vec<Value> =
            self.page.metrics.iter().map(|m| context! { name => &m.name, value => shown(m), help => &m.help }).collect();
        if metrics.is_empty() {
            return Ok(String::new());
        }
        fill("metrics.html", include_str!("../templates/metrics.html"), context! { metrics => metrics })
    }
}

/// The value as the page has it: one that came out as "NaN" is no more defined than one that did not come out.
pub(super) fn shown(metric: &Metric) -> &str {
    metric.value.as_deref().filter(|v| !v.contains("NaN") && !v.trim().is_empty()).unwrap_or(UNDEFINED)
}
