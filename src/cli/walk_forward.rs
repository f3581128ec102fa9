//! `trueup walk-forward`: values chosen on one stretch of the data and tried on the next.

use std::path::PathBuf;

use clap::Args;

use crate::io::{OutputFolder, Overwrite, RunFile};
use crate::market::prepare_run;
use crate::market::sweep::{Sweep, plan};
use crate::market::walk_forward::WalkForward;

use super::screen::{self, Screen, titled};
use super::stop::{Outcome, Stop};
use super::sweep::{belongs, make, section};

/// Choose values on one stretch of the data and try them on the next, window by window
///
/// The ranges and the figure that chooses are those of [sweep], as for `trueup sweep`; [sweep.walk_forward] gives the lengths
/// of training and test, what is left out between the two (purge and embargo), and whether training is anchored to the start
/// of the data. A test begins with cash and with as much of the past as its strategy looks back on, and no orders before it.
#[derive(Debug, Args)]
#[command(
    name = "walk-forward",
    after_help = "\
Examples:
  trueup walk-forward run.toml
  trueup walk-forward run.toml --out walks/first

In run.toml, beside [sweep] and [sweep.ranges]:
  [sweep.walk_forward]
  train = \"90d\"
  test = \"30d\"
  purge = \"1d\"
  embargo = \"1d\"
  anchored = false"
)]
pub(super) struct Walk {
    /// TOML file of the run, with sections [sweep] and [sweep.walk_forward]
    run: PathBuf,
    /// Folder to write windows.parquet, equity.parquet, walk_forward.json and report.html into
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write over files that exist
    #[arg(long)]
    force: bool,
    /// Print walk_forward.json on standard output instead of a table
    #[arg(long)]
    json: bool,
}

const FILES: [&str; 4] = ["windows.parquet", "equity.parquet", "walk_forward.json", "report.html"];

impl Walk {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let file = RunFile::read(&self.run)?;
        let section = section(&file)?;
        let Some(lengths) = section.walk_forward else {
            let error = file.error(&["sweep"], "the run has no section [sweep.walk_forward]");
            return Err(error.hint("add [sweep.walk_forward] with train = \"90d\" and test = \"30d\"").into());
        };
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        if let Some(folder) = &self.out {
            OutputFolder::create(folder, overwrite)?.check_free(&FILES)?;
        }
        let prepared = prepare_run(&file)?;
        let sweep = Sweep { run: &file, prepared: &prepared, make: &make, belongs: &belongs };
        let all = plan(section, file.run.seed, &belongs);
        sweep.check(&all)?;
        let progress = screen.progress();
        let walk = WalkForward::of(&sweep, section, &lengths, &all, &|done, of| progress.tell("running", done, of))?;
        drop(progress);
        let json = format!("{}\n", serde_json::to_string_pretty(&walk)?);
        let mut text = if self.json { json.clone() } else { told(screen, &walk) };
        if let Some(folder) = &self.out {
            let mut output = OutputFolder::create(folder, overwrite)?;
            let [windows, equity, summary, page] = FILES;
            output.table(windows, &walk.windows_table())?;
            output.table(equity, &walk.equity_table())?;
            output.file(summary, json.as_bytes())?;
            output.file(page, walk.page().render()?.as_bytes())?;
            let paths = output.finish()?;
            if !self.json {
                text += &screen::written(&paths);
            }
        } else if !self.json {
            text += "\nNothing was written; --out DIR writes tables and a report.\n";
        }
        screen.print(&text)?;
        Ok(Outcome::Done)
    }
}

fn told(screen: &Screen, walk: &WalkForward) -> String {
    let mut text = format!("{}\n", screen.wrapped("", &walk.headline()));
    text += &titled("Windows", &screen.listing(&walk.listing()));
    text += "\n";
    for line in walk.about() {
        text += &format!("{}\n", screen.wrapped("", &line));
    }
    text
}
