//! Times as logs write them.

use chrono::{LocalResult, NaiveDate, NaiveDateTime, TimeZone};
use chrono_tz::Tz;

use crate::market::Cash;
use crate::sim2real::Timestamp;

/// How a log writes a column of times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Written {
    /// Integers since the Unix epoch, or texts with their zone; texts without one are in the zone given.
    Contract,
    /// Integers since the Unix epoch in a unit [ns].
    Count(i64),
    /// Texts with their zone, by RFC 3339.
    Rfc3339,
    /// Texts without a zone, which are UTC by what the bot says.
    Utc,
    /// Digits of a date and a time, with whatever between them and perhaps a zone behind, else in the zone given.
    Digits,
}

/// Why a text is no time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum NoTime {
    /// It cannot be read: what was expected.
    Unreadable(String),
    /// It has no zone, and none is given.
    NoZone,
}

/// A time, and what was odd about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    pub at: Timestamp,
    /// Whether the clocks pass it twice.
    pub twice: bool,
    /// Whether it has a zone of its own.
    pub own_zone: bool,
}

/// Reads `text`.
pub(super) fn stamp(text: &str, written: Written, zone: Option<Tz>) -> Result<Stamp, NoTime> {
    let exact = |at: Timestamp| Stamp { at, twice: false, own_zone: true };
    let expected = |what: &str| NoTime::Unreadable(what.to_owned());
    match written {
        Written::Count(unit) => count(text, unit).map(exact).ok_or_else(|| expected("expected a count since 1970")),
        Written::Rfc3339 => text.parse().map(exact).map_err(|_| expected("expected a time with its zone (RFC 3339)")),
        Written::Utc => match text.parse() {
            Ok(instant) => Ok(exact(instant)),
            Err(_) => in_zone(naive(text).ok_or_else(|| expected("expected a time"))?, Tz::UTC),
        },
        Written::Contract => match (count(text, 1), text.parse()) {
            (Some(instant), _) | (None, Ok(instant)) => Ok(exact(instant)),
            _ => {
                let what = "expected nanoseconds since 1970 or a time by RFC 3339";
                in_zone(naive(text).ok_or_else(|| expected(what))?, zone.ok_or(NoTime::NoZone)?)
            }
        },
        Written::Digits => digits(text, zone),
    }
}

/// A count of units since the epoch, exactly; a fraction down to the nanosecond.
fn count(text: &str, unit: i64) -> Option<Timestamp> {
    if let Ok(count) = text.parse::<i64>() {
        return count.checked_mul(unit).map(Timestamp);
    }
    // Of numbers such as 1.723161256798e+18; prices are read by the same rule.
    let nano: Cash = text.parse().ok()?;
    let instant = nano.0.checked_mul(i128::from(unit))? / 1_000_000_000_000_000_000;
    i64::try_from(instant).ok().map(Timestamp)
}

fn naive(text: &str) -> Option<NaiveDateTime> {
    ["%Y-%m-%d %H:%M:%S%.f", "%Y-%m-%dT%H:%M:%S%.f"].iter().find_map(|form| NaiveDateTime::parse_from_str(text, form).ok())
}

fn in_zone(naive: NaiveDateTime, zone: Tz) -> Result<Stamp, NoTime> {
    let (instant, twice) = match zone.from_local_datetime(&naive) {
        LocalResult::Single(instant) => (instant, false),
        LocalResult::Ambiguous(instant, _) => (instant, true),
        LocalResult::None => return Err(NoTime::Unreadable(format!("expected a time that exists in {zone}"))),
    };
    let nanos = instant.timestamp_nanos_opt();
    let at = nanos.ok_or_else(|| NoTime::Unreadable("expected a time between the years 1677 and 2262".to_owned()))?;
    Ok(Stamp { at: Timestamp(at), twice, own_zone: false })
}

/// Zones that brokers write behind a time, by their offsets [s]. Others are not guessed: CST is three of them.
const ZONES: [(&str, i64); 6] = [("EST", -5), ("EDT", -4), ("UTC", 0), ("GMT", 0), ("Z", 0), ("HKT", 8)];

/// A date and a time of 8 and 6 digits, as `20210111;221652` or `2021-02-03, 10:01:50 EST`.
fn digits(text: &str, zone: Option<Tz>) -> Result<Stamp, NoTime> {
    let unreadable = || NoTime::Unreadable("expected a date and a time as YYYYMMDD;HHMMSS".to_owned());
    let (body, named) = match text.trim().rsplit_once(|c: char| c == ' ' || c.is_ascii_digit()) {
        Some((_, word)) if !word.is_empty() && word.bytes().all(|b| b.is_ascii_uppercase()) => {
            let zone = ZONES.iter().find(|(name, _)| *name == word);
            let (_, hours) = zone.ok_or_else(|| NoTime::Unreadable(format!("the zone {word} is not known")))?;
            (text.trim().strip_suffix(word).unwrap_or(text), Some(hours * 3_600))
        }
        _ => (text.trim(), None),
    };
    let (body, offset) = match body.len().checked_sub(5).and_then(|at| Some((body.get(..at)?, body.get(at..)?))) {
        // An offset such as -0500 stands behind a time, never behind a date.
        Some((before, offset)) if offset.starts_with(['+', '-']) && before.len() >= 14 => {
            let figures: i64 = offset[1..].parse().map_err(|_| unreadable())?;
            let seconds = figures / 100 * 3_600 + figures % 100 * 60;
            (before, Some(if offset.starts_with('-') { -seconds } else { seconds }))
        }
        _ => (body, named),
    };
    let of_separator = |c: char| matches!(c, ';' | ',' | ' ' | '-' | ':' | 'T');
    if !body.chars().all(|c| c.is_ascii_digit() || of_separator(c)) {
        return Err(unreadable());
    }
    let figures: String = body.chars().filter(char::is_ascii_digit).collect();
    let part = |from: usize, to: usize| figures.get(from..to).and_then(|text| text.parse::<u32>().ok());
    let date = figures.get(..4).and_then(|year| year.parse().ok()).zip(part(4, 6)).zip(part(6, 8));
    let date = date.and_then(|((year, month), day)| NaiveDate::from_ymd_opt(year, month, day)).ok_or_else(unreadable)?;
    let time = part(8, 10).zip(part(10, 12)).zip(part(12, 14)).filter(|_| figures.len() == 14);
    let naive = time.and_then(|((hour, minute), second)| date.and_hms_opt(hour, minute, second)).ok_or_else(unreadable)?;
    match (offset, zone) {
        (Some(offset), _) => {
            let utc = in_zone(naive, Tz::UTC)?.at + -offset * Timestamp::NANOS;
            Ok(Stamp { at: utc, twice: false, own_zone: true })
        }
        (None, Some(zone)) => in_zone(naive, zone),
        (None, None) => Err(NoTime::NoZone),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, written: Written, zone: Option<Tz>) -> Result<String, NoTime> {
        stamp(text, written, zone).map(|stamp| stamp.at.to_string())
    }

    #[test]
    fn digits_are_read_with_and_without_dashes_and_zones() {
        let new_york = Some(Tz::America__New_York);
        let expected = Ok("2021-02-03T15:01:50Z".to_owned());
        for text in
            ["20210203;100150", "2021-02-03 10:01:50", "2021-02-03;10:01:50", "20210203 100150", "2021-02-03, 10:01:50"]
        {
            assert_eq!(read(text, Written::Digits, new_york), expected, "{text}");
            assert_eq!(read(text, Written::Digits, None), Err(NoTime::NoZone), "{text}");
        }
        for text in ["20210203;100150 EST", "2021-02-03;100150-0500", "20210203;150150 UTC"] {
            assert_eq!(read(text, Written::Digits, None), expected, "{text}");
        }
        assert!(stamp("20211107;013000", Written::Digits, new_york).unwrap().twice);
        for text in
            ["20210314;023000", "20210203", "03/02/2021;100150", "20210203;100150 CST", "20211303;100150", "", "é", "+0500"]
        {
            assert!(matches!(read(text, Written::Digits, new_york), Err(NoTime::Unreadable(_))), "{text}");
        }
    }

    #[test]
    fn times_of_the_contract_without_a_zone_need_one() {
        let (text, new_york) = ("2024-07-30 08:06:03.906000", Some(Tz::America__New_York));
        assert_eq!(read(text, Written::Contract, None), Err(NoTime::NoZone));
        assert_eq!(read(text, Written::Contract, new_york).as_deref(), Ok("2024-07-30T12:06:03.906Z"));
        assert_eq!(read(&text.replace(' ', "T"), Written::Contract, new_york).as_deref(), Ok("2024-07-30T12:06:03.906Z"));
        assert_eq!(read("2024-07-30 08:06:03+00:00", Written::Contract, new_york).as_deref(), Ok("2024-07-30T08:06:03Z"));
    }

    #[test]
    fn counts_are_exact_in_their_unit() {
        assert_eq!(
            stamp("1499865549590", Written::Count(1_000_000), None).unwrap().at,
            Timestamp(1_499_865_549_590_000_000)
        );
        assert_eq!(stamp("1.723161256798e+18", Written::Count(1), None).unwrap().at, Timestamp(1_723_161_256_798_000_000));
        assert!(stamp("99999999999999999", Written::Count(1_000_000), None).is_err());
        assert_eq!(read("2024-07-30 08:06:03.906000", Written::Utc, None).as_deref(), Ok("2024-07-30T08:06:03.906Z"));
        assert_eq!(read("1", Written::Contract, None).as_deref(), Ok("1970-01-01T00:00:00.000000001Z"));
    }
}
