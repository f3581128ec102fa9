//! The mechanisms that cart-poles side by side can have: a delay of the command, and noise of the position's sensor.

#![allow(clippy::needless_range_loop, reason = "one index for many rows is what becomes vector instructions")]

use crate::sim2real::normal_draw::{AT_ONCE, normal, normals};
use crate::sim2real::split_mix::next_bits;
use crate::sim2real::{Seed, SplitMix64};

/// A delay of each lane's command. A push has one of two directions, so that a bit a step tells all there was.
#[derive(Debug, Clone)]
pub(super) struct Delay {
    /// The actions of each lane, the last in the lowest bit.
    past: Vec<u64>,
    /// Whole steps of the delay.
    steps: Vec<u64>,
    /// The rest of it, as a part of a step.
    rest: Vec<f64>,
}

/// Longest delay, in steps: one bit more is needed for the part of a step.
pub(super) const LONGEST_DELAY: f64 = 62.0;

/// Noise of each lane's position.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    /// Standard deviation of each lane [m].
    std: Vec<f64>,
    /// The state of the generator that each lane draws from: numbers, of which compilers make vectors.
    draws: Vec<u64>,
    /// The key of the stream.
    key: u64,
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

/// The commands of actions.
#[inline(always)]
pub(super) fn plain(actions: &[i64], commands: &mut [f64]) {
    commands.iter_mut().zip(actions).for_each(|(command, action)| *command = signed(*action as u64));
}

impl Delay {
    pub fn new(lanes: usize) -> Self {
        Self { past: vec![0; lanes], steps: vec![0; lanes], rest: vec![0.0; lanes] }
    }

    /// Delays lane `lane` by so many steps.
    #[inline]
    pub fn set(&mut self, lane: usize, steps: f64) {
        let steps = steps.min(LONGEST_DELAY);
        (self.steps[lane], self.rest[lane]) = (steps as u64, steps.fract());
    }

    /// What arrives of the actions of the lanes from `first` on, which have `done` so many steps of their episodes: the mean over the
    /// step of the command `steps + rest` steps ago. Before its first step a lane has had its first command for ever.
    #[inline(always)]
    pub fn pass(&mut self, first: usize, actions: &[i64], done: &[u32], commands: &mut [f64]) {
        let (lanes, count) = (first..first + commands.len(), commands.len());
        let (past, steps, rest) = (&mut self.past[lanes.clone()], &self.steps[lanes.clone()], &self.rest[lanes]);
        // As long as one another, or compilers ask at every lane.
        let (past, steps, rest) = (&mut past[..count], &steps[..count], &rest[..count]);
        let (actions, done, commands) = (&actions[..count], &done[..count], &mut commands[..count]);
        for k in 0..count {
            let action = actions[k] as u64 & 1;
            let all = if done[k] == 0 { action.wrapping_neg() } else { past[k] << 1 | action };
            past[k] = all;
            let late = all >> (steps[k] & 63);
            commands[k] = (1.0 - rest[k]) * signed(late) + rest[k] * signed(late >> 1);
        }
    }

    /// Makes lane `to` a copy of lane `from` of `other`, or of its own where there is none.
    pub fn copy(&mut self, other: Option<&Self>, from: usize, to: usize) {
        let other = other.unwrap_or(self);
        let (past, steps, rest) = (other.past[from], other.steps[from], other.rest[from]);
        (self.past[to], self.steps[to], self.rest[to]) = (past, steps, rest);
    }
}

impl Noise {
    pub fn new(lanes: usize) -> Self {
        let key = Seed(0).child("noise").0;
        Self { std: vec![0.0; lanes], draws: vec![SplitMix64::new(Seed(0), key).state(); lanes], key }
    }

    /// The noise of lane `lane` has this standard deviation [m].
    #[inline]
    pub fn set(&mut self, lane: usize, std: f64) {
        self.std[lane] = std;
    }

    /// Begins the noise of the episodes of these seeds in `lanes`, as many, and adds the first of it to the positions `seen`.
    #[inline(always)]
    pub fn begin(&mut self, lanes: &[u32], seeds: &[Seed; AT_ONCE], seen: &mut [f64; AT_ONCE]) {
        let mut draws = [0; AT_ONCE];
        for k in 0..AT_ONCE {
            draws[k] = SplitMix64::new(seeds[k], self.key).state();
        }
        let drawn = normals(&next_bits(&mut draws));
        for (k, lane) in lanes.iter().enumerate() {
            let lane = *lane as usize;
            self.draws[lane] = draws[k];
            seen[k] += self.std[lane] * drawn[k];
        }
    }

    /// The positions of the lanes from `first` on, as the sensor tells them.
    #[inline(always)]
    pub fn add(&mut self, first: usize, positions: &[f64], seen: &mut [f64]) {
        let lanes = first..first + positions.len();
        let (std, std_left) = self.std[lanes.clone()].as_chunks();
        let (draws, draws_left) = self.draws[lanes].as_chunks_mut();
        let (positions, positions_left) = positions.as_chunks();
        let (seen, seen_left) = seen.as_chunks_mut();
        for (((std, draws), positions), seen) in std.iter().zip(draws).zip(positions).zip(seen) {
            add_eight(std, draws, positions, seen);
        }
        for (((std, state), position), seen) in std_left.iter().zip(draws_left).zip(positions_left).zip(seen_left) {
            let mut draws = SplitMix64::at(*state);
            *seen = position + std * normal(draws.bits());
            *state = draws.state();
        }
    }

    /// Makes lane `to` a copy of lane `from` of `other`, or of its own where there is none.
    pub fn copy(&mut self, other: Option<&Self>, from: usize, to: usize) {
        let other = other.unwrap_or(self);
        let (std, draws) = (other.std[from], other.draws[from]);
        (self.std[to], self.draws[to]) = (std, draws);
    }
}

#[inline(always)]
fn add_eight(std: &[f64; AT_ONCE], draws: &mut [u64; AT_ONCE], positions: &[f64; AT_ONCE], seen: &mut [f64; AT_ONCE]) {
    let drawn = normals(&next_bits(draws));
    for k in 0..AT_ONCE {
        seen[k] = positions[k] + std[k] * drawn[k];
    }
}
