//! `trueup rollout`: a recording followed by many draws of a twin.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::{Args, ValueEnum};
use serde::Serialize;

use crate::io::{InputError, OutputFolder, OutputTable, Overwrite, RandomizedTwin, TwinFile, hint_among, randomized_twin};
use crate::report::quantity::{axis, number, percent, significant, whole_percent};
use crate::report::{Badge, Fan, FanBand, FanTime, Listing, RolloutPage, Tone};
use crate::robot::{
    cart_pole_assembly, cart_pole_recordings, equations_assembly, equations_recordings, joint_assembly, joint_recordings,
    robot_presets, tanks_assembly, tanks_recordings,
};
use crate::sim2real::randomize::{
    BANDS, Bands, Coverage, DrawTable, OUTSIDE, Predicted, Randomized, WIDEST, ensemble, quantiles,
};
use crate::sim2real::{Assembly, Plant, Recording, Seed, Simulator};

use super::screen::{self, Progress, Screen, titled};
use super::stop::{Outcome, Stop};

/// Follow recordings with many draws of a twin, and say whether they cover what was measured
///
/// What is drawn is said by [randomize] in the twin, or by the [posterior] of a trued.toml. Each draw follows the recording with
/// parameters of its own; the measurement noise, estimated from the recording, is added. Draws cover a recording where next to
/// nothing of it lies outside the band that 99 % of them make: a policy or a controller that copes with all draws then has met
/// what was recorded.
///
/// Without --out nothing is written.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup diagnose twin.toml --recording train.csv --out diagnosis
  trueup rollout diagnosis/trued.toml --recording test.csv --out covered
  trueup rollout twin.toml --recording test.csv --draws 500 --fail-on not_covered    # exit code 1 if they do not")]
pub(super) struct Rollout {
    /// TOML file of the twin
    twin: PathBuf,
    /// Recordings to follow
    #[arg(long, value_name = "PATH", required = true, num_args = 1..)]
    recording: Vec<PathBuf>,
    /// Number of draws
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(20..=100_000))]
    draws: u32,
    /// Folder to write rollout.json, draws.parquet, bands.parquet and report.html into
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write over files that exist
    #[arg(long)]
    force: bool,
    /// Print rollout.json on standard output instead of tables
    #[arg(long)]
    json: bool,
    /// End with exit code 1 if draws do not cover a recording
    #[arg(long, value_name = "FINDING")]
    fail_on: Option<FailOn>,
    /// Seed of the draws
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
}

/// What a caller may ask to fail on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
enum FailOn {
    NotCovered,
}

const FILES: [&str; 4] = ["rollout.json", "draws.parquet", "bands.parquet", "report.html"];
const MODELS: [&str; 4] = ["joint", "cart_pole", "tanks", "equations"];

/// What came of all draws.
struct Rolled {
    predicted: Vec<Predicted>,
    drawn: DrawTable,
    randomized: Vec<Randomized>,
    units: Vec<String>,
    notes: Vec<String>,
    level: f64,
}

/// `rollout.json`.
#[derive(Serialize)]
struct Told<'a> {
    schema: &'static str,
    version: &'static str,
    seed: u64,
    draws: usize,
    level: f64,
    covered: bool,
    summary: &'a str,
    coverage: &'a [Coverage],
    drawn: Vec<DrawnParameter>,
    notes: &'a [String],
}

/// What was drawn of a parameter.
#[derive(Serialize)]
struct DrawnParameter {
    name: String,
    unit: String,
    distribution: &'static str,
    /// None where it is infinite, and does nothing.
    nominal: Option<f64>,
    /// At the parts 0.025, 0.25, 0.5, 0.75 and 0.975.
    quantiles: Vec<f64>,
}

/// The parts below which quantiles of parameters are told.
const PARTS: [f64; 5] = [0.025, 0.25, 0.5, 0.75, 0.975];

impl Rollout {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let file = TwinFile::read(&self.twin)?;
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        if let Some(folder) = &self.out {
            OutputFolder::create(folder, overwrite)?.check_free(&FILES)?;
        }
        let progress = screen.progress();
        let rolled = self.rolled(&file, &progress)?;
        drop(progress);
        let coverage: Vec<Coverage> = rolled.predicted.iter().filter_map(Predicted::coverage).collect();
        if coverage.is_empty() {
            let error = file.error(&["randomize"], "no draw stays within bounds on these recordings");
            return Err(error.hint("draw from narrower ranges, or set a lower level").into());
        }
        let covered = coverage.iter().all(|one| one.covered);
        let summary = summary(&coverage, self.draws);
        let json = self.json(&rolled, &coverage, covered, &summary)?;
        let mut text = if self.json { json.clone() } else { told(screen, &rolled, &coverage, &summary) };
        if let Some(folder) = &self.out {
            let paths = write(folder, overwrite, &rolled, &coverage, &summary, &json)?;
            if !self.json {
                text += &screen::written(&paths);
            }
        } else if !self.json {
            text += "\nNothing was written; --out DIR writes draws, bands and a report.\n";
        }
        screen.print(&text)?;
        let finding = self.fail_on == Some(FailOn::NotCovered) && !covered;
        Ok(if finding { Outcome::Finding } else { Outcome::Done })
    }

    /// Reads the recordings, and follows them with all draws.
    fn rolled(&self, file: &TwinFile, progress: &Progress) -> Result<Rolled, InputError> {
        match file.model.as_str() {
            "joint" => self.followed(file, &joint_assembly(file)?, &joint_recordings(file, &self.recording)?, progress),
            "cart_pole" => {
                self.followed(file, &cart_pole_assembly(file)?, &cart_pole_recordings(file, &self.recording)?, progress)
            }
            "tanks" => {
                let recordings = tanks_recordings(file, &self.recording)?;
                self.followed(file, &tanks_assembly(file, &recordings)?, &recordings, progress)
            }
            "equations" => {
                let recordings = equations_recordings(file, &self.recording)?;
                self.followed(file, &equations_assembly(file, &recordings)?, &recordings, progress)
            }
            "execution" => {
                let error = file.error(&["twin", "model"], "orders are no motion that can be followed over time");
                Err(error.hint("`trueup backtest RUN.toml --draws 200` draws how orders are executed"))
            }
            other => {
                let error = file.error(&["twin", "model"], format!("there is no model `{other}`"));
                Err(error.maybe_hint(hint_among(other, &MODELS)))
            }
        }
    }

    fn followed<P: Plant>(
        &self,
        file: &TwinFile,
        assembly: &Assembly<P>,
        recordings: &[Recording<P::Stimulus>],
        progress: &Progress,
    ) -> Result<Rolled, InputError> {
        let presets = robot_presets();
        let twin: RandomizedTwin<P> =
            randomized_twin(assembly, file.document(), file.randomize.as_ref(), file.posterior.as_ref(), &presets)?;
        twin.check_drawn_once(file.document())?;
        let (drawn, lanes) = twin.draw(Seed(self.seed), self.draws as usize);
        let nominal: Vec<f64> = twin.assembly.parameters().iter().map(|p| p.nominal).collect();
        let (done, of) = (AtomicUsize::new(0), (lanes.len() + 1) * recordings.len());
        let tell = |more: usize| progress.tell("following", done.fetch_add(more, Ordering::Relaxed) + more, of);
        let follow = |recording| ensemble(&twin.assembly, &nominal, &lanes, recording, Seed(self.seed), &tell);
        let predicted = recordings.iter().flat_map(follow).collect();
        let mut notes = twin.notes.clone();
        notes.extend(random(&twin));
        let own = twin.assembly.own().len();
        let unit = |(place, one): (&usize, &Randomized)| match *place < own {
            true => one.parameter.unit.clone().into_owned(),
            false => twin.assembly.unit(&one.parameter.unit),
        };
        let randomized = twin.randomizer.randomized();
        Ok(Rolled {
            units: twin.places.iter().zip(randomized).map(unit).collect(),
            randomized: randomized.to_vec(),
            level: twin.level.get(),
            predicted,
            drawn,
            notes,
        })
    }

    fn json(&self, rolled: &Rolled, coverage: &[Coverage], covered: bool, summary: &str) -> Result<String, Stop> {
        let parameter = |(k, one): (usize, &Randomized)| DrawnParameter {
            name: one.target.to_string(),
            unit: rolled.units[k].clone(),
            distribution: one.distribution.name(),
            nominal: Some(one.parameter.nominal).filter(|nominal| nominal.is_finite()),
            quantiles: quantiles(rolled.drawn.row(k), &PARTS).unwrap_or_default(),
        };
        let told = Told {
            schema: "trueup.rollout/1",
            version: env!("CARGO_PKG_VERSION"),
            seed: self.seed,
            draws: self.draws as usize,
            level: rolled.level,
            covered,
            summary,
            coverage,
            drawn: rolled.randomized.iter().enumerate().map(parameter).collect(),
            notes: &rolled.notes,
        };
        Ok(format!("{}\n", serde_json::to_string_pretty(&told)?))
    }
}

/// A word on randomized mechanisms that draw themselves: no recording can be followed in what they do.
fn random<P: Plant>(twin: &RandomizedTwin<P>) -> Option<String> {
    let mechanisms = twin.assembly.mechanisms();
    let silent: Vec<&str> = mechanisms
        .filter(|(row, form, _)| !row.followed(*form))
        .map(|(row, ..)| row.about().name)
        .filter(|id| {
            let of = |one: &Randomized| one.target.mechanism.as_deref() == Some(*id);
            twin.randomizer.randomized().iter().any(of)
        })
        .collect();
    let names = silent.join("`, `");
    (!silent.is_empty())
        .then(|| format!("`{names}` draws by itself and is left out of what is followed: the noise floor stands for it"))
}

/// What came of it, in a sentence or two.
fn summary(coverage: &[Coverage], draws: u32) -> String {
    let worst = coverage.iter().max_by(|a, b| a.outside.total_cmp(&b.outside));
    match worst {
        Some(worst) if !worst.covered => {
            let since = worst.first_outside.map_or_else(String::new, |t| format!(", first at t = {} s", number(t)));
            format!(
                "The draws do not cover the recording: {} of the samples of {} in {} lie outside the {} band{since}.",
                percent(worst.outside),
                worst.channel,
                worst.recording,
                whole_percent(WIDEST)
            )
        }
        Some(worst) => format!(
            "The {draws} draws cover the recording: at most {} of the samples of a channel lie outside the {} band.",
            percent(worst.outside),
            whole_percent(WIDEST)
        ),
        None => String::new(),
    }
}

/// What to do where draws do not cover a recording.
fn hint(coverage: &[Coverage]) -> Option<String> {
    let missed = coverage.iter().any(|one| !one.covered);
    missed.then(|| {
        "hint: what was recorded would surprise whatever was trained on these draws: `trueup diagnose` tells which physics is \
         missing, and its posterior which ranges hold it"
            .to_owned()
    })
}

fn coverage_listing(coverage: &[Coverage]) -> Listing {
    let bands = BANDS.iter().chain([&WIDEST]).map(|band| format!("in {}", whole_percent(*band)));
    let heads = ["recording", "channel", "samples"].map(str::to_owned).into_iter().chain(bands);
    let row = |one: &Coverage| {
        let head = [one.recording.clone(), axis(&one.channel, &one.unit), one.samples.to_string()];
        let shares = one.within.iter().map(|share| percent(share.share));
        let first = one.first_outside.map_or_else(|| "\u{2013}".to_owned(), number);
        head.into_iter().chain(shares).chain([number(one.width), number(one.noise_floor), first]).collect()
    };
    let tail = ["95 % band is wide", "noise floor", "first outside [s]"].map(str::to_owned);
    Listing { heads: heads.chain(tail).collect(), rows: coverage.iter().map(row).collect() }
}

fn parameters_listing(rolled: &Rolled) -> Listing {
    let heads = ["parameter", "unit", "distribution", "nominal", "2.5 %", "25 %", "median", "75 %", "97.5 %"];
    let row = |(k, one): (usize, &Randomized)| {
        let head = [
            one.target.to_string(),
            rolled.units[k].clone(),
            one.distribution.name().to_owned(),
            significant(one.parameter.nominal, 4),
        ];
        let told = quantiles(rolled.drawn.row(k), &PARTS).unwrap_or_default();
        head.into_iter().chain(told.into_iter().map(|value| significant(value, 4))).collect()
    };
    Listing { heads: heads.map(str::to_owned).to_vec(), rows: rolled.randomized.iter().enumerate().map(row).collect() }
}

fn about(rolled: &Rolled) -> Vec<String> {
    let level = if rolled.level < 1.0 { format!(" at level {}", number(rolled.level)) } else { String::new() };
    vec![format!(
        "{} draws{level}, each started from the state from which it fits the first rows best. Bands hold draws and measurement \
         noise together; draws cover a recording where at most {} of its samples lie outside the {} band.",
        rolled.drawn.environments(),
        whole_percent(OUTSIDE),
        whole_percent(WIDEST)
    )]
}

fn told(screen: &Screen, rolled: &Rolled, coverage: &[Coverage], summary: &str) -> String {
    let mut text = format!("{}\n", screen.wrapped("", summary));
    if let Some(hint) = hint(coverage) {
        text += &format!("{}\n", screen.wrapped("  ", &hint));
    }
    text += &titled("Samples within each band", &screen.listing(&coverage_listing(coverage)));
    text += &titled("What was drawn", &screen.listing(&parameters_listing(rolled)));
    for note in about(rolled) {
        text += &format!("\n{}\n", screen.wrapped("", &note));
    }
    for note in &rolled.notes {
        text += &format!("{}\n", screen.wrapped("- ", &format!("{note}.")));
    }
    text
}

fn write(
    folder: &Path,
    overwrite: Overwrite,
    rolled: &Rolled,
    coverage: &[Coverage],
    summary: &str,
    json: &str,
) -> Result<Vec<PathBuf>, Stop> {
    let bands: Vec<(&Predicted, Bands)> = rolled.predicted.iter().filter_map(|one| Some((one, one.bands()?))).collect();
    let covered = coverage.iter().all(|one| one.covered);
    let (text, tone) = if covered { ("covered", Tone::Good) } else { ("not covered", Tone::Bad) };
    let page = RolloutPage {
        title: summary.to_owned(),
        badge: Badge { text: text.to_owned(), tone },
        about: about(rolled).into_iter().chain(hint(coverage)).collect(),
        fans: bands.iter().map(|(predicted, bands)| fan(predicted, bands)).collect(),
        coverage: coverage_listing(coverage),
        parameters: parameters_listing(rolled),
        notes: rolled.notes.clone(),
    };
    let mut output = OutputFolder::create(folder, overwrite)?;
    let [summary_file, draws_file, bands_file, page_file] = FILES;
    output.file(summary_file, json.as_bytes())?;
    output.table(draws_file, &draws_table(rolled))?;
    output.table(bands_file, &bands_table(&bands))?;
    output.file(page_file, page.render()?.as_bytes())?;
    Ok(output.finish()?)
}

fn fan(predicted: &Predicted, bands: &Bands) -> Fan {
    let band = |(part, [low, high]): (&f64, &[Vec<f64>; 2])| FanBand { part: *part, low: low.clone(), high: high.clone() };
    Fan {
        caption: format!("{}: {}", predicted.recording, predicted.channel),
        quantity: (predicted.channel.clone(), predicted.unit.clone()),
        time: FanTime::Seconds(bands.rows.iter().map(|row| predicted.time[*row]).collect()),
        median: bands.median.clone(),
        bands: BANDS.iter().zip(&bands.ends).map(band).collect(),
        nominal: bands.rows.iter().map(|row| predicted.nominal[*row]).collect(),
        measured: Some((predicted.time.clone(), predicted.measured.clone())),
    }
}

/// `draws.parquet`: a row a draw, with its number and what was drawn by name.
fn draws_table(rolled: &Rolled) -> OutputTable {
    let count = rolled.drawn.environments();
    let table = OutputTable::new().integers("draw", (0..count).map(|k| k as i64));
    rolled.drawn.targets().iter().enumerate().fold(table, |table, (k, target)| {
        let finite = |value: &f64| Some(*value).filter(|value| value.is_finite());
        table.floats(&target.to_string(), rolled.drawn.row(k).iter().map(finite))
    })
}

/// `bands.parquet`: a row a channel and a time shown: `recording, channel, t, measured, nominal, median`, and the ends of each
/// band, `low_50, high_50` and so on.
fn bands_table(all: &[(&Predicted, Bands)]) -> OutputTable {
    let rows = || all.iter().flat_map(|(predicted, bands)| bands.rows.iter().map(move |row| (*predicted, *row)));
    let table = OutputTable::new()
        .texts("recording", rows().map(|(predicted, _)| predicted.recording.clone()))
        .texts("channel", rows().map(|(predicted, _)| predicted.channel.clone()))
        .floats("t", rows().map(|(predicted, row)| predicted.time[row]))
        .floats("measured", rows().map(|(predicted, row)| predicted.measured[row]))
        .floats("nominal", rows().map(|(predicted, row)| predicted.nominal[row]))
        .floats("median", all.iter().flat_map(|(_, bands)| bands.median.iter().copied()));
    BANDS.iter().enumerate().fold(table, |table, (k, band)| {
        let end = |side: usize| all.iter().flat_map(move |(_, bands)| bands.ends[k][side].iter().copied());
        table.floats(&format!("low_{:.0}", 100.0 * band), end(0)).floats(&format!("high_{:.0}", 100.0 * band), end(1))
    })
}
