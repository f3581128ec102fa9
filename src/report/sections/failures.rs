//! The worst answers of a blind benchmark.

use minijinja::{Value, context};

use crate::report::proof::ProofPage;
use crate::report::section::{ReportError, Section, fill};

pub(in crate::report) struct Failures<'a> {
    pub page: &'a ProofPage,
}

impl Section for Failures<'_> {
    fn id(&self) -> &'static str {
        "failures"
    }

    fn title(&self) -> &'static str {
        "The worst answers"
    }

    fn render(&self) -> Result<String, ReportError> {
        let rows: Vec<Value> = self
            .page
            .failures
            .iter()
            .map(|failure| {
                context! {
                    index => failure.index,
                    truth => &failure.truth,
                    said => &failure.said,
                    circumstances => &failure.circumstances,
                    errors => failure.errors.to_vec(),
                }
            })
            .collect();
        if rows.is_empty() {
            return Ok(String::new());
        }
        fill("failures.html", include_str!("../templates/failures.html"), context! { rows => rows })
    }
}
