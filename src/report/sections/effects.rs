//! What was found, where it acted, and its rivals.

use minijinja::{Value, context};

use crate::report::quantity::{UNDEFINED, confidence, number, percent, with_unit};
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
    let rivals: Vec<String> = effect.rivals.iter().map(|r| format!("{} ({})", r.mechanism, percent(r.confidence))).collect();
    let moved: Vec<String> =
        effect.moved.iter().map(|m| format!("{} by {}", m.channel, with_unit(&number(m.rms), &m.unit))).collect();
    context! {
        name => &effect.mechanism,
        site => effect.site.to_string(),
        confidence => confidence(effect.confidence),
        rivals => if rivals.is_empty() { "none".to_string() } else { rivals.join(", ") },
        location => effect.location.as_deref().unwrap_or(UNDEFINED),
        moved => if moved.is_empty() { UNDEFINED.to_string() } else { moved.join(", ") },
    }
}
