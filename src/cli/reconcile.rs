//! `trueup reconcile`: a backtest beside a paper log, order by order.

mod junit;
mod told;
mod tolerances;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::io::{InputError, OutputFolder, Overwrite, RunFile, listed, table_in};
use crate::market::paper::import::{ImportSettings, import};
use crate::market::reconcile::{
    Checked, Compared, Histories, Life, Lives, Reconciliation, ReplayError, ReplayNote, Showing, clock_difference, differs,
    lives, reconcile, reconcile_page, replay,
};
use crate::market::{MoneyError, Multiplier, PreparedRun, explained, prepare_run};
use crate::sim2real::Seed;

use super::log_arguments::LogArguments;
use super::screen::{self, Progress, Screen};
use super::stop::{Outcome, Stop};

/// Compare a backtest with a paper log, order by order: where they part, by how much, and why
///
/// Pairs up orders without shared ids, beside a difference of clocks. With --run, the paper log's own orders are sent through
/// the backtest's simulator: what differs from the backtest then is decision (signal, data, sizing), and what differs from
/// the log is execution (queue and fill, latency, spread, impact, fees). The causes sum to the gap of profit and loss to
/// the last unit. With --tolerance it is a regression test: exit code 1 where the two part further.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup reconcile --backtest out/run --paper logs/paper --run run.toml
  trueup reconcile --backtest out/run --paper tradesv3.sqlite --tolerance unmatched=0 --tolerance mean_price_bps=1
  trueup reconcile --backtest out/run --paper fills.csv --tolerance tolerance.toml --out out/reconcile
  trueup reconcile --run run.toml --paper tradesv3.sqlite       # execution alone: the log's own orders in the simulator")]
pub(super) struct Reconcile {
    /// Folder that `trueup backtest --out` wrote [default: the paper log's own orders as the simulator of --run executes them]
    #[arg(long, value_name = "DIR", required_unless_present = "run")]
    backtest: Option<PathBuf>,
    /// Files of the paper log, or a folder of which all files are read together
    #[arg(long, value_name = "LOG", required = true, num_args = 1..)]
    paper: Vec<PathBuf>,
    #[command(flatten)]
    log: LogArguments,
    /// The run of the backtest: its simulator executes the paper log's orders, and its data say what the market showed
    #[arg(long, value_name = "RUN.toml")]
    run: Option<PathBuf>,
    /// How far the two may part: KEY=VALUE, or a TOML file of keys and values [may be given several times]
    #[arg(long, value_name = "FILE|KEY=VALUE")]
    tolerance: Vec<String>,
    /// Take the whole difference of stamps as one of clocks; of itself only one of whole zones is taken for that
    #[arg(long, requires = "backtest")]
    correct_clock: bool,
    /// Folder to write reconcile.json, report.html and, with --tolerance, junit.xml into
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write over files that exist
    #[arg(long)]
    force: bool,
    /// Print reconcile.json (schema trueup.reconcile/1) on standard output instead of tables
    #[arg(long)]
    json: bool,
    /// Seed of the bootstrap
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
}

/// The files that are written.
const FILES: [&str; 3] = ["reconcile.json", "report.html", "junit.xml"];

impl Reconcile {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let tolerance = tolerances::read(&self.tolerance)?;
        let settings = self.log.settings()?;
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        if let Some(folder) = &self.out {
            OutputFolder::create(folder, overwrite)?.check_free(&FILES)?;
        }
        let file = self.run.as_ref().map(RunFile::read).transpose()?;
        let progress = screen.progress();
        progress.tell("reading logs", 0, 0);
        let backtest = || self.backtest.as_deref().map(backtest_log).transpose();
        let paper = || lives(&import(&self.paper, &settings)?).map_err(|error| too_large(&self.paper[0], &error));
        // Of two errors it is always the same one that is told.
        let (backtest, paper) = rayon::join(backtest, paper);
        let (backtest, paper) = (backtest?, paper?);
        // Not beside them, though it might be: both are large while they are read.
        let prepared = file.as_ref().map(prepare_run).transpose()?;
        let found = self.found(backtest, paper, file.as_ref().zip(prepared.as_ref()), &progress)?;
        drop(progress);
        let checked = found.checked(&tolerance);
        self.tell(&found, &checked, overwrite, screen)?;
        Ok(if checked.iter().all(|checked| checked.holds) { Outcome::Done } else { Outcome::Finding })
    }

    fn found(
        &self,
        mut backtest: Option<Lives>,
        mut paper: Lives,
        run: Option<(&RunFile, &PreparedRun)>,
        progress: &Progress,
    ) -> Result<Reconciliation, Stop> {
        let clock = backtest.as_ref().map(|own| clock_difference(&own.orders, &paper.orders));
        if let Some(clock) = clock.filter(|clock| clock.is_a_zone || self.correct_clock) {
            paper.orders = paper.orders.into_iter().map(|order| order.with_times(|at| clock.on_backtest(at))).collect();
            paper.notes.push(format!("its times are moved by {:+.6} s onto the backtest's clock", -clock.offset));
        }
        let fails = |error: MoneyError| Stop::from(too_large(&self.paper[0], &error));
        let seed = Seed(self.seed);
        let Some((file, prepared)) = run else {
            let backtest = &backtest.unwrap_or_default();
            let compared = Compared { backtest, paper: &paper, replayed: None, showing: None, seed };
            return reconcile(&compared).map_err(fails);
        };
        let symbols: Vec<&str> = prepared.backtest.instruments().iter().map(|i| i.symbol.as_str()).collect();
        check_symbols(file, &symbols, &paper)?;
        let multipliers = multipliers(prepared, &symbols);
        let known = |life: &mut Life| life.multiplier = multipliers.get(life.symbol.as_str()).copied().unwrap_or_default();
        paper.orders.iter_mut().chain(backtest.iter_mut().flat_map(|own| &mut own.orders)).for_each(known);
        progress.tell("replaying", 0, 0);
        let fails_to_run = |error: ReplayError| match error {
            ReplayError::Run(error) => explained(file, &error),
            ReplayError::Money(error) => too_large(&self.paper[0], &error),
        };
        let start = || prepared.start().map_err(|error| explained(file, &error));
        let again = || replay(start()?, &symbols, &paper.orders).map_err(fails_to_run);
        let differs = |own: &Lives| differs(start()?, &symbols, &own.orders).map_err(fails_to_run);
        let (replayed, differs) = rayon::join(again, || backtest.as_ref().map(differs).transpose());
        let (mut replayed, differs) = (replayed?, differs?);
        let note =
            |note: &ReplayNote| format!("{} orders were not replayed: {} (first: {})", note.orders, note.why, note.first);
        paper.notes.extend(replayed.notes.iter().map(note));
        let backtest = match backtest {
            Some(mut backtest) => {
                backtest.notes.extend(differs.into_iter().flatten());
                backtest
            }
            // Execution alone: of what was not replayed there is nothing to compare.
            None => {
                let (orders, executed) =
                    paper.orders.into_iter().zip(replayed.orders).filter(|(_, own)| own.is_some()).unzip();
                (paper.orders, replayed.orders) = (orders, executed);
                Lives { orders: replayed.orders.iter().flatten().cloned().collect(), notes: Vec::new() }
            }
        };
        let histories = Histories::new(&symbols, prepared.backtest.histories());
        let (showing, executed) = (Some(&histories as &dyn Showing), Some(replayed.orders.as_slice()));
        let compared = Compared { backtest: &backtest, paper: &paper, replayed: executed, showing, seed };
        reconcile(&compared).map_err(fails)
    }

    fn tell(&self, found: &Reconciliation, checked: &[Checked], overwrite: Overwrite, screen: &Screen) -> Result<(), Stop> {
        let json = || Ok::<_, Stop>(format!("{}\n", serde_json::to_string_pretty(found)?));
        let mut text = if self.json { json()? } else { told::told(found, checked, screen) };
        match &self.out {
            Some(folder) => {
                let [summary, page, junit] = FILES;
                let mut output = OutputFolder::create(folder, overwrite)?;
                output.file(summary, json()?.as_bytes())?;
                output.file(page, reconcile_page(found, checked).render()?.as_bytes())?;
                if !checked.is_empty() {
                    output.file(junit, junit::junit(found, checked).as_bytes())?;
                }
                let paths = output.finish()?;
                if !self.json {
                    text += &screen::written(&paths);
                }
            }
            None if !self.json => text += "\nNothing was written; --out DIR writes a report.\n",
            None => {}
        }
        screen.print(&text)
    }
}

/// What one unit of each symbol is of its underlying.
fn multipliers<'a>(prepared: &PreparedRun, symbols: &[&'a str]) -> HashMap<&'a str, Multiplier> {
    let terms = prepared.backtest.settings().account.iter().flat_map(|account| &account.terms);
    symbols.iter().copied().zip(terms.map(|terms| terms.multiplier)).collect()
}

/// Refuses a run that has nothing of what the log traded.
fn check_symbols(file: &RunFile, symbols: &[&str], paper: &Lives) -> Result<(), InputError> {
    let Some(first) = paper.orders.first() else { return Ok(()) };
    if paper.orders.iter().any(|order| symbols.contains(&order.symbol.as_str())) {
        return Ok(());
    }
    let message = format!("the run trades nothing of the paper log: {}", first.symbol);
    let hint = format!("it has {}; name the run of the backtest, or map names with --symbols", listed(symbols));
    Err(InputError::new(file.document().path(), message).hint(hint))
}

/// The orders of a backtest, as it wrote them.
fn backtest_log(folder: &Path) -> Result<Lives, InputError> {
    let table = |stem: &str| {
        table_in(folder, stem)?.ok_or_else(|| {
            InputError::new(folder, format!("there is no {stem} table in the folder"))
                .hint("name the folder that `trueup backtest RUN.toml --out DIR` wrote")
        })
    };
    let settings = ImportSettings { format: Some("trueup".to_owned()), ..ImportSettings::default() };
    let log = import(&[table("orders")?, table("fills")?], &settings)?;
    lives(&log).map_err(|error| too_large(folder, &error))
}

fn too_large(path: &Path, error: &MoneyError) -> InputError {
    let text = error.to_string();
    let (message, hint) = text.split_once("\nhint: ").unwrap_or((&text, ""));
    InputError::new(path, message).hint(hint)
}
