//! The volume of a day, by time of day.

use std::collections::VecDeque;

use chrono::{DateTime, NaiveDate, Timelike};
use chrono_tz::Tz;

use crate::market::Bar;
use crate::sim2real::Timestamp;

/// Seconds in a day without a change of clocks.
pub(super) const DAY: f64 = 86_400.0;

/// The date and the time of day [s] of an instant in a zone, as its clocks show them.
pub(super) fn local(instant: Timestamp, zone: Tz) -> (NaiveDate, f64) {
    let local = DateTime::from_timestamp_nanos(instant.0).with_timezone(&zone);
    (local.date_naive(), f64::from(local.num_seconds_from_midnight()) + f64::from(local.nanosecond() % 1_000_000_000) * 1e-9)
}

/// How the volume of a day is spread over it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VolumeProfile {
    spans: Vec<Span>,
}

/// A part of the day, with its volume spread evenly over it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Time of day it begins at [s].
    pub from: f64,
    /// Time of day it ends at [s].
    pub to: f64,
    /// Its volume, in any unit.
    pub weight: f64,
}

impl VolumeProfile {
    /// A profile of spans that do not overlap, in the order of the day.
    #[must_use]
    pub fn new(spans: Vec<Span>) -> Self {
        Self { spans }
    }

    /// The volume from one time of day to another [s].
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> f64 {
        let part = |span: &Span| {
            let overlap = (to.min(span.to) - from.max(span.from)).max(0.0);
            span.weight * overlap / (span.to - span.from)
        };
        self.spans.iter().map(part).sum()
    }
}

/// The volumes of the last days, from which a profile is learned.
#[derive(Debug, Clone, PartialEq)]
pub struct PastDays {
    zone: Tz,
    /// Length of a part of the day [s].
    bucket: f64,
    most: usize,
    /// Volume of each part of each day, the newest day last.
    days: VecDeque<(NaiveDate, Vec<f64>)>,
}

impl PastDays {
    /// Nothing seen yet: `most` days will be kept, in parts of `bucket` [s].
    #[must_use]
    pub fn new(zone: Tz, bucket: f64, most: usize) -> Self {
        Self { zone, bucket, most, days: VecDeque::new() }
    }

    /// Counts a bar to the day in which it began, its volume spread evenly from its beginning to its end.
    pub fn see(&mut self, bar: &Bar) {
        let (date, from) = local(bar.open_at, self.zone);
        if self.days.back().is_none_or(|(last, _)| *last < date) {
            // One more than is asked for: the newest may not have ended.
            let spare = if self.days.len() > self.most { self.days.pop_front() } else { None };
            let mut volumes = spare.map(|(_, volumes)| volumes).unwrap_or_default();
            volumes.clear();
            volumes.resize((DAY / self.bucket).ceil() as usize, 0.0);
            self.days.push_back((date, volumes));
        }
        // What of it lies beyond midnight is left to the last part of the day.
        let to = from + bar.known_at.seconds_since(bar.open_at).max(1e-9);
        let Some((_, volumes)) = self.days.back_mut() else { return };
        let last = volumes.len().saturating_sub(1);
        let first = ((from / self.bucket) as usize).min(last);
        for (k, volume) in volumes.iter_mut().enumerate().skip(first) {
            let ends = if k == last { to } else { ((k + 1) as f64 * self.bucket).min(to) };
            let begins = (k as f64 * self.bucket).max(from);
            *volume += bar.volume * (ends - begins).max(0.0) / (to - from);
            if ends >= to {
                break;
            }
        }
    }

    /// The profile of the last days before `date`; one of no volume where there are none.
    #[must_use]
    pub fn profile_before(&self, date: NaiveDate) -> VolumeProfile {
        let parts = (DAY / self.bucket).ceil() as usize;
        let past = || self.days.iter().rev().filter(|(day, _)| *day < date).take(self.most);
        let span = |k: usize| {
            let (from, to) = (k as f64 * self.bucket, ((k + 1) as f64 * self.bucket).min(DAY));
            Span { from, to, weight: past().map(|(_, volumes)| volumes[k]).sum() }
        };
        VolumeProfile::new((0..parts).map(span).filter(|span| span.weight > 0.0).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Price;

    #[test]
    fn volume_is_spread_evenly_over_its_span() {
        let span = |from: f64, to: f64, weight: f64| Span { from, to, weight };
        let profile = VolumeProfile::new(vec![span(100.0, 200.0, 6.0), span(200.0, 400.0, 2.0), span(500.0, 600.0, 4.0)]);
        let expected = [((0.0, 1_000.0), 12.0), ((150.0, 300.0), 4.0), ((400.0, 500.0), 0.0), ((0.0, 550.0), 10.0)];
        for ((from, to), volume) in expected {
            assert!((profile.between(from, to) - volume).abs() < 1e-12, "{from} to {to}");
        }
    }

    #[test]
    fn a_profile_is_learned_from_days_that_have_ended() {
        let hour = 3_600_000_000_000_i64;
        let bar = |at: i64, volume: f64| {
            let open_at = Timestamp(at);
            Bar { open_at, known_at: open_at + 1, open: Price(1), high: Price(1), low: Price(1), close: Price(1), volume }
        };
        let mut past = PastDays::new(Tz::UTC, 3_600.0, 2);
        for (day, volumes) in [[100.0, 100.0], [1.0, 3.0], [5.0, 7.0], [1_000.0, 0.0]].iter().enumerate() {
            for (k, volume) in volumes.iter().enumerate() {
                past.see(&bar((24 * day as i64 + 9 + k as i64) * hour, *volume));
            }
        }
        let date = |day: i64| local(Timestamp(24 * day * hour), Tz::UTC).0;
        let expected =
            [Span { from: 32_400.0, to: 36_000.0, weight: 6.0 }, Span { from: 36_000.0, to: 39_600.0, weight: 10.0 }];
        assert_eq!(past.profile_before(date(3)).spans, expected);
        assert_eq!(past.profile_before(date(1)).spans, []);
        // A bar of three hours from half past nine, and one that goes on beyond midnight.
        let mut past = PastDays::new(Tz::UTC, 3_600.0, 1);
        for (at, halves, volume) in [(19, 6, 60.0), (46, 8, 40.0)] {
            let known_at = Timestamp((at + halves) * hour / 2);
            past.see(&Bar { known_at, ..bar(at * hour / 2, volume) });
        }
        let found: Vec<f64> = past.profile_before(date(1)).spans.iter().map(|span| span.weight).collect();
        assert_eq!(found, [10.0, 20.0, 20.0, 10.0, 40.0]);
    }
}
