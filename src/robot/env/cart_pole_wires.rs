//! The mechanisms that cart-poles in blocks can have: a delay of the command, and noise of the position's sensor.

use rand_distr::{Distribution, StandardNormal};

use super::cart_pole_lanes::{BLOCK, Row};
use crate::sim2real::SplitMix64;

/// A delay of each lane's command. A push has one of two directions, so that a bit a step tells all there was.
#[derive(Debug, Clone)]
pub(super) struct Delay {
    /// The actions of each lane, the last in the lowest bit.
    pub past: Vec<u64>,
    /// Whole steps of the delay.
    pub steps: Vec<u32>,
    /// The rest of it, as a part of a step.
    pub rest: Vec<f64>,
}

/// Longest delay, in steps: one bit more is needed for the part of a step.
pub(super) const LONGEST_DELAY: f64 = 62.0;

/// Noise of each lane's position.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    /// Standard deviation of each lane [m].
    pub std: Vec<f64>,
    /// What each lane draws from.
    pub draws: Vec<SplitMix64>,
    /// The key of the stream.
    pub key: u64,
}

/// Where, of all parameters of an assembly, those of the mechanisms are that are run here.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Wires {
    /// The command delay's.
    pub delay: Option<usize>,
    /// The noise's.
    pub noise: Option<usize>,
}

/// The command of an action: -1 for 0, 1 for 1.
#[inline(always)]
fn signed(bit: u64) -> f64 {
    f64::from_bits(1.0_f64.to_bits() | ((bit & 1) ^ 1) << 63)
}

/// The commands of a block's actions.
#[inline(always)]
pub(super) fn plain(actions: &[i64; BLOCK]) -> Row {
    std::array::from_fn(|k| signed(actions[k] as u64))
}

impl Delay {
    /// What arrives of a block's actions: the mean over the step of the command `steps + rest` steps ago. Before its first step a
    /// lane has had its first command for ever.
    #[inline(always)]
    pub fn pass(&mut self, block: usize, actions: &[i64; BLOCK], done: &[u32]) -> Row {
        let own = block * BLOCK..(block + 1) * BLOCK;
        let lanes = self.past[own.clone()].iter_mut().zip(&self.steps[own.clone()]).zip(&self.rest[own]);
        let mut command = [0.0; BLOCK];
        for (k, ((past, steps), rest)) in lanes.enumerate() {
            let action = actions[k] as u64 & 1;
            let first = if done[k] == 0 { action.wrapping_neg() } else { *past << 1 | action };
            *past = first;
            let late = first >> steps;
            command[k] = (1.0 - rest) * signed(late) + rest * signed(late >> 1);
        }
        command
    }
}

impl Noise {
    #[inline(always)]
    pub fn add(&mut self, block: usize, seen: &mut [f64]) {
        let own = block * BLOCK..block * BLOCK + seen.len();
        let lanes = seen.iter_mut().zip(&self.std[own.clone()]).zip(&mut self.draws[own]);
        for ((seen, std), draws) in lanes {
            let draw: f64 = StandardNormal.sample(draws);
            *seen += std * draw;
        }
    }
}
