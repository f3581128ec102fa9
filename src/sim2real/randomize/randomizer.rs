//! Draws for many environments at once.

use pulp::Arch;

use super::correlation::{Correlation, CorrelationError, Group, groups};
use super::entry::{Alone, Entry, Part, Together, way};
use super::level::Level;
use super::normal::{AT_ONCE, normal_quantile};
use super::stream::{DrawKey, Occasion, Streams, name_key, uniform};
use super::{DrawTable, Implausible, Randomized, Target};
use crate::sim2real::Seed;

/// Why parameters cannot be randomized together.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RandomizeError {
    /// One of them cannot be, as is asked.
    #[error("`{target}`: {why}")]
    Parameter {
        /// Which.
        target: Target,
        /// Its number.
        index: usize,
        /// Why not.
        #[source]
        why: Implausible,
    },
    /// One of them is here twice.
    #[error("`{target}` is randomized twice\nhint: drop one of the two")]
    Twice {
        /// Which.
        target: Target,
        /// Number of the second.
        index: usize,
    },
    /// They cannot go together as is asked.
    #[error(transparent)]
    Correlation(#[from] CorrelationError),
}

/// Distributions over parameters of a plant and its mechanisms, from which values are drawn for any number of environments.
///
/// What is drawn for an environment depends on the seed, its number, the number of its episode, the occasion and the name of
/// the parameter, and on nothing else: the same bits with 1 environment beside it or 10,000, and at any number of threads. What
/// else is randomized changes nothing either, but where it is correlated.
#[derive(Debug, Clone, PartialEq)]
pub struct Randomizer {
    entries: Vec<Entry>,
    groups: Vec<Group>,
    randomized: Vec<Randomized>,
    correlations: Vec<Correlation>,
}

impl Randomizer {
    /// A randomizer of these parameters, some of them correlated.
    ///
    /// # Errors
    /// A parameter that [`Randomized::check`] refuses or that is here twice; correlations that no numbers have.
    pub fn new(randomized: Vec<Randomized>, correlations: Vec<Correlation>) -> Result<Self, RandomizeError> {
        for (index, one) in randomized.iter().enumerate() {
            let target = || one.target.clone();
            one.check().map_err(|why| RandomizeError::Parameter { target: target(), index, why })?;
            if randomized[..index].iter().any(|other| other.target == one.target) {
                return Err(RandomizeError::Twice { target: target(), index });
            }
        }
        let names: Vec<String> = randomized.iter().map(|one| one.target.to_string()).collect();
        let together = |a: usize, b: usize| randomized[a].at == randomized[b].at;
        let groups = groups(&names, &correlations, together)?;
        let entry = |(k, one): (usize, &Randomized)| Entry {
            key: name_key(&names[k]),
            inverse: one.distribution.inverse(),
            factor: if one.relative { one.parameter.nominal } else { 1.0 },
            nominal: one.parameter.nominal,
            way: way(one, &names[k]),
            at: one.at,
            grouped: groups.iter().any(|group| group.members.contains(&k)),
        };
        let entries = randomized.iter().enumerate().map(entry).collect();
        Ok(Self { entries, groups, randomized, correlations })
    }

    /// What is randomized, in the order of the rows of tables.
    #[must_use]
    pub fn randomized(&self) -> &[Randomized] {
        &self.randomized
    }

    /// What goes together.
    #[must_use]
    pub fn correlations(&self) -> &[Correlation] {
        &self.correlations
    }

    /// What is odd about it and yet may be meant, a sentence each.
    #[must_use]
    pub fn oddities(&self) -> Vec<String> {
        self.randomized.iter().filter_map(Randomized::oddity).collect()
    }

    /// A table for so many environments in which every parameter has its nominal value.
    #[must_use]
    pub fn nominal(&self, environments: usize) -> DrawTable {
        let nominal: Vec<f64> = self.entries.iter().map(|entry| entry.nominal).collect();
        let targets = self.randomized.iter().map(|one| one.target.clone()).collect();
        DrawTable::nominal(targets, &nominal, environments)
    }

    /// Draws for all environments of `table`, of which the first has the number `first`, as they are made and begin the
    /// episode `episode`.
    #[must_use]
    pub fn begin(&self, seed: Seed, first: u64, environments: usize, episode: u64, level: Level) -> DrawTable {
        let mut table = self.nominal(environments);
        let made: Vec<u64> = vec![0; environments];
        self.draw(&mut table, seed, Occasion::Startup, first, &made, level);
        let episodes = vec![episode; environments];
        self.draw(&mut table, seed, Occasion::Reset, first, &episodes, level);
        table
    }

    /// Draws what is due on `occasion` for all environments of `table`, of which the first has the number `first`, each in its
    /// episode of `episodes`.
    ///
    /// # Panics
    /// If there are not as many episodes as environments: an error of the calling code, not of any input.
    pub fn draw(&self, table: &mut DrawTable, seed: Seed, occasion: Occasion, first: u64, episodes: &[u64], level: Level) {
        let streams = Streams::new(seed, occasion);
        let number = |(i, episode): (usize, &u64)| streams.environment(first + i as u64, *episode);
        let keys: Vec<u64> = episodes.iter().enumerate().map(number).collect();
        assert_eq!(keys.len(), table.environments(), "as many episodes as environments");
        for (k, entry) in self.entries.iter().enumerate() {
            match entry.part_in(occasion) {
                Part::Drawn if !entry.grouped => {
                    Arch::new().dispatch(Alone { entry, keys: &keys, row: table.row_mut(k), level });
                }
                Part::Nominal => table.row_mut(k).fill(entry.nominal),
                Part::Drawn | Part::None => {}
            }
        }
        for group in self.drawn_groups(occasion) {
            Arch::new().dispatch(Together { entries: &self.entries, group, keys: &keys, table, first: 0, level });
        }
    }

    /// The same for one environment alone, the one numbered `number` in entry `place` of the table: environments need not begin
    /// their episodes together.
    pub fn redraw(&self, table: &mut DrawTable, place: usize, seed: Seed, occasion: Occasion, turn: Turn, level: Level) {
        self.redraw_by(table, place, DrawKey::new(seed), occasion, turn, level);
    }

    /// The same, with the key of the seed.
    pub fn redraw_by(
        &self,
        table: &mut DrawTable,
        place: usize,
        key: DrawKey,
        occasion: Occasion,
        turn: Turn,
        level: Level,
    ) {
        let key = Streams::of(key, occasion).environment(turn.environment, turn.episode);
        for (k, entry) in self.entries.iter().enumerate() {
            match entry.part_in(occasion) {
                Part::Drawn if !entry.grouped => entry.fill(&[key], &mut table.row_mut(k)[place..=place], level),
                Part::Nominal => table.row_mut(k)[place] = entry.nominal,
                Part::Drawn | Part::None => {}
            }
        }
        for group in self.drawn_groups(occasion) {
            let standard = |k: &usize| [normal_quantile(uniform(key, self.entries[*k].key))];
            let mut normal: Vec<[f64; 1]> = group.members.iter().map(standard).collect();
            group.correlate(&mut normal);
            for (k, z) in group.members.iter().zip(&mut normal) {
                self.entries[*k].fill_by_normal(&[key], z, &mut table.row_mut(*k)[place..=place], level);
            }
        }
    }

    /// The same for the first environments of `table`, as many as there are `keys`, each with a seed of its own and in its episode of
    /// `episodes`, as environment 0 of it: bit by bit what [`redraw_by`](Self::redraw_by) draws for each.
    ///
    /// # Panics
    /// If there are not as many episodes as keys, or more than environments: an error of the calling code, not of any input.
    pub fn redraw_each(&self, table: &mut DrawTable, keys: &[DrawKey], occasion: Occasion, episodes: &[u64], level: Level) {
        let mut own = [0; AT_ONCE];
        assert_eq!(keys.len(), episodes.len(), "as many episodes as keys");
        for (part, (keys, episodes)) in keys.chunks(AT_ONCE).zip(episodes.chunks(AT_ONCE)).enumerate() {
            let own = &mut own[..keys.len()];
            for ((own, key), episode) in own.iter_mut().zip(keys).zip(episodes) {
                *own = Streams::of(*key, occasion).environment(0, *episode);
            }
            let first = part * AT_ONCE;
            for (k, entry) in self.entries.iter().enumerate() {
                let row = &mut table.row_mut(k)[first..first + own.len()];
                match entry.part_in(occasion) {
                    Part::Drawn if !entry.grouped => Arch::new().dispatch(Alone { entry, keys: own, row, level }),
                    Part::Nominal => row.fill(entry.nominal),
                    Part::Drawn | Part::None => {}
                }
            }
            for group in self.drawn_groups(occasion) {
                Arch::new().dispatch(Together { entries: &self.entries, group, keys: own, table, first, level });
            }
        }
    }

    fn drawn_groups(&self, occasion: Occasion) -> impl Iterator<Item = &Group> {
        self.groups.iter().filter(move |group| self.entries[group.members[0]].part_in(occasion) == Part::Drawn)
    }
}

/// Whose turn it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turn {
    /// Number of the environment.
    pub environment: u64,
    /// Number of its episode.
    pub episode: u64,
}

#[cfg(test)]
#[path = "randomizer_tests.rs"]
mod tests;
