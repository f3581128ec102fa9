//! `joint`: one servo joint, or a linear axis.

use super::estimate::{begun, initial_rate, motion, rounding, typical};
use super::mover::{Motion, Mover, Push, rubbed};
use super::signal::{Commands, Signal};
use super::sine::{BLOCK, sine, sines};
use crate::sim2real::{
    Channel, Clock, Covariate, Dynamics, LaneChange, LaneDynamics, Observation, Parameter, Plant, Recording, Scene, Thetas,
    Tick, Typical,
};

/// `inertia a + viscous_friction v + gravity_torque sin(q) = gain u`.
///
/// A linear axis is the same with `gravity_torque = 0` and a mass for the inertia; its units are then kg, N s/m, N and
/// N per unit of command, its positions m.
///
/// Integrated by drift-kick-drift with the damping by Crank-Nicolson and dry friction implicit, so that a joint that is
/// stuck stays where it is, to the bit (Stewart, "Rigid-body dynamics with friction and impact", SIAM Review 42 (2000)).
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    axis: Axis,
    parameters: Vec<Parameter>,
}

/// The parameters of a joint in their order: name, unit of a rotary and of a linear axis.
const PARAMETERS: [(&str, [&str; 2]); 4] = [
    ("inertia", ["kg m^2", "kg"]),
    ("viscous_friction", ["N m s/rad", "N s/m"]),
    ("gravity_torque", ["N m", "N"]),
    ("gain", ["N m per unit", "N per unit"]),
];

/// The other units that mechanisms of a joint declare, each with what it is on a linear axis.
const LINEAR: [(&str, &str); 11] = [
    ("N m", "N"),
    ("N m/rad", "N/m"),
    ("N m/rad^1.5", "N/m^1.5"),
    ("N m/rad^3", "N/m^3"),
    ("N m s^2/rad^2", "N s^2/m^2"),
    ("rad", "m"),
    ("rad/s", "m/s"),
    ("rad/(N m)", "m/N"),
    ("s/rad", "s/m"),
    ("1/rad", "1/m"),
    ("1/rad^2", "1/m^2"),
];

/// How a joint moves: its units follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// It turns: positions in rad, efforts in N m.
    Rotary,
    /// It slides: positions in m, efforts in N.
    Linear,
}

impl Axis {
    /// The unit that a mechanism of motion declares as `declared`, for a rotary axis, on this one.
    #[must_use]
    pub fn unit(self, declared: &str) -> String {
        let declared = match declared {
            "output" => "rad",
            "output/s" => "rad/s",
            "1/output^2" => "1/rad^2",
            "command" => return "unit of the command".to_owned(),
            "command/s" => return "units of the command/s".to_owned(),
            other => other,
        };
        let linear = LINEAR.iter().find(|(rotary, _)| self == Self::Linear && *rotary == declared);
        linear.map_or(declared, |(_, linear)| linear).to_owned()
    }
}

static ROTARY_CHANNELS: &[Channel] = &[Channel::new("position", "rad"), Channel::new("velocity", "rad/s")];
static LINEAR_CHANNELS: &[Channel] = &[Channel::new("position", "m"), Channel::new("velocity", "m/s")];

/// Longest step of integration [s]: at 1 ms smooth motions are right to some microradians.
const LONGEST_STEP: f64 = 1e-3;

/// How contacts of rigid-body engines creep while they hold: friction is `clip(share (inertia rate v + effort), limit)`,
/// with the impedance and the rate [1/s] of MuJoCo's default `solimp` and `solref` (Todorov, "Convex and analytically
/// invertible dynamics with contacts and constraints", ICRA 2014; MuJoCo documentation, "Computation").
pub(super) const CREEP_SHARE: f64 = 0.9;
pub(super) const CREEP_RATE: f64 = 105.0;

/// What is seen of a joint: position [rad], velocity [rad/s].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Posture([f64; 2]);

impl Posture {
    /// That of a motion.
    pub(super) const fn of(motion: &Motion) -> Self {
        Self([motion.position, motion.velocity])
    }
}

impl AsMut<[f64]> for Posture {
    fn as_mut(&mut self) -> &mut [f64] {
        &mut self.0
    }
}

impl Observation for Posture {
    fn channel(&self, k: usize) -> f64 {
        self.0[k]
    }
}

impl Joint {
    /// A joint with the given inertia [kg m^2], viscous friction [N m s/rad], gravity torque [N m] and gain [N m per unit
    /// of command], known to the given relative standard deviations; a linear axis with the units of one.
    #[must_use]
    pub fn new(axis: Axis, values: [f64; 4], uncertainty: [f64; 4]) -> Self {
        let parameters = PARAMETERS
            .iter()
            .zip(values.iter().zip(uncertainty))
            .map(|((name, units), (value, uncertainty))| {
                let parameter = Parameter::new(name, units[axis as usize], *value).known_to((uncertainty * value).abs());
                match *name {
                    // A massless joint has no motion; the other coefficients may vanish but not change their sign.
                    "inertia" => parameter.within(value * 0.01, f64::INFINITY),
                    "viscous_friction" => parameter.within(0.0, f64::INFINITY),
                    _ => parameter,
                }
            })
            .collect();
        Self { axis, parameters }
    }

    /// The names and units of its parameters, in the order of [`Joint::new`].
    #[must_use]
    pub fn parameter_names(axis: Axis) -> [(&'static str, &'static str); 4] {
        PARAMETERS.map(|(name, units)| (name, units[axis as usize]))
    }
}

impl Plant for Joint {
    type Command = Signal;
    type Input = ();
    type State = Motion;
    type Effect = Push;
    type Observation = Posture;
    type Dynamics = JointDynamics;
    type Stimulus = Commands;

    fn name(&self) -> &'static str {
        "joint"
    }

    fn clock(&self) -> Clock {
        Clock::Sampled { longest_step: LONGEST_STEP }
    }

    fn channels(&self) -> &[Channel] {
        match self.axis {
            Axis::Rotary => ROTARY_CHANNELS,
            Axis::Linear => LINEAR_CHANNELS,
        }
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.parameters.clone()
    }

    fn typical(&self, recordings: &[Recording<Commands>]) -> Typical {
        typical(recordings, "position", "velocity", self.parameters[3].nominal)
    }

    /// Position and velocity as a parabola through the rows around `row` has them. The position's prior is wide, so that
    /// an offset of the sensor shows in the motion that follows rather than be taken for where the joint was.
    fn initial_parameters(&self, recording: &Recording<Commands>, row: usize) -> Vec<Parameter> {
        let estimate = begun(recording, "position", "velocity", row);
        let typical = self.typical(std::slice::from_ref(recording));
        vec![
            Parameter::new("initial position", "rad", estimate.value).known_to(0.3 * typical.output.max(1e-9)),
            initial_rate("initial velocity", "rad/s", &estimate, row, || typical.rate),
        ]
    }

    fn covariates(&self, recording: &Recording<Commands>) -> Vec<Covariate> {
        let motion = motion(recording, "position", "velocity");
        vec![
            ("command", recording.stimulus.0.clone()),
            ("position", motion.iter().map(|e| e.value).collect()),
            ("velocity", motion.iter().map(|e| e.rate).collect()),
        ]
    }

    fn resolution(&self, recording: &Recording<Commands>, channel: &str) -> f64 {
        recording.channel(channel).map_or(0.0, rounding)
    }

    fn unit(&self, declared: &str) -> String {
        self.axis.unit(declared)
    }

    fn dynamics(&self, thetas: &Thetas) -> JointDynamics {
        let lane = |k: usize| Lane {
            inertia: thetas.row(0)[k],
            viscous_friction: thetas.row(1)[k],
            gravity_torque: thetas.row(2)[k],
            gain: thetas.row(3)[k],
        };
        JointDynamics { lanes: (0..thetas.lanes()).map(lane).collect() }
    }
}

impl Mover for Joint {
    fn motion(state: &Motion) -> Motion {
        *state
    }

    fn push(effect: &mut Push) -> &mut Push {
        effect
    }

    fn inertia(dynamics: &JointDynamics, lane: usize, _: &Motion) -> f64 {
        dynamics.lanes[lane].inertia
    }

    fn drive(scene: &Scene<'_, Self>, lane: usize) -> f64 {
        scene.dynamics.lanes[lane].gain * scene.commands[lane].0
    }

    fn external(scene: &Scene<'_, Self>, lane: usize, position: f64) -> f64 {
        let gravity = scene.dynamics.lanes[lane].gravity_torque;
        if gravity == 0.0 { 0.0 } else { -gravity * sine(position) }
    }

    fn damping(dynamics: &JointDynamics, lane: usize, _: &Motion) -> f64 {
        dynamics.lanes[lane].viscous_friction
    }
}

/// The running joint: its parameters, lane by lane.
#[derive(Debug, Clone)]
pub struct JointDynamics {
    lanes: Vec<Lane>,
}

/// The parameters of one lane.
#[derive(Debug, Clone, Copy)]
struct Lane {
    inertia: f64,
    viscous_friction: f64,
    gravity_torque: f64,
    gain: f64,
}

impl Lane {
    /// One step of `step` [s]; `sine` is that of the position in the middle of it.
    #[inline(always)]
    fn step(&self, step: f64, state: &mut Motion, sine: f64, command: f64, effect: &Push) {
        let half = 0.5 * step;
        let viscous = self.viscous_friction;
        let inertia = self.inertia + effect.inertia;
        let midway = state.position + half * state.velocity;
        let mut torque = self.gain * command + effect.effort - effect.stiffness * midway;
        if self.gravity_torque != 0.0 {
            torque -= self.gravity_torque * sine;
        }
        if effect.creeping_friction > 0.0 {
            let driven = |velocity: f64| torque - viscous * velocity;
            let stopping = |velocity: f64| {
                let whole = CREEP_SHARE * (inertia * CREEP_RATE * velocity + driven(velocity));
                whole.max(-effect.creeping_friction).min(effect.creeping_friction)
            };
            // As of the middle of the step: creep is fast for a step.
            let change = (driven(state.velocity) - stopping(state.velocity)) / inertia;
            torque -= stopping(state.velocity + half * change);
        }
        // Damping by Crank-Nicolson, on both sides of the step.
        let damping = half * (viscous + effect.damping);
        let whole = inertia + damping;
        let free = (state.velocity * (inertia - damping) + step * torque) / whole;
        let held = if effect.dry_friction > 0.0 { step * effect.dry_friction / whole } else { 0.0 };
        let velocity = if held > 0.0 { rubbed(state.velocity, free, held) } else { free };
        state.position = midway + half * velocity;
        state.velocity = velocity;
    }
}

impl LaneDynamics<Joint> for JointDynamics {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.derived(&mut self.lanes, |values| Lane {
            inertia: values[0],
            viscous_friction: values[1],
            gravity_torque: values[2],
            gain: values[3],
        });
    }
}

impl Dynamics<Joint> for JointDynamics {
    fn initial(&self, initial: &Thetas) -> Vec<Motion> {
        let lanes = initial.row(0).iter().zip(initial.row(1));
        lanes.map(|(position, velocity)| Motion { position: *position, velocity: *velocity }).collect()
    }

    fn advance(&self, tick: Tick, states: &mut [Motion], _: &[()], commands: &[Signal], effects: &[Push]) {
        let half = 0.5 * tick.step;
        for first in (0..states.len()).step_by(BLOCK) {
            let own = first..(first + BLOCK).min(states.len());
            let (states, parameters) = (&mut states[own.clone()], &self.lanes[own.clone()]);
            let mut sine = [0.0; BLOCK];
            // The sine is most of the work of a step: of several lanes at once, and not where nothing weighs on the joint.
            if parameters.iter().any(|lane| lane.gravity_torque != 0.0) {
                let sine = &mut sine[..states.len()];
                sine.iter_mut()
                    .zip(states.iter())
                    .for_each(|(angle, state)| *angle = state.position + half * state.velocity);
                sines(sine);
            }
            let lanes = states.iter_mut().zip(parameters).zip(&commands[own.clone()]).zip(&effects[own]).zip(sine);
            for ((((state, lane), command), effect), sine) in lanes {
                lane.step(tick.step, state, sine, command.0, effect);
            }
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
    use crate::robot::MECHANISMS;
    use crate::sim2real::{Assembly, Measured, Seed, Simulator, check_plant};

    fn swing(rows: usize) -> Recording<Commands> {
        let time: Vec<f64> = (0..rows).map(|i| i as f64 * 4e-3).collect();
        let commands = time.iter().map(|t| 2.0 * (1.3 * t).sin()).collect();
        let samples = time.iter().map(|t| Some(0.3 * t.sin())).collect();
        Recording {
            name: "swing".into(),
            stimulus: Commands(commands),
            measured: vec![Measured { channel: "position".into(), unit: "rad".into(), samples }],
            time,
        }
    }

    fn arm() -> Joint {
        Joint::new(Axis::Rotary, [0.11, 0.25, 2.7, 1.0], [0.2, 0.2, 0.2, 0.0])
    }

    #[test]
    fn keeps_the_contract_of_a_plant() {
        check_plant(&arm(), MECHANISMS, &swing(400)).unwrap();
    }

    #[test]
    fn follows_the_equation_of_motion_as_an_ode_solver_does() {
        let recording = swing(2_000);
        let thetas = Thetas::single(&[0.11, 0.25, 2.7, 1.0, 0.4, 0.0]);
        let ours = Assembly::new(arm(), MECHANISMS).rollout(&thetas, &recording, 0..2_000, Seed(0));
        // Classical Runge-Kutta at a twentieth of the step, each row's command held.
        let (mut q, mut v, h) = (0.4_f64, 0.0_f64, 5e-5);
        let mut worst = 0.0_f64;
        for row in 0..1_999 {
            worst = worst.max((ours[0][0].samples[row] - q).abs());
            let u = recording.stimulus.0[row];
            let a = |q: f64, v: f64| (u - 0.25 * v - 2.7 * q.sin()) / 0.11;
            for _ in 0..80 {
                let (k1, l1) = (v, a(q, v));
                let (k2, l2) = (v + 0.5 * h * l1, a(q + 0.5 * h * k1, v + 0.5 * h * l1));
                let (k3, l3) = (v + 0.5 * h * l2, a(q + 0.5 * h * k2, v + 0.5 * h * l2));
                let (k4, l4) = (v + h * l3, a(q + h * k3, v + h * l3));
                q += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                v += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
            }
        }
        assert!(worst < 2e-5, "{worst} rad");
    }
}
