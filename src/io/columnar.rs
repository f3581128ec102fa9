//! Parquet and Arrow files; the only place, with [`write`](super::write), that knows the data-frame library.

use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use chrono::{DateTime, NaiveDateTime};
use polars::prelude::{
    ArrowDataType, ArrowSchema, ChunkedArray, DataFrame, DataType, FileMetadata, IpcReader, ParquetReader,
    PolarsNumericType, PolarsResult, SerReader, Series, TimeUnit as PolarsUnit, TimeZone, polars_ensure,
};

use super::arrow_buffers::buffers_agree;
use super::error::InputError;
use super::parquet_pages::{footer_agrees, pages_agree};
use super::table::Rows;

/// The values of one column, in the few types that recordings are made of.
pub(super) enum Column {
    Floats(Vec<Option<f64>>),
    Integers(Vec<Option<i64>>),
    Booleans(Vec<Option<bool>>),
    Texts(Vec<Option<String>>),
    /// Nanoseconds since the Unix epoch, in UTC.
    Instants(Vec<Option<i64>>),
    /// Times without a zone.
    Naive(Vec<Option<NaiveDateTime>>),
    /// A type of which no recording is made, by its name.
    Other(String),
}

/// A table read from Parquet or Arrow.
pub(super) struct ColumnarFile {
    frame: DataFrame,
    /// All columns of the file, also those the frame leaves out.
    names: Vec<String>,
    /// Columns of types that are not read, and these types.
    left_out: Vec<(String, String)>,
}

/// The two kinds of columnar file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Container {
    Parquet,
    Arrow,
}

impl ColumnarFile {
    /// Reads `file`, which was opened from `path`: all columns of it, or those `only`.
    ///
    /// # Errors
    /// A file that is empty, truncated or corrupt.
    pub(super) fn read(path: &Path, file: File, container: Container, only: Option<&[String]>) -> Result<Self, InputError> {
        caught(path, container, || load(file, container, only))
    }

    /// The rows of `frame` as a table of the file whose columns are `columns`.
    pub(super) fn of(frame: DataFrame, columns: &Columns) -> Self {
        Self { frame, names: columns.names.clone(), left_out: columns.left_out.clone() }
    }

    pub(super) fn names(&self) -> &[String] {
        &self.names
    }

    pub(super) fn rows(&self) -> usize {
        self.frame.height()
    }

    /// The values of the column of that name, which the file must have, in those `rows`.
    pub(super) fn column(&self, name: &str, rows: &Rows) -> Column {
        if let Some((_, kind)) = self.left_out.iter().find(|(left_out, _)| left_out == name) {
            return Column::Other(kind.clone());
        }
        let series = self.frame.column(name).map(|column| column.as_materialized_series());
        let of_rows = series.and_then(|series| match rows {
            Rows::All => Ok(series.clone()),
            Rows::Span(first, end) => Ok(series.slice(*first as i64, end - first)),
            Rows::Chosen(rows) => series.take_slice(rows),
        });
        match of_rows.and_then(|series| values(&series)) {
            Ok(column) => column,
            Err(error) => Column::Other(first_line(&error.to_string())),
        }
    }
}

/// What `decode` gives, which reads from the file at `path`.
///
/// # Errors
/// Whatever it refuses, and where it panics: the decoders do on some corrupt bytes, and a recording must not take the
/// process with it.
pub(super) fn caught<T>(
    path: &Path,
    container: Container,
    decode: impl FnOnce() -> PolarsResult<T>,
) -> Result<T, InputError> {
    let kind = match container {
        Container::Parquet => "Parquet",
        Container::Arrow => "Arrow IPC",
    };
    let corrupt = |reason: &str| {
        InputError::new(path, format!("expected a whole {kind} file ({})", first_line(reason)))
            .hint("the file is truncated, corrupt or of another format: copy or write it again")
    };
    match catch_unwind(AssertUnwindSafe(decode)) {
        Ok(result) => result.map_err(|error| corrupt(&error.to_string())),
        Err(_) => Err(corrupt("its contents contradict each other")),
    }
}

/// The error of a file without rows.
pub(super) fn no_rows(path: &Path) -> InputError {
    InputError::new(path, "the file has columns but no rows").hint("was the recording cut off before its first sample?")
}

/// The columns of a file.
pub(super) struct Columns {
    /// All of them.
    pub(super) names: Vec<String>,
    /// Those of types that are read.
    pub(super) wanted: Vec<String>,
    /// The others, and their types.
    left_out: Vec<(String, String)>,
}

impl Columns {
    /// The columns that `schema` names.
    pub(super) fn of(schema: &ArrowSchema) -> Self {
        let (mut names, mut wanted, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
        for field in schema.iter_values() {
            let name = field.name.to_string();
            match readable(&field.dtype) {
                true => wanted.push(name.clone()),
                false => left_out.push((name.clone(), type_name(&field.dtype))),
            }
            names.push(name);
        }
        Self { names, wanted, left_out }
    }
}

fn first_line(text: &str) -> String {
    text.lines().next().unwrap_or_default().to_owned()
}

fn load(mut file: File, container: Container, only: Option<&[String]>) -> PolarsResult<ColumnarFile> {
    match container {
        Container::Parquet => {
            let (size, mut again) = (file.metadata()?.len(), file.try_clone()?);
            check_footer(&mut again, size)?;
            let mut reader = ParquetReader::new(file);
            let mut columns = Columns::of(&*reader.schema()?);
            columns.wanted.retain(|name| only.is_none_or(|only| only.contains(name)));
            let footer = Arc::clone(reader.get_metadata()?);
            check_rows(&footer)?;
            for group in 0..footer.row_groups.len() {
                check_group(&footer, group, &columns, &mut again, size)?;
            }
            let frame = reader.with_columns(Some(columns.wanted.clone())).finish()?;
            check_lengths(&frame, footer.num_rows)?;
            Ok(ColumnarFile::of(frame, &columns))
        }
        Container::Arrow => {
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes)?;
            let (frame, columns) = arrow_frame(bytes, buffers_agree)?;
            Ok(ColumnarFile::of(frame, &columns))
        }
    }
}

/// The rows and columns of an Arrow file that `agrees` has nothing against.
pub(super) fn arrow_frame(bytes: Vec<u8>, agrees: impl Fn(&[u8]) -> bool) -> PolarsResult<(DataFrame, Columns)> {
    let bytes: Arc<[u8]> = bytes.into();
    let mut reader = IpcReader::new(Cursor::new(Arc::clone(&bytes)));
    let columns = Columns::of(&*reader.schema()?);
    polars_ensure!(agrees(&bytes), ComputeError: "its buffers contradict its size");
    let frame = reader.with_columns(Some(columns.wanted.clone())).finish()?;
    check_lengths(&frame, frame.height())?;
    Ok((frame, columns))
}

/// Holds every column of what was decoded to have `rows`: where levels run out before values the decoder gives as many as there are.
pub(super) fn check_lengths(frame: &DataFrame, rows: usize) -> PolarsResult<()> {
    let whole = frame.materialized_column_iter().all(|column| column.len() == rows);
    polars_ensure!(whole, ComputeError: "its columns have fewer values than it has rows");
    Ok(())
}

/// Holds the lists of a Parquet footer to its length, where there is one: it stands before its length and `PAR1`.
pub(super) fn check_footer(file: &mut File, size: u64) -> PolarsResult<()> {
    let mut tail = [0; 8];
    let Some(end) = size.checked_sub(8) else { return Ok(()) };
    file.seek(SeekFrom::Start(end))?;
    file.read_exact(&mut tail)?;
    let [a, b, c, d, magic @ ..] = tail;
    let start = end.checked_sub(u32::from_le_bytes([a, b, c, d]).into()).filter(|_| magic == *b"PAR1");
    let Some(start) = start else { return Ok(()) };
    let mut footer = Vec::new();
    file.seek(SeekFrom::Start(start))?;
    file.take(end - start).read_to_end(&mut footer)?;
    polars_ensure!(footer_agrees(&footer), ComputeError: "the lists of its footer contradict its length");
    Ok(())
}

/// Holds the row counts of a Parquet footer to agree with each other.
pub(super) fn check_rows(footer: &FileMetadata) -> PolarsResult<()> {
    let rows = footer.row_groups.iter().try_fold(0_usize, |sum, group| sum.checked_add(group.num_rows()));
    polars_ensure!(rows == Some(footer.num_rows), ComputeError: "its row counts contradict each other");
    Ok(())
}

/// Holds the counts of row group `group` of a Parquet footer and those of the page headers of wanted columns to agree with each
/// other and with the size of the file [bytes].
pub(super) fn check_group(
    footer: &FileMetadata,
    group: usize,
    columns: &Columns,
    file: &mut File,
    size: u64,
) -> PolarsResult<()> {
    let Some(group) = footer.row_groups.get(group) else { return Ok(()) };
    for chunk in group.parquet_columns() {
        let name = chunk.descriptor().path_in_schema.first();
        if name.is_some_and(|name| !columns.wanted.iter().any(|wanted| wanted == name.as_str())) {
            continue;
        }
        // A column of lists has more values than rows.
        let flat = chunk.descriptor().descriptor.max_rep_level == 0;
        let range = chunk.byte_range();
        let fits = range.start <= range.end && range.end <= size;
        let counted = !flat || usize::try_from(chunk.num_values()) == Ok(group.num_rows());
        polars_ensure!(fits && counted, ComputeError: "its footer contradicts its size");
        let read = |at: u64, most: u64| -> PolarsResult<Vec<u8>> {
            let mut bytes = Vec::new();
            file.seek(SeekFrom::Start(range.start + at))?;
            Read::by_ref(file).take(most).read_to_end(&mut bytes)?;
            Ok(bytes)
        };
        let agree = pages_agree(range.end - range.start, chunk.num_values(), read)?;
        polars_ensure!(agree, ComputeError: "its pages contradict its footer");
    }
    Ok(())
}

/// The name of a type, without what is within it.
fn type_name(kind: &ArrowDataType) -> String {
    let name = format!("{kind:?}");
    format!("the type {}", name.split(['(', '{']).next().unwrap_or_default().trim())
}

/// Whether columns of that type are read; the data-frame library is built without the others, and panics at them.
fn readable(kind: &ArrowDataType) -> bool {
    match kind {
        ArrowDataType::Timestamp(_, zone) => TimeZone::opt_try_new(zone.clone()).is_ok(),
        ArrowDataType::Dictionary(_, value, _) => {
            matches!(**value, ArrowDataType::Utf8 | ArrowDataType::LargeUtf8 | ArrowDataType::Utf8View)
        }
        _ => matches!(
            kind,
            ArrowDataType::Null
                | ArrowDataType::Boolean
                | ArrowDataType::Int32
                | ArrowDataType::Int64
                | ArrowDataType::UInt32
                | ArrowDataType::UInt64
                | ArrowDataType::Float32
                | ArrowDataType::Float64
                | ArrowDataType::Utf8
                | ArrowDataType::LargeUtf8
                | ArrowDataType::Utf8View
                | ArrowDataType::Date32
                | ArrowDataType::Date64
        ),
    }
}

fn values(series: &Series) -> PolarsResult<Column> {
    Ok(match series.dtype() {
        DataType::Float64 => Column::Floats(cells(series.f64()?)),
        DataType::Float32 => Column::Floats(series.f32()?.iter().map(|v| v.map(f64::from)).collect()),
        DataType::Int32 | DataType::Int64 | DataType::UInt32 | DataType::UInt64 => {
            Column::Integers(cells(series.strict_cast(&DataType::Int64)?.i64()?))
        }
        DataType::Boolean => Column::Booleans(series.bool()?.iter().collect()),
        DataType::String => Column::Texts(series.str()?.iter().map(|v| v.map(str::to_owned)).collect()),
        DataType::Categorical(..) | DataType::Enum(..) => {
            let texts = series.cast(&DataType::String)?;
            Column::Texts(texts.str()?.iter().map(|v| v.map(str::to_owned)).collect())
        }
        DataType::Null => Column::Texts(vec![None; series.len()]),
        DataType::Date => {
            // Days since the epoch.
            let days = series.cast(&DataType::Int32)?;
            let midnight = |day: i32| DateTime::from_timestamp(i64::from(day) * 86_400, 0).map(|t| t.naive_utc());
            Column::Naive(days.i32()?.iter().map(|v| v.and_then(midnight)).collect())
        }
        DataType::Datetime(unit, zone) => instants(series, *unit, zone.is_some())?,
        other => Column::Other(format!("the type {other}")),
    })
}

/// The values of a column. One without holes, as most are, is copied without a look at each cell's bit.
fn cells<T: PolarsNumericType>(column: &ChunkedArray<T>) -> Vec<Option<T::Native>> {
    match column.cont_slice() {
        Ok(values) if column.null_count() == 0 => values.iter().copied().map(Some).collect(),
        _ => column.iter().collect(),
    }
}

fn instants(series: &Series, unit: PolarsUnit, zoned: bool) -> PolarsResult<Column> {
    let per_unit = match unit {
        PolarsUnit::Nanoseconds => 1,
        PolarsUnit::Microseconds => 1_000,
        PolarsUnit::Milliseconds => 1_000_000,
    };
    let counts = series.to_physical_repr();
    let counts = counts.i64()?;
    let mut nanoseconds = Vec::with_capacity(counts.len());
    for count in counts.iter() {
        match count.map(|c: i64| c.checked_mul(per_unit)) {
            Some(None) => return Ok(Column::Other("a time outside the years 1677 to 2262".to_owned())),
            value => nanoseconds.push(value.flatten()),
        }
    }
    if zoned {
        return Ok(Column::Instants(nanoseconds));
    }
    let naive = |ns: i64| DateTime::from_timestamp_nanos(ns).naive_utc();
    Ok(Column::Naive(nanoseconds.into_iter().map(|v| v.map(naive)).collect()))
}
