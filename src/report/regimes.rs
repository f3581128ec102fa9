//! The page of a series and its regimes, from plain data.

use super::fan::FanTime;
use super::page::Page;
use super::section::ReportError;
use super::sections::{ListingTable, StatesOverTime};
use super::sweep::Listing;

/// What the page of regimes shows. All series have one entry a row.
#[derive(Debug, Clone, PartialEq)]
pub struct RegimesPage {
    /// The first sentence: how many states, and when it changed.
    pub title: String,
    /// What the figures rest on, a paragraph each.
    pub about: Vec<String>,
    /// Of what the series is.
    pub quantity: String,
    /// When the rows were.
    pub time: FanTime,
    /// The series; none where a value was lost.
    pub values: Vec<Option<f64>>,
    /// The state of each row, of the likeliest path.
    pub path: Vec<usize>,
    /// The probability of each state by then, a series a state.
    pub by_then: Vec<Vec<f64>>,
    /// Mean and standard deviation between changes.
    pub segments: Vec<Segment>,
    /// The states.
    pub states: Listing,
    /// The changes.
    pub changes: Listing,
}

/// Rows between two changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Its first row.
    pub start: usize,
    /// The first row after it.
    pub end: usize,
    /// Mean of its values.
    pub mean: f64,
    /// Their standard deviation.
    pub std: f64,
}

impl RegimesPage {
    /// The page as one HTML file.
    ///
    /// # Errors
    /// If a template cannot be rendered.
    pub fn render(&self) -> Result<String, ReportError> {
        let page = Page {
            kind: "Regimes",
            heading: self.title.clone(),
            badge: None,
            sections: vec![
                Box::new(StatesOverTime { page: self }),
                Box::new(ListingTable { id: "states", title: "States", about: &[], listing: &self.states }),
                Box::new(ListingTable { id: "changes", title: "Changes", about: &[], listing: &self.changes }),
            ],
        };
        page.render()
    }
}
