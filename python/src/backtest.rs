//! Backtests, and audits of strategies of Python.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};
use trueup::cli::strategy_of_run;
use trueup::io::{InputError, OutputFolder, Overwrite, RunFile};
use trueup::market::{
    AuditSettings, BacktestError, History, OutputError, PreparedRun, RunOutputs, Strategy, audit, explained, prepare_run,
    prepare_streaming_run,
};
use trueup::sim2real::Seed;

use crate::strategy::{Guest, Raised};
use crate::table::Table;
use crate::{error, work};

/// Events between two looks whether the work is to go on.
const EVENTS_A_TURN: usize = 4_096;

/// What a run came to: figures, tables, and a page.
#[pyclass(frozen, module = "trueup")]
pub struct Outputs {
    outputs: RunOutputs,
}

#[pymethods]
impl Outputs {
    /// `run.json` as text (schema trueup.run/1).
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        self.outputs.json().map_err(|error| unwritten(py, error))
    }

    /// A table: "orders", "fills", "trades" or "equity".
    fn table(&self, py: Python<'_>, name: &str) -> PyResult<Table> {
        let table = match name {
            "orders" => &self.outputs.orders,
            "fills" => &self.outputs.fills,
            "trades" => &self.outputs.trades,
            "equity" => &self.outputs.equity,
            other => {
                return Err(error::refused(py, &format!("there is no table `{other}`"), "orders, fills, trades or equity"));
            }
        };
        Table::of(table).map_err(|error| error::bug(py, &error.to_string()))
    }

    /// `report.html` as text.
    fn html(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| self.outputs.page.render()).map_err(|error| error::bug(py, &error.to_string()))
    }

    /// Writes all files into `folder`; gives their paths.
    #[pyo3(signature = (folder, force=false))]
    fn write(&self, py: Python<'_>, folder: PathBuf, force: bool) -> PyResult<Vec<PathBuf>> {
        let written = py.detach(|| {
            let overwrite = if force { Overwrite::Force } else { Overwrite::Refuse };
            let mut output = OutputFolder::create(&folder, overwrite)?;
            output.check_free(&RunOutputs::FILES)?;
            self.outputs.write(&mut output)?;
            Ok(output.finish()?)
        });
        written.map_err(|error| unwritten(py, error))
    }
}

fn unwritten(py: Python<'_>, error: OutputError) -> PyErr {
    match error {
        OutputError::File(error) => error::input(py, &error),
        other => error::bug(py, &other.to_string()),
    }
}

/// The run at `path`, with other `values` by path ("strategy.fast").
fn run_file(py: Python<'_>, path: PathBuf, seed: Option<u64>, values: Option<&Bound<'_, PyDict>>) -> PyResult<RunFile> {
    let refuse = |error: InputError| error::input(py, &error);
    let mut file = py.detach(|| RunFile::read(path)).map_err(refuse)?;
    let mut others = Vec::new();
    for (path, value) in values.into_iter().flatten() {
        others.push((path.extract::<String>()?, toml_value(py, &value)?));
    }
    if !others.is_empty() {
        file = file.with_values(&others, &|_, _| true).map_err(refuse)?;
    }
    file.run.seed = seed.unwrap_or(file.run.seed);
    Ok(file)
}

fn toml_value(py: Python<'_>, value: &Bound<'_, PyAny>) -> PyResult<toml::Value> {
    Ok(match value {
        value if value.is_instance_of::<PyBool>() => toml::Value::Boolean(value.extract()?),
        value if value.is_instance_of::<PyInt>() => toml::Value::Integer(value.extract()?),
        value if value.is_instance_of::<PyFloat>() => toml::Value::Float(value.extract()?),
        value if value.is_instance_of::<PyString>() => toml::Value::String(value.extract()?),
        other => {
            let message =
                format!("a value of a run is a number, a truth value or a text, found {}", other.get_type().name()?);
            return Err(error::refused(py, &message, "such as values={\"strategy.fast\": 12}"));
        }
    })
}

fn prepared(file: &RunFile) -> Result<PreparedRun, InputError> {
    if file.run.stream { prepare_streaming_run(file) } else { prepare_run(file) }
}

/// Runs `prepared` with `strategy`, and looks between events whether to go on.
fn run(
    file: &RunFile,
    prepared: &PreparedRun,
    strategy: &mut dyn Strategy,
    mut look: impl FnMut(usize, Option<usize>) -> PyResult<()>,
) -> PyResult<Result<RunOutputs, InputError>> {
    let mut session = match prepared.start() {
        Ok(session) => session,
        Err(error) => return Ok(Err(explained(file, &error))),
    };
    loop {
        let (done, of) = session.progress();
        look(done, of)?;
        match session.advance(strategy, EVENTS_A_TURN) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => return Ok(Err(explained(file, &error))),
        }
    }
    let (done, of) = session.progress();
    look(done, of)?;
    let shown =
        |record| prepared.outputs(&record).map_err(|error| InputError::new(file.document().path(), error.to_string()));
    Ok(session.finish().map_err(|error| explained(file, &error)).and_then(shown))
}

/// Runs the RUN.toml at `path` with the strategy it names.
#[pyfunction]
#[pyo3(signature = (path, seed=None, values=None, progress=None))]
pub fn backtest(
    py: Python<'_>,
    path: PathBuf,
    seed: Option<u64>,
    values: Option<&Bound<'_, PyDict>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Outputs> {
    let file = run_file(py, path, seed, values)?;
    let done = work::outside(py, |course| {
        let mut strategy = strategy_of_run(&file)?;
        let prepared = prepared(&file)?;
        let listener = course.listener(progress);
        let look = |done, of: Option<usize>| {
            listener("running", done, of.unwrap_or_default());
            Ok(())
        };
        // Nothing is raised here: what ends the work unwinds.
        run(&file, &prepared, strategy.as_mut(), look).unwrap_or_else(|_| Err(InputError::new("", "the work was ended")))
    })?;
    Ok(Outputs { outputs: done.map_err(|error| error::input(py, &error))? })
}

/// Runs the RUN.toml at `path` with a strategy of Python, on the thread that calls.
#[pyfunction]
#[pyo3(signature = (path, strategy, seed=None, values=None, progress=None))]
pub fn backtest_with(
    py: Python<'_>,
    path: PathBuf,
    strategy: Py<PyAny>,
    seed: Option<u64>,
    values: Option<&Bound<'_, PyDict>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Outputs> {
    let file = run_file(py, path, seed, values)?;
    let refuse = |error: InputError| error::input(py, &error);
    let mut prepared = py.detach(|| prepared(&file)).map_err(refuse)?;
    let raised = Raised::default();
    let mut guest = Guest::new(py, strategy, raised.clone())?;
    guest.name().clone_into(&mut prepared.provenance.strategy);
    let look = |done: usize, of: Option<usize>| {
        raised.check()?;
        py.check_signals()?;
        match &progress {
            Some(told) => told.call1(py, ("running", done, of.unwrap_or_default())).map(drop),
            None => Ok(()),
        }
    };
    let outputs = run(&file, &prepared, &mut guest, look)?;
    raised.check()?;
    Ok(Outputs { outputs: outputs.map_err(refuse)? })
}

/// Why there is no audit.
enum Unable {
    Run(BacktestError),
    Raised(PyErr),
}

impl From<BacktestError> for Unable {
    fn from(error: BacktestError) -> Self {
        Self::Run(error)
    }
}

/// Audits the strategies that `make()` gives, or those that the RUN.toml at `path` names, on its data; gives the audit as JSON.
#[pyfunction]
#[pyo3(signature = (path, make=None, cuts=30, seed=1, progress=None))]
pub fn audit_with(
    py: Python<'_>,
    path: PathBuf,
    make: Option<Py<PyAny>>,
    cuts: usize,
    seed: u64,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let file = run_file(py, path, None, None)?;
    let audited = work::outside(py, |course| {
        let prepared = prepare_run(&file).map_err(|error| Python::attach(|py| error::input(py, &error)))?;
        let listener = course.listener(progress);
        let raised = Raised::default();
        let made = |_: &[History]| -> Result<Box<dyn Strategy>, Unable> {
            // Before a run and not only after it: work that is ended would else begin every run that is left.
            course.check();
            let Some(make) = &make else {
                return strategy_of_run(&file)
                    .map_err(|error| Unable::Raised(Python::attach(|py| error::input(py, &error))));
            };
            Python::attach(|py| {
                let strategy = make.call0(py).map_err(Unable::Raised)?;
                let guest = Guest::new(py, strategy, raised.clone()).map_err(Unable::Raised)?;
                Ok(Box::new(guest) as Box<dyn Strategy>)
            })
        };
        let told = |done: usize, of: usize| {
            if let Err(error) = raised.check() {
                course.fail(error);
            }
            listener("auditing", done, of);
        };
        let found = audit(&prepared.backtest, made, AuditSettings { cuts, seed: Seed(seed) }, &told);
        raised.check()?;
        found.map_err(|error| match error {
            Unable::Run(error) => Python::attach(|py| error::input(py, &explained(&file, &error))),
            Unable::Raised(error) => error,
        })
    })?;
    serde_json::to_string(&audited?).map_err(|error| error::bug(py, &error.to_string()))
}
