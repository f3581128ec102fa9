//! Errors of the library as exceptions of Python, which `trueup.errors` defines.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyType};
use trueup::cli::Refusal;
use trueup::io::{InputError, Place};

/// The exception class `name` of `trueup.errors`.
fn class<'py>(py: Python<'py>, cell: &'static PyOnceLock<Py<PyType>>, name: &str) -> PyResult<&'py Bound<'py, PyType>> {
    cell.import(py, "trueup.errors", name)
}

/// Bad input: `trueup.InputError`, or `trueup.MissingFileError` where a file is not there.
pub fn input(py: Python<'_>, error: &InputError) -> PyErr {
    static INPUT: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    static MISSING: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    let made = || -> PyResult<PyErr> {
        let missing = error.message.starts_with("there is no such file") && error.place == Place::File;
        let class = if missing { class(py, &MISSING, "MissingFileError")? } else { class(py, &INPUT, "InputError")? };
        let (row, line) = match error.place {
            Place::File => (None, None),
            Place::Row(row) => (Some(row), None),
            Place::Line { line, column } => (None, Some((line, column))),
        };
        let place = PyDict::new(py);
        place.set_item("path", error.path.to_string_lossy())?;
        place.set_item("row", row)?;
        place.set_item("line", line)?;
        place.set_item("column", error.column.as_deref())?;
        place.set_item("found", error.found.as_deref())?;
        place.set_item("hint", error.hint.as_deref())?;
        Ok(PyErr::from_value(class.call((error.to_string(),), Some(&place))?))
    };
    made().unwrap_or_else(|error| error)
}

/// Bad input that no file is to blame for: `message` and the remedy.
pub fn refused(py: Python<'_>, message: &str, hint: &str) -> PyErr {
    static INPUT: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    let made = || -> PyResult<PyErr> {
        let place = PyDict::new(py);
        place.set_item("hint", hint)?;
        let class = class(py, &INPUT, "InputError")?;
        Ok(PyErr::from_value(class.call((format!("{message}\n  hint: {hint}"),), Some(&place))?))
    };
    made().unwrap_or_else(|error| error)
}

/// An error that tells its remedy as the library's own do, after `hint:` on a line of its own.
pub fn told(py: Python<'_>, error: &impl ToString) -> PyErr {
    let text = error.to_string();
    match text.split_once("hint: ") {
        Some((message, hint)) => refused(py, message.trim_end(), hint),
        None => refused(py, &text, "see the documentation of what was called"),
    }
}

/// A bug of the library: `trueup.BugError`.
pub fn bug(py: Python<'_>, what: &str) -> PyErr {
    static BUG: PyOnceLock<Py<PyType>> = PyOnceLock::new();
    let text = format!("trueup has met a bug of its own: {what}\n  hint: please report it, with what was called");
    match class(py, &BUG, "BugError").and_then(|class| class.call1((text.as_str(),))) {
        Ok(value) => PyErr::from_value(value),
        Err(_) => PyRuntimeError::new_err(text),
    }
}

/// Why a command gave no answer.
pub fn refusal(py: Python<'_>, refusal: &Refusal) -> PyErr {
    match refusal {
        Refusal::Input(error) => input(py, error),
        Refusal::Bug(what) => bug(py, what),
        Refusal::Usage(text) => {
            let text = text.trim_start_matches("error: ").trim_end();
            refused(py, text, "see the documentation of the function for what its arguments may be")
        }
    }
}
