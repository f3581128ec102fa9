//! What an average day of an instrument looks like, as far as it could be known: for impacts that are stated in days.

use std::collections::VecDeque;

use crate::sim2real::Timestamp;

use super::Price;
use super::account::Ratio;
use super::recent::Recent;

const DAY: i64 = 86_400 * Timestamp::NANOS;

/// Volume and volatility of the last completed days; a day is one of UTC, and only days with data count.
///
/// The day that is under way is never counted: its volume is not known before it ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Daily {
    /// First instant of the day after the one under way.
    next_day: i64,
    volume: f64,
    close: Price,
    /// Volumes of completed days, the newest last.
    volumes: VecDeque<f64>,
    /// Closes of completed days, the newest last.
    closes: VecDeque<f64>,
    /// As of the last completed day.
    mean_volume: Option<f64>,
    /// As of the last completed day.
    volatility: Option<f64>,
    /// What the last minutes were like, where anybody asks.
    recent: Option<Box<Recent>>,
}

impl Default for Daily {
    fn default() -> Self {
        Self {
            next_day: i64::MIN,
            volume: 0.0,
            close: Price(0),
            volumes: VecDeque::new(),
            closes: VecDeque::new(),
            mean_volume: None,
            volatility: None,
            recent: None,
        }
    }
}

impl Daily {
    /// One that is asked for the last minutes too.
    pub(super) fn with_recent() -> Self {
        Self { recent: Some(Box::default()), ..Self::default() }
    }

    /// How many completed days are averaged: a month of trading.
    pub const DAYS: usize = 20;
    /// The fewest daily returns a volatility is made of.
    const FEWEST_RETURNS: usize = 5;

    /// Sees a price and the volume [units] that became known with it.
    #[inline]
    pub fn see(&mut self, time: Timestamp, price: Price, volume: f64) {
        // A bar known at midnight belongs to the day that ends with it.
        if time.0 > self.next_day {
            self.turn(time);
        }
        self.volume += volume;
        self.close = price;
        if let Some(recent) = &mut self.recent {
            recent.see(time, price.to_f64());
        }
    }

    /// Standard deviation of the return over five minutes, of late (a fraction); none where nobody asked for it.
    pub(super) fn recent_volatility(&self) -> Option<f64> {
        self.recent.as_ref()?.volatility()
    }

    /// What was seen is told in the units of after a split, which is no return.
    pub(super) fn split(&mut self, ratio: Ratio) {
        let units = ratio.to_f64();
        self.close = ratio.price(self.close);
        self.volume *= units;
        self.volumes.iter_mut().for_each(|volume| *volume *= units);
        self.closes.iter_mut().for_each(|close| *close /= units);
        self.mean_volume = self.mean_volume.map(|volume| volume * units);
        if let Some(recent) = &mut self.recent {
            recent.split(units);
        }
    }

    fn turn(&mut self, time: Timestamp) {
        if self.next_day != i64::MIN {
            self.volumes.push_back(self.volume);
            self.closes.push_back(self.close.to_f64());
            // One close more than volumes, for as many returns.
            while self.volumes.len() > Self::DAYS {
                self.volumes.pop_front();
            }
            while self.closes.len() > Self::DAYS + 1 {
                self.closes.pop_front();
            }
            self.mean_volume = self.mean_volume();
            self.volatility = self.deviation();
        }
        self.volume = 0.0;
        self.next_day = (time.0 - 1).div_euclid(DAY).saturating_add(1).saturating_mul(DAY);
    }

    /// Mean volume of the last completed days [units]; none before the first has ended, or where there was none.
    #[must_use]
    pub fn volume(&self) -> Option<f64> {
        self.mean_volume
    }

    fn mean_volume(&self) -> Option<f64> {
        let mean = self.volumes.iter().sum::<f64>() / self.volumes.len() as f64;
        (mean > 0.0).then_some(mean)
    }

    /// Standard deviation of the log returns between the last completed days (a fraction); none with fewer than 5.
    #[must_use]
    pub fn volatility(&self) -> Option<f64> {
        self.volatility
    }

    fn deviation(&self) -> Option<f64> {
        let returns: Vec<f64> = self.closes.iter().zip(self.closes.iter().skip(1)).map(|(a, b)| (b / a).ln()).collect();
        if returns.len() < Self::FEWEST_RETURNS {
            return None;
        }
        let mean = returns.iter().sum::<f64>() / returns.len() as f64;
        let squares: f64 = returns.iter().map(|r| (r - mean) * (r - mean)).sum();
        Some((squares / (returns.len() - 1) as f64).sqrt()).filter(|v| *v > 0.0 && v.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_completed_days_count() {
        let mut daily = Daily::default();
        let at = |day: i64, hour: i64| Timestamp(day * DAY + hour * DAY / 24);
        daily.see(at(0, 10), Price(100), 30.0);
        daily.see(at(0, 24), Price(101), 70.0);
        assert_eq!(daily.volume(), None);
        daily.see(at(3, 10), Price(102), 1e9);
        assert_eq!(daily.volume(), Some(100.0));
        daily.see(at(4, 10), Price(102), 0.0);
        assert_eq!(daily.volume(), Some(0.5 * (100.0 + 1e9)));
        assert_eq!(daily.volatility(), None);
    }

    #[test]
    fn volatility_is_that_of_daily_closes() {
        let mut daily = Daily::default();
        for day in 0..100 {
            let price = Price(if day % 2 == 0 { 100 } else { 101 });
            daily.see(Timestamp(day * DAY + 1), price, 5.0);
        }
        // Returns alternate between plus and minus ln 1.01: 20 of them, mean 0.
        let expected = 1.01_f64.ln() * (20.0_f64 / 19.0).sqrt();
        assert!((daily.volatility().unwrap() - expected).abs() < 1e-12);
        assert_eq!((daily.volumes.len(), daily.closes.len(), daily.volume()), (20, 21, Some(5.0)));
    }
}
