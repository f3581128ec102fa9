//! The deepest fall.

use serde::Serialize;

use crate::market::EquityPoint;
use crate::sim2real::Timestamp;

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

impl Drawdown {
    /// The deepest fall of an account that began with `initial` [currency], the first where several are as deep; none
    /// where it never fell below a high above 0.
    #[must_use]
    pub fn deepest(initial: f64, equity: &[EquityPoint]) -> Option<Self> {
        let (first, last) = (equity.first()?, equity.last()?);
        let (mut peak, mut peak_at) = (initial, first.time);
        let mut deepest: Option<(Self, f64)> = None;
        for point in equity {
            if let Some((fall, high)) = &mut deepest
                && fall.recovered_at.is_none()
                && point.equity >= *high
            {
                fall.recovered_at = Some(point.time);
            }
            if point.equity >= peak {
                (peak, peak_at) = (point.equity, point.time);
            } else if peak > 0.0 {
                let depth = 1.0 - point.equity / peak;
                if deepest.as_ref().is_none_or(|(fall, _)| depth > fall.depth) {
                    let fall = Self { depth, peak_at, trough_at: point.time, recovered_at: None, seconds: 0.0 };
                    deepest = Some((fall, peak));
                }
            }
        }
        deepest.map(|(fall, _)| Self { seconds: fall.recovered_at.unwrap_or(last.time).seconds_since(fall.peak_at), ..fall })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn deepest(values: &[f64]) -> Option<Drawdown> {
        let point = |(k, v): (usize, &f64)| EquityPoint { time: Timestamp(k as i64 * Timestamp::NANOS), equity: *v };
        Drawdown::deepest(100.0, &values.iter().enumerate().map(point).collect::<Vec<_>>())
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
}
