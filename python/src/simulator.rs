//! Simulators of Python: a callable that follows a recording, identified and diagnosed as an assembly of the library is.

use std::ops::Range;
use std::sync::Arc;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json};
use trueup::io::hint_among;
use trueup::robot;
use trueup::sim2real::diagnose::{Calibration, Progress, calibrate, diagnose};
use trueup::sim2real::{
    About, Candidate, Channel, Clock, Covariate, Form, Measured, Parameter, Recording, Seed, Simulated, Simulator, Thetas,
    Trajectory, Twin,
};

use crate::initial::{Initial, Inputs, around, rounding};
use crate::work::Course;
use crate::{error, work};

/// A callable of Python as a simulator. What it is asked for while the lock of Python is not held, it takes the lock for.
#[derive(Clone)]
pub struct Script {
    callable: Arc<Py<PyAny>>,
    name: String,
    vectorized: bool,
    channels: Vec<Channel>,
    inputs: Vec<(String, String)>,
    initial: Vec<Initial>,
    /// The simulator's own, then those of each mechanism in turn.
    parameters: Vec<Parameter>,
    /// Names as the callable is given them.
    named: Vec<String>,
    /// What it can be given: parameters that do nothing at their nominal values.
    candidates: Arc<Vec<Candidate>>,
    modelled: Vec<&'static str>,
    course: Course,
}

impl Script {
    /// Follows `rows` in every lane; one call a lane, or one for all where the callable is vectorized.
    fn followed(
        &self,
        py: Python<'_>,
        thetas: &Thetas,
        recording: &Recording<Inputs>,
        rows: Range<usize>,
    ) -> PyResult<Vec<Trajectory>> {
        let time = PyArray1::from_slice(py, &recording.time[rows.clone()]);
        let inputs = PyDict::new(py);
        for ((name, _), values) in self.inputs.iter().zip(recording.stimulus.0.iter()) {
            inputs.set_item(name, PyArray1::from_slice(py, &values[rows.clone()]))?;
        }
        let names = self.named.iter().chain(self.initial.iter().map(|initial| &initial.name));
        if self.vectorized {
            let parameters = PyDict::new(py);
            for (k, name) in names.enumerate() {
                parameters.set_item(name, PyArray1::from_slice(py, thetas.row(k)))?;
            }
            let result = self.callable.bind(py).call1((parameters, time, inputs))?;
            return self.lanes(py, &result, thetas.lanes(), rows.len());
        }
        let names: Vec<&String> = names.collect();
        let one = |lane: usize| {
            let parameters = PyDict::new(py);
            for (k, name) in names.iter().enumerate() {
                parameters.set_item(name, thetas.row(k)[lane])?;
            }
            let result = self.callable.bind(py).call1((parameters, &time, &inputs))?;
            self.lane(py, &result, rows.len())
        };
        (0..thetas.lanes()).map(one).collect()
    }

    /// The channels of one lane: a dict of arrays of shape (rows,), or one array where there is one channel.
    fn lane(&self, py: Python<'_>, result: &Bound<'_, PyAny>, rows: usize) -> PyResult<Trajectory> {
        let of = |channel: &Channel| {
            let values = self.values(py, result, channel)?;
            let array: PyReadonlyArray1<'_, f64> =
                values.extract().map_err(|_| self.misshapen(py, channel, &values, &format!("({rows},)")))?;
            if array.len() != rows {
                return Err(self.misshapen(py, channel, &values, &format!("({rows},)")));
            }
            Ok(Simulated { channel: channel.name.clone().into_owned(), samples: array.as_array().to_vec() })
        };
        self.channels.iter().map(of).collect()
    }

    /// The channels of all lanes: a dict of arrays of shape (lanes, rows).
    fn lanes(&self, py: Python<'_>, result: &Bound<'_, PyAny>, lanes: usize, rows: usize) -> PyResult<Vec<Trajectory>> {
        let mut all = vec![Trajectory::new(); lanes];
        for channel in &self.channels {
            let values = self.values(py, result, channel)?;
            let expected = format!("({lanes}, {rows})");
            let array: PyReadonlyArray2<'_, f64> =
                values.extract().map_err(|_| self.misshapen(py, channel, &values, &expected))?;
            if array.shape() != [lanes, rows] {
                return Err(self.misshapen(py, channel, &values, &expected));
            }
            for (trajectory, samples) in all.iter_mut().zip(array.as_array().rows()) {
                trajectory.push(Simulated { channel: channel.name.clone().into_owned(), samples: samples.to_vec() });
            }
        }
        Ok(all)
    }

    /// What the callable gave of a channel, as float64.
    fn values<'py>(&self, py: Python<'py>, result: &Bound<'py, PyAny>, channel: &Channel) -> PyResult<Bound<'py, PyAny>> {
        let values = match result.cast::<PyDict>() {
            Ok(channels) => channels.get_item(channel.name.as_ref())?.ok_or_else(|| {
                let message = format!("{} gave no channel `{}`", self.name, channel.name);
                error::refused(py, &message, "give a dict with an array for every channel")
            })?,
            Err(_) if self.channels.len() == 1 => result.clone(),
            Err(_) => {
                let message = format!("{} gave {}, not a dict", self.name, result.get_type().name()?);
                return Err(error::refused(py, &message, "give a dict with an array for every channel"));
            }
        };
        py.import("numpy")?.call_method1("asarray", (values, "float64"))
    }

    fn misshapen(&self, py: Python<'_>, channel: &Channel, values: &Bound<'_, PyAny>, expected: &str) -> PyErr {
        let shape =
            values.getattr("shape").and_then(|shape| shape.repr()).map_or_else(|_| "?".to_owned(), |text| text.to_string());
        let message = format!("{}: channel `{}` has the shape {shape}, expected {expected}", self.name, channel.name);
        error::refused(py, &message, "give one sample for each row of `time`")
    }
}

impl Simulator for Script {
    type Stimulus = Inputs;

    fn name(&self) -> String {
        self.name.clone()
    }

    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn clock(&self) -> Clock {
        // It goes from row to row: how it integrates is its own.
        Clock::Sampled { longest_step: f64::INFINITY }
    }

    fn initial_parameters(&self, recording: &Recording<Inputs>, row: usize) -> Vec<Parameter> {
        self.initial.iter().map(|initial| initial.at(recording, row)).collect()
    }

    fn resolution(&self, recording: &Recording<Inputs>, channel: &str) -> f64 {
        recording.channel(channel).map_or(0.0, rounding)
    }

    fn covariates(&self, recording: &Recording<Inputs>) -> Vec<Covariate> {
        let mut covariates: Vec<Covariate> = Vec::new();
        if let Some(command) = recording.stimulus.0.first() {
            covariates.push(("command", command.clone()));
        }
        let first = self.channels.first().and_then(|channel| recording.channel(&channel.name));
        if let Some(measured) = first {
            let lines: Vec<(f64, f64)> =
                (0..recording.len()).map(|row| around(recording, measured, row).unwrap_or_default()).collect();
            covariates.push(("output", lines.iter().map(|line| line.0).collect()));
            covariates.push(("rate of the output", lines.iter().map(|line| line.1).collect()));
        }
        covariates
    }

    fn notes(&self, _recording: &Recording<Inputs>) -> Vec<String> {
        Vec::new()
    }

    fn unit(&self, declared: &str) -> String {
        let of = |unit: Option<&str>| unit.unwrap_or(declared).to_owned();
        match declared {
            "command" => of(self.inputs.first().map(|input| input.1.as_str())),
            "output" => of(self.channels.first().map(|channel| channel.unit.as_ref())),
            other => other.to_owned(),
        }
    }

    fn rollout(&self, thetas: &Thetas, recording: &Recording<Inputs>, rows: Range<usize>, _seed: Seed) -> Vec<Trajectory> {
        self.course.check();
        match Python::attach(|py| self.followed(py, thetas, recording, rows)) {
            Ok(trajectories) => trajectories,
            Err(raised) => self.course.fail(raised),
        }
    }
}

impl Twin for Script {
    fn candidates(&self, _recordings: &[Recording<Inputs>]) -> Vec<Candidate> {
        self.candidates.iter().filter(|candidate| !self.modelled.contains(&candidate.about.name)).cloned().collect()
    }

    fn with(&self, candidate: &Candidate) -> Self {
        let mut twin = self.clone();
        let id = candidate.about.name;
        twin.modelled.push(id);
        twin.named.extend(candidate.form.parameters.iter().map(|parameter| format!("{id}.{}", parameter.name)));
        twin.parameters.extend(candidate.form.parameters.iter().cloned());
        twin
    }

    fn modelled(&self) -> Vec<&'static str> {
        self.modelled.clone()
    }
}

/// Name, unit, value, standard deviation, lower bound, upper bound, where fits begin.
type ParameterRow = (String, String, f64, Option<f64>, f64, f64, Vec<f64>);
/// Name, unit, value, channel, whether it is that channel's derivative, standard deviation.
type InitialRow = (String, String, f64, Option<String>, bool, Option<f64>);
/// Name, time, inputs, channels.
type RecordingRow<'py> =
    (String, PyReadonlyArray1<'py, f64>, Vec<PyReadonlyArray1<'py, f64>>, Vec<PyReadonlyArray1<'py, f64>>);

fn parameter((name, unit, value, std, lower, upper, starts): ParameterRow) -> Parameter {
    let parameter = Parameter::named(name, unit, value).within(lower, upper).starting_at(&starts);
    match std {
        Some(std) => parameter.known_to(std),
        None => parameter,
    }
}

/// What the registries of robots say of the mechanism `id`.
fn about(py: Python<'_>, id: &str) -> PyResult<About> {
    let joint = robot::MECHANISMS.iter().map(|mechanism| mechanism.about());
    let equations = robot::EQUATIONS_MECHANISMS.iter().map(|mechanism| mechanism.about());
    let all: Vec<About> = joint.chain(equations).collect();
    all.iter().find(|about| about.name == id).copied().ok_or_else(|| {
        let known: Vec<&str> = all.iter().map(|about| about.name).collect();
        let hint = hint_among(id, &known).unwrap_or_default();
        error::refused(py, &format!("there is no mechanism `{id}`"), &hint)
    })
}

/// A simulator of Python with all that is declared of it.
#[pyclass(frozen, module = "trueup._trueup")]
pub struct ScriptedSimulator {
    script: Script,
}

#[pymethods]
impl ScriptedSimulator {
    #[new]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        callable: Py<PyAny>,
        name: String,
        vectorized: bool,
        channels: Vec<(String, String)>,
        inputs: Vec<(String, String)>,
        parameters: Vec<ParameterRow>,
        initial: Vec<InitialRow>,
        mechanisms: Vec<(String, Vec<ParameterRow>)>,
    ) -> PyResult<Self> {
        let candidate = |(id, parameters): (String, Vec<ParameterRow>)| {
            let form = Form { name: "", parameters: parameters.into_iter().map(parameter).collect() };
            Ok(Candidate::new(about(py, &id)?, form))
        };
        let parameters: Vec<Parameter> = parameters.into_iter().map(parameter).collect();
        let initial = initial.into_iter().map(|(name, unit, value, channel, derivative, std)| Initial {
            name,
            unit,
            value,
            channel,
            derivative,
            std,
        });
        let script = Script {
            callable: Arc::new(callable),
            name,
            vectorized,
            channels: channels
                .into_iter()
                .map(|(name, unit)| Channel { name: name.into(), unit: unit.into(), exact: false })
                .collect(),
            inputs,
            initial: initial.collect(),
            named: parameters.iter().map(|parameter| parameter.name.clone().into_owned()).collect(),
            parameters,
            candidates: Arc::new(mechanisms.into_iter().map(candidate).collect::<PyResult<_>>()?),
            modelled: Vec::new(),
            course: Course::default(),
        };
        Ok(Self { script })
    }

    /// The diagnosis and the trued values, as JSON.
    fn diagnose(
        &self,
        py: Python<'_>,
        recordings: Vec<RecordingRow<'_>>,
        held_out: Vec<RecordingRow<'_>>,
        seed: u64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<String> {
        self.fitted(py, recordings, held_out, progress, |script, recordings, held_out, told| {
            let outcome = diagnose(script, recordings, held_out, Seed(seed), told);
            let trued = json!({
                "parameters": outcome.trued.named,
                "values": outcome.values,
                "std": outcome.std,
            });
            json!({ "diagnosis": outcome.diagnosis, "trued": trued })
        })
    }

    /// The values that fit, with what they leave, as JSON.
    fn calibrate(
        &self,
        py: Python<'_>,
        recordings: Vec<RecordingRow<'_>>,
        held_out: Vec<RecordingRow<'_>>,
        seed: u64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<String> {
        self.fitted(py, recordings, held_out, progress, |script, recordings, held_out, told| {
            let Calibration { values, std, at_bound, fit, held_out, .. } =
                calibrate(script, recordings, held_out, Seed(seed), told);
            json!({
                "parameters": script.named, "values": values, "std": std, "at_bound": at_bound, "fit": fit, "held_out": held_out,
            })
        })
    }
}

impl ScriptedSimulator {
    /// What `fit` makes of the recordings, with a callable that Ctrl-C ends.
    fn fitted(
        &self,
        py: Python<'_>,
        recordings: Vec<RecordingRow<'_>>,
        held_out: Vec<RecordingRow<'_>>,
        progress: Option<Py<PyAny>>,
        fit: impl FnOnce(&Script, &[Recording<Inputs>], &[Recording<Inputs>], Progress<'_>) -> Value + Send,
    ) -> PyResult<String> {
        let (recordings, held_out) = (self.recordings(recordings), self.recordings(held_out));
        let told = work::outside(py, |course| {
            let script = Script { course: course.clone(), ..self.script.clone() };
            let listener = course.listener(progress);
            fit(&script, &recordings, &held_out, &|step, done, of| listener(step, done, of))
        })?;
        Ok(told.to_string())
    }

    fn recordings(&self, rows: Vec<RecordingRow<'_>>) -> Vec<Recording<Inputs>> {
        let one = |(name, time, inputs, channels): RecordingRow<'_>| Recording {
            name,
            time: time.as_array().to_vec(),
            stimulus: Inputs(Arc::new(inputs.iter().map(|values| values.as_array().to_vec()).collect())),
            measured: self
                .script
                .channels
                .iter()
                .zip(channels)
                .map(|(channel, values)| Measured {
                    channel: channel.name.clone().into_owned(),
                    unit: channel.unit.clone().into_owned(),
                    samples: values.as_array().iter().map(|value| Some(*value).filter(|value| value.is_finite())).collect(),
                })
                .collect(),
        };
        rows.into_iter().map(one).collect()
    }
}
