//! Draws of a run as its report and the terminal show them.

use crate::report::quantity::{UNDEFINED, fine, number};
use crate::report::{BacktestPage, DrawsPart, Fan, FanBand, FanTime, Listing};
use crate::sim2real::randomize::{BANDS, quantiles};

use super::draws::{DrawsSummary, PARTS, RunDraws};

/// Figures that are told first; all are in `run.json`.
const FIGURES: [&str; 12] = [
    "final_equity",
    "total_return",
    "cagr",
    "sharpe",
    "sortino",
    "annualised_volatility",
    "max_drawdown.depth",
    "turnover",
    "hit_rate",
    "costs.shortfall",
    "costs.shortfall_bps",
    "costs.fees",
];

/// Which of the quantiles tables have: all are in `run.json`.
const TOLD: [usize; 5] = [0, 2, 3, 4, 6];

/// The parts of all draws in heads of tables.
fn heads() -> impl Iterator<Item = String> {
    TOLD.iter().map(|k| match PARTS[*k] {
        0.5 => "median".to_owned(),
        part => format!("{} %", 100.0 * part),
    })
}

/// The quantiles that tables have.
fn cells(quantiles: &[f64]) -> impl Iterator<Item = String> {
    TOLD.iter().filter_map(|k| quantiles.get(*k)).map(|value| number(*value))
}

impl DrawsSummary {
    /// Quantiles of the figures, one a row, beside the run as it is written.
    #[must_use]
    pub fn figures_listing(&self) -> Listing {
        let row = |name: &&str| {
            let figure = self.figures.get(*name)?;
            let nominal = figure.nominal.map_or_else(|| UNDEFINED.to_owned(), number);
            Some([(*name).to_owned(), nominal].into_iter().chain(cells(&figure.quantiles)).collect())
        };
        let heads = ["figure".to_owned(), "nominal".to_owned()].into_iter().chain(heads()).collect();
        Listing { heads, rows: FIGURES.iter().filter_map(row).collect() }
    }

    /// Quantiles of what was drawn, one a row.
    #[must_use]
    pub fn parameters_listing(&self) -> Listing {
        let rows = self.drawn.iter().map(|(name, drawn)| {
            let nominal = drawn.nominal.map_or_else(|| "\u{221e}".to_owned(), number);
            let head = [name.clone(), drawn.unit.clone(), drawn.distribution.to_owned(), nominal];
            head.into_iter().chain(cells(&drawn.quantiles)).collect()
        });
        let heads = ["parameter", "unit", "distribution", "nominal"].map(str::to_owned).into_iter().chain(heads());
        Listing { heads: heads.collect(), rows: rows.collect() }
    }

    /// What the figures rest on, line by line.
    #[must_use]
    pub fn about(&self) -> Vec<String> {
        let level = if self.level < 1.0 { format!(" at level {}", number(self.level)) } else { String::new() };
        let mut said = vec![format!(
            "{} draws of what stands between decision and fill{level}; data, strategy and seed are the same in all of them.",
            self.draws
        )];
        if self.failed > 0 {
            let why = self.why.as_deref().unwrap_or_default();
            said.push(format!("{} of them could not go on to their end and are not counted: {why}", self.failed));
        }
        let gained = self.figures.get("total_return");
        if let Some((gained, nominal)) = gained.and_then(|figure| Some((figure, figure.nominal?))) {
            let [least, .., most] = gained.quantiles.as_slice() else { return said };
            said.push(format!(
                "95 % of all draws return between {} and {}; the run as it is written returns {}.",
                fine(*least),
                fine(*most),
                fine(nominal)
            ));
        }
        said.extend(self.notes.iter().map(|note| format!("{note}.")));
        said
    }
}

impl RunDraws {
    /// What the page of the run, `page`, shows of them.
    pub(super) fn page(&self, summary: &DrawsSummary, page: &BacktestPage) -> DrawsPart {
        let done: Vec<&Vec<f64>> = self.runs.iter().map(|run| &run.equity).filter(|equity| !equity.is_empty()).collect();
        let tails: Vec<f64> = BANDS.iter().flat_map(|band| [0.5 - 0.5 * band, 0.5 + 0.5 * band]).chain([0.5]).collect();
        let rows: Vec<Vec<f64>> = (0..self.time.len())
            .filter_map(|k| quantiles(&done.iter().map(|equity| equity[k]).collect::<Vec<_>>(), &tails))
            .collect();
        let curve = |k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
        let bands = BANDS.iter().enumerate();
        DrawsPart {
            about: summary.about(),
            fan: Fan {
                caption: format!("Equity of {} draws, and of the run as it is written", done.len()),
                quantity: ("equity".to_owned(), page.currency.clone()),
                time: FanTime::Date(self.time.iter().copied().take(rows.len()).collect()),
                median: curve(2 * BANDS.len()),
                bands: bands.map(|(k, part)| FanBand { part: *part, low: curve(2 * k), high: curve(2 * k + 1) }).collect(),
                nominal: self.nominal.clone(),
                measured: None,
            },
            figures: summary.figures_listing(),
            parameters: summary.parameters_listing(),
        }
    }
}
