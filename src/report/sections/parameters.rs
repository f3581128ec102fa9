//! The twin's own parameters, before and after.

use minijinja::{Value, context};

use crate::report::quantity::{UNDEFINED, number, percent, uncertain};
use crate::report::section::{ReportError, Section, fill};
use crate::sim2real::diagnose::Diagnosis;

pub(in crate::report) struct Parameters<'a> {
    pub diagnosis: &'a Diagnosis,
}

impl Section for Parameters<'_> {
    fn id(&self) -> &'static str {
        "parameters"
    }

    fn title(&self) -> &'static str {
        "Parameters"
    }

    fn render(&self) -> Result<String, ReportError> {
        if self.diagnosis.parameters.is_empty() {
            return Ok(String::new());
        }
        let at_bound = &self.diagnosis.checks.at_bound;
        let rows: Vec<Value> = self
            .diagnosis
            .parameters
            .iter()
            .map(|(name, p)| {
                let change = p.value / p.nominal - 1.0;
                let sign = if change > 0.0 { "+" } else { "\u{2212}" };
                let unmoved = p.value == p.nominal;
                context! {
                    name => name,
                    unit => &p.unit,
                    nominal => number(p.nominal),
                    value => if p.std > 0.0 { uncertain(p.value, p.std) } else { number(p.value) },
                    change => match () {
                        () if unmoved => "unchanged".into(),
                        () if change.is_finite() => format!("{sign}{}", percent(change.abs())),
                        () => UNDEFINED.into(),
                    },
                    bound => at_bound.contains(name),
                }
            })
            .collect();
        fill("parameters.html", include_str!("../templates/parameters.html"), context! { rows => rows })
    }
}
