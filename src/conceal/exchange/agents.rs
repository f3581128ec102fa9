//! The crowd: agents without a plan who post, cancel and take about a value that nobody sees.
//!
//! Source: Farmer, Patelli & Zovko 2005, "The predictive power of zero intelligence in financial markets": Poisson limit
//! orders, cancellations and market orders. Added here: a hidden value that wanders, and hours that are busy or quiet.

use rand::RngExt;
use rand_distr::{Distribution, Exp1, StandardNormal};

use crate::sim2real::{Draws, Seed};

use super::order_book::{Match, OrderBook, Side};

/// Seconds between the points of the hidden value and of the activity.
const GRID: f64 = 0.1;
/// Limit orders per second, both sides, at mean activity.
const POSTS: f64 = 0.52;
/// Market orders per second at mean activity.
const TAKES: f64 = 0.10;
/// Cancellations per second and resting order, at mean activity.
const CANCELS: f64 = 1.0 / 190.0;
/// How much likelier an order is cancelled that the value has passed.
const REGRET: f64 = 25.0;
/// Market orders per second while the value stands beyond the best offer or bid, at mean activity.
const SNIPES: f64 = 0.9;
/// Mean distance of a limit order from the value, beyond the first tick [ticks].
const REACH: f64 = 3.2;
/// Distance from the value that the dealer lets no best price exceed [ticks].
const WIDEST: f64 = 5.0;
/// Levels below which a patient dealer posts behind the others, so that a side never runs empty.
const PATIENT: usize = 12;

/// The hidden value and how busy the crowd is, over a session.
#[derive(Debug, Clone)]
pub(super) struct Climate {
    /// Hidden value [ticks].
    value: Vec<f64>,
    /// Activity, 1 on average.
    activity: Vec<f64>,
    start: f64,
}

impl Climate {
    /// From `start` to `end` [s after the open], with a value of `level` [ticks] that moves by `volatility` [ticks per
    /// square root of a second].
    pub(super) fn new(start: f64, end: f64, level: f64, volatility: f64, seed: Seed) -> Self {
        let (mut values, mut moods) = (seed.stream("exchange value"), seed.stream("exchange activity"));
        let points = ((end - start) / GRID).ceil() as usize + 2;
        let (memory, spread) = ((-GRID / 30.0_f64).exp(), 1.4_f64);
        let (mut mood, mut value) = (0.0, level);
        let mut climate = Self { value: Vec::with_capacity(points), activity: Vec::with_capacity(points), start };
        for point in 0..points {
            let part = ((start + point as f64 * GRID) / end).clamp(0.0, 1.0);
            let hours = 0.75 + 1.0 * (-part / 0.07).exp() + 0.8 * ((part - 1.0) / 0.06).exp();
            let activity: f64 = hours * f64::exp(mood - 0.5 * spread * spread) / 0.868;
            let (a, b): (f64, f64) = (StandardNormal.sample(&mut moods), StandardNormal.sample(&mut values));
            mood = memory * mood + spread * (1.0 - memory * memory).sqrt() * a;
            value += volatility * (activity * GRID).sqrt() * b;
            climate.value.push(value);
            climate.activity.push(activity);
        }
        climate
    }

    fn index(&self, time: f64) -> usize {
        (((time - self.start) / GRID).max(0.0) as usize).min(self.value.len() - 1)
    }

    /// Activity at a time [s after the open].
    pub(super) fn activity(&self, time: f64) -> f64 {
        self.activity[self.index(time)]
    }

    fn value(&self, time: f64) -> f64 {
        self.value[self.index(time)]
    }
}

/// An order of the crowd that waits, as far as the crowd knows.
#[derive(Debug, Clone, Copy)]
struct Posted {
    id: u64,
    side: Side,
    ticks: i64,
}

/// The crowd.
#[derive(Debug)]
pub(super) struct Agents {
    rng: Draws,
    posted: Vec<Posted>,
    next: u64,
}

impl Agents {
    pub(super) fn new(seed: Seed) -> Self {
        Self { rng: seed.stream("exchange agents"), posted: Vec::new(), next: 1 }
    }

    /// Fills an empty book about a value [ticks].
    pub(super) fn open(&mut self, book: &mut OrderBook, climate: &Climate, time: f64) {
        let value = climate.value(time);
        for _ in 0..90 {
            self.post(book, value);
        }
        self.patience(book, value);
    }

    /// Seconds until the crowd acts next.
    pub(super) fn wait(&mut self, climate: &Climate, time: f64) -> f64 {
        // The fastest it could be; `act` then does nothing where a slower rate was right.
        let wait: f64 = Exp1.sample(&mut self.rng);
        wait / (climate.activity(time) * self.fastest())
    }

    fn fastest(&self) -> f64 {
        POSTS + TAKES + SNIPES + CANCELS * REGRET * self.posted.len() as f64
    }

    /// One act of the crowd, perhaps none; the side that took and what it met.
    pub(super) fn act(&mut self, book: &mut OrderBook, climate: &Climate, time: f64) -> Option<(Side, Vec<Match>)> {
        let value = climate.value(time);
        let mut drawn = self.rng.random::<f64>() * self.fastest();
        let mut below = |rate: f64| {
            drawn -= rate;
            drawn < 0.0
        };
        if below(POSTS) {
            self.post(book, value);
        } else if below(TAKES) {
            return self.take(book, value);
        } else if below(SNIPES) {
            return self.snipe(book, value);
        } else {
            self.cancel(book, value);
        }
        self.patience(book, value);
        None
    }

    /// Posts an order at a random distance from the value, never across the spread.
    fn post(&mut self, book: &mut OrderBook, value: f64) {
        let side = self.side();
        let reach: f64 = Exp1.sample(&mut self.rng);
        let away = 0.6 + reach * REACH;
        let ticks = match side {
            Side::Buy => ((value - away).floor() as i64).min(book.best_ask().map_or(i64::MAX, |ask| ask - 1)),
            Side::Sell => ((value + away).ceil() as i64).max(book.best_bid().map_or(i64::MIN, |bid| bid + 1)),
        };
        let quantity = self.size(95.0, 0.7);
        self.rest(book, side, ticks, quantity);
    }

    fn rest(&mut self, book: &mut OrderBook, side: Side, ticks: i64, quantity: i64) {
        book.limit(self.next, side, ticks, quantity);
        self.posted.push(Posted { id: self.next, side, ticks });
        self.next += 1;
    }

    /// The dealer's orders behind the last level, until there are enough levels.
    fn patience(&mut self, book: &mut OrderBook, value: f64) {
        for side in [Side::Buy, Side::Sell] {
            let farthest = (value - side.sign() as f64 * WIDEST).round() as i64;
            if book.best(side).is_some_and(|best| side.sign() * (farthest - best) > 0)
                && book.best(side.opposite()).is_some_and(|facing| side.sign() * (facing - farthest) > 0)
            {
                let quantity = self.size(160.0, 0.4);
                self.rest(book, side, farthest, quantity);
            }
            while book.levels(side) < PATIENT {
                let facing = book.best(side.opposite()).unwrap_or(value.round() as i64);
                let last = book.depth(side, PATIENT).last().map_or(facing, |level| level.0);
                let quantity = self.size(160.0, 0.4);
                self.rest(book, side, last - side.sign(), quantity);
            }
        }
    }

    /// A market order, likelier towards the value.
    fn take(&mut self, book: &mut OrderBook, value: f64) -> Option<(Side, Vec<Match>)> {
        let middle = 0.5 * (book.best_bid()? + book.best_ask()?) as f64;
        let buys = self.rng.random::<f64>() < 1.0 / (1.0 + (-(value - middle) / 1.5).exp());
        let side = if buys { Side::Buy } else { Side::Sell };
        let quantity = self.size(70.0, 0.9);
        Some(self.taken(book, side, quantity, value))
    }

    /// Takes what stands on the wrong side of the value, at its price and no further.
    fn snipe(&mut self, book: &mut OrderBook, value: f64) -> Option<(Side, Vec<Match>)> {
        let (bid, ask) = (book.best_bid()?, book.best_ask()?);
        let side = if value > ask as f64 + 0.3 {
            Side::Buy
        } else if value < bid as f64 - 0.3 {
            Side::Sell
        } else {
            return None;
        };
        let displayed = book.depth(side.opposite(), 1).first().map_or(0, |level| level.1);
        let quantity = self.size(120.0, 0.7).min(displayed);
        Some(self.taken(book, side, quantity, value))
    }

    fn taken(&mut self, book: &mut OrderBook, side: Side, quantity: i64, value: f64) -> (Side, Vec<Match>) {
        let matches = book.market(side, quantity);
        self.patience(book, value);
        (side, matches)
    }

    /// Thinks about one order at random; keeps it if it is not yet worth cancelling.
    fn cancel(&mut self, book: &mut OrderBook, value: f64) {
        if self.posted.is_empty() {
            return;
        }
        let place = self.rng.random_range(0..self.posted.len());
        let order = self.posted[place];
        let inside = order.side.sign() as f64 * (value - order.ticks as f64);
        let haste = match inside {
            passed if passed < 0.0 => REGRET,
            // Far from the value the book would grow for ever.
            far if far > 4.0 * REACH => 3.0,
            _ => 1.0,
        };
        if self.rng.random::<f64>() * REGRET < haste {
            self.posted.swap_remove(place);
            book.cancel(order.id, order.side, order.ticks);
        }
    }

    fn side(&mut self) -> Side {
        if self.rng.random::<bool>() { Side::Buy } else { Side::Sell }
    }

    /// A log-normal size about `median` [lots], in tens four times of five.
    fn size(&mut self, median: f64, spread: f64) -> i64 {
        let normal: f64 = StandardNormal.sample(&mut self.rng);
        let size = median * (spread * normal).exp();
        let size = if self.rng.random::<f64>() < 0.8 { (size / 10.0).round() * 10.0 } else { size.round() };
        (size as i64).clamp(1, 1_500)
    }
}
