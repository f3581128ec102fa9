//! How a file writes its times.

use chrono::{DateTime, LocalResult, NaiveDate, NaiveDateTime, NaiveTime, TimeZone};
use chrono_tz::Tz;
use serde::{Deserialize, Serialize};

use crate::sim2real::Timestamp;

/// The unit of times that are numbers, since the Unix epoch in UTC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum TimeUnit {
    /// Nanoseconds.
    #[default]
    #[serde(rename = "ns")]
    Nanoseconds,
    /// Microseconds.
    #[serde(rename = "us")]
    Microseconds,
    /// Milliseconds.
    #[serde(rename = "ms")]
    Milliseconds,
    /// Seconds.
    #[serde(rename = "s")]
    Seconds,
}

impl TimeUnit {
    /// Length of the unit [ns].
    #[must_use]
    pub fn nanoseconds(self) -> i64 {
        match self {
            Self::Nanoseconds => 1,
            Self::Microseconds => 1_000,
            Self::Milliseconds => 1_000_000,
            Self::Seconds => 1_000_000_000,
        }
    }
}

/// How a file writes its times, as far as its TOML declares it.
///
/// Numbers count `unit` since the Unix epoch, in UTC whatever the zone. Texts are RFC 3339, or, without an offset, local
/// times in `zone`. A local time that the clocks pass twice (summer time ends) is the earlier of the two instants; one
/// they skip (summer time begins) is an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeFormat {
    /// Unit of numbers.
    pub unit: TimeUnit,
    /// Zone of times without an offset.
    pub zone: Tz,
}

impl Default for TimeFormat {
    fn default() -> Self {
        Self { unit: TimeUnit::default(), zone: Tz::UTC }
    }
}

/// Why a value is no instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NotATime {
    Unreadable,
    Skipped(Tz),
    OutOfRange,
}

impl NotATime {
    pub(super) fn message(self) -> String {
        match self {
            Self::Unreadable => "expected a time".to_owned(),
            Self::Skipped(zone) => format!("expected a time that exists in {zone}"),
            Self::OutOfRange => "expected a time between the years 1677 and 2262".to_owned(),
        }
    }

    pub(super) fn hint(self) -> &'static str {
        match self {
            Self::Unreadable => {
                "times are integers (nanoseconds since 1970 in UTC, or the `time_unit` declared) or texts such as \
                 2024-03-08T14:30:00.5Z or, in the `zone` declared, 2024-03-08 09:30:00"
            }
            Self::Skipped(_) => "the clocks skip this time when summer time begins: is another `zone` meant?",
            Self::OutOfRange => "is another `time_unit` meant? Numbers are nanoseconds where none is declared",
        }
    }
}

impl TimeFormat {
    /// The instant a count of units stands for.
    pub(super) fn count(&self, count: i64) -> Result<Timestamp, NotATime> {
        count.checked_mul(self.unit.nanoseconds()).map(Timestamp).ok_or(NotATime::OutOfRange)
    }

    /// The instant a fractional count of units stands for, to the precision of the number; not for nanoseconds, of
    /// which a binary float cannot hold today's count.
    pub(super) fn fractional_count(&self, count: f64) -> Result<Timestamp, NotATime> {
        if !count.is_finite() || (self.unit == TimeUnit::Nanoseconds && count.fract() != 0.0) {
            return Err(NotATime::Unreadable);
        }
        // Whole and fractional part apart: their sum in nanoseconds would not fit a float.
        let whole = self.count(as_integer(count.trunc()).ok_or(NotATime::OutOfRange)?)?;
        let rest = (count.fract() * self.unit.nanoseconds() as f64).round() as i64;
        whole.0.checked_add(rest).map(Timestamp).ok_or(NotATime::OutOfRange)
    }

    /// The instant a text stands for.
    pub(super) fn text(&self, text: &str) -> Result<Timestamp, NotATime> {
        if let Ok(count) = text.parse::<i64>() {
            return self.count(count);
        }
        if text.bytes().next().is_some_and(|b| b.is_ascii_digit() || b == b'-')
            && let Ok(count) = text.parse::<f64>()
        {
            return self.fractional_count(count);
        }
        if let Ok(instant) = DateTime::parse_from_rfc3339(text) {
            return instant.timestamp_nanos_opt().map(Timestamp).ok_or(NotATime::OutOfRange);
        }
        let naive = ["%Y-%m-%dT%H:%M:%S%.f", "%Y-%m-%d %H:%M:%S%.f"]
            .into_iter()
            .find_map(|format| NaiveDateTime::parse_from_str(text, format).ok())
            .or_else(|| Some(NaiveDate::parse_from_str(text, "%Y-%m-%d").ok()?.and_time(NaiveTime::MIN)));
        self.local(naive.ok_or(NotATime::Unreadable)?)
    }

    /// The instant a local time stands for.
    pub(super) fn local(&self, naive: NaiveDateTime) -> Result<Timestamp, NotATime> {
        let instant = match self.zone.from_local_datetime(&naive) {
            LocalResult::Single(instant) | LocalResult::Ambiguous(instant, _) => instant,
            LocalResult::None => return Err(NotATime::Skipped(self.zone)),
        };
        instant.timestamp_nanos_opt().map(Timestamp).ok_or(NotATime::OutOfRange)
    }
}

/// `value` as an integer, where it is one and fits.
pub(super) fn as_integer(value: f64) -> Option<i64> {
    // The limits are exact in binary; the upper one itself does not fit.
    let fits = (i64::MIN as f64..-(i64::MIN as f64)).contains(&value) && value.fract() == 0.0;
    fits.then_some(value as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn new_york() -> TimeFormat {
        TimeFormat { zone: Tz::America__New_York, ..TimeFormat::default() }
    }

    fn read(format: TimeFormat, text: &str) -> Result<String, NotATime> {
        format.text(text).map(|t| t.to_string())
    }

    #[test]
    fn texts_with_an_offset_need_no_zone_and_those_without_use_it() {
        for text in ["2021-07-01T13:30:00Z", "2021-07-01T09:30:00-04:00", "2021-07-01 09:30:00", "2021-07-01T09:30:00.000"] {
            assert_eq!(read(new_york(), text).as_deref(), Ok("2021-07-01T13:30:00Z"), "{text}");
        }
        assert_eq!(read(new_york(), "2021-01-04").as_deref(), Ok("2021-01-04T05:00:00Z"));
        assert_eq!(read(TimeFormat::default(), "2024-08-08 23:54:32+00:00").as_deref(), Ok("2024-08-08T23:54:32Z"));
    }

    #[test]
    fn summer_time_skips_an_hour_and_doubles_another() {
        assert_eq!(read(new_york(), "2021-03-14 02:30:00"), Err(NotATime::Skipped(Tz::America__New_York)));
        assert_eq!(read(new_york(), "2021-11-07 01:30:00").as_deref(), Ok("2021-11-07T05:30:00Z"));
    }

    #[test]
    fn numbers_are_in_the_declared_unit_and_exact() {
        let seconds = TimeFormat { unit: TimeUnit::Seconds, ..new_york() };
        assert_eq!(TimeFormat::default().text("1612517760002000050"), Ok(Timestamp(1_612_517_760_002_000_050)));
        assert_eq!(seconds.text("1612517760"), Ok(Timestamp(1_612_517_760_000_000_000)));
        assert_eq!(seconds.text("1612517760.5"), Ok(Timestamp(1_612_517_760_500_000_000)));
        assert_eq!(TimeFormat::default().text("1.5"), Err(NotATime::Unreadable));
        assert_eq!(seconds.text("9999999999999999"), Err(NotATime::OutOfRange));
        assert_eq!(seconds.text("1e300"), Err(NotATime::OutOfRange));
        for text in ["", "abc", "NaN", "2021-13-01", "2021-01-01 25:00:00", "1 2"] {
            assert_eq!(seconds.text(text), Err(NotATime::Unreadable), "{text}");
        }
    }
}
