//! `cart_pole`: a cart on a track, and a pole that swings freely on it.

use super::cart_pole_lane::Lane;
use super::estimate::{begun, initial_rate, motion, rounding, typical};
use super::joint::Axis;
use super::mover::{Motion, Mover, Push};
use super::runge_kutta::{Contact, step_with_friction};
use super::signal::{Commands, Signal};
use crate::sim2real::{
    Channel, Clock, Covariate, Dynamics, LaneChange, LaneDynamics, Observation, Parameter, Plant, Recording, Scene, Thetas,
    Tick, Typical,
};

/// A cart of mass `M` at `x`, driven by `gain u`, with a uniform pole of mass `m` and half length `l` hinged on it, at the
/// angle `q` from *upright*, positive where the pole leans towards positive `x`:
///
/// ```text
/// (M + m) a + m l (q'' cos q - q'^2 sin q) = gain u - cart_friction v
/// 4/3 m l^2 q'' + m l a cos q - m g l sin q = -pole_friction q'
/// ```
///
/// A hanging pole has `q` near pi, or -pi; angles are not wrapped. Upright, the free motion grows: a recording of it is made
/// under a controller, which its twin has too.
///
/// Integrated by classical Runge-Kutta at 1 ms and finer; dry friction stops the cart where its velocity changes sign.
///
/// Source: Barto, Sutton & Anderson, "Neuronlike adaptive elements that can solve difficult learning control problems",
/// IEEE Transactions on Systems, Man, and Cybernetics 13 (1983), appendix; as Gymnasium's `CartPole` has it (without
/// friction), with a force that is continuous.
#[derive(Debug, Clone, PartialEq)]
pub struct CartPole {
    parameters: Vec<Parameter>,
    integration: Integration,
}

/// How a cart-pole is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Integration {
    /// By classical Runge-Kutta, at 1 ms and finer.
    #[default]
    RungeKutta,
    /// By Euler's explicit method, in steps of `step` [s]: as Gymnasium has it, whose step of 0.02 s is a part of the task. Dry
    /// friction stops the cart within a step, as the joint's does.
    Euler {
        /// Length of a step [s].
        step: f64,
    },
}

/// The parameters of a cart-pole in their order: name and unit.
const PARAMETERS: [(&str, &str); 7] = [
    ("cart_mass", "kg"),
    ("pole_mass", "kg"),
    ("half_length", "m"),
    ("gravity", "m/s^2"),
    ("cart_friction", "N s/m"),
    ("pole_friction", "N m s"),
    ("gain", "N per unit"),
];

static CHANNELS: &[Channel] = &[
    Channel::new("position", "m"),
    Channel::new("velocity", "m/s"),
    Channel::new("angle", "rad"),
    Channel::new("angular_velocity", "rad/s"),
];

/// Longest step of integration [s].
const LONGEST_STEP: f64 = 1e-3;

/// What is seen of a cart-pole: position [m] and velocity [m/s] of the cart, angle [rad] and angular velocity [rad/s] of
/// the pole.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CartPoleView([f64; 4]);

impl AsMut<[f64]> for CartPoleView {
    fn as_mut(&mut self) -> &mut [f64] {
        &mut self.0
    }
}

impl Observation for CartPoleView {
    fn channel(&self, k: usize) -> f64 {
        self.0[k]
    }
}

impl CartPole {
    /// A cart-pole with the given masses of cart and pole [kg], half length of the pole [m], gravity [m/s^2], viscous
    /// friction of the cart [N s/m] and of the hinge [N m s], and gain [N per unit of command], known to the given
    /// relative standard deviations.
    #[must_use]
    pub fn new(values: [f64; 7], uncertainty: [f64; 7]) -> Self {
        let parameters = PARAMETERS
            .iter()
            .zip(values.iter().zip(uncertainty))
            .map(|((name, unit), (value, uncertainty))| {
                let parameter = Parameter::new(name, unit, *value).known_to((uncertainty * value).abs());
                match *name {
                    "cart_mass" | "pole_mass" | "half_length" => parameter.within(value * 0.01, f64::INFINITY),
                    "gravity" | "cart_friction" | "pole_friction" => parameter.within(0.0, f64::INFINITY),
                    _ => parameter,
                }
            })
            .collect();
        Self { parameters, integration: Integration::default() }
    }

    /// The same, integrated in another way.
    #[must_use]
    pub fn integrated(mut self, integration: Integration) -> Self {
        self.integration = integration;
        self
    }

    /// The names and units of its parameters, in the order of [`CartPole::new`].
    #[must_use]
    pub fn parameter_names() -> [(&'static str, &'static str); 7] {
        PARAMETERS
    }
}

impl Plant for CartPole {
    type Command = Signal;
    type Input = ();
    type State = [f64; 4];
    type Effect = Push;
    type Observation = CartPoleView;
    type Dynamics = CartPoleDynamics;
    type Stimulus = Commands;

    fn name(&self) -> &'static str {
        "cart_pole"
    }

    fn clock(&self) -> Clock {
        match self.integration {
            Integration::RungeKutta => Clock::Sampled { longest_step: LONGEST_STEP },
            Integration::Euler { step } => Clock::Sampled { longest_step: step },
        }
    }

    fn channels(&self) -> &[Channel] {
        CHANNELS
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.parameters.clone()
    }

    fn typical(&self, recordings: &[Recording<Commands>]) -> Typical {
        typical(recordings, "position", "velocity", self.parameters[6].nominal)
    }

    /// As those of a joint: value and rate as a parabola through the rows around `row` has them, of the cart's position with a
    /// wide prior, so that an offset of the sensor shows.
    fn initial_parameters(&self, recording: &Recording<Commands>, row: usize) -> Vec<Parameter> {
        let cart = begun(recording, "position", "velocity", row);
        let pole = begun(recording, "angle", "angular_velocity", row);
        let recordings = std::slice::from_ref(recording);
        let moves = self.typical(recordings);
        let turns = || typical(recordings, "angle", "angular_velocity", 1.0).rate;
        let wide = 0.3 * moves.output.max(1e-9);
        vec![
            Parameter::new("initial position", "m", cart.value).known_to(wide),
            initial_rate("initial velocity", "m/s", &cart, row, || moves.rate),
            Parameter::new("initial angle", "rad", pole.value).known_to(0.1),
            initial_rate("initial angular velocity", "rad/s", &pole, row, turns),
        ]
    }

    fn covariates(&self, recording: &Recording<Commands>) -> Vec<Covariate> {
        let cart = motion(recording, "position", "velocity");
        let pole = motion(recording, "angle", "angular_velocity");
        vec![
            ("command", recording.stimulus.0.clone()),
            ("position", cart.iter().map(|e| e.value).collect()),
            ("velocity", cart.iter().map(|e| e.rate).collect()),
            ("angle", pole.iter().map(|e| e.value).collect()),
            ("angular velocity", pole.iter().map(|e| e.rate).collect()),
        ]
    }

    fn resolution(&self, recording: &Recording<Commands>, channel: &str) -> f64 {
        recording.channel(channel).map_or(0.0, rounding)
    }

    fn unit(&self, declared: &str) -> String {
        Axis::Linear.unit(declared)
    }

    fn dynamics(&self, thetas: &Thetas) -> CartPoleDynamics {
        let values = |lane: usize| std::array::from_fn(|k| thetas.row(k)[lane]);
        let lanes = (0..thetas.lanes()).map(|lane| Lane::of(values(lane))).collect();
        CartPoleDynamics { lanes, integration: self.integration }
    }
}

/// The running cart-pole: its parameters, lane by lane.
#[derive(Debug, Clone)]
pub struct CartPoleDynamics {
    lanes: Vec<Lane>,
    integration: Integration,
}

impl Mover for CartPole {
    fn motion(state: &[f64; 4]) -> Motion {
        Motion { position: state[0], velocity: state[1] }
    }

    fn push(effect: &mut Push) -> &mut Push {
        effect
    }

    fn inertia(dynamics: &CartPoleDynamics, lane: usize, state: &[f64; 4]) -> f64 {
        let lane = &dynamics.lanes[lane];
        lane.inertia(lane.cart_mass, state[2].cos())
    }

    fn drive(scene: &Scene<'_, Self>, lane: usize) -> f64 {
        scene.dynamics.lanes[lane].gain * scene.commands[lane].0
    }

    fn external(scene: &Scene<'_, Self>, lane: usize, _: f64) -> f64 {
        scene.dynamics.lanes[lane].reaction(&scene.states[lane])
    }
}

impl LaneDynamics<CartPole> for CartPoleDynamics {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.derived(&mut self.lanes, |values| Lane::of(std::array::from_fn(|k| values[k])));
    }
}

impl Dynamics<CartPole> for CartPoleDynamics {
    fn initial(&self, initial: &Thetas) -> Vec<[f64; 4]> {
        (0..initial.lanes()).map(|lane| std::array::from_fn(|k| initial.row(k)[lane])).collect()
    }

    fn advance(&self, tick: Tick, states: &mut [[f64; 4]], _: &[()], commands: &[Signal], effects: &[Push]) {
        for (((state, command), push), lane) in states.iter_mut().zip(commands).zip(effects).zip(&self.lanes) {
            *state = match self.integration {
                Integration::RungeKutta => {
                    let net = |s: &[f64; 4]| lane.force(s, command.0, push) + lane.reaction(s);
                    let rate = |s: &[f64; 4], contact: Contact| lane.rate(s, command.0, push, contact);
                    step_with_friction(*state, tick.step, 1, push.dry_friction, net, rate)
                }
                Integration::Euler { .. } => lane.euler(state, tick.step, command.0, push),
            };
        }
    }

    fn observe(&self, states: &[[f64; 4]], observations: &mut [CartPoleView]) {
        for (state, observation) in states.iter().zip(observations) {
            observation.0 = *state;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::CART_POLE_MECHANISMS;
    use crate::sim2real::{Assembly, Measured, Seed, Simulator, check_lanes, check_mechanism, check_plant};

    const VALUES: [f64; 7] = [1.0, 0.1, 0.5, 9.8, 0.3, 0.01, 2.0];

    fn plant() -> CartPole {
        CartPole::new(VALUES, [0.2; 7])
    }

    /// The pole hangs and swings while the cart is pushed to and fro.
    fn hanging(rows: usize) -> Recording<Commands> {
        let time: Vec<f64> = (0..rows).map(|i| i as f64 * 5e-3).collect();
        let samples = |f: &dyn Fn(f64) -> f64| time.iter().map(|t| Some(f(*t))).collect();
        let measured = vec![
            Measured { channel: "position".into(), unit: "m".into(), samples: samples(&|t| 0.2 * (2.0 * t).sin()) },
            Measured { channel: "angle".into(), unit: "rad".into(), samples: samples(&|t| 3.0 + 0.2 * (4.0 * t).sin()) },
        ];
        let commands = time.iter().map(|t| (5.0 * t).cos() - 0.6 * (2.0 * t).sin()).collect();
        Recording { name: "hanging".into(), stimulus: Commands(commands), measured, time }
    }

    #[test]
    fn the_plant_and_every_row_of_its_registry_keep_their_contracts() {
        check_plant(&plant(), CART_POLE_MECHANISMS, &hanging(400)).unwrap();
        for mechanism in CART_POLE_MECHANISMS {
            check_mechanism(*mechanism, &plant(), CART_POLE_MECHANISMS, &hanging(800)).unwrap();
            check_lanes(*mechanism, &plant(), CART_POLE_MECHANISMS, &hanging(800)).unwrap();
        }
    }

    #[test]
    fn by_euler_it_keeps_the_contract_too_and_dry_friction_holds_it() {
        let euler = || plant().integrated(Integration::Euler { step: 0.02 });
        check_plant(&euler(), CART_POLE_MECHANISMS, &hanging(400)).unwrap();
        for mechanism in CART_POLE_MECHANISMS {
            check_lanes(*mechanism, &euler(), CART_POLE_MECHANISMS, &hanging(400)).unwrap();
        }
        let hangs = [0.0, 0.0, std::f64::consts::PI, 0.0];
        let lane = Lane::of(VALUES);
        let stuck = lane.euler(&hangs, 0.02, 0.4, &Push { dry_friction: 1.0, ..Push::default() });
        assert_eq!(stuck[..2], [0.0, 0.0]);
        assert!(lane.euler(&hangs, 0.02, 0.6, &Push { dry_friction: 1.0, ..Push::default() })[1] > 0.0);
    }

    /// The accelerations of Gymnasium's `CartPoleEnv.step`, line by line; without friction, as there.
    #[test]
    fn accelerates_as_gymnasium_has_it() {
        let (masspole, length, gravity, total_mass) = (0.1, 0.5, 9.8, 1.1);
        let polemass_length = masspole * length;
        let frictionless = Lane::of([1.0, 0.1, 0.5, 9.8, 0.0, 0.0, 1.0]);
        for (force, theta, theta_dot) in [(10.0, 0.05, -0.3), (-10.0, 1.2, 4.0), (3.0, 2.9, -7.0), (0.0, -0.4, 0.0)] {
            let (sintheta, costheta) = f64::sin_cos(theta);
            let temp = (force + polemass_length * theta_dot * theta_dot * sintheta) / total_mass;
            let thetaacc = (gravity * sintheta - costheta * temp)
                / (length * (4.0 / 3.0 - masspole * costheta * costheta / total_mass));
            let xacc = temp - polemass_length * thetaacc * costheta / total_mass;
            let state = [0.3, 0.7, theta, theta_dot];
            let rate = frictionless.rate(&state, force, &Push::default(), Contact::Sliding(0.0));
            assert!((rate[1] - xacc).abs() < 1e-12 && (rate[3] - thetaacc).abs() < 1e-12, "{rate:?}");
        }
    }

    /// Against the coupled equations of the documentation, solved as a 2 x 2 system and integrated by small steps.
    #[test]
    fn follows_its_equations_of_motion() {
        let recording = hanging(1_000);
        let theta: Vec<f64> = VALUES.iter().copied().chain([0.1, -0.2, 2.5, 1.0]).collect();
        let assembly = Assembly::new(plant(), CART_POLE_MECHANISMS);
        let ours = assembly.rollout(&Thetas::single(&theta), &recording, 0..1_000, Seed(0));
        let [cart, pole, half, gravity, b, c, gain] = VALUES;
        let rate = |[_, v, q, w]: [f64; 4], u: f64| {
            let (sin, cos) = q.sin_cos();
            let (a11, a12, a22) = (cart + pole, pole * half * cos, 4.0 / 3.0 * pole * half * half);
            let (f1, f2) = (gain * u - b * v + pole * half * w * w * sin, pole * gravity * half * sin - c * w);
            let determinant = a11 * a22 - a12 * a12;
            [v, (a22 * f1 - a12 * f2) / determinant, w, (a11 * f2 - a12 * f1) / determinant]
        };
        let mut state = [0.1, -0.2, 2.5, 1.0];
        let (mut worst, h) = (0.0_f64, 2.5e-6);
        for row in 0..400 {
            for k in 0..4 {
                worst = worst.max((ours[0][k].samples[row] - state[k]).abs());
            }
            // The explicit midpoint rule, another method than the plant's.
            for _ in 0..2_000 {
                let first = rate(state, recording.stimulus.0[row]);
                let middle = std::array::from_fn(|k| state[k] + 0.5 * h * first[k]);
                let slope = rate(middle, recording.stimulus.0[row]);
                state = std::array::from_fn(|k| state[k] + h * slope[k]);
            }
        }
        assert!(worst < 1e-6, "{worst}");
    }

    /// A pole that hangs at rest does not move the cart, and a push below the friction does not either.
    #[test]
    fn a_stuck_cart_stays_stuck_while_the_pole_swings() {
        let mut recording = hanging(600);
        recording.stimulus.0.iter_mut().for_each(|u| *u = 0.05);
        let friction = CART_POLE_MECHANISMS.iter().find(|m| m.about().name == "coulomb_friction").unwrap();
        let form = friction.forms(&Typical::default()).remove(0).parameters;
        let assembly = Assembly::new(plant(), CART_POLE_MECHANISMS).with_mechanism(*friction, 0, form);
        let lane = |friction: f64| -> Vec<f64> { VALUES.into_iter().chain([friction, 0.25, 0.0, 3.0, 0.0]).collect() };
        let follow = |friction| assembly.rollout(&Thetas::single(&lane(friction)), &recording, 0..600, Seed(0)).remove(0);
        let stuck = follow(3.0);
        assert!(stuck[0].samples.iter().all(|x| *x == 0.25));
        assert!(stuck[2].samples.iter().any(|angle| *angle > 3.2), "the pole swings through");
        assert!(follow(0.0)[0].samples[599] > 0.3);
    }
}
