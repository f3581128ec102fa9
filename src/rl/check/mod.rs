//! The contract of [`VecEnv`](super::VecEnv) as a function: run over every environment by the tests, and public, so that an
//! environment or a wrapper written elsewhere can be held to it too.

mod play;
mod rules;

use std::fmt;

use super::{EnvError, Made};

/// A line of the contract.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Rule {
    /// Spaces, names, bounds and options are in order, and the same at any number of lanes.
    About,
    /// What is observed lies within its space.
    Observation,
    /// Rewards are finite and within their range.
    Reward,
    /// Resets and steps write all they should.
    Written,
    /// Same seed, same bits.
    Seed,
    /// A lane does not depend on how many others there are, on its place among them, or on threads.
    Lanes,
    /// A reset of some lanes touches no other.
    Mask,
    /// A clone goes on with the same bits, and shares nothing.
    Clone,
    /// A copied lane goes on with the same bits, and no other lane changes.
    Copy,
    /// Episodes end in time, and a lane that is stepped after its end does no harm.
    End,
    /// What is refused is refused with an error, and leaves all as it was.
    Error,
}

/// A line of the contract that is broken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Which.
    pub rule: Rule,
    /// What was found.
    pub what: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}: {}", self.rule, self.what)
    }
}

/// What came of a check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EnvReport {
    /// The environment.
    pub id: String,
    /// All that was found.
    pub findings: Vec<Finding>,
    /// Steps of a lane that were taken, over all lanes and runs.
    pub steps: usize,
    /// Episodes that ended in the first run.
    pub episodes: usize,
}

impl EnvReport {
    /// Whether nothing was found.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.findings.is_empty()
    }

    fn find(&mut self, rule: Rule, what: impl Into<String>) {
        let finding = Finding { rule, what: what.into() };
        if !self.findings.contains(&finding) {
            self.findings.push(finding);
        }
    }
}

impl fmt::Display for EnvReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { id, findings, steps, episodes } = self;
        write!(f, "{id}: {} findings in {steps} steps, {episodes} episodes", findings.len())?;
        findings.iter().try_for_each(|finding| write!(f, "\n  {finding}"))
    }
}

/// Runs the contract of [`VecEnv`](super::VecEnv) on the environments that `make` gives for a number of lanes, with random actions
/// over `steps` steps, some hundreds or as many as it takes for episodes to end. It goes on after what it finds.
///
/// # Errors
/// What `make` gives, and an error where none should be: of a first reset, or a step.
pub fn check_env(make: impl Fn(usize) -> Made, steps: usize) -> Result<EnvReport, EnvError> {
    let id = make(1)?.about().id.clone();
    let mut report = EnvReport { id, findings: Vec::new(), steps: 0, episodes: 0 };
    let base = rules::base(&make, steps, &mut report)?;
    rules::same_seed(&make, steps, &base, &mut report)?;
    rules::lanes(&make, steps, &base, &mut report)?;
    rules::masks(&make, steps, &base, &mut report)?;
    rules::clones(&make, steps, &base, &mut report)?;
    rules::copies(&make, steps, &base, &mut report)?;
    rules::ends(&make, steps, &base, &mut report)?;
    rules::errors(&make, steps, &base, &mut report)?;
    Ok(report)
}
