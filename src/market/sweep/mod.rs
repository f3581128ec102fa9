//! Sweeps: one run tried with many values.
//!
//! The data are read once and shared. Every run has the seed of its own document, so that runs differ by their values and
//! by nothing else; draws depend on the sweep's seed and their number, never on threads.

mod journal;
mod page;
mod plan;
mod selection;
mod summary;
mod trial;

use rayon::prelude::*;
use sha2::{Digest, Sha256};

use crate::io::{InputError, RunFile, SweepValues};

use super::metric::Metrics;
use super::{Backtest, History, PreparedRun, Strategy};

pub use journal::{Header, JOURNAL, Journal, JournalError, Line};
pub use plan::{Values, plan};
pub use selection::{best, ranked};
pub use summary::{Ranked, SweepSummary, sweep_table};
pub(super) use summary::{column, head, shown};
pub use trial::{Outcome, Trial, figures};

/// Why a strategy was not built.
#[derive(Debug, Clone, PartialEq)]
pub enum Refused {
    /// The strategy refuses these values together (`fast >= slow`): the run is counted as invalid, and the sweep goes on.
    Invalid(String),
    /// The document is wrong: nothing can be run.
    Input(InputError),
}

/// Builds the strategy of a run.
pub type Make = dyn Fn(&RunFile) -> Result<Box<dyn Strategy>, Refused> + Sync;

/// A run, and how it is tried with other values.
pub struct Sweep<'a> {
    /// The run as it is written.
    pub run: &'a RunFile,
    /// The same, its data read.
    pub prepared: &'a PreparedRun,
    /// Builds the strategy of a run.
    pub make: &'a Make,
    /// Whether a kind of strategy (the first) has a parameter (the second).
    pub belongs: &'a (dyn Fn(&str, &str) -> bool + Sync),
}

impl std::fmt::Debug for Sweep<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sweep").field("run", &self.run.document().path()).finish_non_exhaustive()
    }
}

impl Sweep<'_> {
    /// Builds, without running, what every one of `all` stands for.
    ///
    /// # Errors
    /// Of all values that cannot be put into the run, those that come first.
    pub fn check(&self, all: &[Values]) -> Result<(), InputError> {
        let one = |values: &Values| {
            let run = self.run.with_values(values, self.belongs)?;
            match (self.make)(&run) {
                Err(Refused::Input(error)) => return Err(self.run.blamed(values, error)),
                Err(Refused::Invalid(_)) | Ok(_) => {}
            }
            if touches_the_venue(values) {
                self.prepared.variant(&run).map_err(|error| self.run.blamed(values, error))?;
            }
            Ok(())
        };
        all.par_iter().map(one).collect::<Vec<_>>().into_iter().collect()
    }

    /// Tries the values numbered `index` on `data`; on all there are where none are given.
    ///
    /// # Errors
    /// As [`Sweep::check`].
    pub fn trial(&self, index: usize, values: &Values, data: Option<&[History]>) -> Result<Trial, InputError> {
        let run = self.run.with_values(values, self.belongs)?;
        let outcome = match (self.make)(&run) {
            Err(Refused::Input(error)) => return Err(self.run.blamed(values, error)),
            Err(Refused::Invalid(why)) => Outcome::Invalid { why },
            Ok(mut strategy) => outcome(&self.backtest(&run, values, data)?, strategy.as_mut()),
        };
        self.again(index, values, outcome)
    }

    /// The trial of the values numbered `index`, of which is known what they came to.
    ///
    /// # Errors
    /// As [`Sweep::check`].
    pub fn again(&self, index: usize, values: &Values, outcome: Outcome) -> Result<Trial, InputError> {
        let run = self.run.with_values(values, self.belongs)?;
        let hash = self.hash(&run);
        Ok(Trial { index, values: values.iter().cloned().collect(), seed: run.run.seed, hash, outcome })
    }

    /// The backtest of `run` on `data`, or why these data allow none.
    pub(super) fn backtest(
        &self,
        run: &RunFile,
        values: &SweepValues,
        data: Option<&[History]>,
    ) -> Result<Result<Backtest, String>, InputError> {
        let whole = if touches_the_venue(values) {
            self.prepared.variant(run).map_err(|error| self.run.blamed(values, error))?
        } else {
            self.prepared.backtest.clone()
        };
        Ok(match data {
            Some(data) => whole.on(data.to_vec()).map_err(|error| error.to_string()),
            None => Ok(whole),
        })
    }

    /// What tells a run from all others: its document, the program and the data.
    fn hash(&self, run: &RunFile) -> String {
        let mut text = format!("{}\n{}\n", env!("CARGO_PKG_VERSION"), run.document().text());
        // The first input is the document as it is written, which says less than what it became.
        self.prepared.provenance.inputs.iter().skip(1).for_each(|input| text += &format!("{}\n", input.sha256));
        hexadecimal(&text)
    }
}

fn outcome(backtest: &Result<Backtest, String>, strategy: &mut dyn Strategy) -> Outcome {
    let ran = backtest.as_ref().map_err(Clone::clone).and_then(|backtest| {
        let record = backtest.run(strategy).map_err(|error| error.to_string())?;
        let metrics = Metrics::of(&record).map_err(|error| error.to_string());
        backtest.recycle(record);
        metrics
    });
    match ran {
        Ok(metrics) => Outcome::Done { metrics: figures(&metrics) },
        Err(why) => Outcome::Failed { why: why.replace('\n', "; ") },
    }
}

/// Whether values are of more than the strategy, which every run builds anew.
fn touches_the_venue(values: &SweepValues) -> bool {
    values.iter().any(|(path, _)| !path.starts_with("strategy."))
}

/// SHA-256 of `text`.
fn hexadecimal(text: &str) -> String {
    Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
}
