//! The built-in calendars against what the exchanges published, and against the days on which there was trading.

use chrono::{Datelike, NaiveDate, Weekday};

use super::tests::{at, built_in, date, session};
use super::*;

/// Months and days of a year on which `of` holds.
fn days_of(year: i32, of: impl Fn(NaiveDate) -> bool) -> Vec<(u32, u32)> {
    let days = date(year, 1, 1).iter_days().take_while(|day| day.year() == year);
    days.filter(|day| of(*day)).map(|day| (day.month(), day.day())).collect()
}

fn weekend(date: NaiveDate) -> bool {
    matches!(date.weekday(), Weekday::Sat | Weekday::Sun)
}

/// A year of an exchange as it published it: full closings on weekdays, early closings, sessions.
type Year<'a> = (i32, &'a [(u32, u32)], &'a [(u32, u32)], usize);

/// Holidays and early closings of the New York Stock Exchange, copied by hand from its yearly announcements
/// (<https://www.nyse.com/markets/hours-calendars> and the press releases of earlier years), with the days it was closed at
/// short notice, and the number of trading days that it counts.
const NYSE: &[Year<'_>] = &[
    (
        2001,
        &[
            (1, 1),
            (1, 15),
            (2, 19),
            (4, 13),
            (5, 28),
            (7, 4),
            (9, 3),
            (9, 11),
            (9, 12),
            (9, 13),
            (9, 14),
            (11, 22),
            (12, 25),
        ],
        &[(7, 3), (11, 23), (12, 24)],
        248,
    ),
    (2004, &[(1, 1), (1, 19), (2, 16), (4, 9), (5, 31), (6, 11), (7, 5), (9, 6), (11, 25), (12, 24)], &[(11, 26)], 252),
    (
        2007,
        &[(1, 1), (1, 2), (1, 15), (2, 19), (4, 6), (5, 28), (7, 4), (9, 3), (11, 22), (12, 25)],
        &[(7, 3), (11, 23), (12, 24)],
        251,
    ),
    (
        2012,
        &[(1, 2), (1, 16), (2, 20), (4, 6), (5, 28), (7, 4), (9, 3), (10, 29), (10, 30), (11, 22), (12, 25)],
        &[(7, 3), (11, 23), (12, 24)],
        250,
    ),
    (
        2013,
        &[(1, 1), (1, 21), (2, 18), (3, 29), (5, 27), (7, 4), (9, 2), (11, 28), (12, 25)],
        &[(7, 3), (11, 29), (12, 24)],
        252,
    ),
    (
        2018,
        &[(1, 1), (1, 15), (2, 19), (3, 30), (5, 28), (7, 4), (9, 3), (11, 22), (12, 5), (12, 25)],
        &[(7, 3), (11, 23), (12, 24)],
        251,
    ),
    (2020, &[(1, 1), (1, 20), (2, 17), (4, 10), (5, 25), (7, 3), (9, 7), (11, 26), (12, 25)], &[(11, 27), (12, 24)], 253),
    (2021, &[(1, 1), (1, 18), (2, 15), (4, 2), (5, 31), (7, 5), (9, 6), (11, 25), (12, 24)], &[(11, 26)], 252),
    (2022, &[(1, 17), (2, 21), (4, 15), (5, 30), (6, 20), (7, 4), (9, 5), (11, 24), (12, 26)], &[(11, 25)], 251),
    (
        2023,
        &[(1, 2), (1, 16), (2, 20), (4, 7), (5, 29), (6, 19), (7, 4), (9, 4), (11, 23), (12, 25)],
        &[(7, 3), (11, 24)],
        250,
    ),
    (
        2024,
        &[(1, 1), (1, 15), (2, 19), (3, 29), (5, 27), (6, 19), (7, 4), (9, 2), (11, 28), (12, 25)],
        &[(7, 3), (11, 29), (12, 24)],
        252,
    ),
    (
        2025,
        &[(1, 1), (1, 9), (1, 20), (2, 17), (4, 18), (5, 26), (6, 19), (7, 4), (9, 1), (11, 27), (12, 25)],
        &[(7, 3), (11, 28), (12, 24)],
        250,
    ),
    (
        2026,
        &[(1, 1), (1, 19), (2, 16), (4, 3), (5, 25), (6, 19), (7, 3), (9, 7), (11, 26), (12, 25)],
        &[(11, 27), (12, 24)],
        251,
    ),
    (2027, &[(1, 1), (1, 18), (2, 15), (3, 26), (5, 31), (6, 18), (7, 5), (9, 6), (11, 25), (12, 24)], &[(11, 26)], 251),
];

#[test]
fn new_york_keeps_the_holidays_and_early_closes_it_published() {
    let nyse = built_in("nyse");
    for (year, closed, early, sessions) in NYSE {
        let open = |day: NaiveDate| nyse.sessions_on(day).next();
        assert_eq!(days_of(*year, |day| !weekend(day) && open(day).is_none()), *closed, "{year}");
        assert_eq!(days_of(*year, |day| open(day).is_some_and(|hours| hours.half_day)), *early, "{year}");
        assert_eq!(days_of(*year, |day| open(day).is_some()).len(), *sessions, "{year}");
        assert_eq!(days_of(*year, |day| weekend(day) && open(day).is_some()), [], "{year}");
    }
    assert_eq!(nyse.holiday(date(2012, 10, 30)), Some("Hurricane Sandy"));
    assert_eq!(nyse.holiday(date(2021, 12, 31)), None, "New Year's Day on a Saturday is not kept");
    assert_eq!(nyse.holiday(date(2021, 6, 18)), None, "Juneteenth is kept from 2022 on");
    assert_eq!((nyse.holiday(date(1997, 1, 20)), nyse.holds_from()), (None, Some(date(1998, 1, 1))));
}

/// <https://www.cmegroup.com/trading-hours.html>, the holiday calendars of 2024 to 2026 for equity products.
#[test]
fn chicago_keeps_its_own_holidays() {
    let cme = built_in("cme_globex");
    let closed = |year| days_of(year, |day| !weekend(day) && cme.sessions_on(day).next().is_none());
    let early = |year| days_of(year, |day| cme.sessions_on(day).any(|hours| hours.half_day));
    assert_eq!(closed(2022), [(4, 15), (12, 26)]);
    assert_eq!(closed(2024), [(1, 1), (3, 29), (12, 25)]);
    assert_eq!(early(2024), [(1, 15), (2, 19), (5, 27), (6, 19), (7, 3), (7, 4), (9, 2), (11, 28), (11, 29), (12, 24)]);
    assert_eq!((closed(2025), early(2025)[0]), (vec![(1, 1), (4, 18), (12, 25)], (1, 9)));
    assert_eq!(closed(2026), [(1, 1), (12, 25)]);
    let labor_day = session(&cme, 2024, 9, 2).unwrap();
    assert_eq!((labor_day.open, labor_day.close), (at("2024-09-01T17:00:00-05:00"), at("2024-09-02T12:00:00-05:00")));
    assert_eq!(cme.next_session(labor_day.close).unwrap().open, at("2024-09-02T17:00:00-05:00"));
    assert_eq!(session(&cme, 2026, 4, 3).unwrap().close, at("2026-04-03T08:15:00-05:00"));
    // Christmas: from noon of the 24th to the evening of the 25th.
    let eve = at("2024-12-24T12:15:00-06:00");
    assert_eq!(cme.previous_close(at("2024-12-25T10:00:00-06:00")), Some(eve));
    assert_eq!(cme.next_session(eve).unwrap().open, at("2024-12-25T17:00:00-06:00"));
}

/// Hourly bars of SPY from 1998 to 2021, LEAN's sample data: there are bars on each day with a session and on no other, and
/// less than a fifth of what is traded in a day's last hour stands in bars that begin after its close (late reports). The data are not
/// part of the repository: without them the test says so and ends.
#[cfg(feature = "io")]
#[test]
fn spy_traded_when_new_york_was_open() {
    use crate::io::{Table, TimeFormat};
    use std::collections::BTreeMap;
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = root.join("../shared/data/market/lean/spy_hour_x10000.parquet");
    if !path.is_file() {
        println!("skipped: the hourly bars of SPY are not on this machine");
        return;
    }
    const HOUR: i64 = 3_600_000_000_000;
    let nyse = built_in("nyse");
    let format = TimeFormat { zone: nyse.zone(), ..TimeFormat::default() };
    let table = Table::read(&path).unwrap();
    let bars = table.times("ts_exchange_local", &format).unwrap().into_iter().zip(table.floats_complete("volume").unwrap());
    let mut days: BTreeMap<NaiveDate, Vec<(Timestamp, f64)>> = BTreeMap::new();
    for (time, volume) in bars {
        days.entry(local_date(nyse.zone(), time)).or_default().push((time, volume));
    }
    let (Some(first), Some(end)) = (days.keys().next(), days.keys().next_back()) else { panic!("no bars") };
    for day in first.iter_days().take_while(|day| day <= end) {
        let hours = nyse.sessions_on(day).next();
        assert_eq!(hours.is_some(), days.contains_key(&day), "{day}");
        let Some(hours) = hours else { continue };
        // Up to 2008 funds traded a quarter of an hour longer than shares, on the American Stock Exchange.
        let close = hours.close + if day < date(2009, 1, 1) { HOUR / 4 } else { 0 };
        let sum = |range: std::ops::Range<Timestamp>| -> f64 {
            days[&day].iter().filter(|(time, _)| range.contains(time)).map(|(_, volume)| volume).sum()
        };
        let (last, after) = (sum(hours.close + -HOUR..close), sum(close..Timestamp::MAX));
        assert!(last > 0.0 && after < 0.2 * last, "{day}: {last} in the last hour, {after} after it");
    }
    println!("{} days from {first} to {end}", days.len());
}
