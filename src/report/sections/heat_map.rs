//! A figure over two ranges, as a table of colours.

use minijinja::{Value, context};

use crate::report::quantity::number;
use crate::report::section::{ReportError, Section, fill};
use crate::report::sweep::HeatMap;

pub(in crate::report) struct HeatMapTable<'a> {
    pub heat: Option<&'a HeatMap>,
}

impl Section for HeatMapTable<'_> {
    fn id(&self) -> &'static str {
        "heat-map"
    }

    fn title(&self) -> &'static str {
        "Heat map"
    }

    fn render(&self) -> Result<String, ReportError> {
        let Some(heat) = self.heat else { return Ok(String::new()) };
        // By rank: one run far off must not make all others look alike.
        let mut all: Vec<f64> = heat.cells.iter().flatten().flatten().copied().filter(|v| v.is_finite()).collect();
        if all.is_empty() {
            return Ok(String::new());
        }
        all.sort_by(f64::total_cmp);
        let last = (all.len() - 1).max(1) as f64;
        let strength = |value: f64| {
            let part = all.partition_point(|other| *other < value) as f64 / last;
            (55.0 * if heat.larger_is_better { part } else { 1.0 - part }).round()
        };
        let cell = |value: &Option<f64>| match value.filter(|v| v.is_finite()) {
            Some(value) => context! { text => number(value), strength => strength(value) },
            None => context! { text => "", strength => 0 },
        };
        let rows: Vec<Value> = heat
            .rows
            .iter()
            .zip(&heat.cells)
            .map(|(name, cells)| context! { name => name, cells => cells.iter().map(cell).collect::<Vec<_>>() })
            .collect();
        fill(
            "heat_map.html",
            include_str!("../templates/heat_map.html"),
            context! { metric => &heat.metric, down => &heat.down, across => &heat.across, columns => heat.columns.clone(), rows => rows },
        )
    }
}
