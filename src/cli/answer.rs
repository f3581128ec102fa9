//! Commands that a program runs: results are given back instead of printed, and progress is told to whoever asked.

use std::ffi::OsString;
use std::fmt;
use std::sync::Arc;

use clap::Parser;

use super::Line;
use super::screen::Screen;
use super::stop::{Outcome, Stop};
use crate::io::InputError;

/// Learns of each step of a long work: what is being done, how many parts of it lie behind, and of how many; 0 where nobody knows
/// how many there are. It is called from many threads. Where it unwinds, the work ends and nothing is left of it.
pub type Listener = Arc<dyn Fn(&str, usize, usize) + Send + Sync>;

/// What a command answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// What the terminal would have shown: with `--json` that alone.
    pub text: String,
    /// Whether it found something the caller asked to fail on: exit code 1.
    pub finding: bool,
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// A line that is no command, or a call for help, in words.
    Usage(String),
    /// Bad input: exit code 2.
    Input(InputError),
    /// A bug: exit code 3.
    Bug(String),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(text) => write!(f, "{text}"),
            Self::Input(error) => write!(f, "{error}"),
            Self::Bug(text) => write!(f, "trueup has met a bug of its own: {text}\n  hint: please report it"),
        }
    }
}

/// Runs the command line `arguments`, the first of which is the name of the program, and gives what it would have printed.
///
/// `--threads` and `--progress` mean nothing here: threads are the caller's, and so is what is told.
///
/// # Errors
/// As the command line ends with another exit code than 0 and 1.
pub fn answer(
    arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    listener: Listener,
) -> Result<Answer, Refusal> {
    let line = Line::try_parse_from(arguments).map_err(|error| Refusal::Usage(error.to_string()))?;
    let screen = Screen::collecting(listener);
    match line.command.run(&screen) {
        Ok(outcome) => Ok(Answer { text: screen.collected(), finding: outcome == Outcome::Finding }),
        Err(Stop::Input(error)) => Err(Refusal::Input(error)),
        Err(Stop::Bug(text)) => Err(Refusal::Bug(text)),
        Err(stop @ Stop::Unread) => Err(Refusal::Bug(stop.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    fn silent() -> Listener {
        Arc::new(|_, _, _| {})
    }

    #[test]
    fn an_answer_is_what_would_have_been_printed() {
        let answer = answer(["trueup", "mechanisms", "--json"], silent()).unwrap();
        assert!(answer.text.contains("\"schema\": \"trueup.mechanisms/1\""), "{}", answer.text);
        assert!(!answer.finding);
    }

    #[test]
    fn a_refusal_says_what_the_terminal_would_have_been_told() {
        let Err(Refusal::Input(error)) = answer(["trueup", "audit", "nowhere.toml"], silent()) else {
            panic!("no such file")
        };
        assert_eq!(error.path, std::path::Path::new("nowhere.toml"));
        let Err(Refusal::Usage(text)) = answer(["trueup", "audti"], silent()) else { panic!("no such command") };
        assert!(text.contains("audit"), "{text}");
    }

    #[test]
    fn the_caller_learns_how_far_it_is() {
        let run = concat!(env!("CARGO_MANIFEST_DIR"), "/data/bars/run.toml");
        let told = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&told);
        let listener: Listener = Arc::new(move |step, _, _| kept.lock().unwrap().push(step.to_owned()));
        answer(["trueup", "backtest", run, "--json"], listener).unwrap();
        assert!(told.lock().unwrap().iter().any(|step| step == "running"));
    }
}
