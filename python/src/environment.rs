//! Environments as Python steps them: lanes behind a driver that checks all it is given, writing into arrays of NumPy.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::{
    PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadonlyArrayDyn, PyReadwriteArray1,
    PyReadwriteArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyBool, PyDict, PyString, PyTuple};
use trueup::io::hint_among;
use trueup::market::env::make_on;
use trueup::rl::{Actions, AutoresetMode, Checked, EnvEntry, EnvError, Kept, Out, Threads, VecEnv, Which};

use crate::about::about;
use crate::error;
use crate::fresh::Fresh;
use crate::options::{market_of, options_of};
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
    /// Shapes of a lane's observation and action.
    shapes: [Vec<usize>; 2],
    /// Of a single environment: what it observed last, which the array it gives out is filled with.
    row: Vec<f32>,
    fresh: Fresh,
    /// Whether its steps give info, and under which names.
    informs: bool,
    names: PyOnceLock<Vec<Py<PyString>>>,
    /// What makes an array of an action that is no plain one.
    reader: Option<Py<PyAny>>,
}

/// Numbers of an action that are read one by one: more are borrowed as a whole, which takes as long as some dozen of them.
const FEW: usize = 8;

impl Lanes {
    fn of(driver: Driver) -> Self {
        let (lanes, size) = (driver.lanes(), driver.about().observation.size());
        let acted = driver.about().action.as_box().map(|space| space.shape.clone()).unwrap_or_default();
        let shapes = [driver.about().observation.shape.clone(), acted];
        Self {
            driver: Mutex::new(driver),
            lanes,
            size,
            shapes,
            row: vec![0.0; size],
            fresh: Fresh::default(),
            informs: true,
            names: PyOnceLock::new(),
            reader: None,
        }
    }

    /// A step by an array of actions, real numbers as float32, choices as int64.
    fn stepped(&mut self, py: Python<'_>, actions: &Bound<'_, PyAny>, out: &mut Out<'_>) -> PyResult<()> {
        if let Ok(actions) = actions.extract::<PyReadonlyArrayDyn<'_, f32>>() {
            let actions = Actions::Continuous(actions.as_slice().map_err(|_| scattered(py, "actions"))?);
            drive(py, self.driven(), |driver| driver.step(actions, out))
        } else if let Ok(actions) = actions.extract::<PyReadonlyArrayDyn<'_, i64>>() {
            let actions = Actions::Discrete(actions.as_slice().map_err(|_| scattered(py, "actions"))?);
            drive(py, self.driven(), |driver| driver.step(actions, out))
        } else {
            Err(error::refused(py, "actions are no array of float32 or int64", "give one row a lane"))
        }
    }

    /// A step by the action of a single environment: a choice, an array that can be read as it is, or whatever the reader makes an array
    /// of.
    fn stepped_by(&mut self, py: Python<'_>, action: &Bound<'_, PyAny>, out: &mut Out<'_>) -> PyResult<()> {
        if let [count @ 1..=FEW] = self.shapes[1][..]
            && let Ok(array) = action.cast_exact::<PyArray1<f32>>()
            && array.len() == count
        {
            let mut few = [0.0; FEW];
            (0..count).for_each(|k| few[k] = array.get_owned([k]).unwrap_or(f32::NAN));
            return drive(py, self.driven(), |driver| driver.step(Actions::Continuous(&few[..count]), out));
        }
        if let Some(choice) = plain(action) {
            return drive(py, self.driven(), |driver| driver.step(Actions::Discrete(&[choice]), out));
        }
        if let Ok(array) = action.cast_exact::<PyArrayDyn<f32>>()
            && !self.shapes[1].is_empty()
            && array.shape() == self.shapes[1].as_slice()
            && array.is_c_contiguous()
        {
            return self.stepped(py, action, out);
        }
        match &self.reader {
            Some(reader) => {
                let actions = reader.call1(py, (action,))?;
                self.stepped(py, actions.bind(py), out)
            }
            None => self.stepped(py, action, out),
        }
    }

    fn looked_at(&self) -> MutexGuard<'_, Driver> {
        self.driver.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn driven(&mut self) -> &mut Driver {
        self.driver.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What is kept of episodes that end.
fn kept(informs: bool) -> Kept {
    if informs { Kept::All } else { Kept::Observations }
}

/// The choice that an action is, if it is one whole number: of Python or of NumPy.
fn plain(action: &Bound<'_, PyAny>) -> Option<i64> {
    // A truth value is no choice, although it counts as a number.
    let other = action.is_instance_of::<PyBool>() || action.is_instance_of::<PyUntypedArray>();
    if other { None } else { action.extract().ok() }
}

/// Drives lanes, without Python's lock where there are many. A panic is a bug, and an exception.
pub fn drive(
    py: Python<'_>,
    driver: &mut Driver,
    job: impl FnOnce(&mut Driver) -> Result<(), EnvError> + Send,
) -> PyResult<()> {
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
        Ok(Self::of(driver))
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
        self.stepped(py, actions, &mut out)
    }

    /// A step of a single environment: what is observed, in an array of its own, the reward, terminated, truncated, and info by name.
    fn step_one<'py>(&mut self, py: Python<'py>, action: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyTuple>> {
        let (mut reward, mut terminated, mut truncated) = ([0.0], [false], [false]);
        let mut row = std::mem::take(&mut self.row);
        let mut out =
            Out { observations: &mut row, rewards: &mut reward, terminated: &mut terminated, truncated: &mut truncated };
        let told = self.stepped_by(py, action, &mut out).and_then(|()| {
            let observed = self.fresh.with(py, &row);
            let info = self.info_of_one(py)?;
            let shape = &self.shapes[0];
            let observed =
                if shape.len() == 1 { observed.into_any() } else { observed.reshape(shape.as_slice())?.into_any() };
            (observed, reward[0], terminated[0], truncated[0], info).into_pyobject(py)
        });
        self.row = row;
        told
    }

    /// What makes an array of an action that is no plain one.
    #[setter]
    fn set_reader(&mut self, reader: Py<PyAny>) {
        self.reader = Some(reader);
    }

    /// Info of a single environment, by name.
    fn info_of_one<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let info = PyDict::new(py);
        if !self.informs {
            return Ok(info);
        }
        let driver = self.looked_at();
        let names = self.names.get_or_init(py, || {
            driver.about().info.iter().map(|channel| PyString::intern(py, &channel.name).unbind()).collect()
        });
        for (channel, name) in names.iter().enumerate() {
            let mut value = [0.0];
            driver.info(channel, &mut value).map_err(|error| refused(py, &error))?;
            info.set_item(name, value[0])?;
        }
        Ok(info)
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

    /// Whether steps give info.
    #[setter]
    fn set_informs(&mut self, informs: bool) {
        self.informs = informs;
        self.driven().keep(kept(informs));
    }

    /// The same lanes once more, which go on with the same bits.
    fn copy(&self) -> Self {
        Self { informs: self.informs, ..Self::of(self.looked_at().clone()) }
    }

    /// Goes on as `other`.
    fn load(&mut self, other: &Self) {
        *self = Self { informs: self.informs, reader: self.reader.take(), ..other.copy() };
        let informs = self.informs;
        self.driven().keep(kept(informs));
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

/// Why an array cannot be used: it is in several pieces.
pub fn scattered(py: Python<'_>, what: &str) -> PyErr {
    error::refused(py, &format!("{what} do not lie in one piece of memory"), "give a C-contiguous array")
}
