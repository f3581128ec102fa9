//! Volatility and Sharpe ratio, and the sampling they rest on.

use serde::Serialize;

use crate::market::EquityPoint;
use crate::sim2real::Timestamp;

use super::defined;

const DAY: i64 = 86_400 * Timestamp::NANOS;
/// Mean length of a year of the Julian calendar.
pub(super) const DAYS_A_YEAR: f64 = 365.25;

/// Years of 365.25 days between two instants.
pub(super) fn years(from: Timestamp, to: Timestamp) -> f64 {
    to.seconds_since(from) / (86_400.0 * DAYS_A_YEAR)
}

/// At which instants equity is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// At the last event of each day of UTC, and at the first of all.
    Daily,
    /// At each event.
    Event,
}

/// Figures of the simple returns between samples of equity, made yearly by the number of returns there were a year.
///
/// Source: Sharpe, "The Sharpe ratio", Journal of Portfolio Management 21 (1994), with a benchmark of 0; made yearly as
/// if returns were independent, for the limits of which see Lo, Financial Analysts Journal 58 (2002).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Returns {
    /// How equity was sampled: daily where there are at least 20 days with data, else at each event.
    pub sampling: Sampling,
    /// Number of returns.
    pub returns: usize,
    /// Returns a year, as there were: what the figures are made yearly with.
    pub returns_per_year: Option<f64>,
    /// Standard deviation of returns, times the root of their number a year (a fraction).
    pub annualised_volatility: Option<f64>,
    /// Mean return over standard deviation, times the root of their number a year.
    pub sharpe: Option<f64>,
}

impl Returns {
    /// The fewest days with data for daily sampling.
    pub const FEWEST_DAYS: usize = 20;

    /// The figures of `equity`, one point an event in the order of time.
    #[must_use]
    pub fn of(equity: &[EquityPoint]) -> Self {
        let daily = daily(equity);
        let (sampling, samples) = match daily {
            Some(daily) => (Sampling::Daily, daily),
            None => (Sampling::Event, equity.to_vec()),
        };
        let span = match (samples.first(), samples.last()) {
            (Some(first), Some(last)) => years(first.time, last.time),
            _ => 0.0,
        };
        let count = samples.len().saturating_sub(1);
        let per_year = if span > 0.0 { defined(count as f64 / span) } else { None };
        let mut figures =
            Self { sampling, returns: count, returns_per_year: per_year, annualised_volatility: None, sharpe: None };
        // A return on nothing, or on debt, is not defined.
        if count < 2 || samples[..count].iter().any(|point| point.equity <= 0.0) {
            return figures;
        }
        let returns = || samples.windows(2).map(|pair| pair[1].equity / pair[0].equity - 1.0);
        let mean = returns().sum::<f64>() / count as f64;
        let squares: f64 = returns().map(|r| (r - mean) * (r - mean)).sum();
        let deviation = (squares / (count - 1) as f64).sqrt();
        figures.annualised_volatility = per_year.and_then(|n| defined(deviation * n.sqrt()));
        figures.sharpe = per_year.and_then(|n| defined(mean / deviation * n.sqrt()));
        figures
    }
}

/// The first point and the last of each day, where there are days enough.
fn daily(equity: &[EquityPoint]) -> Option<Vec<EquityPoint>> {
    // What is known at midnight belongs to the day that ends with it.
    let day = |point: &EquityPoint| (point.time.0.saturating_sub(1)).div_euclid(DAY);
    let closes: Vec<&EquityPoint> = equity.chunk_by(|a, b| day(a) == day(b)).filter_map(<[_]>::last).collect();
    if closes.len() < Returns::FEWEST_DAYS {
        return None;
    }
    let first = equity.first().filter(|first| closes.first().is_some_and(|close| close.time > first.time));
    Some(first.into_iter().chain(closes).copied().collect())
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
        assert_eq!((figures.sampling, figures.returns), (Sampling::Daily, 29));
        assert!(close(figures.returns_per_year, 365.25));
        assert!(close(figures.annualised_volatility, NUMPY_VOLATILITY), "{figures:?}");
        assert!(close(figures.sharpe, NUMPY_SHARPE), "{figures:?}");
    }
    const NUMPY_VOLATILITY: f64 = 0.13130109169171605;
    const NUMPY_SHARPE: f64 = 2.185693809084023;

    #[test]
    fn short_runs_are_sampled_at_each_event() {
        let figures = Returns::of(&curve(60 * Timestamp::NANOS, &[100.0, 101.0, 100.0, 102.0]));
        assert_eq!((figures.sampling, figures.returns), (Sampling::Event, 3));
        assert!(close(figures.returns_per_year, 365.25 * 1440.0));
    }

    #[test]
    fn days_are_closed_by_their_last_event() {
        let hourly: Vec<f64> = (0..20 * 24).map(|k| 100.0 + f64::from(k)).collect();
        let samples = daily(&curve(DAY / 24, &hourly)).unwrap();
        assert_eq!(samples.len(), 21);
        assert_eq!((samples[0].equity, samples[1].equity, samples[20].equity), (100.0, 123.0, 579.0));
    }

    #[test]
    fn what_is_not_defined_is_none() {
        for values in [&[][..], &[100.0], &[100.0, 101.0], &[100.0, 0.0, 1.0], &[100.0, -5.0, 1.0]] {
            assert_eq!(Returns::of(&curve(1_000, values)).sharpe, None, "{values:?}");
        }
        let flat = Returns::of(&curve(1_000, &[100.0; 5]));
        assert_eq!((flat.annualised_volatility, flat.sharpe), (Some(0.0), None));
    }
}
