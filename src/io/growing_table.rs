//! Tables that are written some rows at a time, so that what is in memory does not grow with them.

use std::fs::File;
use std::path::{Path, PathBuf};

use polars::io::parquet::write::BatchedWriter;
use polars::prelude::{ParquetCompression, ParquetWriter, PolarsError, PolarsResult};

use super::error::InputError;
use super::output_table::OutputTable;

/// A Parquet file to which rows are added. It is one of an [`OutputFolder`](super::OutputFolder), and appears with it.
pub struct GrowingTable {
    /// Where it will be.
    path: PathBuf,
    writer: BatchedWriter<File>,
}

impl std::fmt::Debug for GrowingTable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "GrowingTable({})", self.path.display())
    }
}

impl GrowingTable {
    /// A file at `place` that will be at `path`, with the columns of `like`, whose rows count for nothing.
    pub(super) fn create(place: &Path, path: PathBuf, like: &OutputTable) -> Result<Self, InputError> {
        let make = || -> PolarsResult<_> {
            let file = File::create(place)?;
            let writer = ParquetWriter::new(file).with_compression(ParquetCompression::Zstd(None));
            writer.batched(like.frame()?.schema())
        };
        let writer = make().map_err(|error| failed(&path, &error))?;
        Ok(Self { path, writer })
    }

    /// Adds the rows of a table with the same columns.
    ///
    /// # Errors
    /// Columns that differ in length, or are not those of the file; a disk that is full.
    pub fn append(&mut self, rows: &OutputTable) -> Result<(), InputError> {
        rows.check(&self.path)?;
        let write = |writer: &mut BatchedWriter<File>| writer.write_batch(&rows.frame()?);
        write(&mut self.writer).map_err(|error| failed(&self.path, &error))
    }

    /// Writes the end of the file.
    ///
    /// # Errors
    /// A disk that is full.
    pub fn finish(self) -> Result<(), InputError> {
        self.writer.finish().map(drop).map_err(|error| failed(&self.path, &error))
    }
}

fn failed(path: &Path, error: &PolarsError) -> InputError {
    InputError::new(path, format!("cannot be written as Parquet ({error})"))
}

#[cfg(test)]
mod tests {
    use super::super::{OutputFolder, Overwrite, Table};
    use super::*;

    fn rows(values: &[f64]) -> OutputTable {
        OutputTable::new()
            .floats("a", values.iter().copied())
            .texts("b", values.iter().map(|value| Some(format!("{value}")).filter(|text| text != "2")))
    }

    #[test]
    fn rows_that_are_added_are_there_and_the_file_appears_with_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("out");
        let mut output = OutputFolder::create(&place, Overwrite::Refuse).unwrap();
        let mut table = output.grow("t.parquet", &rows(&[])).unwrap();
        table.append(&rows(&[1.0, 2.0])).unwrap();
        table.append(&rows(&[])).unwrap();
        table.append(&rows(&[3.0])).unwrap();
        assert!(table.append(&rows(&[4.0]).floats("a", [5.0])).is_err(), "a column twice");
        table.finish().unwrap();
        assert!(!place.exists());
        output.finish().unwrap();
        let read = Table::read(place.join("t.parquet")).unwrap();
        assert_eq!(read.floats_complete("a").unwrap(), [1.0, 2.0, 3.0]);
        assert_eq!(read.texts("b").unwrap(), [Some("1".to_owned()), None, Some("3".to_owned())]);
    }

    #[test]
    fn an_empty_table_has_its_columns_and_one_that_is_there_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let mut output = OutputFolder::create(folder.path(), Overwrite::Refuse).unwrap();
        output.grow("t.parquet", &rows(&[])).unwrap().finish().unwrap();
        output.finish().unwrap();
        assert_eq!(Table::read_even_empty(folder.path().join("t.parquet"), &Default::default()).unwrap().rows(), 0);
        let mut output = OutputFolder::create(folder.path(), Overwrite::Refuse).unwrap();
        assert!(output.grow("t.parquet", &rows(&[])).unwrap_err().to_string().contains("--force"));
    }
}
