//! The page of a rollout, from plain data.

use super::fan::Fan;
use super::page::{Badge, Page};
use super::section::ReportError;
use super::sections::{Fans, ListingTable, Remarks};
use super::sweep::Listing;

/// What the page of a rollout shows.
#[derive(Debug, Clone, PartialEq)]
pub struct RolloutPage {
    /// The first sentence: whether the draws cover the recordings.
    pub title: String,
    /// The same in a word.
    pub badge: Badge,
    /// What was drawn, and what the figures rest on, a paragraph each.
    pub about: Vec<String>,
    /// A channel of a recording each.
    pub fans: Vec<Fan>,
    /// How much of each the draws cover.
    pub coverage: Listing,
    /// Quantiles of what was drawn.
    pub parameters: Listing,
    /// What a reader should know.
    pub notes: Vec<String>,
}

impl RolloutPage {
    /// The page as one HTML file.
    ///
    /// # Errors
    /// If a template cannot be rendered.
    pub fn render(&self) -> Result<String, ReportError> {
        let page = Page {
            kind: "Rollout",
            heading: self.title.clone(),
            badge: Some(self.badge.clone()),
            sections: vec![
                Box::new(Fans { title: "Draws over time", about: &self.about, fans: &self.fans }),
                Box::new(ListingTable {
                    id: "coverage",
                    title: "Samples within each band",
                    about: &[],
                    listing: &self.coverage,
                }),
                Box::new(ListingTable { id: "drawn", title: "What was drawn", about: &[], listing: &self.parameters }),
                Box::new(Remarks { remarks: &self.notes }),
            ],
        };
        page.render()
    }
}
