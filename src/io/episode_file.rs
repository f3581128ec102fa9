//! Episodes of environments, as they are put into files: a table of their steps, or a data set of Minari.

use std::path::Path;

use super::error::InputError;
use super::output_table::OutputTable;

/// The actions of an episode, row after row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ActionColumns<'a> {
    /// Real numbers.
    Continuous(&'a [f32]),
    /// Choices.
    Discrete(&'a [i64]),
}

/// An episode: a row a step, and one observation more than steps, the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EpisodeColumns<'a> {
    /// Seed of its lane.
    pub seed: u64,
    /// Its number among the episodes of that seed, from 0.
    pub number: u64,
    /// What was observed, shape (steps + 1, size).
    pub observations: &'a [f32],
    /// What was done, shape (steps, size of an action).
    pub actions: ActionColumns<'a>,
    /// Rewards, one a step.
    pub rewards: &'a [f64],
    /// Whether it terminated, one a step.
    pub terminated: &'a [bool],
    /// Whether it was cut off, one a step.
    pub truncated: &'a [bool],
}

/// What can be observed or done, as Gymnasium has it.
#[derive(Debug, Clone, PartialEq)]
pub enum SpaceColumns {
    /// Real numbers in single precision, within bounds.
    Box {
        /// Lower bounds, row after row.
        low: Vec<f32>,
        /// Upper bounds.
        high: Vec<f32>,
        /// Shape, whose product is the number of components.
        shape: Vec<usize>,
        /// Names of the components.
        names: Vec<String>,
    },
    /// One of so many choices.
    Discrete {
        /// How many there are.
        n: usize,
        /// What is chosen.
        name: String,
    },
    /// Several choices.
    MultiDiscrete {
        /// How many there are of each.
        n: Vec<usize>,
        /// What is chosen by each.
        names: Vec<String>,
    },
}

impl SpaceColumns {
    fn names(&self) -> Vec<&str> {
        match self {
            Self::Box { names, .. } | Self::MultiDiscrete { names, .. } => names.iter().map(String::as_str).collect(),
            Self::Discrete { name, .. } => vec![name],
        }
    }
}

/// Episodes of one environment.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeFile<'a> {
    /// Its id.
    pub environment: &'a str,
    /// What was observed.
    pub observation: SpaceColumns,
    /// What was done.
    pub action: SpaceColumns,
    /// The episodes.
    pub episodes: Vec<EpisodeColumns<'a>>,
}

impl EpisodeFile<'_> {
    /// Number of steps of all episodes.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.episodes.iter().map(|episode| episode.rewards.len()).sum()
    }

    /// All steps as one table, to be written as CSV or Parquet ([`write_table`](super::write_table)): `episode` (from 0), `step`
    /// (from 0), `seed` (a text, for it may be larger than an integer of 64 bits with a sign), `number`, a column
    /// `observation.NAME` for each component, `action.NAME`, `reward`, `terminated` and `truncated` (0 or 1). A row holds what was
    /// observed, and what was done and came of it; the last of an episode holds its last observation alone.
    ///
    /// # Errors
    /// An episode whose columns do not fit together.
    pub fn table(&self, path: &Path) -> Result<OutputTable, InputError> {
        self.check(path)?;
        let rows = |episode: &EpisodeColumns<'_>| episode.rewards.len() + 1;
        let each = |of: &dyn Fn(usize, &EpisodeColumns<'_>, usize) -> Option<i64>| -> Vec<Option<i64>> {
            let numbered = self.episodes.iter().enumerate();
            numbered.flat_map(|(k, one)| (0..rows(one)).map(move |row| of(k, one, row))).collect()
        };
        let flag = |flags: &[bool], row: usize| flags.get(row).map(|flag| i64::from(*flag));
        let seeds = self.episodes.iter().flat_map(|one| std::iter::repeat_n(Some(one.seed.to_string()), rows(one)));
        let mut table = OutputTable::new()
            .integers("episode", each(&|k, _, _| i64::try_from(k).ok()))
            .integers("step", each(&|_, _, row| i64::try_from(row).ok()))
            .texts("seed", seeds)
            .integers("number", each(&|_, one, _| i64::try_from(one.number).ok()));
        let names = self.observation.names();
        for (component, name) in names.iter().enumerate() {
            let values = self.episodes.iter().flat_map(|one| one.observations.iter().skip(component).step_by(names.len()));
            table = table.floats(&format!("observation.{name}"), values.map(|value| f64::from(*value)));
        }
        let names = self.action.names();
        for (component, name) in names.iter().enumerate() {
            let (name, place) = (format!("action.{name}"), |row: usize| row * names.len() + component);
            let floats = self.episodes.iter().flat_map(|one| (0..rows(one)).map(move |row| (one.actions, place(row))));
            table = match self.action {
                SpaceColumns::Box { .. } => table.floats(&name, floats.map(|(actions, at)| actions.real(at))),
                SpaceColumns::Discrete { .. } | SpaceColumns::MultiDiscrete { .. } => {
                    table.integers(&name, floats.map(|(actions, at)| actions.choice(at)))
                }
            };
        }
        let rewards = self.episodes.iter().flat_map(|one| (0..rows(one)).map(|row| one.rewards.get(row).copied()));
        Ok(table
            .floats("reward", rewards)
            .integers("terminated", each(&|_, one, row| flag(one.terminated, row)))
            .integers("truncated", each(&|_, one, row| flag(one.truncated, row))))
    }

    /// Whether the columns of each episode fit together and to the spaces.
    pub(super) fn check(&self, path: &Path) -> Result<(), InputError> {
        let (observation, action) = (self.observation.names().len(), self.action.names().len());
        for (k, one) in self.episodes.iter().enumerate() {
            let steps = one.rewards.len();
            let (actions, kind) = match one.actions {
                ActionColumns::Continuous(values) => (values.len(), matches!(self.action, SpaceColumns::Box { .. })),
                ActionColumns::Discrete(values) => (values.len(), !matches!(self.action, SpaceColumns::Box { .. })),
            };
            let found = [one.observations.len(), actions, one.terminated.len(), one.truncated.len()];
            let expected = [(steps + 1) * observation, steps * action, steps, steps];
            if found != expected || !kind {
                let message = format!("the columns of episode {k} of {steps} steps do not fit together");
                return Err(InputError::new(path, message)
                    .found(format!("{found:?} observations, actions, ends and cuts, where {expected:?} are expected"))
                    .hint("give one observation more than actions, and actions of the environment's kind"));
            }
        }
        Ok(())
    }
}

impl ActionColumns<'_> {
    fn real(self, at: usize) -> Option<f64> {
        match self {
            Self::Continuous(values) => values.get(at).map(|value| f64::from(*value)),
            Self::Discrete(_) => None,
        }
    }

    fn choice(self, at: usize) -> Option<i64> {
        match self {
            Self::Discrete(values) => values.get(at).copied(),
            Self::Continuous(_) => None,
        }
    }
}
