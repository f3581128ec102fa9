//! `trueup data import --tape`: the orders of a tape.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;

use crate::io::{InputError, OutputFolder, Overwrite};
use crate::market::tape_orders::{
    Selection, TAPE_FILES, TapeCounts, TapeFolder, TapeOrder, TapeReading, TapeSettings, TapeSink, TapeSources, TapeWritten,
    Thinning, tape_findings,
};
use crate::market::{Book, Level, Print, Quantity};
use crate::sim2real::Timestamp;

use super::super::screen::{self, Screen, titled};

/// What is asked of a tape.
#[derive(Debug, Args)]
#[command(next_help_heading = "Tape")]
pub(super) struct TapeArguments {
    /// The files are a tape: make orders of what was taken from its book
    #[arg(long)]
    tape: bool,
    /// What the instrument is called [default: the name of the file of orders or trades]
    #[arg(long, value_name = "SYMBOL", requires = "tape")]
    symbol: Option<String>,
    /// Levels a side that are written of the book
    #[arg(long, value_name = "N", default_value_t = Book::DEPTH, value_parser = levels, requires = "tape")]
    levels: usize,
    /// Of trades beside a book: leave out orders that come within MS milliseconds of the trade before them, for the feed may not
    /// have told yet what that one left
    #[arg(long, value_name = "MS", default_value_t = TapeSettings::APART as f64 * 1e-6, value_parser = milliseconds, requires = "tape")]
    apart: f64,
    /// Keep at most N orders: every first, second, fourth or eighth, and so on [default: 2000]
    #[arg(long, value_name = "N", value_parser = above_zero::<usize>, requires = "tape")]
    at_most: Option<usize>,
    /// Keep every N-th order instead; 1 keeps all
    #[arg(long, value_name = "N", value_parser = above_zero::<u64>, requires = "tape", conflicts_with = "at_most")]
    every: Option<u64>,
    /// Leave out orders of less than Q units
    #[arg(long, value_name = "Q", value_parser = quantity, requires = "tape")]
    min_size: Option<Quantity>,
    /// Leave out what comes before this instant, such as 2024-08-08T23:54:20Z
    #[arg(long, value_name = "TIME", requires = "tape")]
    start: Option<Timestamp>,
    /// Leave out what comes at this instant or later
    #[arg(long, value_name = "TIME", requires = "tape")]
    end: Option<Timestamp>,
}

fn levels(text: &str) -> Result<usize, String> {
    let most = Book::DEPTH;
    let number = text.parse().ok().filter(|number| (1..=most).contains(number));
    number.ok_or_else(|| format!("expected a whole number from 1 to {most}"))
}

fn above_zero<N: FromStr + PartialOrd + Default>(text: &str) -> Result<N, String> {
    let number = text.parse().ok().filter(|number| *number > N::default());
    number.ok_or_else(|| "expected a whole number above 0".to_owned())
}

fn milliseconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| (0.0..=60_000.0).contains(number));
    number.ok_or_else(|| "expected a number from 0 to 60000".to_owned())
}

fn quantity(text: &str) -> Result<Quantity, String> {
    let number = text.parse().ok().and_then(|value| Quantity::nearest(value).ok());
    number.filter(|quantity| *quantity > Quantity::ZERO).ok_or_else(|| "expected a number above 0".to_owned())
}

impl TapeArguments {
    pub fn is_asked_for(&self) -> bool {
        self.tape
    }

    fn settings(&self) -> TapeSettings {
        TapeSettings { levels: self.levels, apart: (self.apart * 1e6).round() as i64 }
    }

    fn selection(&self) -> Selection {
        let whole = Selection::default();
        let every = self.every.map(Thinning::Every);
        let at_most = self.at_most.map(Thinning::AtMost);
        Selection {
            thinning: every.or(at_most).unwrap_or(whole.thinning),
            smallest: self.min_size.unwrap_or(whole.smallest),
            start: self.start.unwrap_or(whole.start),
            end: self.end.unwrap_or(whole.end),
        }
    }

    /// Reads the tape, writes what is asked for, and says what came of it.
    pub fn import(
        &self,
        paths: &[PathBuf],
        out: Option<(&Path, Overwrite)>,
        json: bool,
        screen: &Screen,
    ) -> Result<String, InputError> {
        let selection = self.selection();
        if selection.start >= selection.end {
            let error = InputError::new("--end", format!("expected an instant after {}", selection.start));
            return Err(error.found(selection.end).hint("--start comes before --end"));
        }
        let sources = TapeSources::find(paths)?;
        let symbol = self.symbol.clone().unwrap_or_else(|| sources.stem());
        let progress = screen.progress();
        progress.tell("Reading", 0, 0);
        let Some((folder, overwrite)) = out else {
            let reading = sources.read(self.settings(), &mut Nothing)?;
            drop(progress);
            if json {
                return Ok(tape_findings(&sources, &symbol, &reading));
            }
            let text = told(&sources, &symbol, &reading, screen);
            return Ok(text + "\nNothing was written; --out DIR writes orders, their tape and a twin.\n");
        };
        let output = OutputFolder::create(folder, overwrite)?;
        output.check_free(&TAPE_FILES)?;
        let mut written = TapeFolder::create(output, &symbol, self.levels, selection)?;
        let reading = sources.read(self.settings(), &mut written)?;
        let written = written.finish(&sources, &reading)?;
        drop(progress);
        if json {
            return Ok(written.json);
        }
        let text = told(&sources, &symbol, &reading, screen) + &kept(&written, screen) + &screen::written(&written.paths);
        let twin = folder.join("assumed.toml");
        Ok(text + &format!("\nNext: trueup diagnose {} --recording {}\n", twin.display(), folder.display()))
    }
}

/// Takes everything and keeps nothing: for counting.
struct Nothing;

impl TapeSink for Nothing {
    type Error = InputError;

    fn quote(&mut self, _time: Timestamp, _bids: &[Level], _asks: &[Level]) -> Result<(), InputError> {
        Ok(())
    }

    fn print(&mut self, _print: Print) -> Result<(), InputError> {
        Ok(())
    }

    fn order(&mut self, _order: TapeOrder) -> Result<(), InputError> {
        Ok(())
    }
}

/// What was found.
fn told(sources: &TapeSources, symbol: &str, reading: &TapeReading, screen: &Screen) -> String {
    let TapeCounts { orders, market, fills, prints, quotes, better_than_touch, at_touch, worse_than_touch, .. } =
        reading.counts;
    let head = format!("Tape of {symbol}: {}, {prints} trades, {quotes} instants of the book.", sources.what());
    let mut table = screen.table(["orders that took", ">number"]);
    for (what, number) in [
        ("found, with their executions", orders),
        ("executed whole (market)", market),
        ("limited by their price (limit)", orders - market),
        ("first execution at the touch", at_touch),
        ("first execution better than the touch", better_than_touch),
        ("first execution worse than the touch", worse_than_touch),
        ("executions", fills),
    ] {
        table.add_row([what.to_owned(), number.to_string()]);
    }
    let mut text = format!("{}\n{}", screen.wrapped("", &head), titled("Orders", &table));
    let left: Vec<String> = reading.counts.lines().into_iter().chain(reading.notes.iter().cloned()).collect();
    if !left.is_empty() {
        text += "\nLeft out, or worth knowing\n\n";
        for line in left {
            text += &format!("{}\n", screen.wrapped("  - ", &line));
        }
    }
    text
}

/// Which of the orders were written.
fn kept(written: &TapeWritten, screen: &Screen) -> String {
    let TapeWritten { every, fitting, orders, .. } = written;
    let which = match every {
        1 => format!("Of {fitting} orders that fit all are written."),
        every => format!("Of {fitting} orders that fit one in {every} is written, {orders} in all; --every 1 writes all."),
    };
    let mut text = format!("\n{}\n", screen.wrapped("", &which));
    if let Some(measured) = &written.measured {
        let known = |value: Option<f64>, digits: usize| value.map_or("not known".to_owned(), |v| format!("{v:.digits$}"));
        let line = format!(
            "Measured over {:.0} s: tick {}, lot {}; of a day that goes on so: volume {}, volatility {} (of mids {} s apart).",
            measured.span,
            measured.tick.to_f64(),
            measured.lot.to_f64(),
            known(measured.daily_volume, 0),
            known(measured.daily_volatility, 4),
            measured.mids_every,
        );
        text += &format!("{}\n", screen.wrapped("", &line));
    }
    text
}
