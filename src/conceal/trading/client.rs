//! The client: when it decides, which way, how much.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use super::climate::SESSION;
use super::noise::Noise;
use super::tape::{Tape, activity};
use crate::sim2real::Seed;

/// An order as it was decided, with the luck it will have: drawn before, so that it has the same whatever is concealed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Intent {
    /// When it is decided [s after the open].
    pub time: f64,
    /// Whether it buys.
    pub buys: bool,
    /// How much [units].
    pub quantity: f64,
    /// For how long it rests at the best price of its own side [s]; none for what takes at once.
    pub rests: Option<f64>,
    /// Noise of its price [standard deviations].
    pub noise: f64,
    /// Numbers in [0, 1).
    pub dice: [f64; 4],
    /// Standard normal numbers.
    pub normals: [f64; 4],
}

impl Intent {
    /// 1 for a purchase, -1 for a sale.
    pub fn sign(&self) -> f64 {
        if self.buys { 1.0 } else { -1.0 }
    }
}

/// How the client trades on a day.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Habits {
    /// Orders a day.
    pub count: usize,
    /// Least and largest quantity [units].
    pub sizes: (f64, f64),
    /// Probability that an order is on the side of the one before.
    pub persistence: f64,
    /// How unevenly decisions follow one another; 0 for a metronome.
    pub haste: f64,
    /// Probability that a decision foretells the market's next half minute.
    pub foresight: f64,
    /// Quantities are whole multiples of it [units].
    pub whole: f64,
    /// Part of the orders that rest.
    pub resting: f64,
}

/// Nothing is decided in the first minute and in the last three [s].
const FROM: f64 = 60.0;
const UNTIL: f64 = SESSION - 180.0;
/// How far those see who foretell the market [s].
const SIGHT: f64 = 30.0;

impl Habits {
    /// The orders of a day on `tape`.
    pub fn orders(&self, tape: &Tape, noise: Noise, seed: Seed) -> Vec<Intent> {
        let noise = noise.draw(self.count, &mut *seed.stream("noise"));
        let mut luck = seed.stream("luck");
        let mut rng = seed.stream("client");
        let times = self.times(&mut *rng);
        let mut buys = rng.random::<bool>();
        let one = |(time, noise): (f64, f64)| {
            buys ^= rng.random::<f64>() >= self.persistence;
            if self.foresight > 0.0 && rng.random::<f64>() < self.foresight {
                buys = tape.price_at(time + SIGHT) > tape.price_at(time);
            }
            let drawn = self.sizes.0 * (self.sizes.1 / self.sizes.0).powf(rng.random::<f64>());
            Intent {
                time,
                buys,
                quantity: (drawn / self.whole).round().max(1.0) * self.whole,
                rests: (rng.random::<f64>() < self.resting).then(|| rng.random_range(30.0..150.0)),
                noise,
                dice: std::array::from_fn(|_| luck.random()),
                normals: std::array::from_fn(|_| StandardNormal.sample(&mut *luck)),
            }
        };
        times.into_iter().zip(noise).map(one).collect()
    }

    /// Decisions [s after the open], the more frequent the busier the market.
    fn times(&self, rng: &mut impl Rng) -> Vec<f64> {
        let mut sum = 0.0;
        let waits: Vec<f64> = (0..self.count)
            .map(|k| {
                let wobble: f64 = StandardNormal.sample(rng);
                let at = FROM + (UNTIL - FROM) * k as f64 / self.count as f64;
                sum += (self.haste * wobble).exp() / if self.haste > 0.0 { activity(at) } else { 1.0 };
                sum
            })
            .collect();
        waits.into_iter().map(|wait| FROM + (UNTIL - FROM) * wait / (sum * 1.001)).collect()
    }
}
