//! Many cart-poles side by side, in blocks that compilers turn into vector instructions: what most training runs step.
//!
//! Beside the plain task they have parameters of their own, a delay of the command, and noise of the position's sensor, by the laws
//! of `sim2real::mechanism`; whatever else there may be is run by [`Simulated`](super::simulated::Simulated).

#![allow(clippy::needless_range_loop, reason = "one index for many rows is what becomes vector instructions")]

use pulp::{Arch, NullaryFnOnce};
use rand_distr::{Distribution, StandardNormal};

use super::cart_pole::{START, Thresholds};
use super::cart_pole_wires::{Delay, LONGEST_DELAY, Noise, Wires, plain};
use crate::rl::Episode;
use crate::robot::sine::sine;
use crate::sim2real::{Seed, SplitMix64};

/// Lanes that are stepped at once.
pub(super) const BLOCK: usize = 8;

/// One number for each lane of a block.
pub(super) type Row = [f64; BLOCK];

/// Cart position [m] and velocity [m/s], pole angle [rad] and angular velocity [rad/s].
#[derive(Debug, Clone, Copy, Default)]
struct State {
    position: Row,
    velocity: Row,
    angle: Row,
    spin: Row,
}

/// The parameters of a block as the equations have them. With a cart of mass `M`, a pole of mass `m` and half length `l`:
#[derive(Debug, Clone, Copy)]
struct Constants {
    /// `M + m` [kg].
    mass: Row,
    /// `0.75 m` [kg].
    swinging: Row,
    /// `m l` [kg m].
    lever: Row,
    /// `m g` [N].
    weight: Row,
    /// `c / l` of the hinge's friction `c` [N s/rad].
    hinge: Row,
    /// Friction of the cart [N s/m].
    friction: Row,
    /// `0.75 / l` [1/m].
    turning: Row,
    /// `1 / m` [1/kg].
    lightness: Row,
    /// Gain [N per unit of command].
    gain: Row,
}

impl Constants {
    /// Sets lane `k` to these values of [`CartPole`](crate::robot::CartPole)'s parameters.
    fn set(&mut self, k: usize, values: &[f64]) {
        let [cart, pole, half, gravity, friction, hinge, gain] = std::array::from_fn(|k| values[k]);
        self.mass[k] = cart + pole;
        self.swinging[k] = 0.75 * pole;
        self.lever[k] = pole * half;
        self.weight[k] = pole * gravity;
        self.hinge[k] = hinge / half;
        self.friction[k] = friction;
        self.turning[k] = 0.75 / half;
        self.lightness[k] = 1.0 / pole;
        self.gain[k] = gain;
    }

    fn of(values: &[f64]) -> Self {
        let row = [0.0; BLOCK];
        let mut new = Self {
            mass: row,
            swinging: row,
            lever: row,
            weight: row,
            hinge: row,
            friction: row,
            turning: row,
            lightness: row,
            gain: row,
        };
        (0..BLOCK).for_each(|k| new.set(k, values));
        new
    }
}

/// What lanes begin with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Start {
    /// Least value of each component of the state.
    pub low: f64,
    /// Largest.
    pub high: f64,
}

/// The state of an episode at its start.
pub(super) fn started(episode: Episode, start: Start) -> [f64; 4] {
    let mut draws = episode.stream(START);
    std::array::from_fn(|_| draws.between(start.low, start.high))
}

/// Cart-poles by Euler's method, `count` of them.
#[derive(Debug, Clone)]
pub(super) struct CartPoleLanes {
    count: usize,
    states: Vec<State>,
    /// Of each block, or one for all where lanes do not differ.
    constants: Vec<Constants>,
    delay: Option<Delay>,
    noise: Option<Noise>,
    wires: Wires,
    /// Steps of each lane's episode.
    pub steps: Vec<u32>,
    step: f64,
    pub thresholds: Thresholds,
}

impl CartPoleLanes {
    /// `count` lanes with `values` of all parameters, in steps of `step` [s]. Where `own`, each lane may have values of its own.
    pub fn new(count: usize, values: &[f64], own: bool, wires: Wires, step: f64, thresholds: Thresholds) -> Self {
        let blocks = count.div_ceil(BLOCK);
        let padded = blocks * BLOCK;
        let key = Seed(0).child("noise").0;
        let delay = wires.delay.map(|_| Delay { past: vec![0; padded], steps: vec![0; padded], rest: vec![0.0; padded] });
        let draws = || vec![SplitMix64::new(Seed(0), key); padded];
        let noise = wires.noise.map(|_| Noise { std: vec![0.0; padded], draws: draws(), key });
        let states = vec![State::default(); blocks];
        let constants = vec![Constants::of(values); if own { blocks } else { 1 }];
        let mut lanes = Self { count, states, constants, delay, noise, wires, steps: vec![0; padded], step, thresholds };
        (0..count).for_each(|lane| lanes.wire(lane, values));
        lanes
    }

    /// Sets what the mechanisms' parameters say of lane `lane`.
    fn wire(&mut self, lane: usize, values: &[f64]) {
        if let (Some(place), Some(delay)) = (self.wires.delay, &mut self.delay) {
            let steps = (values[place] / self.step).min(LONGEST_DELAY);
            delay.steps[lane] = steps.floor() as u32;
            delay.rest[lane] = steps.fract();
        }
        if let (Some(place), Some(noise)) = (self.wires.noise, &mut self.noise) {
            noise.std[lane] = values[place];
        }
    }

    /// Begins `episode` in lane `lane`, from `state`; `values`, where lanes differ, are those of all its parameters. Gives what is
    /// observed of it.
    pub fn begin(&mut self, lane: usize, episode: Episode, state: [f64; 4], values: Option<&[f64]>) -> [f32; 4] {
        let (block, k) = (lane / BLOCK, lane % BLOCK);
        if let Some(values) = values {
            self.constants[block].set(k, values);
            self.wire(lane, values);
        }
        let own = &mut self.states[block];
        [own.position[k], own.velocity[k], own.angle[k], own.spin[k]] = state;
        self.steps[lane] = 0;
        let mut seen = state;
        if let Some(noise) = &mut self.noise {
            noise.draws[lane] = SplitMix64::new(episode.seed(), noise.key);
            let draw: f64 = StandardNormal.sample(&mut noise.draws[lane]);
            seen[0] += noise.std[lane] * draw;
        }
        seen.map(|value| value as f32)
    }

    /// The state of lane `lane`.
    pub fn state(&self, lane: usize) -> [f64; 4] {
        let (own, k) = (&self.states[lane / BLOCK], lane % BLOCK);
        [own.position[k], own.velocity[k], own.angle[k], own.spin[k]]
    }

    /// Writes component `which` of the state, one a lane.
    pub fn tell(&self, which: usize, values: &mut [f64]) {
        for (state, values) in self.states.iter().zip(values.chunks_mut(BLOCK)) {
            let row = [&state.position, &state.velocity, &state.angle, &state.spin][which];
            values.copy_from_slice(&row[..values.len()]);
        }
    }

    /// Takes a step in all lanes by `actions`, 0 or 1 each, and writes what is observed and whether the episode is over. With the widest
    /// vectors the processor has: the bits are the same with any.
    pub fn step(&mut self, actions: &[i64], observations: &mut [f32], terminated: &mut [bool]) {
        Arch::new().dispatch(Stepped { lanes: self, actions, observations, terminated });
        self.rest();
    }

    /// Puts what only fills the last block back to rest: nobody resets it, and long angles take long.
    fn rest(&mut self) {
        let filled = self.count % BLOCK;
        if filled > 0
            && let Some(last) = self.states.last_mut()
        {
            for row in [&mut last.position, &mut last.velocity, &mut last.angle, &mut last.spin] {
                row[filled..].fill(0.0);
            }
        }
    }

    /// Number of lanes.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Makes lane `to` a copy of lane `from`.
    pub fn copy(&mut self, from: usize, to: usize) {
        let mut one = self.one();
        one.copy_from(self, from, 0);
        self.copy_from(&one, 0, to);
    }

    /// A block of the same kind.
    fn one(&self) -> Self {
        let constants = vec![self.constants[0]];
        let delay =
            self.delay.as_ref().map(|_| Delay { past: vec![0; BLOCK], steps: vec![0; BLOCK], rest: vec![0.0; BLOCK] });
        let noise = self.noise.as_ref().map(|noise| Noise {
            std: vec![0.0; BLOCK],
            draws: vec![SplitMix64::new(Seed(0), noise.key); BLOCK],
            key: noise.key,
        });
        let (states, steps) = (vec![State::default(); 1], vec![0; BLOCK]);
        Self { count: 1, states, constants, delay, noise, steps, ..*self }
    }

    /// Makes lane `to` a copy of lane `from` of `other`.
    pub fn copy_from(&mut self, other: &Self, from: usize, to: usize) {
        let (block, k) = (to / BLOCK, to % BLOCK);
        let own = &mut self.states[block];
        [own.position[k], own.velocity[k], own.angle[k], own.spin[k]] = other.state(from);
        self.steps[to] = other.steps[from];
        if let (Some(own), Some(other)) = (&mut self.delay, &other.delay) {
            (own.past[to], own.steps[to], own.rest[to]) = (other.past[from], other.steps[from], other.rest[from]);
        }
        if let (Some(own), Some(other)) = (&mut self.noise, &other.noise) {
            (own.std[to], own.draws[to]) = (other.std[from], other.draws[from]);
        }
        if self.constants.len() > 1 || self.states.len() == 1 {
            let from_block = if other.constants.len() == 1 { 0 } else { from / BLOCK };
            self.constants[block].copy_lane(&other.constants[from_block], from % BLOCK, k);
        }
    }
}

/// A step of all lanes, with what it reads and writes.
struct Stepped<'a> {
    lanes: &'a mut CartPoleLanes,
    actions: &'a [i64],
    observations: &'a mut [f32],
    terminated: &'a mut [bool],
}

impl NullaryFnOnce for Stepped<'_> {
    type Output = ();

    // What is not inlined here is compiled without the processor's vectors.
    #[inline(always)]
    fn call(self) {
        let CartPoleLanes { states, constants, delay, noise, steps, step, thresholds, .. } = self.lanes;
        let one = constants.len() == 1;
        let rows = self.observations.chunks_mut(4 * BLOCK).zip(self.terminated.chunks_mut(BLOCK));
        let lanes = states.iter_mut().zip(steps.chunks_exact_mut(BLOCK)).zip(self.actions.chunks(BLOCK)).zip(rows);
        for (block, (((state, steps), given), (observations, terminated))) in lanes.enumerate() {
            let own = if one { &constants[0] } else { &constants[block] };
            let mut actions = [0; BLOCK];
            actions[..given.len()].copy_from_slice(given);
            let mut command = match delay {
                None => plain(&actions),
                Some(delay) => delay.pass(block, &actions, steps),
            };
            for k in 0..BLOCK {
                command[k] *= own.gain[k];
                steps[k] = steps[k].saturating_add(1);
            }
            advance(state, own, &command, *step);
            let mut seen = state.position;
            if let Some(noise) = noise {
                noise.add(block, &mut seen[..given.len()]);
            }
            write(state, &seen, thresholds, observations, terminated);
        }
    }
}

impl Constants {
    fn copy_lane(&mut self, other: &Self, from: usize, to: usize) {
        let rows = [
            (&mut self.mass, &other.mass),
            (&mut self.swinging, &other.swinging),
            (&mut self.lever, &other.lever),
            (&mut self.weight, &other.weight),
            (&mut self.hinge, &other.hinge),
            (&mut self.friction, &other.friction),
            (&mut self.turning, &other.turning),
            (&mut self.lightness, &other.lightness),
            (&mut self.gain, &other.gain),
        ];
        rows.into_iter().for_each(|(own, other)| own[to] = other[from]);
    }
}

/// Angles up to this size [rad] have a short way to their sine: all that a pole under way has.
const SHORT: f64 = 0.5;

/// Sine and cosine of each angle [rad]. A lane's bits do not depend on its neighbours' angles.
#[inline(always)]
fn sines(angle: &Row) -> (Row, Row) {
    let (mut sin, mut cos) = ([0.0; BLOCK], [0.0; BLOCK]);
    let mut short = true;
    for k in 0..BLOCK {
        let q = angle[k];
        let z = q * q;
        let z2 = z * z;
        let z4 = z2 * z2;
        // Taylor's series; what is left out is below 1e-17 of 1 within the short way.
        let low = (1.0 - z * (1.0 / 6.0)) + z2 * (1.0 / 120.0 - z * (1.0 / 5_040.0));
        let high = (1.0 / 362_880.0 - z * (1.0 / 39_916_800.0)) + z2 * (1.0 / 6_227_020_800.0);
        sin[k] = q * (low + z4 * high);
        let low = (1.0 - z * 0.5) + z2 * (1.0 / 24.0 - z * (1.0 / 720.0));
        let high = (1.0 / 40_320.0 - z * (1.0 / 3_628_800.0)) + z2 * (1.0 / 479_001_600.0 - z * (1.0 / 87_178_291_200.0));
        cos[k] = low + z4 * high;
        short &= q.abs() <= SHORT;
    }
    if !short {
        long(angle, &mut sin, &mut cos);
    }
    (sin, cos)
}

#[cold]
#[inline(never)]
fn long(angle: &Row, sin: &mut Row, cos: &mut Row) {
    for k in 0..BLOCK {
        if angle[k].abs() > SHORT || angle[k].is_nan() {
            sin[k] = sine(angle[k]);
            cos[k] = sine(angle[k] + std::f64::consts::FRAC_PI_2);
        }
    }
}

/// Speeds are cut off here [m/s, rad/s]: none under way is near it, and one whose episode is over stays finite.
const FASTEST: f64 = 1e4;

/// One step of Euler's method of all lanes of a block.
#[inline(always)]
#[expect(clippy::manual_clamp, reason = "a clamp keeps what is no number, and is no single instruction")]
fn advance(state: &mut State, own: &Constants, force: &Row, step: f64) {
    let (sin, cos) = sines(&state.angle);
    for k in 0..BLOCK {
        let (velocity, spin) = (state.velocity[k], state.spin[k]);
        let leaning = own.weight[k] * sin[k] - own.hinge[k] * spin;
        let reaction = own.lever[k] * spin * spin * sin[k] - 0.75 * cos[k] * leaning;
        let inertia = own.mass[k] - own.swinging[k] * cos[k] * cos[k];
        let acceleration = (force[k] - own.friction[k] * velocity + reaction) / inertia;
        let turning = own.turning[k] * (leaning * own.lightness[k] - cos[k] * acceleration);
        state.position[k] += step * velocity;
        state.angle[k] += step * spin;
        state.velocity[k] = (velocity + step * acceleration).max(-FASTEST).min(FASTEST);
        state.spin[k] = (spin + step * turning).max(-FASTEST).min(FASTEST);
    }
}

#[inline(always)]
fn write(state: &State, seen: &Row, thresholds: &Thresholds, observations: &mut [f32], terminated: &mut [bool]) {
    let mut over = [false; BLOCK];
    for k in 0..BLOCK {
        over[k] = (state.position[k].abs() > thresholds.position) | (state.angle[k].abs() > thresholds.angle);
    }
    if let (Some(rows), Some(all)) = (observations.first_chunk_mut::<{ 4 * BLOCK }>(), terminated.first_chunk_mut()) {
        *all = over;
        for k in 0..BLOCK {
            rows[4 * k] = seen[k] as f32;
            rows[4 * k + 1] = state.velocity[k] as f32;
            rows[4 * k + 2] = state.angle[k] as f32;
            rows[4 * k + 3] = state.spin[k] as f32;
        }
        return;
    }
    for (k, (row, terminated)) in observations.chunks_exact_mut(4).zip(terminated).enumerate() {
        *terminated = over[k];
        row.copy_from_slice(&[seen[k], state.velocity[k], state.angle[k], state.spin[k]].map(|value| value as f32));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_and_long_ways_are_sines() {
        for block in 0..4_000 {
            let angle: Row =
                std::array::from_fn(|k| (block * BLOCK + k) as f64 * 5e-5 * if k % 2 == 0 { 1.0 } else { -1.0 });
            let (sin, cos) = sines(&angle);
            for k in 0..BLOCK {
                assert!((sin[k] - angle[k].sin()).abs() < 5e-16 && (cos[k] - angle[k].cos()).abs() < 5e-16, "{}", angle[k]);
            }
        }
        // What is beside an angle changes no bit of its sine.
        let alone = sines(&[0.1; BLOCK]).0[0];
        assert_eq!(sines(&[0.1, 3.0, -2.0, 0.1, 0.1, 0.1, 0.1, 0.1]).0[0].to_bits(), alone.to_bits());
    }

    #[test]
    fn what_is_over_stays_finite() {
        let values = [1.0, 0.1, 0.5, 9.8, 0.0, 0.0, 10.0];
        let thresholds = Thresholds { position: 2.4, angle: 0.2 };
        let mut lanes = CartPoleLanes::new(3, &values, false, Wires::default(), 0.02, thresholds);
        let (mut observations, mut terminated) = (vec![0.0; 12], vec![false; 3]);
        for k in 0..20_000 {
            lanes.step(&[1, 0, i64::from(k % 2 == 0)], &mut observations, &mut terminated);
        }
        assert!(observations.iter().all(|v| v.is_finite()) && terminated[..2] == [true; 2]);
    }
}
