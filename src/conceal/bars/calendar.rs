//! When New York opens, in UTC: weekdays, and summer time by the rule in force since 2007.
//!
//! Source: US Energy Policy Act of 2005, section 110: second Sunday of March to first Sunday of November. Civil dates:
//! Hinnant, "chrono-Compatible Low-Level Date Algorithms".

const DAY: i64 = 86_400_000_000_000;
const MINUTE: i64 = 60_000_000_000;

/// Opens of the sessions from `first_day` on [ns since the Unix epoch, UTC]; days count from 1970-01-01.
pub(super) fn sessions(first_day: i64) -> impl Iterator<Item = i64> {
    (first_day..).filter(|day| weekday(*day) < 5).map(|day| {
        let offset = if summer(day) { 4 } else { 5 };
        day * DAY + (9 * 60 + 30 + offset * 60) * MINUTE
    })
}

/// 0 for a Monday to 6 for a Sunday; 1970-01-01 was a Thursday.
fn weekday(day: i64) -> i64 {
    (day + 3).rem_euclid(7)
}

/// Whether New York is on summer time on a weekday.
fn summer(day: i64) -> bool {
    let (year, _, _) = civil(day);
    day > nth_sunday(year, 3, 2) && day < nth_sunday(year, 11, 1)
}

fn nth_sunday(year: i64, month: i64, nth: i64) -> i64 {
    let first = days(year, month, 1);
    first + (6 - weekday(first)) + 7 * (nth - 1)
}

/// Days since 1970-01-01 of a date.
fn days(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let era = year.div_euclid(400);
    let of_era = year.rem_euclid(400);
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

/// Year, month and day of a number of days since 1970-01-01.
fn civil(day: i64) -> (i64, i64, i64) {
    let shifted = day + 719_468;
    let (era, of_era) = (shifted.div_euclid(146_097), shifted.rem_euclid(146_097));
    let year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let march = (5 * of_year + 2) / 153;
    let month = if march < 10 { march + 3 } else { march - 9 };
    (era * 400 + year + i64::from(month <= 2), month, of_year - (153 * march + 2) / 5 + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_go_there_and_back() {
        assert_eq!(days(2024, 8, 5), 19_940);
        assert_eq!(weekday(19_940), 0);
        for day in -200_000..200_000 {
            let (year, month, date) = civil(day);
            assert_eq!(days(year, month, date), day);
        }
    }

    #[test]
    fn summer_time_moves_the_open() {
        let open = |year, month, day| sessions(days(year, month, day)).next().unwrap().rem_euclid(DAY) / MINUTE;
        assert_eq!(open(2024, 3, 8), 14 * 60 + 30);
        assert_eq!(open(2024, 3, 11), 13 * 60 + 30);
        assert_eq!(open(2024, 11, 1), 13 * 60 + 30);
        assert_eq!(open(2024, 11, 4), 14 * 60 + 30);
    }

    #[test]
    fn weekends_are_closed() {
        let opens: Vec<i64> = sessions(days(2024, 8, 9)).take(2).map(|open| open / DAY).collect();
        assert_eq!(opens, [days(2024, 8, 9), days(2024, 8, 12)]);
    }
}
