//! Rules that give a date of a year.

use chrono::{Datelike, Days, NaiveDate, TimeDelta, Weekday};
use serde::Deserialize;

/// Where a fixed date is kept that falls on a weekend.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Observed {
    /// Where it falls.
    #[default]
    AsItFalls,
    /// A Saturday's on the Friday before, a Sunday's on the Monday after: rule 7.2 of the New York Stock Exchange.
    NearestWeekday,
    /// A Sunday's on the Monday after, a Saturday's not at all: New Year's Day in New York, whose Friday would end a year's
    /// accounts.
    SundayOnMonday,
    /// A Saturday's and a Sunday's on the Monday after, as in London.
    WeekendOnMonday,
}

impl Observed {
    fn date(self, date: NaiveDate) -> Option<NaiveDate> {
        let days = match (self, date.weekday()) {
            (Self::NearestWeekday, Weekday::Sat) => -1,
            (Self::NearestWeekday | Self::SundayOnMonday | Self::WeekendOnMonday, Weekday::Sun) => 1,
            (Self::WeekendOnMonday, Weekday::Sat) => 2,
            _ => 0,
        };
        moved(date, days)
    }
}

/// What decides the date.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Rule {
    Fixed {
        month: u32,
        day: u32,
        observed: Observed,
    },
    /// The `nth` weekday of a month, from its end where below 0, and some days after it.
    Nth {
        month: u32,
        nth: i32,
        weekday: Weekday,
        offset: i64,
    },
    /// Days after Easter Sunday.
    Easter(i64),
    Dates(Vec<NaiveDate>),
}

impl Rule {
    /// The date it falls on in `year`, which may lie some days beyond that year.
    pub(super) fn in_year(&self, year: i32) -> Option<NaiveDate> {
        match self {
            Self::Fixed { month, day, observed } => {
                NaiveDate::from_ymd_opt(year, *month, *day).and_then(|date| observed.date(date))
            }
            Self::Nth { month, nth, weekday, offset } => {
                nth_weekday(year, *month, *nth, *weekday).and_then(|date| moved(date, *offset))
            }
            Self::Easter(offset) => easter(year).and_then(|date| moved(date, *offset)),
            Self::Dates(_) => None,
        }
    }
}

fn moved(date: NaiveDate, days: i64) -> Option<NaiveDate> {
    date.checked_add_signed(TimeDelta::days(days))
}

fn nth_weekday(year: i32, month: u32, nth: i32, weekday: Weekday) -> Option<NaiveDate> {
    if nth > 0 {
        return NaiveDate::from_weekday_of_month_opt(year, month, weekday, u8::try_from(nth).ok()?);
    }
    let first_of_next = match month {
        12 => NaiveDate::from_ymd_opt(year.checked_add(1)?, 1, 1),
        _ => NaiveDate::from_ymd_opt(year, month + 1, 1),
    };
    let last_day = first_of_next?.pred_opt()?;
    let back = u64::from(last_day.weekday().days_since(weekday)) + 7 * u64::from((-nth - 1).unsigned_abs());
    let date = last_day.checked_sub_days(Days::new(back))?;
    (date.month() == month).then_some(date)
}

/// Easter Sunday of the Gregorian calendar.
///
/// The anonymous algorithm of Nature (20 April 1876), as in J. Meeus, *Astronomical Algorithms*, 2nd ed., chapter 8.
pub(super) fn easter(year: i32) -> Option<NaiveDate> {
    let a = year.rem_euclid(19);
    let (b, c) = (year.div_euclid(100), year.rem_euclid(100));
    let (d, e) = (b.div_euclid(4), b.rem_euclid(4));
    let f = (b + 8).div_euclid(25);
    let g = (b - f + 1).div_euclid(3);
    let h = (19 * a + b - d - g + 15).rem_euclid(30);
    let (i, k) = (c / 4, c % 4);
    let l = (32 + 2 * e + 2 * i - h - k).rem_euclid(7);
    let m = (a + 11 * h + 22 * l) / 451;
    let n = h + l - 7 * m + 114;
    NaiveDate::from_ymd_opt(year, (n / 31).unsigned_abs(), (n % 31 + 1).unsigned_abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn date(year: i32, month: u32, day: u32) -> NaiveDate {
        NaiveDate::from_ymd_opt(year, month, day).unwrap()
    }

    /// Meeus' examples, the earliest and the latest Easter there is, and some years at hand.
    #[test]
    fn easter_is_where_the_tables_have_it() {
        for (year, month, day) in [
            (1818, 3, 22),
            (1943, 4, 25),
            (1954, 4, 18),
            (1991, 3, 31),
            (1992, 4, 19),
            (1993, 4, 11),
            (2000, 4, 23),
            (2024, 3, 31),
            (2025, 4, 20),
            (2026, 4, 5),
            (2038, 4, 25),
        ] {
            assert_eq!(easter(year), Some(date(year, month, day)));
        }
    }

    #[test]
    fn weekdays_are_counted_from_either_end_of_a_month() {
        assert_eq!(nth_weekday(2024, 11, 4, Weekday::Thu), Some(date(2024, 11, 28)));
        assert_eq!(nth_weekday(2024, 5, -1, Weekday::Mon), Some(date(2024, 5, 27)));
        assert_eq!(nth_weekday(2021, 5, -1, Weekday::Mon), Some(date(2021, 5, 31)));
        assert_eq!(nth_weekday(2024, 12, -2, Weekday::Tue), Some(date(2024, 12, 24)));
        assert_eq!(nth_weekday(2024, 2, 5, Weekday::Thu), Some(date(2024, 2, 29)));
        assert_eq!(nth_weekday(2024, 2, 5, Weekday::Fri), None);
        assert_eq!(nth_weekday(2024, 2, -5, Weekday::Fri), None);
    }

    #[test]
    fn a_weekend_moves_a_fixed_date_as_it_is_observed() {
        // 2022-01-01 is a Saturday, 2023-01-01 a Sunday.
        let of = |observed, year| Rule::Fixed { month: 1, day: 1, observed }.in_year(year).unwrap();
        assert_eq!(of(Observed::AsItFalls, 2022), date(2022, 1, 1));
        assert_eq!(of(Observed::NearestWeekday, 2022), date(2021, 12, 31));
        assert_eq!(of(Observed::NearestWeekday, 2023), date(2023, 1, 2));
        assert_eq!(of(Observed::SundayOnMonday, 2022), date(2022, 1, 1));
        assert_eq!(of(Observed::WeekendOnMonday, 2022), date(2022, 1, 3));
    }
}
