//! Returns month by month.

use chrono::{DateTime, Datelike as _, TimeZone as _};
use chrono_tz::Tz;

use crate::market::EquityPoint;
use crate::sim2real::Timestamp;

use super::daily_return::WEEK;
use super::defined;

/// The return of a calendar month.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Month {
    /// Year.
    pub year: i32,
    /// Month of the year, from 1.
    pub month: u32,
    /// Equity at its last event over equity at the last event before it, less one (a fraction). After a gap of more than
    /// a week it is counted from its own first event, as a jump over years is no monthly return; the first month is
    /// counted from the cash at the start. None where there was nothing to gain on.
    pub growth: Option<f64>,
}

impl Month {
    /// The months of `zone` with data, of an account that began with `initial` [currency].
    #[must_use]
    pub fn of(initial: f64, equity: &[EquityPoint], zone: Tz) -> Vec<Self> {
        let mut months = Vec::new();
        let mut rest = equity;
        let mut before: Option<EquityPoint> = None;
        while let Some(first) = rest.first() {
            let (year, month, end) = calendar(first.time, zone);
            // At least one, so that it ends whatever the calendar says.
            let count = rest.partition_point(|point| point.time <= end).max(1);
            let (own, later) = rest.split_at(count);
            let base = match before {
                Some(last) if first.time - last.time > WEEK => first.equity,
                Some(last) => last.equity,
                None => initial,
            };
            before = own.last().copied();
            let growth = before.filter(|_| base > 0.0).and_then(|last| defined(last.equity / base - 1.0));
            months.push(Self { year, month, growth });
            rest = later;
        }
        months
    }
}

/// Year and month of `time` in `zone`, and the last instant of that month: what is known at midnight belongs to the day
/// that ends with it.
fn calendar(time: Timestamp, zone: Tz) -> (i32, u32, Timestamp) {
    let local = DateTime::from_timestamp_nanos(time.0.saturating_sub(1)).with_timezone(&zone);
    let (year, month) = (local.year(), local.month());
    let (next_year, next_month) = if month == 12 { (year + 1, 1) } else { (year, month + 1) };
    // A month that begins where clocks are put forward begins an hour later.
    let next = (0..3).find_map(|hour| zone.with_ymd_and_hms(next_year, next_month, 1, hour, 0, 0).earliest());
    let end = next.and_then(|next| next.timestamp_nanos_opt()).map_or(Timestamp::MAX, Timestamp);
    (year, month, end)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str, equity: f64) -> EquityPoint {
        let time = DateTime::parse_from_rfc3339(text).unwrap().timestamp_nanos_opt().unwrap();
        EquityPoint { time: Timestamp(time), equity }
    }

    fn shown(points: &[EquityPoint], zone: Tz) -> Vec<(i32, u32, Option<i64>)> {
        let months = Month::of(100.0, points, zone);
        months.iter().map(|m| (m.year, m.month, m.growth.map(|g| (g * 1e4).round() as i64))).collect()
    }

    /// A day's bar of New York is known at its midnight, four or five hours into the next day of UTC.
    #[test]
    fn months_are_those_of_their_zone_and_end_at_midnight() {
        let points = [
            at("2024-01-30T05:00:00Z", 101.0),
            at("2024-02-01T05:00:00Z", 110.0),
            at("2024-02-02T05:00:00Z", 121.0),
            at("2024-02-09T05:00:00Z", 99.0),
            at("2024-02-16T05:00:00Z", 99.0),
            at("2024-02-23T05:00:00Z", 99.0),
            at("2024-03-01T05:00:00Z", 99.0),
            at("2024-03-01T05:00:01Z", 49.5),
        ];
        let new_york = shown(&points, Tz::America__New_York);
        assert_eq!(new_york, [(2024, 1, Some(1_000)), (2024, 2, Some(-1_000)), (2024, 3, Some(-5_000))]);
        let utc = shown(&points, Tz::UTC);
        assert_eq!(utc, [(2024, 1, Some(100)), (2024, 2, Some(-198)), (2024, 3, Some(-5_000))]);
    }

    /// Without a gap, months multiply to the return of all; the jump over a decade is in no month.
    #[test]
    fn gaps_are_in_no_month() {
        let points = [
            at("2013-12-30T12:00:00Z", 110.0),
            at("2014-01-02T12:00:00Z", 121.0),
            at("2024-01-02T12:00:00Z", 1_000.0),
            at("2024-01-03T12:00:00Z", 1_100.0),
        ];
        assert_eq!(shown(&points, Tz::UTC), [(2013, 12, Some(1_000)), (2014, 1, Some(1_000)), (2024, 1, Some(1_000))]);
        let broke = [at("2024-01-31T12:00:00Z", -5.0), at("2024-02-01T12:00:00Z", 50.0)];
        assert_eq!(shown(&broke, Tz::UTC), [(2024, 1, Some(-10_500)), (2024, 2, None)]);
        assert_eq!(shown(&[], Tz::UTC), []);
        assert_eq!(shown(&[EquityPoint { time: Timestamp::MAX, equity: 100.0 }], Tz::UTC).len(), 1);
        assert_eq!(shown(&[EquityPoint { time: Timestamp::MIN, equity: 100.0 }], Tz::Asia__Tokyo).len(), 1);
    }
}
