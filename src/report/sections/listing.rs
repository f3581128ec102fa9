//! A table of texts below what it rests on.

use minijinja::{Value, context};

use crate::report::section::{ReportError, Section, fill};
use crate::report::sweep::Listing;

pub(in crate::report) struct ListingTable<'a> {
    pub id: &'static str,
    pub title: &'static str,
    pub about: &'a [String],
    pub listing: &'a Listing,
}

impl Section for ListingTable<'_> {
    fn id(&self) -> &'static str {
        self.id
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn render(&self) -> Result<String, ReportError> {
        let numbers = self.listing.numbers();
        let class = |k: usize| if numbers.get(k).copied().unwrap_or(false) { "n" } else { "nowrap" };
        let cells = |row: &Vec<String>| -> Vec<Value> {
            row.iter().enumerate().map(|(k, text)| context! { text => text, class => class(k) }).collect()
        };
        fill(
            "listing.html",
            include_str!("../templates/listing.html"),
            context! {
                about => self.about.to_vec(),
                title => self.title,
                heads => cells(&self.listing.heads),
                rows => self.listing.rows.iter().map(cells).collect::<Vec<_>>(),
            },
        )
    }
}
