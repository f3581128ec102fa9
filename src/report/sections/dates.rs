//! Instants as tables show them.

use chrono::DateTime;
use chrono_tz::Tz;

use crate::report::backtest::BacktestPage;

/// How exactly instants are told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dates {
    /// By the day of this zone: with about an event a day, an hour of UTC tells nothing, and may be of the day after.
    Days(Tz),
    /// To the minute of UTC.
    Minutes,
}

impl Dates {
    /// As exactly as the events of `page` ask for.
    pub fn over(page: &BacktestPage) -> Self {
        let (Some(first), Some(last)) = (page.time.first(), page.time.last()) else { return Self::Minutes };
        let days = last.saturating_sub(*first) / 86_400_000_000_000;
        let sparse = page.time.len() as i64 <= days + 1;
        if sparse { Self::Days(page.zone.parse().unwrap_or(Tz::UTC)) } else { Self::Minutes }
    }

    /// Name of the zone.
    pub fn zone(self) -> &'static str {
        match self {
            Self::Days(zone) => zone.name(),
            Self::Minutes => Tz::UTC.name(),
        }
    }

    /// When something happened [ns since the Unix epoch, UTC].
    pub fn text(self, time: i64) -> String {
        match self {
            Self::Days(zone) => DateTime::from_timestamp_nanos(time).with_timezone(&zone).format("%Y-%m-%d").to_string(),
            Self::Minutes => DateTime::from_timestamp_nanos(time).format("%Y-%m-%d %H:%M").to_string(),
        }
    }

    /// When something was known [ns since the Unix epoch, UTC]: at midnight, of the day that ends with it.
    pub fn known(self, time: i64) -> String {
        match self {
            Self::Days(_) => self.text(time.saturating_sub(1)),
            Self::Minutes => self.text(time),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bar of Friday, 1 March 2024 in New York is known at 5:00 UTC on Saturday.
    #[test]
    fn days_are_those_of_the_market() {
        let time: Vec<i64> = (1..5).map(|k| (1_709_269_200 + 86_400 * k) * 1_000_000_000).collect();
        let page = BacktestPage { zone: "America/New_York".into(), time: time.clone(), ..BacktestPage::default() };
        let dates = Dates::over(&page);
        assert_eq!((dates.known(time[0]), dates.zone()), ("2024-03-01".to_owned(), "America/New_York"));
        assert_eq!(dates.text(time[0]), "2024-03-02");
        let minutes = Dates::over(&BacktestPage { time: vec![0, 60_000_000_000], ..page });
        assert_eq!((minutes.known(time[0]), minutes.zone()), ("2024-03-02 05:00".to_owned(), "UTC"));
    }
}
