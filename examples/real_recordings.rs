//! Diagnoses the open recordings of real systems and prints `reports/real-recordings.md`:
//! `cargo run --release --example real_recordings -- FOLDER [NAME]`, where FOLDER holds `emps/`, `cascaded_tanks/`,
//! `silverbox/` and `bam_xl330/`. `./x real` does so.
#![allow(clippy::print_stdout, reason = "what it prints is what it is for")]

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use trueup::io::{Table, TwinFile};
use trueup::robot::{
    equations_assembly, equations_recordings, joint_assembly, joint_recordings, tanks_assembly, tanks_recordings,
};
use trueup::sim2real::diagnose::{Comparison, Diagnosis, Outcome, diagnose};
use trueup::sim2real::{Assembly, Plant, Recording, Seed};

/// One set of recordings.
#[derive(Clone, Copy)]
struct Set {
    name: &'static str,
    twin: &'static str,
    train: &'static [&'static str],
    test: &'static [&'static str],
    known: &'static str,
    published: &'static str,
    /// Factor from the channel's unit to the one figures are given in, and that unit.
    shown: (f64, &'static str),
    /// Mean absolute errors instead of root mean squares.
    absolute: bool,
}

const SETS: [Set; 6] = [
    Set {
        name: "emps",
        twin: "emps.toml",
        train: &["emps/train.csv"],
        test: &["emps/test_pulses.csv"],
        known: "Coulomb friction (20.4 N) and a constant force (3.2 N)",
        published: "4.6 to 6.0 (a quick fit of the known law)",
        shown: (1e3, "mm"),
        absolute: false,
    },
    Set {
        name: "cascaded_tanks",
        twin: "cascaded_tanks.toml",
        train: &["cascaded_tanks/train.csv"],
        test: &["cascaded_tanks/test.csv"],
        known: "overflow of the upper tank, part of it into the lower",
        published: "0.18 (grey box with overflow, Rogers 2017); .75 linear",
        shown: (1.0, "V"),
        absolute: false,
    },
    Set {
        name: "silverbox",
        twin: "silverbox.toml",
        train: &["train.csv"],
        test: &["multisine.csv", "arrow.csv"],
        known: "a cubic spring",
        published: "7.73 / 4.15 (SysIdentPy), .352 / .511 (cubic, in discrete time)",
        shown: (1e3, "mV"),
        absolute: false,
    },
    BAM[0],
    BAM[1],
    BAM[2],
];

const BAM: [Set; 3] = [
    bam("bam_kp100", &BAM_100, &["kp100_sin_time_square.csv"]),
    bam("bam_kp200", &BAM_200, &["kp200_sin_time_square.csv"]),
    bam("bam_kp400", &BAM_400, &["kp400_sin_time_square.csv"]),
];
const BAM_100: [&str; 3] = ["kp100_lift_and_drop.csv", "kp100_sin_sin.csv", "kp100_up_and_down.csv"];
const BAM_200: [&str; 3] = ["kp200_lift_and_drop.csv", "kp200_sin_sin.csv", "kp200_up_and_down.csv"];
const BAM_400: [&str; 3] = ["kp400_lift_and_drop.csv", "kp400_sin_sin.csv", "kp400_up_and_down.csv"];

const fn bam(name: &'static str, train: &'static [&'static str], test: &'static [&'static str]) -> Set {
    Set {
        name,
        twin: "bam_xl330.toml",
        train,
        test,
        known: "load-dependent friction of the gears, a delay of 7 ms, a zero offset of 0.025 rad",
        published: "mean absolute, all gains together: .0399 (M1), .0321 (M3), .0349 (M6)",
        shown: (1.0, "rad"),
        absolute: true,
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("give the folder of the recordings")?);
    let only = arguments.next();
    let scratch = tempfile::tempdir()?;
    let mut out = String::from(HEAD);
    for set in SETS.iter().filter(|set| only.as_deref().is_none_or(|name| set.name.starts_with(name))) {
        let begun = Instant::now();
        let told = match set.name {
            "silverbox" => {
                silverbox(&folder, scratch.path())?;
                run(set, scratch.path())?
            }
            name if name.starts_with("bam_") => {
                set.train.iter().chain(set.test).try_for_each(|file| with_gain(&folder, scratch.path(), file))?;
                run(set, scratch.path())?
            }
            _ => run(set, &folder)?,
        };
        eprintln!("{} {:.0} s\n{told}", set.name, begun.elapsed().as_secs_f64());
        out += &told;
    }
    println!("{out}{FOOT}");
    Ok(())
}

const HEAD: &str = "# Real recordings\n\nMade by `./x real`. Each twin is what a plain simulator of the system knows (in `tests/real_recordings/`); errors are \
those of a free run on recordings no fit has seen. Sources and licences of the recordings: Janot, Gautier & Brunot 2019 (EMPS); \
Schoukens & Noël 2017 (tanks); Wigren & Schoukens 2013 (Silverbox); Duclusaud et al., arXiv 2410.08650 (XL330).\n\n\
| recording | known from the literature | verdict and names | held out: as given / recalibrated / trued | published |\n|---|---|---|---|---|\n";
const FOOT: &str = "\nParameters are in the `trued.toml` that `trueup diagnose` writes for the same files.\n\n\
Where a published figure is better, this is what stands in the way.\n\n\
- `cascaded_tanks`: the published grey box has outflow laws of its own; the twin has Torricelli's and the overflow.\n\
- `bam_*`: the published fits are to all gains and all recordings together; here each gain has three recordings of some \
seconds. In closed loop what is left of them is one smooth curve, which holds little independent evidence: what is named is not \
sure, and where no law gains what is asked for, refitting what the twin has makes it worse than as given.\n";

fn run(set: &Set, folder: &Path) -> Result<String, Box<dyn Error>> {
    let twin = TwinFile::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/real_recordings").join(set.twin))?;
    let paths = |names: &[&str]| -> Vec<PathBuf> { names.iter().map(|name| folder.join(name)).collect() };
    let (train, test) = (paths(set.train), paths(set.test));
    Ok(match twin.model.as_str() {
        "tanks" => {
            let train = tanks_recordings(&twin, &train)?;
            told(set, &tanks_assembly(&twin, &train)?, &train, &tanks_recordings(&twin, &test)?)
        }
        "equations" => {
            let train = equations_recordings(&twin, &train)?;
            told(set, &equations_assembly(&twin, &train)?, &train, &equations_recordings(&twin, &test)?)
        }
        _ => told(set, &joint_assembly(&twin)?, &joint_recordings(&twin, &train)?, &joint_recordings(&twin, &test)?),
    })
}

fn told<P: Plant>(
    set: &Set,
    twin: &Assembly<P>,
    train: &[Recording<P::Stimulus>],
    test: &[Recording<P::Stimulus>],
) -> String {
    let outcome = diagnose(twin, train, test, Seed(0), &|_, _, _| {});
    let names = names(&outcome.diagnosis);
    let errors = errors(set, &outcome);
    format!("| {} | {} | `{}`: {names} | {errors} | {} |\n", set.name, set.known, outcome.diagnosis.verdict, set.published)
}

fn names(diagnosis: &Diagnosis) -> String {
    let one = |effect: &trueup::sim2real::diagnose::Effect| {
        let rivals: Vec<&str> = effect.rivals.iter().map(|r| r.mechanism.as_str()).collect();
        let rivals = if rivals.is_empty() { String::new() } else { format!(" (or {})", rivals.join(", ")) };
        format!("{}{rivals}", effect.mechanism)
    };
    let all: Vec<String> = diagnosis.effects.iter().map(one).collect();
    if all.is_empty() { "nothing".to_owned() } else { all.join(", ") }
}

/// Errors on each held-out recording.
fn errors<T>(set: &Set, outcome: &Outcome<T>) -> String {
    let mut out = String::new();
    for comparison in outcome.comparisons.iter().filter(|c| c.held_out && c.channel == outcome.diagnosis.fit[0].channel) {
        let (factor, unit) = set.shown;
        let of = |simulated: &[f64]| factor * error(comparison, simulated, set.absolute);
        let _ = write!(
            out,
            "{}{:.3} / {:.3} / **{:.3}** {unit}",
            if out.is_empty() { "" } else { "; " },
            of(&comparison.nominal),
            of(&comparison.recalibrated),
            of(&comparison.trued)
        );
    }
    out
}

fn error(comparison: &Comparison, simulated: &[f64], absolute: bool) -> f64 {
    let errors: Vec<f64> = comparison.measured.iter().zip(simulated).filter_map(|(m, s)| Some((*m)? - s)).collect();
    let count = errors.len().max(1) as f64;
    if absolute {
        errors.iter().map(|e| e.abs()).sum::<f64>() / count
    } else {
        (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt()
    }
}

/// Adds the column of the proportional gain, which the file's name says, to a recording of the servo; in what is commanded for an
/// error of 1 rad, by the law of its twin.
fn with_gain(folder: &Path, scratch: &Path, file: &str) -> Result<(), Box<dyn Error>> {
    let gain: f64 =
        file.strip_prefix("kp").and_then(|rest| rest.split('_').next()).ok_or("a file named kpN_...")?.parse()?;
    let kp = gain * 4096.0 / std::f64::consts::TAU / (256.0 * 885.0);
    let table = Table::read(folder.join("bam_xl330").join(file))?;
    let column = |name| table.floats_complete(name);
    let (t, goal, position, on) = (column("t")?, column("goal_rad")?, column("pos_rad")?, column("torque_enable")?);
    let mut text = String::from("t,goal_rad,pos_rad,torque_enable,kp\n");
    for row in 0..t.len() {
        let _ = writeln!(text, "{},{},{},{},{kp}", t[row], goal[row], position[row], on[row]);
    }
    std::fs::write(scratch.join(file), text)?;
    Ok(())
}

/// Cuts the Silverbox's recordings as those before did: part of the first three quarters of the multisine to learn from, the
/// last quarter and the arrow to test on.
fn silverbox(folder: &Path, scratch: &Path) -> Result<(), Box<dyn Error>> {
    let table = Table::read(folder.join("silverbox/snls80mv.parquet"))?;
    let (t, u, y) = (table.floats_complete("t")?, table.floats_complete("u_v")?, table.floats_complete("y_v")?);
    for (name, rows) in [("train.csv", 40_650..48_842), ("multisine.csv", 105_712..113_904), ("arrow.csv", 100..40_575)] {
        let mut text = String::from("t,u_v,y_v\n");
        for row in rows.clone() {
            let _ = writeln!(text, "{},{},{}", t[row] - t[rows.start], u[row], y[row]);
        }
        std::fs::write(scratch.join(name), text)?;
    }
    Ok(())
}
