//! Exchange calendars: when a market is open, from a TOML table of its sessions, holidays and half days.
//!
//! ```toml
//! name = "example"
//! source = "where its hours are published"
//! zone = "America/New_York"             # IANA; all times below are local
//! holds_from = 1998-01-01               # optional
//!
//! [[session]]
//! days = ["mon", "tue", "wed", "thu", "fri"]
//! open = "09:30"                        # not before the close: on the evening before
//! close = "16:00"                       # up to "24:00"
//! from = 1998-01-01                     # optional, as is until
//!
//! [[holiday]]                           # no session of this date
//! name = "Independence Day"
//! month = 7
//! day = 4
//! observed = "nearest_weekday"          # or sunday_on_monday, weekend_on_monday, as_it_falls
//!
//! [[half_day]]                          # begins at `open`, ends at `close`, or both
//! name = "Day after Thanksgiving"
//! month = 11
//! nth = 4                               # -1 is the last
//! weekday = "thu"
//! offset = 1                            # days after that
//! close = "13:00"
//! ```
//!
//! A holiday or half day may also be `easter = -2` (days after Easter Sunday) or `dates = [2001-09-11]`; rules take `from`
//! and `until` (years), `except` (years) and `on` (weekdays it counts on).
//!
//! **Instants.** A session holds its open and not its close. A local time stands for the first instant at which clocks show
//! it or a later one: the first of two where they are put back, and the moment of the change where they skip it. Zones
//! change as the tz database in `chrono-tz` has it.

use chrono::NaiveDate;
use chrono_tz::Tz;
use serde::{Deserialize, Deserializer, de::Error};

use crate::sim2real::Timestamp;

mod cursor;
mod error;
mod occasion;
#[cfg(test)]
mod published;
mod rule;
mod table;
#[cfg(test)]
mod tests;
mod week;

pub use cursor::Trading;
pub use error::{CalendarError, CalendarFault};
pub use rule::Observed;
pub use table::{CalendarTable, Day, LocalTime, OccasionRow, SessionRow};

use occasion::Occasion;
use week::{Shorter, Weekly, dates_there_are, local_date};

/// The calendars that come with the program: name and table.
const BUILT_IN: &[(&str, &str)] = &[
    ("nyse", include_str!("calendar/nyse.toml")),
    ("cme_globex", include_str!("calendar/cme_globex.toml")),
    ("always", include_str!("calendar/always.toml")),
];

/// A session: the market is open from `open` to before `close`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hours {
    /// When it opens.
    pub open: Timestamp,
    /// When it closes.
    pub close: Timestamp,
    /// The day it belongs to: that of its close, in local time.
    pub date: NaiveDate,
    /// Whether the calendar has it open late or close early.
    pub half_day: bool,
}

/// When a market is open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Calendar {
    name: String,
    source: String,
    zone: Tz,
    holds_from: Option<NaiveDate>,
    /// In order of opening.
    weekly: Vec<Weekly>,
    /// The dates there can be sessions on.
    span: (NaiveDate, NaiveDate),
    holidays: Vec<Occasion>,
    half_days: Vec<(Occasion, Shorter)>,
}

impl Calendar {
    /// The names of the calendars that come with the program.
    pub fn names() -> impl Iterator<Item = &'static str> {
        BUILT_IN.iter().map(|(name, _)| *name)
    }

    /// The calendar of that name that comes with the program: `nyse`, `cme_globex` or `always`.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn built_in(name: &str) -> Result<Self, CalendarError> {
        match BUILT_IN.iter().find(|(own, _)| *own == name) {
            Some((_, text)) => Self::parse(text),
            None => {
                let there_are = BUILT_IN.iter().map(|(name, _)| format!("`{name}`")).collect::<Vec<_>>().join(", ");
                Err(CalendarError::new(CalendarFault::Unknown { name: name.to_owned(), there_are }))
            }
        }
    }

    /// The calendar whose TOML table `text` is.
    ///
    /// # Errors
    /// If it is no such table, with line and column; or as [`Calendar::new`].
    pub fn parse(text: &str) -> Result<Self, CalendarError> {
        let table: CalendarTable = toml::from_str(text).map_err(|error| CalendarError::toml(text, &error))?;
        Self::new(&table)
    }

    /// The calendar of a file of the user's.
    ///
    /// # Errors
    /// As [`Calendar::parse`], with the place in the file.
    #[cfg(feature = "io")]
    pub fn of(document: &crate::io::Document) -> Result<Self, crate::io::InputError> {
        let table: CalendarTable = document.parse()?;
        Self::new(&table).map_err(|error| {
            let keys: Vec<&str> = error.keys.iter().map(String::as_str).collect();
            let text = error.fault.to_string();
            let (message, hint) = text.split_once("\nhint: ").unwrap_or((text.as_str(), ""));
            document.error(&keys, message).maybe_hint((!hint.is_empty()).then(|| hint.to_owned()))
        })
    }

    /// The calendar of a table.
    ///
    /// # Errors
    /// If it has no session, two at once, or an occasion that falls on no date; with the keys that lead there.
    pub fn new(table: &CalendarTable) -> Result<Self, CalendarError> {
        let holidays = occasions(table, "holiday", &table.holidays)?;
        for (k, row) in table.holidays.iter().enumerate() {
            let hours = [("open", row.open), ("close", row.close)];
            if let Some((key, _)) = hours.into_iter().find(|(_, time)| time.is_some()) {
                let keys = ["holiday", &k.to_string(), key];
                return Err(CalendarError::at(&keys, CalendarFault::HolidayHours { key }));
            }
        }
        let mut half_days = Vec::with_capacity(table.half_days.len());
        for (k, (row, occasion)) in table.half_days.iter().zip(occasions(table, "half_day", &table.half_days)?).enumerate() {
            let shorter = Shorter { open: row.open.map(LocalTime::seconds), close: row.close.map(LocalTime::seconds) };
            if shorter == Shorter::default() {
                return Err(CalendarError::at(&["half_day", &k.to_string()], CalendarFault::HalfDayHours));
            }
            half_days.push((occasion, shorter));
        }
        let weekly = week(&table.sessions)?;
        let (first, last) = dates_there_are();
        let from = weekly.iter().map(|session| session.from).min().map_or(first, |from| from.max(first));
        let until = weekly.iter().map(|session| session.until).max().map_or(last, |until| until.min(last));
        let CalendarTable { name, source, zone, holds_from, .. } = table;
        Ok(Self {
            name: name.clone(),
            source: source.clone(),
            zone: *zone,
            holds_from: *holds_from,
            weekly,
            span: (from, until),
            holidays,
            half_days,
        })
    }

    /// Name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where its hours and holidays were published.
    #[must_use]
    pub fn source(&self) -> &str {
        &self.source
    }

    /// The zone of its local times.
    #[must_use]
    pub fn zone(&self) -> Tz {
        self.zone
    }

    /// The first date it holds for, where it says so. Before it, its rules are followed all the same: whether that will do
    /// is for the caller to say.
    #[must_use]
    pub fn holds_from(&self) -> Option<NaiveDate> {
        self.holds_from
    }

    /// The date in its zone at `time`.
    #[must_use]
    pub fn date_at(&self, time: Timestamp) -> NaiveDate {
        local_date(self.zone, time)
    }

    /// The holiday kept on `date`, by its name.
    #[must_use]
    pub fn holiday(&self, date: NaiveDate) -> Option<&str> {
        self.holidays.iter().find(|holiday| holiday.falls_on(date)).map(|holiday| holiday.name.as_str())
    }

    /// The sessions that belong to `date`, in order.
    pub fn sessions_on(&self, date: NaiveDate) -> impl DoubleEndedIterator<Item = Hours> {
        // What is asked of most days is asked of none on which there is no session.
        let any = self.weekly.iter().any(|session| session.belongs_to(date)) && self.holiday(date).is_none();
        let shorter = if any { self.shorter(date) } else { None };
        let of_date = self.weekly.iter().filter(move |session| any && session.belongs_to(date));
        of_date.filter_map(move |session| session.hours(date, self.zone, shorter))
    }

    /// The day of trading of `date`: from the open of its first session to the close of its last, breaks between them
    /// included.
    #[must_use]
    pub fn day(&self, date: NaiveDate) -> Option<Hours> {
        self.sessions_on(date).reduce(|day, session| Hours {
            close: session.close,
            half_day: day.half_day || session.half_day,
            ..day
        })
    }

    /// What shortens the sessions of `date`: of several half days, the latest open and the earliest close.
    fn shorter(&self, date: NaiveDate) -> Option<Shorter> {
        let of_date = self.half_days.iter().filter(|(occasion, _)| occasion.falls_on(date)).map(|(_, shorter)| *shorter);
        of_date.reduce(|one, other| Shorter {
            open: one.open.max(other.open),
            close: one.close.into_iter().chain(other.close).min(),
        })
    }

    /// Whether the market is open: at the instant of the open it is, at that of the close no longer.
    #[must_use]
    pub fn is_open(&self, time: Timestamp) -> bool {
        self.session_at(time).is_some()
    }

    /// The session at `time`, if the market is open.
    #[must_use]
    pub fn session_at(&self, time: Timestamp) -> Option<Hours> {
        let (first, last) = self.around(time);
        let near = first.iter_days().take_while(|date| *date <= last).take(3);
        near.flat_map(|date| self.sessions_on(date)).find(|hours| (hours.open..hours.close).contains(&time))
    }

    /// The first session that opens after `after`; not the one that opens at that very instant.
    #[must_use]
    pub fn next_session(&self, after: Timestamp) -> Option<Hours> {
        let (first, last) = self.around(after);
        let dates = first.iter_days().take_while(|date| *date <= last);
        dates.flat_map(|date| self.sessions_on(date)).find(|hours| hours.open > after)
    }

    /// The last session that has closed at `time`; one that closes at that very instant has.
    #[must_use]
    pub fn previous_session(&self, time: Timestamp) -> Option<Hours> {
        let (first, last) = self.span;
        let mut date = self.around(time).0 + chrono::Days::new(2);
        date = date.min(last);
        while date >= first {
            if let Some(hours) = self.sessions_on(date).rev().find(|hours| hours.close <= time) {
                return Some(hours);
            }
            date = date.pred_opt()?;
        }
        None
    }

    /// When the market closed last; at the instant of a close, that instant.
    #[must_use]
    pub fn previous_close(&self, time: Timestamp) -> Option<Timestamp> {
        self.previous_session(time).map(|hours| hours.close)
    }

    /// The first date whose sessions may hold `time` or follow it, and the last date there is: a session of a date begins on
    /// the evening before at the earliest, and clocks put back at midnight may show the date before once more.
    fn around(&self, time: Timestamp) -> (NaiveDate, NaiveDate) {
        let date = local_date(self.zone, time) - chrono::Days::new(1);
        (date.max(self.span.0), self.span.1)
    }
}

impl<'de> Deserialize<'de> for Calendar {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::new(&CalendarTable::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

/// The occasions of `rows`, which stand under `key`.
fn occasions(table: &CalendarTable, key: &str, rows: &[OccasionRow]) -> Result<Vec<Occasion>, CalendarError> {
    let one = |(k, row): (usize, &OccasionRow)| {
        let number = k.to_string();
        let occasion = Occasion::of(row, [key, &number])?;
        if let Some(holds_from) = table.holds_from
            && let Some(date) = occasion.listed_before(holds_from)
        {
            return Err(CalendarError::at(&[key, &number, "dates"], CalendarFault::BeforeItHolds { date, holds_from }));
        }
        Ok(occasion)
    };
    rows.iter().enumerate().map(one).collect()
}

/// The sessions of a week, no two of them at once, in the order in which those of a day open.
fn week(rows: &[SessionRow]) -> Result<Vec<Weekly>, CalendarError> {
    if rows.is_empty() {
        return Err(CalendarError::new(CalendarFault::NoSession));
    }
    let mut weekly = Vec::with_capacity(rows.len());
    for (k, row) in rows.iter().enumerate() {
        let session = Weekly::of(row, &k.to_string())?;
        if let Some(other) = weekly.iter().position(|other| session.overlaps(other)) {
            return Err(CalendarError::at(&["session", &k.to_string()], CalendarFault::Overlap { other }));
        }
        weekly.push(session);
    }
    weekly.sort_by_key(Weekly::opens_after_midnight);
    Ok(weekly)
}
