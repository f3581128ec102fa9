//! The cases of a benchmark as files that `trueup diagnose` reads.

use std::path::Path;

use rayon::prelude::*;

use crate::cli::data::output_table;
use crate::conceal::benchmark::Case;
use crate::io::{InputError, OutputFolder, Overwrite};
use crate::proof::Sealed;
use crate::robot::{Axis, Joint};

/// Writes a folder for each case: `twin.toml`, `train.csv`, `test.csv` and `label.json`.
pub(super) fn write(cases: &[Case], sealed: &[Sealed], folder: &Path, overwrite: Overwrite) -> Result<(), InputError> {
    let digits = cases.len().saturating_sub(1).to_string().len().max(3);
    let prepared = cases.par_iter().zip(sealed).enumerate().map(|(index, (case, sealed))| {
        let mut output = OutputFolder::create(folder.join(format!("{index:0digits$}")), overwrite)?;
        output.file("twin.toml", twin(case).as_bytes())?;
        output.table("train.csv", &output_table(&case.train, "train.csv"))?;
        output.table("test.csv", &output_table(&case.test, "test.csv"))?;
        output.file("label.json", format!("{}\n", sealed.label).as_bytes())?;
        Ok(output)
    });
    for output in prepared.collect::<Result<Vec<OutputFolder>, InputError>>()? {
        output.finish()?;
    }
    Ok(())
}

fn twin(case: &Case) -> String {
    let axis = if case.linear { Axis::Linear } else { Axis::Rotary };
    let unit = if case.linear { "m" } else { "rad" };
    let mut text = String::from("[twin]\nmodel = \"joint\"\n\n[parameters]\n");
    for (((name, unit), value), uncertainty) in Joint::parameter_names(axis).iter().zip(case.nominal).zip(case.uncertainty) {
        text += &format!("{name} = {{ value = {value}, unit = \"{unit}\", uncertainty = {uncertainty} }}\n");
    }
    text + &format!("\n[channels]\ncommand = {{ column = \"u\" }}\nposition = {{ column = \"q\", unit = \"{unit}\" }}\n")
}
