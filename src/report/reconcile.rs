//! The page of a reconciliation, from plain data.

use super::page::{Badge, Page};
use super::section::{ReportError, Section};
use super::sections::{GapCauses, GapCurve, ListingTable, Remarks};
use super::sweep::Listing;

/// What the page of a reconciliation shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReconcilePage {
    /// The first sentences: whether the two agree, and what made the gap.
    pub title: String,
    /// Whether they are within bounds.
    pub badge: Option<Badge>,
    /// Currency of amounts, where one is known.
    pub currency: String,
    /// What made the gap, in the order in which it comes about.
    pub causes: Vec<GapCause>,
    /// Times of the orders [ns since the Unix epoch, UTC], increasing.
    pub time: Vec<i64>,
    /// The gap of all orders up to each of them [currency].
    pub gap: Vec<f64>,
    /// Tables, in order; empty ones are left out.
    pub tables: Vec<ReconcileTable>,
    /// What a reader should know.
    pub notes: Vec<String>,
}

/// What one cause made of the gap.
#[derive(Debug, Clone, PartialEq)]
pub struct GapCause {
    /// What it is called.
    pub name: String,
    /// What it is.
    pub words: String,
    /// How much it made [currency].
    pub amount: f64,
    /// 95 % interval of that.
    pub interval: Option<[f64; 2]>,
    /// Orders it is of.
    pub orders: usize,
}

/// A table with its title.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReconcileTable {
    /// Its anchor, unique on the page.
    pub id: &'static str,
    /// Its title.
    pub title: &'static str,
    /// Its rows.
    pub listing: Listing,
}

impl ReconcilePage {
    /// The page as one HTML file.
    ///
    /// # Errors
    /// If a template cannot be rendered.
    pub fn render(&self) -> Result<String, ReportError> {
        let mut sections: Vec<Box<dyn Section + '_>> =
            vec![Box::new(GapCauses { page: self }), Box::new(GapCurve { page: self })];
        for table in self.tables.iter().filter(|table| !table.listing.rows.is_empty()) {
            sections.push(Box::new(ListingTable { id: table.id, title: table.title, about: &[], listing: &table.listing }));
        }
        sections.push(Box::new(Remarks { remarks: &self.notes }));
        let page = Page { kind: "Reconciliation", heading: self.title.clone(), badge: self.badge.clone(), sections };
        page.render()
    }
}
