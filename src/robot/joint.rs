//! `joint`: one servo joint, or a linear axis.

use super::mover::{Motion, Mover, Push, rubbed};
use crate::sim2real::mechanism::HeldLine;
use crate::sim2real::{
    Channel, Clock, Command, Covariate, DelayLine, Dynamics, Observation, Parameter, Plant, Recording, Stimulus, Thetas,
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
const LINEAR: [(&str, &str); 8] = [
    ("N m", "N"),
    ("N m/rad", "N/m"),
    ("N m/rad^3", "N/m^3"),
    ("N m s^2/rad^2", "N s^2/m^2"),
    ("rad", "m"),
    ("rad/s", "m/s"),
    ("rad/(N m)", "m/N"),
    ("1/rad", "1/m"),
];

/// How a joint moves: its units follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// It turns: positions in rad, efforts in N m.
    Rotary,
    /// It slides: positions in m, efforts in N.
    Linear,
}

const ROTARY_CHANNELS: &[Channel] =
    &[Channel { name: "position", unit: "rad" }, Channel { name: "velocity", unit: "rad/s" }];
const LINEAR_CHANNELS: &[Channel] = &[Channel { name: "position", unit: "m" }, Channel { name: "velocity", unit: "m/s" }];

/// Longest step of integration [s]: at 1 ms smooth motions are right to some microradians.
const LONGEST_STEP: f64 = 1e-3;

/// How contacts of rigid-body engines creep while they hold: friction is `clip(share (inertia rate v + effort), limit)`,
/// with the impedance and the rate [1/s] of MuJoCo's default `solimp` and `solref` (Todorov, "Convex and analytically
/// invertible dynamics with contacts and constraints", ICRA 2014; MuJoCo documentation, "Computation").
pub(super) const CREEP_SHARE: f64 = 0.9;
pub(super) const CREEP_RATE: f64 = 105.0;

/// A command that holds until the next, in the actuator's own unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Torque(pub f64);

impl AsMut<f64> for Torque {
    fn as_mut(&mut self) -> &mut f64 {
        &mut self.0
    }
}

impl Command for Torque {
    type Line = HeldLine;
}

impl DelayLine<Torque> for HeldLine {
    fn pass(&mut self, tick: Tick, seconds: f64, command: &mut Torque) {
        command.0 = self.mean(tick, seconds, command.0);
    }
}

/// The commands of a recording, one a row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Commands(pub Vec<f64>);

impl Stimulus<Joint> for Commands {
    fn command(&self, row: usize) -> Torque {
        Torque(self.0[row])
    }

    fn input(&self, _row: usize, _arriving: &Torque) {}

    fn commands(&self) -> Option<&[f64]> {
        Some(&self.0)
    }

    fn commanded(&self, commands: Vec<f64>) -> Option<Self> {
        Some(Self(commands))
    }
}

/// What is seen of a joint: position [rad], velocity [rad/s].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Posture([f64; 2]);

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
    type Command = Torque;
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

    fn channels(&self) -> &'static [Channel] {
        match self.axis {
            Axis::Rotary => ROTARY_CHANNELS,
            Axis::Linear => LINEAR_CHANNELS,
        }
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.parameters.clone()
    }

    fn typical(&self, recordings: &[Recording<Commands>]) -> Typical {
        let gain = self.parameters[3].nominal.abs();
        let command = root_mean_square(recordings.iter().flat_map(|r| r.stimulus.0.iter().copied()));
        let positions: Vec<Estimate> =
            recordings.iter().flat_map(|r| (0..r.len()).step_by(7).filter_map(|row| local_motion(r, row))).collect();
        let mean = positions.iter().map(|e| e.position).sum::<f64>() / positions.len().max(1) as f64;
        Typical {
            command,
            effort: command * gain,
            output: root_mean_square(positions.iter().map(|e| e.position - mean)),
            rate: root_mean_square(positions.iter().map(|e| e.velocity)),
            range: range(positions.iter().map(|e| e.position)),
            resolution: recordings.iter().map(|r| self.resolution(r, "position")).fold(0.0, f64::max) * 12.0_f64.sqrt(),
            duration: recordings.iter().filter_map(|r| Some(r.time.last()? - r.time.first()?)).fold(0.0, f64::max),
            delay: None,
        }
    }

    /// Position and velocity as a parabola through the rows around `row` has them. The position's prior is wide, so that
    /// an offset of the sensor shows in the motion that follows rather than be taken for where the joint was.
    fn initial_parameters(&self, recording: &Recording<Commands>, row: usize) -> Vec<Parameter> {
        let estimate = local_motion(recording, row).unwrap_or_default();
        let typical = self.typical(std::slice::from_ref(recording));
        vec![
            Parameter::new("initial position", "rad", estimate.position).known_to(0.3 * typical.output.max(1e-9)),
            Parameter::new("initial velocity", "rad/s", estimate.velocity).known_to(estimate.velocity_std.max(1e-9)),
        ]
    }

    fn covariates(&self, recording: &Recording<Commands>) -> Vec<Covariate> {
        let motion: Vec<Estimate> =
            (0..recording.len()).map(|row| local_motion(recording, row).unwrap_or_default()).collect();
        vec![
            ("command", recording.stimulus.0.clone()),
            ("position", motion.iter().map(|e| e.position).collect()),
            ("velocity", motion.iter().map(|e| e.velocity).collect()),
        ]
    }

    /// Standard deviation of the rounding of a sensor that counts in steps: `step / sqrt(12)` (Widrow & Kollár,
    /// *Quantization Noise* (2008), section 5.4), where nine in ten changes of the signal are whole multiples of the
    /// smallest.
    fn resolution(&self, recording: &Recording<Commands>, channel: &str) -> f64 {
        let Some(measured) = recording.channel(channel) else { return 0.0 };
        let changes = measured.samples.windows(2).filter_map(|w| Some((w[1]? - w[0]?).abs()));
        let largest = changes.clone().fold(0.0, f64::max);
        // Differences of rounded numbers are not quite whole multiples: the last bits differ.
        let changes: Vec<f64> = changes.filter(|change| *change > 1e-9 * largest).collect();
        let step = changes.iter().copied().fold(f64::INFINITY, f64::min);
        let whole = changes.iter().filter(|change| ((**change / step) - (**change / step).round()).abs() < 1e-3).count();
        if !changes.is_empty() && 10 * whole >= 9 * changes.len() { step / 12.0_f64.sqrt() } else { 0.0 }
    }

    fn unit(&self, declared: &str) -> String {
        let declared = match declared {
            "output" => "rad",
            "output/s" => "rad/s",
            "command" => return "unit of the command".to_owned(),
            "command/s" => return "units of the command/s".to_owned(),
            other => other,
        };
        let linear = LINEAR.iter().find(|(rotary, _)| self.axis == Axis::Linear && *rotary == declared);
        linear.map_or(declared, |(_, linear)| linear).to_owned()
    }

    fn dynamics(&self, thetas: &Thetas) -> JointDynamics {
        JointDynamics {
            inertia: thetas.row(0).to_vec(),
            viscous_friction: thetas.row(1).to_vec(),
            gravity_torque: thetas.row(2).to_vec(),
            gain: thetas.row(3).to_vec(),
        }
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
        dynamics.inertia[lane]
    }

    fn drive(dynamics: &JointDynamics, lane: usize, _: &Motion, command: &Torque) -> f64 {
        dynamics.gain[lane] * command.0
    }

    fn external(dynamics: &JointDynamics, lane: usize, _: &Motion, position: f64) -> f64 {
        let gravity = dynamics.gravity_torque[lane];
        if gravity == 0.0 { 0.0 } else { -gravity * position.sin() }
    }

    fn damping(dynamics: &JointDynamics, lane: usize, _: &Motion) -> f64 {
        dynamics.viscous_friction[lane]
    }
}

/// The running joint: its parameters, lane by lane.
#[derive(Debug, Clone)]
pub struct JointDynamics {
    inertia: Vec<f64>,
    viscous_friction: Vec<f64>,
    gravity_torque: Vec<f64>,
    gain: Vec<f64>,
}

impl Dynamics<Joint> for JointDynamics {
    fn initial(&self, initial: &Thetas) -> Vec<Motion> {
        let lanes = initial.row(0).iter().zip(initial.row(1));
        lanes.map(|(position, velocity)| Motion { position: *position, velocity: *velocity }).collect()
    }

    fn advance(&self, tick: Tick, states: &mut [Motion], _: &[()], commands: &[Torque], effects: &[Push]) {
        let half = 0.5 * tick.step;
        let parameters = self.inertia.iter().zip(&self.viscous_friction).zip(&self.gravity_torque).zip(&self.gain);
        let lanes = states.iter_mut().zip(commands).zip(effects).zip(parameters);
        for (((state, command), effect), (((inertia, viscous), gravity), gain)) in lanes {
            let inertia = inertia + effect.inertia;
            let midway = state.position + half * state.velocity;
            let mut torque = gain * command.0 + effect.effort - effect.stiffness * midway;
            // The sine is most of the work of a step: not where nothing weighs on the joint.
            if *gravity != 0.0 {
                torque -= gravity * midway.sin();
            }
            if effect.creeping_friction > 0.0 {
                let driven = |velocity: f64| torque - viscous * velocity;
                let stopping = |velocity: f64| {
                    let whole = CREEP_SHARE * (inertia * CREEP_RATE * velocity + driven(velocity));
                    whole.clamp(-effect.creeping_friction, effect.creeping_friction)
                };
                // As of the middle of the step: creep is fast for a step.
                let change = (driven(state.velocity) - stopping(state.velocity)) / inertia;
                torque -= stopping(state.velocity + half * change);
            }
            let damping = half * (viscous + effect.damping) / inertia;
            let free = (state.velocity * (1.0 - damping) + tick.step * torque / inertia) / (1.0 + damping);
            let held = tick.step * effect.dry_friction / (inertia * (1.0 + damping));
            let velocity = if held > 0.0 { rubbed(state.velocity, free, held) } else { free };
            state.position = midway + half * velocity;
            state.velocity = velocity;
        }
    }

    fn observe(&self, states: &[Motion], observations: &mut [Posture]) {
        for (state, observation) in states.iter().zip(observations) {
            observation.0 = [state.position, state.velocity];
        }
    }
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.filter(|v| v.is_finite()).fold((0.0, 0), |(sum, count), v| (sum + v * v, count + 1));
    (sum / f64::from(count.max(1))).sqrt()
}

/// Lowest and highest of the values; 0 where there is none.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values
        .fold(None, |range, v| Some(range.map_or([v, v], |[low, high]: [f64; 2]| [low.min(v), high.max(v)])))
        .unwrap_or_default()
}

/// Position and velocity at one row, as measured.
#[derive(Debug, Clone, Copy, Default)]
struct Estimate {
    position: f64,
    velocity: f64,
    /// Standard deviation of `velocity` [rad/s].
    velocity_std: f64,
}

/// Rows on either side that a local estimate uses.
const REACH: usize = 7;

/// A parabola by least squares through the measured positions around `row`; the measured velocity where there is one.
fn local_motion(recording: &Recording<Commands>, row: usize) -> Option<Estimate> {
    let positions = &recording.channel("position")?.samples;
    let rows = row.saturating_sub(REACH)..(row + REACH + 1).min(recording.len());
    let points: Vec<(f64, f64)> =
        rows.filter_map(|i| Some((recording.time[i] - recording.time[row], positions[i]?))).collect();
    let scale = points.iter().map(|(t, _)| t.abs()).fold(0.0, f64::max);
    if points.len() < 5 || scale <= 0.0 {
        let (_, position) = points.first()?;
        return Some(Estimate { position: *position, velocity: 0.0, velocity_std: f64::INFINITY });
    }
    let design = nalgebra::DMatrix::from_fn(points.len(), 3, |i, k| (points[i].0 / scale).powi(k as i32));
    let values = nalgebra::DVector::from_iterator(points.len(), points.iter().map(|(_, y)| *y));
    let inverse = design.tr_mul(&design).try_inverse()?;
    let solution = &inverse * design.tr_mul(&values);
    let spare = (points.len() - 3) as f64;
    let variance = (&values - &design * &solution).norm_squared() / spare;
    let measured = recording.channel("velocity").and_then(|v| v.samples[row]);
    Some(Estimate {
        position: solution[0],
        velocity: measured.unwrap_or(solution[1] / scale),
        velocity_std: (variance * inverse[(1, 1)]).sqrt() / scale,
    })
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

    #[test]
    fn a_sensor_that_counts_is_no_better_than_its_step() {
        let step = 2.0 * std::f64::consts::PI / 4096.0;
        let mut recording = swing(2_000);
        let counted = |t: f64| ((0.05 * (3.1 * t).sin()) / step).round() * step;
        recording.measured[0].samples = recording.time.iter().map(|t| Some(counted(*t))).collect();
        let resolution = arm().resolution(&recording, "position");
        assert!((resolution / (step / 12.0_f64.sqrt()) - 1.0).abs() < 1e-6, "{resolution}");
        assert_eq!(arm().resolution(&swing(2_000), "position"), 0.0);
    }
}
