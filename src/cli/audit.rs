//! `trueup audit`: does a run see the future?

use std::path::PathBuf;

use clap::Args;

use crate::io::{InputError, RunFile};
use crate::market::{Audit, AuditSettings, AuditVerdict, BacktestError, History, KnownEarly, audit, explained, prepare_run};
use crate::sim2real::Seed;

use super::backtest::strategy;
use super::screen::{Screen, titled};
use super::stop::{Outcome, Stop};

/// Look for lookahead: change the future, and compare every earlier decision bit by bit
///
/// Runs the strategy on the data; then, for many instants, on data of which everything that becomes known later is cut off
/// or changed at random. Orders, refusals, fills and equity up to the instant must stay the same to the last bit. Fills must
/// not be older than their decisions nor lie outside what was traded or quoted, and bars must not be known before the quotes
/// of their last moment. Ends with exit code 1 if anything is found.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup audit data/bars/run.toml
  trueup audit run.toml --cuts 200 --json")]
pub(super) struct Look {
    /// TOML file of the run
    run: PathBuf,
    /// Number of instants after which the future is changed: half of them are times of orders
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    cuts: u32,
    /// Print the audit as JSON on standard output instead of tables
    #[arg(long)]
    json: bool,
    /// Seed of the instants and of the other futures
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
}

impl Look {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let file = RunFile::read(&self.run)?;
        // What cannot be built is said before the data are read.
        strategy(&file)?;
        let prepared = prepare_run(&file)?;
        let progress = screen.progress();
        let settings = AuditSettings { cuts: self.cuts as usize, seed: Seed(self.seed) };
        let make = |_: &[History]| strategy(&file).map_err(Unable::Build);
        let found = audit(&prepared.backtest, make, settings, &|done, of| progress.tell("auditing", done, of));
        let found = found.map_err(|error| match error {
            Unable::Build(error) => error,
            Unable::Run(error) => explained(&file, &error),
        })?;
        drop(progress);
        let text = if self.json { format!("{}\n", serde_json::to_string_pretty(&found)?) } else { told(screen, &found) };
        screen.print(&text)?;
        Ok(if found.verdict == AuditVerdict::Clean { Outcome::Done } else { Outcome::Finding })
    }
}

/// Why there is no audit.
enum Unable {
    Build(InputError),
    Run(BacktestError),
}

impl From<BacktestError> for Unable {
    fn from(error: BacktestError) -> Self {
        Self::Run(error)
    }
}

/// Rows of a table at most; --json has them all.
const SHOWN: usize = 12;

fn told(screen: &Screen, audit: &Audit) -> String {
    let mut text = format!("{}\n", screen.wrapped("", &audit.summary));
    let differing: Vec<_> = audit.cuts.iter().flat_map(|cut| cut.found.iter().map(move |found| (cut, found))).collect();
    let mut table = screen.table(["known up to", "then", "first difference", "of", "what", "was", "became"]);
    for (cut, (change, found)) in differing.iter().take(SHOWN) {
        table.add_row([
            cut.at.to_string(),
            change.words().to_owned(),
            found.time.to_string(),
            found.instrument.clone().unwrap_or_default(),
            found.subject.word().to_owned(),
            found.was.clone(),
            found.became.clone(),
        ]);
    }
    let runs = 2 * audit.cuts.len();
    if !differing.is_empty() {
        text += &titled(&format!("Decisions that depend on the future ({} of {runs} runs)", differing.len()), &table);
    } else if let (Some(first), Some(last)) = (audit.cuts.first(), audit.cuts.last()) {
        let mut table = screen.table([">instants", "from", "to", ">orders", ">fills", ">runs compared", ">that differ"]);
        let [cuts, decisions, fills, runs] = [audit.cuts.len(), audit.decisions, audit.fills, runs].map(|n| n.to_string());
        table.add_row([cuts, first.at.to_string(), last.at.to_string(), decisions, fills, runs, "0".to_owned()]);
        text += &titled("The future cut off, and changed", &table);
    }
    if !audit.impossible_fills.is_empty() {
        let mut table = screen.table([">order", "of", "decided", "filled", ">price", ">lowest", ">highest", "fault"]);
        for fault in audit.impossible_fills.iter().take(SHOWN) {
            let [low, high] =
                [fault.range.map(|r| r.0), fault.range.map(|r| r.1)].map(|p| p.map_or_else(String::new, |p| p.to_string()));
            table.add_row([
                fault.order_id.to_string(),
                fault.instrument.clone(),
                fault.decided_at.to_string(),
                fault.filled_at.to_string(),
                fault.price.to_string(),
                low,
                high,
                fault.fault.words().to_owned(),
            ]);
        }
        text += &titled(&format!("Fills that cannot be ({})", audit.impossible), &table);
    }
    if !audit.known_early.is_empty() {
        let mut table = screen.table(["bars of", ">known early [s]", ">closes nearer later", ">nearer then"]);
        for early in &audit.known_early {
            let KnownEarly { instrument, seconds, nearer_later, nearer_then } = early;
            table.add_row([instrument.clone(), seconds.to_string(), nearer_later.to_string(), nearer_then.to_string()]);
        }
        text += &titled("Bars known before they end", &table);
        text += "\nhint: correct `stamp` or `zone` of their [[data]]\n";
    }
    if !audit.untold.is_empty() {
        let symbols = audit.untold.join(", ");
        let note = format!(
            "With bars alone it cannot be told whether `stamp` says when they were known ({symbols}): quotes of the same instrument would tell."
        );
        text += &format!("\n{}\n", screen.wrapped("", &note));
    }
    text
}
