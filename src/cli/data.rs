//! `trueup data`: the data sets that come with the project, logs that come from elsewhere, and orders out of tapes.

mod import;
mod tape;
mod told;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use crate::conceal::{self, Column, Content, Set, catalogue};
use crate::io::{InputError, OutputFolder, OutputTable, Overwrite, Values};
use crate::sim2real::Timestamp;

use super::screen::Screen;
use super::stop::{Outcome, Stop};

/// Make the data sets that come with the project, or read logs of brokers and bots
#[derive(Debug, Args)]
pub(super) struct Data {
    #[command(subcommand)]
    command: DataCommand,
}

#[derive(Debug, Subcommand)]
enum DataCommand {
    Make(Make),
    Import(Box<import::Import>),
}

/// Write the generated data sets: a servo recording, a day of orders and a month of minute bars
///
/// The sets are the same bits at each call. Each has a README with its columns, their units and what is concealed in it.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup data make
  trueup data make --out sets
  trueup diagnose data/servo/twin.toml --recording data/servo/train.csv --holdout data/servo/test.csv")]
struct Make {
    /// Folder to write the sets into, a folder each
    #[arg(long, value_name = "DIR", default_value = "data")]
    out: PathBuf,
    /// Write over files that exist
    #[arg(long)]
    force: bool,
}

impl Data {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        match self.command {
            DataCommand::Make(make) => make.run(screen),
            DataCommand::Import(import) => import.run(screen),
        }
    }
}

impl Make {
    fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        let folders = catalogue()
            .iter()
            .map(|set| prepared(set, &self.out.join(set.name), overwrite))
            .collect::<Result<Vec<OutputFolder>, InputError>>()?;
        let mut text = String::new();
        for folder in folders {
            for path in folder.finish()? {
                text += &format!("{}\n", path.display());
            }
        }
        screen.print(&text)?;
        Ok(Outcome::Done)
    }
}

/// The files of `set`, ready to appear in `folder`.
pub(super) fn prepared(set: &Set, folder: &Path, overwrite: Overwrite) -> Result<OutputFolder, InputError> {
    let mut output = OutputFolder::create(folder, overwrite)?;
    for (name, content) in &set.files {
        match content {
            Content::Text(words) => output.file(name, words.as_bytes())?,
            Content::Table(table) => output.table(name, &output_table(table, name))?,
        }
    }
    Ok(output)
}

/// The table as it goes into the file `name`.
pub(super) fn output_table(table: &conceal::Table, name: &str) -> OutputTable {
    let typed_times = name.ends_with(".parquet");
    let columns = table.columns().iter();
    columns.fold(OutputTable::new(), |out, (name, column)| out.with(name, values(column, typed_times)))
}

/// The values of `column`. Times are nanoseconds as integers in CSV, which knows no types, and timestamps in Parquet.
fn values(column: &Column, typed_times: bool) -> Values {
    match column {
        Column::Time(times) if typed_times => Values::Times(times.iter().map(|t| Some(Timestamp(*t))).collect()),
        Column::Time(whole) | Column::Whole(whole) => Values::Integers(whole.iter().copied().map(Some).collect()),
        Column::Real(real) => Values::Floats(real.iter().copied().map(Some).collect()),
        Column::Text(texts) => Values::Texts(texts.iter().cloned().map(Some).collect()),
        Column::Sparse(real) => Values::Floats(real.clone()),
        Column::Empty(rows) => Values::Floats(vec![None; *rows]),
    }
}
