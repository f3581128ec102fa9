//! Equity and drawdown over time.

use minijinja::{Value, context};

use crate::report::backtest::BacktestPage;
use crate::report::data_time::{Cut, DataTime};
use crate::report::plot::{Curve, Ink, Mark, Plot, Scale, Shade, Tint};
use crate::report::quantity::axis;
use crate::report::section::{ReportError, Section, fill};

pub(in crate::report) struct Equity<'a> {
    pub page: &'a BacktestPage,
}

/// Columns of a wide plot: two points each, so at most 2,000.
pub(super) const COLUMNS: usize = 1_000;

impl Section for Equity<'_> {
    fn id(&self) -> &'static str {
        "equity"
    }

    fn title(&self) -> &'static str {
        "Equity and drawdown"
    }

    fn render(&self) -> Result<String, ReportError> {
        if self.page.equity.is_empty() {
            return Ok(String::new());
        }
        let DataTime { places: time, cuts } = DataTime::of(&self.page.time);
        let line = |ink, values: &[f64]| {
            let y = values.iter().map(|v| Some(*v)).collect();
            Curve { ink, mark: Mark::Line, x: &time, y }
        };
        let bounds = self.page.bands.iter().flatten().map(|bound| line(Ink::Bound, bound));
        let equity = Plot {
            alt: "Equity over time".into(),
            x_label: String::new(),
            y_label: axis("equity", &self.page.currency),
            shades: gaps(&cuts),
            scale: Scale::Date(cuts),
            curves: bounds.chain([line(Ink::Equity, &self.page.equity)]).collect(),
            zero: false,
            diagonal: false,
            within: None,
            height: (300.0, 230.0),
            columns: COLUMNS,
        };
        let drawdown = Plot {
            alt: "Drawdown from the highest equity so far, over time".into(),
            x_label: "date (UTC)".into(),
            y_label: "drawdown [%]".into(),
            curves: vec![Curve { ink: Ink::Loss, mark: Mark::Area, x: &time, y: drawdown(&self.page.equity) }],
            zero: true,
            height: (190.0, 170.0),
            ..equity.clone()
        };
        fill(
            "equity.html",
            include_str!("../templates/equity.html"),
            context! {
                equity => Value::from_safe_string(equity.draw("equity-plot")),
                bands => self.page.bands.is_some(),
                drawdown => Value::from_safe_string(drawdown.draw("drawdown-plot")),
            },
        )
    }
}

/// Where time was cut, as stretches to point at.
pub(super) fn gaps(cuts: &[Cut]) -> Vec<Shade> {
    cuts.iter()
        .map(|cut| Shade { start: cut.around.0, end: cut.around.1, label: "gap".into(), tint: Tint::Misfit })
        .collect()
}

/// By how much equity lies below its highest value so far [%]; none where that is not positive.
fn drawdown(equity: &[f64]) -> Vec<Option<f64>> {
    let mut peak = f64::NEG_INFINITY;
    let below = |v: &f64| {
        peak = peak.max(*v);
        (peak > 0.0).then(|| 100.0 * (v / peak - 1.0))
    };
    equity.iter().map(below).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawdown_is_measured_from_the_peak_so_far() {
        let below: Vec<f64> = drawdown(&[100.0, 80.0, 200.0, 150.0]).into_iter().flatten().collect();
        for (found, expected) in below.iter().zip([0.0, -20.0, 0.0, -25.0]) {
            assert!((found - expected).abs() < 1e-9, "{below:?}");
        }
        assert_eq!(drawdown(&[-1.0]), vec![None]);
    }
}
