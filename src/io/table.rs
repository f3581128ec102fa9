//! A table: named columns read from a file, with errors that say where.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::cell::{INFINITE, NO_INTEGER, Wrong, integer, number};
use super::columnar::{Column, ColumnarFile, no_rows};
use super::csv::CsvText;
use super::error::{InputError, Place, did_you_mean, hint_among, listed};
use super::source::{Ending, bytes, open, unzip};
use super::time_format::{NotATime, TimeFormat, as_integer};
use crate::sim2real::Timestamp;

/// Where a file's names are not the contract's: the contract's name, and the file's.
pub type Renames = BTreeMap<String, String>;

/// A table as it was read from a file: rows in the file's order, columns by name.
///
/// Columns are converted when they are asked for, so columns that nobody asks for may hold anything. A clone shares what was read.
#[derive(Clone)]
pub struct Table {
    path: PathBuf,
    renames: Renames,
    body: Arc<Body>,
    /// Data rows of the file before these, where its rows are counted and not its lines.
    before: usize,
    rows: Rows,
}

/// Which rows of what was read are of a table.
#[derive(Clone)]
pub(super) enum Rows {
    All,
    /// Those that follow one another, from one to before another.
    Span(usize, usize),
    /// Those of these numbers, which data frames count in 32 bits.
    Chosen(Vec<u32>),
}

enum Body {
    Csv(CsvText),
    Columnar(ColumnarFile),
}

impl std::fmt::Debug for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Table({}, {} rows of {:?})", self.path.display(), self.rows(), self.names())
    }
}

impl Table {
    /// Reads a `.csv`, `.csv.gz`, `.parquet`, `.arrow`, `.ipc` or `.feather` file.
    ///
    /// # Errors
    /// A file that is missing, empty, truncated, corrupt, without rows or of an unknown ending; rows of different
    /// lengths; two columns of one name.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        Self::read_with(path, &Renames::new())
    }

    /// Reads a file whose columns are named otherwise; errors speak the file's names.
    ///
    /// # Errors
    /// As [`read`](Self::read), and a rename of a column the file does not have.
    pub fn read_with(path: impl AsRef<Path>, renames: &Renames) -> Result<Self, InputError> {
        let table = Self::read_even_empty(path, renames)?;
        match &*table.body {
            _ if table.rows() > 0 => Ok(table),
            Body::Csv(csv) => Err(csv.no_rows(&table.path)),
            Body::Columnar(_) => Err(no_rows(&table.path)),
        }
    }

    /// As [`read_with`](Self::read_with), but a table of columns without rows is one: a log of a day without fills.
    ///
    /// # Errors
    /// As [`read_with`](Self::read_with), but for that.
    pub fn read_even_empty(path: impl AsRef<Path>, renames: &Renames) -> Result<Self, InputError> {
        Self::read_columns(path.as_ref(), renames, None)
    }

    /// As [`read_even_empty`](Self::read_even_empty), of a columnar file no more than the columns `only`, where any are given: they
    /// may be asked for, and no others.
    pub(crate) fn read_columns(path: &Path, renames: &Renames, only: Option<&[&str]>) -> Result<Self, InputError> {
        let own = |name: &&str| renames.get(*name).cloned().unwrap_or_else(|| (*name).to_owned());
        let only: Option<Vec<String>> = only.map(|only| only.iter().map(own).collect());
        let body = match Ending::of(path)? {
            Ending::Csv => Body::Csv(CsvText::first_block(path, bytes(path, open(path)?)?)?),
            Ending::CsvGz => Body::Csv(CsvText::first_block(path, unzip(path, open(path)?)?)?),
            Ending::Columnar(container) => {
                Body::Columnar(ColumnarFile::read(path, open(path)?, container, only.as_deref())?)
            }
        };
        let table = Self::of(path, renames, body, 0);
        table.check_columns()?;
        Ok(table)
    }

    /// A block of the rows of a CSV file.
    pub(super) fn of_csv(path: &Path, renames: &Renames, block: CsvText) -> Self {
        Self::of(path, renames, Body::Csv(block), 0)
    }

    /// The rows of a columnar file that follow the first `before`.
    pub(super) fn of_piece(path: &Path, renames: &Renames, piece: ColumnarFile, before: usize) -> Self {
        Self::of(path, renames, Body::Columnar(piece), before)
    }

    fn of(path: &Path, renames: &Renames, body: Body, before: usize) -> Self {
        Self { path: path.to_path_buf(), renames: renames.clone(), body: Arc::new(body), before, rows: Rows::All }
    }

    /// The number in the body of a row of the table.
    pub(super) fn row_in_file(&self, row: usize) -> u32 {
        self.own_row(row).try_into().unwrap_or(u32::MAX)
    }

    fn own_row(&self, row: usize) -> usize {
        match &self.rows {
            Rows::All => row,
            Rows::Span(first, _) => first + row,
            Rows::Chosen(rows) => rows.get(row).map_or(row, |own| *own as usize),
        }
    }

    /// Those of the file's rows, by number from 0, without a copy of them: errors give the places they have in the file.
    pub(super) fn with_rows(&self, rows: Vec<u32>) -> Self {
        self.with(Rows::Chosen(rows))
    }

    fn with(&self, rows: Rows) -> Self {
        let (path, renames, body) = (self.path.clone(), self.renames.clone(), Arc::clone(&self.body));
        Self { path, renames, body, before: self.before, rows }
    }

    /// The table in pieces of at most so many rows, in their order and without a copy of them: what is made of a piece is small and
    /// stays near the processor, which what is made of a long table does not.
    pub(crate) fn pieces(&self, most: usize) -> impl Iterator<Item = Self> {
        let (all, most) = (self.rows(), most.max(1));
        (0..all).step_by(most).map(move |first| {
            let end = all.min(first + most);
            self.with(match &self.rows {
                Rows::All => Rows::Span(first, end),
                Rows::Span(before, _) => Rows::Span(before + first, before + end),
                Rows::Chosen(rows) => Rows::Chosen(rows[first..end].to_vec()),
            })
        })
    }

    /// Holds the columns to have names of their own, and the renames to be of columns that are there.
    pub(super) fn check_columns(&self) -> Result<(), InputError> {
        let own = self.own_names();
        let mut seen = BTreeSet::new();
        if let Some(name) = own.iter().find(|name| !seen.insert(name.as_str())) {
            let error = InputError::new(&self.path, format!("two columns are named `{name}`"));
            return Err(error.hint("rename or drop one of them"));
        }
        match self.renames.iter().find(|(_, file_name)| !own.contains(file_name)) {
            None => Ok(()),
            Some((name, file_name)) => Err(self.no_column(file_name).hint(format!(
                "`columns` says that `{name}` is here called `{file_name}`; {}",
                hint_among(file_name, own).unwrap_or_default()
            ))),
        }
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of data rows; at least 1, but of [`read_even_empty`](Self::read_even_empty).
    #[must_use]
    pub fn rows(&self) -> usize {
        match (&self.rows, &*self.body) {
            (Rows::Span(first, end), _) => end - first,
            (Rows::Chosen(rows), _) => rows.len(),
            (Rows::All, Body::Csv(csv)) => csv.rows(),
            (Rows::All, Body::Columnar(file)) => file.rows(),
        }
    }

    /// Names of the columns, renamed where `columns` says so, in the file's order.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        let mut names = Vec::new();
        for own in self.own_names() {
            let before = names.len();
            names.extend(self.renames.iter().filter(|(_, file_name)| *file_name == own).map(|(name, _)| name.as_str()));
            // A rename hides the column that has its name by itself.
            if names.len() == before && !self.renames.contains_key(own) {
                names.push(own);
            }
        }
        names
    }

    /// Whether there is a column of that name.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.own_names().iter().any(|own| own == self.own_name(name))
    }

    /// Holds the left sides of `columns = { … }` to the names that mean something for this file.
    ///
    /// # Errors
    /// A rename to a name that is none of `meaningful`.
    pub fn check_renames(&self, meaningful: &[&str]) -> Result<(), InputError> {
        match self.renames.keys().find(|name| !meaningful.contains(&name.as_str())) {
            None => Ok(()),
            Some(name) => Err(InputError::new(&self.path, format!("`columns` renames to `{name}`, which nothing reads"))
                .maybe_hint(hint_among(name, meaningful))),
        }
    }

    /// The texts of a column that is one of times by its type: RFC 3339, without an offset where the file gives no zone.
    pub(super) fn time_texts(&self, name: &str) -> Option<Vec<Option<String>>> {
        match self.column(name).ok()? {
            Cells::Typed(Column::Instants(values)) => {
                Some(values.into_iter().map(|v| v.map(|ns| Timestamp(ns).to_string())).collect())
            }
            Cells::Typed(Column::Naive(values)) => {
                Some(values.into_iter().map(|v| v.map(|t| t.format("%Y-%m-%dT%H:%M:%S%.9f").to_string())).collect())
            }
            _ => None,
        }
    }

    /// A column of numbers; `None` where the cell is empty, null or NaN. Integers are converted.
    ///
    /// # Errors
    /// A missing column, a text, an infinity.
    pub fn floats(&self, name: &str) -> Result<Vec<Option<f64>>, InputError> {
        match self.column(name)? {
            Cells::Text(texts) => texts
                .enumerate()
                .map(|(row, text)| number(&text).map_err(|e| self.cell_error(name, row, e, &text)))
                .collect(),
            Cells::Typed(Column::Floats(values)) => values
                .into_iter()
                .enumerate()
                .map(|(row, value)| match value {
                    Some(v) if v.is_infinite() => Err(self.error(name, row, INFINITE.0).found(v).hint(INFINITE.1)),
                    value => Ok(value.filter(|v| !v.is_nan())),
                })
                .collect(),
            Cells::Typed(Column::Integers(values)) => Ok(values.into_iter().map(|v| v.map(|v| v as f64)).collect()),
            Cells::Typed(other) => Err(self.wrong_type(name, "numbers", &other)),
        }
    }

    /// A column of numbers without holes.
    ///
    /// # Errors
    /// As [`floats`](Self::floats), and a cell that is empty, null or NaN.
    pub fn floats_complete(&self, name: &str) -> Result<Vec<f64>, InputError> {
        self.complete(name, self.floats(name)?, "a number")
    }

    /// A column of integers; `None` where the cell is empty or null. Numbers written as `1.0` are integers too.
    ///
    /// # Errors
    /// A missing column, a text, a fraction, a number beyond 64 bits.
    pub fn integers(&self, name: &str) -> Result<Vec<Option<i64>>, InputError> {
        match self.column(name)? {
            Cells::Text(texts) => texts
                .enumerate()
                .map(|(row, text)| integer(&text).map_err(|e| self.cell_error(name, row, e, &text)))
                .collect(),
            Cells::Typed(Column::Integers(values)) => Ok(values),
            Cells::Typed(Column::Floats(values)) => values
                .into_iter()
                .enumerate()
                .map(|(row, value)| match value.filter(|v| !v.is_nan()) {
                    None => Ok(None),
                    Some(v) => as_integer(v)
                        .map(Some)
                        .ok_or_else(|| self.error(name, row, NO_INTEGER.0).found(v).hint(NO_INTEGER.1)),
                })
                .collect(),
            Cells::Typed(other) => Err(self.wrong_type(name, "integers", &other)),
        }
    }

    /// A column of texts; `None` where the cell is empty or null. Integers, such as order ids, and booleans are
    /// converted, and so are floats.
    ///
    /// # Errors
    /// A missing column, or one of times.
    pub fn texts(&self, name: &str) -> Result<Vec<Option<String>>, InputError> {
        let filled = |text: &String| !text.is_empty();
        Ok(match self.column(name)? {
            Cells::Text(texts) => texts.map(|text| Some(text.into_owned()).filter(filled)).collect(),
            Cells::Typed(Column::Integers(values)) => values.into_iter().map(|v| v.map(|v| v.to_string())).collect(),
            Cells::Typed(Column::Booleans(values)) => values.into_iter().map(|v| v.map(|v| v.to_string())).collect(),
            Cells::Typed(Column::Floats(values)) => values.into_iter().map(|v| v.map(|v| v.to_string())).collect(),
            Cells::Typed(other) => return Err(self.wrong_type(name, "texts", &other)),
        })
    }

    /// A column of texts without holes.
    ///
    /// # Errors
    /// As [`texts`](Self::texts), and an empty cell.
    pub fn texts_complete(&self, name: &str) -> Result<Vec<String>, InputError> {
        self.complete(name, self.texts(name)?, "a text")
    }

    /// A column of times without holes.
    ///
    /// # Errors
    /// As [`times_with_holes`](Self::times_with_holes), and an empty cell.
    pub fn times(&self, name: &str, format: &TimeFormat) -> Result<Vec<Timestamp>, InputError> {
        self.complete(name, self.times_with_holes(name, format)?, "a time")
    }

    /// A column of times, as `format` reads them; `None` where the cell is empty or null. Columns that are times by
    /// type keep the unit and zone the file gives them, and where it gives no zone are in the `format`'s.
    ///
    /// # Errors
    /// A missing column, a cell that is no time, a local time that the clocks skip, a time outside 1677..2262.
    pub fn times_with_holes(&self, name: &str, format: &TimeFormat) -> Result<Vec<Option<Timestamp>>, InputError> {
        let explain = |row: usize, why: NotATime| self.error(name, row, why.message()).hint(why.hint());
        match self.column(name)? {
            Cells::Text(texts) => each(texts.map(|text| Some(text).filter(|t| !t.trim().is_empty())), |row, text| {
                format.text(text.trim()).map_err(|why| explain(row, why).found_text(&text))
            }),
            Cells::Typed(Column::Integers(values)) => {
                each(values, |row, v| format.count(v).map_err(|why| explain(row, why).found(v)))
            }
            Cells::Typed(Column::Floats(values)) => each(values.into_iter().map(|v| v.filter(|v| !v.is_nan())), |row, v| {
                format.fractional_count(v).map_err(|why| explain(row, why).found(v))
            }),
            Cells::Typed(Column::Instants(values)) => Ok(values.into_iter().map(|v| v.map(Timestamp)).collect()),
            Cells::Typed(Column::Naive(values)) => {
                each(values, |row, v| format.local(v).map_err(|why| explain(row, why).found(v)))
            }
            Cells::Typed(other) => Err(self.wrong_type(name, "times", &other)),
        }
    }

    /// An error about data row `row`, from 0, of a column: for readers that hold cells to more than their type.
    #[must_use]
    pub fn error(&self, name: &str, row: usize, message: impl Into<String>) -> InputError {
        InputError::new(&self.path, message).at(self.place(row)).in_column(self.own_name(name))
    }

    /// Where data row `row`, from 0, is in the file.
    #[must_use]
    pub fn place(&self, row: usize) -> Place {
        let row = self.own_row(row);
        match &*self.body {
            Body::Csv(csv) => Place::Row(csv.line(row)),
            Body::Columnar(_) => Place::Row(self.before + row + 1),
        }
    }

    fn own_names(&self) -> &[String] {
        match &*self.body {
            Body::Csv(csv) => csv.names(),
            Body::Columnar(file) => file.names(),
        }
    }

    fn own_name<'a>(&'a self, name: &'a str) -> &'a str {
        self.renames.get(name).map_or(name, String::as_str)
    }

    fn column(&self, name: &str) -> Result<Cells<'_>, InputError> {
        let own = self.own_name(name);
        let index = self.own_names().iter().position(|n| n == own).ok_or_else(|| self.no_column(own))?;
        Ok(match (&*self.body, &self.rows) {
            (Body::Csv(csv), Rows::Chosen(rows)) => {
                Cells::Text(Box::new(rows.iter().map(move |row| csv.cell(*row as usize, index))))
            }
            (Body::Csv(csv), _) => {
                Cells::Text(Box::new((0..self.rows()).map(move |row| csv.cell(self.own_row(row), index))))
            }
            (Body::Columnar(file), rows) => match file.column(own, rows) {
                // Some writers keep numbers as texts: they are read as a CSV's cells are.
                Column::Texts(values) => {
                    Cells::Text(Box::new(values.into_iter().map(|v| v.map_or(Cow::Borrowed(""), Cow::Owned))))
                }
                other => Cells::Typed(other),
            },
        })
    }

    fn no_column(&self, own: &str) -> InputError {
        let names = self.own_names();
        let meant = did_you_mean(own, names).map(|meant| format!("did you mean `{meant}`? ")).unwrap_or_default();
        let has = if names.len() == 1 { "column" } else { "columns" };
        let error = InputError::new(&self.path, format!("there is no column `{own}`"));
        let hint = match names {
            [only] if only.contains(';') || only.contains('\t') => {
                "cells are separated by commas; was the file written with another separator?".to_owned()
            }
            _ if meant.is_empty() => format!("the file has the {has} {}", listed(names)),
            _ => format!("{meant}The file has the {has} {}", listed(names)),
        };
        error.hint(hint)
    }

    fn wrong_type(&self, name: &str, expected: &str, found: &Column) -> InputError {
        let kind = match found {
            Column::Floats(_) | Column::Integers(_) => "numbers",
            Column::Booleans(_) => "true and false",
            Column::Texts(_) => "texts",
            Column::Instants(_) | Column::Naive(_) => "times",
            Column::Other(kind) => kind.as_str(),
        };
        let hint = match found {
            Column::Other(_) => "write it as 64-bit numbers, texts or timestamps",
            _ => "is another column meant?",
        };
        InputError::new(&self.path, format!("expected {expected}")).in_column(self.own_name(name)).found(kind).hint(hint)
    }

    fn cell_error(&self, name: &str, row: usize, (message, hint): Wrong, text: &str) -> InputError {
        self.error(name, row, message).found_text(text).hint(hint)
    }

    /// What stands in a cell that counts as having no value.
    fn hole(&self, name: &str, row: usize) -> &'static str {
        let nan = match self.column(name) {
            Ok(Cells::Text(mut texts)) => texts.nth(row).is_some_and(|text| text.trim().eq_ignore_ascii_case("nan")),
            Ok(Cells::Typed(Column::Floats(values))) => values.get(row).copied().flatten().is_some_and(f64::is_nan),
            _ => false,
        };
        if nan { "NaN" } else { "an empty cell" }
    }

    fn complete<T>(&self, name: &str, cells: Vec<Option<T>>, what: &str) -> Result<Vec<T>, InputError> {
        let hole = cells.iter().position(Option::is_none);
        match hole {
            None => Ok(cells.into_iter().flatten().collect()),
            Some(row) => Err(self.missing(name, row, what)),
        }
    }

    /// The error of a cell that has no value, in a column that must be complete: `what` was expected there.
    #[must_use]
    pub fn missing(&self, name: &str, row: usize, what: &str) -> InputError {
        let hint = "this column must be complete: fill the cell or drop the row";
        self.error(name, row, format!("expected {what}")).found(self.hole(name, row)).hint(hint)
    }
}

/// The cells of one column.
enum Cells<'a> {
    Text(Box<dyn Iterator<Item = Cow<'a, str>> + 'a>),
    Typed(Column),
}

fn each<V, T>(
    values: impl IntoIterator<Item = Option<V>>,
    convert: impl Fn(usize, V) -> Result<T, InputError>,
) -> Result<Vec<Option<T>>, InputError> {
    values.into_iter().enumerate().map(|(row, value)| value.map(|v| convert(row, v)).transpose()).collect()
}
