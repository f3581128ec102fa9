//! The cases of a benchmark as files that `trueup diagnose` reads.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::cases::Cases;
use crate::cli::data::output_table;
use crate::cli::screen::Progress;
use crate::conceal::benchmark;
use crate::conceal::trading::{Day, TradingCase};
use crate::io::{InputError, OutputFolder, Overwrite};
use crate::proof::{Case, Sealed};
use crate::robot::{Axis, Joint};

/// Writes a folder for each case: `twin.toml`, `label.json`, and the recordings: `train.csv` and `test.csv` of a joint, the
/// tables in `train/` and `test/` of a market.
pub(super) fn write(
    cases: &Cases,
    sealed: &[Sealed],
    folder: &Path,
    overwrite: Overwrite,
    progress: &Progress,
) -> Result<(), InputError> {
    let digits = cases.len().saturating_sub(1).to_string().len().max(3);
    let done = AtomicUsize::new(0);
    let one = |(index, sealed): (usize, &Sealed)| {
        let folder = folder.join(format!("{index:0digits$}"));
        let mut output = OutputFolder::create(&folder, overwrite)?;
        output.file("label.json", format!("{}\n", sealed.label).as_bytes())?;
        let mut days = Vec::new();
        match &*cases.get(index) {
            Case::Joint(case) => joint(case, &mut output)?,
            Case::Trading(case) => {
                output.file("twin.toml", execution_twin(case).as_bytes())?;
                for (name, of) in [("train", &case.train), ("test", &case.test)] {
                    days.push(day(of, OutputFolder::create(folder.join(name), overwrite)?)?);
                }
            }
        }
        progress.tell("writing cases", done.fetch_add(1, Ordering::Relaxed) + 1, cases.len());
        days.push(output);
        Ok(days)
    };
    let prepared: Result<Vec<Vec<OutputFolder>>, InputError> = sealed.par_iter().enumerate().map(one).collect();
    for output in prepared?.into_iter().flatten() {
        output.finish()?;
    }
    Ok(())
}

fn joint(case: &benchmark::Case, output: &mut OutputFolder) -> Result<(), InputError> {
    output.file("twin.toml", joint_twin(case).as_bytes())?;
    output.table("train.csv", &output_table(&case.train, "train.csv"))?;
    output.table("test.csv", &output_table(&case.test, "test.csv"))
}

fn joint_twin(case: &benchmark::Case) -> String {
    let axis = if case.linear { Axis::Linear } else { Axis::Rotary };
    let unit = if case.linear { "m" } else { "rad" };
    let mut text = String::from("[twin]\nmodel = \"joint\"\n\n[parameters]\n");
    for (((name, unit), value), uncertainty) in Joint::parameter_names(axis).iter().zip(case.nominal).zip(case.uncertainty) {
        text += &format!("{name} = {{ value = {value}, unit = \"{unit}\", uncertainty = {uncertainty} }}\n");
    }
    text + &format!("\n[channels]\ncommand = {{ column = \"u\" }}\nposition = {{ column = \"q\", unit = \"{unit}\" }}\n")
}

/// The tables of a day: small ones to be read by eye, the tape in Parquet.
fn day(day: &Day, mut output: OutputFolder) -> Result<OutputFolder, InputError> {
    let tables = [
        ("orders.csv", Some(&day.orders)),
        ("fills.csv", Some(&day.fills)),
        ("quotes.parquet", Some(&day.quotes)),
        ("trades.parquet", day.trades.as_ref()),
    ];
    for (name, table) in tables.into_iter().filter_map(|(name, table)| Some((name, table?))) {
        output.table(name, &output_table(table, name))?;
    }
    Ok(output)
}

fn execution_twin(case: &TradingCase) -> String {
    let lot = case.lot.map_or(String::new(), |lot| format!("lot_size = {lot}\n"));
    format!(
        "[twin]\nmodel = \"execution\"\n\n[assumptions]\nprice = \"{}\"\n\n[[instrument]]\nsymbol = \"{}\"\ntick_size = {}\n{lot}\
         average_daily_volume = {}\ndaily_volatility = {}\n",
        case.price.word(),
        case.symbol,
        case.tick,
        case.average_daily_volume,
        case.daily_volatility
    )
}
