//! Whether confidences are probabilities.

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::score::Entry;
use crate::sim2real::Seed;
use crate::sim2real::split_mix::open_unit;

/// Confidences beside how often names of such a confidence are right.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reliability {
    /// Bins of equal width; empty ones left out.
    pub bins: Vec<Bin>,
    /// Expected calibration error: the mean distance of confidence and share, weighed by names (Guo et al. 2017, "On
    /// calibration of modern neural networks").
    pub error: Option<f64>,
    /// The same of as many names that are right just as often as their confidences say: its median, and the ends between which 95 % of
    /// draws lie. The fewer names there are, the larger it is: shares of a few names scatter (Bröcker & Smith, "Increasing the
    /// reliability of reliability diagrams", Weather and Forecasting 22 (2007)).
    #[serde(default)]
    pub by_chance: Option<[f64; 3]>,
    /// Number of names.
    pub of: usize,
}

/// Names of about one confidence.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// Their mean confidence.
    pub confidence: f64,
    /// The share that is right.
    pub right: f64,
    /// How many they are.
    pub count: usize,
}

const BINS: usize = 10;
/// Draws of what chance alone makes of it.
const DRAWS: usize = 1_000;

impl Reliability {
    /// Of every name in every diagnosis.
    #[must_use]
    pub fn of(entries: &[Entry]) -> Self {
        let names: Vec<(f64, bool)> = entries
            .iter()
            .flat_map(|entry| {
                let counted = entry.trial.found.iter().filter(|found| !entry.tolerates(&found.mechanism));
                counted.map(|found| (found.confidence, entry.conceals(&found.mechanism)))
            })
            .collect();
        let bins = binned(&names);
        let error = (!names.is_empty()).then(|| error(&bins));
        Self { error, by_chance: by_chance(&names), bins, of: names.len() }
    }
}

/// Names, each with its confidence and whether it is right, in bins of which none is empty.
fn binned(names: &[(f64, bool)]) -> Vec<Bin> {
    let mut sums = [(0.0, 0_usize, 0_usize); BINS];
    for (confidence, right) in names {
        let bin = &mut sums[((confidence * BINS as f64) as usize).min(BINS - 1)];
        bin.0 += confidence;
        bin.1 += usize::from(*right);
        bin.2 += 1;
    }
    let filled = sums.into_iter().filter(|(_, _, count)| *count > 0);
    filled
        .map(|(sum, right, count)| Bin { confidence: sum / count as f64, right: right as f64 / count as f64, count })
        .collect()
}

/// The mean distance of confidence and share.
fn error(bins: &[Bin]) -> f64 {
    let of: usize = bins.iter().map(|bin| bin.count).sum();
    bins.iter().map(|bin| bin.count as f64 * (bin.confidence - bin.right).abs()).sum::<f64>() / of as f64
}

/// What that comes to where names are right by their confidences: median and 95 % interval of draws; none of no names.
fn by_chance(names: &[(f64, bool)]) -> Option<[f64; 3]> {
    if names.is_empty() {
        return None;
    }
    let mut rng = Seed(0).stream("calibration by chance");
    let mut draw = || -> f64 {
        let drawn: Vec<(f64, bool)> = names.iter().map(|(c, _)| (*c, open_unit(rng.next_u64()) < *c)).collect();
        error(&binned(&drawn))
    };
    let mut draws: Vec<f64> = (0..DRAWS).map(|_| draw()).collect();
    draws.sort_by(f64::total_cmp);
    Some([DRAWS / 2, DRAWS / 40, DRAWS - 1 - DRAWS / 40].map(|k| draws[k]))
}

#[cfg(test)]
mod tests {
    use super::super::score::tests::entry;
    use super::*;
    use crate::conceal::Kind;
    use crate::sim2real::diagnose::Verdict;

    #[test]
    fn confidence_is_held_to_how_often_it_is_right() {
        let said = |confidence, name| entry(Kind::Single, &[("bias", 5.0)], Verdict::Named, &[(name, confidence)]);
        let mut entries = vec![said(0.75, "bias"); 3];
        entries.push(said(0.75, "drift"));
        assert_eq!(Reliability::of(&entries).error, Some(0.0));
        let sure = vec![said(1.0, "bias"), said(1.0, "drift")];
        assert_eq!(Reliability::of(&sure).error, Some(0.5));
        // What a case tolerates counts neither way.
        let tolerated = vec![said(1.0, "quantization")];
        assert_eq!((Reliability::of(&tolerated).error, Reliability::of(&tolerated).of), (None, 0));
    }

    #[test]
    fn the_fewer_names_the_further_from_their_confidences_are_shares_by_chance() {
        let said = |count: usize| -> [f64; 3] {
            let entries = vec![entry(Kind::Single, &[("bias", 5.0)], Verdict::Named, &[("bias", 0.75)]); count];
            Reliability::of(&entries).by_chance.expect("there are names")
        };
        let [few, many] = [16, 1_600].map(said);
        // Half of all draws of a share of n lie within .6745 standard deviations.
        let half = |count: f64| 0.6745 * (0.75_f64 * 0.25 / count).sqrt();
        assert!((many[0] / half(1_600.0) - 1.0).abs() < 0.1, "{many:?}");
        assert!((few[0] / many[0] - 10.0).abs() < 2.0, "{few:?}");
        assert!(few[1] <= few[0] && few[0] < few[2] && few[2] < 0.3, "{few:?}");
        assert_eq!(Reliability::of(&[]).by_chance, None);
    }
}
