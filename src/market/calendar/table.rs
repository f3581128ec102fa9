//! A calendar as its TOML table has it, before it is checked.

use chrono::{NaiveDate, Weekday};
use chrono_tz::Tz;
use serde::{Deserialize, Deserializer, de::Error};

use super::rule::Observed;

/// The table of a calendar: what [`Calendar::new`](super::Calendar::new) is made from.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalendarTable {
    /// Name.
    pub name: String,
    /// Where its hours and holidays were published.
    pub source: String,
    /// IANA zone in which all its times are local.
    #[serde(deserialize_with = "zone")]
    pub zone: Tz,
    /// The first date it holds for; by default it is taken to hold for any.
    #[serde(default, deserialize_with = "maybe_date")]
    pub holds_from: Option<NaiveDate>,
    /// Sessions of a week.
    #[serde(rename = "session")]
    pub sessions: Vec<SessionRow>,
    /// Dates without a session.
    #[serde(default, rename = "holiday")]
    pub holidays: Vec<OccasionRow>,
    /// Dates with a shorter one.
    #[serde(default, rename = "half_day")]
    pub half_days: Vec<OccasionRow>,
}

/// A session of a week.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionRow {
    /// Days it belongs to: the day it closes on.
    pub days: Vec<Day>,
    /// Opens at; where that is not before the close, on the evening before.
    pub open: LocalTime,
    /// Closes at, up to 24:00.
    pub close: LocalTime,
    /// The first date it belongs to.
    #[serde(default, deserialize_with = "maybe_date")]
    pub from: Option<NaiveDate>,
    /// The last.
    #[serde(default, deserialize_with = "maybe_date")]
    pub until: Option<NaiveDate>,
}

/// A holiday or a half day. It has `month` and `day`; or `month`, `nth` and `weekday`; or `easter`; or `dates`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OccasionRow {
    /// Name.
    pub name: String,
    /// Month, 1 to 12.
    pub month: Option<u32>,
    /// Day of the month, 1 to 31; 29 February is there in leap years alone.
    pub day: Option<u32>,
    /// Where a `day` is kept that falls on a weekend.
    pub observed: Option<Observed>,
    /// Which `weekday` of the month: 1 the first, -1 the last.
    pub nth: Option<i32>,
    /// Day of the week.
    pub weekday: Option<Day>,
    /// Days after that weekday.
    pub offset: Option<i64>,
    /// Days after Easter Sunday: -2 is Good Friday.
    pub easter: Option<i64>,
    /// Dates one by one.
    #[serde(default, deserialize_with = "dates")]
    pub dates: Option<Vec<NaiveDate>>,
    /// Counts only where it falls on one of these.
    pub on: Option<Vec<Day>>,
    /// First year.
    pub from: Option<i32>,
    /// Last year.
    pub until: Option<i32>,
    /// Years without it.
    pub except: Option<Vec<i32>>,
    /// Of a half day: opens late, at.
    pub open: Option<LocalTime>,
    /// Of a half day: closes early, at.
    pub close: Option<LocalTime>,
}

/// A day of the week.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs, reason = "they are their names")]
pub enum Day {
    Mon,
    Tue,
    Wed,
    Thu,
    Fri,
    Sat,
    Sun,
}

impl From<Day> for Weekday {
    fn from(day: Day) -> Self {
        match day {
            Day::Mon => Self::Mon,
            Day::Tue => Self::Tue,
            Day::Wed => Self::Wed,
            Day::Thu => Self::Thu,
            Day::Fri => Self::Fri,
            Day::Sat => Self::Sat,
            Day::Sun => Self::Sun,
        }
    }
}

/// A local time of a day, 00:00 to 24:00 [s since midnight].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LocalTime(u32);

impl LocalTime {
    /// Seconds since midnight, as the clock shows them [s].
    #[must_use]
    pub fn seconds(self) -> u32 {
        self.0
    }

    /// The time that `text` gives as hours and minutes, and maybe seconds.
    #[must_use]
    pub fn of(text: &str) -> Option<Self> {
        let mut parts = text.split(':').map(|part| {
            let digits = part.len() == 2 && part.bytes().all(|b| b.is_ascii_digit());
            digits.then(|| part.parse::<u32>().ok()).flatten()
        });
        let (hours, minutes) = (parts.next()??, parts.next()??);
        let seconds = parts.next().unwrap_or(Some(0))?;
        let time = hours * 3_600 + minutes * 60 + seconds;
        (parts.next().is_none() && minutes < 60 && seconds < 60 && time <= 86_400).then_some(Self(time))
    }
}

impl<'de> Deserialize<'de> for LocalTime {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::of(&text).ok_or_else(|| {
            D::Error::custom(format!(
                "expected a local time, found {text:?}\nhint: write \"09:30\", from \"00:00\" to \"24:00\""
            ))
        })
    }
}

fn zone<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Tz, D::Error> {
    let text = String::deserialize(deserializer)?;
    text.parse().map_err(|_| {
        D::Error::custom(format!("unknown zone {text:?}\nhint: give an IANA name, such as \"America/New_York\" or \"UTC\""))
    })
}

fn date<E: Error>(found: toml::value::Datetime) -> Result<NaiveDate, E> {
    let date = match (found.date, found.time, found.offset) {
        (Some(date), None, None) => NaiveDate::from_ymd_opt(date.year.into(), date.month.into(), date.day.into()),
        _ => None,
    };
    date.ok_or_else(|| E::custom(format!("expected a date, found {found}\nhint: write it without quotes, as 2001-09-11")))
}

fn maybe_date<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<NaiveDate>, D::Error> {
    toml::value::Datetime::deserialize(deserializer).and_then(date).map(Some)
}

fn dates<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Vec<NaiveDate>>, D::Error> {
    let found = Vec::<toml::value::Datetime>::deserialize(deserializer)?;
    found.into_iter().map(date).collect::<Result<_, _>>().map(Some)
}
