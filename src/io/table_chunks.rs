//! A table in pieces, for files that are longer than memory.

use std::path::{Path, PathBuf};

use super::columnar_chunks::ColumnarChunks;
use super::csv_blocks::CsvBlocks;
use super::error::InputError;
use super::source::{Ending, no_gzip, open, unreadable};
use super::table::{Renames, Table};

/// The rows of a file, as [`Table`]s of some rows each. Rows are numbered, and errors placed, in the file as a whole.
///
/// No more is in memory than a piece of the file: of CSV a block of complete lines, of at most 4 MB but where one row is
/// longer; of Parquet the pages of one column of a row group, and at most 131,072 decoded rows; of Arrow a record batch
/// and the dictionaries. What it needs does therefore not grow with the file's length, but with that of its row groups
/// and record batches, which whoever wrote it has chosen.
///
/// What is broken is found where it stands: the tables before it have been given out by then, while [`Table::read`] gives
/// nothing of such a file.
pub struct TableChunks {
    path: PathBuf,
    renames: Renames,
    source: Source,
    first: Option<Table>,
}

enum Source {
    Csv(Box<CsvBlocks>),
    Columnar(Box<ColumnarChunks>),
}

impl std::fmt::Debug for TableChunks {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "TableChunks({})", self.path.display())
    }
}

impl TableChunks {
    /// Rows of a table where nothing asks for another number: a few MB of market data.
    pub const ROWS: usize = 1 << 15;

    /// Opens a `.csv`, `.csv.gz`, `.parquet`, `.arrow`, `.ipc` or `.feather` file, to be read `rows` rows at a time.
    ///
    /// # Errors
    /// As [`Table::read_with`], as far as it shows in the first table.
    pub fn open(path: impl AsRef<Path>, renames: &Renames, rows: usize) -> Result<Self, InputError> {
        let path = path.as_ref();
        let source = match Ending::of(path)? {
            Ending::Csv => Source::Csv(Box::new(CsvBlocks::new(path, Box::new(open(path)?), unreadable, rows))),
            Ending::CsvGz => {
                let unzipped = flate2::read::MultiGzDecoder::new(open(path)?);
                Source::Csv(Box::new(CsvBlocks::new(path, Box::new(unzipped), no_gzip, rows)))
            }
            Ending::Columnar(container) => {
                Source::Columnar(Box::new(ColumnarChunks::new(path, open(path)?, container, rows)?))
            }
        };
        let mut chunks = Self { path: path.to_path_buf(), renames: renames.clone(), source, first: None };
        chunks.first = chunks.read()?;
        if let Some(first) = &chunks.first {
            first.check_columns()?;
        }
        Ok(chunks)
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The table that [`next_table`](Self::next_table) gives first: for what is to be known of the columns before.
    #[must_use]
    pub fn first(&self) -> Option<&Table> {
        self.first.as_ref()
    }

    /// The next rows; none at the end of the file.
    ///
    /// # Errors
    /// As [`Table::read_with`], as far as it shows in these rows.
    pub fn next_table(&mut self) -> Result<Option<Table>, InputError> {
        match self.first.take() {
            Some(first) => Ok(Some(first)),
            None => self.read(),
        }
    }

    fn read(&mut self) -> Result<Option<Table>, InputError> {
        Ok(match &mut self.source {
            Source::Csv(blocks) => blocks.next()?.map(|block| Table::of_csv(&self.path, &self.renames, block)),
            Source::Columnar(chunks) => {
                chunks.next()?.map(|(piece, before)| Table::of_piece(&self.path, &self.renames, piece, before))
            }
        })
    }
}
