//! A sweep as its report shows it.

use std::collections::BTreeMap;

use toml::Value;

use crate::io::{SweepGoal, SweepSection};
use crate::report::quantity::{UNDEFINED, number as rounded};
use crate::report::{HeatMap, Listing, Scatter, SweepPage};

use super::summary::{head, number, shown};
use super::{SweepSummary, Trial};

/// Cells of a heat map a side at most.
const SIDE: usize = 40;

impl SweepSummary {
    /// The page of `trials`, the runs this is the summary of.
    #[must_use]
    pub fn page(&self, section: &SweepSection, trials: &[Trial]) -> SweepPage {
        SweepPage {
            title: self.headline(),
            about: self.about(),
            best: self.listing(),
            heat: heat(section, trials),
            scatters: section.ranges.iter().filter_map(|range| scatter(section, &range.path, trials)).collect(),
        }
    }

    /// What came of it, in a sentence.
    #[must_use]
    pub fn headline(&self) -> String {
        let Some(best) = self.best.first() else {
            return format!("None of {} runs has the figure {}.", self.runs, self.metric);
        };
        let values: Vec<String> =
            best.trial.values.iter().map(|(path, value)| format!("{path} = {}", shown(value))).collect();
        let median = self.median.map_or_else(|| UNDEFINED.to_owned(), rounded);
        format!(
            "Of {} runs the best {} is {}, with {}; the median is {median}.",
            self.runs,
            self.metric,
            rounded(best.value),
            values.join(", ")
        )
    }

    /// What the figures rest on, line by line.
    #[must_use]
    pub fn about(&self) -> Vec<String> {
        let mut said = vec![format!(
            "{} runs came to their end, {} were refused by the strategy, {} failed.",
            self.done, self.invalid, self.failed
        )];
        said.extend(self.reasons.iter().map(|(why, count)| format!("{count} times: {why}.")));
        said.push(match self.deflated_sharpe {
            Some(part) => format!("The deflated Sharpe ratio of the best is {}: the probability that it is more than the luck of so many runs.", rounded(part)),
            None => format!("The best of {} runs is better than it will be again: it was chosen for it. No deflated Sharpe ratio was computed; try it on data that no run has seen, as trueup walk-forward does.", self.runs),
        });
        said
    }

    /// The best runs as a table.
    #[must_use]
    pub fn listing(&self) -> Listing {
        let mut figures: Vec<&str> = ["sharpe", "total_return", "max_drawdown.depth", "turnover"].to_vec();
        figures.retain(|name| *name != self.metric);
        let heads = std::iter::once(self.metric.clone())
            .chain(self.ranges.iter().map(|path| head(path, &self.ranges)))
            .chain(figures.iter().map(|name| name.trim_end_matches(".depth").to_owned()))
            .chain(["run".to_owned()]);
        let row = |ranked: &super::Ranked| {
            let values = self.ranges.iter().map(|path| ranked.trial.values.get(path).map(shown));
            let figures = figures.iter().map(|name| ranked.trial.outcome.figure(name).map(rounded));
            let all = std::iter::once(Some(rounded(ranked.value))).chain(values).chain(figures);
            all.chain([Some(ranked.trial.index.to_string())])
                .map(|cell| cell.unwrap_or_else(|| UNDEFINED.to_owned()))
                .collect()
        };
        Listing { heads: heads.collect(), rows: self.best.iter().map(row).collect() }
    }
}

/// The metric over the first two ranges of numbers: of runs that share both values the best.
fn heat(section: &SweepSection, trials: &[Trial]) -> Option<HeatMap> {
    let axis = |path: &str| -> Option<Vec<f64>> {
        let mut values: Vec<f64> = trials.iter().filter_map(|trial| number(trial.values.get(path)?)).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        (2..=SIDE).contains(&values.len()).then_some(values)
    };
    let mut axes = section.ranges.iter().filter_map(|range| Some((range.path.clone(), axis(&range.path)?)));
    let ((down, rows), (across, columns)) = (axes.next()?, axes.next()?);
    let mut cells: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for trial in trials {
        let at = |path: &str, all: &[f64]| {
            let value = number(trial.values.get(path)?)?;
            all.iter().position(|other| *other == value)
        };
        let (Some(row), Some(column)) = (at(&down, &rows), at(&across, &columns)) else { continue };
        let Some(value) = trial.outcome.figure(&section.metric) else { continue };
        let best = |old: f64| if (section.goal == SweepGoal::Max) == (value > old) { value } else { old };
        cells.entry((row, column)).and_modify(|old| *old = best(*old)).or_insert(value);
    }
    let row = |k: usize| (0..columns.len()).map(|j| cells.get(&(k, j)).copied()).collect();
    Some(HeatMap {
        down,
        across,
        metric: section.metric.clone(),
        larger_is_better: section.goal == SweepGoal::Max,
        rows: rows.iter().map(|value| shown(&Value::Float(*value))).collect(),
        columns: columns.iter().map(|value| shown(&Value::Float(*value))).collect(),
        cells: (0..rows.len()).map(row).collect(),
    })
}

/// The metric over one range of numbers.
fn scatter(section: &SweepSection, path: &str, trials: &[Trial]) -> Option<Scatter> {
    let point = |trial: &Trial| Some((number(trial.values.get(path)?)?, trial.outcome.figure(&section.metric)?));
    let points: Vec<(f64, f64)> = trials.iter().filter_map(point).collect();
    let differ = points.windows(2).any(|pair| pair[0].0 != pair[1].0);
    differ.then(|| Scatter { path: path.to_owned(), metric: section.metric.clone(), points })
}
