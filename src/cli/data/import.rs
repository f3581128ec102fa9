//! `trueup data import`: the logs of brokers and bots in the form of this program.

use std::path::PathBuf;

use clap::Args;

use crate::io::{InputError, OutputFolder, Overwrite};
use crate::market::paper::PaperLog;
use crate::market::paper::import::import;

use super::super::log_arguments::LogArguments;
use super::super::screen::{self, Screen};
use super::super::stop::{Outcome, Stop};
use super::tape::TapeArguments;
use super::told::told;

/// Read a log of paper or live orders, as a broker or a bot wrote it, or make one of a market's tape
///
/// The format is told by the content: alpaca, binance, ccxt, freqtrade, hftbacktest, hummingbot, ibkr_flex, nautilus or
/// trueup. Numbers are read exactly; what cannot be read, and what must be known of a log before it is compared with
/// anything, is counted and said. Without --out nothing is written.
///
/// With --tape the files are a tape, and every order that took from the book becomes an order with its executions, for
/// `trueup diagnose DIR/assumed.toml --recording DIR`. A tape is order-by-order events (Bitstamp's, or the contract's), or trades
/// beside changes of the book with their snapshot, beside quotes, or both (Binance's, or the contract's).
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup data import tradesv3.sqlite --out logs/bot
  trueup data import orders.json activities.json --symbols symbols.toml --out logs/alpaca
  trueup data import flex.xml --zone America/New_York --fee-rate CAD/USD=0.785
  trueup data import --tape orders_2015-05-01.parquet --symbol BTCUSD --out tape
  trueup data import --tape trades.parquet depth.parquet snapshot.parquet --at-most 1000 --out tape")]
pub(super) struct Import {
    /// Files of the log or the tape, or folders of which all files are read together
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    log: LogArguments,
    /// Folder to write orders.parquet, fills.parquet and findings.json into, and of a tape quotes.parquet, trades.parquet and
    /// assumed.toml
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write over files that exist
    #[arg(long)]
    force: bool,
    /// Print findings.json (schema trueup.paper_log/1, of a tape trueup.tape_orders/1) on standard output instead of tables
    #[arg(long)]
    json: bool,
    // The last, since what comes after it would stand under its heading.
    #[command(flatten)]
    tape: TapeArguments,
}

/// The files that are written.
const FILES: [&str; 3] = ["orders.parquet", "fills.parquet", "findings.json"];

impl Import {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        if self.tape.is_asked_for() {
            self.log.check_unused()?;
            let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
            let text = self.tape.import(&self.paths, self.out.as_deref().map(|out| (out, overwrite)), self.json, screen)?;
            screen.print(&text)?;
            return Ok(Outcome::Done);
        }
        let settings = self.log.settings()?;
        let overwrite = if self.force { Overwrite::Force } else { Overwrite::Refuse };
        if let Some(folder) = &self.out {
            OutputFolder::create(folder, overwrite)?.check_free(&FILES)?;
        }
        let progress = screen.progress();
        progress.tell("Reading", 0, 0);
        let log = import(&self.paths, &settings)?;
        drop(progress);
        let json = format!("{}\n", serde_json::to_string_pretty(&log.summary())?);
        let mut text = if self.json { json.clone() } else { told(&log, screen) };
        match &self.out {
            Some(folder) => {
                let written = write(&log, &json, OutputFolder::create(folder, overwrite)?)?;
                if !self.json {
                    text += &screen::written(&written);
                }
            }
            None if !self.json => text += "\nNothing was written; --out DIR writes tables and findings.\n",
            None => {}
        }
        screen.print(&text)?;
        Ok(Outcome::Done)
    }
}

fn write(log: &PaperLog, json: &str, mut output: OutputFolder) -> Result<Vec<PathBuf>, InputError> {
    let [orders, fills, findings] = FILES;
    output.table(orders, &log.orders_table())?;
    output.table(fills, &log.fills_table())?;
    output.file(findings, json.as_bytes())?;
    output.finish()
}
