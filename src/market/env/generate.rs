//! Data for environments that are made by their ids alone: generated from a seed, with regimes of volatility.
//!
//! - The regime is a Markov chain of two states, calm and turbulent, which last 200 and 50 rows on average; turbulent volatility is three
//!   times the calm one.
//! - **Bars** of a minute: log returns are autoregressive of order one with the coefficient `momentum`, and share a third of their
//!   variance between instruments; of six steps within a bar come its high and low; volumes are log-normal and rise with
//!   volatility.
//! - **Quotes** of a second: the mid goes by ticks, the more likely to the side on which less is displayed; the spread is one tick or
//!   two, wider in turbulence; trades are printed at the touch.
//! - **Book**: limit orders, market orders and cancellations come at random (zero intelligence), market orders with a sign that
//!   persists; turbulence brings more of them.
//!
//! Source: Hamilton, Econometrica 57 (1989) for regimes; Smith, Farmer, Gillemot and Krishnamurthy, Quantitative Finance 3 (2003) for
//! the book.

use std::collections::BTreeMap;

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

use crate::market::{Bar, DepthAction, DepthChange, History, HistoryError, Instrument, Level, Price, Print, Quotes, Side};
use crate::sim2real::{Draws, Seed, Timestamp};

/// What generated data are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataKind {
    /// Bars of a minute.
    Bars,
    /// Quotes of a second, and trades.
    Quotes,
    /// Changes of a book, and trades.
    Book,
}

/// A market that is generated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Generated {
    /// What its data are.
    pub kind: DataKind,
    /// Number of rows of each instrument: bars, quotes, or changes of the book.
    pub rows: usize,
    /// Number of instruments.
    pub instruments: usize,
    /// Correlation of a bar's return with the one before: above 0 prices run on, below 0 they come back.
    pub momentum: f64,
    /// Where all of it is drawn from.
    pub seed: Seed,
}

/// When the first row is: 2024-01-01T00:00:00Z.
const BEGIN: i64 = 1_704_067_200 * Timestamp::NANOS;
const MINUTE: i64 = 60 * Timestamp::NANOS;
/// A tick [1e-9 of the currency].
const TICK: i64 = 10_000_000;
/// Price of all instruments at the beginning [ticks].
const PRICE: i64 = 10_000;
/// Volatility of a bar in the calm regime, and in the turbulent one.
const VOLATILITY: [f64; 2] = [6e-4, 1.8e-3];
/// Probability to leave each regime at a row.
const LEAVES: [f64; 2] = [0.005, 0.02];

impl Generated {
    /// The instruments: prices in cents, quantities in ones.
    #[must_use]
    pub fn instruments(&self) -> Vec<Instrument> {
        let one = |k: usize| Instrument {
            symbol: format!("GEN{k}"),
            tick_size: 0.01,
            lot_size: 1.0,
            average_daily_volume: None,
            daily_volatility: None,
        };
        (0..self.instruments).map(one).collect()
    }

    /// Their data.
    ///
    /// # Errors
    /// None: what is generated is a history.
    pub fn histories(&self) -> Result<Vec<History>, HistoryError> {
        let each = 0..self.instruments;
        match self.kind {
            DataKind::Bars => self.bars(),
            DataKind::Quotes => each.map(|k| self.quotes(self.seed.child(&format!("GEN{k}")))).collect(),
            DataKind::Book => each.map(|k| self.book(self.seed.child(&format!("GEN{k}")))).collect(),
        }
    }

    fn bars(&self) -> Result<Vec<History>, HistoryError> {
        let mut regimes = Regimes::new(self.seed);
        let states: Vec<usize> = (0..self.rows).map(|_| regimes.next()).collect();
        let mut common = self.seed.stream("data.common");
        let shared: Vec<f64> = (0..self.rows).map(|_| normal(&mut common)).collect();
        let part = if self.instruments > 1 { 1.0 / 3.0_f64 } else { 0.0 };
        let one = |k: usize| {
            let seed = self.seed.child(&format!("GEN{k}"));
            let (mut prices, mut volumes) = (seed.stream("data.prices"), seed.stream("data.volumes"));
            let fresh = (1.0 - self.momentum * self.momentum).max(0.0).sqrt();
            let (mut logarithm, mut last) = ((PRICE as f64).ln(), 0.0);
            let row = |row: usize| {
                let deviation = VOLATILITY[states[row]];
                let shock = part.sqrt() * shared[row] + (1.0 - part).sqrt() * normal(&mut prices);
                last = self.momentum * last + fresh * shock;
                let open = ticks(logarithm.exp());
                let (mut high, mut low, mut close) = (open, open, open);
                for step in 1..=6 {
                    // A bridge to the close: within the bar there is no momentum.
                    let left = 6 - step;
                    let wobble = if left > 0 { 0.3 * normal(&mut prices) } else { 0.0 };
                    close = ticks((logarithm + deviation * (last * f64::from(step) / 6.0 + wobble)).exp());
                    (high, low) = (high.max(close), low.min(close));
                }
                logarithm += deviation * last;
                let volume = (10_000.0 * (0.5 * normal(&mut volumes)).exp() * deviation / VOLATILITY[0]).round();
                let open_at = Timestamp(BEGIN + row as i64 * MINUTE);
                Bar { open_at, known_at: open_at + MINUTE, open, high, low, close, volume }
            };
            History::new((0..self.rows).map(row).collect(), Quotes::default())
        };
        (0..self.instruments).map(one).collect()
    }

    fn quotes(&self, seed: Seed) -> Result<History, HistoryError> {
        let (mut regimes, mut moves, mut trades) =
            (Regimes::new(seed), seed.stream("data.prices"), seed.stream("data.trades"));
        let (mut quotes, mut prints) = (Quotes::with_depth(1), Vec::new());
        let (mut bid, mut lean) = (PRICE, 0.0_f64);
        for row in 0..self.rows {
            let turbulent = regimes.next() == 1;
            lean = 0.9 * lean + 0.3 * normal(&mut moves);
            let bias = lean.tanh();
            let moves_at = if turbulent { 0.5 } else { 0.15 };
            if moves.random::<f64>() < moves_at {
                bid += if moves.random::<f64>() < 0.5 + 0.4 * bias { 1 } else { -1 };
                bid = bid.max(100);
            }
            let spread = 1 + i64::from(moves.random::<f64>() < if turbulent { 0.5 } else { 0.1 });
            let size = |share: f64, draw: f64| (100.0 * (1.0 + 9.0 * share * draw)).round();
            let sizes = [size(0.5 + 0.5 * bias, moves.random()), size(0.5 - 0.5 * bias, moves.random())];
            let at = BEGIN + row as i64 * Timestamp::NANOS;
            let level = |tick: i64, size: f64| Level { price: tick as f64 * 0.01, size };
            quotes.push(Timestamp(at), &[level(bid, sizes[0])], &[level(bid + spread, sizes[1])]);
            if trades.random::<f64>() < if turbulent { 0.8 } else { 0.4 } {
                let buys = trades.random::<f64>() < 0.5 + 0.4 * bias;
                let (tick, aggressor) = if buys { (bid + spread, Side::Buy) } else { (bid, Side::Sell) };
                let size = 100.0 * f64::from(trades.random_range(1..=5_u32));
                let time = Timestamp(at + Timestamp::NANOS / 2);
                prints.push(Print { time, price: tick as f64 * 0.01, size, aggressor: Some(aggressor) });
            }
        }
        History::new(Vec::new(), quotes)?.with_prints(prints)
    }

    fn book(&self, seed: Seed) -> Result<History, HistoryError> {
        let mut regimes = Regimes::new(seed);
        let (mut events, mut signs) = (seed.stream("data.prices"), seed.stream("data.trades"));
        let mut book = Flow { time: BEGIN, sides: Default::default(), changes: Vec::new(), prints: Vec::new() };
        for k in 1..=10 {
            let size = 100.0 * f64::from(events.random_range(1..=9_u32));
            book.set(0, PRICE - k, size);
            book.set(1, PRICE + k, size);
        }
        let mut sign = 0;
        while book.changes.len() < self.rows {
            let turbulent = regimes.next() == 1;
            let wait = -events.random::<f64>().max(1e-12).ln() * if turbulent { 0.1 } else { 0.3 };
            book.time += ((wait * Timestamp::NANOS as f64) as i64).max(1_000);
            let (bid, ask) = book.best();
            let side = usize::from(events.random::<bool>());
            let what: f64 = events.random();
            if what < 0.5 {
                let behind = (events.random::<f64>() * events.random::<f64>() * 8.0) as i64;
                let tick = if side == 0 { ask - 1 - behind } else { bid + 1 + behind };
                let size = 100.0 * f64::from(events.random_range(1..=4_u32));
                book.add(side, tick, size);
            } else if what < if turbulent { 0.75 } else { 0.85 } {
                let nth = (events.random::<f64>() * 8.0) as usize;
                let levels = &book.sides[side];
                let found = if side == 0 { levels.iter().nth_back(nth) } else { levels.iter().nth(nth) };
                // The last levels stay: a market always has two sides.
                if let (Some((tick, _)), true) = (found, levels.len() > 3) {
                    book.add(side, *tick, -100.0 * f64::from(events.random_range(1..=3_u32)));
                }
            } else {
                if signs.random::<f64>() < 0.2 {
                    sign = usize::from(signs.random::<bool>());
                }
                book.take(1 - sign, 100.0 * f64::from(signs.random_range(1..=4_u32)));
            }
            book.keep_two_sides(side);
        }
        History::default().with_depth(book.changes)?.with_prints(book.prints)
    }
}

/// A book that is generated: bids and asks by tick.
struct Flow {
    time: i64,
    sides: [BTreeMap<i64, f64>; 2],
    changes: Vec<DepthChange>,
    prints: Vec<Print>,
}

impl Flow {
    /// Best bid and ask [ticks].
    fn best(&self) -> (i64, i64) {
        let bid = self.sides[0].keys().next_back().copied().unwrap_or(PRICE - 1);
        let ask = self.sides[1].keys().next().copied().unwrap_or(bid + 1);
        (bid, ask)
    }

    fn set(&mut self, side: usize, tick: i64, size: f64) {
        if tick < 1 {
            return;
        }
        if size > 0.0 {
            self.sides[side].insert(tick, size);
        } else {
            self.sides[side].remove(&tick);
        }
        let (time, side) = (Timestamp(self.time), if side == 0 { Side::Buy } else { Side::Sell });
        let (action, price, size) = (DepthAction::Set, Price(tick * TICK), size.max(0.0));
        self.changes.push(DepthChange { time, known_at: time, side, action, price, size });
    }

    fn add(&mut self, side: usize, tick: i64, size: f64) {
        let before = self.sides[side].get(&tick).copied().unwrap_or_default();
        self.set(side, tick, before + size);
    }

    /// A market order takes up to `size` of the best level of `side`.
    fn take(&mut self, side: usize, size: f64) {
        let (bid, ask) = self.best();
        let tick = if side == 0 { bid } else { ask };
        let there = self.sides[side].get(&tick).copied().unwrap_or_default();
        if there <= 0.0 || self.sides[side].len() < 3 {
            return;
        }
        let aggressor = Some(if side == 0 { Side::Sell } else { Side::Buy });
        let (time, size) = (Timestamp(self.time), size.min(there));
        self.prints.push(Print { time, price: tick as f64 * 0.01, size, aggressor });
        self.set(side, tick, there - size);
    }

    /// Levels far from the best are given up, and a side never runs out.
    fn keep_two_sides(&mut self, side: usize) {
        let (bid, ask) = self.best();
        let far = if side == 0 {
            self.sides[0].keys().next().copied().filter(|tick| *tick < bid - 30)
        } else {
            self.sides[1].keys().next_back().copied().filter(|tick| *tick > ask + 30)
        };
        if let Some(tick) = far {
            self.set(side, tick, 0.0);
        }
        if self.sides[side].len() < 3 {
            let last = if side == 0 { bid - 3 } else { ask + 3 };
            self.add(side, last, 300.0);
        }
    }
}

/// The regime under way.
struct Regimes {
    state: usize,
    draws: Draws,
}

impl Regimes {
    fn new(seed: Seed) -> Self {
        Self { state: 0, draws: seed.stream("data.regimes") }
    }

    fn next(&mut self) -> usize {
        if self.draws.random::<f64>() < LEAVES[self.state] {
            self.state = 1 - self.state;
        }
        self.state
    }
}

fn normal(draws: &mut Draws) -> f64 {
    StandardNormal.sample(&mut **draws)
}

/// A price of so many ticks, at least 1.
fn ticks(many: f64) -> Price {
    Price((many.round() as i64).max(1) * TICK)
}
