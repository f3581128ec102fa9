//! Sessions around opens, closes and changes of clocks; what is refused; and the cursor against the calendar.

use std::sync::Arc;

use chrono::{DateTime, NaiveDate};
use proptest::prelude::*;

use super::*;

pub(super) fn built_in(name: &str) -> Calendar {
    Calendar::built_in(name).unwrap()
}

pub(super) fn date(year: i32, month: u32, day: u32) -> NaiveDate {
    NaiveDate::from_ymd_opt(year, month, day).unwrap()
}

pub(super) fn at(text: &str) -> Timestamp {
    Timestamp(DateTime::parse_from_rfc3339(text).unwrap().timestamp_nanos_opt().unwrap())
}

/// The one session of a date.
pub(super) fn session(calendar: &Calendar, year: i32, month: u32, day: u32) -> Option<Hours> {
    let mut sessions = calendar.sessions_on(date(year, month, day));
    let first = sessions.next();
    assert!(sessions.next().is_none());
    first
}

fn utc(hours: Hours) -> (String, String) {
    (hours.open.to_string(), hours.close.to_string())
}

#[test]
fn an_early_close_is_at_one_and_a_late_open_at_noon() {
    let nyse = built_in("nyse");
    let hours = session(&nyse, 2024, 11, 29).unwrap();
    assert_eq!(utc(hours), ("2024-11-29T14:30:00Z".into(), "2024-11-29T18:00:00Z".into()));
    let hours = session(&nyse, 2024, 7, 3).unwrap();
    assert_eq!(utc(hours), ("2024-07-03T13:30:00Z".into(), "2024-07-03T17:00:00Z".into()));
    let hours = session(&nyse, 2002, 9, 11).unwrap();
    assert_eq!(utc(hours), ("2002-09-11T16:00:00Z".into(), "2002-09-11T20:00:00Z".into()));
    // Of 2002 the Friday after the 4th was short, of 2013 the Wednesday before it.
    assert!(session(&nyse, 2002, 7, 5).unwrap().half_day && !session(&nyse, 2002, 7, 3).unwrap().half_day);
    assert!(session(&nyse, 2013, 7, 3).unwrap().half_day && !session(&nyse, 2013, 7, 5).unwrap().half_day);
}

#[test]
fn a_session_holds_its_open_and_not_its_close() {
    let nyse = built_in("nyse");
    let (open, close) = (at("2024-03-08T09:30:00-05:00"), at("2024-03-08T16:00:00-05:00"));
    assert!(!nyse.is_open(open + -1) && nyse.is_open(open) && nyse.is_open(close + -1) && !nyse.is_open(close));
    let hours = nyse.session_at(open).unwrap();
    assert_eq!((hours.open, hours.close, hours.date, hours.half_day), (open, close, date(2024, 3, 8), false));
    // Before a weekend at the end of which clocks are put forward.
    let monday = at("2024-03-11T09:30:00-04:00");
    assert_eq!(nyse.next_session(open).unwrap().open, monday);
    assert_eq!(nyse.next_session(open + -1).unwrap().open, open);
    assert_eq!(nyse.previous_close(close), Some(close));
    assert_eq!(nyse.previous_close(close + -1), Some(at("2024-03-07T16:00:00-05:00")));
    assert_eq!(nyse.previous_close(monday), Some(close));
}

/// Clocks changed on 2024-03-10 and on 2024-11-03.
#[test]
fn in_summer_a_session_is_an_hour_earlier_in_universal_time() {
    let (nyse, cme) = (built_in("nyse"), built_in("cme_globex"));
    for (month, day, open, close) in
        [(3, 8, "14:30", "21:00"), (3, 11, "13:30", "20:00"), (11, 1, "13:30", "20:00"), (11, 4, "14:30", "21:00")]
    {
        let expected = |time| format!("2024-{month:02}-{day:02}T{time}:00Z");
        assert_eq!(utc(session(&nyse, 2024, month, day).unwrap()), (expected(open), expected(close)));
    }
    // Clocks change within the hour in which no future trades: Chicago opens at 17:00 of the new time.
    let hours = session(&cme, 2024, 3, 11).unwrap();
    assert_eq!(utc(hours), ("2024-03-10T22:00:00Z".into(), "2024-03-11T21:00:00Z".into()));
    let hours = session(&cme, 2024, 11, 4).unwrap();
    assert_eq!(utc(hours), ("2024-11-03T23:00:00Z".into(), "2024-11-04T22:00:00Z".into()));
    assert_eq!(utc(session(&cme, 2024, 3, 8).unwrap()).0, "2024-03-07T23:00:00Z");
}

#[test]
fn chicago_opens_on_sunday_evening_and_halts_an_hour_a_day() {
    let cme = built_in("cme_globex");
    let sunday = at("2024-06-09T17:00:00-05:00");
    assert!(!cme.is_open(sunday + -1) && cme.is_open(sunday));
    assert_eq!(cme.session_at(sunday).unwrap().date, date(2024, 6, 10));
    let halt = at("2024-06-10T16:00:00-05:00");
    assert!(cme.is_open(halt + -1) && !cme.is_open(halt) && !cme.is_open(halt + 3_599_999_999_999));
    assert_eq!(cme.next_session(halt).unwrap().open, at("2024-06-10T17:00:00-05:00"));
    // From Friday afternoon to Sunday evening.
    let friday = at("2024-06-14T16:00:00-05:00");
    assert_eq!(cme.next_session(friday).unwrap().open, at("2024-06-16T17:00:00-05:00"));
    assert_eq!(cme.previous_close(at("2024-06-16T12:00:00-05:00")), Some(friday));
}

#[test]
fn a_year_ends_without_a_gap_in_the_calendar() {
    let (nyse, cme) = (built_in("nyse"), built_in("cme_globex"));
    let hours = nyse.next_session(at("2024-12-31T16:00:00-05:00")).unwrap();
    assert_eq!((hours.date, hours.open), (date(2025, 1, 2), at("2025-01-02T09:30:00-05:00")));
    assert_eq!(nyse.previous_close(hours.open), Some(at("2024-12-31T16:00:00-05:00")));
    let hours = cme.next_session(at("2025-12-31T16:00:00-06:00")).unwrap();
    assert_eq!((hours.date, hours.open), (date(2026, 1, 2), at("2026-01-01T17:00:00-06:00")));
    assert_eq!(nyse.session_at(at("2021-12-31T15:00:00-05:00")).unwrap().date, date(2021, 12, 31));
}

#[test]
fn always_is_always() {
    let always = built_in("always");
    for time in [Timestamp(0), Timestamp(-1), at("2024-02-29T23:59:59.999999999Z"), at("2024-03-01T00:00:00Z")] {
        let hours = always.session_at(time).unwrap();
        assert!(always.is_open(time) && hours.close - hours.open == 86_400_000_000_000);
        assert_eq!(always.next_session(time).unwrap().open, hours.close);
        assert_eq!(always.previous_close(time), Some(hours.open));
    }
}

fn of(sessions: &str, zone: &str) -> Result<Calendar, CalendarError> {
    Calendar::parse(&format!("name = 'x'\nsource = 'a test'\nzone = '{zone}'\n{sessions}"))
}

/// New York skips 02:00 to 03:00 on 2024-03-10 and passes 01:00 to 02:00 twice on 2024-11-03.
#[test]
fn a_local_time_that_is_skipped_or_passed_twice_is_the_first_instant_at_or_after_it() {
    let night = "[[session]]\ndays = ['sun']\nopen = '01:30'\nclose = '02:30'\n\
                 [[session]]\ndays = ['sun']\nopen = '02:30'\nclose = '04:00'\n";
    let night = of(night, "America/New_York").unwrap();
    let hours: Vec<_> = night.sessions_on(date(2024, 3, 10)).map(utc).collect();
    let change = "2024-03-10T07:00:00Z".to_owned();
    assert_eq!(hours[0], ("2024-03-10T06:30:00Z".into(), change.clone()));
    assert_eq!(hours[1], (change, "2024-03-10T08:00:00Z".into()));
    let hours: Vec<_> = night.sessions_on(date(2024, 11, 3)).map(utc).collect();
    assert_eq!(
        hours[0],
        ("2024-11-03T05:30:00Z".into(), "2024-11-03T07:30:00Z".into()),
        "two hours by the clock on the wall"
    );
    // A session that lies within the hour that is skipped does not take place.
    let skipped = of("[[session]]\ndays = ['sun']\nopen = '02:10'\nclose = '02:50'\n", "America/New_York").unwrap();
    assert_eq!(skipped.sessions_on(date(2024, 3, 10)).count(), 0);
    assert_eq!(skipped.next_session(at("2024-03-09T00:00:00Z")).unwrap().date, date(2024, 3, 17));
    // Clocks of Sao Paulo were put forward at midnight: days of 24 hours still touch.
    let days = "[[session]]\ndays = ['mon', 'tue', 'wed', 'thu', 'fri', 'sat', 'sun']\nopen = '00:00'\nclose = '24:00'\n";
    let days = of(days, "America/Sao_Paulo").unwrap();
    let (saturday, sunday) = (session(&days, 2018, 11, 3).unwrap(), session(&days, 2018, 11, 4).unwrap());
    assert_eq!((saturday.close, sunday.open), (at("2018-11-04T03:00:00Z"), at("2018-11-04T03:00:00Z")));
    assert_eq!(sunday.close - sunday.open, 23 * 3_600_000_000_000);
    // Samoa left out 30 December 2011.
    let days = "[[session]]\ndays = ['fri', 'sat']\nopen = '09:00'\nclose = '17:00'\n";
    let samoa = of(days, "Pacific/Apia").unwrap();
    assert_eq!(samoa.sessions_on(date(2011, 12, 30)).count(), 0);
}

#[test]
fn a_lunch_break_is_two_sessions_and_a_half_day_has_the_first() {
    let text = "[[session]]\ndays = ['mon', 'tue']\nopen = '13:00'\nclose = '16:00'\n\
                [[session]]\ndays = ['mon', 'tue']\nopen = '09:30'\nclose = '12:00'\nuntil = 2024-12-31\n\
                [[half_day]]\nname = 'eve'\ndates = [2024-12-24]\nclose = '12:00'\n";
    let calendar = of(text, "Asia/Hong_Kong").unwrap();
    let monday: Vec<_> = calendar.sessions_on(date(2024, 12, 23)).map(utc).collect();
    assert_eq!(monday[0], ("2024-12-23T01:30:00Z".into(), "2024-12-23T04:00:00Z".into()));
    assert_eq!(monday[1].0, "2024-12-23T05:00:00Z");
    let day = |d| calendar.day(date(2024, 12, d)).map(utc);
    assert_eq!(day(23), Some(("2024-12-23T01:30:00Z".into(), "2024-12-23T08:00:00Z".into())), "both, and the break");
    assert_eq!((day(24).map(|day| day.1), day(25)), (Some("2024-12-24T04:00:00Z".into()), None));
    assert_eq!(calendar.sessions_on(date(2024, 12, 24)).count(), 1);
    assert_eq!(calendar.sessions_on(date(2025, 1, 6)).count(), 1);
}

#[test]
fn a_market_that_ended_never_opens_again() {
    let calendar =
        of("[[session]]\ndays = ['mon']\nopen = '09:00'\nclose = '10:00'\nfrom = 2000-01-01\nuntil = 2001-01-01\n", "UTC");
    let calendar = calendar.unwrap();
    assert_eq!(calendar.next_session(at("2002-01-01T00:00:00Z")), None);
    assert_eq!(calendar.previous_close(at("2200-01-01T00:00:00Z")), Some(at("2001-01-01T10:00:00Z")));
    assert_eq!(calendar.previous_close(at("1999-01-01T00:00:00Z")), None);
    assert_eq!(calendar.next_session(Timestamp::MIN).unwrap().date, date(2000, 1, 3));
    let mut trading = Trading::new(Arc::new(calendar.clone()));
    for time in [Timestamp::MAX, Timestamp::MIN, at("2000-01-03T09:30:00Z"), Timestamp::MAX] {
        assert_eq!(trading.session_at(time), calendar.session_at(time));
        assert_eq!(trading.next_session(time), calendar.next_session(time));
    }
}

#[test]
fn tables_that_cannot_be_are_refused_with_place_and_hint() {
    let day = "[[session]]\ndays = ['mon']\nopen = '09:00'\nclose = '10:00'\n";
    let error = |text: &str| of(text, "UTC").unwrap_err().to_string();
    let with = |text: &str| error(&format!("{day}{text}"));
    insta::assert_snapshot!(error(""), @"line 1, column 1: missing field `session`");
    insta::assert_snapshot!(error("session = []\n"), @r"
    no session
    hint: add a section [[session]] with `days`, `open` and `close`
    ");
    insta::assert_snapshot!(error("[[session]]\ndays = ['mon']\nopen = '9.30'\nclose = '10:00'\n"), @r#"
    line 6, column 8: expected a local time, found "9.30"
    hint: write "09:30", from "00:00" to "24:00"
    "#);
    insta::assert_snapshot!(with("[[session]]\ndays = ['tue']\nopen = '09:30'\nclose = '09:15'\n\
                                  [[session]]\ndays = ['mon']\nopen = '09:45'\nclose = '10:15'\n"), @r"
    session.1: the session overlaps with session 0
    hint: part them, or give `from` and `until` if one followed the other
    ");
    insta::assert_snapshot!(with("[[holiday]]\nname = 'Labor Day'\nmonth = 9\nweekday = 'mon'\n"), @r"
    holiday.0: `Labor Day` falls on no date or has two rules
    hint: give `month` and `day`; or `month`, `nth` and `weekday`; or `easter`; or `dates`, and no key of another rule
    ");
    insta::assert_snapshot!(with("[[holiday]]\nname = 'x'\nmonth = 2\nday = 30\n"), @r"
    holiday.0.day: no year has a day 30 in month 2
    hint: days of a month go up to 28, 29, 30 or 31
    ");
    insta::assert_snapshot!(with("[[holiday]]\nname = 'x'\nmonth = 2\nnth = 0\nweekday = 'mon'\n"), @r"
    holiday.0.nth: `nth` is 0
    hint: 1 is the first of the month, -1 the last
    ");
    insta::assert_snapshot!(with("[[holiday]]\nname = 'x'\ndates = [2001-09-11]\nclose = '13:00'\n"), @r"
    holiday.0.close: a holiday has no `close`
    hint: a day with a shorter session is a [[half_day]]
    ");
    insta::assert_snapshot!(with("[[half_day]]\nname = 'x'\neaster = 1\n"), @r#"
    half_day.0: a half day as long as any other
    hint: give `close = "13:00"`, or `open` where it begins late
    "#);
    insta::assert_snapshot!(with("[[half_day]]\nname = 'x'\ndates = [2001-09-11]\nfrom = 2000\nclose = '13:00'\n"), @r"
    half_day.0.from: `from` does not go with `dates`
    hint: leave it out, and list the dates that count
    ");
    insta::assert_snapshot!(with("[[holiday]]\nname = 'x'\ndates = [2001-09-11T09:00:00]\n"), @r"
    line 10, column 9: expected a date, found 2001-09-11T09:00:00
    hint: write it without quotes, as 2001-09-11
    ");
    insta::assert_snapshot!(Calendar::built_in("nise").unwrap_err().to_string(), @r"
    unknown calendar `nise`
    hint: there are `nyse`, `cme_globex`, `always`; another is read from its TOML table
    ");
    assert!(of(day, "America/New_Jersey").unwrap_err().to_string().contains("unknown zone"));
    assert!(with("[[holiday]]\nname = 'x'\neastr = -2\n").contains("unknown field `eastr`"));
}

#[cfg(feature = "io")]
#[test]
fn a_document_of_the_user_is_refused_at_its_place() {
    let text = "name = 'x'\nsource = 'x'\nzone = 'UTC'\n[[session]]\ndays = ['mon']\nopen = '09:00'\nclose = '10:00'\n\
                [[holiday]]\nname = 'x'\nmonth = 13\nday = 1\n";
    let error = Calendar::of(&crate::io::Document::from_text("x.toml", text)).unwrap_err().to_string();
    insta::assert_snapshot!(error, @r"
    x.toml:10:1: 13 is beyond 1 to 12
      hint: months are 1 to 12
    ");
}

/// Any time there is, most of them within some years.
fn times() -> impl Strategy<Value = Vec<Timestamp>> {
    let within = at("2019-01-01T00:00:00Z").0..at("2027-01-01T00:00:00Z").0;
    let near = (within.clone(), 0..200_i64).prop_map(|(start, hours)| start + hours * 3_600_000_000_000);
    let time = prop_oneof![8 => near, 4 => within, 1 => any::<i64>()];
    proptest::collection::vec(time.prop_map(Timestamp), 1..40)
}

proptest! {
    /// Whatever it was asked before, the cursor says what the calendar says; and what that says hangs together.
    #[test]
    fn the_cursor_agrees_with_the_calendar(times in times(), name in prop::sample::select(vec!["nyse", "cme_globex", "always"])) {
        let calendar = built_in(name);
        let mut trading = Trading::new(Arc::new(calendar.clone()));
        for time in times {
            // The instants around each open and close as well.
            let (session, next) = (calendar.session_at(time), calendar.next_session(time));
            let edges = session.into_iter().chain(next).flat_map(|hours| [hours.open, hours.close]);
            for time in edges.flat_map(|edge| [edge + -1, edge, edge + 1]).chain([time]) {
                let (session, next) = (calendar.session_at(time), calendar.next_session(time));
                prop_assert_eq!(trading.seen_at(time), session);
                prop_assert_eq!(trading.is_open(time), session.is_some());
                prop_assert_eq!(trading.seen_at(time), session);
                prop_assert_eq!(trading.session_at(time), session);
                prop_assert_eq!(trading.next_session(time), next);
                let closed = calendar.previous_close(time);
                prop_assert_eq!(trading.previous_close(time), closed);
                prop_assert!(closed.is_none_or(|closed| closed <= time) && next.is_none_or(|next| next.open > time));
                if let (Some(session), Some(next)) = (session, next) {
                    prop_assert!(session.open <= time && time < session.close && session.close <= next.open);
                }
            }
        }
    }
}
