//! A CSV file in blocks of complete rows, so that no more than one of them is in memory.

use std::io::Read;
use std::path::{Path, PathBuf};

use super::csv::CsvText;
use super::error::InputError;

/// Most bytes of a block, but where one row alone is longer.
const BLOCK: usize = 1 << 22;
/// Most bytes of a row: a quote that nobody closes makes a row of all that follows.
const LONGEST_ROW: usize = 1 << 24;
/// Bytes read at a time.
const PIECE: usize = 1 << 18;
/// What may stand before the header: the byte order mark in UTF-8.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// The blocks of a CSV file.
pub(super) struct CsvBlocks {
    path: PathBuf,
    source: Box<dyn Read + Send>,
    /// What a failure to read is told as.
    failure: fn(&Path, &std::io::Error) -> InputError,
    /// Most rows of a block.
    rows: usize,
    /// What was read and not given out.
    kept: Vec<u8>,
    ended: bool,
    /// Knows the header and the line to go on from.
    before: Option<CsvText>,
    /// Whether any row was given out.
    any: bool,
}

impl CsvBlocks {
    /// Blocks of at most `rows` rows of what `source` gives, which is the content of `path`.
    pub(super) fn new(
        path: &Path,
        source: Box<dyn Read + Send>,
        failure: fn(&Path, &std::io::Error) -> InputError,
        rows: usize,
    ) -> Self {
        let (path, kept) = (path.to_path_buf(), Vec::new());
        Self { path, source, failure, rows: rows.max(1), kept, ended: false, before: None, any: false }
    }

    /// The next rows; none at the end.
    ///
    /// # Errors
    /// As [`CsvText::first_block`], and a row longer than 16 MB.
    pub(super) fn next(&mut self) -> Result<Option<CsvText>, InputError> {
        loop {
            let bytes = self.complete_rows()?;
            if bytes.is_empty() && self.before.is_some() {
                return match self.before.take() {
                    Some(last) if !self.any => Err(last.no_rows(&self.path)),
                    last => {
                        self.before = last;
                        Ok(None)
                    }
                };
            }
            let block = match &self.before {
                None => CsvText::first_block(&self.path, bytes)?,
                Some(before) => before.next_block(&self.path, bytes)?,
            };
            let empty = block.rows() == 0;
            self.before = Some(block.without_rows());
            if !empty {
                self.any = true;
                return Ok(Some(block));
            }
        }
    }

    /// Bytes of complete rows; the last row of the file need not end with a line end. Nothing at the end of the file.
    fn complete_rows(&mut self) -> Result<Vec<u8>, InputError> {
        let mut scan = Scan { rows: self.rows + usize::from(self.before.is_none()), ..Scan::default() };
        loop {
            // A mark of the byte order is not part of the first cell.
            if self.before.is_none() && scan.at == 0 && self.kept.starts_with(MARK) {
                scan.at = MARK.len();
            }
            scan.go_on(&self.kept);
            let full = scan.found == scan.rows || (scan.at >= BLOCK && scan.end > 0);
            if full || self.ended {
                let end = if scan.found == scan.rows || !self.ended { scan.end } else { self.kept.len() };
                let rest = self.kept.split_off(end);
                return Ok(std::mem::replace(&mut self.kept, rest));
            }
            if scan.at - scan.end > LONGEST_ROW {
                return Err(InputError::new(&self.path, "a row is longer than 16 MB")
                    .hint("is there a quote that is not closed? Or is this no CSV file?"));
            }
            let before = self.kept.len();
            let read = self.source.by_ref().take(PIECE as u64).read_to_end(&mut self.kept);
            read.map_err(|error| (self.failure)(&self.path, &error))?;
            self.ended = self.kept.len() == before;
        }
    }
}

/// A search for ends of rows: line ends that are not within quotes. A quote opens a cell only at its start.
#[derive(Default)]
struct Scan {
    /// Rows to find.
    rows: usize,
    found: usize,
    /// Where the search stands.
    at: usize,
    /// Behind the last row that is complete.
    end: usize,
    within: Within,
    /// Whether there is anything but blanks in the row so far; one without is not counted.
    filled: bool,
}

#[derive(Default, Clone, Copy, PartialEq)]
enum Within {
    /// At the start of a cell.
    #[default]
    Start,
    Cell,
    Quotes,
}

impl Scan {
    /// Goes on to the end of `bytes`, or to the last of the rows that are to be found.
    fn go_on(&mut self, bytes: &[u8]) {
        while self.found < self.rows
            && let Some(byte) = bytes.get(self.at)
        {
            self.at += 1;
            self.filled |= !matches!(byte, b'\n' | b'\r' | b' ' | b'\t');
            self.within = match (self.within, byte) {
                // A quote within quotes is written twice: the second opens what the first has closed.
                (Within::Quotes, b'"') => Within::Start,
                (Within::Quotes, _) | (Within::Start, b'"') => Within::Quotes,
                (_, b',') => Within::Start,
                (_, b'\n') => {
                    self.end = self.at;
                    self.found += usize::from(std::mem::take(&mut self.filled));
                    Within::Start
                }
                _ => Within::Cell,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blocks(text: &str, rows: usize) -> Result<Vec<Vec<(String, usize)>>, String> {
        let source = Box::new(std::io::Cursor::new(text.as_bytes().to_vec()));
        let failure = |path: &Path, _: &std::io::Error| InputError::new(path, "cannot be read");
        let mut all = CsvBlocks::new(Path::new("a.csv"), source, failure, rows);
        let mut read = Vec::new();
        while let Some(block) = all.next().map_err(|error| error.to_string())? {
            read.push((0..block.rows()).map(|row| (block.cell(row, 0).into_owned(), block.line(row))).collect());
        }
        assert!(all.next().unwrap().is_none(), "the end stays the end");
        Ok(read)
    }

    fn cell(text: &str, line: usize) -> (String, usize) {
        (text.to_owned(), line)
    }

    #[test]
    fn rows_are_the_same_in_blocks_and_keep_their_lines() {
        let text = "\u{feff}a,b\n1,\"x\n\"\"y\"\r\n\n\"2\",\n3,4";
        let whole = vec![cell("1", 2), cell("2", 5), cell("3", 6)];
        for rows in 1..6 {
            assert_eq!(blocks(text, rows).unwrap().concat(), whole, "{rows} rows a block");
        }
        assert_eq!(blocks("\u{feff}\"a,\nb\"\n1\n", 1).unwrap().concat(), [cell("1", 3)]);
        assert_eq!(blocks("\n\n\na\n\n\n1\n", 1).unwrap().concat(), [cell("1", 7)]);
        assert_eq!(blocks(text, 1).unwrap().len(), 3);
        assert_eq!(blocks("a\n1\n2\n", 1).unwrap().len(), 2, "a line end at the end begins no row");
    }

    #[test]
    fn what_is_no_table_is_said_with_its_line() {
        for (text, message) in [
            ("", "a.csv: the file is empty"),
            ("a,b\n", "a.csv: row 1: the file has a header but no rows"),
            ("a,b\n\n\n \n", "a.csv: row 1: the file has a header but no rows"),
            ("a,b\n1,2\n3\n", "a.csv: row 3: expected 2 cells"),
            ("a,b\n1,2\n3,\"4\n5,6\n", "a.csv: row 3: a quote is not closed"),
            ("a,b\n1,2\n3,\"4\"x\n5,6\n", "a.csv: row 3: expected a comma after the closing quote"),
        ] {
            let error = blocks(text, 1).unwrap_err();
            assert!(error.starts_with(message), "{error}");
        }
    }

    #[test]
    fn a_quote_that_nobody_closes_does_not_fill_the_memory() {
        let text = format!("a\n1\n\"{}", "2\n".repeat(LONGEST_ROW));
        assert!(blocks(&text, 10).unwrap_err().contains("a row is longer than 16 MB"));
    }
}
