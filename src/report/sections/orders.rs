//! Event clocks: measured against predicted, and residuals order by order.

use minijinja::{Value, context};

use crate::report::figures::{Abscissa, DiagnosisFigures, Trace};
use crate::report::plot::{Curve, Mark, Plot, Scale, Shade, Tint};
use crate::report::quantity::{axis, percent};
use crate::report::section::{ReportError, Section, fill};
use crate::sim2real::diagnose::Diagnosis;

use super::traces::{SHOWN, errors, selected, twins};

pub(in crate::report) struct Orders<'a> {
    pub diagnosis: &'a Diagnosis,
    pub figures: &'a DiagnosisFigures,
    /// Whether to show what no fit has seen, or what was fitted.
    pub held_out: bool,
}

impl Section for Orders<'_> {
    fn id(&self) -> &'static str {
        if self.held_out { "held-out-orders" } else { "fitted-orders" }
    }

    fn title(&self) -> &'static str {
        if self.held_out { "Held-out orders" } else { "Fitted orders" }
    }

    fn render(&self) -> Result<String, ReportError> {
        let all: Vec<&Trace> = selected(self.figures, self.held_out, Abscissa::Order).collect();
        if all.is_empty() {
            return Ok(String::new());
        }
        let plots: Vec<Value> = all.iter().take(SHOWN).enumerate().map(|(k, t)| self.plots(k, t)).collect();
        let rest: Vec<String> = all.iter().skip(SHOWN).map(|t| t.caption()).collect();
        fill(
            "orders.html",
            include_str!("../templates/orders.html"),
            context! { plots => plots, rest => rest, held_out => self.held_out },
        )
    }
}

impl Orders<'_> {
    fn plots(&self, k: usize, trace: &Trace) -> Value {
        let id = self.id();
        let caption = trace.caption();
        let number: Vec<f64> = (1..=trace.measured.len()).map(|n| n as f64).collect();
        let scatters: Vec<Value> = twins(trace)
            .into_iter()
            .map(|(ink, predicted)| {
                let plot = Plot {
                    alt: format!("{caption}: measured against {} prediction, with the line on which they agree", ink.name()),
                    x_label: axis(&format!("{}, predicted", ink.name()), &trace.unit),
                    y_label: axis("measured", &trace.unit),
                    scale: Scale::Number,
                    curves: vec![Curve { ink, mark: Mark::Dots, x: predicted, y: trace.measured.clone() }],
                    shades: Vec::new(),
                    zero: false,
                    diagonal: true,
                    within: None,
                    height: (330.0, 300.0),
                    columns: 0,
                };
                Value::from_safe_string(plot.draw(&format!("{id}-{k}-{}", ink.name())))
            })
            .collect();
        let residual = Plot {
            alt: format!("{caption}: measured less each prediction, order by order"),
            x_label: "order".into(),
            y_label: axis("residual", &trace.unit),
            scale: Scale::Number,
            curves: twins(trace)
                .into_iter()
                .map(|(ink, predicted)| Curve { ink, mark: Mark::Dots, x: &number, y: trace.residual(predicted) })
                .collect(),
            shades: self.shades(trace),
            zero: true,
            diagonal: false,
            within: None,
            height: (260.0, 220.0),
            columns: 0,
        };
        context! {
            caption => caption,
            errors => errors(trace),
            scatters => scatters,
            residual => Value::from_safe_string(residual.draw(&format!("{id}-{k}-r"))),
            shaded => !residual.shades.is_empty(),
        }
    }

    /// The worst stretches, from seconds to numbers of orders.
    fn shades(&self, trace: &Trace) -> Vec<Shade> {
        let number = |seconds: f64| trace.time.partition_point(|t| *t < seconds) as f64;
        let of_this =
            |i: &&crate::sim2real::diagnose::Interval| i.channel == trace.channel && i.recording == trace.recording;
        let intervals = self.diagnosis.location.intervals.iter().filter(of_this);
        intervals
            .map(|i| Shade {
                start: number(i.start) + 0.5,
                end: number(i.end) + 0.5,
                label: percent(i.share_of_error),
                tint: Tint::Misfit,
            })
            .filter(|s| s.end > s.start)
            .collect()
    }
}
