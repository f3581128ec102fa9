//! Bayesian online change points: how long it has been since the last change, as probabilities.

use serde::{Deserialize, Serialize};

use super::runs::{Runs, peak};
use super::{Hazard, Prior, RegimeError};

/// Numbers of rows up to which constants of the law are kept.
const KEPT_PEAKS: u32 = 2_048;

/// What is assumed of changes, and how much is kept of what could be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Assumed {
    /// What a stretch may look like.
    pub prior: Prior,
    /// How often there are changes.
    pub hazard: Hazard,
    /// Run lengths with less probability than this are dropped, 0 or above.
    pub least: f64,
    /// Most run lengths that are kept, from 2: the likeliest. It bounds memory and time a row.
    pub most: usize,
}

impl Assumed {
    /// A change every `interval` rows on average, of what `prior` says; at most 200 run lengths of probability 1e-8 or more.
    #[must_use]
    pub fn every(interval: f64, prior: Prior) -> Self {
        Self { prior, hazard: Hazard::Constant(1.0 / interval), least: 1e-8, most: 200 }
    }
}

/// How long it has been since the last change, followed online: after each row the probabilities of all run lengths given the
/// rows so far. A run length counts the rows since the change, the latest among them: 1 means that it came just now.
///
/// A row that is NaN was lost: time goes on, and nothing is learned. Memory does not grow with the series, and a row costs as
/// much as there are run lengths of any probability.
///
/// Source: R. P. Adams and D. J. C. MacKay, *Bayesian online changepoint detection* (2007), with the change before the row and
/// not after it, so that the row is judged by what it starts; conjugate laws as in K. P. Murphy, *Conjugate Bayesian analysis
/// of the Gaussian distribution* (2007).
#[derive(Debug, Clone, PartialEq)]
pub struct RunLengths {
    assumed: Assumed,
    rows: u64,
    runs: Runs,
    /// Order of runs by probability, where some must go.
    order: Vec<usize>,
    /// Logarithm of the density at the mean, but for the scale, by the number of rows seen.
    peaks: Vec<f64>,
    log_likelihood: f64,
}

impl RunLengths {
    /// Before the first row, which starts a run.
    ///
    /// # Errors
    /// A hazard outside of (0, 1), a prior or bounds out of range.
    pub fn new(assumed: Assumed) -> Result<Self, RegimeError> {
        assumed.prior.check()?;
        assumed.hazard.check()?;
        let least = (0.0..0.1).contains(&assumed.least);
        RegimeError::setting("least", assumed.least, least, "from 0 to 0.1, such as 1e-8")?;
        RegimeError::setting("most", assumed.most as f64, assumed.most >= 2, "a whole number from 2, such as 200")?;
        let peaks = match assumed.prior {
            Prior::NormalInverseGamma { strength, shape, .. } => {
                (0..KEPT_PEAKS).map(|seen| peak(strength + f64::from(seen), shape + 0.5 * f64::from(seen))).collect()
            }
            Prior::KnownVariance { .. } => vec![],
        };
        Ok(Self { assumed, rows: 0, runs: Runs::default(), order: vec![], peaks, log_likelihood: 0.0 })
    }

    /// Takes the next row, and gives the likeliest run length.
    ///
    /// # Errors
    /// An infinite value; nothing is changed by it.
    pub fn step(&mut self, value: f64) -> Result<u64, RegimeError> {
        self.follow(value)?;
        Ok(self.likeliest())
    }

    /// Takes the next row, and gives the start of the run that the likeliest path had before a change at this row.
    fn follow(&mut self, value: f64) -> Result<u64, RegimeError> {
        if value.is_infinite() {
            let hint = "NaN stands for a sample that was lost";
            return Err(RegimeError::NotFinite { row: self.rows as usize, found: value, hint });
        }
        let before = self.begin();
        if !value.is_nan() {
            self.weigh(value);
        }
        self.prune();
        self.rows += 1;
        Ok(before)
    }

    /// Lets every run go on or end, and a new one begin.
    fn begin(&mut self) -> u64 {
        let runs = &mut self.runs;
        let (mut changed, mut best, mut origin) = (0.0, f64::NEG_INFINITY, 0);
        for run in 0..runs.starts.len() {
            let hazard = self.assumed.hazard.after(self.rows - runs.starts[run]);
            changed += runs.probability[run] * hazard;
            runs.probability[run] *= 1.0 - hazard;
            let ended = runs.best[run] + hazard.ln();
            if ended > best {
                (best, origin) = (ended, runs.starts[run]);
            }
            runs.best[run] += (-hazard).ln_1p();
        }
        let first = runs.starts.is_empty();
        let (mean, scale) = match self.assumed.prior {
            Prior::NormalInverseGamma { mean, scale, .. } => (mean, scale),
            Prior::KnownVariance { mean, .. } => (mean, 1.0),
        };
        runs.starts.push(self.rows);
        runs.seen.push(0.0);
        runs.mean.push(mean);
        runs.scale.push(scale);
        runs.log_scale.push(scale.ln());
        runs.probability.push(if first { 1.0 } else { changed });
        runs.best.push(if first { 0.0 } else { best });
        origin
    }

    /// Weighs runs by how well each had foretold `value`, and lets each learn of it.
    fn weigh(&mut self, value: f64) {
        let runs = &mut self.runs;
        // Probabilities are logarithms until the largest is known.
        let mut peak = f64::NEG_INFINITY;
        for run in 0..runs.starts.len() {
            let foretold = match self.assumed.prior {
                Prior::NormalInverseGamma { strength, shape, .. } => runs.learn(run, value, strength, shape, &self.peaks),
                Prior::KnownVariance { spread, variance, .. } => runs.learn_mean(run, value, spread, variance),
            };
            runs.best[run] += foretold;
            runs.probability[run] = runs.probability[run].ln() + foretold;
            peak = peak.max(runs.probability[run]);
        }
        let mut sum = 0.0;
        for probability in &mut runs.probability {
            *probability = (*probability - peak).exp();
            sum += *probability;
        }
        self.log_likelihood += peak + sum.ln();
        runs.probability.iter_mut().for_each(|p| *p /= sum);
    }

    /// Drops runs that hardly can be.
    fn prune(&mut self) {
        let Assumed { least, most, .. } = self.assumed;
        let runs = &mut self.runs;
        let mut bound = least;
        if runs.starts.len() > most {
            self.order.clear();
            self.order.extend(0..runs.starts.len());
            let probability = &runs.probability;
            let (_, last, _) =
                self.order.select_nth_unstable_by(most - 1, |a, b| probability[*b].total_cmp(&probability[*a]));
            bound = bound.max(probability[*last]);
        }
        let mut kept = 0;
        for run in 0..runs.starts.len() {
            // Of equal ones the longest stay.
            if runs.probability[run] >= bound && kept < most {
                runs.shift(run, kept);
                kept += 1;
            }
        }
        if kept < runs.starts.len() {
            runs.truncate(kept);
            let sum: f64 = runs.probability.iter().sum();
            runs.probability.iter_mut().for_each(|p| *p /= sum);
        }
    }

    /// Run lengths [rows] that may be, the longest first, with their probabilities: their sum is 1.
    pub fn posterior(&self) -> impl Iterator<Item = (u64, f64)> + '_ {
        self.runs.starts.iter().zip(&self.runs.probability).map(|(start, p)| (self.rows - start, *p))
    }

    /// Probability that a change came within the last `rows` rows: that a run began in one of them. The first row is one,
    /// for it was not known what there was before.
    #[must_use]
    pub fn change_within(&self, rows: u64) -> f64 {
        self.posterior().filter(|(run, _)| *run <= rows).map(|(_, p)| p).sum::<f64>().min(1.0)
    }

    /// The likeliest run length [rows], of equal ones the longest; 0 before the first row.
    #[must_use]
    pub fn likeliest(&self) -> u64 {
        let (mut run, mut most) = (0, 0.0);
        for (length, probability) in self.posterior() {
            if probability > most {
                (run, most) = (length, probability);
            }
        }
        run
    }

    /// Expected mean of the run that is under way, over all run lengths.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.runs.mean.iter().zip(&self.runs.probability).map(|(mean, p)| mean * p).sum()
    }

    /// Logarithm of the density of all rows so far.
    #[must_use]
    pub fn log_likelihood(&self) -> f64 {
        self.log_likelihood
    }

    /// Number of run lengths that are kept.
    #[must_use]
    pub fn kept(&self) -> usize {
        self.runs.starts.len()
    }

    /// The likeliest set of changes in a whole series: rows at which a new stretch begins, ascending (the first row is none).
    /// It is the maximum over all sets of changes whose run lengths were never dropped. It looks ahead.
    ///
    /// # Errors
    /// As [`Self::new`]; an infinite value; an empty series.
    pub fn changes(assumed: Assumed, series: &[f64]) -> Result<Vec<usize>, RegimeError> {
        if series.is_empty() {
            return Err(RegimeError::TooShort { what: "change points", found: 0, needed: 1 });
        }
        let mut lengths = Self::new(assumed)?;
        let before = series.iter().map(|value| lengths.follow(*value)).collect::<Result<Vec<u64>, _>>()?;
        let runs = &lengths.runs;
        let last = runs
            .best
            .iter()
            .zip(&runs.starts)
            .fold((f64::NEG_INFINITY, 0), |best, (of, start)| if *of > best.0 { (*of, *start) } else { best });
        let mut changes = vec![];
        let mut start = last.1 as usize;
        while start > 0 {
            changes.push(start);
            start = before[start] as usize;
        }
        changes.reverse();
        Ok(changes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Seed;
    use proptest::prelude::*;
    use rand_distr::{Distribution, StandardNormal};
    use statrs::distribution::{Continuous, StudentsT};

    fn noise(rows: usize, seed: u64) -> Vec<f64> {
        let mut draws = Seed(seed).stream("noise");
        (0..rows).map(|_| StandardNormal.sample(&mut *draws)).collect()
    }

    /// Probabilities of all run lengths, from the definitions: every run's evidence anew, nothing dropped.
    fn by_definition(series: &[f64], hazard: f64, prior: (f64, f64, f64, f64)) -> Vec<f64> {
        let (mean0, strength0, shape0, scale0) = prior;
        let foretell = |seen: &[f64], value: f64| {
            let count = seen.len() as f64;
            let mean = if seen.is_empty() { 0.0 } else { seen.iter().sum::<f64>() / count };
            let squares: f64 = seen.iter().map(|x| (x - mean).powi(2)).sum();
            let known = strength0 + count;
            let center = (strength0 * mean0 + count * mean) / known;
            let shape = shape0 + 0.5 * count;
            let scale = scale0 + 0.5 * squares + 0.5 * strength0 * count * (mean - mean0).powi(2) / known;
            let width = (scale * (known + 1.0) / (shape * known)).sqrt();
            StudentsT::new(center, width, 2.0 * shape).unwrap().pdf(value)
        };
        let mut joint = vec![1.0];
        for (row, value) in series.iter().enumerate() {
            if row > 0 {
                let changed: f64 = joint.iter().sum::<f64>() * hazard;
                joint.iter_mut().for_each(|p| *p *= 1.0 - hazard);
                joint.push(changed);
            }
            for (start, weight) in joint.iter_mut().enumerate() {
                *weight *= foretell(&series[start..row], *value);
            }
        }
        let sum: f64 = joint.iter().sum();
        joint.into_iter().map(|p| p / sum).collect()
    }

    #[test]
    fn probabilities_are_those_of_the_definition() {
        let mut series = noise(60, 3);
        series.iter_mut().skip(35).for_each(|x| *x = 3.0 + 0.5 * *x);
        let prior = Prior::NormalInverseGamma { mean: 0.5, strength: 0.2, shape: 1.5, scale: 0.8 };
        let assumed = Assumed { prior, hazard: Hazard::Constant(0.05), least: 0.0, most: 1_000 };
        let mut lengths = RunLengths::new(assumed).unwrap();
        for (row, value) in series.iter().enumerate() {
            lengths.step(*value).unwrap();
            let expected = by_definition(&series[..=row], 0.05, (0.5, 0.2, 1.5, 0.8));
            for ((_, p), expected) in lengths.posterior().zip(expected) {
                assert!((p - expected).abs() < 1e-9, "row {row}: {p} and {expected}");
            }
        }
        assert!((24..=27).contains(&lengths.likeliest()), "{}", lengths.likeliest());
        let (soon, earlier) = (lengths.change_within(20), lengths.change_within(30));
        assert!(soon < 0.2 && earlier > 0.9, "{soon}, {earlier}");
    }

    #[test]
    fn what_is_dropped_hardly_matters() {
        let mut series = noise(3_000, 4);
        series.iter_mut().skip(1_000).for_each(|x| *x += 4.0);
        series.iter_mut().skip(2_000).for_each(|x| *x = 4.0 + 5.0 * (*x - 4.0));
        let assumed = Assumed::every(500.0, Prior::weak(0.0, 1.0));
        let changes = RunLengths::changes(assumed.clone(), &series).unwrap();
        let all = Assumed { least: 0.0, most: 10_000, ..assumed.clone() };
        assert_eq!(RunLengths::changes(all.clone(), &series).unwrap(), changes);
        assert!(changes.len() == 2 && changes[0] == 1_000 && changes[1].abs_diff(2_000) < 5, "{changes:?}");
        let (mut few, mut many) = (RunLengths::new(assumed).unwrap(), RunLengths::new(all).unwrap());
        let (mut most, mut apart) = (0, 0.0_f64);
        for value in &series {
            few.step(*value).unwrap();
            many.step(*value).unwrap();
            most = most.max(few.kept());
            apart = apart.max((few.change_within(50) - many.change_within(50)).abs());
        }
        assert!(apart < 1e-3, "{apart}");
        assert!(most <= 200, "{most}");
        assert_eq!(many.kept(), 3_000);
    }

    /// The sum over all sets of changes of a short series, and the best of them, one after the other.
    #[test]
    fn the_likeliest_changes_are_the_best_of_all_sets() {
        let prior = Prior::KnownVariance { mean: 0.0, spread: 4.0, variance: 0.5 };
        let hazard = Hazard::ByLength(vec![0.02, 0.1, 0.2]);
        let assumed = Assumed { prior, hazard: hazard.clone(), least: 0.0, most: 100 };
        let series = [0.3, -0.2, 2.1, 1.9, f64::NAN, 2.4, -1.0, -0.8, -1.2];
        // Density of a stretch: a Gaussian vector, through its rows in turn.
        let stretch = |values: &[f64]| {
            let (mut mean, mut spread, mut log) = (0.0, 4.0, 0.0);
            for value in values.iter().filter(|v| !v.is_nan()) {
                let total: f64 = spread + 0.5;
                log += -0.5 * ((std::f64::consts::TAU * total).ln() + (value - mean).powi(2) / total);
                mean += (value - mean) * spread / total;
                spread = 1.0 / (1.0 / spread + 2.0);
            }
            log
        };
        let (mut sum, mut best) = (0.0, (f64::NEG_INFINITY, vec![]));
        for set in 0..1_u32 << 8 {
            let changes: Vec<usize> = (1..9).filter(|row| set >> (row - 1) & 1 == 1).collect();
            let bounds: Vec<usize> = [0].into_iter().chain(changes.iter().copied()).chain([9]).collect();
            let mut log: f64 = bounds.windows(2).map(|w| stretch(&series[w[0]..w[1]])).sum();
            for w in bounds.windows(2) {
                log += (1..w[1] - w[0]).map(|run| (-hazard.after(run as u64)).ln_1p()).sum::<f64>();
                log += if w[1] < 9 { hazard.after((w[1] - w[0]) as u64).ln() } else { 0.0 };
            }
            sum += log.exp();
            if log > best.0 {
                best = (log, changes);
            }
        }
        assert_eq!(RunLengths::changes(assumed.clone(), &series).unwrap(), best.1);
        let mut lengths = RunLengths::new(assumed).unwrap();
        series.iter().for_each(|x| assert!(lengths.step(*x).unwrap() > 0));
        assert!((lengths.log_likelihood() - sum.ln()).abs() < 1e-10);
    }

    #[test]
    fn settings_and_values_out_of_range() {
        let prior = Prior::weak(0.0, 1.0);
        for hazard in [0.0, 1.0, -0.1, f64::NAN] {
            let assumed = Assumed { hazard: Hazard::Constant(hazard), ..Assumed::every(100.0, prior) };
            let told = RunLengths::new(assumed).unwrap_err().to_string();
            assert!(told.contains("hazard = ") && told.contains("hint: between 0 and 1"), "{told}");
        }
        let none = Assumed { hazard: Hazard::ByLength(vec![]), ..Assumed::every(100.0, prior) };
        assert!(RunLengths::new(none).is_err());
        assert!(RunLengths::new(Assumed::every(100.0, Prior::weak(0.0, 0.0))).is_err());
        assert!(RunLengths::new(Assumed { most: 1, ..Assumed::every(100.0, prior) }).is_err());
        assert!(RunLengths::new(Assumed { least: 0.5, ..Assumed::every(100.0, prior) }).is_err());
        let assumed = Assumed::every(100.0, prior);
        assert!(matches!(RunLengths::changes(assumed.clone(), &[]), Err(RegimeError::TooShort { .. })));
        let infinite = RunLengths::changes(assumed.clone(), &[1.0, f64::INFINITY]);
        assert!(matches!(infinite, Err(RegimeError::NotFinite { row: 1, .. })));
        // A constant never changes, and nothing breaks.
        assert_eq!(RunLengths::changes(assumed, &[2.0; 500]).unwrap(), Vec::<usize>::new());
    }

    proptest! {
        /// What is said of a row does not depend on the rows after it.
        #[test]
        fn the_future_changes_nothing(
            past in prop::collection::vec(-5.0..5.0_f64, 1..80),
            one in prop::collection::vec(-50.0..50.0_f64, 1..20),
            other in prop::collection::vec(-50.0..50.0_f64, 1..20),
        ) {
            let assumed = Assumed { most: 30, ..Assumed::every(20.0, Prior::weak(0.0, 1.0)) };
            let follow = |future: &[f64]| {
                let mut lengths = RunLengths::new(assumed.clone()).unwrap();
                let all = past.iter().chain(future);
                let said = all.map(|x| { lengths.step(*x).unwrap(); lengths.posterior().map(|(r, p)| (r, p.to_bits())).collect::<Vec<_>>() });
                said.take(past.len()).collect::<Vec<_>>()
            };
            prop_assert_eq!(follow(&one), follow(&other));
        }
    }
}
