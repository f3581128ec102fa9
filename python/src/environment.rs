//! Environments as Python steps them: lanes behind a driver that checks all it is given, writing into arrays of NumPy.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArrayDyn, PyReadwriteArray1, PyReadwriteArrayDyn,
};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString};
use trueup::io::{RunFile, hint_among};
use trueup::market::env::{MarketSetup, make_on};
use trueup::rl::{
    About, Actions, AutoresetMode, BoxSpace, Checked, EnvEntry, EnvError, InfoChannel, Occasion, OptionKind, OptionValue,
    Options, Out, Space, Threads, VecEnv, Which,
};

use crate::error;
use crate::work::words;

/// Lanes from which on a step goes without Python's lock: below, to give it back costs more than the step.
const MANY: usize = 64;

/// The environments that can be made by their ids.
fn entries() -> impl Iterator<Item = &'static EnvEntry> {
    trueup::robot::ENVIRONMENTS.iter().chain(trueup::market::ENVIRONMENTS)
}

/// Ids of the environments, each with what has to be done in it.
#[pyfunction]
pub fn environments() -> Vec<(&'static str, &'static str)> {
    entries().map(|entry| (entry.id, entry.about)).collect()
}

fn refused(py: Python<'_>, error: &EnvError) -> PyErr {
    error::told(py, error)
}

type Driver = Checked<Box<dyn VecEnv>>;

/// Lanes of an environment.
#[pyclass(module = "trueup._trueup")]
pub struct Lanes {
    /// Whoever steps has it alone and never waits; the lock is for those who only look.
    driver: Mutex<Driver>,
    lanes: usize,
    size: usize,
}

impl Lanes {
    fn looked_at(&self) -> MutexGuard<'_, Driver> {
        self.driver.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn driven(&mut self) -> &mut Driver {
        self.driver.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Drives lanes, without Python's lock where there are many. A panic is a bug, and an exception.
fn drive(py: Python<'_>, driver: &mut Driver, job: impl FnOnce(&mut Driver) -> Result<(), EnvError> + Send) -> PyResult<()> {
    let caught = |driver: &mut Driver| catch_unwind(AssertUnwindSafe(|| job(driver)));
    let done = if driver.lanes() < MANY { caught(driver) } else { py.detach(|| caught(driver)) };
    match done {
        Ok(done) => done.map_err(|error| refused(py, &error)),
        Err(payload) => Err(error::bug(py, &words(payload.as_ref()))),
    }
}

#[pymethods]
impl Lanes {
    /// `lanes` lanes of the environment `id`, split over `threads` chunks that are stepped side by side; `mode` is "NextStep",
    /// "SameStep" or "Disabled". Beside the environment's own options, one of a market has `run`: the path of the RUN.toml whose data and
    /// venue it is in.
    #[new]
    fn new(
        py: Python<'_>,
        id: &str,
        lanes: usize,
        mode: &str,
        threads: usize,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let entry = entries().find(|entry| entry.id == id).ok_or_else(|| {
            let ids: Vec<&str> = entries().map(|entry| entry.id).collect();
            error::refused(py, &format!("there is no environment `{id}`"), &hint_among(id, &ids).unwrap_or_default())
        })?;
        let mode = match mode {
            "NextStep" => AutoresetMode::NextStep,
            "SameStep" => AutoresetMode::SameStep,
            "Disabled" => AutoresetMode::Disabled,
            other => {
                return Err(error::refused(
                    py,
                    &format!("there is no autoreset mode {other:?}"),
                    "NextStep, SameStep or Disabled",
                ));
            }
        };
        let mut options = options_of(py, options)?;
        let market = market_of(py, id, &mut options)?;
        let make = |lanes: usize| match &market {
            Some(setup) => make_on(id, lanes, setup.clone(), &options),
            None => (entry.make)(lanes, &options),
        };
        let made = py.detach(|| match threads {
            0 | 1 => make(lanes),
            threads => Threads::new(lanes, threads, make).map(|env| Box::new(env) as Box<dyn VecEnv>),
        });
        let driver = made.and_then(|env| Checked::new(env, mode)).map_err(|error| refused(py, &error))?;
        let size = driver.about().observation.size();
        Ok(Self { driver: Mutex::new(driver), lanes, size })
    }

    /// What the environment is: spaces, info channels, options.
    fn about<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        about(py, self.looked_at().about())
    }

    /// Begins an episode in the lanes of `mask`, all if there is none, with `seeds`, one a lane, or else the next of the seeds they
    /// have; writes what is observed to their rows of `observations` (lanes, ...).
    #[pyo3(signature = (seeds, mask, options, observations))]
    fn reset(
        &mut self,
        py: Python<'_>,
        seeds: Option<Vec<u64>>,
        mask: Option<PyReadonlyArray1<'_, bool>>,
        options: &Bound<'_, PyDict>,
        mut observations: PyReadwriteArrayDyn<'_, f32>,
    ) -> PyResult<()> {
        let options = options_of(py, options)?;
        let which = match &mask {
            None => Which::All,
            Some(mask) => Which::Mask(mask.as_slice().map_err(|_| scattered(py, "the mask"))?),
        };
        let observations = observations.as_slice_mut().map_err(|_| scattered(py, "observations"))?;
        drive(py, self.driven(), |driver| driver.reset(which, seeds.as_deref(), &options, observations))
    }

    /// A step by `actions`, real numbers as float32, choices as int64, which writes what comes of it into the arrays.
    fn step(
        &mut self,
        py: Python<'_>,
        actions: &Bound<'_, PyAny>,
        mut observations: PyReadwriteArrayDyn<'_, f32>,
        mut rewards: PyReadwriteArray1<'_, f64>,
        mut terminated: PyReadwriteArray1<'_, bool>,
        mut truncated: PyReadwriteArray1<'_, bool>,
    ) -> PyResult<()> {
        let mut out = Out {
            observations: observations.as_slice_mut().map_err(|_| scattered(py, "observations"))?,
            rewards: rewards.as_slice_mut().map_err(|_| scattered(py, "rewards"))?,
            terminated: terminated.as_slice_mut().map_err(|_| scattered(py, "terminated"))?,
            truncated: truncated.as_slice_mut().map_err(|_| scattered(py, "truncated"))?,
        };
        if let Ok(actions) = actions.extract::<PyReadonlyArrayDyn<'_, f32>>() {
            let actions = Actions::Continuous(actions.as_slice().map_err(|_| scattered(py, "actions"))?);
            drive(py, self.driven(), |driver| driver.step(actions, &mut out))
        } else if let Ok(actions) = actions.extract::<PyReadonlyArrayDyn<'_, i64>>() {
            let actions = Actions::Discrete(actions.as_slice().map_err(|_| scattered(py, "actions"))?);
            drive(py, self.driven(), |driver| driver.step(actions, &mut out))
        } else {
            Err(error::refused(py, "actions are no array of float32 or int64", "give one row a lane"))
        }
    }

    /// Values of the info channels, one a lane each, by name.
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let infos = PyDict::new(py);
        let driver = self.looked_at();
        for (channel, about) in driver.about().info.iter().enumerate() {
            let values = PyArray1::<f64>::zeros(py, self.lanes, false);
            driver
                .info(channel, values.readwrite().as_slice_mut().map_err(|_| scattered(py, "info"))?)
                .map_err(|error| refused(py, &error))?;
            infos.set_item(&about.name, values)?;
        }
        Ok(infos)
    }

    /// Of the lanes whose episodes ended in the step before and have begun the next in it: which they are (lanes,), what was observed
    /// last (lanes, size), and info by name (lanes,). None where there are none.
    fn finals<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let driver = self.looked_at();
        let Some(finals) = driver.finals() else { return Ok(None) };
        let ended = PyArray1::from_slice(py, finals.ended);
        let observations = PyArray1::from_slice(py, finals.observations);
        let infos = PyDict::new(py);
        for (about, values) in driver.about().info.iter().zip(finals.info.chunks_exact(self.lanes)) {
            infos.set_item(&about.name, PyArray1::from_slice(py, values))?;
        }
        let observations = observations.reshape([self.lanes, self.size])?;
        Ok(Some((ended, observations, infos).into_pyobject(py)?.into_any()))
    }

    /// Values of the parameters that are drawn and not observed, shape (lanes, parameters).
    fn privileged<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let driver = self.looked_at();
        let count = driver.about().privileged.len();
        let mut rows = vec![vec![0.0; count]; self.lanes];
        let mut values = vec![0.0; self.lanes];
        for parameter in 0..count {
            driver.env().privileged(parameter, &mut values);
            rows.iter_mut().zip(&values).for_each(|(row, value)| row[parameter] = *value);
        }
        if count == 0 {
            return Ok(PyArray2::zeros(py, [self.lanes, 0], false));
        }
        Ok(PyArray2::from_vec2(py, &rows)?)
    }

    /// The same lanes once more, which go on with the same bits.
    fn copy(&self) -> Self {
        Self { driver: Mutex::new(self.looked_at().clone()), lanes: self.lanes, size: self.size }
    }

    /// Makes lane `to` a copy of lane `from`.
    fn copy_lane(&mut self, py: Python<'_>, from: usize, to: usize) -> PyResult<()> {
        self.driven().copy_lane(from, to).map_err(|error| refused(py, &error))
    }

    /// Makes lane `to` a copy of lane `from` of other lanes of the same kind.
    fn copy_lane_from(&mut self, py: Python<'_>, other: &Self, from: usize, to: usize) -> PyResult<()> {
        self.driven().copy_lane_from(&other.looked_at(), from, to).map_err(|error| refused(py, &error))
    }

    fn close(&mut self) {
        self.driven().close();
    }

    #[getter]
    fn closed(&self) -> bool {
        self.looked_at().closed()
    }
}

/// The market of the RUN.toml that the option `run` names, of an environment of a market.
fn market_of(py: Python<'_>, id: &str, options: &mut Options) -> PyResult<Option<MarketSetup>> {
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

fn scattered(py: Python<'_>, what: &str) -> PyErr {
    error::refused(py, &format!("{what} do not lie in one piece of memory"), "give a C-contiguous array")
}

/// Options of Python's: numbers, truth values, texts.
fn options_of(py: Python<'_>, given: &Bound<'_, PyDict>) -> PyResult<Options> {
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

fn about<'py>(py: Python<'py>, about: &About) -> PyResult<Bound<'py, PyDict>> {
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
