//! What a run of the benchmark amounts to.

use serde::{Deserialize, Serialize};

use super::confusion::Confusion;
use super::domain::Domain;
use super::figure::Figure;
use super::journal::{Journal, JournalError};
use super::reliability::Reliability;
use super::score::{Entry, Method};
use super::seal::seal_of_all;
use super::table::figures;

/// The schema `summary.json` names.
pub const SUMMARY: &str = "trueup.proof/1";

/// Seeds from here on are for tests: what is learnt from their cases must not go into the program.
pub const TEST_SEEDS: u64 = 1_000;

/// The whole result: field by field it is `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// [`SUMMARY`].
    pub schema: String,
    /// What the cases are of.
    pub domain: Domain,
    /// The seed all cases were drawn from.
    pub seed: u64,
    /// Whether it is one of those that the program may be developed on.
    pub development: bool,
    /// Number of cases.
    pub cases: usize,
    /// The version of trueup.
    pub version: String,
    /// The seal of all labels.
    pub seal: String,
    /// The table.
    pub figures: Vec<Figure>,
    /// What was taken for what.
    pub confusion: Confusion,
    /// Whether confidences are probabilities.
    pub reliability: Reliability,
    /// The worst answers, worst first.
    pub failures: Vec<Failure>,
}

/// A case that was answered wrongly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// Number of the case.
    pub index: usize,
    /// What was concealed, and how large.
    pub truth: String,
    /// What was said.
    pub said: String,
    /// What makes the case what it is, in words.
    pub circumstances: String,
    /// Held-out errors over the noise: recalibrated, trued, and the oracle's where there is one.
    pub errors: [Option<f64>; 3],
}

/// Failures that are told.
const TOLD: usize = 12;

impl Summary {
    /// Of a journal whose cases are all done.
    ///
    /// # Errors
    /// As [`Journal::entries`].
    pub fn of(journal: &Journal) -> Result<Self, JournalError> {
        let entries = journal.entries()?;
        let reliability = Reliability::of(&entries);
        let header = &journal.header;
        Ok(Self {
            schema: SUMMARY.to_owned(),
            domain: header.domain,
            seed: header.seed,
            development: header.seed < TEST_SEEDS,
            cases: header.cases,
            version: header.version.clone(),
            seal: seal_of_all(&header.seals),
            figures: figures(header.domain, &entries, &reliability),
            confusion: Confusion::of(&entries),
            reliability,
            failures: failures(&entries),
        })
    }
}

fn failures(entries: &[Entry]) -> Vec<Failure> {
    let mut wrong: Vec<(f64, &Entry)> = entries.iter().map(|e| (e.severity(), e)).filter(|(s, _)| *s > 0.0).collect();
    wrong.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.truth.index.cmp(&b.1.truth.index)));
    wrong.into_iter().take(TOLD).map(|(_, entry)| failure(entry)).collect()
}

fn failure(entry: &Entry) -> Failure {
    let (truth, trial) = (&entry.truth, &entry.trial);
    let sized = |id: &str, size: f64| format!("{id} ({size:.1} sigma)");
    let outside = truth.outside.iter().map(|(id, size)| format!("outside: {}", sized(id, *size)));
    let concealed: Vec<String> = truth.effects.iter().map(|effect| sized(&effect.id, effect.size)).chain(outside).collect();
    let names = entry.answer(Method::Diagnosis).names;
    let found = trial.found.iter().filter(|found| names.contains(&found.mechanism));
    let found: Vec<String> = found.map(|found| format!("{} {:.2}", found.mechanism, found.confidence)).collect();
    let ratio = |error: f64| Some(error / truth.noise).filter(|ratio| ratio.is_finite());
    Failure {
        index: truth.index,
        truth: if concealed.is_empty() { "nothing".to_owned() } else { concealed.join(" and ") },
        said: if found.is_empty() { trial.verdict.to_string() } else { format!("{}: {}", trial.verdict, found.join(", ")) },
        circumstances: truth.circumstances.clone(),
        errors: [
            ratio(trial.held_out.recalibrated),
            ratio(trial.held_out.trued),
            trial.oracle.as_ref().and_then(|oracle| ratio(oracle.held_out)),
        ],
    }
}
