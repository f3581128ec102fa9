//! `trueup backtest`: a strategy on past data.

use std::path::PathBuf;

use clap::Args;

use crate::io::{InputError, OutputFolder, Overwrite, RunFile, hint_among};
use crate::market::{Instrument, RunBrief, RunOutputs, Strategy, prepare_run, prepare_streaming_run, streams_as_well};
use crate::report::Metric;
use crate::report::quantity::UNDEFINED;
use crate::strategies::{self, StrategyError};

use super::checkpoint::{Going, Ran, Turn};
use super::draws;
use super::screen::{self, Screen};
use super::stop::{Outcome, Stop};

/// Run a strategy on past bars or quotes, event by event
///
/// Orders meet the market through the mechanisms that RUN.toml lists: the same ones that `trueup diagnose` finds missing.
/// Without --out nothing is written.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup backtest data/bars/run.toml
  trueup backtest run.toml --out runs/first
  trueup backtest run.toml --draws 200 --out runs/spread    # [randomize] says what is drawn")]
pub(super) struct Run {
    /// TOML file of the run: cash, instruments, data, strategy, and what stands between decision and fill
    run: PathBuf,
    /// Folder to write run.json, orders.parquet, fills.parquet, trades.parquet, equity.parquet and report.html into; with --draws
    /// draws.parquet too
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write over files that exist
    #[arg(long)]
    force: bool,
    /// Print run.json on standard output instead of a table
    #[arg(long)]
    json: bool,
    /// Seed of all randomness [default: as RUN.toml has it]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Run so many draws besides, each with other parameters of what stands between decision and fill, as [randomize] or a
    /// [posterior] says, and show how far the figures spread
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000), conflicts_with_all = ["save", "resume", "fork"])]
    draws: Option<u32>,
    #[command(flatten)]
    turn: Turn,
}

impl Run {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let mut file = RunFile::read(&self.run)?;
        file.run.seed = self.seed.unwrap_or(file.run.seed);
        strategy(&file)?;
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        if let Some(folder) = &self.out {
            let draws = self.draws.map(|_| RunOutputs::DRAWS);
            let files: Vec<&str> = RunOutputs::FILES.into_iter().chain(draws).collect();
            OutputFolder::create(folder, overwrite)?.check_free(&files)?;
        }
        if self.draws.is_some() {
            draws::check(&file)?;
        }
        self.turn.check_free(overwrite)?;
        // What goes through its data once need not hold them, where to read them twice costs next to nothing.
        let once = self.draws.is_none() && self.turn.is_none() && streams_as_well(&file);
        let prepared = if file.run.stream || once { prepare_streaming_run(&file)? } else { prepare_run(&file)? };
        let progress = screen.progress();
        let going = Going { file: &file, prepared: &prepared, progress: &progress, strategy: &|| strategy(&file) };
        let (record, beside) = match self.turn.run(&going, overwrite)? {
            Ran::Whole { record, beside } => (record, beside),
            Ran::Saved(text) => {
                drop(progress);
                screen.print(&text)?;
                return Ok(Outcome::Done);
            }
        };
        let drawn = match self.draws {
            Some(count) => Some(draws::drawn(&going, &record, count as usize)?),
            None => None,
        };
        drop(progress);
        if self.out.is_none() && drawn.is_none() && beside.is_none() {
            return self.tell(&prepared.brief(&record).map_err(|error| Stop::Bug(error.to_string()))?, screen);
        }
        let shown = |record| prepared.outputs(record).map_err(|error| Stop::Bug(error.to_string()));
        let mut outputs = shown(&record)?;
        if let Some(drawn) = &drawn {
            outputs = outputs.with_draws(drawn);
        }
        let mut text = match &beside {
            _ if self.json => outputs.json()?,
            None => told(&outputs.page.title, &outputs.page.metrics, screen) + &draws::told(&outputs, screen),
            Some(beside) => {
                let told = told_beside(&shown(beside)?, &outputs, screen);
                format!("{}\n\n{told}", screen.wrapped("", &self.turn.instead_of_what()))
            }
        };
        match &self.out {
            Some(folder) => {
                let mut output = OutputFolder::create(folder, overwrite)?;
                outputs.write(&mut output)?;
                let paths = output.finish()?;
                if !self.json {
                    text += &screen::written(&paths);
                }
            }
            None if !self.json => text += NOTHING_WRITTEN,
            None => {}
        }
        screen.print(&text)?;
        Ok(Outcome::Done)
    }

    /// Tells of a run of which nothing is written.
    fn tell(&self, brief: &RunBrief, screen: &Screen) -> Result<Outcome, Stop> {
        let text = match self.json {
            true => brief.summary.json()?,
            false => told(&brief.title, &brief.metrics, screen) + NOTHING_WRITTEN,
        };
        screen.print(&text)?;
        Ok(Outcome::Done)
    }
}

const NOTHING_WRITTEN: &str = "\nNothing was written; --out DIR writes tables and a report.\n";

/// The strategy that `file` names.
///
/// # Errors
/// If there is no such strategy, or a parameter of it is missing, unknown or of a value that cannot be; if it needs instruments the
/// run does not have.
pub fn strategy(file: &RunFile) -> Result<Box<dyn Strategy>, InputError> {
    let table = strategy_table(file)?;
    let built = strategies::build(&table).and_then(|strategy| {
        let instruments: Vec<Instrument> = file.instruments.iter().map(Instrument::from).collect();
        strategies::check_instruments(&table, &instruments).map(|()| strategy)
    });
    built.map_err(|error| explained_strategy(file, &error))
}

/// `[strategy]` of `file`, its `kind` with it.
pub(super) fn strategy_table(file: &RunFile) -> Result<toml::Table, InputError> {
    let mut table: toml::Table = file.strategy_settings()?;
    table.insert("kind".to_owned(), toml::Value::String(file.strategy.clone()));
    Ok(table)
}

/// The error of a strategy at its place in the run.
pub(super) fn explained_strategy(file: &RunFile, error: &StrategyError) -> InputError {
    let text = error.to_string();
    let (message, hint) = text.split_once("\nhint: ").unwrap_or((&text, ""));
    let message = message.trim_start_matches("[strategy] ");
    match error {
        StrategyError::NoKind(_) | StrategyError::Unknown { .. } => file.error(&["strategy", "kind"], message).hint(hint),
        StrategyError::TooFew { .. } => file.error(&["strategy", "kind"], message).hint(hint),
        StrategyError::Value { parameter, .. } | StrategyError::Symbol { parameter, .. } => {
            file.error(&["strategy", parameter], message).hint(hint)
        }
        StrategyError::Parameter { kind, message, parameters } => {
            let word = message.split('`').nth(1).unwrap_or_default();
            let known: Vec<&str> = parameters.split(", ").collect();
            if message.starts_with("unknown field") {
                let error = file.error(&["strategy", word], format!("`{kind}` has no parameter `{word}`"));
                return error.maybe_hint(hint_among(word, &known));
            }
            file.error(&["strategy", word], format!("{kind}: {message}")).hint(hint)
        }
    }
}

/// The figures of a run.
pub(super) fn told(title: &str, metrics: &[Metric], screen: &Screen) -> String {
    let mut table = screen.table(["figure", ">value"]);
    for metric in metrics {
        table.add_row([metric.name.clone(), metric.value.clone().unwrap_or_else(|| UNDEFINED.to_owned())]);
    }
    format!("{}\n\n{}\n", screen.wrapped("", title), table.trim_fmt())
}

/// The figures of a run and of its fork.
fn told_beside(run: &RunOutputs, fork: &RunOutputs, screen: &Screen) -> String {
    let mut table = screen.table(["figure", ">run", ">fork"]);
    for (metric, other) in run.page.metrics.iter().zip(&fork.page.metrics) {
        let value = |value: &Option<String>| value.clone().unwrap_or_else(|| UNDEFINED.to_owned());
        table.add_row([metric.name.clone(), value(&metric.value), value(&other.value)]);
    }
    format!("{}\n\n{}\n", screen.wrapped("", &fork.page.title), table.trim_fmt())
}
