//! Daily returns: what volatility, Sharpe ratio and tails rest on.

use crate::market::EquityPoint;
use crate::sim2real::Timestamp;

pub(super) const DAY: i64 = 86_400 * Timestamp::NANOS;
/// Mean length of a year of the Julian calendar.
const DAYS_A_YEAR: f64 = 365.25;

/// Years of 365.25 days between two instants.
pub(super) fn years(from: Timestamp, to: Timestamp) -> f64 {
    to.seconds_since(from) / (86_400.0 * DAYS_A_YEAR)
}

/// Neighbouring days with data that are further apart than this are no neighbours: the longest that exchanges have been
/// closed for in a century is a week.
pub(super) const WEEK: i64 = 7 * DAY;

/// Simple returns from the last event of one day of UTC with data to that of the next.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct DailyReturns {
    /// The returns (fractions).
    pub values: Vec<f64>,
    /// Gaps of more than a week, over which no return is taken.
    pub gaps: usize,
    /// Time the returns span [years].
    pub years: f64,
    /// Whether there was a return on nothing, or on debt, which is not defined.
    pub broke: bool,
}

impl DailyReturns {
    /// The returns between `closes`, one a day.
    pub fn of(closes: &[EquityPoint]) -> Self {
        let mut daily = Self::default();
        for pair in closes.windows(2) {
            if pair[1].time - pair[0].time > WEEK {
                daily.gaps += 1;
                continue;
            }
            daily.broke |= pair[0].equity <= 0.0;
            daily.years += years(pair[0].time, pair[1].time);
            daily.values.push(pair[1].equity / pair[0].equity - 1.0);
        }
        daily
    }
}

/// The last point of each day.
pub(super) fn closes(equity: &[EquityPoint]) -> Vec<EquityPoint> {
    // What is known at midnight belongs to the day that ends with it.
    let day = |point: &EquityPoint| (point.time.0.saturating_sub(1)).div_euclid(DAY);
    equity.chunk_by(|a, b| day(a) == day(b)).filter_map(|of_day| of_day.last().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::curve;
    use super::*;

    #[test]
    fn days_are_closed_by_their_last_event() {
        let hourly: Vec<f64> = (0..20 * 24).map(|k| 100.0 + f64::from(k)).collect();
        let samples = closes(&curve(DAY / 24, &hourly));
        assert_eq!(samples.len(), 20);
        assert_eq!((samples[0].equity, samples[1].equity, samples[19].equity), (123.0, 147.0, 579.0));
    }
}
