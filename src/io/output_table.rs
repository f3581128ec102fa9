//! Tables on their way to a file.

use std::fmt::Write as _;
use std::path::Path;

use polars::prelude::{
    Column, DataFrame, DataType, IntoColumn, NamedFrom, ParquetCompression, ParquetWriter, PolarsResult, Series,
    TimeUnit as PolarsUnit, TimeZone,
};

use super::error::InputError;
use crate::sim2real::Timestamp;

/// The values of a column; `None` is an empty cell, a null in Parquet.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers.
    Floats(Vec<Option<f64>>),
    /// Integers.
    Integers(Vec<Option<i64>>),
    /// Texts.
    Texts(Vec<Option<String>>),
    /// Times: RFC 3339 in CSV, timestamps [ns, UTC] in Parquet.
    Times(Vec<Option<Timestamp>>),
}

impl Values {
    fn len(&self) -> usize {
        match self {
            Self::Floats(values) => values.len(),
            Self::Integers(values) => values.len(),
            Self::Texts(values) => values.len(),
            Self::Times(values) => values.len(),
        }
    }

    fn cell(&self, row: usize) -> Option<String> {
        match self {
            // The shortest digits that read back as the same bits.
            Self::Floats(values) => values[row].map(|v| format!("{v:?}")),
            Self::Integers(values) => values[row].map(|v| v.to_string()),
            Self::Texts(values) => values[row].clone(),
            Self::Times(values) => values[row].map(|v| v.to_string()),
        }
    }

    fn column(&self, name: &str) -> PolarsResult<Column> {
        let name = name.into();
        Ok(match self {
            Self::Floats(values) => Series::new(name, values),
            Self::Integers(values) => Series::new(name, values),
            Self::Texts(values) => Series::new(name, values),
            Self::Times(values) => {
                let counts: Vec<Option<i64>> = values.iter().map(|v| v.map(|t| t.0)).collect();
                Series::new(name, counts).cast(&DataType::Datetime(PolarsUnit::Nanoseconds, Some(TimeZone::UTC)))?
            }
        }
        .into_column())
    }
}

/// A table to be written; the same table gives the same bytes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OutputTable {
    columns: Vec<(String, Values)>,
}

impl OutputTable {
    /// A table without columns.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a column of numbers.
    #[must_use]
    pub fn floats(self, name: &str, values: impl IntoIterator<Item = impl Into<Option<f64>>>) -> Self {
        self.with(name, Values::Floats(values.into_iter().map(Into::into).collect()))
    }

    /// Adds a column of integers.
    #[must_use]
    pub fn integers(self, name: &str, values: impl IntoIterator<Item = impl Into<Option<i64>>>) -> Self {
        self.with(name, Values::Integers(values.into_iter().map(Into::into).collect()))
    }

    /// Adds a column of texts.
    #[must_use]
    pub fn texts(self, name: &str, values: impl IntoIterator<Item = impl Into<Option<String>>>) -> Self {
        self.with(name, Values::Texts(values.into_iter().map(Into::into).collect()))
    }

    /// Adds a column of times.
    #[must_use]
    pub fn times(self, name: &str, values: impl IntoIterator<Item = impl Into<Option<Timestamp>>>) -> Self {
        self.with(name, Values::Times(values.into_iter().map(Into::into).collect()))
    }

    /// Adds a column.
    #[must_use]
    pub fn with(mut self, name: &str, values: Values) -> Self {
        self.columns.push((name.to_owned(), values));
        self
    }

    /// Its columns: names and values.
    #[must_use]
    pub fn columns(&self) -> &[(String, Values)] {
        &self.columns
    }

    /// The table as the bytes of a file of that name: CSV or Parquet, by its ending.
    ///
    /// # Errors
    /// Another ending; columns that differ in length or share a name.
    pub fn bytes(&self, path: &Path) -> Result<Vec<u8>, InputError> {
        let rows = self.check(path)?;
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("csv") => Ok(self.csv(rows).into_bytes()),
            Some("parquet") => {
                self.parquet().map_err(|error| InputError::new(path, format!("cannot be written as Parquet ({error})")))
            }
            _ => Err(InputError::new(path, "the ending of the name says no format that is written")
                .hint("tables are written as .csv or .parquet")),
        }
    }

    /// How many rows it has, where its columns are those of one table.
    pub(super) fn check(&self, path: &Path) -> Result<usize, InputError> {
        let rows = self.columns.first().map_or(0, |(_, values)| values.len());
        for (index, (name, values)) in self.columns.iter().enumerate() {
            if values.len() != rows || self.columns[..index].iter().any(|(earlier, _)| earlier == name) {
                let message = "the columns of a table differ in length or share a name";
                return Err(InputError::new(path, message).in_column(name.as_str()));
            }
        }
        Ok(rows)
    }

    fn csv(&self, rows: usize) -> String {
        let alone = self.columns.len() == 1;
        let mut out = String::new();
        let names: Vec<String> = self.columns.iter().map(|(name, _)| quoted(name, alone)).collect();
        out.push_str(&names.join(","));
        out.push('\n');
        for row in 0..rows {
            for (index, (_, values)) in self.columns.iter().enumerate() {
                let comma = if index == 0 { "" } else { "," };
                // Writing to a String cannot fail.
                let _ = write!(out, "{comma}{}", quoted(&values.cell(row).unwrap_or_default(), alone));
            }
            out.push('\n');
        }
        out
    }

    pub(super) fn frame(&self) -> PolarsResult<DataFrame> {
        let columns = self.columns.iter().map(|(name, values)| values.column(name)).collect::<PolarsResult<_>>()?;
        DataFrame::new_infer_height(columns)
    }

    fn parquet(&self) -> PolarsResult<Vec<u8>> {
        let mut frame = self.frame()?;
        let mut bytes = Vec::new();
        ParquetWriter::new(&mut bytes).with_compression(ParquetCompression::Zstd(None)).finish(&mut frame)?;
        Ok(bytes)
    }
}

/// A cell in quotes where it needs them; an empty one too where it stands `alone`, for blank lines are no rows. A mark of
/// the byte order is one only where a file starts with it.
fn quoted(cell: &str, alone: bool) -> String {
    let special = cell.contains([',', '"', '\n', '\r', '\u{feff}']) || cell.trim() != cell || (alone && cell.is_empty());
    if special { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}
