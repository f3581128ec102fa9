//! `trueup sweep`: one run tried with many values.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::Args;
use rayon::prelude::*;

use crate::io::{InputError, OutputFolder, Overwrite, RunFile, SweepSection, hint_among};
use crate::market::metric::Metrics;
use crate::market::sweep::{Header, Line, Refused, Sweep, SweepSummary, Trial, Values, figures, plan, sweep_table};
use crate::market::{Cash, Ledger, Record, Strategy, prepare_run};
use crate::strategies::{STRATEGIES, StrategyError};

use super::backtest::{explained_strategy, strategy_table};
use super::screen::{self, Screen, titled};
use super::stop::{Outcome, Stop};

mod journal;

use journal::{JournalFile, Start};

/// Try a run with many values: a grid or random draws over ranges of its keys, in parallel
///
/// The ranges stand in the run itself: [sweep] says how values are combined and which figure ranks the runs, [sweep.ranges]
/// gives values by path. Values that a strategy refuses together are counted, and the others go on. With --out each run is
/// written to sweep.jsonl as soon as it is done, so that --resume can go on after an interruption.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup sweep run.toml
  trueup sweep run.toml --out sweeps/first      # after an interruption, the same with --resume

In run.toml:
  [sweep]
  metric = \"sharpe\"         # any figure of run.json; goal = \"min\" where less is better
  [sweep.ranges]
  \"strategy.fast\" = { from = 5, to = 20, step = 5 }
  \"mechanism.half_spread.bps\" = { from = 0.5, to = 2.0, log = true, count = 5 }
  # method = \"random\" and runs = 200 draw from ranges without steps, too")]
pub(super) struct Try {
    /// TOML file of the run, with a section [sweep]
    run: PathBuf,
    /// Folder to write sweep.jsonl, sweep.parquet, sweep.json and report.html into
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write over files that exist, and begin anew
    #[arg(long)]
    force: bool,
    /// Go on with the sweep.jsonl that is there
    #[arg(long, conflicts_with = "force", requires = "out")]
    resume: bool,
    /// Print sweep.json on standard output instead of a table
    #[arg(long)]
    json: bool,
}

/// The files that appear at the end.
const FILES: [&str; 3] = ["sweep.parquet", "sweep.json", "report.html"];

impl Try {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let file = RunFile::read(&self.run)?;
        let section = section(&file)?.clone();
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        let start = if self.resume { Start::Resume } else { Start::Anew(overwrite) };
        if let Some(folder) = &self.out {
            OutputFolder::create(folder, overwrite)?.check_free(&FILES)?;
            journal::check(&folder.join("sweep.jsonl"), start)?;
        }
        let prepared = prepare_run(&file)?;
        let sweep = Sweep { run: &file, prepared: &prepared, make: &make, belongs: &belongs };
        let all = plan(&section, file.run.seed, &belongs);
        sweep.check(&all)?;
        let journal = match &self.out {
            Some(folder) => Some(JournalFile::open(&folder.join("sweep.jsonl"), &Header::of(&sweep, &all), start)?),
            None => None,
        };
        let trials = tried(&sweep, &all, journal.as_ref(), screen)?;
        let summary = SweepSummary::of(&sweep, &section, &trials);
        let json = format!("{}\n", serde_json::to_string_pretty(&summary)?);
        let mut text = if self.json { json.clone() } else { told(screen, &summary) };
        if let Some(folder) = &self.out {
            let mut output = OutputFolder::create(folder, overwrite)?;
            let [table, summary_file, page] = FILES;
            output.table(table, &sweep_table(&trials))?;
            output.file(summary_file, json.as_bytes())?;
            output.file(page, summary.page(&section, &trials).render()?.as_bytes())?;
            let paths = output.finish()?;
            if !self.json {
                text += &screen::written(&paths);
            }
        } else if !self.json {
            text += "\nNothing was written; --out DIR writes every run, and a report.\n";
        }
        screen.print(&text)?;
        Ok(Outcome::Done)
    }
}

/// The section [sweep] of `file`, its metric and the keys of its strategies known.
pub(super) fn section(file: &RunFile) -> Result<&SweepSection, InputError> {
    let Some(section) = &file.sweep else {
        let error = file.error(&["sweep"], "the run has no section [sweep]");
        return Err(error.hint("add [sweep.ranges] with e.g. \"strategy.fast\" = { from = 5, to = 50, step = 5 }"));
    };
    let names = metric_names();
    let first = section.metric.split('.').next().unwrap_or_default();
    if !names.iter().any(|name| name.split('.').next() == Some(first)) {
        let error = file.error(&["sweep", "metric"], format!("there is no figure `{}`", section.metric));
        return Err(error.maybe_hint(hint_among(&section.metric, &names)));
    }
    let kinds = section.ranges.iter().find(|range| range.path == "strategy.kind").and_then(|range| range.grid());
    let kinds: Vec<String> = match kinds {
        Some(kinds) => kinds.iter().filter_map(|kind| kind.as_str().map(str::to_owned)).collect(),
        None => vec![file.strategy.clone()],
    };
    let rows = STRATEGIES.iter().filter(|row| kinds.iter().any(|kind| kind == row.name));
    let known: Vec<&str> = rows.flat_map(|row| row.parameters.iter().copied()).collect();
    for range in &section.ranges {
        let key = range.path.strip_prefix("strategy.").filter(|key| *key != "kind" && !known.is_empty());
        if let Some(key) = key.filter(|key| !known.contains(key)) {
            let error = range.error(file.document(), format!("`{}` has no parameter `{key}`", kinds.join("`, `")));
            return Err(error.maybe_hint(hint_among(key, &known)));
        }
    }
    Ok(section)
}

/// Names of the figures of a run: those of one in which nothing happened, and of a fall, which it has none of.
fn metric_names() -> Vec<String> {
    let empty = Record {
        blotter: crate::market::Blotter::default(),
        equity: Vec::new(),
        ledger: Ledger::new(Cash::default(), 1),
        held: crate::market::Held::default(),
        data: Vec::new(),
        outside: Vec::new(),
        halts: Vec::new(),
        account: crate::market::AccountRecord::default(),
    };
    let value = Metrics::of(&empty).ok().and_then(|metrics| serde_json::to_value(&metrics).ok()).unwrap_or_default();
    let known: BTreeMap<String, f64> = Metrics::of(&empty).map(|metrics| figures(&metrics)).unwrap_or_default();
    let mut names: Vec<String> = value
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(_, value)| !value.is_object())
        .map(|(name, _)| name.clone())
        .collect();
    names.extend(known.into_keys().filter(|name| name.contains('.')));
    names.extend(["max_drawdown.depth", "max_drawdown.seconds"].map(str::to_owned));
    names.retain(|name| name != "max_drawdown");
    names
}

/// The strategy of a run of a sweep: what it refuses for its values is no error of the document.
pub(super) fn make(file: &RunFile) -> Result<Box<dyn Strategy>, Refused> {
    let table = strategy_table(file).map_err(Refused::Input)?;
    crate::strategies::build(&table).map_err(|error| match &error {
        StrategyError::Value { .. } => {
            Refused::Invalid(error.to_string().replace("\nhint: ", ": ").replace("[strategy] ", ""))
        }
        StrategyError::NoKind(_)
        | StrategyError::Unknown { .. }
        | StrategyError::Parameter { .. }
        | StrategyError::Symbol { .. }
        | StrategyError::TooFew { .. } => Refused::Input(explained_strategy(file, &error)),
    })
}

/// Whether a kind of strategy has a parameter.
pub(super) fn belongs(kind: &str, key: &str) -> bool {
    STRATEGIES.iter().find(|row| row.name == kind).is_none_or(|row| row.parameters.contains(&key))
}

/// All runs, those that `journal` does not hold yet anew.
fn tried(sweep: &Sweep<'_>, all: &[Values], journal: Option<&JournalFile>, screen: &Screen) -> Result<Vec<Trial>, Stop> {
    let progress = screen.progress();
    let done = AtomicUsize::new(0);
    progress.tell("running", 0, all.len());
    let one = |(index, values): (usize, &Values)| -> Result<Trial, Stop> {
        let trial = match journal.and_then(|journal| journal.outcome(index)) {
            Some(outcome) => sweep.again(index, values, outcome.clone())?,
            None => {
                let trial = sweep.trial(index, values, None)?;
                if let Some(journal) = journal {
                    journal.append(&Line { index, outcome: trial.outcome.clone() })?;
                }
                trial
            }
        };
        progress.tell("running", done.fetch_add(1, Ordering::Relaxed) + 1, all.len());
        Ok(trial)
    };
    all.par_iter().enumerate().map(one).collect()
}

fn told(screen: &Screen, summary: &SweepSummary) -> String {
    let mut text = format!("{}\n", screen.wrapped("", &summary.headline()));
    let listing = summary.listing();
    if !listing.rows.is_empty() {
        text += &titled("The best runs", &screen.listing(&listing));
    }
    text += "\n";
    for line in summary.about() {
        text += &format!("{}\n", screen.wrapped("", &line));
    }
    text
}
