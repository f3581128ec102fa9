//! The page of a backtest, from plain data.

use super::page::Page;
use super::section::ReportError;
use super::sections::{Assumptions, Costs, Equity, ExposurePlot, Fills, Inputs, Metrics};

/// What the page of a backtest shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BacktestPage {
    /// The first sentence: what was traded, when, and how it went.
    pub title: String,
    /// Currency of all amounts ("USD").
    pub currency: String,
    /// Key figures, most important first.
    pub metrics: Vec<Metric>,
    /// Times of the equity series [ns since the Unix epoch, UTC], increasing.
    pub time: Vec<i64>,
    /// Equity at each of `time` [currency].
    pub equity: Vec<f64>,
    /// Positions or exposures at each of `time`.
    pub exposures: Vec<Exposure>,
    /// Fills in order of time; the page lists the first 200.
    pub fills: Vec<Fill>,
    /// How many fills there were, of which `fills` may be the first only.
    pub fill_count: usize,
    /// What trading cost, by kind.
    pub costs: Vec<Cost>,
    /// The mechanisms between decision and fill, and other assumptions.
    pub in_force: Vec<InForce>,
    /// What the run was made from.
    pub inputs: Vec<Input>,
}

/// A key figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Metric {
    /// Name.
    pub name: String,
    /// The value as text, with its unit; none where it is not defined.
    pub value: Option<String>,
    /// What it is and how it was computed, in a sentence.
    pub help: String,
}

/// What was held over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Exposure {
    /// Of what: a symbol, "gross", "net".
    pub name: String,
    /// Unit of the values ("shares", "USD"); one plot for each unit.
    pub unit: String,
    /// The values, one for each of [`BacktestPage::time`].
    pub values: Vec<f64>,
}

/// A fill.
#[derive(Debug, Clone, PartialEq)]
pub struct Fill {
    /// When [ns since the Unix epoch, UTC].
    pub time: i64,
    /// Instrument.
    pub symbol: String,
    /// `buy` or `sell`.
    pub side: String,
    /// Quantity [units of the instrument].
    pub quantity: f64,
    /// Price [currency].
    pub price: f64,
    /// Fee [currency].
    pub fee: f64,
}

/// A kind of cost.
#[derive(Debug, Clone, PartialEq)]
pub struct Cost {
    /// Of what kind: a mechanism's id, or "commission".
    pub kind: String,
    /// Amount over the whole run [currency]; positive where it was paid.
    pub amount: f64,
    /// The same relative to the value traded [basis points]; none where nothing was traded.
    pub bps: Option<f64>,
}

/// A mechanism or an assumption in force.
#[derive(Debug, Clone, PartialEq)]
pub struct InForce {
    /// The mechanism's id, or a name for the assumption.
    pub name: String,
    /// Its parameters, or what is assumed.
    pub setting: String,
}

/// A file the run read.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Its name, as the run gives it.
    pub name: String,
    /// Rows read; none where it is no table.
    pub rows: Option<usize>,
    /// SHA-256 of its bytes, in hexadecimal digits.
    pub sha256: String,
}

impl BacktestPage {
    /// The report as one HTML file.
    ///
    /// # Errors
    /// If a template cannot be rendered.
    pub fn render(&self) -> Result<String, ReportError> {
        let page = Page {
            kind: "Backtest",
            heading: self.title.clone(),
            badge: None,
            sections: vec![
                Box::new(Metrics { page: self }),
                Box::new(Equity { page: self }),
                Box::new(ExposurePlot { page: self }),
                Box::new(Costs { page: self }),
                Box::new(Assumptions { page: self }),
                Box::new(Fills { page: self }),
                Box::new(Inputs { page: self }),
            ],
        };
        page.render()
    }
}
