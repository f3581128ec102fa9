//! Volatility, Sharpe ratio and the other figures of daily returns.

use serde::Serialize;

use crate::market::EquityPoint;

use super::daily_return::{DailyReturns, closes};
use super::moment::Moments;
use super::tail::Tail;
use super::{defined, probabilistic_sharpe, sharpe_standard_error};

/// Figures of the simple returns from the last event of one day of UTC with data to that of the next, made yearly by the
/// number of such returns there were a year.
///
/// A return across more than a week without data is left out: one jump over years is no daily return. Without
/// [`Returns::FEWEST`] returns nothing is made yearly and nothing said of their distribution: over some days a Sharpe
/// ratio is mostly its own error, of `1 / sqrt(years)`.
///
/// Source: Sharpe, "The Sharpe ratio", Journal of Portfolio Management 21 (1994), with a benchmark of 0; made yearly as
/// if returns were independent, for the limits of which and for the error see Lo, Financial Analysts Journal 58 (2002).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Returns {
    /// Number of returns.
    pub daily_returns: usize,
    /// Gaps in the data of more than a week, over which no return is taken.
    pub gaps: usize,
    /// Returns a year, as there were between the gaps: what the figures are made yearly with.
    pub returns_per_year: Option<f64>,
    /// Standard deviation of returns, times the root of their number a year (a fraction).
    pub annualised_volatility: Option<f64>,
    /// Mean return over standard deviation, times the root of their number a year.
    pub sharpe: Option<f64>,
    /// The same a day, not made yearly: what [`deflated_sharpe`](super::deflated_sharpe) takes.
    pub daily_sharpe: Option<f64>,
    /// Standard error of `sharpe`, as [`sharpe_standard_error`] gives it, made yearly.
    pub sharpe_standard_error: Option<f64>,
    /// The probability that the true Sharpe ratio is above 0, as [`probabilistic_sharpe`] gives it from these returns.
    pub probabilistic_sharpe: Option<f64>,
    /// Mean return over downside deviation, times the root of the number of returns a year. The downside deviation is the
    /// root of the mean over all returns of their squares, those above the target of 0 counted as 0.
    ///
    /// Source: Sortino and Price, "Performance measurement in a downside risk framework", Journal of Investing 3 (1994).
    pub sortino: Option<f64>,
    /// Skewness of returns: third central moment over the power 3/2 of the second.
    pub skewness: Option<f64>,
    /// Kurtosis of returns, 3 for a normal distribution: fourth central moment over the square of the second.
    pub kurtosis: Option<f64>,
    /// The best return (a fraction).
    pub best_day: Option<f64>,
    /// The worst return (a fraction).
    pub worst_day: Option<f64>,
    /// The loss that 95 % of the returns do not exceed (a fraction, positive for a loss), from the returns as they were.
    pub value_at_risk_95: Option<f64>,
    /// Mean loss of the worst 5 % of the returns (a fraction, positive for a loss).
    ///
    /// Source: Acerbi and Tasche, "On the coherence of expected shortfall", Journal of Banking & Finance 26 (2002).
    pub expected_shortfall_95: Option<f64>,
}

impl Returns {
    /// The fewest returns that are made yearly.
    pub const FEWEST: usize = 20;

    /// The figures of `equity`, one point an event in the order of time.
    #[must_use]
    pub fn of(equity: &[EquityPoint]) -> Self {
        Self::of_daily(&DailyReturns::of(&closes(equity)))
    }

    pub(super) fn of_daily(daily: &DailyReturns) -> Self {
        let count = daily.values.len();
        let a_year = if daily.years > 0.0 { defined(count as f64 / daily.years) } else { None };
        let plain = Self::plain(daily, a_year);
        if count < Self::FEWEST || daily.broke {
            return plain;
        }
        let m = Moments::of(&daily.values);
        let yearly = |per_return: f64| a_year.and_then(|n| defined(per_return * n.sqrt()));
        let sharpe = defined(m.mean / m.deviation);
        let below: f64 = daily.values.iter().map(|r| r.min(0.0).powi(2)).sum();
        let tail = Tail::of(&daily.values);
        Self {
            annualised_volatility: yearly(m.deviation),
            sharpe: sharpe.and_then(yearly),
            daily_sharpe: sharpe,
            sharpe_standard_error: sharpe.and_then(|s| sharpe_standard_error(s, count)).and_then(yearly),
            probabilistic_sharpe: match (sharpe, m.skewness, m.kurtosis) {
                (Some(sharpe), Some(skewness), Some(kurtosis)) => {
                    probabilistic_sharpe(sharpe, 0.0, count, skewness, kurtosis)
                }
                _ => None,
            },
            sortino: yearly(m.mean / (below / count as f64).sqrt()),
            skewness: m.skewness,
            kurtosis: m.kurtosis,
            value_at_risk_95: tail.map(|tail| tail.value_at_risk),
            expected_shortfall_95: tail.map(|tail| tail.expected_shortfall),
            ..plain
        }
    }

    /// What any number of returns has.
    fn plain(daily: &DailyReturns, returns_per_year: Option<f64>) -> Self {
        let extreme = |pick: fn(f64, f64) -> f64| if daily.broke { None } else { daily.values.iter().copied().reduce(pick) };
        Self {
            daily_returns: daily.values.len(),
            gaps: daily.gaps,
            returns_per_year,
            annualised_volatility: None,
            sharpe: None,
            daily_sharpe: None,
            sharpe_standard_error: None,
            probabilistic_sharpe: None,
            sortino: None,
            skewness: None,
            kurtosis: None,
            best_day: extreme(f64::max),
            worst_day: extreme(f64::min),
            value_at_risk_95: None,
            expected_shortfall_95: None,
        }
    }

    /// Whether there are data enough, and none missing, for figures of a year.
    #[must_use]
    pub fn make_a_year(&self) -> bool {
        self.daily_returns >= Self::FEWEST && self.gaps == 0
    }
}

#[cfg(test)]
mod tests {
    use super::super::daily_return::DAY;
    use super::super::tests::curve;
    use super::*;
    use crate::sim2real::Timestamp;

    fn close(found: Option<f64>, expected: f64) -> bool {
        found.is_some_and(|f| (f - expected).abs() <= 1e-12 * expected.abs())
    }

    /// Made with numpy: e = 1e5 * (1 + 0.001 k + 0.01 sin k), k = 0..29, one a day; r = e[1:] / e[:-1] - 1;
    /// volatility = r.std(ddof=1) * sqrt(365.25); Sharpe = r.mean() / r.std(ddof=1) * sqrt(365.25).
    #[test]
    fn daily_figures_are_those_of_numpy() {
        let values: Vec<f64> = (0..30).map(|k| 1e5 * (1.0 + 0.001 * f64::from(k) + 0.01 * f64::from(k).sin())).collect();
        let figures = Returns::of(&curve(DAY, &values));
        assert_eq!((figures.daily_returns, figures.gaps), (29, 0));
        assert!(close(figures.returns_per_year, 365.25));
        assert!(close(figures.annualised_volatility, NUMPY_VOLATILITY), "{figures:?}");
        assert!(close(figures.sharpe, NUMPY_SHARPE), "{figures:?}");
    }
    /// Of the same returns, in Python: mean(r) / sqrt(mean(min(r, 0)**2)) * sqrt(365.25); with d = r - mean(r),
    /// mean(d**3) / mean(d**2)**1.5 and mean(d**4) / mean(d**2)**2; of the returns in order, the second negated and
    /// -(first + 0.45 second) / 1.45; Sharpe's error and odds by their formulas.
    #[test]
    fn the_shape_of_daily_returns_is_as_computed_elsewhere() {
        let values: Vec<f64> = (0..30).map(|k| 1e5 * (1.0 + 0.001 * f64::from(k) + 0.01 * f64::from(k).sin())).collect();
        let figures = Returns::of(&curve(DAY, &values));
        for (what, found, expected) in [
            ("daily Sharpe", figures.daily_sharpe, NUMPY_SHARPE / 365.25_f64.sqrt()),
            ("Sortino", figures.sortino, SORTINO),
            ("skewness", figures.skewness, SKEWNESS),
            ("kurtosis", figures.kurtosis, KURTOSIS),
            ("best", figures.best_day, BEST),
            ("worst", figures.worst_day, WORST),
            ("value at risk", figures.value_at_risk_95, AT_RISK),
            ("shortfall", figures.expected_shortfall_95, SHORTFALL),
            ("error", figures.sharpe_standard_error, ERROR),
            ("odds", figures.probabilistic_sharpe, ODDS),
        ] {
            assert!(
                found.is_some_and(|f| (f - expected).abs() <= 1e-11 * expected.abs()),
                "{what}: {found:?}, not {expected}"
            );
        }
    }

    const SORTINO: f64 = 3.5439921891852206;
    const SKEWNESS: f64 = 0.047096264068675904;
    const KURTOSIS: f64 = 1.4851882973977888;
    const BEST: f64 = 0.010497754601244136;
    const WORST: f64 = -0.008450515189412644;
    const AT_RISK: f64 = 0.008205470337330545;
    const SHORTFALL: f64 = 0.008374466787042336;
    const ERROR: f64 = 3.560504752639735;
    const ODDS: f64 = 0.7278479299787103;
    const NUMPY_VOLATILITY: f64 = 0.13130109169171605;
    const NUMPY_SHARPE: f64 = 2.185693809084023;

    #[test]
    fn some_minutes_or_days_make_no_year() {
        let minutes = Returns::of(&curve(60 * Timestamp::NANOS, &[100.0, 101.0, 100.0, 102.0]));
        assert_eq!((minutes.daily_returns, minutes.sharpe, minutes.annualised_volatility), (0, None, None));
        let values: Vec<f64> = (0..=Returns::FEWEST).map(|k| 100.0 + (k % 3) as f64).collect();
        assert!(Returns::of(&curve(DAY, &values)).sharpe.is_some());
        let fewer = Returns::of(&curve(DAY, &values[1..]));
        assert_eq!((fewer.daily_returns, fewer.sharpe, fewer.make_a_year()), (19, None, false));
    }

    /// Two stretches a decade apart: the jump between them is no daily return, and the decade no trading time.
    #[test]
    fn gaps_are_left_out() {
        let mut points = curve(DAY, &(0..15).map(|k| 100.0 + f64::from(k % 2)).collect::<Vec<_>>());
        let later = points.iter().map(|p| EquityPoint { time: p.time + 3_650 * DAY, equity: 10.0 * p.equity });
        points.extend(later.collect::<Vec<_>>());
        let figures = Returns::of(&points);
        assert_eq!((figures.daily_returns, figures.gaps, figures.make_a_year()), (28, 1, false));
        assert!(close(figures.returns_per_year, 365.25));
        assert!(figures.annualised_volatility.unwrap() < 0.2, "{figures:?}");
        let isolated: Vec<EquityPoint> =
            (0..40).map(|k| EquityPoint { time: Timestamp(k * 30 * DAY), equity: 100.0 }).collect();
        let figures = Returns::of(&isolated);
        assert_eq!((figures.daily_returns, figures.gaps, figures.sharpe), (0, 39, None));
    }

    #[test]
    fn what_is_not_defined_is_none() {
        for first in [100.0, 0.0, -5.0] {
            let values: Vec<f64> = std::iter::once(first).chain((0..30).map(|k| f64::from(50 + k % 7))).collect();
            assert_eq!(Returns::of(&curve(DAY, &values)).sharpe.is_some(), first > 0.0, "{first}");
        }
        assert_eq!(Returns::of(&[]).returns_per_year, None);
        let flat = Returns::of(&curve(DAY, &[100.0; 30]));
        assert_eq!((flat.annualised_volatility, flat.sharpe), (Some(0.0), None));
    }
}
