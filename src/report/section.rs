//! One part of a page.

use minijinja::{Environment, UndefinedBehavior, Value};

/// A part of a page, with a heading and a place in the page's contents.
///
/// # Contract
/// `render` gives well-formed HTML that fetches nothing, escapes all text that came from input, and is the same for the
/// same section. An empty string means that there is nothing to show: heading and entry are left out as well.
pub trait Section {
    /// Anchor of the section, unique within its page: lower case letters and hyphens.
    fn id(&self) -> &'static str;

    /// Heading.
    fn title(&self) -> &'static str;

    /// The body, without the heading.
    ///
    /// # Errors
    /// If the section's template cannot be rendered.
    fn render(&self) -> Result<String, ReportError>;
}

/// Why a page could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A template asked for something its section does not give, or is malformed.
    #[error(
        "template `{template}` of the report cannot be rendered: {source}\nhint: this is a bug in trueup, not in the input"
    )]
    Template {
        /// File name of the template.
        template: &'static str,
        /// What the template engine says.
        source: minijinja::Error,
    },
}

/// Fills the template `text`; `name` ends in `.html`, which is what turns escaping on.
pub(super) fn fill(name: &'static str, text: &'static str, values: Value) -> Result<String, ReportError> {
    let mut environment = Environment::new();
    // A misspelt name is an error, not a hole in the page.
    environment.set_undefined_behavior(UndefinedBehavior::SemiStrict);
    environment.render_named_str(name, text, values).map_err(|source| ReportError::Template { template: name, source })
}

#[cfg(test)]
mod tests {
    use minijinja::context;

    use super::*;

    #[test]
    fn input_is_escaped_and_a_hole_is_an_error() {
        let html = fill("test.html", "<b>{{ name }}</b>", context! { name => "<script>" }).unwrap();
        assert_eq!(html, "<b>&lt;script&gt;</b>");
        let error = fill("test.html", "{{ nmae }}", context! { name => "x" }).unwrap_err();
        assert!(error.to_string().contains("`test.html`"), "{error}");
    }
}
