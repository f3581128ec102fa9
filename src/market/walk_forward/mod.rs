//! Walk-forward: values are chosen on one stretch of the data and tried on the next, window by window.
//!
//! A test begins with nothing but cash and the past its strategy looks back on; the cash is what the test before it left, so
//! that the tests in a row are one account. What is chosen for a window depends on its training data alone.
//!
//! Source: Pardo, Design, Testing, and Optimization of Trading Systems (1992), for the method; Lopez de Prado, Advances in
//! Financial Machine Learning (2018), chapters 7 and 12, for purge and embargo.

mod page;
mod warm_up;
mod windows;

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;
use toml::Value;

use crate::io::{InputError, OutputTable, SweepSection, WalkForwardSection};
use crate::sim2real::Timestamp;

use super::metric::{Drawdown, Drawdowns, Metrics, Returns};
use super::sweep::{Outcome, Refused, Sweep, Trial, Values, best, column, figures};
use super::{Backtest, Cash, EquityPoint, History, InputFile, Record, Settings};

pub use windows::{Window, windows};

/// What was chosen in a window, and what came of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Step {
    /// Its number, from 0.
    pub index: usize,
    /// Its stretches of time.
    #[serde(flatten)]
    pub window: Window,
    /// What was chosen; none where no run had the metric, and nothing was traded.
    pub chosen: Option<Choice>,
    /// The figures of the test; what is not defined is not here.
    pub out_of_sample: BTreeMap<String, f64>,
    /// Why the test did not come to its end.
    pub failed: Option<String>,
}

/// The best run of a training.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Choice {
    /// Its number in the sweep.
    pub run: usize,
    /// Its values, by path.
    pub values: BTreeMap<String, Value>,
    /// Its metric on the training data.
    pub value: f64,
    /// All its figures on the training data.
    pub in_sample: BTreeMap<String, f64>,
}

/// The tests in a row.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutOfSample {
    /// Cash at the start of the first test [currency].
    pub initial_equity: f64,
    /// Worth of the account at the end of the last [currency].
    pub final_equity: f64,
    /// `final_equity / initial_equity - 1` (a fraction).
    pub total_return: Option<f64>,
    /// Volatility and Sharpe ratio, with the number of returns they rest on.
    #[serde(flatten)]
    pub returns: Returns,
    /// The deepest fall from an earlier high; none where equity never fell.
    pub max_drawdown: Option<Drawdown>,
    /// Number of fills.
    pub fills: usize,
}

/// `walk_forward.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WalkForward {
    /// [`WalkForward::SCHEMA`].
    pub schema: &'static str,
    /// Version of the program.
    pub version: String,
    /// The figure that chooses.
    pub metric: String,
    /// Lengths of the windows [ns].
    pub lengths: WalkForwardSection,
    /// Number of runs in each training.
    pub runs: usize,
    /// The windows, in order.
    pub windows: Vec<Step>,
    /// What the tests came to in a row.
    pub out_of_sample: OutOfSample,
    /// Every file the runs read.
    pub inputs: Vec<InputFile>,
    /// Equity over all tests; it stands in equity.parquet.
    #[serde(skip)]
    pub equity: Vec<EquityPoint>,
    /// Currency of all amounts.
    pub currency: String,
}

impl WalkForward {
    /// The schema, with its version.
    pub const SCHEMA: &'static str = "trueup.walk-forward/1";

    /// Walks `sweep` of `all` values forward. `told` hears how many runs of how many are done.
    ///
    /// # Errors
    /// Windows that the data have no room for; a metric no run of the first training has; as [`Sweep::trial`].
    pub fn of(
        sweep: &Sweep<'_>,
        section: &SweepSection,
        lengths: &WalkForwardSection,
        all: &[Values],
        told: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Self, InputError> {
        let histories = sweep.prepared.backtest.histories();
        let windows = fitting(sweep, histories, lengths)?;
        let opening = sweep.prepared.backtest.settings().cash;
        let (mut account, mut equity, mut steps, mut fills) = (opening, Vec::new(), Vec::new(), 0);
        for (index, window) in windows.iter().enumerate() {
            let before = index * all.len();
            let trials = trained(sweep, all, histories, window, &|done| told(before + done, windows.len() * all.len()))?;
            let chosen = best(section, &trials);
            if chosen.is_none() && index == 0 {
                return Err(no_metric(sweep, section, &trials));
            }
            let mut step = Step { index, window: *window, chosen: None, out_of_sample: BTreeMap::new(), failed: None };
            if let Some((trial, value)) = chosen {
                match tested(sweep, &all[trial.index], histories, window, account)? {
                    Ok((record, left)) => {
                        step.out_of_sample = Metrics::of(&record).map(|metrics| figures(&metrics)).unwrap_or_default();
                        fills += record.blotter.fills.len();
                        equity.extend(record.equity);
                        account = left;
                    }
                    Err(why) => step.failed = Some(why),
                }
                let in_sample = match &trial.outcome {
                    Outcome::Done { metrics } => metrics.clone(),
                    _ => BTreeMap::new(),
                };
                step.chosen = Some(Choice { run: trial.index, values: trial.values.clone(), value, in_sample });
            }
            steps.push(step);
        }
        let provenance = &sweep.prepared.provenance;
        Ok(Self {
            schema: Self::SCHEMA,
            version: provenance.version.clone(),
            metric: section.metric.clone(),
            lengths: *lengths,
            runs: all.len(),
            windows: steps,
            out_of_sample: OutOfSample::of(opening, account, &equity, fills),
            inputs: provenance.inputs.clone(),
            equity,
            currency: provenance.currency.clone(),
        })
    }

    /// `windows.parquet`: a row a window with its times, its chosen values by path, and the metric in and out of sample.
    #[must_use]
    pub fn windows_table(&self) -> OutputTable {
        let all = &self.windows;
        let mut table = OutputTable::new()
            .integers("window", all.iter().map(|step| step.index as i64))
            .times("train_start", all.iter().map(|step| step.window.train_start))
            .times("train_end", all.iter().map(|step| step.window.train_end))
            .times("test_start", all.iter().map(|step| step.window.test_start))
            .times("test_end", all.iter().map(|step| step.window.test_end))
            .integers("run", all.iter().map(|step| step.chosen.as_ref().map(|chosen| chosen.run as i64)))
            .floats("in_sample", all.iter().map(|step| step.chosen.as_ref().map(|chosen| chosen.value)))
            .floats("out_of_sample", all.iter().map(|step| step.out_of_sample.get(&self.metric).copied()))
            .floats("total_return", all.iter().map(|step| step.out_of_sample.get("total_return").copied()));
        for path in self.paths() {
            let value = |step: &'_ Step| step.chosen.as_ref().and_then(|chosen| chosen.values.get(&path).cloned());
            let values: Vec<Option<Value>> = all.iter().map(value).collect();
            table = table.with(&path, column(values.iter().map(Option::as_ref)));
        }
        table
    }

    /// `equity.parquet`: `ts, equity`, one row an event of a test.
    #[must_use]
    pub fn equity_table(&self) -> OutputTable {
        OutputTable::new()
            .times("ts", self.equity.iter().map(|point| point.time))
            .floats("equity", self.equity.iter().map(|point| point.equity))
    }

    /// Paths of all that was chosen.
    fn paths(&self) -> Vec<String> {
        let chosen = self.windows.iter().filter_map(|step| step.chosen.as_ref());
        let all: std::collections::BTreeSet<&String> = chosen.flat_map(|chosen| chosen.values.keys()).collect();
        all.into_iter().cloned().collect()
    }
}

impl OutOfSample {
    fn of(opening: Cash, left: Cash, equity: &[EquityPoint], fills: usize) -> Self {
        let (initial, last) = (opening.to_f64(), left.to_f64());
        Self {
            initial_equity: initial,
            final_equity: last,
            total_return: (initial > 0.0).then(|| last / initial - 1.0),
            returns: Returns::of(equity),
            max_drawdown: Drawdowns::of(initial, equity).deepest.first().copied(),
            fills,
        }
    }
}

fn fitting(sweep: &Sweep<'_>, histories: &[History], lengths: &WalkForwardSection) -> Result<Vec<Window>, InputError> {
    let times = super::audit::known_times(histories);
    let (first, last) = (times.first().copied().unwrap_or_default(), times.last().copied().unwrap_or_default());
    let all = windows(first, last, lengths);
    if all.is_empty() {
        let message = format!("the data, from {first} to {last}, have no room for a training and a test");
        let error = sweep.run.error(&["sweep", "walk_forward", "train"], message);
        return Err(error.hint("shorten `train`, `purge` or `embargo`, or give more data"));
    }
    Ok(all)
}

/// All values on the training data of `window`.
fn trained(
    sweep: &Sweep<'_>,
    all: &[Values],
    histories: &[History],
    window: &Window,
    told: &(dyn Fn(usize) + Sync),
) -> Result<Vec<Trial>, InputError> {
    let end = Timestamp(window.train_end.0.saturating_sub(1));
    let data: Vec<History> = histories.iter().map(|history| history.within(window.train_start, end)).collect();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let one = |(index, values): (usize, &Values)| {
        let trial = sweep.trial(index, values, Some(&data));
        told(done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1);
        trial
    };
    all.par_iter().enumerate().map(one).collect::<Vec<_>>().into_iter().collect()
}

/// The test of `values`, which begins with `cash`: its record without the time before it, and what it leaves; or why it did
/// not come to its end.
fn tested(
    sweep: &Sweep<'_>,
    values: &Values,
    histories: &[History],
    window: &Window,
    cash: Cash,
) -> Result<Result<(Record, Cash), String>, InputError> {
    let run = sweep.run.with_values(values, sweep.belongs)?;
    let mut strategy = match (sweep.make)(&run) {
        Ok(strategy) => strategy,
        Err(Refused::Input(error)) => return Err(error),
        Err(Refused::Invalid(why)) => return Ok(Err(why)),
    };
    let shown = warm_up::warmed(histories, window, strategy.lookback());
    let ran = sweep.backtest(&run, values, Some(&shown))?.and_then(|backtest| {
        let settings = Settings { cash, ..backtest.settings().clone() };
        let (instruments, venue) = (backtest.instruments().to_vec(), backtest.venue().clone());
        let backtest = Backtest::new(instruments, shown, venue, settings).map_err(|error| error.to_string())?;
        let warmed = &mut warm_up::Warmed { inner: strategy.as_mut(), from: window.test_start };
        let mut record = backtest.run(warmed).map_err(|error| error.to_string())?;
        let before = record.equity.iter().take_while(|point| point.time < window.test_start).count();
        record.equity.drain(..before);
        record.held.events -= before;
        let left = record.ledger.equity().map_err(|error| error.to_string())?;
        Ok((record, left))
    });
    Ok(ran)
}

fn no_metric(sweep: &Sweep<'_>, section: &SweepSection, trials: &[Trial]) -> InputError {
    let why = trials.iter().find_map(|trial| match &trial.outcome {
        Outcome::Failed { why } | Outcome::Invalid { why } => Some(why.clone()),
        Outcome::Done { .. } => None,
    });
    let message = format!("none of {} runs of the first training has the figure `{}`", trials.len(), section.metric);
    let hint = format!(
        "ratios of a year take {} daily returns: lengthen `train`, or take metric = \"total_return\"",
        Returns::FEWEST
    );
    sweep
        .run
        .error(&["sweep", "metric"], message)
        .hint(why.filter(|_| trials.iter().all(|t| t.outcome.word() != "done")).unwrap_or(hint))
}
