//! The pages of a sweep and of a walk-forward, from plain data.

use super::backtest::BacktestPage;
use super::page::Page;
use super::section::ReportError;
use super::sections::{Equity, HeatMapTable, ListingTable, Scatters};

/// What the page of a sweep shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepPage {
    /// The first sentence: which values are the best.
    pub title: String,
    /// What the figures rest on, in a paragraph each.
    pub about: Vec<String>,
    /// The best runs.
    pub best: Listing,
    /// The metric over two of the ranges.
    pub heat: Option<HeatMap>,
    /// The metric over each of the ranges.
    pub scatters: Vec<Scatter>,
}

/// What the page of a walk-forward shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WalkForwardPage {
    /// The first sentence: what came of it on data no choice has seen.
    pub title: String,
    /// What the figures rest on, in a paragraph each.
    pub about: Vec<String>,
    /// Currency of all amounts ("USD").
    pub currency: String,
    /// Times of the equity series [ns since the Unix epoch, UTC], increasing.
    pub time: Vec<i64>,
    /// Equity at each of `time`, out of sample [currency].
    pub equity: Vec<f64>,
    /// The windows.
    pub windows: Listing,
}

/// A table of texts; columns of numbers are aligned right.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Listing {
    /// Heads of its columns.
    pub heads: Vec<String>,
    /// Its rows, with a cell for each head.
    pub rows: Vec<Vec<String>>,
}

/// A figure over two ranges.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeatMap {
    /// What rows are values of.
    pub down: String,
    /// What columns are values of.
    pub across: String,
    /// The figure.
    pub metric: String,
    /// Which end of it is the good one.
    pub larger_is_better: bool,
    /// Values of the rows.
    pub rows: Vec<String>,
    /// Values of the columns.
    pub columns: Vec<String>,
    /// The figure, row by row; none where there is none.
    pub cells: Vec<Vec<Option<f64>>>,
}

/// A figure over one range.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scatter {
    /// The range.
    pub path: String,
    /// The figure.
    pub metric: String,
    /// Value and figure, one pair a run.
    pub points: Vec<(f64, f64)>,
}

impl Listing {
    /// Which columns hold nothing but numbers.
    #[must_use]
    pub fn numbers(&self) -> Vec<bool> {
        let signs = "+-\u{2212}\u{2013}\u{221e}";
        // Of what is "< 0.1 %" the number counts.
        let number = |cell: &String| {
            cell.trim_start_matches(['<', '>', ' ']).starts_with(|c: char| c.is_ascii_digit() || signs.contains(c))
        };
        (0..self.heads.len()).map(|k| self.rows.iter().filter_map(|row| row.get(k)).all(number)).collect()
    }
}

impl SweepPage {
    /// The page as one HTML file.
    ///
    /// # Errors
    /// If a template cannot be rendered.
    pub fn render(&self) -> Result<String, ReportError> {
        let page = Page {
            kind: "Sweep",
            heading: self.title.clone(),
            badge: None,
            sections: vec![
                Box::new(ListingTable { id: "listing", title: "The best runs", about: &self.about, listing: &self.best }),
                Box::new(HeatMapTable { heat: self.heat.as_ref() }),
                Box::new(Scatters { scatters: &self.scatters }),
            ],
        };
        page.render()
    }
}

impl WalkForwardPage {
    /// The page as one HTML file.
    ///
    /// # Errors
    /// If a template cannot be rendered.
    pub fn render(&self) -> Result<String, ReportError> {
        let out_of_sample = BacktestPage {
            currency: self.currency.clone(),
            time: self.time.clone(),
            equity: self.equity.clone(),
            ..BacktestPage::default()
        };
        let page = Page {
            kind: "Walk-forward",
            heading: self.title.clone(),
            badge: None,
            sections: vec![
                Box::new(ListingTable { id: "listing", title: "Windows", about: &self.about, listing: &self.windows }),
                Box::new(Equity { page: &out_of_sample }),
            ],
        };
        page.render()
    }
}
