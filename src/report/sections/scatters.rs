//! A figure over each range, one dot a run.

use minijinja::{Value, context};

use crate::report::plot::{Curve, Ink, Mark, Plot, Scale};
use crate::report::section::{ReportError, Section, fill};
use crate::report::sweep::Scatter;

pub(in crate::report) struct Scatters<'a> {
    pub scatters: &'a [Scatter],
}

impl Section for Scatters<'_> {
    fn id(&self) -> &'static str {
        "ranges"
    }

    fn title(&self) -> &'static str {
        "Range by range"
    }

    fn render(&self) -> Result<String, ReportError> {
        if self.scatters.is_empty() {
            return Ok(String::new());
        }
        let plot = |(k, scatter): (usize, &Scatter)| {
            let (x, y): (Vec<f64>, Vec<Option<f64>>) = scatter.points.iter().map(|(x, y)| (*x, Some(*y))).unzip();
            let plot = Plot {
                alt: format!("{} over {}, one dot a run", scatter.metric, scatter.path),
                x_label: scatter.path.clone(),
                y_label: scatter.metric.clone(),
                scale: Scale::Number,
                curves: vec![Curve { ink: Ink::Equity, mark: Mark::Dots, x: &x, y }],
                shades: Vec::new(),
                zero: true,
                diagonal: false,
                within: None,
                height: (260.0, 240.0),
                columns: 0,
            };
            Value::from_safe_string(plot.draw_narrow(&format!("range-{k}")))
        };
        let plots: Vec<Value> = self.scatters.iter().enumerate().map(plot).collect();
        fill("scatters.html", include_str!("../templates/scatters.html"), context! { plots => plots })
    }
}
