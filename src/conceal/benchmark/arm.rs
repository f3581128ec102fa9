//! The arm itself, before anything is concealed in it.

use std::f64::consts::TAU;

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

/// A joint: `inertia a + viscous_friction v + gravity_torque sin q = gain u`; a linear axis with the units of one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Arm {
    /// Whether it slides: then all that follows is in kg, N and m.
    pub linear: bool,
    /// Inertia [kg m^2].
    pub inertia: f64,
    /// Viscous friction [N m s/rad].
    pub viscous_friction: f64,
    /// Torque of gravity at a right angle [N m]; 0 for an arm that nothing weighs on.
    pub gravity_torque: f64,
    /// Torque of the driver [N m per unit of command].
    pub gain: f64,
}

/// What an arm must be for what is to be concealed in it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Need {
    /// Gravity must pull it to one place: without, a sensor's error is the same as having started elsewhere.
    pub weighed: bool,
    /// It must turn.
    pub rotary: bool,
}

/// Share of linear axes.
const LINEAR: f64 = 0.14;
/// Share of rotary arms that nothing weighs on.
const BALANCED: f64 = 0.14;

impl Arm {
    /// An arm at random.
    pub(super) fn draw(need: Need, rng: &mut impl Rng) -> Self {
        let linear = rng.random::<f64>() < LINEAR && !need.weighed && !need.rotary;
        let balanced = rng.random::<f64>() < BALANCED && !need.weighed;
        // A gain is read off a data sheet, which has two digits.
        let two_digits = |gain: f64| if gain < 1.0 { (100.0 * gain).round() / 100.0 } else { (10.0 * gain).round() / 10.0 };
        let (inertia, gain) = if linear {
            (logarithmic(rng, 0.5, 8.0), logarithmic(rng, 1.0, 20.0))
        } else {
            (logarithmic(rng, 0.02, 0.5), logarithmic(rng, 0.4, 3.0))
        };
        let gain = two_digits(gain);
        if linear || balanced {
            let settling = logarithmic(rng, 0.08, 0.8);
            return Self { linear, inertia, viscous_friction: inertia / settling, gravity_torque: 0.0, gain };
        }
        let swing = TAU * logarithmic(rng, 0.35, 1.3);
        let damping = logarithmic(rng, 0.06, 0.6);
        Self {
            linear,
            inertia,
            viscous_friction: 2.0 * damping * swing * inertia,
            gravity_torque: inertia * swing * swing,
            gain,
        }
    }

    /// Whether it stays wherever it is put: errors then add up over a recording.
    pub(super) fn adds_up(&self) -> bool {
        self.gravity_torque == 0.0
    }

    /// Its numbers, in the order of a twin's parameters: inertia, viscous friction, gravity torque, gain.
    #[must_use]
    pub fn values(&self) -> [f64; 4] {
        [self.inertia, self.viscous_friction, self.gravity_torque, self.gain]
    }

    /// Another arm of the same kind with these numbers.
    #[must_use]
    pub fn with_values(self, values: [f64; 4]) -> Self {
        let [inertia, viscous_friction, gravity_torque, gain] = values;
        Self { inertia, viscous_friction, gravity_torque, gain, ..self }
    }
}

/// A number between `low` and `high`, evenly in its logarithm.
pub(super) fn logarithmic(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(rng.random::<f64>())
}

/// 1 or -1.
pub(super) fn sign(rng: &mut impl Rng) -> f64 {
    if rng.random::<bool>() { 1.0 } else { -1.0 }
}
