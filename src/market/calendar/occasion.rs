//! Holidays and half days: a rule, and the years and weekdays it holds for.

use chrono::{Datelike, NaiveDate, WeekdaySet};

use super::error::{CalendarError, CalendarFault};
use super::rule::Rule;
use super::table::OccasionRow;

/// A rule and the years and weekdays it holds for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Occasion {
    pub name: String,
    pub rule: Rule,
    /// It counts where it falls on one of these, by default on any.
    pub on: WeekdaySet,
    /// First and last year; the year is that of the date before it is moved to a weekday.
    pub years: (i32, i32),
    /// Years without it.
    pub except: Vec<i32>,
}

impl Occasion {
    pub(super) fn falls_on(&self, date: NaiveDate) -> bool {
        if let Rule::Dates(dates) = &self.rule {
            return dates.contains(&date);
        }
        if !self.on.contains(date.weekday()) {
            return false;
        }
        // What is moved to a weekday, or counted from one, may leave its year.
        let (before, after) = (i32::from(date.month() == 1), i32::from(date.month() == 12));
        (date.year() - before..=date.year() + after).any(|year| self.kept_in(year) && self.rule.in_year(year) == Some(date))
    }

    fn kept_in(&self, year: i32) -> bool {
        (self.years.0..=self.years.1).contains(&year) && !self.except.contains(&year)
    }
}

/// What a row holds must be within these, or no year has the date.
const MONTHS: (i64, i64, &str) = (1, 12, "months are 1 to 12");
const NTH: (i64, i64, &str) = (-5, 5, "a month has five at most; 1 is its first, -1 its last");
const OFFSET: (i64, i64, &str) = (-7, 7, "count from the nearest weekday there is");
const EASTER: (i64, i64, &str) = (-70, 70, "Good Friday is -2, Whit Monday 50");

impl Occasion {
    /// The occasion a row of the table stands for; `keys` lead to the row.
    pub(super) fn of(row: &OccasionRow, keys: [&str; 2]) -> Result<Self, CalendarError> {
        let at = |key: &'static str, fault| CalendarError::at(&[keys[0], keys[1], key], fault);
        let within = |key: &'static str, found: i64, (least, most, hint): (i64, i64, &'static str)| {
            let beyond = !(least..=most).contains(&found);
            if beyond { Err(at(key, CalendarFault::Beyond { found, least, most, hint })) } else { Ok(()) }
        };
        let no_rule = || CalendarError::at(&keys, CalendarFault::Rule { name: row.name.clone() });
        let fixed = row.observed.is_none();
        let counted = row.weekday.is_none() && row.nth.is_none() && row.offset.is_none();
        let rule = match (row.month, row.day, row.nth.zip(row.weekday), row.easter, &row.dates) {
            (Some(month), Some(day), None, None, None) if counted => {
                within("month", month.into(), MONTHS)?;
                // 2000 was a leap year.
                if NaiveDate::from_ymd_opt(2000, month, day).is_none() {
                    return Err(at("day", CalendarFault::NoSuchDay { month, day }));
                }
                Rule::Fixed { month, day, observed: row.observed.unwrap_or_default() }
            }
            (Some(month), None, Some((nth, weekday)), None, None) if fixed => {
                let offset = row.offset.unwrap_or(0);
                within("month", month.into(), MONTHS)?;
                within("nth", nth.into(), NTH)?;
                if nth == 0 {
                    return Err(at("nth", CalendarFault::NoNth));
                }
                within("offset", offset, OFFSET)?;
                Rule::Nth { month, nth, weekday: weekday.into(), offset }
            }
            (None, None, None, Some(days), None) if fixed && counted => {
                within("easter", days, EASTER)?;
                Rule::Easter(days)
            }
            (None, None, None, None, Some(dates)) if fixed && counted => {
                if let Some(key) = key_for_rules(row) {
                    return Err(at(key, CalendarFault::WithDates { key }));
                }
                Rule::Dates(dates.clone())
            }
            _ => return Err(no_rule()),
        };
        let years = (row.from.unwrap_or(i32::MIN), row.until.unwrap_or(i32::MAX));
        if years.0 > years.1 {
            let (from, until) = (years.0.to_string(), years.1.to_string());
            return Err(at("from", CalendarFault::Backwards { from, until }));
        }
        let on = row.on.as_ref().map_or(WeekdaySet::ALL, |days| days.iter().map(|day| (*day).into()).collect());
        Ok(Self { name: row.name.clone(), rule, on, years, except: row.except.clone().unwrap_or_default() })
    }

    /// The first date that is listed before `holds_from`.
    pub(super) fn listed_before(&self, holds_from: NaiveDate) -> Option<NaiveDate> {
        match &self.rule {
            Rule::Dates(dates) => dates.iter().copied().find(|date| *date < holds_from),
            _ => None,
        }
    }
}

/// The first key of `row` that goes with a rule only.
fn key_for_rules(row: &OccasionRow) -> Option<&'static str> {
    let keys = [
        ("on", row.on.is_some()),
        ("from", row.from.is_some()),
        ("until", row.until.is_some()),
        ("except", row.except.is_some()),
    ];
    keys.into_iter().find(|(_, there)| *there).map(|(key, _)| key)
}

#[cfg(test)]
mod tests {
    use super::super::rule::Observed;
    use super::*;

    #[test]
    fn a_holiday_may_be_kept_in_the_year_before() {
        let new_year = Occasion {
            name: "New Year's Day".into(),
            rule: Rule::Fixed { month: 1, day: 1, observed: Observed::NearestWeekday },
            on: WeekdaySet::ALL,
            years: (2022, 2023),
            except: vec![],
        };
        let falls_on = |year, month, day| new_year.falls_on(NaiveDate::from_ymd_opt(year, month, day).unwrap());
        assert!(falls_on(2021, 12, 31) && !falls_on(2022, 1, 1), "1 January 2022 is a Saturday");
        assert!(falls_on(2023, 1, 2) && !falls_on(2024, 1, 1));
    }
}
