//! What speaks for and against the verdict.

use minijinja::{Value, context};

use crate::report::quantity::{UNDEFINED, number, percent};
use crate::report::section::{ReportError, Section, fill};
use crate::sim2real::diagnose::Diagnosis;

pub(in crate::report) struct Checks<'a> {
    pub diagnosis: &'a Diagnosis,
}

impl Section for Checks<'_> {
    fn id(&self) -> &'static str {
        "checks"
    }

    fn title(&self) -> &'static str {
        "Checks and notes"
    }

    fn render(&self) -> Result<String, ReportError> {
        let checks = &self.diagnosis.checks;
        let at_bound = if checks.at_bound.is_empty() { "none".into() } else { checks.at_bound.join(", ") };
        let row = |name: &str, value: String, meaning: &str| context! { name => name, value => value, meaning => meaning };
        let rows: Vec<Value> = vec![
            row(
                "misfit left",
                percent(checks.remainder),
                "Share of the recalibrated misfit above the noise floor that is left. Up to a few per cent is an error of form, more is missing physics.",
            ),
            row(
                "adequacy",
                number(checks.adequacy),
                "Autocorrelation left in the trued residual, mean over 40 lags of N ρ². About 1 when the physics is complete.",
            ),
            row(
                "placebos",
                checks.placebo_p.map_or_else(|| UNDEFINED.into(), percent),
                "Share of placebos that did at least as well as what was named.",
            ),
            row("at a bound", at_bound, "Parameters that ended at a bound are not measured, only limited."),
            row("tried", checks.tried.to_string(), "Number of mechanisms the data were asked about."),
        ];
        fill(
            "checks.html",
            include_str!("../templates/checks.html"),
            context! {
                rows => rows,
                notes => checks.notes.clone(),
                held_out => &self.diagnosis.held_out,
            },
        )
    }
}
