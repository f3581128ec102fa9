//! Reconciles open dry-run logs of a bot with its candles and prints `reports/paper-logs.md`:
//! `cargo run --release --example paper_logs -- FOLDER`, where FOLDER holds the logs of freqtrade. `./x logs` does so.
#![allow(clippy::print_stdout, reason = "what it prints is what it is for")]

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use trueup::io::RunFile;
use trueup::market::paper::PaperLog;
use trueup::market::paper::import::{ImportSettings, import};
use trueup::market::prepare_run;
use trueup::market::reconcile::{Cause, Compared, Histories, Lives, Reconciliation, cause_name, lives, reconcile, replay};
use trueup::sim2real::Seed;

/// A log and the candles beside it.
struct Set {
    folder: &'static str,
    /// The finest candles that cover the log.
    candles: &'static str,
    symbols: &'static [&'static str],
    /// Commission of the venue the bot was configured for [bps].
    commission: f64,
}

const SETS: [Set; 3] = [
    Set { folder: "gtudor33_dryrun_binanceus_2021-12", candles: "3m", symbols: &["SHIB/USDT"], commission: 10.0 },
    Set {
        folder: "roger_dryrun_kucoin_2026-04",
        candles: "1h",
        symbols: &["AAVE/USDT", "ARKM/USDT", "ENA/USDT", "FET/USDT", "H/USDT", "JUP/USDT", "SIREN/USDT"],
        commission: 10.0,
    },
    Set { folder: "th2002_dryrun_2024-07", candles: "5m", symbols: &["BTC/USDT", "ETH/USDT"], commission: 10.0 },
];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name the folder of the logs")?);
    // Runs are written elsewhere, and name their candles from there.
    let folder = folder.canonicalize().map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut text = String::from(HEAD);
    let mut details = String::new();
    for set in &SETS {
        let (log, found) = reconciled(set, &folder)?;
        row(&mut text, set, &log, &found)?;
        detail(&mut details, set, &found)?;
    }
    print!("{text}{WHAT_CANDLES_SAY}{details}");
    Ok(())
}

/// The log's own orders beside what a backtest on the candles makes of them.
fn reconciled(set: &Set, folder: &Path) -> Result<(PaperLog, Reconciliation), Box<dyn Error>> {
    let own = folder.join(set.folder);
    let log = import(&[own.join("tradesv3.sqlite")], &ImportSettings::default())?;
    let file = tempfile::Builder::new().suffix(".toml").tempfile()?;
    std::fs::write(file.path(), run(set, &own)?)?;
    let prepared = prepare_run(&RunFile::read(file.path())?)?;
    let all = lives(&log)?;
    let replayed = replay(prepared.start()?, set.symbols, &all.orders)?;
    let (orders, executed): (Vec<_>, Vec<_>) =
        all.orders.into_iter().zip(replayed.orders).filter(|(_, own)| own.is_some()).unzip();
    let backtest = Lives { orders: executed.iter().flatten().cloned().collect(), notes: Vec::new() };
    let paper = Lives { orders, notes: all.notes };
    let histories = Histories::new(set.symbols, prepared.backtest.histories());
    let compared =
        Compared { backtest: &backtest, paper: &paper, replayed: Some(&executed), showing: Some(&histories), seed: Seed(1) };
    Ok((log, reconcile(&compared)?))
}

/// The run on the candles: orders meet the open of the next one.
fn run(set: &Set, folder: &Path) -> Result<String, std::fmt::Error> {
    let mut text = String::from("[run]\nseed = 1\ncash = 1_000_000_000\ncurrency = \"USDT\"\n");
    for symbol in set.symbols {
        let candles = folder.join(format!("candles_{}-{}.parquet", symbol.replace('/', "_"), set.candles));
        write!(
            text,
            "\n[[instrument]]\nsymbol = \"{symbol}\"\ntick_size = 1e-9\nlot_size = 1e-9\n\n[[data]]\nsymbol = \"{symbol}\"\n\
             bars = {:?}\nstamp = \"open\"\ncolumns = {{ ts = \"date\" }}\n",
            candles.display().to_string()
        )?;
    }
    write!(
        text,
        "\n[strategy]\nkind = \"buy_and_hold\"\n\n[[mechanism]]\nname = \"commission\"\nbps = {:.1}\n",
        set.commission
    )?;
    Ok(text)
}

fn row(text: &mut String, set: &Set, log: &PaperLog, found: &Reconciliation) -> std::fmt::Result {
    let Some(gap) = found.gaps.first() else { return Ok(()) };
    let bands = found.bands.as_ref();
    let (inside, better, worse) = bands.map_or((0, 0, 0), |bands| (bands.inside, bands.better, bands.worse));
    let amount = |cause: Cause| gap.causes.iter().find(|own| own.cause == cause).map_or(0.0, |own| own.amount);
    writeln!(
        text,
        "| {} | {} | {} of {} | {inside} / {better} / {worse} | {} | {:+.2} | {:+.2} | {:+.2} | {:+.2} |",
        set.folder.split('_').next().unwrap_or_default(),
        set.candles,
        found.counts.pairs,
        log.orders.len(),
        found.mean_price_bps().map_or_else(|| "-".to_owned(), |bps| format!("{bps:+.1}")),
        gap.gap,
        amount(Cause::QueueFill),
        amount(Cause::Price),
        amount(Cause::Fees),
    )
}

fn detail(text: &mut String, set: &Set, found: &Reconciliation) -> std::fmt::Result {
    writeln!(text, "\n### {}\n\n{}\n", set.folder, found.summary)?;
    let mut largest: Vec<_> = found.orders.iter().filter(|order| order.gap != 0.0).collect();
    largest.sort_by(|a, b| b.gap.abs().total_cmp(&a.gap.abs()));
    writeln!(text, "| order of | side | decided | price [bps] | gap [USDT] | mostly |\n|---|---|---|---|---|---|")?;
    for order in largest.iter().take(5) {
        let mostly = order.causes.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map(|(cause, _)| *cause);
        let mostly = Cause::ALL.into_iter().find(|cause| Some(cause.word()) == mostly).map_or("", cause_name);
        let price = order.price_bps.map_or_else(|| "-".to_owned(), |bps| format!("{bps:+.1}"));
        writeln!(
            text,
            "| {} | {} | {} | {price} | {:+.2} | {mostly} |",
            order.symbol,
            order.side.word(),
            order.at,
            order.gap
        )?;
    }
    for outside in found.bands.iter().flat_map(|bands| &bands.outside) {
        writeln!(
            text,
            "\n`{}` was executed at {} where the candles show {} to {}.",
            outside.order, outside.price, outside.low, outside.high
        )?;
    }
    Ok(())
}

const HEAD: &str = "\
# Dry-run logs of a bot, beside its candles

Made by `./x logs`. Each order of the log is sent through a backtest on the candles that lie beside it: market orders meet the open of
the next candle, limit orders are filled when the price goes through them. What the log made of an order less what the backtest made
of it is the gap. Prices of executions are held against the candles from decision to execution: within them, cheaper for the
order than any, dearer than any. Amounts are USDT; positive is better for the log.

| log | candles | orders compared | within / cheaper / dearer | log dearer by [bps] | gap | queue and fill | price | fees |
|---|---|---|---|---|---|---|---|---|
";

const WHAT_CANDLES_SAY: &str = "
Orders of symbols without candles, or outside their time, are not compared. Of the fourth log (selskas) there are no candles at all.

## What can be said from candles alone, and what cannot

| question | from candles |
|---|---|
| was the price of an execution one the market had? | yes: within the range of the candles from decision to execution, or not |
| was the order filled although the market never came to its limit? | yes |
| which fee was charged? | yes: it needs no market |
| how much later than its decision was it executed? | no: the bot stamps when it asked, and a candle has no time within itself |
| how much was latency, spread, impact? | no: one amount, `price`; quotes are needed to split it |
| would a limit order have been filled? | only if the price went through its limit; at the limit, the queue decides, which no candle shows |
| what of orders that never filled? | nothing: freqtrade deletes entries that never filled with their trades |
| how sure is the sum? | the interval of a bootstrap over orders, wide with a dozen of them |
";
