//! `trueup diagnose`: locate, name, model, prove.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use crate::io::{OutputFolder, Overwrite, TwinFile};
use crate::report::diagnosis_page;
use crate::sim2real::Seed;
use crate::sim2real::diagnose::{Diagnosis, EXPERIMENT_FILE, Excitation, Verdict};

use super::case::Case;
use super::diagnosed::Diagnosed;
use super::figures::figures;
use super::screen::{self, Screen};
use super::stop::{Outcome, Stop};

mod told;

pub(super) use told::{effect_names, errors, headline};

/// Find what a twin leaves out: where it errs, which mechanism is missing, and how much better it does with that
///
/// Fits the twin to the recordings, adds the mechanisms of the registry that the data ask for, and proves the result on
/// recordings no fit has seen. The answer is one of: named, ambiguous, no_mismatch, unexplained, not_excited.
///
/// Without --out nothing is written: the answer is printed and that is all.
#[derive(Debug, Args)]
#[command(after_help = "\
A recording of a joint is a file (CSV, Parquet or Arrow; t in s), one of execution a folder with orders and fills.
A RUN.toml is a twin of execution: its trued.toml is that run with what was found added.

Examples:
  trueup diagnose twin.toml --recording train.csv --holdout test.csv --out diagnosis
  trueup diagnose twin.toml --recording monday tuesday --json > diagnosis.json
  trueup diagnose run.toml --recording logs/paper --out told && trueup backtest told/trued.toml
  trueup diagnose twin.toml --recording run.parquet --fail-on mismatch    # exit code 1 if the twin is incomplete")]
pub(super) struct Diagnose {
    /// TOML file of the twin: its model, its parameters, and what it models already; or of a run
    twin: PathBuf,
    /// Recordings to fit
    #[arg(long, value_name = "PATH", required = true, num_args = 1..)]
    recording: Vec<PathBuf>,
    /// Recordings for proof alone, which no fit sees [default: the last 30 % in time of each recording]
    #[arg(long, value_name = "PATH", num_args = 1..)]
    holdout: Vec<PathBuf>,
    /// Mechanisms to leave out of the registry: what is said without the right one shows what an answer is worth
    #[arg(long, value_name = "ID", value_delimiter = ',')]
    without: Vec<String>,
    /// Folder to write diagnosis.json, trued.toml and report.html into, and next_experiment.csv where these data cannot tell
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write over files that exist
    #[arg(long)]
    force: bool,
    /// Print diagnosis.json on standard output instead of tables
    #[arg(long)]
    json: bool,
    /// End with exit code 1 at these verdicts; mismatch is short for named,ambiguous,unexplained
    #[arg(long, value_name = "VERDICT", value_delimiter = ',')]
    fail_on: Vec<FailOn>,
    /// Seed of what is drawn: placebos, and the resampling behind intervals
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

/// What a caller may ask to fail on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
enum FailOn {
    Mismatch,
    Named,
    Ambiguous,
    NoMismatch,
    Unexplained,
    NotExcited,
}

impl FailOn {
    fn holds(self, verdict: Verdict) -> bool {
        match self {
            Self::Mismatch => matches!(verdict, Verdict::Named | Verdict::Ambiguous | Verdict::Unexplained),
            Self::Named => verdict == Verdict::Named,
            Self::Ambiguous => verdict == Verdict::Ambiguous,
            Self::NoMismatch => verdict == Verdict::NoMismatch,
            Self::Unexplained => verdict == Verdict::Unexplained,
            Self::NotExcited => verdict == Verdict::NotExcited,
        }
    }
}

/// The files a diagnosis writes; the last only where the recordings cannot tell, and commands that could are plain numbers.
pub(super) const FILES: [&str; 4] = ["diagnosis.json", "trued.toml", "report.html", EXPERIMENT_FILE];

impl Diagnose {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let file = TwinFile::read(&self.twin)?;
        let case = Case::read(&file, &self.recording, &self.holdout)?.without(&self.without)?;
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        if let Some(folder) = &self.out {
            // Before the work rather than after it.
            OutputFolder::create(folder, overwrite)?.check_free(&FILES)?;
        }
        let diagnosed = case.diagnose(Seed(self.seed), &screen.progress());
        let mut text = if self.json { json(&diagnosed.diagnosis)? } else { told::diagnosis(screen, &diagnosed.diagnosis) };
        let verdict = diagnosed.diagnosis.verdict;
        if let Some(folder) = &self.out {
            let paths = write(diagnosed, folder, overwrite)?;
            if !self.json {
                text += &screen::written(&paths);
            }
        } else if !self.json {
            text += "\nNothing was written; --out DIR writes diagnosis.json, trued.toml and report.html.\n";
        }
        // A reader who has seen enough does not change what was found.
        match screen.print(&text) {
            Ok(()) | Err(Stop::Unread) => {}
            Err(stop) => return Err(stop),
        }
        Ok(if self.fail_on.iter().any(|on| on.holds(verdict)) { Outcome::Finding } else { Outcome::Done })
    }
}

/// `diagnosis.json`.
fn json(diagnosis: &Diagnosis) -> Result<String, Stop> {
    Ok(format!("{}\n", serde_json::to_string_pretty(diagnosis)?))
}

/// Writes what a diagnosis leaves into `folder`; gives the paths.
pub(super) fn write(diagnosed: Diagnosed, folder: &Path, overwrite: Overwrite) -> Result<Vec<PathBuf>, Stop> {
    let (diagnosis, file) = (&diagnosed.diagnosis, &diagnosed.file);
    let experiment = diagnosed.excitation.as_ref().map(|excitation| commands(excitation, file));
    let figures = figures(diagnosed.comparisons, diagnosed.profiles, diagnosed.excitation);
    let page = diagnosis_page(diagnosis, &figures)?;
    let name = file.document().path().file_name().unwrap_or_default().to_string_lossy().replace(char::is_control, " ");
    // A sentence with line breaks would leave the comment.
    let summary = diagnosis.summary.replace(char::is_control, " ");
    let trued = format!(
        "# Made by `trueup diagnose` from {name}. {}: {summary}\n{}",
        diagnosis.verdict,
        diagnosed.trued.document(file)?.render(folder)?
    );
    let mut output = OutputFolder::create(folder, overwrite)?;
    for (name, text) in FILES.iter().zip([Some(json(diagnosis)?), Some(trued), Some(page), experiment]) {
        if let Some(text) = text {
            output.file(name, text.as_bytes())?;
        }
    }
    Ok(output.finish()?)
}

/// The commands of an experiment as a recording has them, under the name its command column has.
fn commands(excitation: &Excitation, file: &TwinFile) -> String {
    let column = file.channels.get("command").map_or("u", |channel| channel.column.as_str());
    let quoted = if column.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", column.replace('"', "\"\""))
    } else {
        column.to_owned()
    };
    let rows = excitation.time.iter().zip(&excitation.command).map(|(time, command)| format!("{time},{command}\n"));
    format!("t,{quoted}\n") + &rows.collect::<String>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mismatch_is_what_was_established() {
        let all = [Verdict::Named, Verdict::Ambiguous, Verdict::NoMismatch, Verdict::Unexplained, Verdict::NotExcited];
        assert_eq!(all.map(|verdict| FailOn::Mismatch.holds(verdict)), [true, true, false, true, false]);
        for verdict in all {
            let word = FailOn::from_str(&verdict.to_string(), false).unwrap();
            assert_eq!(all.map(|other| word.holds(other)), all.map(|other| other == verdict));
        }
    }
}
