//! The shell of a page: head, styles, heading, contents, sections.

use minijinja::{Value, context};

use super::section::{ReportError, Section, fill};

/// A page before it is rendered.
pub struct Page<'a> {
    /// What the page is, in a word or two: for the title bar.
    pub kind: &'static str,
    /// The first sentence.
    pub heading: String,
    /// The answer in one word, beside the kind.
    pub badge: Option<Badge>,
    /// The sections, in order.
    pub sections: Vec<Box<dyn Section + 'a>>,
}

/// A word that sums up the page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Badge {
    /// The word.
    pub text: String,
    /// How to take it.
    pub tone: Tone,
}

/// How to take a badge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// Settled.
    Good,
    /// Settled in part.
    Unsure,
    /// Open.
    Bad,
}

impl Tone {
    pub(super) fn class(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Unsure => "unsure",
            Self::Bad => "bad",
        }
    }
}

impl Page<'_> {
    /// The page as one HTML file.
    ///
    /// # Errors
    /// If the template of the page or of one of its sections cannot be rendered.
    pub fn render(&self) -> Result<String, ReportError> {
        let mut sections = Vec::new();
        for section in &self.sections {
            let body = section.render()?;
            if !body.is_empty() {
                let body = Value::from_safe_string(body);
                sections.push(context! { id => section.id(), title => section.title(), body => body });
            }
        }
        let badge = self.badge.as_ref().map(|b| context! { text => &b.text, tone => b.tone.class() });
        fill(
            "page.html",
            include_str!("templates/page.html"),
            context! {
                kind => self.kind,
                // A number does not part from its percent sign.
                heading => self.heading.replace(" %", "\u{a0}%"),
                badge => badge.unwrap_or(Value::from(())),
                style => Value::from_safe_string(include_str!("templates/page.css").into()),
                sections => sections,
            },
        )
    }
}
