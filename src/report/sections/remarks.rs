//! What a reader should know, a line each.

use minijinja::context;

use crate::report::section::{ReportError, Section, fill};

pub(in crate::report) struct Remarks<'a> {
    pub remarks: &'a [String],
}

impl Section for Remarks<'_> {
    fn id(&self) -> &'static str {
        "notes"
    }

    fn title(&self) -> &'static str {
        "Notes"
    }

    fn render(&self) -> Result<String, ReportError> {
        if self.remarks.is_empty() {
            return Ok(String::new());
        }
        fill("remarks.html", include_str!("../templates/remarks.html"), context! { remarks => self.remarks.to_vec() })
    }
}
