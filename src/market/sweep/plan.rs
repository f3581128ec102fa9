//! Which values are tried, in which order.

use std::collections::BTreeSet;

use rand::RngExt;
use toml::Value;

use crate::io::{SweepMethod, SweepSection};
use crate::sim2real::Seed;

/// The values of one run, by path.
pub type Values = Vec<(String, Value)>;

/// The values of all runs of `section`, in order. Of a grid the last range goes fastest; what a random search draws depends
/// on `seed`, the number of the run and the path alone, so that more runs leave the first ones as they are.
///
/// Where a range is over `strategy.kind`, values that a kind has no parameter for (`belongs`) are left out, and what then is
/// the same as an earlier run is tried once.
#[must_use]
pub fn plan(section: &SweepSection, seed: u64, belongs: &dyn Fn(&str, &str) -> bool) -> Vec<Values> {
    let seed = Seed(section.seed.unwrap_or(seed)).child("sweep");
    let grids: Vec<Vec<Value>> = section.ranges.iter().map(|range| range.grid().unwrap_or_default()).collect();
    let count = match section.method {
        SweepMethod::Grid => grids.iter().map(Vec::len).product(),
        SweepMethod::Random => section.runs.unwrap_or(0),
    };
    let mut seen = BTreeSet::new();
    let all = (0..count).map(|index| match section.method {
        SweepMethod::Grid => combination(section, &grids, index),
        SweepMethod::Random => draw(section, seed.child(&index.to_string())),
    });
    all.map(|values| fitting(values, belongs)).filter(|values| seen.insert(format!("{values:?}"))).collect()
}

fn combination(section: &SweepSection, grids: &[Vec<Value>], index: usize) -> Values {
    let mut rest = index;
    let mut values: Values = section
        .ranges
        .iter()
        .zip(grids)
        .rev()
        .map(|(range, grid)| {
            let value = grid[rest % grid.len()].clone();
            rest /= grid.len();
            (range.path.clone(), value)
        })
        .collect();
    values.reverse();
    values
}

fn draw(section: &SweepSection, seed: Seed) -> Values {
    let one = |range: &crate::io::SweepRange| (range.path.clone(), range.at(seed.stream(&range.path).random::<f64>()));
    section.ranges.iter().map(one).collect()
}

fn fitting(values: Values, belongs: &dyn Fn(&str, &str) -> bool) -> Values {
    let kind =
        values.iter().find(|(path, _)| path == "strategy.kind").and_then(|(_, kind)| kind.as_str().map(str::to_owned));
    let Some(kind) = kind else { return values };
    let fits = |path: &str| path.strip_prefix("strategy.").is_none_or(|key| key == "kind" || belongs(&kind, key));
    values.into_iter().filter(|(path, _)| fits(path)).collect()
}
