//! Whether confidences are probabilities.

use minijinja::{Value, context};

use crate::report::plot::{Curve, Ink, Mark, Plot, Scale};
use crate::report::proof::ProofPage;
use crate::report::quantity::percent;
use crate::report::section::{ReportError, Section, fill};

pub(in crate::report) struct ReliabilityPlot<'a> {
    pub page: &'a ProofPage,
}

impl Section for ReliabilityPlot<'_> {
    fn id(&self) -> &'static str {
        "confidence"
    }

    fn title(&self) -> &'static str {
        "Confidence, and how often it is right"
    }

    fn render(&self) -> Result<String, ReportError> {
        let bins = &self.page.reliability;
        if bins.is_empty() {
            return Ok(String::new());
        }
        let said: Vec<f64> = bins.iter().map(|(said, _, _)| *said).collect();
        let right: Vec<Option<f64>> = bins.iter().map(|(_, right, _)| Some(*right)).collect();
        let plot = Plot {
            alt: "Share of names that are right over the confidence they were given with".to_owned(),
            x_label: "confidence".to_owned(),
            y_label: "share that is right".to_owned(),
            scale: Scale::Number,
            curves: vec![Curve { ink: Ink::Trued, mark: Mark::Dots, x: &said, y: right }],
            shades: Vec::new(),
            zero: false,
            diagonal: true,
            within: None,
            height: (320.0, 320.0),
            columns: 200,
        };
        let rows: Vec<Value> = bins
            .iter()
            .map(|(said, right, count)| context! { said => percent(*said), right => percent(*right), count => count })
            .collect();
        let drawing = Value::from_safe_string(plot.draw("reliability"));
        fill(
            "reliability.html",
            include_str!("../templates/reliability.html"),
            context! { rows => rows, drawing => drawing },
        )
    }
}
