//! All figures of a backtest, by what they are about.

use minijinja::{Value, context};

use crate::report::backtest::{BacktestPage, Metric};
use crate::report::section::{ReportError, Section, fill};

use super::metrics::shown;

pub(in crate::report) struct AllFigures<'a> {
    pub page: &'a BacktestPage,
}

impl Section for AllFigures<'_> {
    fn id(&self) -> &'static str {
        "figures"
    }

    fn title(&self) -> &'static str {
        "All figures"
    }

    fn render(&self) -> Result<String, ReportError> {
        let row = |m: &Metric| context! { name => &m.name, value => shown(m), help => &m.help };
        let groups: Vec<Value> = self
            .page
            .figures
            .iter()
            .filter(|group| !group.figures.is_empty())
            .map(|group| context! { title => &group.title, rows => group.figures.iter().map(row).collect::<Vec<_>>() })
            .collect();
        if groups.is_empty() {
            return Ok(String::new());
        }
        fill("all_figures.html", include_str!("../templates/all_figures.html"), context! { groups => groups })
    }
}
