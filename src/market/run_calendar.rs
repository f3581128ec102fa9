//! The calendars of a run: by their name, or from files of the user's.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::io::{Document, InputError, RunFile, did_you_mean, file_hash, listed};

use super::Calendar;
use super::run_log::InputFile;

/// Calendars that were read, by what a run calls them: each is read once.
#[derive(Debug, Clone, Default)]
pub(super) struct ReadCalendars {
    by_name: BTreeMap<String, Arc<Calendar>>,
    /// The files among them.
    pub files: Vec<InputFile>,
}

impl ReadCalendars {
    /// The calendar of each instrument of `run`; nothing where none has one.
    ///
    /// # Errors
    /// A name that no calendar has, at its key; and what [`Calendar::of`] refuses, at its place in the file.
    pub fn of(&mut self, run: &RunFile) -> Result<Vec<Option<Arc<Calendar>>>, InputError> {
        if run.instruments.iter().all(|instrument| instrument.calendar.is_none()) {
            return Ok(Vec::new());
        }
        (0..run.instruments.len()).map(|index| self.one(run, index)).collect()
    }

    /// The calendar of the `index`-th instrument.
    fn one(&mut self, run: &RunFile, index: usize) -> Result<Option<Arc<Calendar>>, InputError> {
        let entry = &run.instruments[index];
        let Some(named) = &entry.calendar else { return Ok(None) };
        if let Some(known) = self.by_name.get(named) {
            return Ok(Some(Arc::clone(known)));
        }
        let calendar = match entry.calendar_file() {
            Some(file) => {
                let path = run.document().resolve(file);
                let calendar = Calendar::of(&Document::read(&path)?)?;
                self.files.push(InputFile { path: file.to_owned(), sha256: file_hash(&path)?, rows: None });
                calendar
            }
            None => Calendar::built_in(named).map_err(|_| unknown(run, index, named))?,
        };
        let calendar = Arc::new(calendar);
        self.by_name.insert(named.clone(), Arc::clone(&calendar));
        Ok(Some(calendar))
    }
}

fn unknown(run: &RunFile, index: usize, named: &str) -> InputError {
    let names: Vec<&str> = Calendar::names().collect();
    let hint = match did_you_mean(named, &names) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None => format!("there are {}; a file of your own is named by its path: \"./my_exchange.toml\"", listed(&names)),
    };
    run.error(&["instrument", &index.to_string(), "calendar"], format!("there is no calendar `{named}`")).hint(hint)
}
