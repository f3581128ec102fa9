//! Whether confidences are probabilities.

use serde::{Deserialize, Serialize};

use super::score::Entry;

/// Confidences beside how often names of such a confidence are right.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reliability {
    /// Bins of equal width; empty ones left out.
    pub bins: Vec<Bin>,
    /// Expected calibration error: the mean distance of confidence and share, weighed by names (Guo et al. 2017, "On
    /// calibration of modern neural networks").
    pub error: Option<f64>,
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

impl Reliability {
    /// Of every name in every diagnosis.
    #[must_use]
    pub fn of(entries: &[Entry]) -> Self {
        let mut sums = [(0.0, 0_usize, 0_usize); BINS];
        for entry in entries {
            for found in entry.trial.found.iter().filter(|found| !entry.tolerates(&found.mechanism)) {
                let bin = &mut sums[((found.confidence * BINS as f64) as usize).min(BINS - 1)];
                bin.0 += found.confidence;
                bin.1 += usize::from(entry.conceals(&found.mechanism));
                bin.2 += 1;
            }
        }
        let of: usize = sums.iter().map(|(_, _, count)| count).sum();
        let bins: Vec<Bin> = sums
            .iter()
            .filter(|(_, _, count)| *count > 0)
            .map(|(sum, right, count)| Bin {
                confidence: sum / *count as f64,
                right: *right as f64 / *count as f64,
                count: *count,
            })
            .collect();
        let distance: f64 = bins.iter().map(|bin| bin.count as f64 * (bin.confidence - bin.right).abs()).sum();
        Self { error: (of > 0).then(|| distance / of as f64), bins, of }
    }
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
}
