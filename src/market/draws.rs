//! A backtest whose execution is drawn: many runs on the same data, each with other parameters of what stands between decision
//! and fill.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::io::{InputError, OutputTable, RandomizedTwin, RunFile, randomized_twin};
use crate::sim2real::Seed;
use crate::sim2real::randomize::{DrawTable, quantiles};

use super::metric::Metrics;
use super::sweep::figures;
use super::{Backtest, EquityPoint, Execution, PreparedRun, Record, Reference, Strategy, market_presets, run_needs};

/// Points of the equity of a draw that are kept.
const POINTS: usize = 500;
/// The parts of all draws below which quantiles are told.
pub(super) const PARTS: [f64; 7] = [0.025, 0.1, 0.25, 0.5, 0.75, 0.9, 0.975];

/// Draws of a run: all that they have in common.
#[derive(Debug)]
pub struct RunDraws {
    /// The backtest of each draw but for its venue.
    backtest: Backtest,
    twin: RandomizedTwin<Execution>,
    /// What was drawn.
    pub drawn: DrawTable,
    lanes: Vec<Vec<f64>>,
    /// Times at which equity is kept [ns since the Unix epoch, UTC].
    pub time: Vec<i64>,
    /// Equity of the run as it is written at these times [currency].
    pub nominal: Vec<f64>,
    /// What came of each draw, in their order.
    pub runs: Vec<DrawnRun>,
}

/// What came of a draw.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnRun {
    /// Its figures, or why it did not come to its end.
    pub outcome: DrawOutcome,
    /// Its equity at the times of [`RunDraws::time`] [currency]; empty where it did not come to its end.
    pub equity: Vec<f64>,
}

/// What a draw came to.
#[derive(Debug, Clone, PartialEq)]
pub enum DrawOutcome {
    /// It ran to its end: its figures, by the names they have in `run.json`.
    Done(BTreeMap<String, f64>),
    /// It could not go on to its end.
    Failed(String),
}

/// What all draws came to, as `run.json` tells it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DrawsSummary {
    /// Number of draws.
    pub draws: usize,
    /// Draws that could not go on to their end.
    pub failed: usize,
    /// Why the first of these could not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// How much was randomized, from 0 to 1.
    pub level: f64,
    /// The parts of all draws below which quantiles are told.
    pub parts: [f64; 7],
    /// What was drawn, by name.
    pub drawn: BTreeMap<String, DrawnParameter>,
    /// Quantiles of each figure, by name.
    pub figures: BTreeMap<String, DrawnFigure>,
    /// What a reader should know.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// What was drawn of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DrawnParameter {
    /// Its unit.
    pub unit: String,
    /// Its value in the run as it is written; none where that is infinite, and does nothing.
    pub nominal: Option<f64>,
    /// Its distribution, by name.
    pub distribution: &'static str,
    /// Quantiles of the draws.
    pub quantiles: Vec<f64>,
}

/// A figure over all draws.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DrawnFigure {
    /// Of the run as it is written; none where it is not defined.
    pub nominal: Option<f64>,
    /// Draws of which it is defined.
    pub count: usize,
    /// Quantiles of the draws.
    pub quantiles: Vec<f64>,
}

impl PreparedRun {
    /// `draws` draws of what stands between decision and fill of `run`, whose record is `record`.
    ///
    /// # Errors
    /// A run that is streamed; nothing to randomize, or what is refused of that; mechanisms that need data there are none of, or that
    /// would change which price all orders meet.
    pub fn draws(&self, run: &RunFile, record: &Record, seed: Seed, draws: usize) -> Result<RunDraws, InputError> {
        if self.streamed.is_some() {
            let error = run.error(&["run", "stream"], "draws run on data in memory, and these are read while a run goes");
            return Err(error.hint("drop `stream = true`, or cut the data with `start` and `end`"));
        }
        let (venue, settings) = (self.backtest.venue(), self.backtest.settings());
        let presets = market_presets();
        let twin = randomized_twin(venue, run.document(), run.randomize.as_ref(), run.posterior.as_ref(), &presets)?;
        twin.check_drawn_once(run.document())?;
        run_needs::check(run, &twin.assembly, self.backtest.instruments(), self.backtest.histories())?;
        if settings.reference.is_none() && Reference::suiting(&twin.assembly) != Reference::suiting(venue) {
            let id = twin.added.iter().find(|id| ["half_spread", "book_walk"].contains(*id)).unwrap_or(&"half_spread");
            let error = run.error(
                &["randomize"],
                format!("with `{id}` orders meet the mid, and in the run as it is written the touch"),
            );
            return Err(error.hint(format!("add [[mechanism]] name = \"{id}\" with its nominal value, or price in [run]")));
        }
        let (drawn, lanes) = twin.draw(seed, draws);
        let time = times(&record.equity);
        let nominal = at(&record.equity, &time);
        Ok(RunDraws { backtest: self.backtest.clone(), twin, drawn, lanes, time, nominal, runs: Vec::new() })
    }
}

/// Some of the times of an equity curve, evenly by number, its first and last among them.
fn times(equity: &[EquityPoint]) -> Vec<i64> {
    let count = equity.len();
    let points = POINTS.min(count);
    let mut all: Vec<i64> = (0..points).map(|k| equity[k * (count - 1) / (points - 1).max(1)].time.0).collect();
    all.dedup();
    all
}

/// The equity at each of `time`: that of the last event until then.
fn at(equity: &[EquityPoint], time: &[i64]) -> Vec<f64> {
    let one = |time: &i64| {
        let upto = equity.partition_point(|point| point.time.0 <= *time);
        equity.get(upto.saturating_sub(1)).map_or(f64::NAN, |point| point.equity)
    };
    time.iter().map(one).collect()
}

impl RunDraws {
    /// Number of draws.
    #[must_use]
    pub fn count(&self) -> usize {
        self.lanes.len()
    }

    /// Runs the draw numbered `index`. All draws have the seed of the run: they differ by what was drawn and by nothing else.
    #[must_use]
    pub fn run(&self, index: usize, strategy: &mut dyn Strategy) -> DrawnRun {
        let venue = self.twin.assembly.clone().with_values(&self.lanes[index]);
        let ran = self.backtest.with_venue(venue).run(strategy).map_err(|error| error.to_string());
        let told = ran.and_then(|record| {
            let (metrics, equity) = (Metrics::of(&record), at(&record.equity, &self.time));
            self.backtest.recycle(record);
            Ok((figures(&metrics.map_err(|error| error.to_string())?), equity))
        });
        match told {
            Ok((figures, equity)) => DrawnRun { outcome: DrawOutcome::Done(figures), equity },
            Err(why) => DrawnRun { outcome: DrawOutcome::Failed(why.replace('\n', "; ")), equity: Vec::new() },
        }
    }

    /// The figures of all draws that came to their end.
    pub(super) fn done(&self) -> impl Iterator<Item = &BTreeMap<String, f64>> {
        self.runs.iter().filter_map(|run| match &run.outcome {
            DrawOutcome::Done(figures) => Some(figures),
            DrawOutcome::Failed(_) => None,
        })
    }

    /// What all draws came to, beside the figures of the run as it is written.
    #[must_use]
    pub fn summary(&self, nominal: &Metrics) -> DrawsSummary {
        let nominal = figures(nominal);
        let mut values: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for (name, value) in self.done().flatten() {
            values.entry(name).or_default().push(*value);
        }
        let figure = |(name, values): (&str, Vec<f64>)| {
            let (count, nominal) = (values.len(), nominal.get(name).copied());
            let quantiles = quantiles(&values, &PARTS)?;
            Some((name.to_owned(), DrawnFigure { nominal, count, quantiles }))
        };
        let parameter = |(k, one): (usize, &crate::sim2real::randomize::Randomized)| {
            let parameter = DrawnParameter {
                unit: one.parameter.unit.clone().into_owned(),
                nominal: Some(one.parameter.nominal).filter(|nominal| nominal.is_finite()),
                distribution: one.distribution.name(),
                quantiles: quantiles(self.drawn.row(k), &PARTS)?,
            };
            Some((one.target.to_string(), parameter))
        };
        let why = self.runs.iter().find_map(|run| match &run.outcome {
            DrawOutcome::Failed(why) => Some(why.clone()),
            DrawOutcome::Done(_) => None,
        });
        DrawsSummary {
            draws: self.count(),
            failed: self.runs.len() - self.done().count(),
            why,
            level: self.twin.level.get(),
            parts: PARTS,
            drawn: self.twin.randomizer.randomized().iter().enumerate().filter_map(parameter).collect(),
            figures: values.into_iter().filter_map(figure).collect(),
            notes: self.twin.notes.clone(),
        }
    }

    /// `draws.parquet`: a row a draw with its number, its outcome, what was drawn by name, and its figures by name.
    #[must_use]
    pub fn table(&self) -> OutputTable {
        let failed = |run: &DrawnRun| match &run.outcome {
            DrawOutcome::Done(_) => None,
            DrawOutcome::Failed(why) => Some(why.clone()),
        };
        let word = |run: &DrawnRun| if failed(run).is_none() { "done" } else { "failed" };
        let mut table = OutputTable::new()
            .integers("draw", (0..self.runs.len()).map(|k| k as i64))
            .texts("outcome", self.runs.iter().map(|run| word(run).to_owned()))
            .texts("why", self.runs.iter().map(failed));
        for (k, target) in self.drawn.targets().iter().enumerate() {
            // A limit that is never reached is none.
            let finite = |value: &f64| Some(*value).filter(|value| value.is_finite());
            table = table.floats(&target.to_string(), self.drawn.row(k).iter().take(self.runs.len()).map(finite));
        }
        let mut names: Vec<&String> = self.done().flat_map(BTreeMap::keys).collect();
        names.sort();
        names.dedup();
        for name in names {
            let figure = |run: &DrawnRun| match &run.outcome {
                DrawOutcome::Done(figures) => figures.get(name).copied(),
                DrawOutcome::Failed(_) => None,
            };
            table = table.floats(name, self.runs.iter().map(figure));
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Timestamp;

    #[test]
    fn equity_is_that_of_the_last_event() {
        let point = |time: i64, equity: f64| EquityPoint { time: Timestamp(time), equity };
        let curve: Vec<EquityPoint> = (0..2_000).map(|k| point(10 * k, k as f64)).collect();
        let time = times(&curve);
        assert_eq!((time.len(), time[0], time[POINTS - 1]), (POINTS, 0, 19_990));
        assert!(time.windows(2).all(|w| w[0] < w[1]));
        assert_eq!(at(&curve, &[0, 9, 10, 19, 1_000_000]), [0.0, 0.0, 1.0, 1.0, 1_999.0]);
        assert_eq!(times(&curve[..1]), [0]);
        assert_eq!(times(&[]), Vec::<i64>::new());
    }
}
