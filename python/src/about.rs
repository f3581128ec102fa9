//! What an environment is, as Python is told it.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use trueup::rl::{About, BoxSpace, InfoChannel, Occasion, OptionKind, OptionValue, Space};

/// Spaces with names and units, channels, options.
pub fn about<'py>(py: Python<'py>, about: &About) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    told.set_item("id", &about.id)?;
    told.set_item("title", &about.title)?;
    told.set_item("observation", box_space(py, &about.observation)?)?;
    let action = match &about.action {
        Space::Box(space) => box_space(py, space)?,
        Space::Discrete { n, name } => {
            let action = PyDict::new(py);
            action.set_item("n", n)?;
            action.set_item("names", [name])?;
            action
        }
        Space::MultiDiscrete { n, names } => {
            let action = PyDict::new(py);
            action.set_item("n", n.clone())?;
            action.set_item("names", names.clone())?;
            action
        }
    };
    told.set_item("action", action)?;
    told.set_item("reward_range", about.reward_range)?;
    told.set_item("seconds_a_step", about.seconds_a_step)?;
    told.set_item("max_steps", about.max_steps)?;
    let named = |channels: &[InfoChannel]| channels.iter().map(|c| (c.name.clone(), c.unit.clone())).collect::<Vec<_>>();
    told.set_item("info", named(&about.info))?;
    told.set_item("privileged", named(&about.privileged))?;
    let options = PyList::empty(py);
    for option in &about.options {
        let row = PyDict::new(py);
        row.set_item("name", &option.name)?;
        row.set_item("unit", &option.unit)?;
        row.set_item("meaning", &option.meaning)?;
        row.set_item("at", if option.at == Occasion::Make { "make" } else { "reset" })?;
        match option.nominal() {
            OptionValue::Number(value) => row.set_item("nominal", value)?,
            OptionValue::Switch(value) => row.set_item("nominal", value)?,
            OptionValue::Text(value) => row.set_item("nominal", value)?,
        }
        match &option.kind {
            OptionKind::Number { lower, upper, .. } => row.set_item("within", (lower, upper))?,
            OptionKind::Whole { lower, upper, .. } => row.set_item("within", (lower, upper))?,
            OptionKind::Choice { of, .. } => row.set_item("among", of.clone())?,
            OptionKind::Switch { .. } | OptionKind::Text { .. } => {}
        }
        options.append(row)?;
    }
    told.set_item("options", options)?;
    Ok(told)
}

fn box_space<'py>(py: Python<'py>, space: &BoxSpace) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    told.set_item("low", PyArray1::from_slice(py, &space.low))?;
    told.set_item("high", PyArray1::from_slice(py, &space.high))?;
    told.set_item("shape", space.shape.clone())?;
    told.set_item("names", space.names.clone())?;
    told.set_item("units", space.units.clone())?;
    Ok(told)
}
