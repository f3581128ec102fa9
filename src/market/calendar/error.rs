//! What is wrong with a calendar's table.

use chrono::NaiveDate;

/// A table that is no calendar: the key it is about, and what is wrong there.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{fault}", if keys.is_empty() { String::new() } else { format!("{}: ", keys.join(".")) })]
pub struct CalendarError {
    /// The way to the key, such as `["holiday", "3", "month"]`; empty where the text is no such table at all.
    pub keys: Vec<String>,
    /// What is wrong.
    pub fault: CalendarFault,
}

/// What can be wrong with a calendar.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CalendarFault {
    /// No calendar of that name comes with the program.
    #[error("unknown calendar `{name}`\nhint: there are {there_are}; another is read from its TOML table")]
    Unknown {
        /// The name asked for.
        name: String,
        /// Those there are.
        there_are: String,
    },
    /// The text is no TOML, or a key or value of it is not one of a calendar.
    #[error("line {line}, column {column}: {message}")]
    Toml {
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What the reader of TOML says, with a hint where there is one.
        message: String,
    },
    /// No session at all.
    #[error("no session\nhint: add a section [[session]] with `days`, `open` and `close`")]
    NoSession,
    /// A session without days.
    #[error("a session on no day\nhint: `days = [\"mon\", \"tue\"]`")]
    NoDays,
    /// Two sessions of the week at the same time.
    #[error(
        "the session overlaps with session {other}\nhint: part them, or give `from` and `until` if one followed the other"
    )]
    Overlap {
        /// Number of the other, from 0.
        other: usize,
    },
    /// A beginning after its end.
    #[error("`from` {from} is after `until` {until}\nhint: exchange them")]
    Backwards {
        /// `from`.
        from: String,
        /// `until`.
        until: String,
    },
    /// Keys that make no rule, or more than one.
    #[error(
        "`{name}` falls on no date or has two rules\nhint: give `month` and `day`; or `month`, `nth` and `weekday`; or \
         `easter`; or `dates`, and no key of another rule"
    )]
    Rule {
        /// Name of the occasion.
        name: String,
    },
    /// A number beyond what a date can have.
    #[error("{found} is beyond {least} to {most}\nhint: {hint}")]
    Beyond {
        /// What was found.
        found: i64,
        /// The least there is.
        least: i64,
        /// The most there is.
        most: i64,
        /// What to do.
        hint: &'static str,
    },
    /// Weekdays of a month are counted from 1, or back from -1.
    #[error("`nth` is 0\nhint: 1 is the first of the month, -1 the last")]
    NoNth,
    /// `month` and `day` that no year has.
    #[error("no year has a day {day} in month {month}\nhint: days of a month go up to 28, 29, 30 or 31")]
    NoSuchDay {
        /// Month.
        month: u32,
        /// Day.
        day: u32,
    },
    /// Listed dates with a key that is for rules.
    #[error("`{key}` does not go with `dates`\nhint: leave it out, and list the dates that count")]
    WithDates {
        /// The key.
        key: &'static str,
    },
    /// A date before the first that the calendar holds for.
    #[error(
        "{date} is before {holds_from}, from which on the calendar holds\nhint: leave it out, or set `holds_from` earlier"
    )]
    BeforeItHolds {
        /// The date.
        date: NaiveDate,
        /// The first date of the calendar.
        holds_from: NaiveDate,
    },
    /// A holiday with hours.
    #[error("a holiday has no `{key}`\nhint: a day with a shorter session is a [[half_day]]")]
    HolidayHours {
        /// `open` or `close`.
        key: &'static str,
    },
    /// A half day without hours.
    #[error("a half day as long as any other\nhint: give `close = \"13:00\"`, or `open` where it begins late")]
    HalfDayHours,
}

impl CalendarError {
    pub(super) fn new(fault: CalendarFault) -> Self {
        Self { keys: Vec::new(), fault }
    }

    pub(super) fn at(keys: &[&str], fault: CalendarFault) -> Self {
        Self { keys: keys.iter().map(|key| (*key).to_owned()).collect(), fault }
    }

    /// The error of the TOML library, with the line and column of its place in `text`.
    pub(super) fn toml(text: &str, error: &toml::de::Error) -> Self {
        let at = error.span().map_or(0, |span| span.start).min(text.len());
        let before = text.get(..at).unwrap_or_default();
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let (line, column) = (1 + before.matches('\n').count(), 1 + before[line_start..].chars().count());
        Self::new(CalendarFault::Toml { line, column, message: error.message().trim().to_owned() })
    }
}
