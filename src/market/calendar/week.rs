//! The sessions of a week, and the instants at which their local times are.

use chrono::{DateTime, Datelike, Days, LocalResult, NaiveDate, NaiveDateTime, TimeDelta, TimeZone, Utc, WeekdaySet};
use chrono_tz::Tz;

use crate::sim2real::Timestamp;

use super::Hours;
use super::error::{CalendarError, CalendarFault};
use super::table::SessionRow;

/// A day [s], as clocks show it.
const DAY: u32 = 86_400;

/// A session of a week.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Weekly {
    pub days: WeekdaySet,
    /// [s since midnight]
    pub open: u32,
    /// [s since midnight]
    pub close: u32,
    pub from: NaiveDate,
    pub until: NaiveDate,
}

/// What a half day changes: a late open and an early close [s since midnight].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Shorter {
    pub open: Option<u32>,
    pub close: Option<u32>,
}

impl Weekly {
    pub(super) fn of(row: &SessionRow, number: &str) -> Result<Self, CalendarError> {
        let at = |key: &'static str, fault| CalendarError::at(&["session", number, key], fault);
        if row.days.is_empty() {
            return Err(at("days", CalendarFault::NoDays));
        }
        let (from, until) = (row.from.unwrap_or(NaiveDate::MIN), row.until.unwrap_or(NaiveDate::MAX));
        if from > until {
            return Err(at("from", CalendarFault::Backwards { from: from.to_string(), until: until.to_string() }));
        }
        let days = row.days.iter().map(|day| (*day).into()).collect();
        Ok(Self { days, open: row.open.seconds(), close: row.close.seconds(), from, until })
    }

    /// Whether it opens on the evening before the day it belongs to.
    fn opens_the_evening_before(&self) -> bool {
        self.open >= self.close
    }

    /// When it opens, counted from the midnight at which its day begins [s].
    pub(super) fn opens_after_midnight(&self) -> i64 {
        i64::from(self.open) - if self.opens_the_evening_before() { i64::from(DAY) } else { 0 }
    }

    /// Whether both are open at some time of a week in which both are in force.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        const WEEK: i64 = 7 * DAY as i64;
        if self.from > other.until || other.from > self.until {
            return false;
        }
        self.days.iter(chrono::Weekday::Mon).any(|ours| {
            other.days.iter(chrono::Weekday::Mon).any(|theirs| {
                let apart = i64::from(DAY) * i64::from(theirs.days_since(ours));
                let (ours, end) = (self.opens_after_midnight(), i64::from(self.close));
                [apart - WEEK, apart, apart + WEEK].into_iter().any(|apart| {
                    let (theirs, their_end) = (apart + other.opens_after_midnight(), apart + i64::from(other.close));
                    ours < their_end && theirs < end
                })
            })
        })
    }

    pub(super) fn belongs_to(&self, date: NaiveDate) -> bool {
        self.days.contains(date.weekday()) && (self.from..=self.until).contains(&date)
    }

    /// The session of `date`; none where what is shorter leaves nothing of it.
    pub(super) fn hours(&self, date: NaiveDate, zone: Tz, shorter: Option<Shorter>) -> Option<Hours> {
        let midnight = date.and_hms_opt(0, 0, 0)?;
        let at = |seconds: i64| midnight.checked_add_signed(TimeDelta::seconds(seconds));
        let (late, early) = shorter.map_or((None, None), |shorter| (shorter.open, shorter.close));
        let open = late.map(i64::from).unwrap_or(i64::MIN).max(self.opens_after_midnight());
        let close = i64::from(early.unwrap_or(DAY).min(self.close));
        if open >= close {
            return None;
        }
        let (open, close) = (instant(zone, at(open)?)?, instant(zone, at(close)?)?);
        (open < close).then_some(Hours { open, close, date, half_day: shorter.is_some() })
    }
}

/// The first instant at which clocks in `zone` show `local` or a later time.
///
/// Of a time that they pass twice that is the first, and for one that they skip the instant at which they are put forward;
/// so sessions that touch in local time touch as instants.
pub(super) fn instant(zone: Tz, local: NaiveDateTime) -> Option<Timestamp> {
    let instant = match zone.from_local_datetime(&local) {
        LocalResult::Single(instant) | LocalResult::Ambiguous(instant, _) => instant.to_utc(),
        LocalResult::None => skipped(zone, local)?,
    };
    instant.timestamp_nanos_opt().map(Timestamp)
}

/// The instant at which clocks are put forward past `local`, to the second.
fn skipped(zone: Tz, local: NaiveDateTime) -> Option<DateTime<Utc>> {
    // No zone is as much as 26 hours from UTC.
    let margin = TimeDelta::hours(26);
    let mut before = local.and_utc().checked_sub_signed(margin)?;
    let mut after = local.and_utc().checked_add_signed(margin)?;
    while after - before > TimeDelta::seconds(1) {
        let middle = before + TimeDelta::seconds((after - before).num_seconds() / 2);
        if middle.with_timezone(&zone).naive_local() < local { before = middle } else { after = middle }
    }
    Some(after)
}

/// The date that clocks in `zone` show.
pub(super) fn local_date(zone: Tz, time: Timestamp) -> NaiveDate {
    DateTime::from_timestamp_nanos(time.0).with_timezone(&zone).date_naive()
}

/// The dates around those a timestamp can have.
pub(super) fn dates_there_are() -> (NaiveDate, NaiveDate) {
    let date = |time: Timestamp| DateTime::from_timestamp_nanos(time.0).date_naive();
    (date(Timestamp::MIN) - Days::new(1), date(Timestamp::MAX) + Days::new(2))
}
