//! The motion of an arm, by fourth-order Runge-Kutta between the instants at which commands reach its driver.

use rand_distr::{Distribution, StandardNormal};

use super::arm::Arm;
use super::driver::{self, Driver};
use super::effect::Effect;
use super::load::{self, Instant, Load};
use crate::sim2real::Seed;

/// What changes faster than this [1/s] has run away: a run in steps that follow it would not come to an end.
const FASTEST: f64 = 1e7;

/// Commands of a recording, and where the arm is when it begins.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    /// One a row.
    pub commands: Vec<f64>,
    /// Time between rows [s].
    pub sample: f64,
    /// Position at rest before the first row.
    pub start: f64,
    /// Velocity at the first row: 0 but where sensitivities are asked for.
    pub speed: f64,
}

impl Drive {
    /// Time of a row [s], rounded to the nanosecond so that files show 0.012 and not 0.012000000000000002.
    pub fn time(&self, row: usize) -> f64 {
        (row as f64 * self.sample * 1e9).round() / 1e9
    }
}

/// How finely to integrate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Precision {
    /// Steps of 0.1 ms at most: what is recorded.
    Fine,
    /// Steps of 1 ms at most, finer where anything is stiff: while a strength is looked for.
    Coarse,
    /// Semi-implicit Euler at this step [s], as simulators of rigid bodies have it: a flaw to be told from physics.
    Euler(f64),
}

impl Precision {
    fn step(self) -> f64 {
        match self {
            Self::Fine => 1e-4,
            Self::Coarse => 1e-3,
            Self::Euler(step) => step,
        }
    }
}

/// Positions at even times.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    step: f64,
    /// One a step, from time 0 on.
    pub positions: Vec<f64>,
    before: f64,
}

impl Motion {
    /// The position at a time [s]; before the first, where the arm rested.
    pub fn at(&self, time: f64) -> f64 {
        let place = time / self.step;
        if place <= 0.0 {
            return self.before;
        }
        let row = (place as usize).min(self.positions.len().saturating_sub(2));
        let part = (place - row as f64).min(1.0);
        self.positions[row] + part * (self.positions[row + 1] - self.positions[row])
    }

    /// The largest distance from where it began.
    pub fn reach(&self) -> f64 {
        self.positions
            .iter()
            .fold(0.0, |most: f64, q| if q.is_finite() { most.max((q - self.before).abs()) } else { f64::INFINITY })
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct State {
    position: f64,
    velocity: f64,
    motor_position: f64,
    motor_velocity: f64,
    driver: driver::Memory,
    load: load::Memory,
}

/// An arm with what acts on it.
#[derive(Debug, Clone)]
pub(super) struct Machine {
    arm: Arm,
    driver: Driver,
    load: Load,
    /// Whether nothing acts on its motion: most runs are of arms alone, and many.
    bare: bool,
    /// Whether anything beside the arm has a state of its own.
    remembers: bool,
}

impl Machine {
    pub fn new(arm: Arm, effects: &[Effect]) -> Self {
        let acts = |effect: &Effect| !effect.is_of_sensor();
        let (driver, load) = (Driver::of(effects), Load::of(effects));
        let remembers = driver.remembers() || load.remembers();
        Self { arm, driver, load, bare: !effects.iter().any(acts), remembers }
    }

    pub fn driver(&self) -> &Driver {
        &self.driver
    }

    pub fn load(&self) -> &Load {
        &self.load
    }

    /// Where the arm is while `drive` lasts; `seed` is for the bus alone.
    pub fn run(&self, drive: &Drive, precision: Precision, seed: Seed) -> Motion {
        let step = precision.step().min(drive.sample);
        let arrivals = self.arrivals(drive, seed);
        let mut arriving = arrivals.iter().zip(&drive.commands).peekable();
        let mut state = State {
            position: drive.start,
            velocity: drive.speed,
            motor_position: drive.start,
            motor_velocity: drive.speed,
            ..State::default()
        };
        let end = drive.sample * drive.commands.len() as f64;
        let steps = (end / step).round() as usize;
        let mut command = 0.0;
        let mut positions = Vec::with_capacity(steps + 1);
        for k in 0..=steps {
            positions.push(state.position);
            let (mut now, until) = (k as f64 * step, (k + 1) as f64 * step);
            while let Some((at, next)) = arriving.next_if(|(at, _)| **at < until - 1e-9) {
                state = self.integrate(state, command, now, (at - now).max(0.0), precision);
                (now, command) = (at.max(now), *next);
            }
            state = self.integrate(state, command, now, until - now, precision);
            if state.position.is_nan() || state.position.abs() > 1e6 {
                positions.resize(steps + 1, f64::NAN);
                break;
            }
        }
        Motion { step, positions, before: drive.start }
    }

    /// When each command reaches the driver [s], in order.
    fn arrivals(&self, drive: &Drive, seed: Seed) -> Vec<f64> {
        let (delay, jitter) = self.driver.bus;
        let mut rng = seed.stream("bus");
        let mut last = 0.0_f64;
        (0..drive.commands.len())
            .map(|row| {
                let wobble: f64 = StandardNormal.sample(&mut rng);
                last = last.max(drive.time(row) + (delay + jitter * wobble.clamp(-3.0, 3.0)).max(0.0));
                last
            })
            .collect()
    }

    /// Integrates over `duration` [s] under one command, in steps that what is stiff can bear. What runs away is nowhere.
    fn integrate(&self, mut state: State, command: f64, mut time: f64, duration: f64, precision: Precision) -> State {
        if duration <= 0.0 {
            return state;
        }
        if let Precision::Euler(_) = precision {
            return self.euler(state, command, time, duration);
        }
        if self.bare {
            return self.swing(state, command, duration);
        }
        let mut left = duration;
        let driver = self.driver.fastest();
        let patience = if precision == Precision::Fine { 0.7 } else { 1.6 };
        while left > 1e-12 {
            let rubbing = if self.load.coupling.is_some() { state.motor_velocity } else { state.velocity };
            let load = || self.load.fastest(self.arm.inertia, state.position, state.velocity, rubbing);
            let fastest = driver.max(load());
            if fastest > FASTEST {
                return State { position: f64::NAN, ..state };
            }
            let step = left.min(precision.step()).min(if fastest > 0.0 { patience / fastest } else { f64::INFINITY });
            let step = if left - step < 0.1 * step { left } else { step };
            state = self.runge_kutta(state, command, time, step);
            time += step;
            left -= step;
        }
        state
    }

    fn runge_kutta(&self, state: State, command: f64, time: f64, step: f64) -> State {
        let k1 = self.rates(&state, command, time);
        let k2 = self.rates(&self.moved(state, 0.5 * step, &k1), command, time + 0.5 * step);
        let k3 = self.rates(&self.moved(state, 0.5 * step, &k2), command, time + 0.5 * step);
        let k4 = self.rates(&self.moved(state, step, &k3), command, time + step);
        let parts = [(step / 6.0, &k1), (step / 3.0, &k2), (step / 3.0, &k3), (step / 6.0, &k4)];
        parts.into_iter().fold(state, |state, (step, rate)| self.moved(state, step, rate))
    }

    /// `state + step * rate`.
    fn moved(&self, mut state: State, step: f64, rate: &State) -> State {
        state.position += step * rate.position;
        state.velocity += step * rate.velocity;
        state.motor_position += step * rate.motor_position;
        state.motor_velocity += step * rate.motor_velocity;
        if self.remembers {
            state.driver.iter_mut().zip(&rate.driver).for_each(|(value, rate)| *value += step * rate);
            state.load.iter_mut().zip(&rate.load).for_each(|(value, rate)| *value += step * rate);
        }
        state
    }

    /// One step of an arm alone, as [`runge_kutta`](Self::runge_kutta) takes it.
    fn swing(&self, state: State, command: f64, step: f64) -> State {
        let Arm { inertia, viscous_friction, gravity_torque, gain, .. } = self.arm;
        let (push, friction, gravity) = (gain * command / inertia, viscous_friction / inertia, gravity_torque / inertia);
        let rate = |q: f64, v: f64| {
            let weight = if gravity == 0.0 { 0.0 } else { gravity * q.sin() };
            push - friction * v - weight
        };
        let (q, v, half) = (state.position, state.velocity, 0.5 * step);
        let a1 = rate(q, v);
        let (v2, a2) = (v + half * a1, rate(q + half * v, v + half * a1));
        let (v3, a3) = (v + half * a2, rate(q + half * v2, v + half * a2));
        let (v4, a4) = (v + step * a3, rate(q + step * v3, v + step * a3));
        let position = q + step / 6.0 * (v + 2.0 * (v2 + v3) + v4);
        let velocity = v + step / 6.0 * (a1 + 2.0 * (a2 + a3) + a4);
        State { position, velocity, ..state }
    }

    fn euler(&self, state: State, command: f64, time: f64, step: f64) -> State {
        let rates = self.rates(&state, command, time);
        let velocity = state.velocity + step * rates.velocity;
        let position = state.position + step * velocity;
        State { position, velocity, motor_position: position, motor_velocity: velocity, ..self.moved(state, step, &rates) }
    }

    /// Time derivatives of the state.
    fn rates(&self, state: &State, command: f64, time: f64) -> State {
        let (output, driver) = self.driver.act(&state.driver, command, time);
        let (more_inertia, more_gravity) = self.load.mass(time);
        let gravity = (self.arm.gravity_torque + more_gravity) * self.load.gravity_factor(time);
        let weight = if gravity == 0.0 { 0.0 } else { gravity * state.position.sin() };
        let motor = self.arm.gain * output;
        let coupled = self.load.coupling.as_ref();
        let rubbing = if coupled.is_some() { state.motor_velocity } else { state.velocity };
        let now = Instant { position: state.position, velocity: state.velocity, rubbing, motor, weight, time };
        let (against, load) = self.load.act(&now, &state.load);
        let at_motor = motor - self.arm.viscous_friction * rubbing - against.friction;
        let at_link = -weight - against.link;
        let (velocity, motor_velocity) = match coupled {
            Some(coupling) => {
                let own = self.arm.inertia * coupling.motor_share;
                let twist = state.motor_position - state.position;
                let passed = coupling.torque(twist, state.motor_velocity - state.velocity);
                let link = self.arm.inertia - own + more_inertia;
                ((at_link + passed) / link, (at_motor - passed) / own)
            }
            None => {
                let (factor, slope) = self.load.inertia_factor(state.position);
                let bent = 0.5 * self.arm.inertia * slope * state.velocity * state.velocity;
                let rate = (at_motor + at_link - bent) / (self.arm.inertia * factor + more_inertia);
                (rate, rate)
            }
        };
        State { position: state.velocity, velocity, motor_position: rubbing, motor_velocity, driver, load }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conceal::benchmark::recipe::{FOREIGN, KNOWN, Recipe};
    use crate::conceal::benchmark::scene::Scales;

    /// A state that nobody integrates stays as it was, and its effect is none.
    #[test]
    fn whatever_has_a_state_is_integrated() {
        let arm = Arm { linear: false, inertia: 0.1, viscous_friction: 0.2, gravity_torque: 2.5, gain: 1.0 };
        let commands = (0..2_500).map(|i| (f64::from(i) * 0.011).sin()).collect();
        let scales = Scales::of(arm, &Drive { commands, sample: 0.004, start: 0.0, speed: 0.0 });
        let state = State { position: 0.3, velocity: 1.1, driver: [0.1; 5], load: [0.02; 5], ..State::default() };
        let moves = |id: &'static str| {
            let recipe = Recipe::draw(id, &mut Seed(3).stream(id));
            let machine = Machine::new(arm, &[recipe.at((recipe.range.0 * recipe.range.1).sqrt(), &scales)]);
            let rate = machine.rates(&state, 0.7, 1.0);
            let moves = rate.driver.iter().chain(&rate.load).any(|rate| *rate != 0.0);
            assert!(!moves || machine.remembers, "{id}");
            moves
        };
        let moving = KNOWN.into_iter().chain(FOREIGN).filter(|id| moves(id)).count();
        assert!(moving >= 6, "{moving}: friction, hysteresis, a lag, a slewing driver, heat, a relaxing spring");
    }

    #[test]
    fn what_runs_away_is_nowhere_and_comes_to_an_end() {
        let arm = Arm { linear: false, inertia: 0.1, viscous_friction: 0.2, gravity_torque: 2.5, gain: 1.0 };
        let drive = Drive { commands: vec![1.0; 50], sample: 0.004, start: 0.0, speed: 0.0 };
        let ends = |bend: f64| {
            let friction = Effect::Bristles { sliding: 0.5, breakaway: 0.5, fading: 0.1, load: 0.0, bend };
            Machine::new(arm, &[friction]).run(&drive, Precision::Coarse, Seed(0)).at(0.19)
        };
        assert!(ends(1e-3).abs() < 10.0);
        assert!(ends(1e-18).is_nan());
    }
}
