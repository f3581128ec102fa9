//! Lanes that step in place, on arrays of NumPy that were given once.

use numpy::{Element, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use trueup::rl::{Actions, Kept, Out, choices_of_32_bits, rewards_of_32_bits};

use crate::environment::{Lanes, drive, scattered};

/// Lanes, the arrays they read their actions from and those they write what comes of them into.
#[pyclass(module = "trueup._trueup")]
pub struct BoundLanes {
    lanes: Py<Lanes>,
    actions: ActionBuffer,
    observations: Py<PyArrayDyn<f32>>,
    rewards: RewardBuffer,
    terminated: Py<PyArrayDyn<bool>>,
    truncated: Py<PyArrayDyn<bool>>,
}

/// Actions; those of the second kind are copied into numbers of the library's own type.
enum ActionBuffer {
    Real(Py<PyArrayDyn<f32>>),
    Choice(Py<PyArrayDyn<i64>>),
    ShortChoice(Py<PyArrayDyn<i32>>, Vec<i64>),
}

/// Rewards, in double precision or rounded to single.
enum RewardBuffer {
    Double(Py<PyArrayDyn<f64>>),
    Single(Py<PyArrayDyn<f32>>, Vec<f64>),
}

#[pymethods]
impl BoundLanes {
    /// Binds `lanes` to the arrays, which are C-contiguous and writeable, and of the sizes that a step asks for: `actions` float32, int64 or
    /// int32, `observations` float32, `rewards` float64 or float32, `terminated` and `truncated` bool.
    #[new]
    fn new(
        lanes: Py<Lanes>,
        actions: &Bound<'_, PyAny>,
        observations: Py<PyArrayDyn<f32>>,
        rewards: &Bound<'_, PyAny>,
        terminated: Py<PyArrayDyn<bool>>,
        truncated: Py<PyArrayDyn<bool>>,
    ) -> PyResult<Self> {
        // Nobody is told of what was last.
        lanes.borrow_mut(actions.py()).driven().keep(Kept::Nothing);
        let actions = if let Ok(real) = actions.extract() {
            ActionBuffer::Real(real)
        } else if let Ok(choice) = actions.extract() {
            ActionBuffer::Choice(choice)
        } else {
            ActionBuffer::ShortChoice(actions.extract()?, Vec::new())
        };
        let rewards = match rewards.extract() {
            Ok(double) => RewardBuffer::Double(double),
            Err(_) => RewardBuffer::Single(rewards.extract()?, Vec::new()),
        };
        Ok(Self { lanes, actions, observations, rewards, terminated, truncated })
    }

    /// Takes a step by the actions there are in their array, into which `given` ones are written before, and writes what comes of it into the
    /// others.
    #[pyo3(signature = (given=None))]
    fn step(&mut self, py: Python<'_>, given: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        if let Some(given) = given {
            match &self.actions {
                ActionBuffer::Real(own) => take(given, own)?,
                ActionBuffer::Choice(own) => take(given, own)?,
                ActionBuffer::ShortChoice(own, _) => take(given, own)?,
            }
        }
        let actions = match &mut self.actions {
            ActionBuffer::Real(real) => Actions::Continuous(read(py, real)?),
            ActionBuffer::Choice(choice) => Actions::Discrete(read(py, choice)?),
            ActionBuffer::ShortChoice(short, own) => {
                choices_of_32_bits(read(py, short)?, own);
                Actions::Discrete(own)
            }
        };
        let rewards: &mut [f64] = match &mut self.rewards {
            RewardBuffer::Double(double) => written(py, double)?,
            RewardBuffer::Single(single, own) => {
                own.resize(read(py, single)?.len(), 0.0);
                own
            }
        };
        let mut out = Out {
            observations: written(py, &self.observations)?,
            rewards,
            terminated: written(py, &self.terminated)?,
            truncated: written(py, &self.truncated)?,
        };
        drive(py, self.lanes.borrow_mut(py).driven(), |driver| driver.step(actions, &mut out))?;
        if let RewardBuffer::Single(single, own) = &self.rewards {
            rewards_of_32_bits(own, written(py, single)?);
        }
        Ok(())
    }
}

/// Writes `given` actions into `own` array: those that lie there as they are asked for without a word to NumPy, which takes longer to see that
/// than a step does.
fn take<T: Element + Copy>(given: &Bound<'_, PyAny>, own: &Py<PyArrayDyn<T>>) -> PyResult<()> {
    let own = own.bind(given.py());
    if let Ok(array) = given.cast_exact::<PyArrayDyn<T>>()
        && array.shape() == own.shape()
        && array.is_c_contiguous()
    {
        let (from, to, bytes) = (array.data() as usize, own.data() as usize, own.len() * size_of::<T>());
        if from == to {
            return Ok(());
        }
        if from.abs_diff(to) >= bytes {
            written(given.py(), own.as_unbound())?.copy_from_slice(read(given.py(), array.as_unbound())?);
            return Ok(());
        }
    }
    own.set_item(given.py().Ellipsis(), given)
}

/// What is in an array.
// A step takes as long as the books that are otherwise kept of who has borrowed which array. Whoever binds arrays leaves them alone while a
// step is under way, as with any function of NumPy that writes into an array.
#[allow(unsafe_code)]
fn read<'a, T: Element>(py: Python<'a>, array: &'a Py<PyArrayDyn<T>>) -> PyResult<&'a [T]> {
    // SAFETY: the array is alive, and nothing else writes into it during the step.
    unsafe { array.bind(py).as_slice() }.map_err(|_| scattered(py, "a buffer"))
}

/// The same, to be written into.
#[allow(unsafe_code)]
fn written<'a, T: Element>(py: Python<'a>, array: &'a Py<PyArrayDyn<T>>) -> PyResult<&'a mut [T]> {
    // SAFETY: as above; each array of a `BoundLanes` is borrowed once at a time.
    unsafe { array.bind(py).as_slice_mut() }.map_err(|_| scattered(py, "a buffer"))
}
