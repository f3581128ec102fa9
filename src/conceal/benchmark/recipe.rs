//! From a name to an effect: shapes are drawn once, strength is turned until the effect is as large as wanted.

use std::f64::consts::TAU;

use rand::{Rng, RngExt};

use super::arm::{Need, logarithmic, sign};
use super::effect::{Effect, Foreign};
use super::scene::Scales;

/// What registries may have, by its name there.
pub(super) const KNOWN: [&str; 27] = [
    "coulomb_friction",
    "stribeck_friction",
    "load_friction",
    "quadratic_drag",
    "constant_load",
    "stiffness",
    "cubic_stiffness",
    "cogging",
    "payload_change",
    "end_stop",
    "compliance",
    "hysteresis",
    "actuator_lag",
    "dead_zone",
    "saturation",
    "rate_limit",
    "backlash",
    "thermal_derating",
    "command_delay",
    "bias",
    "drift",
    "scale",
    "quantization",
    "rectification",
    "eccentricity",
    "dropout",
    "observation_delay",
];

/// What no registry has.
pub(super) const FOREIGN: [&str; 10] = [
    "moving_inertia",
    "shaking",
    "one_way_friction",
    "warming_oil",
    "eddy_brake",
    "sagging_supply",
    "viscoelastic_memory",
    "clock_wobble",
    "shaken_base",
    "bent_shaft",
];

/// What an arm may have and never show: only what depends on how far, how fast or for how long it is moved.
pub(super) const UNREACHED: [&str; 7] =
    ["end_stop", "saturation", "rate_limit", "cubic_stiffness", "thermal_derating", "payload_change", "quadratic_drag"];

/// Names that one case does not hold both of: they are one thing in two words, or no recording could part them.
const ALIKE: [&[&str]; 5] = [
    &["coulomb_friction", "stribeck_friction", "load_friction", "hysteresis"],
    &["command_delay", "observation_delay"],
    &["compliance", "backlash", "payload_change"],
    &["stiffness", "cubic_stiffness"],
    &["bias", "drift"],
];

/// Whether one case may hold both.
pub(super) fn compatible(one: &str, other: &str) -> bool {
    one != other && !ALIKE.iter().any(|names| names.contains(&one) && names.contains(&other))
}

/// What an arm must be for this to be concealed in it.
pub(super) fn need(id: &str) -> Need {
    Need {
        weighed: ["bias", "scale", "shaken_base", "rectification", "drift"].contains(&id),
        rotary: ["eccentricity", "moving_inertia", "bent_shaft"].contains(&id),
    }
}

/// A shape with its strength left open.
#[derive(Debug, Clone)]
pub(super) struct Recipe {
    pub id: &'static str,
    /// Strengths that make sense.
    pub range: (f64, f64),
    /// Numbers in [0, 1) from which the shape is drawn.
    shape: [f64; 4],
    side: f64,
    bend: f64,
}

impl Recipe {
    pub fn draw(id: &'static str, rng: &mut impl Rng) -> Self {
        Self {
            id,
            range: range(id),
            shape: std::array::from_fn(|_| rng.random()),
            side: sign(rng),
            bend: logarithmic(rng, 3e-4, 1.2e-3),
        }
    }

    /// `low` to `high` by the `k`-th number of the shape.
    fn between(&self, k: usize, low: f64, high: f64) -> f64 {
        low + (high - low) * self.shape[k]
    }

    /// The effect at a strength.
    pub fn at(&self, strength: f64, scales: &Scales) -> Effect {
        let torque = strength * scales.torque;
        let motor_share = self.between(0, 0.3, 0.6);
        let reduced = scales.arm.inertia * motor_share * (1.0 - motor_share);
        let stiff = |frequency: f64| (TAU * frequency).powi(2) * reduced;
        match self.id {
            "coulomb_friction" => self.bristles(torque, torque, 0.0, scales),
            "stribeck_friction" => self.bristles(torque, torque * self.between(0, 1.5, 2.2), 0.0, scales),
            "load_friction" => self.bristles(0.002 * torque, 0.002 * torque, strength, scales),
            "quadratic_drag" => Effect::Drag { coefficient: torque / scales.speed.powf(1.9) },
            "constant_load" => Effect::Pull { torque: self.side * torque, reach: scales.reach },
            "stiffness" => Effect::Spring { rate: torque / scales.reach, reach: 2.0 * scales.reach },
            "cubic_stiffness" => Effect::StiffeningSpring { rate: torque / scales.reach.powi(3), reach: 2.0 * scales.reach },
            "cogging" => Effect::Magnets {
                torque,
                count: if scales.arm.linear {
                    TAU / self.between(0, 0.02, 0.06)
                } else {
                    self.between(0, 4.0, 15.0).floor()
                },
                phase: self.between(1, 0.0, TAU),
                harmonic: self.between(2, 0.1, 0.3),
            },
            "payload_change" => {
                let time = scales.duration * self.between(0, 0.25, 0.75);
                let gravity = scales.arm.gravity_torque * strength * self.between(1, 1.0, 2.5);
                Effect::Load { time, inertia: strength * scales.arm.inertia, gravity }
            }
            "end_stop" => {
                let farthest = if self.side > 0.0 { scales.farthest.1 } else { -scales.farthest.0 };
                // At its usual speed the arm is thrown back within 12 to 30 ms.
                let contact = std::f64::consts::PI / self.between(0, 0.012, 0.03);
                let depth = 0.3 * scales.speed / contact;
                let stiffness = scales.arm.inertia * contact * contact / depth.max(1e-9).sqrt();
                let damping = self.between(1, 0.2, 0.8) / scales.speed;
                Effect::Pad { position: self.side * farthest * (1.0 - strength), side: self.side, stiffness, damping }
            }
            "compliance" => {
                let stiffness = stiff(1.0 / strength.sqrt());
                let damping = 2.0 * self.between(1, 0.02, 0.08) * (stiffness * reduced).sqrt();
                // Harder by a tenth at the twist that the usual torque makes.
                let twist = scales.torque / stiffness;
                Effect::Coupling { motor_share, stiffness, hardening: 0.1 / (twist * twist), damping, gap: 0.0 }
            }
            "backlash" => {
                let stiffness = stiff(80.0);
                let damping = 0.4 * (stiffness * reduced).sqrt();
                Effect::Coupling { motor_share, stiffness, hardening: 0.0, damping, gap: strength * scales.reach }
            }
            "hysteresis" => Effect::Yielding { torque, reach: scales.reach * self.between(0, 0.25, 0.6) },
            "actuator_lag" => {
                let second = self.between(0, 0.2, 0.45);
                Effect::Poles { first: strength * (1.0 - second), second: strength * second }
            }
            "dead_zone" => Effect::Band { width: strength * scales.command },
            "saturation" => Effect::Ceiling { limit: scales.loudest / strength },
            "rate_limit" => Effect::Slew { rate: TAU * scales.command / strength },
            "thermal_derating" => Effect::Heat {
                weakening: strength,
                usual: scales.command,
                winding: self.between(0, 2.0, 6.0),
                housing: self.between(1, 15.0, 50.0),
            },
            "command_delay" => Effect::Bus { delay: strength, jitter: 0.04 * strength },
            _ => self.of_sensor(strength, scales),
        }
    }

    fn of_sensor(&self, strength: f64, scales: &Scales) -> Effect {
        let size = strength * scales.reach;
        match self.id {
            "bias" => Effect::Offset { offset: self.side * size },
            "drift" => {
                let settling = (self.shape[0] < 0.6).then(|| self.between(1, 6.0, 20.0));
                Effect::Creep { size: self.side * size, settling }
            }
            "scale" => Effect::Stretch { excess: self.side * strength, reach: scales.reach },
            "quantization" => Effect::Counts { step: size },
            "rectification" => Effect::Fold { share: strength, rounding: 0.02 * scales.reach },
            "eccentricity" => {
                Effect::Wobble { size: strength, phase: self.between(0, 0.0, TAU), harmonic: self.between(1, 0.05, 0.2) }
            }
            "dropout" => Effect::Bursts { share: strength },
            "observation_delay" => Effect::Late { delay: strength },
            _ => Effect::Foreign(self.foreign(strength, scales)),
        }
    }

    fn foreign(&self, strength: f64, scales: &Scales) -> Foreign {
        let torque = strength * scales.torque;
        let phase = self.between(3, 0.0, TAU);
        match self.id {
            "moving_inertia" => Foreign::MovingInertia { share: strength, phase },
            "shaking" => Foreign::Shaking { torque, frequency: self.between(0, 0.3, 2.5), phase },
            "one_way_friction" => Foreign::OneWay { friction: torque / scales.speed, side: self.side },
            "warming_oil" => Foreign::WarmingOil { friction: torque / scales.speed, time: self.between(0, 3.0, 8.0) },
            "eddy_brake" => Foreign::Brake { torque, peak: scales.speed * self.between(0, 0.4, 1.0) },
            "sagging_supply" => Foreign::Sagging { depth: strength, period: self.between(0, 3.0, 8.0) },
            "viscoelastic_memory" => Foreign::Memory { rate: torque / scales.reach, time: self.between(0, 0.1, 0.6) },
            "clock_wobble" => Foreign::Clock { size: strength, period: self.between(0, 3.0, 9.0) },
            "shaken_base" => Foreign::ShakenBase { share: strength, frequency: self.between(0, 0.5, 3.0) },
            _ => Foreign::BentShaft { friction: torque / scales.speed, phase },
        }
    }

    /// Dry friction whose bristles bend by a part of the arm's usual excursion that no sensor sees.
    fn bristles(&self, sliding: f64, breakaway: f64, load: f64, scales: &Scales) -> Effect {
        let fading = if breakaway > sliding { scales.speed * self.between(1, 0.05, 0.2) } else { 0.05 * scales.speed };
        Effect::Bristles { sliding, breakaway, fading, load, bend: self.bend * scales.reach }
    }
}

/// From hardly there to as much as a machine that still works could have.
fn range(id: &str) -> (f64, f64) {
    match id {
        "coulomb_friction" | "stribeck_friction" | "hysteresis" | "cogging" | "constant_load" | "shaking" => (1e-4, 0.6),
        "load_friction" => (1e-4, 0.45),
        "payload_change" => (1e-3, 1.0),
        "end_stop" => (1e-4, 0.75),
        // Resonances from 70 Hz down to 2.5 Hz.
        "compliance" => (1.0 / (70.0 * 70.0), 1.0 / (2.5 * 2.5)),
        "actuator_lag" => (3e-4, 0.15),
        "command_delay" | "observation_delay" => (1e-4, 0.12),
        "saturation" => (0.03, 4.0),
        "rate_limit" => (5e-3, 8.0),
        "thermal_derating" => (2e-4, 2.0),
        "backlash" => (1e-4, 0.6),
        "rectification" => (1e-3, 1.0),
        "dropout" => (2e-3, 0.5),
        "scale" => (1e-3, 0.5),
        "eccentricity" => (1e-4, 0.5),
        "moving_inertia" | "sagging_supply" | "shaken_base" => (2e-3, 0.75),
        "clock_wobble" => (1e-5, 0.1),
        "dead_zone" | "bias" | "drift" | "quantization" => (1e-4, 0.8),
        // Springs, drag, and frictions that depend on speed.
        _ => (1e-4, 2.0),
    }
}
