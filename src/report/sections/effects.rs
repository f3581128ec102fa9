//! What was found, its parameters and its rivals.

use minijinja::{Value, context};

use crate::report::quantity::{percent, uncertain, with_unit};
use crate::report::section::{ReportError, Section, fill};
use crate::sim2real::diagnose::{Diagnosis, Effect};

pub(in crate::report) struct Effects<'a> {
    pub diagnosis: &'a Diagnosis,
}

impl Section for Effects<'_> {
    fn id(&self) -> &'static str {
        "effects"
    }

    fn title(&self) -> &'static str {
        "What was found"
    }

    fn render(&self) -> Result<String, ReportError> {
        let rows: Vec<Value> = self.diagnosis.effects.iter().map(row).collect();
        if rows.is_empty() {
            return Ok(String::new());
        }
        let modelled = self.diagnosis.modelled.clone();
        fill("effects.html", include_str!("../templates/effects.html"), context! { rows => rows, modelled => modelled })
    }
}

fn row(effect: &Effect) -> Value {
    let parameters: Vec<Value> = effect
        .parameters
        .iter()
        .map(|(name, e)| context! { name => name, value => with_unit(&uncertain(e.value, e.std), &e.unit) })
        .collect();
    let rivals: Vec<String> = effect.rivals.iter().map(|r| format!("{} ({})", r.mechanism, percent(r.confidence))).collect();
    context! {
        name => &effect.mechanism,
        site => effect.site.to_string(),
        confidence => percent(effect.confidence),
        parameters => parameters,
        rivals => if rivals.is_empty() { "none".to_string() } else { rivals.join(", ") },
        location => effect.location.as_deref().unwrap_or("–"),
    }
}
