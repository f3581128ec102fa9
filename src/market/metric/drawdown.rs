//! Falls of equity below its highs.

use serde::Serialize;

use crate::market::EquityPoint;
use crate::sim2real::Timestamp;

use super::defined;

/// A fall of equity from a high.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Drawdown {
    /// Part of the high that was lost, from 0; above 1 where equity went below 0.
    pub depth: f64,
    /// When the high was reached last.
    pub peak_at: Timestamp,
    /// When it was deepest.
    pub trough_at: Timestamp,
    /// When the high was reached again; none where it was not.
    pub recovered_at: Option<Timestamp>,
    /// From the high to the recovery, or else to the end [s].
    pub seconds: f64,
}

/// The falls of an account, from each high to the next time it was reached: they do not overlap.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drawdowns {
    /// The deepest, at most [`Drawdowns::KEPT`], the deepest first and the earlier where two are as deep.
    pub deepest: Vec<Drawdown>,
    /// The longest time from a high to its recovery, or else to the end [s]; none where equity never fell.
    pub longest: Option<f64>,
}

impl Drawdowns {
    /// How many are kept.
    pub const KEPT: usize = 10;

    /// The falls of an account that began with `initial` [currency]. From a high of 0 or below no fall is counted.
    #[must_use]
    pub fn of(initial: f64, equity: &[EquityPoint]) -> Self {
        let (Some(first), Some(last)) = (equity.first(), equity.last()) else { return Self::default() };
        let mut falls = Self::default();
        let (mut peak, mut peak_at) = (initial, first.time);
        let mut under_way: Option<Drawdown> = None;
        for point in equity {
            if point.equity >= peak {
                if let Some(fall) = under_way.take() {
                    falls.keep(Drawdown { recovered_at: Some(point.time), ..fall }, point.time);
                }
                (peak, peak_at) = (point.equity, point.time);
            } else if peak > 0.0 {
                let depth = 1.0 - point.equity / peak;
                if under_way.is_none_or(|fall| depth > fall.depth) {
                    let trough_at = point.time;
                    under_way = Some(Drawdown { depth, peak_at, trough_at, recovered_at: None, seconds: 0.0 });
                }
            }
        }
        if let Some(fall) = under_way {
            falls.keep(fall, last.time);
        }
        falls
    }

    /// Counts a fall that lasted until `end`.
    fn keep(&mut self, fall: Drawdown, end: Timestamp) {
        let seconds = end.seconds_since(fall.peak_at);
        self.longest = Some(self.longest.map_or(seconds, |longest| longest.max(seconds)));
        let at = self.deepest.partition_point(|kept| kept.depth >= fall.depth);
        if at < Self::KEPT {
            self.deepest.truncate(Self::KEPT - 1);
            self.deepest.insert(at, Drawdown { seconds, ..fall });
        }
    }
}

/// The root of the mean square of the drawdowns at `closes`, one a day, of an account that began with `initial`
/// [currency] (a fraction); none without any, or where a high is not above 0.
///
/// Source: Martin and McCann, "The investor's guide to Fidelity funds" (1989), there in percent.
#[must_use]
pub(super) fn ulcer_index(initial: f64, closes: &[EquityPoint]) -> Option<f64> {
    let (mut peak, mut squares) = (initial, 0.0);
    for close in closes {
        peak = peak.max(close.equity);
        if peak <= 0.0 {
            return None;
        }
        squares += (1.0 - close.equity / peak).powi(2);
    }
    defined((squares / closes.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn falls(values: &[f64]) -> Drawdowns {
        let point = |(k, v): (usize, &f64)| EquityPoint { time: Timestamp(k as i64 * Timestamp::NANOS), equity: *v };
        Drawdowns::of(100.0, &values.iter().enumerate().map(point).collect::<Vec<_>>())
    }

    fn deepest(values: &[f64]) -> Option<Drawdown> {
        falls(values).deepest.first().copied()
    }

    #[test]
    fn the_deepest_fall_is_found_with_its_dates() {
        let at = |s: i64| Timestamp(s * Timestamp::NANOS);
        let fall = deepest(&[100.0, 110.0, 99.0, 120.0, 90.0, 96.0, 120.0, 119.0]).unwrap();
        assert_eq!((fall.depth, fall.peak_at, fall.trough_at, fall.recovered_at), (0.25, at(3), at(4), Some(at(6))));
        assert_eq!(fall.seconds, 3.0);
    }

    #[test]
    fn a_fall_at_once_counts_and_need_not_recover() {
        let fall = deepest(&[95.0, 90.0, 99.0]).unwrap();
        assert!((fall.depth - 0.1).abs() < 1e-15 && fall.recovered_at.is_none() && fall.seconds == 2.0);
        assert_eq!(deepest(&[100.0, 100.0, 101.0]), None);
        assert_eq!(deepest(&[]), None);
        assert!(deepest(&[100.0, -20.0]).unwrap().depth > 1.0);
    }

    /// Falls of 10 % (two seconds under water), 25 % (three), 0.8 % (two) and, not yet over, 5 % (one).
    #[test]
    fn falls_do_not_overlap_and_the_deepest_comes_first() {
        let found = falls(&[100.0, 90.0, 120.0, 90.0, 96.0, 120.0, 119.0, 200.0, 190.0]);
        let depths: Vec<f64> = found.deepest.iter().map(|fall| (fall.depth * 1e4).round()).collect();
        assert_eq!(depths, [2_500.0, 1_000.0, 500.0, 83.0]);
        let seconds: Vec<f64> = found.deepest.iter().map(|fall| fall.seconds).collect();
        assert_eq!((seconds, found.longest), (vec![3.0, 2.0, 1.0, 2.0], Some(3.0)));
        assert_eq!(found.deepest.iter().filter(|fall| fall.recovered_at.is_none()).count(), 1);
        for (k, fall) in found.deepest.iter().enumerate() {
            let end = fall.recovered_at.unwrap_or(Timestamp::MAX);
            let overlaps =
                |other: &Drawdown| other.peak_at < end && fall.peak_at < other.recovered_at.unwrap_or(Timestamp::MAX);
            assert!(!found.deepest.iter().enumerate().any(|(n, other)| n != k && overlaps(other)), "{found:?}");
        }
    }

    /// Fifteen falls, of 1 % to 15 %: ten are kept, and the longest of all is known.
    #[test]
    fn ten_are_kept() {
        let values: Vec<f64> = (1..=15).flat_map(|k| [100.0, 100.0 - f64::from(k)]).chain([100.0]).collect();
        let found = falls(&values);
        let depths: Vec<f64> = found.deepest.iter().map(|fall| (fall.depth * 100.0).round()).collect();
        assert_eq!(depths, (6..=15).rev().map(f64::from).collect::<Vec<_>>());
        assert_eq!((found.longest, falls(&[100.0]).longest), (Some(2.0), None));
    }

    /// Drawdowns of 0, 10, 20 and 0 %: the root of 500 / 4 in percent.
    #[test]
    fn the_ulcer_index_by_hand() {
        let points: Vec<EquityPoint> =
            [200.0, 180.0, 160.0, 210.0].iter().map(|v| EquityPoint { time: Timestamp(0), equity: *v }).collect();
        assert!((ulcer_index(100.0, &points).unwrap() - 0.012_5_f64.sqrt()).abs() < 1e-12);
        assert_eq!(
            (ulcer_index(100.0, &[]), ulcer_index(-500.0, &[EquityPoint { time: Timestamp(0), equity: -1.0 }])),
            (None, None)
        );
    }
}
