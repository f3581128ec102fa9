//! A day of the market as it would have been without the client: price, spread, depth and trades, each a process of its own.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, Exp1, StandardNormal};

use super::climate::{Climate, SESSION, TICK};
use crate::sim2real::Seed;

/// Levels of the book.
pub(super) const LEVELS: usize = 5;

/// The state of the market from a time on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    /// Since when [s after the open].
    pub time: f64,
    /// Price about which bids and offers stand [currency].
    pub price: f64,
    /// Offer less bid [ticks].
    pub spread: i64,
    /// Sizes displayed to buy from and to sell to, best first, in units of the usual size of the best level.
    pub asks: [f64; LEVELS],
    /// The same of bids.
    pub bids: [f64; LEVELS],
    /// Ticks from the best level to each.
    pub steps: [i64; LEVELS],
}

/// A trade of others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Trade {
    /// When [s after the open].
    pub time: f64,
    /// Whether the one who took bought.
    pub bought: bool,
    /// Size [units].
    pub size: f64,
}

/// A day without the client.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tape {
    pub rows: Vec<Row>,
    pub trades: Vec<Trade>,
    /// Sum of squared moves of the price up to each row [bps^2].
    squares: Vec<f64>,
}

/// A quantity that returns to 0 with a time constant [s] and has a standard deviation of 1.
struct Reverting {
    time: f64,
    value: f64,
}

impl Reverting {
    fn new(time: f64, rng: &mut impl Rng) -> Self {
        Self { time, value: StandardNormal.sample(rng) }
    }

    fn step(&mut self, passed: f64, rng: &mut impl Rng) -> f64 {
        let kept = (-passed / self.time).exp();
        let shock: f64 = StandardNormal.sample(rng);
        self.value = kept * self.value + (1.0 - kept * kept).sqrt() * shock;
        self.value
    }
}

/// Jumps of the price a day, and their usual size as a part of a day's volatility.
const JUMPS: f64 = 4.0;
const JUMP: f64 = 0.08;
/// Exponent of the tail of trade sizes.
const TAIL: f64 = 1.6;

impl Tape {
    pub fn draw(climate: &Climate, seed: Seed) -> Self {
        let rows = rows(climate, &mut seed.stream("price").clone());
        let squares = rows
            .windows(2)
            .scan(0.0, |sum, pair| {
                *sum += (1e4 * (pair[1].price / pair[0].price).ln()).powi(2);
                Some(*sum)
            })
            .collect::<Vec<f64>>();
        let squares = std::iter::once(0.0).chain(squares).collect();
        Self { trades: trades(climate, &mut seed.stream("trades").clone()), rows, squares }
    }

    /// The last row of no later than `time` [s after the open].
    pub fn row_at(&self, time: f64) -> usize {
        self.rows.partition_point(|row| row.time <= time).saturating_sub(1)
    }

    /// The price at `time` [currency].
    pub fn price_at(&self, time: f64) -> f64 {
        self.rows[self.row_at(time)].price
    }

    /// Standard deviation of the daily return as the five minutes before `time` have it (a fraction).
    pub fn realized(&self, time: f64) -> f64 {
        let (from, to) = (self.row_at(time - 300.0), self.row_at(time));
        let seconds = (self.rows[to].time - self.rows[from].time).max(1.0);
        1e-4 * ((self.squares[to] - self.squares[from]) / seconds * SESSION).sqrt()
    }

    /// Standard deviation of the moves of the price over `seconds` [bps].
    pub fn moves_over(&self, seconds: f64) -> f64 {
        let count = (SESSION / seconds) as usize;
        let prices: Vec<f64> = (0..count).map(|k| self.price_at(k as f64 * seconds)).collect();
        let squares: f64 = prices.windows(2).map(|pair| (1e4 * (pair[1] / pair[0]).ln()).powi(2)).sum();
        (squares / (count - 1) as f64).sqrt()
    }
}

/// How busy the market is, beside its mean: more at the open and at the close.
pub(super) fn activity(time: f64) -> f64 {
    let part = 2.0 * time / SESSION - 1.0;
    0.7 + 0.9 * part * part
}

fn rows(climate: &Climate, rng: &mut impl Rng) -> Vec<Row> {
    let mut volatility = [Reverting::new(300.0, rng), Reverting::new(3_000.0, rng)];
    let mut width = Reverting::new(200.0, rng);
    let mut depth = [Reverting::new(60.0, rng), Reverting::new(60.0, rng)];
    let mut thin = Reverting::new(120.0, rng);
    let (mut logarithm, mut time, mut rows) = (climate.level.ln(), 0.0, Vec::new());
    let mut levels: [[f64; LEVELS]; 2] = [[1.0; LEVELS]; 2];
    while time < SESSION {
        let waited: f64 = Exp1.sample(rng);
        let passed = if rows.is_empty() { 0.0 } else { (waited / (climate.rate * activity(time))).max(1e-4) };
        time += passed;
        let rough = volatility[0].step(passed, rng) + volatility[1].step(passed, rng);
        // The mean of the square of a lognormal is put right, so that the day's volatility is what it is said to be.
        let calm = (0.25 * rough - 0.125).exp();
        let shock: f64 = StandardNormal.sample(rng);
        logarithm += climate.volatility * (passed / SESSION).sqrt() * calm * shock;
        if rng.random::<f64>() < JUMPS * passed / SESSION {
            let size: f64 = StandardNormal.sample(rng);
            logarithm += JUMP * climate.volatility * size;
        }
        let wide = climate.breathing * (width.step(passed, rng) + 0.5 * rough);
        let ticks = climate.spread * wide.exp() * if climate.breathing > 0.0 { rng.random_range(0.8..1.2) } else { 1.0 };
        let sides = [depth[0].step(passed, rng), depth[1].step(passed, rng)];
        let gap = if thin.step(passed, rng) > 0.8 { 2 } else { 1 };
        for (side, levels) in sides.iter().zip(&mut levels) {
            // A change is of one level or two, not of all at once.
            for _ in 0..2 {
                let level = rng.random_range(0..LEVELS);
                let own: f64 = StandardNormal.sample(rng);
                let usual = 1.0 + 0.35 * level as f64;
                levels[level] = usual * (0.4 * side + 0.45 * own - 0.2 * rough.max(0.0)).exp();
            }
        }
        let flicker: f64 = StandardNormal.sample(rng);
        rows.push(Row {
            time,
            price: logarithm.exp() + climate.flicker * TICK * flicker,
            spread: (ticks.round() as i64).max(1),
            asks: levels[0],
            bids: levels[1],
            steps: std::array::from_fn(|k| k as i64 * gap),
        });
    }
    rows
}

fn trades(climate: &Climate, rng: &mut impl Rng) -> Vec<Trade> {
    let (mut time, mut bought, mut trades) = (0.0, true, Vec::new());
    // A mean of what has a tail of that exponent, cut at a thousand times the least.
    let mean = TAIL / (TAIL - 1.0) * (1.0 - 1_000.0_f64.powf(1.0 - TAIL));
    let least = climate.volume / climate.trades / mean;
    loop {
        let waited: f64 = Exp1.sample(rng);
        time += waited * SESSION / climate.trades / activity(time);
        if time >= SESSION {
            return trades;
        }
        bought ^= rng.random::<f64>() < 0.3;
        let size = least * (1.0 - rng.random::<f64>()).powf(-1.0 / TAIL).min(1_000.0);
        trades.push(Trade { time, bought, size: size.round().max(1.0) });
    }
}
