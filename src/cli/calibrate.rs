//! `trueup calibrate`: the parameters a twin has, refitted.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::io::{InputError, OutputFolder, Overwrite, TwinFile, write_file};
use crate::report::quantity::{axis, number, uncertain};
use crate::sim2real::Seed;
use crate::sim2real::diagnose::{Calibration, ChannelFit};

use super::case::Case;
use super::fitted::FittedTwin;
use super::screen::{Screen, titled};
use super::stop::{Outcome, Stop};

/// Fit the parameters a twin has to recordings, and add nothing to it
///
/// Parameters of uncertainty 0 stay as they are. Without --out nothing is written.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup calibrate twin.toml --recording train.csv --holdout test.csv --out calibrated.toml
  trueup calibrate twin.toml --recording train.csv --json")]
pub(super) struct Calibrate {
    /// TOML file of the twin, or of a run
    twin: PathBuf,
    /// Recordings to fit
    #[arg(long, value_name = "PATH", required = true, num_args = 1..)]
    recording: Vec<PathBuf>,
    /// Recordings for proof alone, which no fit sees [default: the last 30 % in time of each recording]
    #[arg(long, value_name = "PATH", num_args = 1..)]
    holdout: Vec<PathBuf>,
    /// File to write the calibrated twin into
    #[arg(long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
    /// Write over a file that exists
    #[arg(long)]
    force: bool,
    /// Print JSON (schema trueup.calibration/1) instead of tables
    #[arg(long)]
    json: bool,
    /// Seed of what is drawn: the resampling behind intervals
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

#[derive(Serialize)]
struct Listing<'a> {
    schema: &'static str,
    parameters: BTreeMap<String, Row<'a>>,
    fit: &'a [ChannelFit],
    held_out: &'a str,
}

#[derive(Serialize)]
struct Row<'a> {
    nominal: f64,
    value: f64,
    std: f64,
    unit: &'a str,
    frozen: bool,
    at_bound: bool,
}

impl Calibrate {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let file = TwinFile::read(&self.twin)?;
        let case = Case::read(&file, &self.recording, &self.holdout)?;
        if !case.has_free_parameters() {
            let error = file.error(&["twin"], "the twin has no parameter that a fit may move");
            return Err(error
                .hint("give a parameter an uncertainty above 0; `trueup diagnose` adds what is missing")
                .into());
        }
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        if let Some(path) = &self.out {
            check_output(path, overwrite)?;
        }
        let (calibration, twin) = case.calibrate(Seed(self.seed), &screen.progress());
        let mut text = if self.json { json(&calibration, &twin)? } else { told(screen, &calibration, &twin) };
        match &self.out {
            Some(path) => {
                let folder = path.parent().unwrap_or(Path::new(""));
                let name = self.twin.file_name().unwrap_or_default().to_string_lossy().replace(char::is_control, " ");
                let head = format!("# Made by `trueup calibrate` from {name}.\n");
                write_file(path, (head + &twin.document(&file)?.render(folder)?).as_bytes(), overwrite)?;
                if !self.json {
                    text += &format!("\nWritten: {}\n", path.display());
                }
            }
            None if !self.json => text += "\nNothing was written; --out FILE.toml writes the calibrated twin.\n",
            None => {}
        }
        screen.print(&text)?;
        Ok(Outcome::Done)
    }
}

/// Refuses before the work what would be refused after it.
fn check_output(path: &Path, overwrite: Overwrite) -> Result<(), InputError> {
    if path.extension().is_none_or(|ending| ending != "toml") {
        return Err(InputError::new(path, "expected a name that ends in .toml").hint("a twin is a TOML file"));
    }
    let folder = OutputFolder::create(path.parent().unwrap_or(Path::new("")), overwrite)?;
    folder.check_free(&[&path.file_name().unwrap_or_default().to_string_lossy()])
}

fn json(calibration: &Calibration, twin: &FittedTwin) -> Result<String, Stop> {
    let named = twin.named();
    let parameters = named.iter().map(|(name, p)| {
        let row =
            Row { nominal: p.nominal, value: p.value, std: p.std, unit: &p.unit, frozen: p.frozen, at_bound: p.at_bound };
        (name.clone(), row)
    });
    let listing = Listing {
        schema: "trueup.calibration/1",
        parameters: parameters.collect(),
        fit: &calibration.fit,
        held_out: &calibration.held_out,
    };
    Ok(format!("{}\n", serde_json::to_string_pretty(&listing)?))
}

fn told(screen: &Screen, calibration: &Calibration, twin: &FittedTwin) -> String {
    let mut parameters = screen.table(["parameter", "unit", ">as given", ">calibrated", ""]);
    for (name, p) in twin.named() {
        let remark = match () {
            () if p.frozen && p.nominal == 0.0 => "fixed: an uncertainty is a part of the value",
            () if p.frozen => "known exactly: not fitted",
            () if p.at_bound => "at its bound",
            () => "",
        };
        let value = if p.std > 0.0 { uncertain(p.value, p.std) } else { number(p.value) };
        parameters.add_row([name, p.unit.clone(), number(p.nominal), value, remark.to_owned()]);
    }
    let mut errors =
        screen.table(["channel", ">RMS as given", ">RMS calibrated", ">mean |e| as given", ">mean |e| calibrated"]);
    for fit in &calibration.fit {
        errors.add_row([
            axis(&fit.channel, &fit.unit),
            number(fit.nominal_rmse),
            number(fit.recalibrated_rmse),
            number(fit.nominal_mae),
            number(fit.recalibrated_mae),
        ]);
    }
    titled("Parameters", &parameters) + &titled(&format!("Errors on held-out data ({})", calibration.held_out), &errors)
}
