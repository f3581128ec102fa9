//! The page of a backtest, from plain data.

use super::fan::Fan;
use super::page::Page;
use super::section::{ReportError, Section};
use super::sections::{
    AllFigures, Assumptions, Costs, Drawdowns, Equity, ExposurePlot, Fans, Fills, Inputs, ListingTable, Metrics, Months,
    RoundTrips,
};
use super::sweep::Listing;

/// What the page of a backtest shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BacktestPage {
    /// The first sentence: what was traded, when, and how it went.
    pub title: String,
    /// Currency of all amounts ("USD").
    pub currency: String,
    /// Key figures, most important first.
    pub metrics: Vec<Metric>,
    /// All figures, by what they are about.
    pub figures: Vec<FigureGroup>,
    /// Times of the equity series [ns since the Unix epoch, UTC], increasing.
    pub time: Vec<i64>,
    /// Equity at each of `time` [currency].
    pub equity: Vec<f64>,
    /// The same with all fills so far at the best price of their times, and at the worst; none without a fill.
    pub bands: Option<[Vec<f64>; 2]>,
    /// Returns month by month, in order of time; the page shows those of more than one month.
    pub months: Vec<MonthReturn>,
    /// The zone months are counted in, by its IANA name.
    pub zone: String,
    /// The deepest falls from a high, the deepest first.
    pub drawdowns: Vec<Fall>,
    /// Round trips in the order in which they were entered; the page lists the first, the last and the largest.
    pub trades: Vec<Trade>,
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
    /// What randomized executions of it came to; none of a run alone.
    pub draws: Option<DrawsPart>,
}

/// What randomized executions of a run came to.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawsPart {
    /// What was drawn, and what the figures rest on, a paragraph each.
    pub about: Vec<String>,
    /// Equity over time.
    pub fan: Fan,
    /// Quantiles of the figures.
    pub figures: Listing,
    /// Quantiles of what was drawn.
    pub parameters: Listing,
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

/// Figures about one thing.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureGroup {
    /// What they are about: "Return", "Risk".
    pub title: String,
    /// The figures.
    pub figures: Vec<Metric>,
}

/// The return of a month.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MonthReturn {
    /// Year.
    pub year: i32,
    /// Month of the year, from 1.
    pub month: u32,
    /// Return (a fraction); none where it is not defined.
    pub growth: Option<f64>,
}

/// A fall of equity from a high.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fall {
    /// Part of the high that was lost.
    pub depth: f64,
    /// When the high was reached last [ns since the Unix epoch, UTC].
    pub peak_at: i64,
    /// When it was deepest [ns since the Unix epoch, UTC].
    pub trough_at: i64,
    /// When the high was reached again [ns since the Unix epoch, UTC]; none where it was not.
    pub recovered_at: Option<i64>,
    /// From the high to the recovery, or else to the end [s].
    pub seconds: f64,
}

/// A round trip, from flat to flat.
#[derive(Debug, Clone, PartialEq)]
pub struct Trade {
    /// Instrument.
    pub symbol: String,
    /// `long` or `short`.
    pub side: String,
    /// First fill [ns since the Unix epoch, UTC].
    pub entered_at: i64,
    /// Last fill [ns since the Unix epoch, UTC]; none where something is still held.
    pub exited_at: Option<i64>,
    /// From the first fill to the last, or to the end [s].
    pub seconds: f64,
    /// All that was entered [units of the instrument].
    pub quantity: f64,
    /// Average price it was entered at [currency].
    pub entry_price: f64,
    /// Average price it was left at [currency]; none where nothing was.
    pub exit_price: Option<f64>,
    /// Fees [currency].
    pub fees: f64,
    /// Gain after fees [currency]; of what is still held, at its last price.
    pub net: f64,
    /// The same over the value entered (a fraction); none where it is not defined.
    pub growth: Option<f64>,
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
        let mut page = Page {
            kind: "Backtest",
            heading: self.title.clone(),
            badge: None,
            sections: vec![
                Box::new(Metrics { page: self }),
                Box::new(Equity { page: self }),
                Box::new(Months { page: self }),
                Box::new(Drawdowns { page: self }),
                Box::new(AllFigures { page: self }),
                Box::new(RoundTrips { page: self }),
                Box::new(ExposurePlot { page: self }),
                Box::new(Costs { page: self }),
                Box::new(Assumptions { page: self }),
                Box::new(Fills { page: self }),
                Box::new(Inputs { page: self }),
            ],
        };
        if let Some(draws) = &self.draws {
            let fan = std::slice::from_ref(&draws.fan);
            let listing = |id, title, listing| Box::new(ListingTable { id, title, about: &[], listing });
            // After the equity of the run as it is written.
            page.sections.splice(
                2..2,
                [
                    Box::new(Fans { title: "Randomized execution", about: &draws.about, fans: fan }) as Box<dyn Section>,
                    listing("draw-figures", "Figures over all draws", &draws.figures),
                    listing("drawn", "What was drawn", &draws.parameters),
                ],
            );
        }
        page.render()
    }
}
