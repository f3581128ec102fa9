//! `trueup demo`: the main job, with nothing but the program.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::conceal::{Content, Set, catalogue};
use crate::io::{OutputFolder, Overwrite, TwinFile};
use crate::sim2real::Seed;

use super::case::Case;
use super::data;
use super::diagnose::{FILES, effect_names, errors, headline, write};
use super::diagnosed::Diagnosed;
use super::screen::{Screen, titled};
use super::stop::{Outcome, Stop};

/// Conceal effects in a servo and in a market, and find them again
///
/// Makes two of the generated data sets, in which effects are concealed that their twins do not model; diagnoses both
/// through the same code; only then reads out what was concealed.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup demo
  trueup demo --out demo --force")]
pub(super) struct Demo {
    /// Folder to write the data sets and the reports into
    #[arg(long, value_name = "DIR", default_value = "trueup-demo")]
    out: PathBuf,
    /// Write over files that exist
    #[arg(long)]
    force: bool,
}

/// A set and how it is diagnosed: paths within its folder, which itself is the empty one.
struct Trial {
    set: &'static str,
    recording: &'static str,
    holdout: Option<&'static str>,
}

const TRIALS: [Trial; 2] = [
    Trial { set: "servo", recording: "train.csv", holdout: Some("test.csv") },
    Trial { set: "execution", recording: "", holdout: None },
];

/// Folder of a set that its diagnosis goes into.
const DIAGNOSIS: &str = "diagnosis";

impl Demo {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        let sets = catalogue();
        let chosen: Vec<(&Trial, &Set)> =
            TRIALS.iter().filter_map(|trial| Some((trial, sets.iter().find(|set| set.name == trial.set)?))).collect();
        let mut folders = Vec::new();
        for (trial, set) in &chosen {
            folders.push(data::prepared(set, &self.out.join(trial.set), overwrite)?);
            OutputFolder::create(self.out.join(trial.set).join(DIAGNOSIS), overwrite)?.check_free(&FILES)?;
        }
        for folder in folders {
            folder.finish()?;
        }
        for (trial, set) in chosen {
            self.show(screen, trial, set, overwrite)?;
        }
        Ok(Outcome::Done)
    }

    fn show(&self, screen: &Screen, trial: &Trial, set: &Set, overwrite: Overwrite) -> Result<(), Stop> {
        let folder = self.out.join(trial.set);
        screen.print(&format!("{}\n\n", heading(&again(trial, &folder))))?;
        let file = TwinFile::read(folder.join("twin.toml"))?;
        let held_out: Vec<PathBuf> = trial.holdout.iter().map(|name| folder.join(name)).collect();
        let case = Case::read(&file, &[inside(&folder, trial.recording)], &held_out)?;
        let diagnosed = case.diagnose(Seed(0), &screen.progress());
        let mut text = found(screen, &diagnosed);
        if let Some(told) = concealed(set) {
            text += &format!("\nWhat the generator had concealed\n\n{told}\n");
        }
        let paths = write(diagnosed, &folder.join(DIAGNOSIS), overwrite)?;
        if let Some(report) = paths.iter().find(|path| path.extension().is_some_and(|ending| ending == "html")) {
            text += &format!("\nReport: {}\n\n", report.display());
        }
        screen.print(&text)
    }
}

/// A path in `folder`; the folder itself for an empty name.
fn inside(folder: &Path, name: &str) -> PathBuf {
    if name.is_empty() { folder.to_path_buf() } else { folder.join(name) }
}

/// The command that does the same again.
fn again(trial: &Trial, folder: &Path) -> String {
    let holdout = trial.holdout.map_or_else(String::new, |name| format!(" --holdout {}", folder.join(name).display()));
    let recording = inside(folder, trial.recording);
    format!("trueup diagnose {} --recording {}{holdout}", folder.join("twin.toml").display(), recording.display())
}

fn heading(command: &str) -> String {
    format!("$ {command}")
}

fn found(screen: &Screen, diagnosed: &Diagnosed) -> String {
    let diagnosis = &diagnosed.diagnosis;
    let mut text = format!("{}\n", headline(screen, diagnosis));
    text += &format!("\nFound missing: {}\n", effect_names(diagnosis));
    text + &titled(&format!("Errors on held-out data ({})", diagnosis.held_out), &errors(screen, &diagnosis.fit))
}

/// What the set's own words say is concealed in it.
fn concealed(set: &Set) -> Option<String> {
    let readme = set.files.iter().find_map(|(name, content)| match content {
        Content::Text(words) if *name == "README.md" => Some(words),
        _ => None,
    })?;
    let (_, told) = readme.split_once("## What is concealed\n")?;
    let lines: Vec<String> = told.trim().lines().map(|line| format!("  {line}")).collect();
    Some(lines.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_trial_has_a_set_that_tells_what_it_conceals() {
        let sets = catalogue();
        for trial in &TRIALS {
            let set = sets.iter().find(|set| set.name == trial.set).unwrap();
            assert!(concealed(set).is_some_and(|told| told.len() > 20), "{}", trial.set);
        }
    }
}
