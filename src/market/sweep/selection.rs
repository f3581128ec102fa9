//! Which run of many is the best, and how much of that is luck.

use crate::io::{SweepGoal, SweepSection};

use super::Trial;
use crate::market::metric;

/// The runs that have the section's metric, the best first; of equals the one that was tried first.
#[must_use]
pub fn ranked<'t>(section: &SweepSection, trials: &'t [Trial]) -> Vec<(&'t Trial, f64)> {
    let mut all: Vec<(&Trial, f64)> =
        trials.iter().filter_map(|trial| Some((trial, trial.outcome.figure(&section.metric)?))).collect();
    let sign = match section.goal {
        SweepGoal::Max => -1.0,
        SweepGoal::Min => 1.0,
    };
    all.sort_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1)).then(a.0.index.cmp(&b.0.index)));
    all
}

/// The best run, where one has the section's metric.
#[must_use]
pub fn best<'t>(section: &SweepSection, trials: &'t [Trial]) -> Option<(&'t Trial, f64)> {
    ranked(section, trials).into_iter().next()
}

/// The probability that the best Sharpe ratio of so many is more than luck: the deflated Sharpe ratio of `best` among
/// `trials`.
///
/// Source: Bailey and Lopez de Prado, "The deflated Sharpe ratio: correcting for selection bias, backtest overfitting and
/// non-normality", Journal of Portfolio Management 40 (2014).
///
/// Ratios and moments are those of daily returns; runs that failed count for nothing.
#[must_use]
pub(super) fn deflated_sharpe(best: &Trial, trials: &[Trial]) -> Option<f64> {
    let of = |trial: &Trial, figure: &str| trial.outcome.figure(figure);
    let sharpes: Vec<f64> = trials.iter().filter_map(|trial| of(trial, "daily_sharpe")).collect();
    let count = sharpes.len() as f64;
    let mean = sharpes.iter().sum::<f64>() / count;
    let variance = sharpes.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / (count - 1.0).max(1.0);
    let (skewness, kurtosis) = (of(best, "skewness")?, of(best, "kurtosis")?);
    let days = of(best, "daily_returns")? as usize;
    metric::deflated_sharpe(of(best, "daily_sharpe")?, days, skewness, kurtosis, count, variance)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::Outcome;
    use super::*;
    use crate::io::SweepMethod;

    #[test]
    fn the_best_comes_first_and_of_equals_the_earlier() {
        let trial = |index: usize, value: Option<f64>| Trial {
            index,
            values: BTreeMap::new(),
            seed: 0,
            hash: String::new(),
            outcome: Outcome::Done { metrics: value.map(|v| ("sharpe".to_owned(), v)).into_iter().collect() },
        };
        let trials = [trial(0, Some(1.0)), trial(1, None), trial(2, Some(2.0)), trial(3, Some(2.0)), trial(4, Some(-1.0))];
        let section = |goal| SweepSection {
            method: SweepMethod::Grid,
            runs: None,
            seed: None,
            metric: "sharpe".into(),
            goal,
            ranges: Vec::new(),
            walk_forward: None,
        };
        let order = |goal| ranked(&section(goal), &trials).iter().map(|(trial, _)| trial.index).collect::<Vec<_>>();
        assert_eq!(order(SweepGoal::Max), [2, 3, 0, 4]);
        assert_eq!(order(SweepGoal::Min), [4, 0, 2, 3]);
        assert!(best(&section(SweepGoal::Max), &trials[1..2]).is_none());
    }
}
