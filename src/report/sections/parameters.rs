//! Parameters with their intervals: those of what was found, and the twin's own before and after.

use minijinja::{Value, context};

use crate::report::quantity::{UNDEFINED, decimals, number, percent, uncertain};
use crate::report::section::{ReportError, Section, fill};
use crate::sim2real::diagnose::{Diagnosis, Estimate, ParameterChange};

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
        let d = self.diagnosis;
        let found = d.effects.iter().flat_map(|effect| {
            let of =
                move |(name, e): (&String, &Estimate)| added(&format!("{}.{name}", effect.mechanism), e, &d.checks.at_bound);
            effect.parameters.iter().map(of)
        });
        let own = d.parameters.iter().map(|(name, p)| own(name, p, &d.checks.at_bound));
        let rows: Vec<Value> = found.chain(own).collect();
        if rows.is_empty() {
            return Ok(String::new());
        }
        fill("parameters.html", include_str!("../templates/parameters.html"), context! { rows => rows })
    }
}

/// A parameter of a mechanism that was found: the twin has no value of it.
fn added(name: &str, estimate: &Estimate, at_bound: &[String]) -> Value {
    context! {
        name => name,
        unit => &estimate.unit,
        nominal => UNDEFINED,
        value => fitted(estimate.value, estimate.std),
        interval => interval(estimate.value, estimate.std),
        change => "added",
        bound => at_bound.iter().any(|other| other == name),
    }
}

/// A parameter of the twin, refitted together with what was found.
fn own(name: &str, p: &ParameterChange, at_bound: &[String]) -> Value {
    let change = p.value / p.nominal - 1.0;
    let sign = if change > 0.0 { "+" } else { "\u{2212}" };
    let unmoved = p.value == p.nominal;
    context! {
        name => name,
        unit => &p.unit,
        nominal => number(p.nominal),
        value => fitted(p.value, p.std),
        interval => interval(p.value, p.std),
        change => match () {
            () if unmoved => "unchanged".into(),
            () if change.is_finite() => format!("{sign}{}", percent(change.abs())),
            () => UNDEFINED.into(),
        },
        bound => at_bound.iter().any(|other| other == name),
    }
}

fn fitted(value: f64, std: f64) -> String {
    if std > 0.0 { uncertain(value, std) } else { number(value) }
}

/// The 95 % interval of a Gaussian estimate, to the digits its standard deviation has.
fn interval(value: f64, std: f64) -> String {
    if !(std > 0.0 && std.is_finite() && value.is_finite()) {
        return UNDEFINED.into();
    }
    let places = (1.0 - std.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{} to {}", decimals(value - 1.96 * std, places), decimals(value + 1.96 * std, places))
}
