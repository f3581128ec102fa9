//! `sweep.jsonl`: the one file that grows while a sweep goes on, so that what is done is not done again.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use crate::cli::stop::Stop;
use crate::io::{InputError, Overwrite, write_file};
use crate::market::sweep::{Header, Journal, Line, Outcome};

/// Whether to go on with what is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Start {
    /// From the first run.
    Anew(Overwrite),
    /// With those that are not done.
    Resume,
}

/// The file, open to be added to.
#[derive(Debug)]
pub(super) struct JournalFile {
    path: PathBuf,
    file: Mutex<File>,
    done: BTreeMap<usize, Outcome>,
}

/// Refuses before the work what would be refused after it.
pub(super) fn check(path: &Path, start: Start) -> Result<(), InputError> {
    if path.exists() && start == Start::Anew(Overwrite::Refuse) {
        return Err(InputError::new(path, "the file exists already, and nothing is written over unasked")
            .hint("--resume goes on with it, --force begins anew, --out names another folder"));
    }
    if path.exists() && start == Start::Resume {
        read(path)?;
    }
    Ok(())
}

impl JournalFile {
    /// Begins the file with `header`, or takes up the one that begins with the same; a torn last line is cut off.
    ///
    /// # Errors
    /// A file of another sweep, or one that is none; a disk that is full.
    pub fn open(path: &Path, header: &Header, start: Start) -> Result<Self, Stop> {
        let mut done = BTreeMap::new();
        if start == Start::Resume && path.exists() {
            let journal = read(path)?;
            if journal.header != *header {
                let error =
                    InputError::new(path, "holds another sweep: the run, its data or the program have changed since");
                return Err(error.hint("--force begins anew, --out names another folder").into());
            }
            let file = OpenOptions::new().write(true).open(path).map_err(|error| failed(path, &error))?;
            file.set_len(journal.whole as u64).map_err(|error| failed(path, &error))?;
            done = journal.done;
        } else {
            let overwrite = if start == Start::Anew(Overwrite::Force) { Overwrite::Force } else { Overwrite::Refuse };
            fs::create_dir_all(path.parent().unwrap_or(Path::new("."))).map_err(|error| failed(path, &error))?;
            write_file(path, header.text()?.as_bytes(), overwrite)?;
        }
        let file = OpenOptions::new().append(true).open(path).map_err(|error| failed(path, &error))?;
        Ok(Self { path: path.to_path_buf(), file: Mutex::new(file), done })
    }

    /// What the run of that number came to before.
    pub fn outcome(&self, index: usize) -> Option<&Outcome> {
        self.done.get(&index)
    }

    /// Adds a run. Lines are handed to the system one by one: a killed process loses none.
    ///
    /// # Errors
    /// A disk that is full.
    pub fn append(&self, line: &Line) -> Result<(), Stop> {
        let text = line.text()?;
        let mut file = self.file.lock().map_err(|_| Stop::Bug("a thread has stopped while it wrote".to_owned()))?;
        file.write_all(text.as_bytes()).map_err(|error| failed(&self.path, &error).into())
    }
}

fn read(path: &Path) -> Result<Journal, InputError> {
    let text = fs::read_to_string(path).map_err(|error| InputError::new(path, format!("cannot be read ({error})")))?;
    Journal::read(&text)
        .map_err(|error| InputError::new(path, error.to_string()).hint("--force begins anew, --out names another folder"))
}

fn failed(path: &Path, error: &std::io::Error) -> InputError {
    InputError::new(path, format!("cannot be written ({error})")).hint("is there room, and the right to write there?")
}
