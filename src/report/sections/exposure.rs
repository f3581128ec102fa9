//! What was held over time.

use minijinja::{Value, context};

use crate::report::backtest::{BacktestPage, Exposure};
use crate::report::data_time::DataTime;
use crate::report::plot::{Curve, Ink, Mark, Plot, Scale};
use crate::report::quantity::axis;
use crate::report::section::{ReportError, Section, fill};

use super::equity::{COLUMNS, gaps};

pub(in crate::report) struct ExposurePlot<'a> {
    pub page: &'a BacktestPage,
}

impl Section for ExposurePlot<'_> {
    fn id(&self) -> &'static str {
        "exposure"
    }

    fn title(&self) -> &'static str {
        "What was held"
    }

    fn render(&self) -> Result<String, ReportError> {
        let mut units: Vec<&str> = Vec::new();
        for exposure in &self.page.exposures {
            if !units.contains(&exposure.unit.as_str()) {
                units.push(&exposure.unit);
            }
        }
        let time = DataTime::of(&self.page.time);
        // As many series to a plot as there are colours.
        let groups = units.iter().flat_map(|unit| {
            let alike: Vec<&Exposure> = self.page.exposures.iter().filter(|e| e.unit == *unit).collect();
            alike.chunks(Ink::MEMBERS).map(<[_]>::to_vec).collect::<Vec<_>>()
        });
        let plots: Vec<Value> = groups.take(4).enumerate().map(|(k, group)| plot(k, &group, &time)).collect();
        if plots.is_empty() {
            return Ok(String::new());
        }
        fill("exposure.html", include_str!("../templates/exposure.html"), context! { plots => plots })
    }
}

fn plot(k: usize, group: &[&Exposure], time: &DataTime) -> Value {
    let names: Vec<&str> = group.iter().map(|e| e.name.as_str()).collect();
    let unit = group.first().map_or("", |e| e.unit.as_str());
    let plot = Plot {
        alt: format!("Held over time: {}", names.join(", ")),
        x_label: "date (UTC)".into(),
        y_label: axis("held", unit),
        scale: Scale::Date(time.cuts.clone()),
        curves: group
            .iter()
            .enumerate()
            .map(|(n, e)| Curve {
                ink: Ink::Member(n),
                mark: Mark::Step,
                x: &time.places,
                y: e.values.iter().map(|v| Some(*v)).collect(),
            })
            .collect(),
        shades: gaps(&time.cuts),
        zero: true,
        diagonal: false,
        within: None,
        height: (220.0, 190.0),
        columns: COLUMNS / group.len().max(1),
    };
    let legend: Vec<Value> =
        names.iter().enumerate().map(|(n, name)| context! { name => *name, ink => Ink::Member(n).name() }).collect();
    context! { drawing => Value::from_safe_string(plot.draw(&format!("exposure-{k}"))), legend => legend }
}
