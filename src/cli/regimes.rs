//! `trueup regimes`: the states of a series, and when it changed.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::Serialize;

use crate::io::{InputError, OutputFolder, Overwrite, Table, TimeFormat, listed};
use crate::sim2real::regime::{
    Assumed, Cost, Cusum, CusumSettings, Degrees, Division, Family, Filter, Fit, Observations, Penalty, Prior, RegimeError,
    RunLengths, Settings, fit, fit_states,
};
use crate::sim2real::{Seed, Timestamp};

use super::regimes_output::{by_row, page, told};
use super::screen::{Screen, written};
use super::stop::{Outcome, Stop};

/// Most states that `--states auto` tries.
const MOST_STATES: usize = 5;

/// Rows between changes that `--changes bocpd` expects, and between false alarms of `--changes cusum`.
const INTERVAL: f64 = 1_000.0;

/// Columns that hold times, by name.
const TIMES: [&str; 2] = ["t", "ts"];

/// Find the regimes of a series: states that come back, and rows at which it changed
///
/// States are those of a hidden Markov model, the calmest first, fitted to the whole series. What a state is told by its
/// probability "now" uses no later row than the last. Without --out nothing is written.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup regimes bars.parquet --returns
  trueup regimes log.csv --column residual --states 2 --changes cusum --json")]
pub(super) struct Regimes {
    /// CSV, Parquet or Arrow file; times are in a column `t` [s] or `ts`, where there is one
    file: PathBuf,
    /// Column of the series [default: `close`, or the only one that is not of times]
    #[arg(long, value_name = "NAME")]
    column: Option<String>,
    /// Take logarithms of prices, and of these the differences from row to row
    #[arg(long)]
    returns: bool,
    /// Number of states, or `auto`: from 1 to 5, by the least BIC
    #[arg(long, value_name = "K", default_value = "auto", value_parser = states)]
    states: States,
    /// What is observed while a state lasts
    #[arg(long, value_enum, default_value = "gaussian")]
    model: Model,
    /// How changes are looked for: over the whole series, or row by row
    #[arg(long, value_enum, default_value = "pelt")]
    changes: Changes,
    /// Folder to write into: regimes.json, model.toml, report.html and states.parquet, a row for each of the series
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write over files that exist
    #[arg(long)]
    force: bool,
    /// Print JSON (schema trueup.regimes/1) instead of tables
    #[arg(long)]
    json: bool,
    /// Seed of what is drawn: where fits begin
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
enum Model {
    /// Gaussian
    Gaussian,
    /// Student's t, its degrees of freedom fitted: for series with far outliers
    StudentT,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[value(rename_all = "snake_case")]
#[serde(rename_all = "snake_case")]
pub(super) enum Changes {
    /// The best division of the whole series by mean and variance, exactly
    Pelt,
    /// Bayesian run lengths, a change expected every 1000 rows
    Bocpd,
    /// Cumulative sums against mean and deviation of the first tenth, a false alarm every 1000 rows
    Cusum,
}

/// How many states there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum States {
    Auto,
    Given(usize),
}

fn states(text: &str) -> Result<States, String> {
    match text.parse() {
        _ if text == "auto" => Ok(States::Auto),
        Ok(states @ 1..=50) => Ok(States::Given(states)),
        _ => Err("expected `auto` or a whole number from 1 to 50".into()),
    }
}

#[derive(Serialize)]
pub(super) struct Listing<'a> {
    pub schema: &'static str,
    pub column: &'a str,
    pub returns: bool,
    pub rows: usize,
    pub observed: usize,
    pub log_likelihood: f64,
    pub bic: f64,
    pub converged: bool,
    pub iterations: usize,
    pub states: Vec<StateRow>,
    pub tried: Vec<TriedRow>,
    pub method: Changes,
    pub changes: Vec<ChangeRow>,
}

#[derive(Serialize)]
pub(super) struct StateRow {
    pub mean: f64,
    pub std: Option<f64>,
    pub degrees: Option<f64>,
    pub share: f64,
    /// None of a state that is never left.
    pub expected_rows: Option<f64>,
    pub now: f64,
    pub collapsed: bool,
}

#[derive(Serialize)]
pub(super) struct TriedRow {
    pub states: usize,
    pub log_likelihood: f64,
    pub bic: f64,
}

#[derive(Serialize)]
pub(super) struct ChangeRow {
    pub row: usize,
    pub time: Option<String>,
    pub mean: f64,
    pub std: f64,
}

/// The series, and what its rows are called.
pub(super) struct Series {
    pub column: String,
    pub values: Vec<f64>,
    /// Data row of the file of the first value.
    pub first: usize,
    pub times: Times,
}

pub(super) enum Times {
    Instants(Vec<Timestamp>),
    Seconds(Vec<f64>),
    None,
}

impl Regimes {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let series = self.series()?;
        let mut folder = match &self.out {
            Some(path) => {
                let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
                let folder = OutputFolder::create(path, overwrite)?;
                folder.check_free(&["regimes.json", "model.toml", "states.parquet", "report.html"])?;
                Some(folder)
            }
            None => None,
        };
        let refused = |error: RegimeError| self.refused(&error);
        let observations = Observations::of(&series.values).map_err(refused)?;
        let (best, fits) = self.fits(observations).map_err(refused)?;
        let found = &fits[best];
        let (path, _) = found.model.viterbi(observations).map_err(refused)?;
        let mut filter = Filter::new(found.model.clone());
        for value in &series.values {
            filter.step(&[*value]).map_err(refused)?;
        }
        let changes = self.changes(&series).map_err(refused)?;
        let listing = self.listing(&series, &fits, best, &path, filter.belief(), &changes);
        let json = format!("{}\n", serde_json::to_string_pretty(&listing)?);
        let mut text = if self.json { json.clone() } else { told(screen, &listing) };
        if let Some(folder) = &mut folder {
            folder.file("regimes.json", json.as_bytes())?;
            let model = toml::to_string(&found.model).map_err(|error| Stop::Bug(error.to_string()))?;
            folder.file("model.toml", model.as_bytes())?;
            let filtered = found.model.filter(observations).map_err(refused)?;
            folder.table("states.parquet", &by_row(&series, &path, &filtered))?;
            folder.file("report.html", page(&series, &listing, &changes, &path, &filtered).render()?.as_bytes())?;
        }
        match folder {
            Some(folder) => {
                let paths = folder.finish()?;
                if !self.json {
                    text += &written(&paths);
                }
            }
            None if !self.json => text += "\nNothing was written; --out DIR writes states, model and probabilities.\n",
            None => {}
        }
        screen.print(&text)?;
        Ok(Outcome::Done)
    }

    /// What is wrong with the series, as an error of its file.
    fn refused(&self, error: &RegimeError) -> Stop {
        let told = error.to_string();
        let (message, hint) = told.split_once("\nhint: ").unwrap_or((&told, "give another series"));
        InputError::new(&self.file, message).hint(hint).into()
    }

    fn series(&self) -> Result<Series, Stop> {
        let table = Table::read(&self.file)?;
        let column = match &self.column {
            Some(column) => column.clone(),
            None => default_column(&table)?,
        };
        let cells = table.floats(&column)?;
        let times = if table.has("t") {
            Times::Seconds(table.floats_complete("t")?)
        } else if table.has("ts") {
            Times::Instants(table.times("ts", &TimeFormat::default())?)
        } else {
            Times::None
        };
        let mut values: Vec<f64> = cells.iter().map(|cell| cell.unwrap_or(f64::NAN)).collect();
        if self.returns {
            if let Some(row) = values.iter().position(|price| *price <= 0.0) {
                let error = table.error(&column, row, "a price has a logarithm only above 0");
                return Err(error.found(values[row]).hint("leave --returns out for what is no price").into());
            }
            values = values.windows(2).map(|pair| (pair[1] / pair[0]).ln()).collect();
        }
        Ok(Series { column, values, first: usize::from(self.returns), times })
    }

    /// The fits that were tried, and the number of the best.
    fn fits(&self, series: Observations) -> Result<(usize, Vec<Fit>), RegimeError> {
        let family = match self.model {
            Model::Gaussian => Family::Gaussian,
            Model::StudentT => Family::StudentT(Degrees::Fitted),
        };
        let settings = Settings { family, seed: Seed(self.seed), ..Settings::new(1) };
        match self.states {
            States::Given(states) => Ok((0, vec![fit(&[series], &Settings { states, ..settings })?])),
            States::Auto => fit_states(&[series], 1..=MOST_STATES, &settings),
        }
    }

    /// Rows of the series at which something new begins.
    fn changes(&self, series: &Series) -> Result<Vec<usize>, RegimeError> {
        let kept: Vec<usize> = (0..series.values.len()).filter(|row| !series.values[*row].is_nan()).collect();
        let known: Vec<f64> = kept.iter().map(|row| series.values[*row]).collect();
        match self.changes {
            Changes::Pelt => {
                let division = Division { cost: Cost::MeanAndVariance, penalty: Penalty::Mbic, shortest: 5 };
                Ok(division.divide(&known)?.changes.into_iter().map(|row| kept[row]).collect())
            }
            Changes::Bocpd => {
                let (mean, deviation) = moments(&known);
                RunLengths::changes(Assumed::every(INTERVAL, Prior::weak(mean, deviation)), &series.values)
            }
            Changes::Cusum => {
                let reference = &known[..(known.len() / 10).max(20).min(known.len())];
                let (mean, deviation) = moments(reference);
                let mut cusum = Cusum::new(CusumSettings::for_false_alarms_every(INTERVAL, mean, deviation, 0.5)?)?;
                let mut changes = vec![];
                for value in &series.values {
                    changes.extend(cusum.step(*value)?.map(|alarm| alarm.since as usize));
                }
                Ok(changes)
            }
        }
    }

    fn listing<'a>(
        &self,
        series: &'a Series,
        fits: &[Fit],
        best: usize,
        path: &[usize],
        now: &[f64],
        changes: &[usize],
    ) -> Listing<'a> {
        let found = &fits[best];
        let durations = found.model.expected_durations();
        let finite = |value: f64| value.is_finite().then_some(value);
        let states = found.model.emissions().iter().enumerate().map(|(state, emission)| StateRow {
            mean: emission.mean[0],
            std: finite(emission.volatility()),
            degrees: emission.degrees,
            share: path.iter().filter(|s| **s == state).count() as f64 / path.len() as f64,
            expected_rows: finite(durations[state]),
            now: now[state],
            collapsed: found.collapsed.iter().any(|(which, _)| *which == state),
        });
        let ends = changes.iter().skip(1).copied().chain([series.values.len()]);
        let changes = changes.iter().zip(ends).map(|(row, end)| {
            let (mean, std) = moments(&series.values[*row..end.max(*row)]);
            ChangeRow { row: row + series.first, time: series.time(*row), mean, std }
        });
        Listing {
            schema: "trueup.regimes/1",
            column: &series.column,
            returns: self.returns,
            rows: series.values.len(),
            observed: found.observed,
            log_likelihood: found.log_likelihood,
            bic: found.bic(),
            converged: found.converged,
            iterations: found.iterations,
            states: states.collect(),
            tried: fits
                .iter()
                .map(|f| TriedRow { states: f.model.states(), log_likelihood: f.log_likelihood, bic: f.bic() })
                .collect(),
            method: self.changes,
            changes: changes.collect(),
        }
    }
}

impl Series {
    /// When a row of the series was; `None` where the file has no times.
    fn time(&self, row: usize) -> Option<String> {
        match &self.times {
            Times::Instants(times) => times.get(row + self.first).map(ToString::to_string),
            Times::Seconds(times) => times.get(row + self.first).map(|t| format!("{t} s")),
            Times::None => None,
        }
    }
}

/// `close`, or the only column that is not of times.
fn default_column(table: &Table) -> Result<String, InputError> {
    let names = table.names();
    let others: Vec<&str> = names.iter().copied().filter(|name| !TIMES.contains(name)).collect();
    match others.as_slice() {
        _ if table.has("close") => Ok("close".into()),
        [only] => Ok((*only).to_owned()),
        _ => {
            let message = format!("it does not say which column is the series: there are {}", listed(&others));
            Err(InputError::new(table.path(), message).hint("name one with --column"))
        }
    }
}

/// Mean and standard deviation of what is not NaN.
pub(super) fn moments(values: &[f64]) -> (f64, f64) {
    let known = || values.iter().filter(|x| !x.is_nan());
    let count = (known().count() as f64).max(1.0);
    let mean = known().sum::<f64>() / count;
    (mean, (known().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt())
}
