//! What was drawn so far, in a few numbers a parameter.

use std::collections::VecDeque;

use serde::Serialize;

use super::{DrawTable, Target};

/// Statistics of all that was drawn, and the last draws; its size does not grow with their number.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawHistory {
    keep: usize,
    rows: Vec<(Target, Drawn)>,
}

/// The draws of one parameter.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Drawn {
    /// How many.
    pub count: u64,
    /// Their mean; 0 where there is none.
    pub mean: f64,
    /// Their least; infinite where there is none.
    pub min: f64,
    /// Their largest; minus infinite where there is none.
    pub max: f64,
    /// The last of them, the oldest first.
    pub last: VecDeque<f64>,
    /// Sum of squared distances from the mean.
    #[serde(skip)]
    squares: f64,
}

impl Drawn {
    /// Their standard deviation (of a sample, over n - 1); 0 of fewer than two.
    #[must_use]
    pub fn std(&self) -> f64 {
        if self.count < 2 { 0.0 } else { (self.squares / (self.count - 1) as f64).sqrt() }
    }

    /// Takes in one more; source: Welford, "Note on a method for calculating corrected sums of squares and products",
    /// Technometrics 4 (1962).
    fn take(&mut self, value: f64, keep: usize) {
        self.count += 1;
        let off = value - self.mean;
        self.mean += off / self.count as f64;
        self.squares += off * (value - self.mean);
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        if keep == 0 {
            return;
        }
        if self.last.len() == keep {
            self.last.pop_front();
        }
        self.last.push_back(value);
    }
}

impl DrawHistory {
    /// A history that keeps the last `keep` draws of each parameter.
    #[must_use]
    pub fn new(keep: usize) -> Self {
        Self { keep, rows: Vec::new() }
    }

    /// Takes in the draws of these environments. A value that is infinite, a limit that is never reached, is no number to add
    /// up, and is left out.
    pub fn record(&mut self, table: &DrawTable, environments: std::ops::Range<usize>) {
        for (k, target) in table.targets().iter().enumerate() {
            let at = self.rows.iter().position(|(known, _)| known == target).unwrap_or_else(|| {
                let drawn = Drawn { min: f64::INFINITY, max: f64::NEG_INFINITY, ..Drawn::default() };
                self.rows.push((target.clone(), drawn));
                self.rows.len() - 1
            });
            let values = &table.row(k)[environments.clone()];
            values.iter().filter(|v| v.is_finite()).for_each(|v| self.rows[at].1.take(*v, self.keep));
        }
    }

    /// What was drawn, parameter by parameter.
    pub fn rows(&self) -> impl Iterator<Item = (&Target, &Drawn)> {
        self.rows.iter().map(|(target, drawn)| (target, drawn))
    }

    /// What was drawn of one parameter.
    #[must_use]
    pub fn of(&self, target: &Target) -> Option<&Drawn> {
        self.rows().find(|(other, _)| *other == target).map(|(_, drawn)| drawn)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Distribution, Level, Randomized, Randomizer, Redraw};
    use super::*;
    use crate::sim2real::{Parameter, Seed};

    #[test]
    fn statistics_are_those_of_all_draws_and_memory_is_bounded() {
        let one = Randomized {
            target: Target::own("mass"),
            parameter: Parameter::new("mass", "kg", 1.0),
            distribution: Distribution::Uniform { low: 1e6, high: 1e6 + 2.0 },
            relative: false,
            at: Redraw::Reset,
        };
        let randomizer = Randomizer::new(vec![one], Vec::new()).unwrap();
        let mut history = DrawHistory::new(10);
        let mut all = Vec::new();
        for episode in 0..50 {
            let table = randomizer.begin(Seed(1), 0, 20, episode, Level::FULL);
            history.record(&table, 5..20);
            all.extend_from_slice(&table.row(0)[5..]);
        }
        let drawn = history.of(&Target::own("mass")).unwrap();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let std = (all.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (all.len() - 1) as f64).sqrt();
        assert_eq!(drawn.count, 750);
        // Of large numbers with a small spread, sums of squares would have lost it.
        assert!((drawn.mean - mean).abs() < 1e-6 && (drawn.std() - std).abs() < 1e-6, "{} {}", drawn.std(), std);
        assert_eq!(drawn.min, all.iter().copied().fold(f64::INFINITY, f64::min));
        assert_eq!(drawn.max, all.iter().copied().fold(f64::NEG_INFINITY, f64::max));
        assert_eq!(drawn.last.iter().copied().collect::<Vec<_>>(), all[740..]);
        assert_eq!(history.of(&Target::own("none")), None);
    }
}
