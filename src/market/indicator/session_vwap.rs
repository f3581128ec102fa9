//! The volume-weighted average price of the day.

use chrono::{DateTime, Days, NaiveTime, TimeZone};
use chrono_tz::Tz;

use crate::market::Bar;
use crate::sim2real::Timestamp;

use super::{Indicator, Vwap, is_taken};

/// The volume-weighted average price since the day began in its zone [currency], from bars: each counts with the mean of
/// its high, low and close, the usual "typical price", and to the day in which it began.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionVwap {
    zone: Tz,
    vwap: Vwap,
    /// When the day began, and when the next one does.
    day: Option<(Timestamp, Timestamp)>,
}

impl SessionVwap {
    /// The average of each day of `zone`.
    #[must_use]
    pub fn new(zone: Tz) -> Self {
        Self { zone, vwap: Vwap::new(), day: None }
    }

    /// The day of an instant; none for one within a day of the ends of time.
    fn day_of(&self, instant: Timestamp) -> Option<(Timestamp, Timestamp)> {
        let date = DateTime::from_timestamp_nanos(instant.0).with_timezone(&self.zone).date_naive();
        let midnight = |date: chrono::NaiveDate| {
            // Where summer time begins at midnight the day begins an hour late.
            let hours = (0..24).filter_map(|hour| NaiveTime::from_hms_opt(hour, 0, 0));
            let first = hours.into_iter().find_map(|hour| self.zone.from_local_datetime(&date.and_time(hour)).earliest());
            first?.timestamp_nanos_opt().map(Timestamp)
        };
        Some((midnight(date)?, midnight(date.checked_add_days(Days::new(1))?)?))
    }
}

impl Indicator for SessionVwap {
    type Input = Bar;
    type Output = f64;

    #[inline]
    fn update(&mut self, input: Bar) -> Option<f64> {
        if !is_taken(input.volume) || input.volume < 0.0 {
            return None;
        }
        if self.day.is_none_or(|(from, to)| input.open_at < from || input.open_at >= to) {
            self.day = Some(self.day_of(input.open_at)?);
            self.vwap.reset();
        }
        let typical = (input.high.to_f64() + input.low.to_f64() + input.close.to_f64()) / 3.0;
        self.vwap.update((typical, input.volume))
    }

    fn value(&self) -> Option<f64> {
        self.vwap.value()
    }

    /// Whether a day has begun: there is no value before its first volume.
    fn is_ready(&self) -> bool {
        self.day.is_some()
    }

    fn reset(&mut self) {
        self.vwap.reset();
        self.day = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::Price;

    /// New York's evening is the next day in Greenwich, and its clocks go forward on 10 March 2024.
    #[test]
    fn a_day_begins_at_midnight_in_its_zone() {
        let at = |text: &str| Timestamp(DateTime::parse_from_rfc3339(text).unwrap().timestamp_nanos_opt().unwrap());
        let bar = |text: &str, price: f64, volume: f64| {
            let (open_at, price) = (at(text), Price::nearest(price).unwrap());
            Bar { open_at, known_at: open_at + 1, open: price, high: price, low: price, close: price, volume }
        };
        let mut vwap = SessionVwap::new(Tz::America__New_York);
        let values = [
            bar("2024-03-09T23:00:00-05:00", 10.0, 1.0),
            bar("2024-03-10T00:00:00-05:00", 20.0, 0.0),
            bar("2024-03-10T00:30:00-05:00", 20.0, 1.0),
            bar("2024-03-10T23:59:00-04:00", 30.0, 1.0),
            bar("2024-03-11T00:00:00-04:00", 50.0, 1.0),
        ]
        .map(|bar| vwap.update(bar));
        assert_eq!(values, [Some(10.0), None, Some(20.0), Some(25.0), Some(50.0)]);
    }
}
