//! `trueup backtest`: a strategy on past data.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::io::{InputError, OutputFolder, Overwrite, RunFile};
use crate::market::{
    Backtest, InputHash, Provenance, Record, Reference, RunSetUp, RunSummary, Session, Strategy, explained,
};
use crate::sim2real::Twin;
use crate::strategies;

use super::screen::{Progress, Screen};
use super::stop::{Outcome, Stop};

mod page;

use page::{metrics, title};

/// Run a strategy on past bars or quotes, event by event
///
/// Orders meet the market through the mechanisms that RUN.toml lists: the same ones that `trueup diagnose` finds missing.
/// Without --out nothing is written.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup backtest data/bars/run.toml
  trueup backtest run.toml --out runs/first")]
pub(super) struct Run {
    /// TOML file of the run: cash, instruments, data, strategy, and what stands between decision and fill
    run: PathBuf,
    /// Folder to write run.json, orders.parquet, fills.parquet, equity.parquet and report.html into
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
}

const FILES: [&str; 5] = ["run.json", "orders.parquet", "fills.parquet", "equity.parquet", "report.html"];

/// A backtest that has been run.
struct Ran {
    file: RunFile,
    backtest: Backtest,
    /// Rows of each data file.
    rows: Vec<usize>,
    strategy: String,
    record: Record,
    summary: RunSummary,
}

impl Run {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let mut file = RunFile::read(&self.run)?;
        file.run.seed = self.seed.unwrap_or(file.run.seed);
        let mut strategy = strategy(&file)?;
        let RunSetUp { backtest, rows } = RunSetUp::of(&file)?;
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        if let Some(folder) = &self.out {
            OutputFolder::create(folder, overwrite)?.check_free(&FILES)?;
        }
        let record = run(&backtest, strategy.as_mut(), &screen.progress()).map_err(|error| explained(&file, &error))?;
        let provenance = provenance(&file, &backtest)?;
        let summary = RunSummary::new(provenance, &record, backtest.instruments());
        let summary = summary.map_err(|error| Stop::Bug(error.to_string()))?;
        let strategy = strategy.name().to_owned();
        let ran = Ran { file, backtest, rows, strategy, record, summary };
        let mut text = if self.json { ran.json()? } else { ran.told(screen) };
        match &self.out {
            Some(folder) => {
                let paths = ran.write(folder, overwrite)?;
                if !self.json {
                    text += "\n";
                    paths.iter().for_each(|path| text += &format!("Written: {}\n", path.display()));
                }
            }
            None if !self.json => text += "\nNothing was written; --out DIR writes tables and a report.\n",
            None => {}
        }
        screen.print(&text)?;
        Ok(Outcome::Done)
    }
}

/// The strategy of `file`.
fn strategy(file: &RunFile) -> Result<Box<dyn Strategy>, InputError> {
    let mut table: toml::Table = file.strategy_settings()?;
    table.insert("kind".to_owned(), toml::Value::String(file.strategy.clone()));
    strategies::build(&table).map_err(|error| {
        let text = error.to_string();
        let (message, hint) = text.split_once("\nhint: ").unwrap_or((&text, ""));
        let error = file.error(&["strategy"], message.trim_start_matches("[strategy] "));
        if hint.is_empty() { error } else { error.hint(hint) }
    })
}

/// Events between two looks at the progress.
const EVENTS_A_TURN: usize = 20_000;

fn run(
    backtest: &Backtest,
    strategy: &mut dyn Strategy,
    progress: &Progress,
) -> Result<Record, crate::market::BacktestError> {
    let mut session: Session<'_> = backtest.start();
    loop {
        let (done, of) = session.progress();
        progress.tell("running", done, of);
        for _ in 0..EVENTS_A_TURN {
            if session.step(strategy)?.is_none() {
                return session.finish();
            }
        }
    }
}

fn provenance(file: &RunFile, backtest: &Backtest) -> Result<Provenance, Stop> {
    let folder = file.document().path().parent().unwrap_or(Path::new(""));
    let hash = |path: &Path, name: String| -> Result<InputHash, Stop> {
        let bytes = std::fs::read(path).map_err(|error| InputError::new(path, format!("cannot be read ({error})")))?;
        Ok(InputHash::of(name, &bytes))
    };
    let own = file.document().path();
    let mut inputs = vec![hash(own, own.file_name().unwrap_or_default().to_string_lossy().into_owned())?];
    for data in &file.data {
        let name = data.path.strip_prefix(folder).unwrap_or(&data.path).display().to_string();
        inputs.push(hash(&data.path, name)?);
    }
    let venue = backtest.venue();
    Ok(Provenance {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: file.run.seed,
        currency: file.run.currency.clone(),
        strategy: file.strategy.clone(),
        mechanisms: venue.modelled().into_iter().map(str::to_owned).collect(),
        reference: Reference::suiting(venue),
        inputs,
    })
}

impl Ran {
    fn json(&self) -> Result<String, Stop> {
        Ok(format!("{}\n", serde_json::to_string_pretty(&self.summary)?))
    }

    fn told(&self, screen: &Screen) -> String {
        let mut table = screen.table(["figure", ">value"]);
        for metric in metrics(self) {
            table.add_row([metric.name, metric.value.unwrap_or_else(|| crate::report::quantity::UNDEFINED.to_owned())]);
        }
        format!("{}\n\n{}\n", screen.wrapped(&title(self), 2), table.trim_fmt())
    }

    fn write(&self, folder: &Path, overwrite: Overwrite) -> Result<Vec<PathBuf>, Stop> {
        let mut output = OutputFolder::create(folder, overwrite)?;
        output.file("run.json", self.json()?.as_bytes())?;
        output.table("orders.parquet", &self.record.orders_table(self.backtest.instruments(), &self.strategy))?;
        output.table("fills.parquet", &self.record.fills_table())?;
        output.table("equity.parquet", &self.record.equity_table())?;
        output.file("report.html", page::page(self).render()?.as_bytes())?;
        Ok(output.finish()?)
    }
}
