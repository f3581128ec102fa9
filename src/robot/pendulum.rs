//! `pendulum`: a rod on a hinge, driven by a torque, as Gymnasium has it.

use super::estimate::{begun, initial_rate, motion, rounding, typical};
use super::joint::{Axis, CREEP_RATE, CREEP_SHARE, Posture};
use super::mover::{Motion, Mover, Push, rubbed};
use super::signal::{Commands, Signal};
use super::sine::sine;
use crate::sim2real::{
    Channel, Clock, Covariate, Dynamics, LaneChange, LaneDynamics, Parameter, Plant, Recording, Scene, Thetas, Tick, Typical,
};

/// A uniform rod of mass `m` and length `l` on a hinge, at the angle `q` from *upright*:
///
/// ```text
/// 1/3 m l^2 q'' = 1/2 m g l sin q + gain u - friction q',  |q'| <= top_speed
/// ```
///
/// Integrated by semi-implicit Euler in steps of `step` [s], the speed cut off after each: as Gymnasium's `Pendulum-v1`, whose step
/// of 0.05 s and top speed of 8 rad/s are a part of the task. Damping is by Crank-Nicolson and dry friction implicit, as the
/// joint's. Angles are not wrapped.
///
/// Source: Gymnasium, `envs/classic_control/pendulum.py` (without friction).
#[derive(Debug, Clone, PartialEq)]
pub struct Pendulum {
    parameters: Vec<Parameter>,
    step: f64,
    top_speed: f64,
}

/// The parameters of a pendulum in their order: name and unit.
const PARAMETERS: [(&str, &str); 5] =
    [("mass", "kg"), ("length", "m"), ("gravity", "m/s^2"), ("friction", "N m s/rad"), ("gain", "N m per unit")];

static CHANNELS: &[Channel] = &[Channel::new("angle", "rad"), Channel::new("angular_velocity", "rad/s")];

impl Pendulum {
    /// A pendulum of the given mass [kg], length [m], gravity [m/s^2], viscous friction [N m s/rad] and gain [N m per unit of
    /// command], known to the given relative standard deviations.
    #[must_use]
    pub fn new(values: [f64; 5], uncertainty: [f64; 5], step: f64, top_speed: f64) -> Self {
        let parameters = PARAMETERS
            .iter()
            .zip(values.iter().zip(uncertainty))
            .map(|((name, unit), (value, uncertainty))| {
                let parameter = Parameter::new(name, unit, *value).known_to((uncertainty * value).abs());
                match *name {
                    "mass" | "length" => parameter.within(value * 0.01, f64::INFINITY),
                    "gravity" | "friction" => parameter.within(0.0, f64::INFINITY),
                    _ => parameter,
                }
            })
            .collect();
        Self { parameters, step, top_speed }
    }
}

impl Plant for Pendulum {
    type Command = Signal;
    type Input = ();
    type State = Motion;
    type Effect = Push;
    type Observation = Posture;
    type Dynamics = PendulumDynamics;
    type Stimulus = Commands;

    fn name(&self) -> &'static str {
        "pendulum"
    }

    fn clock(&self) -> Clock {
        Clock::Sampled { longest_step: self.step }
    }

    fn channels(&self) -> &[Channel] {
        CHANNELS
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.parameters.clone()
    }

    fn typical(&self, recordings: &[Recording<Commands>]) -> Typical {
        typical(recordings, "angle", "angular_velocity", self.parameters[4].nominal)
    }

    fn initial_parameters(&self, recording: &Recording<Commands>, row: usize) -> Vec<Parameter> {
        let estimate = begun(recording, "angle", "angular_velocity", row);
        let usual = || self.typical(std::slice::from_ref(recording)).rate;
        vec![
            Parameter::new("initial angle", "rad", estimate.value).known_to(0.3),
            initial_rate("initial angular velocity", "rad/s", &estimate, row, usual),
        ]
    }

    fn covariates(&self, recording: &Recording<Commands>) -> Vec<Covariate> {
        let motion = motion(recording, "angle", "angular_velocity");
        vec![
            ("command", recording.stimulus.0.clone()),
            ("angle", motion.iter().map(|e| e.value).collect()),
            ("angular velocity", motion.iter().map(|e| e.rate).collect()),
        ]
    }

    fn resolution(&self, recording: &Recording<Commands>, channel: &str) -> f64 {
        recording.channel(channel).map_or(0.0, rounding)
    }

    fn unit(&self, declared: &str) -> String {
        Axis::Rotary.unit(declared)
    }

    fn dynamics(&self, thetas: &Thetas) -> PendulumDynamics {
        let values = |lane: usize| -> Vec<f64> { (0..PARAMETERS.len()).map(|k| thetas.row(k)[lane]).collect() };
        let lanes = (0..thetas.lanes()).map(|lane| Lane::of(&values(lane))).collect();
        PendulumDynamics { lanes, top_speed: self.top_speed }
    }
}

/// The running pendulum: its parameters, lane by lane.
#[derive(Debug, Clone)]
pub struct PendulumDynamics {
    lanes: Vec<Lane>,
    top_speed: f64,
}

#[derive(Debug, Clone, Copy)]
struct Lane {
    inertia: f64,
    /// Largest torque of its weight [N m].
    weight: f64,
    friction: f64,
    gain: f64,
}

impl Lane {
    fn of(values: &[f64]) -> Self {
        let [mass, length, gravity, friction, gain] = std::array::from_fn(|k| values[k]);
        Self { inertia: mass * length * length / 3.0, weight: 0.5 * mass * gravity * length, friction, gain }
    }

    fn step(&self, step: f64, state: &Motion, command: f64, push: &Push, top_speed: f64) -> Motion {
        let inertia = self.inertia + push.inertia;
        let Motion { position, velocity } = *state;
        let mut torque = self.weight * sine(position) + self.gain * command + push.effort - push.stiffness * position;
        if push.creeping_friction > 0.0 {
            let stopping = CREEP_SHARE * (inertia * CREEP_RATE * velocity + torque - self.friction * velocity);
            torque -= stopping.max(-push.creeping_friction).min(push.creeping_friction);
        }
        let damping = 0.5 * step * (self.friction + push.damping);
        let whole = inertia + damping;
        let free = velocity + (step * torque - 2.0 * damping * velocity) / whole;
        let held = if push.dry_friction > 0.0 { step * push.dry_friction / whole } else { 0.0 };
        let after = if held > 0.0 { rubbed(velocity, free, held) } else { free };
        let velocity = after.max(-top_speed).min(top_speed);
        Motion { position: position + step * velocity, velocity }
    }
}

impl Mover for Pendulum {
    fn motion(state: &Motion) -> Motion {
        *state
    }

    fn push(effect: &mut Push) -> &mut Push {
        effect
    }

    fn inertia(dynamics: &PendulumDynamics, lane: usize, _: &Motion) -> f64 {
        dynamics.lanes[lane].inertia
    }

    fn drive(scene: &Scene<'_, Self>, lane: usize) -> f64 {
        scene.dynamics.lanes[lane].gain * scene.commands[lane].0
    }

    fn external(scene: &Scene<'_, Self>, lane: usize, position: f64) -> f64 {
        scene.dynamics.lanes[lane].weight * sine(position)
    }

    fn damping(dynamics: &PendulumDynamics, lane: usize, _: &Motion) -> f64 {
        dynamics.lanes[lane].friction
    }
}

impl LaneDynamics<Pendulum> for PendulumDynamics {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.derived(&mut self.lanes, Lane::of);
    }
}

impl Dynamics<Pendulum> for PendulumDynamics {
    fn initial(&self, initial: &Thetas) -> Vec<Motion> {
        let lanes = initial.row(0).iter().zip(initial.row(1));
        lanes.map(|(position, velocity)| Motion { position: *position, velocity: *velocity }).collect()
    }

    fn advance(&self, tick: Tick, states: &mut [Motion], _: &[()], commands: &[Signal], effects: &[Push]) {
        for (((state, command), push), lane) in states.iter_mut().zip(commands).zip(effects).zip(&self.lanes) {
            *state = lane.step(tick.step, state, command.0, push, self.top_speed);
        }
    }

    fn observe(&self, states: &[Motion], observations: &mut [Posture]) {
        for (state, observation) in states.iter().zip(observations) {
            *observation = Posture::of(state);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::PENDULUM_MECHANISMS;
    use crate::sim2real::{Assembly, Measured, Seed, Simulator, check_lanes, check_mechanism, check_plant};

    const VALUES: [f64; 5] = [1.0, 1.0, 10.0, 0.0, 1.0];

    fn plant(step: f64, top_speed: f64) -> Pendulum {
        Pendulum::new(VALUES, [0.2; 5], step, top_speed)
    }

    /// It hangs, on the side where angles are below 0, and swings.
    fn swing(rows: usize, spacing: f64) -> Recording<Commands> {
        let time: Vec<f64> = (0..rows).map(|i| i as f64 * spacing).collect();
        let samples = time.iter().map(|t| Some(0.4 * (3.0 * t).sin() - 3.1)).collect();
        let measured = vec![Measured { channel: "angle".into(), unit: "rad".into(), samples }];
        let commands = time.iter().map(|t| 2.0 * (2.0 * t).sin() + (5.0 * t).cos()).collect();
        Recording { name: "swing".into(), stimulus: Commands(commands), measured, time }
    }

    #[test]
    fn the_plant_and_every_row_of_its_registry_keep_their_contracts() {
        let fine = plant(5e-3, 50.0);
        check_plant(&fine, PENDULUM_MECHANISMS, &swing(400, 5e-3)).unwrap();
        for mechanism in PENDULUM_MECHANISMS {
            check_mechanism(*mechanism, &fine, PENDULUM_MECHANISMS, &swing(800, 5e-3)).unwrap();
            check_lanes(*mechanism, &fine, PENDULUM_MECHANISMS, &swing(300, 5e-3)).unwrap();
        }
    }

    /// Without torque, semi-implicit Euler keeps the energy to first order of the step, for any time: halved, it errs by half.
    #[test]
    fn without_torque_its_energy_stays_where_it_is() {
        let energy = |m: &[f64; 2]| m[1] * m[1] / 6.0 + 5.0 * m[0].cos();
        let worst = |step: f64, rows: usize| {
            let mut recording = swing(rows, step);
            recording.stimulus.0.fill(0.0);
            let theta: Vec<f64> = VALUES.iter().copied().chain([1.0, 0.5]).collect();
            let assembly = Assembly::new(plant(step, f64::INFINITY), PENDULUM_MECHANISMS);
            let out = assembly.rollout(&Thetas::single(&theta), &recording, 0..rows, Seed(0));
            let start = energy(&[1.0, 0.5]);
            let apart = |k: usize| (energy(&[out[0][0].samples[k], out[0][1].samples[k]]) - start).abs();
            (0..rows).map(apart).fold(0.0, f64::max)
        };
        let (coarse, fine) = (worst(2e-3, 10_000), worst(1e-3, 20_000));
        assert!(fine < 0.05 && (1.7..2.3).contains(&(coarse / fine)), "{coarse} and {fine} J");
    }

    #[test]
    fn its_speed_is_cut_off_and_friction_slows_it() {
        let lane = Lane::of(&VALUES);
        let fast = lane.step(0.05, &Motion { position: 1.5, velocity: 7.9 }, 2.0, &Push::default(), 8.0);
        assert_eq!(fast.velocity, 8.0);
        assert!((fast.position - 1.9).abs() < 1e-12);
        let hanging = Motion { position: std::f64::consts::PI, velocity: 1.0 };
        let rubbed = Lane::of(&[1.0, 1.0, 10.0, 0.3, 1.0]).step(0.05, &hanging, 0.0, &Push::default(), 8.0);
        // (I - h c / 2) / (I + h c / 2), with I = 1/3 and h c / 2 = 0.0075.
        assert!((rubbed.velocity - (1.0 / 3.0 - 0.0075) / (1.0 / 3.0 + 0.0075)).abs() < 1e-12);
    }
}
