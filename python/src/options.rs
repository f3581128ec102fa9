//! Options of an environment, as Python gives them.

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};
use trueup::io::RunFile;
use trueup::market::env::MarketSetup;
use trueup::rl::{OptionValue, Options};

use crate::error;

/// Numbers, truth values, texts.
pub fn options_of(py: Python<'_>, given: &Bound<'_, PyDict>) -> PyResult<Options> {
    let mut options = Options::new();
    for (name, value) in given {
        let Ok(name) = name.extract::<String>() else {
            return Err(error::refused(
                py,
                &format!("an option is called {}", name.repr()?),
                "options have texts for names",
            ));
        };
        let value: OptionValue = match &value {
            value if value.is_instance_of::<PyBool>() => value.extract::<bool>()?.into(),
            value if value.is_instance_of::<PyInt>() || value.is_instance_of::<PyFloat>() => value.extract::<f64>()?.into(),
            value if value.is_instance_of::<PyString>() => value.extract::<String>()?.into(),
            other => match other.call_method0("item") {
                // A scalar of NumPy.
                Ok(item) if item.is_instance_of::<PyBool>() => item.extract::<bool>()?.into(),
                Ok(item) if item.is_instance_of::<PyFloat>() || item.is_instance_of::<PyInt>() => {
                    item.extract::<f64>()?.into()
                }
                _ => {
                    let message = format!("option `{name}` is {}", other.repr()?);
                    return Err(error::refused(py, &message, "an option is a number, a truth value or a text"));
                }
            },
        };
        options.set(&name, value);
    }
    Ok(options)
}

/// The market of the RUN.toml that the option `run` names, of an environment of a market.
pub fn market_of(py: Python<'_>, id: &str, options: &mut Options) -> PyResult<Option<MarketSetup>> {
    if trueup::market::ENVIRONMENTS.iter().all(|entry| entry.id != id) {
        return Ok(None);
    }
    let Some(run) = options.take("run") else { return Ok(None) };
    let OptionValue::Text(path) = run else {
        return Err(error::refused(py, &format!("the option `run` is {run}"), "the path of a RUN.toml"));
    };
    let read = py.detach(|| RunFile::read(path).and_then(|file| MarketSetup::from_run(&file)));
    read.map(Some).map_err(|error| error::input(py, &error))
}
