//! The journal of a paper run under way: what it holds already is replayed and held to be the same, what is new is added.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use crate::io::{CutTail, InputError, Journal, JournalLines, JournalSync, Place};

use super::entry::{Entry, FeedFrom, Header, SCHEMA, Stop};
use super::stored_row::StoredRow;

/// What became of the last lines, where some are not what they were.
const HINT: &str = "the program or a file has changed since; begin anew in another folder";

/// The journal of a paper run.
#[derive(Debug)]
pub(super) struct PaperLog {
    path: PathBuf,
    /// None where a journal is only read.
    journal: Option<Journal>,
    /// What is replayed.
    lines: Option<JournalLines>,
    /// Rows of each stream that were read from the journal and not yet asked for.
    rows: Vec<VecDeque<StoredRow>>,
    texts: VecDeque<(usize, String)>,
    input_ended: bool,
    /// Orders, fills and refusals that the engine has yet to come to.
    expected: VecDeque<(usize, Entry)>,
    /// Where it was stopped, if it was.
    pub stop: Option<Stop>,
    /// Entries that were replayed.
    pub replayed: Replayed,
}

/// How much of a journal was replayed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Replayed {
    /// Rows or lines of the feed.
    pub rows: u64,
    /// Orders.
    pub orders: u64,
    /// Fills.
    pub fills: u64,
}

/// What a journal is, known before it is replayed.
#[derive(Debug, Default)]
struct Seen {
    header: Option<Header>,
    stop: Option<Stop>,
    closed: bool,
}

impl Seen {
    fn see(&mut self, path: &Path, line: usize, text: &str) -> Result<(), InputError> {
        if self.closed {
            let error = InputError::new(path, "there are lines after the end of the session");
            return Err(error.at(Place::Line { line, column: 1 }).hint(HINT));
        }
        if line == 1 {
            match parsed(path, line, text)? {
                Entry::Header(header) => self.header = Some(header),
                _ => return Err(no_header(path)),
            }
        } else if text.starts_with("{\"stop\"") || text.starts_with("{\"closed\"") {
            match parsed(path, line, text)? {
                Entry::Stop(stop) => self.stop = Some(stop),
                _ => self.closed = true,
            }
        }
        Ok(())
    }
}

impl PaperLog {
    /// Begins a journal.
    pub fn create(path: &Path, header: &Header, sync: JournalSync) -> Result<Self, InputError> {
        let mut journal = Journal::create(path, sync)?;
        journal.add(&[text(path, &Entry::Header(header.clone()))?])?;
        Ok(Self::of(path, Some(journal), None, None))
    }

    /// Goes on with a journal, which must be of that run and not closed.
    pub fn resume(path: &Path, header: &Header, sync: JournalSync) -> Result<(Self, Option<CutTail>), InputError> {
        let mut seen = Seen::default();
        let (mut journal, cut) = Journal::open(path, sync, |line, text| seen.see(path, line, text))?;
        match &seen.header {
            Some(of) => same_run(path, of, header)?,
            // It was killed before its first line was whole: nothing has happened yet.
            None => journal.add(&[text(path, &Entry::Header(header.clone()))?])?,
        }
        if seen.closed {
            let error = InputError::new(path, "the session has ended, and its tables are written");
            return Err(error.hint("begin another in another folder"));
        }
        let (lines, _) = JournalLines::open(path, |_, _| Ok(()))?;
        Ok((Self::of(path, Some(journal), Some(lines), seen.stop), cut))
    }

    /// Reads a journal, whatever has become of its session; nothing is added to it.
    pub fn read(path: &Path, header: &Header) -> Result<(Self, Option<CutTail>), InputError> {
        let mut seen = Seen::default();
        let (lines, cut) = JournalLines::open(path, |line, text| seen.see(path, line, text))?;
        same_run(path, &seen.header.ok_or_else(|| no_header(path))?, header)?;
        Ok((Self::of(path, None, Some(lines), seen.stop), cut))
    }

    fn of(path: &Path, journal: Option<Journal>, lines: Option<JournalLines>, stop: Option<Stop>) -> Self {
        Self {
            path: path.to_path_buf(),
            journal,
            lines,
            rows: Vec::new(),
            texts: VecDeque::new(),
            input_ended: false,
            expected: VecDeque::new(),
            stop,
            replayed: Replayed::default(),
        }
    }

    /// Whether it is only read.
    pub fn is_read_only(&self) -> bool {
        self.journal.is_none()
    }

    /// Whether there is anything in it that has yet to be asked for, or done again.
    pub fn is_replaying(&mut self) -> Result<bool, InputError> {
        loop {
            let waiting =
                !self.expected.is_empty() || !self.texts.is_empty() || self.rows.iter().any(|rows| !rows.is_empty());
            if waiting {
                return Ok(true);
            }
            if !self.read_on()? {
                return Ok(false);
            }
        }
    }

    /// The next row of a stream that the journal holds; none where it holds no more.
    pub fn next_row(&mut self, stream: usize) -> Result<Option<StoredRow>, InputError> {
        loop {
            if let Some(row) = self.rows.get_mut(stream).and_then(VecDeque::pop_front) {
                self.replayed.rows += 1;
                return Ok(Some(row));
            }
            if !self.read_on()? {
                return Ok(None);
            }
        }
    }

    /// The next line of a feed that the journal holds; none where it holds no more.
    pub fn next_text(&mut self) -> Result<Option<(usize, String)>, InputError> {
        loop {
            if let Some(text) = self.texts.pop_front() {
                self.replayed.rows += 1;
                return Ok(Some(text));
            }
            if !self.read_on()? {
                return Ok(None);
            }
        }
    }

    /// Whether the feed had ended, known once all its lines were given.
    pub fn input_has_ended(&self) -> bool {
        self.input_ended
    }

    /// Takes what the engine did: what the journal holds must be the same, what it does not is added.
    pub fn outcome(&mut self, entries: Vec<Entry>) -> Result<(), InputError> {
        let mut fresh = Vec::new();
        for entry in entries {
            while self.expected.is_empty() && fresh.is_empty() && self.read_on()? {}
            match self.expected.pop_front() {
                Some((_, expected)) if expected == entry => match entry {
                    Entry::Order(_) => self.replayed.orders += 1,
                    Entry::Fill(_) => self.replayed.fills += 1,
                    _ => {}
                },
                Some((line, expected)) => return Err(self.parted(line, &expected, Some(&entry))),
                None => fresh.push(entry),
            }
        }
        if self.is_read_only() { Ok(()) } else { self.add(&fresh) }
    }

    /// Holds all that the journal says was done to have been done again.
    pub fn all_done(&mut self) -> Result<(), InputError> {
        while self.expected.is_empty() && self.read_on()? {}
        match self.expected.pop_front() {
            Some((line, expected)) => Err(self.parted(line, &expected, None)),
            None => Ok(()),
        }
    }

    /// Adds entries.
    pub fn add(&mut self, entries: &[Entry]) -> Result<(), InputError> {
        let Some(journal) = self.journal.as_mut().filter(|_| !entries.is_empty()) else { return Ok(()) };
        let texts = entries.iter().map(|entry| text(&self.path, entry)).collect::<Result<Vec<_>, _>>()?;
        journal.add(&texts)
    }

    /// Brings it to the disk.
    pub fn sync(&mut self) -> Result<(), InputError> {
        self.journal.as_mut().map_or(Ok(()), Journal::sync)
    }

    /// The error of a row that is not what the journal has.
    pub fn changed(&self, what: &str, stored: &StoredRow, found: Option<&StoredRow>) -> InputError {
        let found = found.map_or_else(|| "nothing".to_owned(), |row| format!("{row:?}"));
        let message = format!("{what} have changed since: expected {stored:?}");
        InputError::new(&self.path, message).found(found).hint("bring the data back, or begin anew in another folder")
    }

    fn parted(&self, line: usize, expected: &Entry, found: Option<&Entry>) -> InputError {
        let found = found.map_or_else(|| "nothing".to_owned(), |entry| format!("{entry:?}"));
        let message = format!("run again, the session does not do what it did: expected {expected:?}");
        InputError::new(&self.path, message).at(Place::Line { line, column: 1 }).found(found).hint(HINT)
    }

    /// Reads the next line of what is replayed; false at the end.
    fn read_on(&mut self) -> Result<bool, InputError> {
        let Some(lines) = &mut self.lines else { return Ok(false) };
        let Some((line, text)) = lines.next_line()? else {
            self.lines = None;
            return Ok(false);
        };
        match parsed(&self.path, line, &text)? {
            Entry::Row { stream, row } => {
                // No run has as many files; a number from nowhere must not ask for memory.
                const MOST: usize = 100_000;
                if stream >= MOST {
                    let error = InputError::new(&self.path, "there is no such stream").at(Place::Line { line, column: 1 });
                    return Err(error.found(stream).hint(HINT));
                }
                if self.rows.len() <= stream {
                    self.rows.resize_with(stream + 1, VecDeque::new);
                }
                self.rows[stream].push_back(row);
            }
            Entry::Line { line, text } => self.texts.push_back((line, text)),
            Entry::EndOfInput {} => self.input_ended = true,
            entry @ (Entry::Order(_) | Entry::Fill(_) | Entry::Refusal(_)) => self.expected.push_back((line, entry)),
            Entry::Header(_) | Entry::Stop(_) | Entry::Closed {} => {}
        }
        Ok(true)
    }
}

fn text(path: &Path, entry: &Entry) -> Result<String, InputError> {
    serde_json::to_string(entry).map_err(|error| InputError::new(path, format!("an entry cannot be written: {error}")))
}

fn parsed(path: &Path, line: usize, text: &str) -> Result<Entry, InputError> {
    serde_json::from_str(text).map_err(|error| {
        let error = InputError::new(path, format!("no entry of a paper run: {error}")).at(Place::Line { line, column: 1 });
        error.found_text(text).hint("was it written by another version of the program?")
    })
}

fn no_header(path: &Path) -> InputError {
    let error = InputError::new(path, "expected a header").at(Place::Line { line: 1, column: 1 });
    error.hint("give the folder of a paper run, in which journal.jsonl is")
}

/// Holds a journal to be of the run that goes on with it.
fn same_run(path: &Path, of: &Header, own: &Header) -> Result<(), InputError> {
    let refuse = |what: &str, of: &dyn std::fmt::Display, own: &dyn std::fmt::Display, hint: &str| {
        let error = InputError::new(path, format!("the session was begun with {what} {of}, this is {own}"));
        Err(error.at(Place::Line { line: 1, column: 1 }).hint(hint))
    };
    const ANEW: &str = "or begin anew in another folder";
    if of.schema != SCHEMA || of.version != own.version {
        let hint = format!("go on with that version, {ANEW}");
        let [of, own] = [of, own].map(|header| format!("{} ({})", header.version, header.schema));
        return refuse("version", &of, &own, &hint);
    }
    if of.run_sha256 != own.run_sha256 {
        let hint = format!("bring RUN.toml back as it was, {ANEW}");
        return refuse("another RUN.toml, of SHA-256", &of.run_sha256, &own.run_sha256, &hint);
    }
    if of.seed != own.seed {
        return refuse("seed", &of.seed, &own.seed, &format!("give it the same seed, {ANEW}"));
    }
    if of.feed != own.feed {
        let [of, own] = [of, own].map(|header| match header.feed {
            FeedFrom::Files => "the files of RUN.toml",
            FeedFrom::Lines => "standard input",
        });
        return refuse("its feed from", &of, &own, &format!("give --feed as before, {ANEW}"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::entry::StopReason;
    use super::*;
    use proptest::prelude::*;
    use tempfile::TempDir;

    fn header() -> Header {
        let (schema, version, run_sha256) = (SCHEMA.to_owned(), "0.1.0".to_owned(), "ab".to_owned());
        Header { schema, version, run_sha256, seed: 7, feed: FeedFrom::Files }
    }

    fn row(price: f64) -> StoredRow {
        StoredRow::Trade { time: 1, known_at: 2, price, size: 3.0, buy: None }
    }

    /// A journal of two rows of two streams.
    fn begun(folder: &TempDir) -> PathBuf {
        let path = folder.path().join("journal.jsonl");
        let mut log = PaperLog::create(&path, &header(), JournalSync::Asked).unwrap();
        log.add(&[Entry::Row { stream: 1, row: row(1.0) }, Entry::Row { stream: 0, row: row(2.0) }]).unwrap();
        path
    }

    #[test]
    fn rows_come_back_stream_by_stream_and_new_ones_are_added() {
        let folder = TempDir::new().unwrap();
        let path = begun(&folder);
        let (mut log, cut) = PaperLog::resume(&path, &header(), JournalSync::Asked).unwrap();
        assert!(cut.is_none() && log.is_replaying().unwrap());
        assert_eq!((log.next_row(0).unwrap(), log.next_row(0).unwrap()), (Some(row(2.0)), None));
        assert_eq!((log.next_row(1).unwrap(), log.is_replaying().unwrap()), (Some(row(1.0)), false));
        log.add(&[Entry::Stop(Stop { why: StopReason::KillFile, after: 5 }), Entry::Closed {}]).unwrap();
        drop(log);
        let refused = PaperLog::resume(&path, &header(), JournalSync::Asked).unwrap_err().to_string();
        assert!(refused.contains("the session has ended") && refused.contains("hint: "), "{refused}");
        let (log, _) = PaperLog::read(&path, &header()).unwrap();
        assert_eq!(log.stop.map(|stop| stop.after), Some(5));
    }

    #[test]
    fn another_run_is_refused_by_what_differs() {
        let folder = TempDir::new().unwrap();
        let path = begun(&folder);
        let cases = [
            (Header { version: "9".into(), ..header() }, "version"),
            (Header { run_sha256: "cd".into(), ..header() }, "RUN.toml"),
            (Header { seed: 8, ..header() }, "seed 7, this is 8"),
            (Header { feed: FeedFrom::Lines, ..header() }, "--feed"),
        ];
        for (other, word) in cases {
            let refused = PaperLog::resume(&path, &other, JournalSync::Asked).unwrap_err().to_string();
            assert!(refused.contains(word) && refused.contains("hint: "), "{refused}");
        }
    }

    proptest! {
        /// Lines with the right checksums that hold anything at all give an error with their place, or entries.
        #[test]
        fn nonsense_is_an_error_and_no_panic(
            lines in proptest::collection::vec(prop_oneof![
                "[ -~]{0,40}",
                Just("{\"row\":{\"stream\":99999999999,\"row\":{\"trade\":{}}}}".to_owned()),
                Just("{\"row\":{\"stream\":9999999,\"row\":{\"trade\":{\"time\":1,\"known_at\":1,\"price\":1,\"size\":1,\"buy\":null}}}}".to_owned()),
                Just("{\"line\":{\"line\":1,\"text\":\"x\"}}".to_owned()),
                Just("{\"stop\":{\"why\":\"end_of_feed\",\"after\":3}}".to_owned()),
                Just("{\"closed\":{}}".to_owned()),
            ], 0..6)
        ) {
            let folder = TempDir::new().unwrap();
            let path = begun(&folder);
            let (mut journal, _) = Journal::open(&path, JournalSync::Asked, |_, _| Ok(())).unwrap();
            journal.add(&lines).unwrap();
            drop(journal);
            let read = || -> Result<(), InputError> {
                let (mut log, _) = PaperLog::read(&path, &header())?;
                while log.next_row(0)?.is_some() || log.next_text()?.is_some() {}
                log.all_done()
            };
            if let Err(error) = read() {
                prop_assert!(error.path == path && error.hint.is_some(), "{error}");
            }
        }
    }
}
