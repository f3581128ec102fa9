//! Volatility and Sharpe ratio, and the daily returns they rest on.

use serde::Serialize;

use crate::market::EquityPoint;
use crate::sim2real::Timestamp;

use super::defined;

const DAY: i64 = 86_400 * Timestamp::NANOS;
/// Mean length of a year of the Julian calendar.
const DAYS_A_YEAR: f64 = 365.25;

/// Years of 365.25 days between two instants.
pub(super) fn years(from: Timestamp, to: Timestamp) -> f64 {
    to.seconds_since(from) / (86_400.0 * DAYS_A_YEAR)
}

/// Neighbouring days with data that are further apart than this are no neighbours: the longest that exchanges have been
/// closed for in a century is a week.
const WEEK: i64 = 7 * DAY;

/// Figures of the simple returns from the last event of one day of UTC with data to that of the next, made yearly by the
/// number of such returns there were a year.
///
/// A return across more than a week without data is left out: one jump over years is no daily return. Without
/// [`Returns::FEWEST`] returns nothing is made yearly: over some days a Sharpe ratio is mostly its own error, of
/// `1 / sqrt(years)`.
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
}

impl Returns {
    /// The fewest returns that are made yearly.
    pub const FEWEST: usize = 20;

    /// The figures of `equity`, one point an event in the order of time.
    #[must_use]
    pub fn of(equity: &[EquityPoint]) -> Self {
        let closes = closes(equity);
        let (mut gaps, mut span, mut broke, mut returns) = (0, 0.0, false, Vec::new());
        for pair in closes.windows(2) {
            if pair[1].time - pair[0].time > WEEK {
                gaps += 1;
                continue;
            }
            // A return on nothing, or on debt, is not defined.
            broke |= pair[0].equity <= 0.0;
            span += years(pair[0].time, pair[1].time);
            returns.push(pair[1].equity / pair[0].equity - 1.0);
        }
        let count = returns.len();
        let mut figures = Self {
            daily_returns: count,
            gaps,
            returns_per_year: if span > 0.0 { defined(count as f64 / span) } else { None },
            annualised_volatility: None,
            sharpe: None,
        };
        if count < Self::FEWEST || broke {
            return figures;
        }
        let mean = returns.iter().sum::<f64>() / count as f64;
        let squares: f64 = returns.iter().map(|r| (r - mean) * (r - mean)).sum();
        let deviation = (squares / (count - 1) as f64).sqrt();
        figures.annualised_volatility = figures.returns_per_year.and_then(|n| defined(deviation * n.sqrt()));
        figures.sharpe = figures.returns_per_year.and_then(|n| defined(mean / deviation * n.sqrt()));
        figures
    }

    /// Whether there are data enough, and none missing, for figures of a year.
    #[must_use]
    pub fn make_a_year(&self) -> bool {
        self.daily_returns >= Self::FEWEST && self.gaps == 0
    }
}

/// The last point of each day.
fn closes(equity: &[EquityPoint]) -> Vec<EquityPoint> {
    // What is known at midnight belongs to the day that ends with it.
    let day = |point: &EquityPoint| (point.time.0.saturating_sub(1)).div_euclid(DAY);
    equity.chunk_by(|a, b| day(a) == day(b)).filter_map(|of_day| of_day.last().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(spacing: i64, values: &[f64]) -> Vec<EquityPoint> {
        values
            .iter()
            .enumerate()
            .map(|(k, v)| EquityPoint { time: Timestamp((k as i64 + 1) * spacing), equity: *v })
            .collect()
    }

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
    fn days_are_closed_by_their_last_event() {
        let hourly: Vec<f64> = (0..20 * 24).map(|k| 100.0 + f64::from(k)).collect();
        let samples = closes(&curve(DAY / 24, &hourly));
        assert_eq!(samples.len(), 20);
        assert_eq!((samples[0].equity, samples[1].equity, samples[19].equity), (123.0, 147.0, 579.0));
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
