//! Tables between the library, NumPy, and whatever speaks Arrow's C data interface (pandas, polars, pyarrow, DuckDB ...).

use std::collections::HashSet;
use std::path::PathBuf;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::{FFI_ArrowArrayStream, RecordBatchStreamReader};
use arrow_array::{
    Array, ArrayRef, ArrowPrimitiveType, Float64Array, Int64Array, RecordBatch, RecordBatchIterator, RecordBatchReader,
    StringArray, TimestampNanosecondArray, types,
};
use arrow_schema::{ArrowError, DataType, Field, Schema, TimeUnit};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict, PyList};
use trueup::io::{OutputTable, Overwrite, Values, write_table};
use trueup::sim2real::Timestamp;

use crate::error;

/// The name of capsules with a stream of tables. Source: the Arrow PyCapsule interface.
const STREAM: &std::ffi::CStr = c"arrow_array_stream";

/// A table of a result, by columns, that never changes.
///
/// `table["price"]` is a column as a new NumPy array of shape (rows,): numbers are float64 (NaN where there is none), whole
/// numbers int64 where every row has one, times datetime64[ns] (UTC; NaT where there is none), texts objects (None where there is
/// none). `__arrow_c_stream__` hands the table to pandas, polars or pyarrow without a copy.
#[pyclass(frozen, module = "trueup")]
pub struct Table {
    batch: RecordBatch,
}

impl Table {
    /// The table that the library would have written.
    pub fn of(table: &OutputTable) -> Result<Self, ArrowError> {
        let columns = table.columns().iter().map(|(name, values)| {
            let array = array(values);
            (Field::new(name, array.data_type().clone(), true), array)
        });
        let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) = columns.unzip();
        Ok(Self { batch: RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays)? })
    }
}

fn array(values: &Values) -> ArrayRef {
    match values {
        Values::Floats(values) => Arc::new(Float64Array::from(values.clone())),
        Values::Integers(values) => Arc::new(Int64Array::from(values.clone())),
        Values::Texts(values) => Arc::new(StringArray::from(values.iter().map(Option::as_deref).collect::<Vec<_>>())),
        Values::Times(values) => {
            let counts: Vec<Option<i64>> = values.iter().map(|time| time.map(|time| time.0)).collect();
            Arc::new(TimestampNanosecondArray::from(counts).with_timezone("UTC"))
        }
    }
}

#[pymethods]
impl Table {
    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.batch.schema().fields().iter().map(|field| field.name().clone()).collect()
    }

    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    fn __contains__(&self, name: &str) -> bool {
        self.batch.column_by_name(name).is_some()
    }

    fn __repr__(&self) -> String {
        format!("<trueup.Table of {} rows: {}>", self.batch.num_rows(), self.columns().join(", "))
    }

    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let column = self.batch.column_by_name(name).ok_or_else(|| {
            PyKeyError::new_err(format!("there is no column `{name}`; there are {}", self.columns().join(", ")))
        })?;
        numpy_of(py, column)
    }

    /// All columns as NumPy arrays, by name.
    fn to_numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        for (field, column) in self.batch.schema().fields().iter().zip(self.batch.columns()) {
            columns.set_item(field.name(), numpy_of(py, column)?)?;
        }
        Ok(columns)
    }

    /// The Arrow PyCapsule interface: this table as a stream of one batch, not copied. `requested_schema` is not heeded.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let reader = RecordBatchIterator::new([Ok(self.batch.clone())], self.batch.schema());
        PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(reader)), STREAM)
    }
}

/// A column as an array of NumPy.
fn numpy_of<'py>(py: Python<'py>, column: &ArrayRef) -> PyResult<Bound<'py, PyAny>> {
    match column.data_type() {
        DataType::Float64 => {
            let values = column.as_primitive::<types::Float64Type>();
            Ok(PyArray1::from_iter(py, values.iter().map(|value| value.unwrap_or(f64::NAN))).into_any())
        }
        DataType::Int64 if column.null_count() == 0 => {
            let values = column.as_primitive::<types::Int64Type>();
            Ok(PyArray1::from_slice(py, values.values()).into_any())
        }
        DataType::Int64 => {
            let values = column.as_primitive::<types::Int64Type>();
            Ok(PyArray1::from_iter(py, values.iter().map(|value| value.map_or(f64::NAN, |v| v as f64))).into_any())
        }
        DataType::Timestamp(TimeUnit::Nanosecond, _) => {
            let values = column.as_primitive::<types::TimestampNanosecondType>();
            // NaT of NumPy is the least integer.
            let counts = PyArray1::from_iter(py, values.iter().map(|value| value.unwrap_or(i64::MIN)));
            counts.call_method1("view", ("datetime64[ns]",))
        }
        _ => {
            let texts = PyList::new(py, column.as_string::<i32>().iter())?;
            py.import("numpy")?.call_method1("array", (texts, "object"))
        }
    }
}

/// The columns of whatever gives a stream of Arrow (an object with `__arrow_c_stream__`), by name, in their order: numbers and
/// booleans as float64 arrays (NaN where null), times as datetime64[ns], texts as objects. Each column is copied once.
#[pyfunction]
pub fn columns_of<'py>(py: Python<'py>, table: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
    let capsule = table.call_method0("__arrow_c_stream__")?;
    let capsule = capsule.cast::<PyCapsule>()?;
    let stream = capsule.pointer_checked(Some(STREAM))?;
    // SAFETY: whoever implements the interface promises that a capsule of this name holds a valid stream; the reader moves it out
    // and leaves a released one behind, which the capsule's destructor does not release again.
    #[allow(unsafe_code)]
    let reader = unsafe { RecordBatchStreamReader::from_raw(stream.as_ptr().cast()) };
    let unreadable =
        |error: ArrowError| error::refused(py, &format!("the Arrow stream cannot be read ({error})"), "is it whole?");
    let reader = reader.map_err(unreadable)?;
    let schema = reader.schema();
    let batches = reader.collect::<Result<Vec<RecordBatch>, ArrowError>>().map_err(unreadable)?;
    let columns = PyDict::new(py);
    for (index, field) in schema.fields().iter().enumerate() {
        let parts: Vec<&ArrayRef> = batches.iter().map(|batch| batch.column(index)).collect();
        columns.set_item(field.name(), joined(py, field, &parts)?)?;
    }
    Ok(columns)
}

/// The parts of a column as one array of NumPy.
fn joined<'py>(py: Python<'py>, field: &Field, parts: &[&ArrayRef]) -> PyResult<Bound<'py, PyAny>> {
    if let Some(integers) = integers(field.data_type(), parts) {
        return Ok(PyArray1::from_vec(py, integers).into_any());
    }
    if let Some(numbers) = numbers(field.data_type(), parts) {
        return Ok(PyArray1::from_vec(py, numbers).into_any());
    }
    if let Some(times) = times(field.data_type(), parts) {
        return PyArray1::from_vec(py, times).call_method1("view", ("datetime64[ns]",));
    }
    let Some(texts) = texts(field.data_type(), parts) else {
        let message =
            format!("column `{}` holds {}, which is neither numbers nor times nor texts", field.name(), field.data_type());
        return Err(error::refused(py, &message, "convert the column, or leave it out"));
    };
    py.import("numpy")?.call_method1("array", (PyList::new(py, texts)?, "object"))
}

/// Integers up to this size are floating-point numbers as well.
const EXACT: i64 = 1 << 53;

/// Integers that would lose digits as floating-point numbers, such as nanoseconds since the epoch; the least integer where there is none.
fn integers(kind: &DataType, parts: &[&ArrayRef]) -> Option<Vec<i64>> {
    let all: Vec<Option<i64>> = match kind {
        DataType::Int64 => parts.iter().flat_map(|part| part.as_primitive::<types::Int64Type>().iter()).collect(),
        DataType::UInt64 => {
            let own = parts.iter().flat_map(|part| part.as_primitive::<types::UInt64Type>().iter());
            own.map(|value| value.map(i64::try_from).transpose()).collect::<Result<_, _>>().ok()?
        }
        _ => return None,
    };
    let long = all.iter().flatten().any(|value| value.unsigned_abs() > EXACT.unsigned_abs());
    long.then(|| all.into_iter().map(|value| value.unwrap_or(i64::MIN)).collect())
}

/// Numbers of any type as floating-point numbers.
fn numbers(kind: &DataType, parts: &[&ArrayRef]) -> Option<Vec<f64>> {
    Some(match kind {
        DataType::Float64 => floats::<types::Float64Type>(parts, |v| v),
        DataType::Float32 => floats::<types::Float32Type>(parts, f64::from),
        DataType::Float16 => floats::<types::Float16Type>(parts, f64::from),
        DataType::Int64 => floats::<types::Int64Type>(parts, |v| v as f64),
        DataType::Int32 => floats::<types::Int32Type>(parts, f64::from),
        DataType::Int16 => floats::<types::Int16Type>(parts, f64::from),
        DataType::Int8 => floats::<types::Int8Type>(parts, f64::from),
        DataType::UInt64 => floats::<types::UInt64Type>(parts, |v| v as f64),
        DataType::UInt32 => floats::<types::UInt32Type>(parts, f64::from),
        DataType::UInt16 => floats::<types::UInt16Type>(parts, f64::from),
        DataType::UInt8 => floats::<types::UInt8Type>(parts, f64::from),
        DataType::Boolean => {
            let value = |value: Option<bool>| value.map_or(f64::NAN, |value| f64::from(u8::from(value)));
            parts.iter().flat_map(|part| part.as_boolean().iter().map(value).collect::<Vec<f64>>()).collect()
        }
        DataType::Null => vec![f64::NAN; parts.iter().map(|part| part.len()).sum()],
        _ => return None,
    })
}

fn floats<T: ArrowPrimitiveType>(parts: &[&ArrayRef], number: fn(T::Native) -> f64) -> Vec<f64> {
    parts.iter().flat_map(|part| part.as_primitive::<T>().iter().map(|value| value.map_or(f64::NAN, number))).collect()
}

/// Times of any unit [ns since the epoch, UTC]; NumPy's NaT, which is the least integer, where there is none, and where a time is
/// beyond what 64 bits hold.
fn times(kind: &DataType, parts: &[&ArrayRef]) -> Option<Vec<i64>> {
    Some(match kind {
        DataType::Timestamp(TimeUnit::Nanosecond, _) => counts::<types::TimestampNanosecondType>(parts, 1),
        DataType::Timestamp(TimeUnit::Microsecond, _) => counts::<types::TimestampMicrosecondType>(parts, 1_000),
        DataType::Timestamp(TimeUnit::Millisecond, _) => counts::<types::TimestampMillisecondType>(parts, 1_000_000),
        DataType::Timestamp(TimeUnit::Second, _) => counts::<types::TimestampSecondType>(parts, 1_000_000_000),
        DataType::Date32 => counts::<types::Date32Type>(parts, 86_400_000_000_000),
        DataType::Date64 => counts::<types::Date64Type>(parts, 1_000_000),
        _ => return None,
    })
}

fn counts<T: ArrowPrimitiveType>(parts: &[&ArrayRef], nanoseconds: i64) -> Vec<i64>
where
    i64: From<T::Native>,
{
    let count =
        |value: Option<T::Native>| value.and_then(|value| i64::from(value).checked_mul(nanoseconds)).unwrap_or(i64::MIN);
    parts.iter().flat_map(|part| part.as_primitive::<T>().iter().map(count)).collect()
}

fn texts(kind: &DataType, parts: &[&ArrayRef]) -> Option<Vec<Option<String>>> {
    let owned = |text: Option<&str>| text.map(str::to_owned);
    let of = |part: &&ArrayRef| -> Option<Vec<Option<String>>> {
        Some(match kind {
            DataType::Utf8 => part.as_string::<i32>().iter().map(owned).collect(),
            DataType::LargeUtf8 => part.as_string::<i64>().iter().map(owned).collect(),
            DataType::Utf8View => part.as_string_view().iter().map(owned).collect(),
            _ => return None,
        })
    };
    parts.iter().map(of).collect::<Option<Vec<_>>>().map(|parts| parts.concat())
}

/// Writes `columns` to the file `path`, CSV or Parquet by its ending: float64 arrays (NaN: no value), int64 arrays, arrays of
/// datetime64[ns] viewed as int64 under a name in `times`, and lists of texts.
#[pyfunction]
#[pyo3(signature = (path, columns, times, force=false))]
pub fn write_columns(
    py: Python<'_>,
    path: PathBuf,
    columns: &Bound<'_, PyDict>,
    times: HashSet<String>,
    force: bool,
) -> PyResult<()> {
    let mut table = OutputTable::new();
    for (name, values) in columns {
        let name: String = name.extract()?;
        let values = if let Ok(numbers) = values.extract::<PyReadonlyArray1<'_, f64>>() {
            Values::Floats(numbers.as_array().iter().map(|value| Some(*value).filter(|value| !value.is_nan())).collect())
        } else if let Ok(counts) = values.extract::<PyReadonlyArray1<'_, i64>>() {
            let present =
                counts.as_array().iter().map(|count| Some(*count).filter(|count| *count != i64::MIN)).collect::<Vec<_>>();
            match times.contains(&name) {
                true => Values::Times(present.into_iter().map(|count| count.map(Timestamp)).collect()),
                false => Values::Integers(present),
            }
        } else {
            Values::Texts(values.extract()?)
        };
        table = table.with(&name, values);
    }
    let overwrite = if force { Overwrite::Force } else { Overwrite::Refuse };
    py.detach(|| write_table(&path, &table, overwrite)).map_err(|error| error::input(py, &error))
}

/// The columns of the file `path` (CSV, Parquet or Arrow) that hold numbers, as float64 arrays (NaN: no value), by name.
#[pyfunction]
pub fn read_columns<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Bound<'py, PyDict>> {
    let read = py.detach(|| {
        let table = trueup::io::Table::read(&path)?;
        let numbers = |name: &str| Some((name.to_owned(), table.floats(name).ok()?));
        Ok(table.names().into_iter().filter_map(numbers).collect::<Vec<_>>())
    });
    let columns = PyDict::new(py);
    for (name, values) in read.map_err(|error| error::input(py, &error))? {
        columns.set_item(name, PyArray1::from_iter(py, values.into_iter().map(|value| value.unwrap_or(f64::NAN))))?;
    }
    Ok(columns)
}
