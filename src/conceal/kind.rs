//! What kinds of cases there are, and how many of each.

use serde::{Deserialize, Serialize};

/// What a case is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// One effect.
    Single,
    /// Two effects.
    Pair,
    /// Nothing but noise and parameters that are off.
    Null(Null),
    /// An effect that no registry has.
    Outside,
    /// An effect that the recording to learn from never reaches.
    NotExcited,
}

/// What makes a case in which nothing is concealed look like one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Null {
    /// White noise.
    White,
    /// Noise that remembers.
    Coloured,
    /// Noise below a step of the sensor.
    Quantized,
    /// White noise, and a twin further off than usual.
    MisSet,
    /// Motion as a coarse integrator computes it.
    Coarse,
    /// Noise with heavy tails.
    HeavyTailed,
    /// Decisions that foretell where the market goes.
    Alpha,
    /// Stamps rounded to a second.
    Rounded,
}

impl Null {
    /// Whether it is made to mislead.
    #[must_use]
    pub fn adversarial(self) -> bool {
        !matches!(self, Self::White | Self::MisSet)
    }
}

/// Cases of each kind in a hundred: one effect, two, none, outside any registry, not excited.
pub const MIX: [usize; 5] = [45, 20, 15, 12, 8];

/// The kind of each place in a hundred, none of which gather, and how many of that kind stand before it.
pub(in crate::conceal) fn planned(index: usize) -> (usize, usize) {
    // Every stretch of cases holds about its share of each kind (largest remainder), so that a run cut short is fair too.
    let mut counts = [0_usize; MIX.len()];
    let mut kind = 0;
    for place in 0..=(index % 100) {
        let lag = |k: usize| MIX[k] as i64 * (place as i64 + 1) - 100 * counts[k] as i64;
        kind = (0..MIX.len()).max_by_key(|k| (lag(*k), usize::MAX - k)).unwrap_or(0);
        counts[kind] += 1;
    }
    (kind, counts[kind] - 1 + (index / 100) * MIX[kind])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hundred_cases_are_mixed_exactly_and_any_few_nearly() {
        for start in [0, 100, 300] {
            let mut counts = [0; 5];
            for index in start..start + 100 {
                counts[planned(index).0] += 1;
            }
            assert_eq!(counts, MIX);
        }
        let kinds: Vec<usize> = (0..20).map(|i| planned(i).0).collect();
        assert_eq!((0..5).map(|k| kinds.iter().filter(|kind| **kind == k).count()).collect::<Vec<_>>(), [9, 4, 3, 2, 2]);
        assert_eq!((planned(100).1, planned(0).1), (45, 0));
    }
}
