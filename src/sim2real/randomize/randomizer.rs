//! Draws for many environments at once.

use pulp::{Arch, NullaryFnOnce};

use super::correlation::{Correlation, CorrelationError, Group, groups};
use super::distribution::{Inverse, open, uniform_at};
use super::level::Level;
use super::normal::{AT_ONCE, normal_parts, normal_quantile, normal_quantiles};
use super::stream::{DrawKey, Occasion, Streams, name_key, uniform};
use super::{DrawTable, Implausible, Randomized, Redraw, Target};
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

/// A parameter made ready for many draws.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    key: u64,
    inverse: Inverse,
    /// What a draw is multiplied by: the nominal value of a relative one.
    factor: f64,
    nominal: f64,
    way: Way,
    at: Redraw,
    /// Whether it is drawn with others.
    grouped: bool,
}

/// How a value goes from nominal to what was drawn as the level rises.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// On a straight line.
    Straight,
    /// By factors: the logarithm goes on a straight line.
    ByFactors,
    /// From infinity, where a limit does nothing: the inverse goes on a straight line.
    FromInfinity,
    /// At once, with a probability as large as the level: between two choices there is nothing.
    AtOnce { key: u64 },
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
                Part::Drawn if !entry.grouped => entry.fill(&keys, table.row_mut(k), level),
                Part::Nominal => table.row_mut(k).fill(entry.nominal),
                Part::Drawn | Part::None => {}
            }
        }
        for group in self.drawn_groups(occasion) {
            Arch::new().dispatch(Together { entries: &self.entries, group, keys: &keys, table, level });
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

    fn drawn_groups(&self, occasion: Occasion) -> impl Iterator<Item = &Group> {
        self.groups.iter().filter(move |group| self.entries[group.members[0]].part_in(occasion) == Part::Drawn)
    }
}

/// Draws for the members of a group and the environments of `keys`, with the widest vectors of the processor: what is not inlined into it
/// is compiled without.
struct Together<'a> {
    entries: &'a [Entry],
    group: &'a Group,
    keys: &'a [u64],
    table: &'a mut DrawTable,
    level: Level,
}

impl NullaryFnOnce for Together<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { entries, group, keys, table, level } = self;
        let mut normal = vec![[0.0; AT_ONCE]; group.members.len()];
        for (part, keys) in keys.chunks(AT_ONCE).enumerate() {
            for (z, k) in normal.iter_mut().zip(&group.members) {
                entries[*k].standard(keys, &mut z[..keys.len()]);
            }
            group.correlate(&mut normal);
            for (k, z) in group.members.iter().zip(&mut normal) {
                let row = &mut table.row_mut(*k)[part * AT_ONCE..][..keys.len()];
                entries[*k].fill_by_normal(keys, &mut z[..keys.len()], row, level);
            }
        }
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

/// What an occasion does to a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Drawn,
    Nominal,
    None,
}

/// How the value of a parameter goes from nominal to what is drawn.
fn way(one: &Randomized, name: &str) -> Way {
    let nominal = one.parameter.nominal;
    match &one.distribution {
        super::Distribution::Choice { .. } => Way::AtOnce { key: name_key(&format!("{name}, whether at all")) },
        _ if nominal.is_infinite() => Way::FromInfinity,
        distribution if distribution.by_factors() && nominal > 0.0 => Way::ByFactors,
        _ => Way::Straight,
    }
}

impl Entry {
    fn part_in(&self, occasion: Occasion) -> Part {
        match (self.at, occasion) {
            (Redraw::Startup, Occasion::Startup) => Part::Drawn,
            (Redraw::Reset | Redraw::EverySeconds(_) | Redraw::EverySteps(_), Occasion::Reset) => Part::Drawn,
            (Redraw::EverySeconds(_) | Redraw::EverySteps(_), Occasion::Interval(_)) => Part::Drawn,
            (Redraw::Regime(own), Occasion::Regime(entered, _)) if own == entered => Part::Drawn,
            // The regime is left, or the episode begins in none.
            (Redraw::Regime(_), Occasion::Regime(..) | Occasion::Reset) => Part::Nominal,
            _ => Part::None,
        }
    }

    /// Draws for the environments of `keys`.
    fn fill(&self, keys: &[u64], row: &mut [f64], level: Level) {
        if keys.len() == 1 || !matches!(self.inverse, Inverse::Normal { .. } | Inverse::LogNormal { .. }) {
            return self.fill_by_parts(keys, keys.iter().map(|key| uniform(*key, self.key)), row, level);
        }
        let mut normal = [0.0; AT_ONCE];
        for (row, keys) in row.chunks_mut(AT_ONCE).zip(keys.chunks(AT_ONCE)) {
            let normal = &mut normal[..keys.len()];
            self.standard(keys, normal);
            self.fill_by_normal(keys, normal, row, level);
        }
    }

    /// Standard normal numbers for the environments of up to [`AT_ONCE`] `keys`.
    #[inline(always)]
    fn standard(&self, keys: &[u64], normal: &mut [f64]) {
        normal.iter_mut().zip(keys).for_each(|(z, key)| *z = uniform(*key, self.key));
        match normal {
            [z] => *z = normal_quantile(*z),
            several => normal_quantiles(several),
        }
    }

    /// Draws for the environments of `keys`, of which the copula says these standard `normal` numbers; parts take their place where the
    /// distribution is told in parts.
    #[inline(always)]
    fn fill_by_normal(&self, keys: &[u64], normal: &mut [f64], row: &mut [f64], level: Level) {
        match &self.inverse {
            Inverse::Normal { mean, std } => {
                self.fill_with(keys, normal.iter().map(|z| mean + std * z), row, level);
            }
            inverse if inverse.takes_normal() => {
                self.fill_with(keys, normal.iter().map(|z| inverse.at_normal(*z)), row, level);
            }
            _ => {
                normal_parts(normal);
                self.fill_by_parts(keys, normal.iter().map(|part| open(*part)), row, level);
            }
        }
    }

    /// Draws for the environments of `keys`, below which these parts of all draws lie.
    #[inline(always)]
    fn fill_by_parts(&self, keys: &[u64], parts: impl Iterator<Item = f64>, row: &mut [f64], level: Level) {
        // What is asked once a row need not be asked once a value.
        match &self.inverse {
            &Inverse::Uniform { low, high } => {
                self.fill_with(keys, parts.map(|u| uniform_at(u, low, high)), row, level);
            }
            other => self.fill_with(keys, parts.map(|u| other.at(u)), row, level),
        }
    }

    /// Makes what was `drawn` for the environments of `keys` values at `level`.
    #[inline(always)]
    fn fill_with(&self, keys: &[u64], drawn: impl Iterator<Item = f64>, row: &mut [f64], level: Level) {
        if level == Level::FULL {
            let factor = self.factor;
            row.iter_mut().zip(drawn).for_each(|(to, drawn)| *to = drawn * factor);
            return;
        }
        for ((to, drawn), key) in row.iter_mut().zip(drawn).zip(keys) {
            *to = self.levelled(*key, drawn, level);
        }
    }

    /// The value at `level` where `drawn` is that at the full one.
    #[inline]
    fn levelled(&self, key: u64, drawn: f64, level: Level) -> f64 {
        let (full, part) = (drawn * self.factor, level.get());
        if part >= 1.0 {
            return full;
        }
        if part <= 0.0 {
            return self.nominal;
        }
        match self.way {
            Way::Straight => between(self.nominal, full, (1.0 - part) * self.nominal + part * full),
            Way::ByFactors if full > 0.0 => {
                let way = (1.0 - part) * self.nominal.ln() + part * full.ln();
                between(self.nominal, full, way.exp())
            }
            Way::ByFactors => between(self.nominal, full, (1.0 - part) * self.nominal + part * full),
            Way::FromInfinity => full / part,
            Way::AtOnce { key: own } => {
                if uniform(key, own) < part {
                    full
                } else {
                    self.nominal
                }
            }
        }
    }
}

/// `value`, which rounding may not lead beyond what it lies between.
fn between(one: f64, other: f64, value: f64) -> f64 {
    value.clamp(one.min(other), one.max(other))
}

#[cfg(test)]
#[path = "randomizer_tests.rs"]
mod tests;
