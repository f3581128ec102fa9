//! Parquet and Arrow files in pieces: row group by row group, record batch by record batch.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use polars::prelude::{
    DataFrame, FileMetadata, ParallelStrategy, ParquetReader, PolarsResult, SerReader, polars_ensure, polars_err,
};

use super::arrow_buffers::{Block, blocks, part, part_agrees};
use super::columnar::{
    ColumnarFile, Columns, Container, arrow_frame, caught, check_footer, check_group, check_lengths, check_rows, no_rows,
};
use super::error::InputError;

/// Most rows that are decoded at once of a row group. It begins with as many as a piece has, and goes on with twice as many each time:
/// whoever looks at the first rows alone waits for no more.
const WINDOW: usize = 1 << 17;

/// The rows of a columnar file, a piece at a time.
pub(super) struct ColumnarChunks {
    path: PathBuf,
    container: Container,
    source: Source,
    columns: Columns,
    /// Most rows of a piece.
    rows: usize,
    /// What is decoded, and how many of its rows were given out.
    decoded: DataFrame,
    given: usize,
    /// Rows given out of all.
    first_row: usize,
}

enum Source {
    Parquet(RowGroups),
    Arrow(Batches),
}

impl ColumnarChunks {
    /// Pieces of at most `rows` rows of `file`, which was opened from `path`.
    ///
    /// # Errors
    /// A footer that is none, and a Parquet file without rows.
    pub(super) fn new(path: &Path, file: File, container: Container, rows: usize) -> Result<Self, InputError> {
        let (source, columns) = caught(path, container, || match container {
            Container::Parquet => RowGroups::new(file, rows).map(|(groups, columns)| (Source::Parquet(groups), columns)),
            Container::Arrow => Batches::new(file).map(|(batches, columns)| (Source::Arrow(batches), columns)),
        })?;
        let (path, decoded) = (path.to_path_buf(), DataFrame::empty());
        Ok(Self { path, container, source, columns, rows: rows.max(1), decoded, given: 0, first_row: 0 })
    }

    /// The next rows and the number of those before them; none at the end.
    ///
    /// # Errors
    /// What contradicts the file's own counts or cannot be decoded, and a file without rows.
    pub(super) fn next(&mut self) -> Result<Option<(ColumnarFile, usize)>, InputError> {
        while self.given == self.decoded.height() {
            // What is given out is let go of before more is decoded.
            (self.decoded, self.given) = (DataFrame::empty(), 0);
            let (source, columns) = (&mut self.source, &self.columns);
            let next = caught(&self.path, self.container, || match source {
                Source::Parquet(groups) => groups.next(columns),
                Source::Arrow(batches) => batches.next(),
            })?;
            match next {
                Some(frame) => self.decoded = frame,
                None if self.first_row == 0 => return Err(no_rows(&self.path)),
                None => return Ok(None),
            }
        }
        let count = self.rows.min(self.decoded.height() - self.given);
        let piece = self.decoded.slice(self.given as i64, count);
        let first_row = self.first_row;
        self.given += count;
        self.first_row += count;
        Ok(Some((ColumnarFile::of(piece, &self.columns), first_row)))
    }
}

/// The row groups of a Parquet file.
struct RowGroups {
    file: File,
    size: u64,
    footer: Arc<FileMetadata>,
    /// The row group that is read, and how many rows of it were read.
    group: usize,
    within: usize,
    /// The footer of a file that has this row group and no other.
    alone: Arc<FileMetadata>,
    /// Rows to decode next.
    window: usize,
}

impl RowGroups {
    fn new(mut file: File, first: usize) -> PolarsResult<(Self, Columns)> {
        let size = file.metadata()?.len();
        check_footer(&mut file, size)?;
        let mut reader = ParquetReader::new(file.try_clone()?);
        let columns = Columns::of(&*reader.schema()?);
        let footer = Arc::clone(reader.get_metadata()?);
        check_rows(&footer)?;
        let (alone, window) = (Arc::clone(&footer), first.clamp(1, WINDOW));
        Ok((Self { file, size, footer, group: 0, within: 0, alone, window }, columns))
    }

    /// The next rows of the row group, or of the one after it.
    fn next(&mut self, columns: &Columns) -> PolarsResult<Option<DataFrame>> {
        let rows = loop {
            let Some(group) = self.footer.row_groups.get(self.group) else { return Ok(None) };
            if self.within < group.num_rows() {
                break group.num_rows();
            }
            (self.group, self.within) = (self.group + 1, 0);
        };
        if self.within == 0 {
            check_group(&self.footer, self.group, columns, &mut self.file, self.size)?;
            self.alone = alone(&self.footer, self.group);
        }
        let count = self.window.min(rows - self.within);
        self.window = self.window.saturating_mul(2).min(WINDOW);
        let mut reader = ParquetReader::new(self.file.try_clone()?);
        reader.set_metadata(Arc::clone(&self.alone));
        let frame = reader
            .read_parallel(ParallelStrategy::Columns)
            .with_columns(Some(columns.wanted.clone()))
            .with_slice(Some((self.within, count)))
            .finish()?;
        polars_ensure!(frame.height() == count, ComputeError: "its row counts contradict each other");
        check_lengths(&frame, count)?;
        self.within += count;
        Ok(Some(frame))
    }
}

/// `footer` without all row groups but one: whoever reads by it looks at no other.
fn alone(footer: &Arc<FileMetadata>, group: usize) -> Arc<FileMetadata> {
    let Some(own) = footer.row_groups.get(group).filter(|_| footer.row_groups.len() > 1) else { return Arc::clone(footer) };
    Arc::new(FileMetadata {
        version: footer.version,
        num_rows: own.num_rows(),
        max_row_group_height: own.num_rows(),
        created_by: footer.created_by.clone(),
        row_groups: vec![own.clone()],
        key_value_metadata: footer.key_value_metadata.clone(),
        schema_descr: footer.schema_descr.clone(),
        column_orders: footer.column_orders.clone(),
        footer_buf: footer.footer_buf.clone(),
    })
}

/// The record batches of an Arrow file.
struct Batches {
    file: File,
    size: u64,
    footer: Vec<u8>,
    dictionaries: Vec<Block>,
    batches: std::vec::IntoIter<Block>,
}

impl Batches {
    fn new(mut file: File) -> PolarsResult<(Self, Columns)> {
        const AFTER: u64 = 10;
        let size = file.metadata()?.len();
        let mut tail = [0; AFTER as usize];
        let broken = || polars_err!(ComputeError: "its footer contradicts its size");
        let end = size.checked_sub(AFTER).ok_or_else(broken)?;
        file.seek(SeekFrom::Start(end))?;
        file.read_exact(&mut tail)?;
        let [a, b, c, d, magic @ ..] = tail;
        let start = end.checked_sub(u32::from_le_bytes([a, b, c, d]).into()).filter(|_| magic == *b"ARROW1");
        let start = start.ok_or_else(broken)?;
        let footer = Self::read(&mut file, start, end - start, size)?;
        let [dictionaries, batches] = blocks(&footer).ok_or_else(broken)?;
        // An empty file has the same footer: the library reads the columns from there.
        let empty = part(&footer, [&[], &[]], &[]).ok_or_else(broken)?;
        let (_, columns) = arrow_frame(empty, |part| part_agrees(part, size))?;
        Ok((Self { file, size, footer, dictionaries, batches: batches.into_iter() }, columns))
    }

    fn read(file: &mut File, offset: u64, length: u64, size: u64) -> PolarsResult<Vec<u8>> {
        let fits = offset.checked_add(length).is_some_and(|end| end <= size);
        polars_ensure!(fits, ComputeError: "its blocks contradict its size");
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(offset))?;
        file.take(length).read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    /// The next batch, decoded as a file of its own with the dictionaries of the whole.
    fn next(&mut self) -> PolarsResult<Option<DataFrame>> {
        let Some(batch) = self.batches.next() else { return Ok(None) };
        let of = |block: &Block| Self::read(&mut self.file, block.offset, block.length(), self.size);
        let bodies = self.dictionaries.iter().chain([&batch]).map(of).collect::<PolarsResult<Vec<_>>>()?;
        let part = part(&self.footer, [&self.dictionaries, &[batch]], &bodies);
        let part = part.ok_or_else(|| polars_err!(ComputeError: "its footer contradicts its size"))?;
        drop(bodies);
        let (frame, _) = arrow_frame(part, |part| part_agrees(part, self.size))?;
        Ok(Some(frame))
    }
}
