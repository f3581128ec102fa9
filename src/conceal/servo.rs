//! A position servo arm with effects concealed in it: a pendulum on a motor, integrated by fourth-order Runge-Kutta at
//! 0.1 ms or finer between the instants at which commands reach the driver.

mod effect;
mod excitation;

use rand_distr::{Distribution, Normal, StandardNormal};

use crate::sim2real::Seed;

use super::{Column, Table};
pub use effect::ServoEffect;
use effect::{Bristles, Distortion};
pub use excitation::Excitation;

/// An arm as it really is.
#[derive(Debug, Clone, PartialEq)]
pub struct Servo {
    /// Inertia seen by the motor [kg m^2].
    pub inertia: f64,
    /// Viscous friction [N m s/rad].
    pub viscous_friction: f64,
    /// Torque of gravity at a right angle, m g l [N m].
    pub gravity_torque: f64,
    /// Torque of the driver [N m per unit of command].
    pub gain: f64,
    /// What a twin with the four numbers above would leave out.
    pub effects: Vec<ServoEffect>,
    /// Standard deviation of the white noise on position [rad].
    pub noise: f64,
    /// Step of the position sensor [rad]; 0 for none.
    pub resolution: f64,
    /// Time between samples [s].
    pub sample: f64,
    /// Number of samples.
    pub rows: usize,
}

impl Default for Servo {
    /// The arm of the `servo` set, without effects: 5 to 15 % off the twin that comes with it.
    fn default() -> Self {
        Self {
            inertia: 0.119,
            viscous_friction: 0.218,
            gravity_torque: 2.52,
            gain: 1.0,
            effects: Vec::new(),
            noise: 0.003,
            resolution: 0.0005,
            sample: 0.004,
            rows: 6_000,
        }
    }
}

/// What the integrator carries from step to step.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    position: f64,
    velocity: f64,
    /// Mean deflection of the bristles [rad].
    bristle: f64,
    /// The two poles of the driver [units of command].
    driver: [f64; 2],
}

impl State {
    /// `self + step * rate`.
    fn moved(self, step: f64, rate: Self) -> Self {
        Self {
            position: self.position + step * rate.position,
            velocity: self.velocity + step * rate.velocity,
            bristle: self.bristle + step * rate.bristle,
            driver: [self.driver[0] + step * rate.driver[0], self.driver[1] + step * rate.driver[1]],
        }
    }
}

/// Longest step of the integrator [s].
const STEP: f64 = 1e-4;

impl Servo {
    /// The same arm with these effects in it.
    #[must_use]
    pub fn with(self, effects: impl Into<Vec<ServoEffect>>) -> Self {
        Self { effects: effects.into(), ..self }
    }

    /// Records the arm from rest under an excitation: columns `t` [s], `u` [unit of command], `q` [rad].
    ///
    /// The command of a row is sent at its `t`, the position of a row is measured at its `t`, before that command acts.
    #[must_use]
    pub fn record(&self, excitation: Excitation, seed: Seed) -> Table {
        let commands = excitation.commands(self.rows, self.sample, seed);
        let positions = self.motion(&commands, seed);
        let times = (0..self.rows).map(|row| self.time(row)).collect();
        let measured = self.measure(&positions, seed);
        Table::default().with("t", Column::Real(times)).with("u", Column::Real(commands)).with("q", Column::Real(measured))
    }

    /// Time of a row [s], rounded to the nanosecond so that files show 0.012 and not 0.012000000000000002.
    fn time(&self, row: usize) -> f64 {
        (row as f64 * self.sample * 1e9).round() / 1e9
    }

    /// True positions at the rows [rad].
    fn motion(&self, commands: &[f64], seed: Seed) -> Vec<f64> {
        let distortion = Distortion::of(&self.effects);
        let arrivals = self.arrivals(commands, &distortion, seed);
        let mut arriving = arrivals.iter().copied().peekable();
        let (mut state, mut command) = (State::default(), 0.0);
        let mut positions = Vec::with_capacity(self.rows);
        for row in 0..self.rows {
            positions.push(state.position);
            let (mut now, end) = (self.time(row), self.time(row + 1));
            while let Some((at, value)) = arriving.next_if(|(at, _)| *at < end) {
                state = self.integrate(state, command, at - now, &distortion);
                (now, command) = (at, value);
            }
            state = self.integrate(state, command, end - now, &distortion);
        }
        positions
    }

    /// When each command reaches the driver [s], in order.
    fn arrivals(&self, commands: &[f64], distortion: &Distortion, seed: Seed) -> Vec<(f64, f64)> {
        let mut rng = seed.stream("servo bus");
        let mut last = 0.0_f64;
        commands
            .iter()
            .enumerate()
            .map(|(row, command)| {
                let wobble: f64 = StandardNormal.sample(&mut rng);
                let lateness = distortion.delay + distortion.delay_jitter * wobble.clamp(-3.0, 3.0);
                last = last.max(self.time(row) + lateness.max(0.0));
                (last, *command)
            })
            .collect()
    }

    /// Integrates over `duration` [s] under one command. The bristles get stiffer the faster the arm moves, so the step
    /// follows the velocity.
    fn integrate(&self, mut state: State, command: f64, duration: f64, distortion: &Distortion) -> State {
        let mut left = duration;
        while left > 1e-12 {
            let stiffest = distortion.bristles.map_or(0.0, |bristles| bristles.rate(state.velocity.abs() + 0.5));
            let step = left.min(STEP).min(if stiffest > 0.0 { 1.5 / stiffest } else { STEP });
            state = self.runge_kutta(state, command, step, distortion);
            left -= step;
        }
        state
    }

    /// One classical fourth-order step.
    fn runge_kutta(&self, state: State, command: f64, step: f64, distortion: &Distortion) -> State {
        let k1 = self.rates(state, command, distortion);
        let k2 = self.rates(state.moved(step / 2.0, k1), command, distortion);
        let k3 = self.rates(state.moved(step / 2.0, k2), command, distortion);
        let k4 = self.rates(state.moved(step, k3), command, distortion);
        state.moved(step / 6.0, k1).moved(step / 3.0, k2).moved(step / 3.0, k3).moved(step / 6.0, k4)
    }

    /// Time derivatives of the state.
    fn rates(&self, state: State, command: f64, distortion: &Distortion) -> State {
        let driven = distortion.driven(command);
        let (driver, output) = match distortion.driver_pole {
            Some(pole) => {
                let [first, second] = state.driver;
                ([(driven - first) * pole, (first - second) * pole], second)
            }
            None => ([0.0; 2], driven),
        };
        let (bristle, friction) = distortion.bristles.map_or((0.0, 0.0), |b| b.act(state.bristle, state.velocity));
        let torque = self.gain * output
            - self.viscous_friction * state.velocity
            - self.gravity_torque * state.position.sin()
            - friction
            - distortion.load(state.position, state.velocity);
        State { position: state.velocity, velocity: torque / self.inertia, bristle, driver }
    }

    /// What the sensor reports [rad].
    fn measure(&self, positions: &[f64], seed: Seed) -> Vec<f64> {
        let distortion = Distortion::of(&self.effects);
        let mut rng = seed.stream("servo sensor");
        let noise = Normal::new(0.0, self.noise.max(0.0)).ok();
        positions
            .iter()
            .enumerate()
            .map(|(row, position)| {
                let error = noise.map_or(0.0, |noise| noise.sample(&mut rng));
                let read = position + distortion.offset(self.time(row)) + error;
                // Files show microradians; a sensor without steps is rounded to them as well.
                let step = if self.resolution > 0.0 { self.resolution } else { 1e-6 };
                ((read / step).round() * step * 1e6).round() / 1e6
            })
            .collect()
    }
}

impl Bristles {
    /// Rate of the bristle's deflection [rad/s] and torque of friction [N m].
    fn act(&self, deflection: f64, velocity: f64) -> (f64, f64) {
        let rate = velocity - self.rate(velocity.abs()) * deflection;
        // Damping that fades with velocity keeps the model passive (Olsson 1996, section 3.4).
        let damping = self.damping * (-(velocity / self.stribeck_velocity).powi(2)).exp();
        (rate, self.stiffness * deflection + damping * rate)
    }

    /// How fast the bristles relax at a speed [1/s].
    fn rate(&self, speed: f64) -> f64 {
        let level = self.coulomb + (self.breakaway - self.coulomb) * (-(speed / self.stribeck_velocity).powi(2)).exp();
        self.stiffness * speed / level
    }
}

#[cfg(test)]
mod tests;
