//! The halts of a run: written in its document, or read from files.

use crate::io::{HaltEntry, InputError, RunFile, Table, file_hash};

use super::Halt;
use super::run_log::InputFile;

/// Halts that were read, and the files they were read from.
#[derive(Debug, Clone, Default)]
pub(super) struct ReadHalts {
    pub all: Vec<Halt>,
    pub files: Vec<InputFile>,
}

impl ReadHalts {
    /// The halts of `run`; of a file, those of its instruments.
    ///
    /// # Errors
    /// A file that cannot be read, or a halt in it that ends no later than it begins.
    pub fn read(run: &RunFile) -> Result<Self, InputError> {
        let mut halts = Self::default();
        for entry in &run.halts {
            match entry {
                HaltEntry::Written { symbol, from, to, reason } => {
                    if let Some(instrument) = place(run, symbol) {
                        halts.all.push(Halt { instrument, from: *from, to: *to, reason: reason.clone() });
                    }
                }
                HaltEntry::File { path, named, .. } => {
                    let rows = halts.read_file(run, entry)?;
                    halts.files.push(InputFile { path: named.clone(), sha256: file_hash(path)?, rows: Some(rows) });
                }
            }
        }
        Ok(halts)
    }

    /// Reads a file of halts, and gives its number of rows.
    fn read_file(&mut self, run: &RunFile, entry: &HaltEntry) -> Result<usize, InputError> {
        let HaltEntry::File { path, time, columns, .. } = entry else { return Ok(0) };
        let table = Table::read_with(path, columns)?;
        table.check_renames(&["symbol", "from", "to", "reason"])?;
        let symbols = table.texts_complete("symbol")?;
        let (begun, ended) = (table.times("from", time)?, table.times("to", time)?);
        let reasons = if table.has("reason") { table.texts("reason")? } else { vec![None; table.rows()] };
        for (row, (symbol, reason)) in symbols.iter().zip(reasons).enumerate() {
            let (from, to) = (begun[row], ended[row]);
            if from >= to {
                let error = table.error("to", row, format!("expected an end after the beginning, {from}")).found(to);
                return Err(error.hint("swap or correct them; are both in the same zone?"));
            }
            // A file may tell of a whole market.
            if let Some(instrument) = place(run, symbol) {
                self.all.push(Halt { instrument, from, to, reason });
            }
        }
        Ok(table.rows())
    }
}

fn place(run: &RunFile, symbol: &str) -> Option<usize> {
    run.instruments.iter().position(|instrument| instrument.symbol == symbol)
}
