//! `cases.jsonl`: the one file that grows while a command goes on, so that what is done is not done again.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use crate::cli::stop::Stop;
use crate::io::{InputError, Overwrite, write_file};
use crate::proof::{Header, Journal, JournalError, Line};

/// Whether to go on with what is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Start {
    /// From the first case.
    Anew(Overwrite),
    /// From the first that is not done.
    Resume,
}

/// The file, open to be added to.
#[derive(Debug)]
pub(super) struct Record {
    path: PathBuf,
    file: Mutex<File>,
    done: usize,
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

impl Record {
    /// Begins the file with `header`, or takes up the one that begins with the same; a torn last line is cut off.
    ///
    /// # Errors
    /// A file of other cases, or one that is no record; a disk that is full.
    pub fn open(path: &Path, header: &Header, start: Start) -> Result<Self, Stop> {
        let mut done = 0;
        if start == Start::Resume && path.exists() {
            let journal = read(path)?;
            if journal.header != *header {
                return Err(other(path, &journal.header, header).into());
            }
            let file = OpenOptions::new().write(true).open(path).map_err(|error| failed(path, &error))?;
            file.set_len(journal.whole as u64).map_err(|error| failed(path, &error))?;
            done = journal.lines.len();
        } else {
            let overwrite = if start == Start::Anew(Overwrite::Force) { Overwrite::Force } else { Overwrite::Refuse };
            write_file(path, header.text()?.as_bytes(), overwrite)?;
        }
        let file = OpenOptions::new().append(true).open(path).map_err(|error| failed(path, &error))?;
        Ok(Self { path: path.to_path_buf(), file: Mutex::new(file), done })
    }

    /// How many cases it held when it was opened.
    pub fn done(&self) -> usize {
        self.done
    }

    /// Adds a case.
    ///
    /// # Errors
    /// A disk that is full.
    pub fn append(&self, line: &Line) -> Result<(), Stop> {
        let text = line.text()?;
        let mut file = self.file.lock().map_err(|_| Stop::Bug("a thread has stopped while it wrote".to_owned()))?;
        let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_data());
        written.map_err(|error| failed(&self.path, &error).into())
    }

    /// What it holds now.
    ///
    /// # Errors
    /// What is no record any more.
    pub fn read(&self) -> Result<Journal, InputError> {
        read(&self.path)
    }
}

fn read(path: &Path) -> Result<Journal, InputError> {
    let text = fs::read_to_string(path).map_err(|error| InputError::new(path, format!("cannot be read ({error})")))?;
    Journal::read(&text).map_err(|error: JournalError| {
        InputError::new(path, error.to_string()).hint("--force begins anew, --out names another folder")
    })
}

/// What tells a record from the one that is asked for.
fn other(path: &Path, found: &Header, wanted: &Header) -> InputError {
    let again = format!(
        "trueup prove --domain {} --seed {} --cases {} --resume goes on with it",
        found.domain, found.seed, found.cases
    );
    match () {
        () if found.domain != wanted.domain => {
            InputError::new(path, format!("holds cases of another domain: {}", found.domain)).hint(again)
        }
        () if (found.seed, found.cases) != (wanted.seed, wanted.cases) => {
            InputError::new(path, format!("holds {} cases of seed {}", found.cases, found.seed)).hint(again)
        }
        () if found.version != wanted.version => {
            InputError::new(path, format!("was made by trueup {}", found.version)).hint("--force begins anew")
        }
        () => InputError::new(path, "holds other cases than this program draws from that seed")
            .hint("it was made by another build of trueup; --force begins anew"),
    }
}

fn failed(path: &Path, error: &std::io::Error) -> InputError {
    InputError::new(path, format!("cannot be written ({error})")).hint("is there room, and the right to write there?")
}
