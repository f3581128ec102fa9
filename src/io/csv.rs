//! CSV (RFC 4180) cut into cells.
//!
//! The cells stay where they are in the text, so that an error can say on which line of the file it stands, which a
//! data-frame reader has forgotten by then; such readers also fill short rows up in silence.

use std::borrow::Cow;
use std::path::Path;

use super::error::{InputError, Place};

/// A CSV text and where its cells are.
pub(super) struct CsvText {
    text: String,
    names: Vec<String>,
    rows: Rows,
    header_line: usize,
}

/// Where the rows of a text are, but for the header.
struct Rows {
    /// Byte at which each row starts.
    starts: Vec<usize>,
    /// Byte after each cell, from the start of its row: 4 bytes a cell, row by row.
    ends: Vec<u32>,
    /// Line of the file on which each row starts, from 1.
    lines: Vec<usize>,
    /// The line after the last.
    next_line: usize,
}

impl CsvText {
    /// Cuts the complete lines with which the file begins, the header among them; there may be no rows among them.
    ///
    /// # Errors
    /// Bytes that are not UTF-8, an empty file, rows of different lengths, a quote that is not closed.
    pub(super) fn first_block(path: &Path, bytes: Vec<u8>) -> Result<Self, InputError> {
        let mut text = decode(path, bytes, 1)?;
        if text.starts_with('\u{feff}') {
            text.drain(..'\u{feff}'.len_utf8());
        }
        if text.trim().is_empty() {
            return Err(InputError::new(path, "the file is empty").hint("expected a header row and data rows"));
        }
        let mut cursor = Cursor { path, text: &text, at: 0, line: 1 };
        let mut header = Vec::new();
        let (start, header_line) = loop {
            let (start, line) = (cursor.at, cursor.line);
            cursor.row(&mut header)?;
            if !is_blank(&text[start..cursor.at]) {
                break (start, line);
            }
            header.clear();
        };
        let names: Vec<String> = (0..header.len()).map(|k| shown(cell(&text, start, &header, k)).into_owned()).collect();
        let rows = cursor.rows(names.len())?;
        Ok(Self { text, names, rows, header_line })
    }

    /// Cuts complete lines of the file of which `self` is an earlier block.
    ///
    /// # Errors
    /// Bytes that are not UTF-8, rows of other lengths than the header, a quote that is not closed.
    pub(super) fn next_block(&self, path: &Path, bytes: Vec<u8>) -> Result<Self, InputError> {
        let line = self.rows.next_line;
        let text = decode(path, bytes, line)?;
        let rows = Cursor { path, text: &text, at: 0, line }.rows(self.names.len())?;
        Ok(Self { text, names: self.names.clone(), rows, header_line: self.header_line })
    }

    /// The same, with its rows from line `line` on: for text that stands elsewhere in the file.
    pub(super) fn at_line(mut self, line: usize) -> Self {
        self.rows.lines.iter_mut().enumerate().for_each(|(row, own)| *own = line + row);
        self
    }

    /// What a later block needs of this one.
    pub(super) fn without_rows(&self) -> Self {
        let rows = Rows { starts: Vec::new(), ends: Vec::new(), lines: Vec::new(), next_line: self.rows.next_line };
        Self { text: String::new(), names: self.names.clone(), rows, header_line: self.header_line }
    }

    /// The error of a file that ended without rows.
    pub(super) fn no_rows(&self, path: &Path) -> InputError {
        no_rows(path, self.header_line)
    }

    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    pub(super) fn rows(&self) -> usize {
        self.rows.starts.len()
    }

    /// Line of the file on which data row `row` starts, from 1.
    pub(super) fn line(&self, row: usize) -> usize {
        self.rows.lines.get(row).copied().unwrap_or_default()
    }

    /// A cell without its quotes, or without the blanks around it.
    pub(super) fn cell(&self, row: usize, column: usize) -> Cow<'_, str> {
        let width = self.names.len();
        shown(cell(&self.text, self.rows.starts[row], &self.rows.ends[row * width..(row + 1) * width], column))
    }
}

fn is_blank(row: &str) -> bool {
    row.bytes().all(|b| matches!(b, b'\n' | b'\r' | b' ' | b'\t'))
}

fn cell<'a>(text: &'a str, start: usize, ends: &[u32], k: usize) -> &'a str {
    let from = if k == 0 { start } else { start + ends[k - 1] as usize + 1 };
    text[from..start + ends[k] as usize].trim_end_matches('\r')
}

/// A cell without its quotes, or without the blanks around it.
fn shown(raw: &str) -> Cow<'_, str> {
    if raw.starts_with('"') { unquote(raw) } else { Cow::Borrowed(raw.trim()) }
}

fn unquote(raw: &str) -> Cow<'_, str> {
    match raw.strip_prefix('"').and_then(|r| r.strip_suffix('"')) {
        Some(inner) if inner.contains("\"\"") => Cow::Owned(inner.replace("\"\"", "\"")),
        Some(inner) => Cow::Borrowed(inner),
        None => Cow::Borrowed(raw),
    }
}

fn ragged(path: &Path, line: usize, expected: usize, found: usize) -> InputError {
    let hint = if expected == 1 {
        "cells are separated by commas; was the file written with another separator?"
    } else if found < expected {
        "was the file cut off while it was written?"
    } else {
        "does a cell hold a comma (a decimal comma, say)? Then it belongs in quotes"
    };
    InputError::new(path, format!("expected {expected} cells, as in the header"))
        .at(Place::Row(line))
        .found(found)
        .hint(hint)
}

fn no_rows(path: &Path, header_line: usize) -> InputError {
    InputError::new(path, "the file has a header but no rows")
        .at(Place::Row(header_line))
        .hint("was the recording cut off before its first sample?")
}

/// `bytes`, which begin with line `first` of the file, as text.
fn decode(path: &Path, bytes: Vec<u8>, first: usize) -> Result<String, InputError> {
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let line = first + bytes[..valid].iter().filter(|b| **b == b'\n').count();
        let hint = match bytes {
            [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "this is UTF-16: save it as UTF-8",
            [0x1f, 0x8b, ..] => "this is compressed by gzip: name it .csv.gz",
            [b'P', b'A', b'R', b'1', ..] => "this is Parquet: name it .parquet",
            _ => "save the file as UTF-8",
        };
        InputError::new(path, "expected UTF-8 text")
            .at(Place::Row(line))
            .found(format_args!("byte {:#04x}", bytes[valid]))
            .hint(hint)
    })
}

struct Cursor<'a> {
    path: &'a Path,
    text: &'a str,
    at: usize,
    line: usize,
}

impl Cursor<'_> {
    /// Reads all rows that are left, of `width` cells each; blank lines are none.
    fn rows(mut self, width: usize) -> Result<Rows, InputError> {
        let (mut starts, mut ends, mut lines) = (Vec::new(), Vec::new(), Vec::new());
        while self.at < self.text.len() {
            let (start, line, before) = (self.at, self.line, ends.len());
            self.row(&mut ends)?;
            if is_blank(&self.text[start..self.at]) {
                ends.truncate(before);
                continue;
            }
            if ends.len() - before != width {
                return Err(ragged(self.path, line, width, ends.len() - before));
            }
            starts.push(start);
            lines.push(line);
        }
        Ok(Rows { starts, ends, lines, next_line: self.line })
    }

    /// Reads one row, up to and with its line end; adds the ends of its cells.
    fn row(&mut self, ends: &mut Vec<u32>) -> Result<(), InputError> {
        let bytes = self.text.as_bytes();
        let start = self.at;
        let path = self.path;
        let too_long = |line| InputError::new(path, "a row is longer than 4 GB").at(Place::Row(line));
        loop {
            if bytes.get(self.at) == Some(&b'"') {
                self.skip_quoted()?;
            }
            let rest = &bytes[self.at..];
            let length = rest.iter().position(|b| matches!(b, b',' | b'\n')).unwrap_or(rest.len());
            self.at += length;
            ends.push(u32::try_from(self.at - start).map_err(|_| too_long(self.line))?);
            match bytes.get(self.at) {
                Some(b',') => self.at += 1,
                Some(_) => {
                    self.at += 1;
                    self.line += 1;
                    return Ok(());
                }
                None => return Ok(()),
            }
        }
    }

    /// Stands on a quote; goes behind the one that closes it.
    fn skip_quoted(&mut self) -> Result<(), InputError> {
        let bytes = self.text.as_bytes();
        let (opened, line) = (self.at, self.line);
        self.at += 1;
        loop {
            match bytes.get(self.at) {
                None => {
                    return Err(InputError::new(self.path, "a quote is not closed")
                        .at(Place::Row(line))
                        .found_text(&self.text[opened..])
                        .hint("a quote within a cell is written twice"));
                }
                Some(b'"') if bytes.get(self.at + 1) == Some(&b'"') => self.at += 2,
                Some(b'"') => {
                    self.at += 1;
                    let after = bytes.get(self.at);
                    if matches!(after, None | Some(b',' | b'\n' | b'\r')) {
                        return Ok(());
                    }
                    return Err(InputError::new(self.path, "expected a comma after the closing quote")
                        .at(Place::Row(self.line))
                        .found_text(self.text[opened..].lines().next().unwrap_or_default())
                        .hint("a quote within a cell is written twice"));
                }
                Some(other) => {
                    self.line += usize::from(*other == b'\n');
                    self.at += 1;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<CsvText, InputError> {
        let csv = CsvText::first_block(Path::new("a.csv"), text.as_bytes().to_vec())?;
        if csv.rows() == 0 { Err(csv.no_rows(Path::new("a.csv"))) } else { Ok(csv) }
    }

    #[test]
    fn quotes_blank_lines_and_line_ends_are_understood() {
        let csv = parse("\u{feff}a, \"b,c\" \r\n").err().map(|e| e.message);
        assert_eq!(csv.as_deref(), Some("the file has a header but no rows"));
        let csv = parse("\n\"a\",\"b,c\"\r\n1 ,\"x \"\"y\"\",\nz\"\r\n\r\n 2,\n").unwrap();
        assert_eq!(csv.names(), ["a", "b,c"]);
        assert_eq!((csv.cell(0, 0), csv.cell(0, 1)), ("1".into(), "x \"y\",\nz".into()));
        assert_eq!((csv.cell(1, 0), csv.cell(1, 1)), ("2".into(), "".into()));
        assert_eq!((csv.rows(), csv.line(0), csv.line(1)), (2, 3, 6));
    }

    #[test]
    fn what_is_no_table_is_said_with_its_line() {
        let line = |text: &str| parse(text).err().map(|e| (e.place, e.found));
        assert_eq!(line("a,b\n1,2\n3\n"), Some((Place::Row(3), Some("1".into()))));
        assert_eq!(line("a,b\n1,2\n3,4,5\n"), Some((Place::Row(3), Some("3".into()))));
        assert_eq!(line("a,b\n1,\"2\n3,4\n"), Some((Place::Row(2), Some(r#""\"2\n3,4\n""#.into()))));
        assert_eq!(line("  \n"), Some((Place::File, None)));
        let bytes = CsvText::first_block(Path::new("a.csv"), b"a\n1\n\xfc\n".to_vec()).err().unwrap();
        assert_eq!((bytes.place, bytes.found.as_deref()), (Place::Row(3), Some("byte 0xfc")));
    }
}
