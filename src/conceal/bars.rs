//! Minute bars of one instrument: volatility that clusters, volume that is high at the open and the close, and trends that
//! last an hour or two and are weak, so that a trend follower trades and grows neither rich nor poor fast.

mod calendar;

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

use crate::sim2real::Seed;

use super::{Column, Table};
use calendar::sessions;

/// Bars of a regular session, 09:30 to 16:00 in New York.
pub const SESSION: usize = 390;
/// Price moves simulated within a minute.
const MOVES: usize = 12;
/// Size of a tick [currency].
const TICKS_PER_UNIT: f64 = 100.0;

/// An instrument and how it moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Bars {
    /// First session: days since 1970-01-01; the next weekday where it falls on a weekend.
    pub first_day: i64,
    /// First price [currency].
    pub price: f64,
    /// Typical volatility [fraction per square root of a minute].
    pub volatility: f64,
    /// Drift in a trend, as a part of a typical minute's volatility.
    pub trend: f64,
    /// Mean duration of a trend, and of the quiet between trends [minutes].
    pub trend_minutes: f64,
    /// Typical volume of a minute [shares].
    pub volume: f64,
}

impl Default for Bars {
    /// The instrument of the `bars` set, from Monday 2024-08-05.
    fn default() -> Self {
        Self { first_day: 19_940, price: 120.0, volatility: 0.000_45, trend: 0.06, trend_minutes: 110.0, volume: 9_000.0 }
    }
}

/// What a minute leaves behind [ticks, shares].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bar {
    open: i64,
    high: i64,
    low: i64,
    close: i64,
    volume: i64,
}

/// What moves on from minute to minute.
#[derive(Debug, Clone, Copy, Default)]
struct Weather {
    /// Logarithm of the price.
    price: f64,
    /// Logarithm of the volatility, against the typical; a slow part and a fast one.
    slow: f64,
    fast: f64,
    /// -1, 0 or 1.
    trend: f64,
}

impl Bars {
    /// Columns `ts` [ns, start of the minute], `open`, `high`, `low`, `close` [currency], `volume` [shares].
    ///
    /// Sessions are the weekdays from `first_day` on; holidays and half days of the real calendar are not left out.
    #[must_use]
    pub fn minutes(&self, rows: usize, seed: Seed) -> Table {
        let opens = sessions(self.first_day);
        let times = opens.flat_map(|open| (0..SESSION as i64).map(move |minute| open + minute * 60_000_000_000));
        let bars = self.bars(rows, seed);
        let price = |of: fn(&Bar) -> i64| Column::Real(bars.iter().map(|bar| of(bar) as f64 / TICKS_PER_UNIT).collect());
        Table::default()
            .with("ts", Column::Time(times.take(rows).collect()))
            .with("open", price(|bar| bar.open))
            .with("high", price(|bar| bar.high))
            .with("low", price(|bar| bar.low))
            .with("close", price(|bar| bar.close))
            .with("volume", Column::Whole(bars.iter().map(|bar| bar.volume).collect()))
    }

    fn bars(&self, rows: usize, seed: Seed) -> Vec<Bar> {
        let mut path = seed.stream("bars path");
        let mut moods = seed.stream("bars volatility");
        let mut trends = seed.stream("bars trend");
        let mut volumes = seed.stream("bars volume");
        let mut weather = Weather { price: self.price.ln(), ..Weather::default() };
        (0..rows)
            .map(|row| {
                let minute = row % SESSION;
                weather.turn(minute, &mut moods);
                if trends.random::<f64>() < 1.0 / self.trend_minutes {
                    weather.trend = f64::from(trends.random_range(-1..=1));
                }
                if minute == 0 && row > 0 {
                    let overnight: f64 = StandardNormal.sample(&mut path);
                    weather.price += 9.0 * self.volatility * overnight;
                }
                let size = self.volatility * shape(minute) * (weather.slow + weather.fast).exp();
                let wobble: f64 = StandardNormal.sample(&mut volumes);
                let busy = (0.8 * (weather.slow + weather.fast) + 0.35 * wobble).exp();
                let volume = (self.volume * shape(minute).powf(1.6) * busy).round().max(1.0) as i64;
                self.minute(&mut weather, size, volume, &mut path)
            })
            .collect()
    }

    /// One minute in small moves, prices rounded to ticks.
    fn minute(&self, weather: &mut Weather, size: f64, volume: i64, path: &mut impl rand::Rng) -> Bar {
        let mut bar: Option<Bar> = None;
        let step = size / (MOVES as f64).sqrt();
        let drift = weather.trend * self.trend * self.volatility / MOVES as f64;
        for _ in 0..MOVES {
            let normal: f64 = StandardNormal.sample(path);
            weather.price += drift + step * normal - 0.5 * step * step;
            // Below one tick there is no price.
            let ticks = ((weather.price.exp() * TICKS_PER_UNIT).round() as i64).max(1);
            let seen = bar.get_or_insert(Bar { open: ticks, high: ticks, low: ticks, close: ticks, volume });
            (seen.high, seen.low, seen.close) = (seen.high.max(ticks), seen.low.min(ticks), ticks);
        }
        bar.unwrap_or(Bar { open: 1, high: 1, low: 1, close: 1, volume })
    }
}

impl Weather {
    /// Volatility of the next minute: two mean-reverting logarithms, one of days and one of a quarter of an hour.
    fn turn(&mut self, minute: usize, rng: &mut impl rand::Rng) {
        let (a, b): (f64, f64) = (StandardNormal.sample(rng), StandardNormal.sample(rng));
        self.fast = 0.94 * self.fast + 0.10 * a;
        // A night counts as an hour.
        let memory = if minute == 0 { 0.90_f64 } else { 0.998 };
        self.slow = memory * self.slow + 0.35 * (1.0 - memory * memory).sqrt() * b;
    }
}

/// Busy at the open, busy at the close: a factor on volatility, 1 on average.
fn shape(minute: usize) -> f64 {
    let part = minute as f64 / SESSION as f64;
    (0.72 + 1.5 * (-part / 0.06).exp() + 0.75 * ((part - 1.0) / 0.10).exp()) / 0.885
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prices<'a>(table: &'a Table, name: &str) -> &'a [f64] {
        table.real(name).unwrap()
    }

    fn returns(closes: &[f64]) -> Vec<f64> {
        closes.windows(2).map(|pair| (pair[1] / pair[0]).ln()).collect()
    }

    #[test]
    fn same_seed_same_bits() {
        let bars = Bars::default();
        assert_eq!(bars.minutes(1_000, Seed(3)), bars.minutes(1_000, Seed(3)));
        assert_ne!(bars.minutes(1_000, Seed(3)), bars.minutes(1_000, Seed(4)));
    }

    /// A longer recording goes on where a shorter one stopped.
    #[test]
    fn length_does_not_change_the_start() {
        let (short, long) = (Bars::default().minutes(500, Seed(3)), Bars::default().minutes(5_000, Seed(3)));
        assert_eq!(prices(&short, "close"), &prices(&long, "close")[..500]);
    }

    #[test]
    fn high_and_low_bracket_open_and_close() {
        let table = Bars::default().minutes(7_800, Seed(3));
        let [open, high, low, close] = ["open", "high", "low", "close"].map(|name| prices(&table, name));
        for k in 0..table.rows() {
            assert!(low[k] > 0.0 && low[k] <= open[k].min(close[k]) && high[k] >= open[k].max(close[k]), "row {k}");
            assert!((close[k] * 100.0 - (close[k] * 100.0).round()).abs() < 1e-6, "row {k} is off the tick");
        }
        let Some(Column::Whole(volume)) = table.column("volume") else { panic!("no volume") };
        assert!(volume.iter().all(|volume| *volume > 0));
    }

    /// The facts any market shows: clustered volatility, no memory in returns, busy ends of the day.
    #[test]
    fn the_bars_look_like_a_market() {
        let table = Bars::default().minutes(40 * SESSION, Seed(3));
        let moves = returns(prices(&table, "close"));
        let correlation = |values: &[f64], lag: usize| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let product =
                |lag: usize| -> f64 { values.iter().zip(&values[lag..]).map(|(a, b)| (a - mean) * (b - mean)).sum() };
            product(lag) / product(0)
        };
        assert!(correlation(&moves, 1).abs() < 0.05);
        let sizes: Vec<f64> = moves.iter().map(|value| value.abs().min(0.003)).collect();
        assert!(correlation(&sizes, 5) > 0.05, "{}", correlation(&sizes, 5));
        let Some(Column::Whole(volume)) = table.column("volume") else { panic!("no volume") };
        let mean = |part: std::ops::Range<usize>| {
            let of: Vec<f64> =
                volume.iter().enumerate().filter(|(k, _)| part.contains(&(k % SESSION))).map(|v| *v.1 as f64).collect();
            of.iter().sum::<f64>() / of.len() as f64
        };
        assert!(mean(0..15) > 2.0 * mean(180..210) && mean(375..390) > 1.4 * mean(180..210));
    }

    /// A crossover of means trades, and what it makes before costs is neither a fortune nor a ruin.
    #[test]
    fn a_crossover_trades_and_makes_no_fortune() {
        let table = Bars::default().minutes(20 * SESSION, Seed(11));
        let close = prices(&table, "close");
        let mean = |end: usize, length: usize| close[end - length..end].iter().sum::<f64>() / length as f64;
        let (mut log, mut long, mut trades) = (0.0, false, 0);
        for now in 50..close.len() {
            if long {
                log += (close[now] / close[now - 1]).ln();
            }
            let wants = mean(now, 10) > mean(now, 50);
            trades += usize::from(wants != long);
            long = wants;
        }
        assert!((150..600).contains(&trades), "{trades} trades");
        assert!(log.abs() < 0.15, "a log return of {log} in a month");
    }
}
