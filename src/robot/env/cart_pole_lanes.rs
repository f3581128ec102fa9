//! Many cart-poles side by side, in loops over lanes that compilers turn into vector instructions: what most training runs step.
//!
//! Beside the plain task they have parameters of their own, a delay of the command, and noise of the position's sensor, by the laws
//! of `sim2real::mechanism`; whatever else there may be is run by [`Simulated`](super::simulated::Simulated).

#![allow(clippy::needless_range_loop, reason = "one index for many rows is what becomes vector instructions")]

use pulp::{Arch, NullaryFnOnce};

use super::cart_pole::{START, Thresholds};
use super::cart_pole_motion::{Constants, SMALL_TILE, TILE, Tile, advance};
use super::cart_pole_wires::{Delay, Noise, Wires, plain};
use super::row::Row;
use crate::rl::{Episode, Out};
use crate::sim2real::Seed;
use crate::sim2real::normal_draw::AT_ONCE;

/// What lanes begin with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Start {
    /// Least value of each component of the state.
    pub low: f64,
    /// Largest.
    pub high: f64,
}

/// The state of an episode at its start.
#[inline(always)]
pub(super) fn started(episode: Episode, start: Start) -> [f64; 4] {
    let mut draws = episode.stream(START);
    std::array::from_fn(|_| draws.between(start.low, start.high))
}

/// Cart-poles by Euler's method.
#[derive(Debug, Clone)]
pub(super) struct CartPoleLanes {
    /// Cart position [m] and velocity [m/s], pole angle [rad] and angular velocity [rad/s].
    position: Row,
    velocity: Row,
    angle: Row,
    spin: Row,
    /// Steps of each lane's episode.
    steps: Vec<u32>,
    constants: Constants,
    delay: Option<Delay>,
    noise: Option<Noise>,
    wires: Wires,
    step: f64,
    max_steps: u32,
    thresholds: Thresholds,
}

impl CartPoleLanes {
    /// `count` lanes with `values` of all parameters, in steps of `step` [s], of which an episode has `max_steps`. Of the parameters
    /// for which `differs` each lane may have values of its own.
    pub fn new(
        count: usize,
        values: &[f64],
        differs: impl Fn(usize) -> bool,
        wires: Wires,
        (step, max_steps): (f64, u32),
        thresholds: Thresholds,
    ) -> Self {
        let zeros = || Row::new(0.0, count);
        let mut lanes = Self {
            position: zeros(),
            velocity: zeros(),
            angle: zeros(),
            spin: zeros(),
            steps: vec![0; count],
            constants: Constants::new(values, count, differs),
            delay: wires.delay.map(|_| Delay::new(count)),
            noise: wires.noise.map(|_| Noise::new(count)),
            wires,
            step,
            max_steps,
            thresholds,
        };
        (0..count).for_each(|lane| lanes.wire(lane, values));
        lanes
    }

    /// Sets what the mechanisms' parameters say of lane `lane`.
    #[inline]
    fn wire(&mut self, lane: usize, values: &[f64]) {
        if let (Some(place), Some(delay)) = (self.wires.delay, &mut self.delay) {
            delay.set(lane, values[place] / self.step);
        }
        if let (Some(place), Some(noise)) = (self.wires.noise, &mut self.noise) {
            noise.set(lane, values[place]);
        }
    }

    /// Sets all parameters of lane `lane` to `values`, before its episode begins.
    #[inline]
    pub fn retune(&mut self, lane: usize, values: &[f64]) {
        self.constants.set(lane, values);
        self.wire(lane, values);
    }

    /// Begins these episodes in `lanes`, as many, and writes what is observed of them to their rows of `observations`.
    pub fn begin(&mut self, lanes: &[u32], episodes: &[Episode], start: Start, observations: &mut [f32]) {
        Arch::new().dispatch(Begun { own: self, lanes, episodes, start, observations });
    }

    /// Writes component `which` of the state, one a lane.
    pub fn tell(&self, which: usize, values: &mut [f64]) {
        values.copy_from_slice([&self.position, &self.velocity, &self.angle, &self.spin][which]);
    }

    /// Takes a step in all lanes by `actions`, 0 or 1 each, and writes what comes of it but rewards. With the widest vectors the processor
    /// has: the bits are the same with any.
    pub fn step(&mut self, actions: &[i64], out: &mut Out<'_>) {
        Arch::new().dispatch(Stepped { lanes: self, actions, out: out.again() });
    }

    /// Number of lanes.
    pub fn count(&self) -> usize {
        self.steps.len()
    }

    /// Makes lane `to` a copy of lane `from` of `other`, or of its own where there is none.
    pub fn copy(&mut self, other: Option<&Self>, from: usize, to: usize) {
        let source = other.unwrap_or(self);
        let state = [source.position[from], source.velocity[from], source.angle[from], source.spin[from]];
        self.steps[to] = source.steps[from];
        [self.position[to], self.velocity[to], self.angle[to], self.spin[to]] = state;
        self.constants.copy(other.map(|other| &other.constants), from, to);
        if let Some(own) = &mut self.delay {
            own.copy(other.and_then(|other| other.delay.as_ref()), from, to);
        }
        if let Some(own) = &mut self.noise {
            own.copy(other.and_then(|other| other.noise.as_ref()), from, to);
        }
    }

    /// A step of the `N` lanes from lane `first` on: as many at any time, so that compilers know how far their loops go.
    #[inline(always)]
    fn step_tile<const N: usize>(&mut self, first: usize, actions: &[i64; N], out: &mut Out<'_>) {
        let own = first..first + N;
        let steps = &mut self.steps[own.clone()];
        let mut commands = Tile([0.0; N]);
        match &mut self.delay {
            None => plain(actions, &mut commands.0),
            Some(delay) => delay.pass(first, actions, steps, &mut commands.0),
        }
        steps.iter_mut().for_each(|steps| *steps = steps.saturating_add(1));
        late(steps, self.max_steps, &mut out.truncated[own.clone()]);
        let (position, velocity) = (&mut self.position[own.clone()], &mut self.velocity[own.clone()]);
        let (angle, spin) = (&mut self.angle[own.clone()], &mut self.spin[own.clone()]);
        advance(position, velocity, angle, spin, &commands.0, &self.constants, first, self.step);
        over(position, angle, self.thresholds, &mut out.terminated[own.clone()]);
        let (rows, _) = out.observations[4 * first..4 * own.end].as_chunks_mut();
        match &mut self.noise {
            None => write(position, velocity, angle, spin, rows),
            Some(noise) => {
                let mut seen = [0.0; N];
                noise.add(first, position, &mut seen);
                write(&seen, velocity, angle, spin, rows);
            }
        }
    }
}

/// A step of all lanes, with what it reads and writes.
struct Stepped<'a> {
    lanes: &'a mut CartPoleLanes,
    actions: &'a [i64],
    out: Out<'a>,
}

impl NullaryFnOnce for Stepped<'_> {
    type Output = ();

    // What is not inlined here is compiled without the processor's vectors.
    #[inline(always)]
    fn call(self) {
        let Self { lanes, actions, mut out } = self;
        let (tiles, left) = actions.as_chunks::<TILE>();
        let (small, single) = left.as_chunks::<SMALL_TILE>();
        let mut first = 0;
        for actions in tiles {
            lanes.step_tile(first, actions, &mut out);
            first += TILE;
        }
        for actions in small {
            lanes.step_tile(first, actions, &mut out);
            first += SMALL_TILE;
        }
        for action in single {
            lanes.step_tile(first, &[*action], &mut out);
            first += 1;
        }
    }
}

#[inline(always)]
fn late(steps: &[u32], max: u32, truncated: &mut [bool]) {
    truncated.iter_mut().zip(steps).for_each(|(truncated, steps)| *truncated = *steps >= max);
}

#[inline(always)]
fn over(position: &[f64], angle: &[f64], thresholds: Thresholds, terminated: &mut [bool]) {
    let count = terminated.len();
    let (position, angle) = (&position[..count], &angle[..count]);
    for k in 0..count {
        terminated[k] = (position[k].abs() > thresholds.position) | (angle[k].abs() > thresholds.angle);
    }
}

#[inline(always)]
fn write(seen: &[f64], velocity: &[f64], angle: &[f64], spin: &[f64], rows: &mut [[f32; 4]]) {
    let count = rows.len();
    let (seen, velocity, angle, spin) = (&seen[..count], &velocity[..count], &angle[..count], &spin[..count]);
    for k in 0..count {
        rows[k] = [seen[k] as f32, velocity[k] as f32, angle[k] as f32, spin[k] as f32];
    }
}

/// Episodes that begin, with what is read and written.
struct Begun<'a> {
    own: &'a mut CartPoleLanes,
    lanes: &'a [u32],
    episodes: &'a [Episode],
    start: Start,
    observations: &'a mut [f32],
}

impl NullaryFnOnce for Begun<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { own, lanes, episodes, start, observations } = self;
        let (rows, _) = observations.as_chunks_mut::<4>();
        for (lanes, some) in lanes.chunks(AT_ONCE).zip(episodes.chunks(AT_ONCE)) {
            // All places are drawn for, so that this is a loop without a branch; those that are no lane's are left.
            let mut episodes = [Episode::default(); AT_ONCE];
            episodes[..some.len()].copy_from_slice(some);
            let (mut states, mut seeds) = ([[0.0; AT_ONCE]; 4], [Seed(0); AT_ONCE]);
            for k in 0..AT_ONCE {
                let state = started(episodes[k], start);
                for (row, value) in states.iter_mut().zip(state) {
                    row[k] = value;
                }
                seeds[k] = episodes[k].seed();
            }
            let [position, velocity, angle, spin] = states;
            let mut seen = position;
            if let Some(noise) = &mut own.noise {
                noise.begin(lanes, &seeds, &mut seen);
            }
            for (k, lane) in lanes.iter().enumerate() {
                let lane = *lane as usize;
                own.position[lane] = position[k];
                own.velocity[lane] = velocity[k];
                own.angle[lane] = angle[k];
                own.spin[lane] = spin[k];
                own.steps[lane] = 0;
                rows[lane] = [seen[k], velocity[k], angle[k], spin[k]].map(|value| value as f32);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rl::Buffers;

    /// In tiles, in small ones, and by itself: 64, 8 and 1 lanes at a time.
    #[test]
    fn a_lane_has_the_same_bits_however_many_are_stepped_with_it() {
        let values = [1.0, 0.1, 0.5, 9.8, 0.1, 0.01, 10.0, 0.03, 0.01];
        let wires = Wires { delay: Some(7), noise: Some(8) };
        let thresholds = Thresholds { position: 2.4, angle: 0.2 };
        let start = Start { low: -0.3, high: 0.3 };
        let run = |seeds: &[u64]| {
            let count = seeds.len();
            let mut lanes = CartPoleLanes::new(count, &values, |k| k == 3, wires, (0.02, 500), thresholds);
            let mut buffers = Buffers::new(count, 4);
            let all: Vec<u32> = (0..count as u32).collect();
            let episodes: Vec<Episode> = seeds.iter().map(|seed| Episode { seed: *seed, number: 2 }).collect();
            let tuned =
                |seed: u64| [1.0, 0.1, 0.5, 9.0 + seed as f64 * 0.01, 0.1, 0.01, 10.0, 0.01 * (seed % 9) as f64, 0.01];
            seeds.iter().enumerate().for_each(|(lane, seed)| lanes.retune(lane, &tuned(*seed)));
            lanes.begin(&all, &episodes, start, &mut buffers.observations);
            let mut seen: Vec<Vec<[u32; 4]>> = vec![Vec::new(); count];
            for step in 0..60 {
                let actions: Vec<i64> = seeds.iter().map(|seed| ((seed + step) / 3 % 2) as i64).collect();
                for (seen, row) in seen.iter_mut().zip(buffers.observations.as_chunks::<4>().0) {
                    seen.push(row.map(f32::to_bits));
                }
                lanes.step(&actions, &mut buffers.out());
            }
            seen
        };
        let seeds: Vec<u64> = (0..85).collect();
        let together = run(&seeds);
        for (seed, together) in seeds.iter().zip(together) {
            assert_eq!(run(&[*seed])[0], together, "seed {seed}");
        }
    }

    #[test]
    fn what_is_over_stays_finite() {
        let values = [1.0, 0.1, 0.5, 9.8, 0.0, 0.0, 10.0];
        let thresholds = Thresholds { position: 2.4, angle: 0.2 };
        let mut lanes = CartPoleLanes::new(3, &values, |_| false, Wires::default(), (0.02, 500), thresholds);
        let mut buffers = Buffers::new(3, 4);
        for k in 0..20_000 {
            lanes.step(&[1, 0, i64::from(k % 2 == 0)], &mut buffers.out());
        }
        assert!(buffers.observations.iter().all(|v| v.is_finite()));
        assert!(buffers.terminated[..2] == [true; 2] && buffers.truncated == [true; 3]);
    }
}
