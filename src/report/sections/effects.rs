//! What was found, its parameters and its rivals; and where model and recording part.

use minijinja::{Value, context};

use crate::report::quantity::{percent, significant, uncertain, with_unit};
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
        let location = &self.diagnosis.location;
        let rows: Vec<Value> = self.diagnosis.effects.iter().map(row).collect();
        let intervals: Vec<Value> = location
            .intervals
            .iter()
            .map(|i| {
                context! {
                    recording => &i.recording,
                    channel => &i.channel,
                    start => with_unit(&significant(i.start, 4), "s"),
                    end => with_unit(&significant(i.end, 4), "s"),
                    share => percent(i.share_of_error),
                }
            })
            .collect();
        if rows.is_empty() && intervals.is_empty() && location.onset.is_none() {
            return Ok(String::new());
        }
        fill(
            "effects.html",
            include_str!("../templates/effects.html"),
            context! {
                rows => rows,
                intervals => intervals,
                onset => location.onset.map(|t| with_unit(&significant(t, 4), "s")),
                modelled => self.diagnosis.modelled.clone(),
            },
        )
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
