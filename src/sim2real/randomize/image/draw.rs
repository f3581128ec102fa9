//! Draws of settings from ranges.

use rand::Rng;

use crate::sim2real::Draws;

/// Uniform draws from the ranges of one effect, in the order of their use.
pub(super) struct Uniform<'a> {
    ranges: &'a [[f64; 2]],
    draws: &'a mut Draws,
}

/// Words of 32 bits kept for the draws of one index; the greediest effect needs 34.
const WORDS: u128 = 64;

impl<'a> Uniform<'a> {
    /// The draws of `place` in an effect's stream. Places of more than 62 bits come round to the first.
    pub fn new(ranges: &'a [[f64; 2]], draws: &'a mut Draws, place: u64) -> Self {
        draws.set_word_pos(u128::from(place % (1 << 62)) * WORDS);
        Self { ranges, draws }
    }

    /// 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.draws.next_u64()
    }

    /// From 0 to just below 1.
    pub fn part(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A value of the effect's parameter `k`.
    pub fn number(&mut self, k: usize) -> f32 {
        let [low, high] = self.ranges[k];
        (low + (high - low) * self.part()) as f32
    }

    /// A whole number of the effect's parameter `k`, the ends of the range as likely as what is between.
    pub fn whole(&mut self, k: usize) -> f64 {
        let [low, high] = self.ranges[k].map(f64::round);
        (low + (high - low + 1.0) * self.part()).floor().min(high)
    }
}
