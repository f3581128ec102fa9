//! Long work: without Python's lock, and ended by Ctrl-C.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use trueup::cli::Listener;

use crate::error;

/// How often Python is asked whether somebody has pressed Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);
/// Stack of the thread that works [bytes]: as the main thread of a program has it.
const STACK: usize = 8 << 20;

/// What ends a work from within, beside a bug.
struct Ended;

/// Whether work goes on: shared by all threads that do it.
#[derive(Clone, Default)]
pub struct Course(Arc<Shared>);

#[derive(Default)]
struct Shared {
    stopped: AtomicBool,
    /// What Python raised while it was asked for something.
    raised: Mutex<Option<PyErr>>,
}

impl Course {
    /// Ends the work of this thread, by unwinding, where it is not to go on.
    pub fn check(&self) {
        if self.0.stopped.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Ended));
        }
    }

    /// Ends the work because of what Python raised.
    pub fn fail(&self, raised: PyErr) -> ! {
        if let Ok(mut first) = self.0.raised.lock() {
            first.get_or_insert(raised);
        }
        self.0.stopped.store(true, Ordering::Relaxed);
        resume_unwind(Box::new(Ended))
    }

    fn raised(&self) -> Option<PyErr> {
        self.0.raised.lock().ok()?.take()
    }

    /// What commands are told by: ends them where the work is not to go on, and tells `told(step, done, of)`, where there is one, at
    /// most every tenth of a second and whenever the step is another.
    pub fn listener(&self, told: Option<Py<PyAny>>) -> Listener {
        let course = self.clone();
        let Some(told) = told else { return Arc::new(move |_, _, _| course.check()) };
        let last: Mutex<Option<(String, Instant)>> = Mutex::new(None);
        Arc::new(move |step, done, of| {
            course.check();
            if let Ok(mut last) = last.lock() {
                let recent =
                    last.as_ref().is_some_and(|(then, at)| then == step && at.elapsed() < Duration::from_millis(100));
                if recent {
                    return;
                }
                *last = Some((step.to_owned(), Instant::now()));
            }
            if let Err(raised) = Python::attach(|py| told.call1(py, (step, done, of)).map(drop)) {
                course.fail(raised);
            }
        })
    }
}

/// Does `work` on a thread of its own, without Python's lock, while this one waits for Ctrl-C.
///
/// # Errors
/// What Python raised meanwhile: `KeyboardInterrupt`, or an exception of what the work has called; `trueup.BugError` where it panicked.
pub fn outside<T: Send>(py: Python<'_>, work: impl FnOnce(&Course) -> T + Send) -> PyResult<T> {
    let course = Course::default();
    let (result, signal) = py.detach(|| waited(&course, work));
    if let Some(signal) = signal {
        return Err(signal);
    }
    match result {
        Ok(value) => Ok(value),
        Err(payload) if payload.is::<Ended>() => {
            Err(course.raised().unwrap_or_else(|| error::bug(py, "work has ended without a reason")))
        }
        Err(payload) => Err(error::bug(py, &words(payload.as_ref()))),
    }
}

fn waited<T: Send>(course: &Course, work: impl FnOnce(&Course) -> T + Send) -> (thread::Result<T>, Option<PyErr>) {
    thread::scope(|scope| {
        let (end, ended) = mpsc::channel::<()>();
        let worker = thread::Builder::new().name("trueup".to_owned()).stack_size(STACK).spawn_scoped(scope, move || {
            let _end = end;
            catch_unwind(AssertUnwindSafe(|| work(course)))
        });
        let worker = match worker {
            Ok(worker) => worker,
            Err(error) => return (Err(Box::new(error.to_string()) as Box<dyn Any + Send>), None),
        };
        let mut signal = None;
        while matches!(ended.recv_timeout(LOOK), Err(RecvTimeoutError::Timeout)) {
            if signal.is_none() {
                signal = Python::attach(|py| py.check_signals()).err();
                course.0.stopped.fetch_or(signal.is_some(), Ordering::Relaxed);
            }
        }
        (worker.join().and_then(|result| result), signal)
    })
}

/// What a panic said.
pub fn words(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_else(|| "a panic without words".to_owned())
}
