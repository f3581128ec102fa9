//! A schedule: a parent order cut into slices of time.

use crate::market::View;
use crate::sim2real::Timestamp;

use super::{Kind, ParentOrder, StrategyError};

/// Slices of equal length from the start of a parent order to its end; the last may be shorter.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    start: Timestamp,
    end: Timestamp,
    /// Length of a slice [ns].
    interval: i64,
    /// The slice each instrument was last asked for.
    last: Vec<Option<i64>>,
}

/// A slice that has begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slice {
    /// Its number, from 0; from `of` on after the end.
    pub number: i64,
    /// How many there are.
    pub of: i64,
    /// When it ends, or the parent order.
    pub until: Timestamp,
}

impl Schedule {
    /// Slices of `interval` [s] for `parent`.
    ///
    /// # Errors
    /// If the interval is below a microsecond, or cuts it into more than a million slices.
    pub(super) fn new(kind: &Kind, parent: &ParentOrder, interval: f64) -> Result<Self, StrategyError> {
        let value =
            |hint| Err(StrategyError::Value { kind: kind.name, parameter: "interval", value: interval.to_string(), hint });
        if !(interval.is_finite() && interval >= 1e-6) {
            return value("it is a number of seconds above 0, as 300");
        }
        let (start, end) = (parent.start(), parent.end());
        // Longer than the order is one slice, however long.
        let interval = (interval * 1e9).min((end - start) as f64).round() as i64;
        if (end - start) / interval >= 1_000_000 {
            return value("it cuts the order into more than a million slices");
        }
        Ok(Self { start, end, interval, last: Vec::new() })
    }

    /// The slice the present lies in, once a slice and instrument; also once an interval after the end.
    pub(super) fn begun(&mut self, view: &View<'_>) -> Option<Slice> {
        let (instrument, count) = (view.event().instrument, view.instruments().len());
        if self.last.len() < count {
            self.last.resize(count, None);
        }
        let slice = self.slice(view.now())?;
        let last = self.last[instrument].replace(slice.number);
        (last != Some(slice.number)).then_some(slice)
    }

    fn slice(&self, now: Timestamp) -> Option<Slice> {
        if now < self.start {
            return None;
        }
        let length = self.end - self.start;
        let of = length / self.interval + i64::from(length % self.interval != 0);
        let number = if now < self.end { (now - self.start) / self.interval } else { of + (now - self.end) / self.interval };
        let until = (self.start + self.interval.saturating_mul(number + 1)).min(self.end);
        Some(Slice { number, of, until })
    }
}

impl Slice {
    /// The part of the order that is to be sent with it and those before, all being equal.
    #[must_use]
    pub fn share(&self) -> f64 {
        if self.number + 1 >= self.of { 1.0 } else { (self.number + 1) as f64 / self.of as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_are_numbered_from_start_to_end_and_on() {
        let kind = &super::super::twap::KIND;
        let order = |end: i64| ParentOrder::new(kind, None, "buy", 1.0, [Timestamp(0), Timestamp(end)]).unwrap();
        let seconds = |s: f64| Timestamp((s * 1e9) as i64);
        let schedule = Schedule::new(kind, &order(100_000_000_000), 30.0).unwrap();
        let slice = |at: f64| schedule.slice(seconds(at)).map(|s| (s.number, s.of, s.until, s.share()));
        assert_eq!(slice(-1e-9), None);
        assert_eq!(slice(0.0), Some((0, 4, seconds(30.0), 0.25)));
        assert_eq!(slice(29.9), slice(0.0));
        assert_eq!(slice(60.0), Some((2, 4, seconds(90.0), 0.75)));
        assert_eq!(slice(95.0), Some((3, 4, seconds(100.0), 1.0)));
        assert_eq!(slice(100.0), Some((4, 4, seconds(100.0), 1.0)));
        assert_eq!(slice(130.0), Some((5, 4, seconds(100.0), 1.0)));
        let one = Schedule::new(kind, &order(100), 1e9).unwrap();
        assert_eq!(one.slice(Timestamp(0)).map(|s| (s.number, s.of, s.share())), Some((0, 1, 1.0)));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-4] {
            assert!(Schedule::new(kind, &order(100_000_000_000), bad).is_err(), "{bad}");
        }
    }
}
