//! A journal: lines that are only ever added, each with a checksum, so that whatever stops a program leaves lines that are whole
//! and at most one that is not.
//!
//! A line is the CRC-32 of its text in eight hexadecimal digits, a blank, the text, and a line feed. A process that is killed
//! leaves a beginning of its last line at most, and a machine that loses power a tail that was not on the disk yet: what is
//! broken *at the end* is cut. What is broken before lines that are sound was damaged later, and is an error.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::error::{InputError, Place};

/// When lines are not only handed to the system but on the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum JournalSync {
    /// At each call that adds lines: what was added survives a loss of power.
    Always,
    /// When [`Journal::sync`] is called: a killed process loses nothing, a loss of power what came since.
    #[default]
    Asked,
}

/// A journal that lines are added to. While it is open no other process can open it.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    sync: JournalSync,
    /// Lines that may not be on the disk yet.
    unsynced: bool,
}

/// The lines of a journal, one after the other.
#[derive(Debug)]
pub struct JournalLines {
    path: PathBuf,
    reader: BufReader<File>,
    /// Bytes that are left of the sound ones.
    left: u64,
    line: usize,
}

/// What was cut off the end of a journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CutTail {
    /// Line at which the cut is, from 1.
    pub line: usize,
    /// How much was cut [bytes].
    pub bytes: u64,
}

impl Journal {
    /// Begins a journal where there is none.
    ///
    /// # Errors
    /// A file of that name; a place where nothing can be written.
    pub fn create(path: impl AsRef<Path>, sync: JournalSync) -> Result<Self, InputError> {
        let path = path.as_ref();
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(|error| unwritten(path, &error))?;
        }
        let file =
            OpenOptions::new().read(true).append(true).create_new(true).open(path).map_err(|error| match error.kind() {
                std::io::ErrorKind::AlreadyExists => InputError::new(path, "there is a journal already")
                    .hint("go on with it by --resume, or name another folder with --out"),
                _ => unwritten(path, &error),
            })?;
        lock(path, &file)?;
        Ok(Self { path: path.to_path_buf(), file, sync, unsynced: false })
    }

    /// Opens a journal to go on with it: `see` is shown its lines with their numbers, from 1, and what is torn at its end is cut.
    ///
    /// # Errors
    /// A file that is not there, or that another process holds; lines that are damaged, though sound ones come after them; what
    /// `see` refuses.
    pub fn open(
        path: impl AsRef<Path>,
        sync: JournalSync,
        see: impl FnMut(usize, &str) -> Result<(), InputError>,
    ) -> Result<(Self, Option<CutTail>), InputError> {
        let path = path.as_ref();
        let file = OpenOptions::new().read(true).append(true).open(path).map_err(|error| unread(path, &error))?;
        lock(path, &file)?;
        let (sound, cut) = scan(path, &file, see)?;
        if cut.is_some() {
            file.set_len(sound).and_then(|()| file.sync_all()).map_err(|error| unwritten(path, &error))?;
        }
        Ok((Self { path: path.to_path_buf(), file, sync, unsynced: false }, cut))
    }

    /// Adds lines, all in one write. They are with the system when this returns: a process that is killed then has lost nothing.
    ///
    /// # Errors
    /// A disk that is full.
    pub fn add(&mut self, lines: &[String]) -> Result<(), InputError> {
        let mut text = String::new();
        lines.iter().for_each(|line| push_line(&mut text, line));
        self.file.write_all(text.as_bytes()).map_err(|error| unwritten(&self.path, &error))?;
        self.unsynced = true;
        if self.sync == JournalSync::Always { self.sync() } else { Ok(()) }
    }

    /// Brings all that was added to the disk.
    ///
    /// # Errors
    /// A disk that fails.
    pub fn sync(&mut self) -> Result<(), InputError> {
        if std::mem::take(&mut self.unsynced) {
            self.file.sync_data().map_err(|error| unwritten(&self.path, &error))?;
        }
        Ok(())
    }
}

impl JournalLines {
    /// The sound lines of a journal, whether or not it is being added to: `see` is shown each at once, with its number from 1.
    ///
    /// # Errors
    /// As [`Journal::open`], but for other processes: nothing is written here, and what is torn is left alone.
    pub fn open(
        path: impl AsRef<Path>,
        see: impl FnMut(usize, &str) -> Result<(), InputError>,
    ) -> Result<(Self, Option<CutTail>), InputError> {
        let path = path.as_ref();
        let mut file = File::open(path).map_err(|error| unread(path, &error))?;
        let (left, cut) = scan(path, &file, see)?;
        file.seek(SeekFrom::Start(0)).map_err(|error| unread(path, &error))?;
        Ok((Self { path: path.to_path_buf(), reader: BufReader::new(file), left, line: 0 }, cut))
    }

    /// The next line, with its number from 1; none behind the last.
    ///
    /// # Errors
    /// A file that cannot be read any more, or has changed since.
    pub fn next_line(&mut self) -> Result<Option<(usize, String)>, InputError> {
        if self.left == 0 {
            return Ok(None);
        }
        let mut bytes = Vec::new();
        let read = self.reader.read_until(b'\n', &mut bytes).map_err(|error| unread(&self.path, &error))?;
        self.line += 1;
        self.left = self.left.saturating_sub(read as u64);
        match sound_line(&bytes) {
            Some(text) => Ok(Some((self.line, text.to_owned()))),
            None => Err(damaged(&self.path, self.line)),
        }
    }
}

/// Shows `see` every sound line from the start; gives how many bytes they are, and what is torn behind them.
fn scan(
    path: &Path,
    mut file: &File,
    mut see: impl FnMut(usize, &str) -> Result<(), InputError>,
) -> Result<(u64, Option<CutTail>), InputError> {
    file.seek(SeekFrom::Start(0)).map_err(|error| unread(path, &error))?;
    let mut reader = BufReader::with_capacity(1 << 16, file);
    let (mut sound, mut all, mut line) = (0_u64, 0_u64, 0_usize);
    let mut broken = None;
    let mut bytes = Vec::new();
    loop {
        bytes.clear();
        let read = reader.read_until(b'\n', &mut bytes).map_err(|error| unread(path, &error))?;
        if read == 0 {
            break;
        }
        (all, line) = (all + read as u64, line + 1);
        match (sound_line(&bytes), broken) {
            (Some(_), Some(broken)) => return Err(damaged(path, broken)),
            (Some(text), None) => {
                see(line, text)?;
                sound = all;
            }
            (None, None) => broken = Some(line),
            (None, Some(_)) => {}
        }
    }
    Ok((sound, broken.map(|line| CutTail { line, bytes: all - sound })))
}

/// Writes a line as it stands in a journal. A line feed cannot be part of it: what holds texts writes them as JSON does.
fn push_line(into: &mut String, text: &str) {
    let text = text.replace('\n', " ");
    into.push_str(&checksum(text.as_bytes()));
    into.push(' ');
    into.push_str(&text);
    into.push('\n');
}

/// The text of a line that is whole.
fn sound_line(bytes: &[u8]) -> Option<&str> {
    let line = std::str::from_utf8(bytes.strip_suffix(b"\n")?).ok()?;
    let (sum, text) = line.split_at_checked(8)?;
    let text = text.strip_prefix(' ')?;
    (checksum(text.as_bytes()) == sum).then_some(text)
}

/// Source: CRC-32 of ISO 3309, which finds every error of up to 32 bits in a row.
fn checksum(bytes: &[u8]) -> String {
    format!("{:08x}", crc32fast::hash(bytes))
}

fn lock(path: &Path, file: &File) -> Result<(), InputError> {
    file.try_lock().map_err(|error| match error {
        std::fs::TryLockError::WouldBlock => InputError::new(path, "another process writes this journal")
            .hint("wait for it, stop it, or name another folder with --out"),
        std::fs::TryLockError::Error(error) => unwritten(path, &error),
    })
}

fn damaged(path: &Path, line: usize) -> InputError {
    let error = InputError::new(path, "the line is damaged: its checksum is another").at(Place::Line { line, column: 1 });
    error.hint("sound lines come after it, so that nothing can be cut: copy the journal from a backup, or begin anew")
}

fn unread(path: &Path, error: &std::io::Error) -> InputError {
    InputError::new(path, format!("cannot be read ({error})")).hint("is that the folder the session was begun in?")
}

fn unwritten(path: &Path, error: &std::io::Error) -> InputError {
    InputError::new(path, format!("cannot be written ({error})")).hint("is there room, and the right to write there?")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use tempfile::TempDir;

    fn written(lines: &[String]) -> (TempDir, PathBuf, Vec<u8>) {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("a/journal.jsonl");
        let mut journal = Journal::create(&path, JournalSync::Always).unwrap();
        journal.add(lines).unwrap();
        drop(journal);
        let bytes = std::fs::read(&path).unwrap();
        (folder, path, bytes)
    }

    fn read(path: &Path) -> Result<(Vec<String>, Option<CutTail>), InputError> {
        let mut lines = Vec::new();
        let see = |_: usize, line: &str| {
            lines.push(line.to_owned());
            Ok(())
        };
        let (_, cut) = Journal::open(path, JournalSync::Asked, see)?;
        Ok((lines, cut))
    }

    #[test]
    fn one_process_at_a_time_and_no_journal_is_begun_twice() {
        let (_folder, path, _) = written(&["{}".into()]);
        assert!(Journal::create(&path, JournalSync::Asked).unwrap_err().to_string().contains("--resume"));
        let (mut open, _) = Journal::open(&path, JournalSync::Asked, |_, _| Ok(())).unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("another process"));
        open.add(&["two\nlines".into()]).unwrap();
        drop(open);
        assert_eq!(read(&path).unwrap().0, ["{}", "two lines"]);
    }

    proptest! {
        /// Cut anywhere, a journal gives the lines that are whole, and can be gone on with.
        #[test]
        fn what_is_torn_is_cut(lines in proptest::collection::vec("[ -~]{0,30}", 1..6), at in any::<prop::sample::Index>()) {
            let (_folder, path, bytes) = written(&lines);
            let at = at.index(bytes.len() + 1);
            std::fs::write(&path, &bytes[..at]).unwrap();
            let whole = bytes[..at].iter().filter(|byte| **byte == b'\n').count();
            let (found, cut) = read(&path).unwrap();
            prop_assert_eq!(&found, &lines[..whole]);
            prop_assert_eq!(cut.is_some(), at > 0 && bytes[at - 1] != b'\n');
            let (mut journal, none) = Journal::open(&path, JournalSync::Asked, |_, _| Ok(())).unwrap();
            prop_assert_eq!(none, None);
            journal.add(&["more".to_owned()]).unwrap();
            drop(journal);
            prop_assert_eq!(read(&path).unwrap().0.pop(), Some("more".to_owned()));
        }

        /// A byte that was changed is found out: the end is cut, and anything before it an error with its line.
        #[test]
        fn a_changed_byte_is_found_out(
            lines in proptest::collection::vec("[ -~]{0,30}", 1..6), at in any::<prop::sample::Index>(), to in 1..=255_u8,
        ) {
            let (_folder, path, mut bytes) = written(&lines);
            let at = at.index(bytes.len());
            bytes[at] ^= to;
            std::fs::write(&path, &bytes).unwrap();
            match read(&path) {
                Ok((found, cut)) => {
                    prop_assert!(found.len() < lines.len() && cut.is_some());
                    prop_assert_eq!(&found, &lines[..found.len()]);
                }
                Err(error) => prop_assert!(error.to_string().contains("checksum") && error.hint.is_some()),
            }
        }
    }
}
