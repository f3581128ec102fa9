//! `trueup prove`: the blind benchmark.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use clap::{Args, ValueEnum};

use crate::io::{OutputFolder, Overwrite};
use crate::proof::{
    Domain as Concealing, Header, JOURNAL, Line, Sealed, Standing, Summary, TEST_SEEDS, Trial, figures_table, readme,
    seal_of_all,
};
use crate::sim2real::Seed;

use super::screen::{Progress, Screen, titled};
use super::stop::{Outcome, Stop};

mod cases;
mod kept;
mod record;

use cases::Cases;
use record::{Record, Start};

/// Conceal effects, diagnose blind, unseal and score: how often a diagnosis is right
///
/// Draws cases, each a joint or two days of orders with something concealed in them or with nothing, seals their labels by SHA-256, diagnoses them,
/// and only then unseals and scores them, beside recalibration alone, sparse regression, and a fit that is told the names.
///
/// Seeds below 1000 are for development; those from 1000 on are for tests, of whose cases nothing is to be learnt. A case is
/// written to cases.jsonl as soon as it is done, so that --resume can go on after an interruption; the other files appear
/// together at the end.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup prove
  trueup prove --cases 40 --seed 3 --keep      # writes the recordings too, for `trueup diagnose`
  trueup prove --seed 1000 --out proof         # a test seed; after an interruption, the same with --resume")]
pub(super) struct Prove {
    /// What to conceal effects in
    #[arg(long, value_enum, default_value_t = Domain::Robot)]
    domain: Domain,
    /// Number of cases
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    cases: u32,
    /// Seed of all cases: below 1000 for development, from 1000 on for tests
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Folder to write cases.jsonl, summary.json, figures.md, README.md and report.html into
    #[arg(long, value_name = "DIR", default_value = "trueup-prove")]
    out: PathBuf,
    /// Write over files that exist, and begin anew
    #[arg(long)]
    force: bool,
    /// Go on with the cases.jsonl that is there
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Write the twin, the recordings and the label of every case into cases/ as well
    #[arg(long)]
    keep: bool,
    /// Print summary.json on standard output instead of tables
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Domain {
    /// Joints of every kind
    Robot,
    /// Days of orders
    Market,
}

impl From<Domain> for Concealing {
    fn from(domain: Domain) -> Self {
        match domain {
            Domain::Robot => Self::Robot,
            Domain::Market => Self::Market,
        }
    }
}

/// Threads of a diagnosis: its time is told of two cores.
const THREADS: usize = 2;
/// The files that appear at the end.
const FILES: [&str; 4] = ["summary.json", "figures.md", "README.md", "report.html"];

impl Prove {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        // Before the work rather than after it.
        let mut output = OutputFolder::create(&self.out, overwrite)?;
        output.check_free(&FILES)?;
        let path = self.out.join("cases.jsonl");
        let start = if self.resume { Start::Resume } else { Start::Anew(overwrite) };
        record::check(&path, start)?;

        let domain = Concealing::from(self.domain);
        let (cases, sealed) = Cases::draw(domain, Seed(self.seed), self.cases as usize, &screen.progress())?;
        let header = Header {
            schema: JOURNAL.to_owned(),
            domain,
            seed: self.seed,
            cases: cases.len(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seals: sealed.iter().map(|sealed| sealed.seal.clone()).collect(),
        };
        let record = Record::open(&path, &header, start)?;
        if !self.json {
            screen.print(&told_before(&header, self.seed, record.done()))?;
        }
        diagnosed(&cases, &sealed, &record, &screen.progress())?;

        let summary = Summary::of(&record.read()?).map_err(|error| Stop::Bug(error.to_string()))?;
        let json = format!("{}\n", serde_json::to_string_pretty(&summary)?);
        output.file("summary.json", json.as_bytes())?;
        output.file("figures.md", figures_table(&summary).as_bytes())?;
        output.file("README.md", readme(&summary).as_bytes())?;
        output.file("report.html", summary.page()?.as_bytes())?;
        if self.keep {
            kept::write(&cases, &sealed, &self.out.join("cases"), overwrite, &screen.progress())?;
        }
        let paths = output.finish()?;
        let mut text = if self.json { json } else { told(screen, &summary) };
        if !self.json {
            std::iter::once(&path).chain(&paths).for_each(|path| text += &format!("Written: {}\n", path.display()));
        }
        screen.print(&text)?;
        Ok(Outcome::Done)
    }
}

/// Diagnoses what `record` does not hold yet. Cases are begun in order and written in order.
///
/// As many are under way at once as have [`THREADS`] each, in a pool of their own: were the cases tasks of one parallel loop, a diagnosis
/// that waits for a part of its own might be given another case to do meanwhile, and its time would be that of both.
fn diagnosed(cases: &Cases, sealed: &[Sealed], record: &Record, progress: &Progress) -> Result<(), Stop> {
    let clock = Instant::now();
    let next = AtomicUsize::new(record.done());
    let waiting = Mutex::new(Waiting { next: record.done(), done: BTreeMap::new(), failed: None });
    progress.tell("diagnosing", record.done(), cases.len());
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= cases.len() {
                return;
            }
            let trial = cases.get(index).tried(&|| clock.elapsed().as_secs_f64());
            let Ok(mut waiting) = waiting.lock() else { return };
            match trial {
                Ok(trial) => drop(waiting.done.insert(index, trial)),
                Err(error) => waiting.failed = Some(Stop::Bug(format!("case {index} cannot be read: {error}"))),
            }
            waiting.write(sealed, record);
            progress.tell("diagnosing", waiting.next, cases.len());
            if waiting.failed.is_some() {
                return;
            }
        }
    };
    let threads = rayon::current_num_threads();
    let pool = || rayon::ThreadPoolBuilder::new().num_threads(THREADS.min(threads)).build();
    let pools: Result<Vec<_>, _> = (0..(threads / THREADS).max(1)).map(|_| pool()).collect();
    let pools = pools.map_err(|error| Stop::Bug(format!("no threads to diagnose with: {error}")))?;
    std::thread::scope(|scope| pools.iter().for_each(|pool| drop(scope.spawn(|| pool.install(work)))));
    match waiting.into_inner().map(|waiting| waiting.failed) {
        Ok(None) => Ok(()),
        Ok(Some(stop)) => Err(stop),
        Err(_) => Err(Stop::Bug("a thread has stopped while it wrote".to_owned())),
    }
}

/// Cases that are done, while one before them is not.
struct Waiting {
    next: usize,
    done: BTreeMap<usize, Trial>,
    failed: Option<Stop>,
}

impl Waiting {
    fn write(&mut self, sealed: &[Sealed], record: &Record) {
        while let Some(trial) = self.done.remove(&self.next) {
            if self.failed.is_none() {
                self.failed = record.append(&Line::new(self.next, &sealed[self.next], trial)).err();
            }
            self.next += 1;
        }
    }
}

fn told_before(header: &Header, seed: u64, done: usize) -> String {
    let kind = if seed < TEST_SEEDS { "development" } else { "test" };
    let already = if done > 0 { format!(", {done} of them diagnosed already") } else { String::new() };
    format!(
        "{} cases of seed {seed}, a {kind} seed{already}. Their labels are sealed:\n{}\n",
        header.cases,
        seal_of_all(&header.seals)
    )
}

fn told(screen: &Screen, summary: &Summary) -> String {
    let mut table =
        screen.table(["figure", ">trueup (95 %)", ">of", ">least, aim", "", ">recalib.", ">regress.", ">oracle"]);
    for figure in &summary.figures {
        let standing = match figure.standing {
            Standing::Aim => "aim",
            Standing::Least => "least",
            Standing::Missed => "missed",
            Standing::Open => "",
        };
        table.add_row([
            figure.name.clone(),
            figure.shown(),
            figure.of.to_string(),
            figure.wanted_short(),
            standing.to_owned(),
            figure.beside(figure.recalibration),
            figure.beside(figure.regression),
            figure.beside(figure.oracle),
        ]);
    }
    let mut worst = screen.table([">case", "concealed", "said"]);
    for failure in summary.failures.iter().take(5) {
        worst.add_row([failure.index.to_string(), failure.truth.clone(), failure.said.clone()]);
    }
    let mut text = format!("\n{}\n", screen.wrapped("", &summary.headline())) + &titled("Figures", &table);
    if !summary.failures.is_empty() {
        text += &titled("The worst answers", &worst);
    }
    text + "\nWhat each figure is of stands in figures.md.\n\n"
}
