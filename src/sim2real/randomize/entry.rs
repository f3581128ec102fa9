//! A randomized parameter made ready for many draws, and the draws for many environments side by side.

use pulp::NullaryFnOnce;

use super::correlation::Group;
use super::distribution::{Inverse, log_uniform_at, open, uniform_at, within};
use super::level::Level;
use super::normal::{AT_ONCE, normal_parts, normal_quantile, normal_quantiles};
use super::stream::{Occasion, name_key, uniform};
use super::{Distribution, DrawTable, Randomized, Redraw};
use crate::sim2real::elementary::{exp, ln_1p};

/// A parameter made ready for many draws.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub key: u64,
    pub inverse: Inverse,
    /// What a draw is multiplied by: the nominal value of a relative one.
    pub factor: f64,
    pub nominal: f64,
    pub way: Way,
    pub at: Redraw,
    /// Whether it is drawn with others.
    pub grouped: bool,
}

/// How a value goes from nominal to what was drawn as the level rises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Way {
    /// On a straight line.
    Straight,
    /// By factors: the logarithm goes on a straight line.
    ByFactors,
    /// From infinity, where a limit does nothing: the inverse goes on a straight line.
    FromInfinity,
    /// At once, with a probability as large as the level: between two choices there is nothing.
    AtOnce { key: u64 },
}

/// What an occasion does to a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Drawn,
    Nominal,
    None,
}

/// How the value of a parameter goes from nominal to what is drawn.
pub(super) fn way(one: &Randomized, name: &str) -> Way {
    let nominal = one.parameter.nominal;
    match &one.distribution {
        Distribution::Choice { .. } => Way::AtOnce { key: name_key(&format!("{name}, whether at all")) },
        _ if nominal.is_infinite() => Way::FromInfinity,
        distribution if distribution.by_factors() && nominal > 0.0 => Way::ByFactors,
        _ => Way::Straight,
    }
}

impl Entry {
    pub fn part_in(&self, occasion: Occasion) -> Part {
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
    #[inline(always)]
    pub fn fill(&self, keys: &[u64], row: &mut [f64], level: Level) {
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
    pub fn standard(&self, keys: &[u64], normal: &mut [f64]) {
        normal.iter_mut().zip(keys).for_each(|(z, key)| *z = uniform(*key, self.key));
        match normal {
            [z] => *z = normal_quantile(*z),
            several => normal_quantiles(several),
        }
    }

    /// Draws for the environments of `keys`, of which the copula says these standard `normal` numbers; parts take their place where the
    /// distribution is told in parts.
    #[inline(always)]
    pub fn fill_by_normal(&self, keys: &[u64], normal: &mut [f64], row: &mut [f64], level: Level) {
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
    fn fill_by_parts(&self, keys: &[u64], mut parts: impl Iterator<Item = f64>, row: &mut [f64], level: Level) {
        // What is asked once a row need not be asked once a value.
        match &self.inverse {
            &Inverse::Uniform { low, high } => {
                self.fill_with(keys, parts.map(|u| uniform_at(u, low, high)), row, level);
            }
            &Inverse::TruncatedNormal { mean, std, cut } if keys.len() > 1 => {
                let (mut ends, mut sides) = ([0.5; AT_ONCE], [1.0; AT_ONCE]);
                for (row, keys) in row.chunks_mut(AT_ONCE).zip(keys.chunks(AT_ONCE)) {
                    for ((end, side), u) in ends.iter_mut().zip(&mut sides).zip(parts.by_ref().take(keys.len())) {
                        (*end, *side) = cut.part(u);
                    }
                    normal_quantiles(&mut ends);
                    let drawn = ends.iter().zip(&sides).map(|(z, side)| within(mean + std * side * z, cut.low, cut.high));
                    self.fill_with(keys, drawn, row, level);
                }
            }
            &Inverse::LogUniform { low, high, from, width } => {
                self.fill_with(keys, parts.map(|u| log_uniform_at(u, [low, high], from, width)), row, level);
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
        let (part, nominal, factor) = (level.get(), self.nominal, self.factor);
        let by_itself = matches!(self.way, Way::Straight | Way::ByFactors) && part > 0.0;
        if !by_itself {
            for ((to, drawn), key) in row.iter_mut().zip(drawn).zip(keys) {
                *to = self.levelled(*key, drawn, level);
            }
            return;
        }
        // Without a question for each value, and in loops of their own: compilers make vector instructions of short ones.
        row.iter_mut().zip(drawn).for_each(|(to, drawn)| *to = drawn * factor);
        if self.way == Way::Straight {
            for to in row {
                *to = straight(nominal, *to, part);
            }
        } else {
            for to in row {
                *to = by_factors(nominal, *to, part);
            }
        }
    }

    /// The value at `level` where `drawn` is that at the full one.
    #[inline]
    pub fn levelled(&self, key: u64, drawn: f64, level: Level) -> f64 {
        let (full, part) = (drawn * self.factor, level.get());
        if part >= 1.0 {
            return full;
        }
        if part <= 0.0 {
            return self.nominal;
        }
        match self.way {
            Way::Straight => straight(self.nominal, full, part),
            Way::ByFactors => by_factors(self.nominal, full, part),
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

/// The value `part` of the way from one to the other.
#[inline(always)]
fn straight(one: f64, other: f64, part: f64) -> f64 {
    between(one, other, (1.0 - part) * one + part * other)
}

/// The same by factors, of numbers above 0; from 0 on, which no factor leads to, on a straight line.
#[inline(always)]
fn by_factors(one: f64, other: f64, part: f64) -> f64 {
    let factor = (other / one).clamp(1e-300, 1e300);
    let (inverse, falls) = (1.0 / factor, factor < 1.0);
    let logarithm = ln_1p(if falls { inverse } else { factor } - 1.0);
    let way = between(one, other, one * exp(part * if falls { -logarithm } else { logarithm }));
    let line = straight(one, other, part);
    if other > 0.0 { way } else { line }
}

/// `value`, which rounding may not lead beyond what it lies between.
#[inline(always)]
fn between(one: f64, other: f64, value: f64) -> f64 {
    within(value, one.min(other), one.max(other))
}

/// Draws of a parameter alone for the environments of `keys`, as those of [`Together`] are.
pub(super) struct Alone<'a> {
    pub entry: &'a Entry,
    pub keys: &'a [u64],
    pub row: &'a mut [f64],
    pub level: Level,
}

impl NullaryFnOnce for Alone<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.entry.fill(self.keys, self.row, self.level);
    }
}

/// Draws for the members of a group and the environments of `keys`, with the widest vectors of the processor: what is not inlined into it
/// is compiled without.
pub(super) struct Together<'a> {
    pub entries: &'a [Entry],
    pub group: &'a Group,
    pub keys: &'a [u64],
    pub table: &'a mut DrawTable,
    /// The environment of the first key.
    pub first: usize,
    pub level: Level,
}

impl NullaryFnOnce for Together<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { entries, group, keys, table, first, level } = self;
        let mut normal = vec![[0.0; AT_ONCE]; group.members.len()];
        for (part, keys) in keys.chunks(AT_ONCE).enumerate() {
            for (z, k) in normal.iter_mut().zip(&group.members) {
                entries[*k].standard(keys, &mut z[..keys.len()]);
            }
            group.correlate(&mut normal);
            for (k, z) in group.members.iter().zip(&mut normal) {
                let row = &mut table.row_mut(*k)[first + part * AT_ONCE..][..keys.len()];
                entries[*k].fill_by_normal(keys, &mut z[..keys.len()], row, level);
            }
        }
    }
}
