//! Many pendulums side by side, in blocks that compilers turn into vector instructions.

#![allow(clippy::needless_range_loop, reason = "one index for many rows is what becomes vector instructions")]

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::robot::sine::sines;

/// Lanes that are stepped at once.
const BLOCK: usize = 8;
/// One number for each lane of a block.
type Row = [f64; BLOCK];

/// What moves a pendulum: torques over its inertia.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rates {
    /// Of gravity [1/s^2].
    pub gravity: f64,
    /// Of a torque of 1 N m [1/s^2]. The product with an action is of single precision, as Gymnasium has it since NumPy 2: in double,
    /// motions part by 2e-6 within 80 steps.
    pub torque: f32,
    /// Step [s].
    pub step: f64,
    /// Top speed [rad/s].
    pub top_speed: f64,
}

/// Pendulums by semi-implicit Euler.
#[derive(Debug, Clone)]
pub(super) struct PendulumLanes {
    rates: Rates,
    angle: Vec<Row>,
    spin: Vec<Row>,
    /// Steps of each lane's episode.
    pub steps: Vec<u32>,
}

/// `angle` [rad] within half a turn of upright.
#[inline(always)]
pub(super) fn wrapped(angle: f64) -> f64 {
    let turns = angle * (1.0 / TAU);
    // Rounded to the nearest whole number by an addition: an instruction that does it is not on every machine.
    const ROUNDING: f64 = 6_755_399_441_055_744.0;
    angle - TAU * ((turns + ROUNDING) - ROUNDING)
}

/// The reward of a step that begins at `angle` [rad] with `spin` [rad/s] and has the torque `torque` [N m].
#[inline(always)]
pub(super) fn reward(angle: f64, spin: f64, torque: f64) -> f64 {
    let from_upright = wrapped(angle);
    -(from_upright * from_upright + 0.1 * spin * spin + 0.001 * torque * torque)
}

impl PendulumLanes {
    /// `count` lanes.
    pub fn new(count: usize, rates: Rates) -> Self {
        let blocks = count.div_ceil(BLOCK);
        Self { rates, angle: vec![[0.0; BLOCK]; blocks], spin: vec![[0.0; BLOCK]; blocks], steps: vec![0; count] }
    }

    /// Angle [rad] and angular velocity [rad/s] of lane `lane`.
    pub fn state(&self, lane: usize) -> [f64; 2] {
        [self.angle[lane / BLOCK][lane % BLOCK], self.spin[lane / BLOCK][lane % BLOCK]]
    }

    /// Puts lane `lane` where an episode begins, and gives what is observed of it.
    pub fn begin(&mut self, lane: usize, state: [f64; 2]) -> [f32; 3] {
        let (block, k) = (lane / BLOCK, lane % BLOCK);
        [self.angle[block][k], self.spin[block][k]] = state;
        self.steps[lane] = 0;
        observed(state)
    }

    /// Takes a step in all lanes by `actions` [N m], and writes what is observed, and rewards.
    pub fn step(&mut self, actions: &[f32], observations: &mut [f32], rewards: &mut [f64]) {
        let Rates { gravity, torque, step, top_speed } = self.rates;
        let out = observations.chunks_mut(3 * BLOCK).zip(rewards.chunks_mut(BLOCK));
        let lanes = self.angle.iter_mut().zip(&mut self.spin).zip(actions.chunks(BLOCK)).zip(out);
        for (((angle, spin), given), (observations, rewards)) in lanes {
            let (mut action, mut driven, mut gained) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
            for (k, given) in given.iter().enumerate() {
                action[k] = f64::from(*given);
                driven[k] = f64::from(torque * given);
            }
            let mut sine = *angle;
            sines(&mut sine);
            let (mut cosine, mut seen) = ([0.0; BLOCK], [0.0; BLOCK]);
            for k in 0..BLOCK {
                gained[k] = reward(angle[k], spin[k], action[k]);
                let free = spin[k] + (gravity * sine[k] + driven[k]) * step;
                spin[k] = free.max(-top_speed).min(top_speed);
                angle[k] += step * spin[k];
                cosine[k] = angle[k] + FRAC_PI_2;
                seen[k] = angle[k];
            }
            sines(&mut cosine);
            sines(&mut seen);
            rewards.copy_from_slice(&gained[..rewards.len()]);
            for (k, row) in observations.chunks_exact_mut(3).enumerate() {
                row.copy_from_slice(&[cosine[k] as f32, seen[k] as f32, spin[k] as f32]);
            }
        }
        self.steps.iter_mut().for_each(|steps| *steps = steps.saturating_add(1));
    }

    /// Makes lane `to` a copy of lane `from` of `other`.
    pub fn copy_state(&mut self, to: usize, state: [f64; 2], steps: u32) {
        self.begin(to, state);
        self.steps[to] = steps;
    }
}

/// What is observed of a state.
pub(super) fn observed([angle, spin]: [f64; 2]) -> [f32; 3] {
    let mut both = [angle + FRAC_PI_2, angle];
    sines(&mut both);
    [both[0] as f32, both[1] as f32, spin as f32]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_wrapped_as_gymnasium_wraps_them() {
        for k in -20_000..20_000 {
            let angle = f64::from(k) * 1e-3;
            let theirs = (angle + std::f64::consts::PI).rem_euclid(TAU) - std::f64::consts::PI;
            assert!((wrapped(angle) - theirs).abs() < 1e-12, "{angle}");
        }
    }
}
