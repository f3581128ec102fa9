//! How a command ends: done, with a finding, at bad input, or at a bug.

use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::process::ExitCode;

use crate::io::InputError;
use crate::report::ReportError;

/// What a command that came to its end found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    Done,
    /// Something the caller asked to fail on.
    Finding,
}

/// Why a command did not come to its end.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum Stop {
    #[error(transparent)]
    Input(#[from] InputError),
    /// Something wrong that is not the user's doing.
    #[error("{0}")]
    Bug(String),
    /// Whoever read the results has gone.
    #[error("nobody reads standard output")]
    Unread,
}

impl From<ReportError> for Stop {
    fn from(error: ReportError) -> Self {
        Self::Bug(error.to_string())
    }
}

impl From<serde_json::Error> for Stop {
    fn from(error: serde_json::Error) -> Self {
        Self::Bug(error.to_string())
    }
}

/// Keeps panics from printing, for they are told by [`report`], or caught where a reader meets corrupt bytes; someone who
/// asks for a backtrace gets all of them.
pub(super) fn silence_panics() {
    if std::env::var_os("RUST_BACKTRACE").is_none_or(|value| value == "0") {
        drop(take_hook());
        set_hook(Box::new(|_| {}));
    }
}

/// Runs `job`; a panic in it is a bug.
pub(super) fn caught(job: impl FnOnce() -> Result<Outcome, Stop>) -> Result<Outcome, Stop> {
    catch_unwind(AssertUnwindSafe(job)).unwrap_or_else(|payload| {
        let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
        Err(Stop::Bug(text.unwrap_or_else(|| "a panic without words".to_owned())))
    })
}

/// Tells on standard error what stopped a command; gives its exit code.
pub(super) fn report(outcome: Result<Outcome, Stop>) -> ExitCode {
    match outcome {
        Ok(Outcome::Done) | Err(Stop::Unread) => ExitCode::SUCCESS,
        Ok(Outcome::Finding) => ExitCode::from(1),
        Err(Stop::Input(error)) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
        Err(Stop::Bug(what)) => {
            eprintln!("error: trueup has met a bug of its own: {what}");
            eprintln!("  hint: please report it, with the command and what RUST_BACKTRACE=1 adds to this message");
            ExitCode::from(3)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_bug_and_bad_input_is_not() {
        let bug = caught(|| panic!("index {}", 3)).unwrap_err();
        assert_eq!(bug, Stop::Bug("index 3".to_owned()));
        assert_eq!(report(Err(bug)), ExitCode::from(3));
        assert_eq!(report(caught(|| Err(InputError::new("a.csv", "is empty").into()))), ExitCode::from(2));
        assert_eq!(report(caught(|| Ok(Outcome::Finding))), ExitCode::from(1));
    }
}
