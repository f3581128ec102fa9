//! How the gap came about, order by order.

use minijinja::{Value, context};

use crate::report::data_time::DataTime;
use crate::report::plot::{Curve, Ink, Mark, Plot, Scale};
use crate::report::quantity::axis;
use crate::report::reconcile::ReconcilePage;
use crate::report::section::{ReportError, Section, fill};

use super::equity::{COLUMNS, gaps};

pub(in crate::report) struct GapCurve<'a> {
    pub page: &'a ReconcilePage,
}

impl Section for GapCurve<'_> {
    fn id(&self) -> &'static str {
        "gap-curve"
    }

    fn title(&self) -> &'static str {
        "The gap, order by order"
    }

    fn render(&self) -> Result<String, ReportError> {
        if self.page.gap.len() < 2 {
            return Ok(String::new());
        }
        let DataTime { places: time, cuts } = DataTime::of(&self.page.time);
        let plot = Plot {
            alt: "Gap of profit and loss of all orders up to each, over time".into(),
            x_label: "decided (UTC)".into(),
            y_label: axis("paper log better by", &self.page.currency),
            shades: gaps(&cuts),
            scale: Scale::Date(cuts),
            curves: vec![Curve {
                ink: Ink::Equity,
                mark: Mark::Step,
                x: &time,
                y: self.page.gap.iter().map(|gap| Some(*gap)).collect(),
            }],
            zero: true,
            diagonal: false,
            within: None,
            height: (260.0, 200.0),
            columns: COLUMNS,
        };
        fill(
            "gap_curve.html",
            include_str!("../templates/gap_curve.html"),
            context! { plot => Value::from_safe_string(plot.draw("gap-plot")) },
        )
    }
}
