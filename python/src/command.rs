//! Commands of the command line, run for a program.

use std::ffi::OsString;
use std::process::ExitCode;

use pyo3::prelude::*;
use trueup::cli;

use crate::{error, work};

/// Runs the command line with `arguments`, the first of which is the name of the program; gives its exit code. It prints.
#[pyfunction]
pub fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    let code = py.detach(|| cli::run(arguments));
    // An exit code does not tell its number, but whether it is another's.
    (0..=u8::MAX).find(|number| ExitCode::from(*number) == code).unwrap_or(3)
}

/// Runs the command `arguments` (`["diagnose", "twin.toml", ...]`) without a terminal; gives what it would have printed, and whether it
/// found what the caller asked to fail on. `progress(step, done, of)` is told how far it is.
#[pyfunction]
#[pyo3(signature = (arguments, progress=None))]
pub fn answer(py: Python<'_>, arguments: Vec<OsString>, progress: Option<Py<PyAny>>) -> PyResult<(String, bool)> {
    let line = std::iter::once(OsString::from("trueup")).chain(arguments);
    let answer = work::outside(py, |course| cli::answer(line, course.listener(progress)))?;
    let answer = answer.map_err(|refusal| error::refusal(py, &refusal))?;
    Ok((answer.text, answer.finding))
}
