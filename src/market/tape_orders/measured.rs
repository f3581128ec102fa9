//! What a tape says of its instrument: tick, lot, a day's volume and a day's volatility.

use crate::market::{Price, Print, Quantity};
use crate::sim2real::Timestamp;

/// A day [s].
const DAY: f64 = 86_400.0;

/// Most mids that are kept for the volatility; where there are more, every second goes and the distance between them doubles.
const MIDS: usize = 512;

/// What was measured of an instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredInstrument {
    /// The largest number of which every price is a multiple [currency].
    pub tick: Price,
    /// The largest number of which every traded size is a multiple [units].
    pub lot: Quantity,
    /// From the first to the last instant of the tape [s].
    pub span: f64,
    /// What would be traded in a day that goes on as the tape does [units]; none where nothing is traded, or in no time.
    pub daily_volume: Option<f64>,
    /// Standard deviation of the return of a day that goes on as the tape does; none of less than ten returns.
    pub daily_volatility: Option<f64>,
    /// The distance of the mids from which the volatility is reckoned [s].
    pub mids_every: f64,
}

/// Measures an instrument while its tape goes by, in memory that does not grow.
#[derive(Debug, Clone, Default)]
pub(super) struct Measuring {
    tick: u64,
    lot: u64,
    volume: f64,
    first: Option<Timestamp>,
    last: Option<Timestamp>,
    mids: Mids,
}

impl Measuring {
    pub(super) fn print(&mut self, print: &Print) {
        self.at(print.time);
        self.volume += print.size;
        if let Ok(price) = Price::nearest(print.price) {
            self.price(price);
        }
        if let Ok(size) = Quantity::nearest(print.size) {
            self.lot = greatest_common_divisor(self.lot, size.0.unsigned_abs());
        }
    }

    /// A price at which something was shown or traded.
    pub(super) fn price(&mut self, price: Price) {
        self.tick = greatest_common_divisor(self.tick, price.0.unsigned_abs());
    }

    /// The mid [currency] from `time` on.
    pub(super) fn mid(&mut self, time: Timestamp, mid: f64) {
        self.at(time);
        self.mids.push(time, mid);
    }

    fn at(&mut self, time: Timestamp) {
        self.first = Some(self.first.map_or(time, |first| first.min(time)));
        self.last = Some(self.last.map_or(time, |last| last.max(time)));
    }

    /// What is known by now; none where no price was shown.
    pub(super) fn measured(&self) -> Option<MeasuredInstrument> {
        let whole = |number: u64| i64::try_from(number).unwrap_or(i64::MAX);
        let span = self.last?.seconds_since(self.first?);
        let tick = (self.tick > 0).then(|| Price(whole(self.tick)))?;
        Some(MeasuredInstrument {
            tick,
            lot: Quantity(whole(self.lot).max(1)),
            span,
            daily_volume: (span > 0.0 && self.volume > 0.0).then(|| self.volume / span * DAY),
            daily_volatility: self.mids.daily_volatility(),
            mids_every: self.mids.every as f64 * 1e-9,
        })
    }
}

fn greatest_common_divisor(mut a: u64, mut b: u64) -> u64 {
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// Mids at even distances.
#[derive(Debug, Clone)]
struct Mids {
    begin: Option<Timestamp>,
    /// Distance [ns].
    every: i64,
    mids: Vec<f64>,
    newest: f64,
}

impl Default for Mids {
    fn default() -> Self {
        Self { begin: None, every: Timestamp::NANOS, mids: Vec::new(), newest: 0.0 }
    }
}

impl Mids {
    fn push(&mut self, time: Timestamp, mid: f64) {
        let begin = *self.begin.get_or_insert(time);
        if self.mids.is_empty() {
            self.mids.push(mid);
        }
        // What was shown last holds at every instant up to this one.
        while (self.mids.len() as i64).saturating_mul(self.every) < time - begin {
            if self.mids.len() >= MIDS {
                let mut number = 0;
                self.mids.retain(|_| {
                    number += 1;
                    number % 2 == 1
                });
                self.every = self.every.saturating_mul(2);
                continue;
            }
            self.mids.push(self.newest);
        }
        self.newest = mid;
    }

    fn daily_volatility(&self) -> Option<f64> {
        const ENOUGH: usize = 10;
        let returns: Vec<f64> = self.mids.windows(2).map(|pair| (pair[1] / pair[0]).ln()).collect();
        let variance = returns.iter().map(|r| r * r).sum::<f64>() / returns.len().max(1) as f64;
        let volatility = (variance * DAY / (self.every as f64 * 1e-9)).sqrt();
        (returns.len() >= ENOUGH && volatility > 0.0 && volatility.is_finite()).then_some(volatility)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn print(second: i64, price: f64, size: f64) -> Print {
        Print { time: Timestamp(second * Timestamp::NANOS), price, size, aggressor: None }
    }

    #[test]
    fn tick_lot_and_volume_are_those_of_the_tape() {
        let mut measuring = Measuring::default();
        assert_eq!(measuring.measured(), None);
        for (second, price, size) in [(0, 100.25, 0.3), (60, 100.1, 0.12), (120, 99.95, 0.6)] {
            measuring.print(&print(second, price, size));
        }
        let found = measuring.measured().unwrap();
        assert_eq!((found.tick, found.lot), (Price(50_000_000), Quantity(60_000_000)));
        assert!((found.span - 120.0).abs() < 1e-9);
        assert!((found.daily_volume.unwrap() - 1.02 * 720.0).abs() < 1e-9);
        assert_eq!(found.daily_volatility, None, "no mids");
    }

    #[test]
    fn a_days_volatility_is_that_of_the_mids_however_long_the_tape() {
        use rand_distr::{Distribution, StandardNormal};
        let mut draws = crate::sim2real::Seed(3).stream("mids");
        for seconds in [400, 20_000] {
            let (mut measuring, mut log_mid) = (Measuring::default(), 4.0_f64);
            // A move every quarter of a second; of 2 % a day in all.
            let step = 0.02 / (DAY * 4.0).sqrt();
            for quarter in 0..4 * seconds {
                let draw: f64 = StandardNormal.sample(&mut draws);
                log_mid += step * draw;
                measuring.mid(Timestamp(quarter * Timestamp::NANOS / 4), log_mid.exp());
            }
            let found = measuring.measured().unwrap_or(MeasuredInstrument {
                tick: Price(1),
                lot: Quantity(1),
                span: 0.0,
                daily_volume: None,
                daily_volatility: measuring.mids.daily_volatility(),
                mids_every: 0.0,
            });
            let volatility = found.daily_volatility.unwrap();
            assert!((volatility / 0.02 - 1.0).abs() < 0.15, "{volatility} over {seconds} s");
            assert!(measuring.mids.mids.len() <= MIDS);
        }
    }
}
