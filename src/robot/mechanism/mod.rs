//! What simulators of joints tend to leave out: one file each, one row each in [`MECHANISMS`].

mod backlash;
mod cogging;
mod compliance;
mod constant_load;
mod coulomb_friction;
mod cubic_stiffness;
mod end_stop;
mod hysteresis;
mod load_friction;
mod payload_change;
mod quadratic_drag;
mod second_mass;
mod spring;
mod stiffness;
mod stribeck_friction;
#[cfg(test)]
mod trial;

pub use backlash::Backlash;
pub use cogging::Cogging;
pub use compliance::Compliance;
pub use constant_load::ConstantLoad;
pub use coulomb_friction::CoulombFriction;
pub use cubic_stiffness::CubicStiffness;
pub use end_stop::EndStop;
pub use hysteresis::Hysteresis;
pub use load_friction::LoadFriction;
pub use payload_change::PayloadChange;
pub use quadratic_drag::QuadraticDrag;
pub use stiffness::Stiffness;
pub use stribeck_friction::StribeckFriction;

use super::Joint;
use crate::sim2real::Registry;
use crate::sim2real::mechanism::{ActuatorLag, Bias, CommandDelay, DeadZone, Saturation};

/// The joint's registry.
pub static MECHANISMS: Registry<Joint> = &[
    &CommandDelay { longest: 0.5, starts: &[0.004, 0.02, 0.08], smooth: true },
    &DeadZone,
    &Saturation,
    &ActuatorLag,
    &Backlash,
    &ConstantLoad,
    &CoulombFriction,
    &StribeckFriction,
    &LoadFriction,
    &QuadraticDrag,
    &Stiffness,
    &CubicStiffness,
    &Cogging,
    &PayloadChange,
    &EndStop,
    &Compliance,
    &Hysteresis,
    &Bias,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{Axis, Commands};
    use crate::sim2real::{Measured, Recording, check_mechanism};

    #[test]
    fn every_row_keeps_the_contract() {
        let time: Vec<f64> = (0..1_000).map(|i| f64::from(i) * 4e-3).collect();
        let samples = time.iter().map(|t| Some(0.5 * (2.0 * t).sin())).collect();
        let recording = Recording {
            name: "swing".into(),
            stimulus: Commands(time.iter().map(|t| 2.0 * (2.0 * t).sin() + (7.0 * t).cos()).collect()),
            measured: vec![Measured { channel: "position".into(), unit: "rad".into(), samples }],
            time,
        };
        let arm = Joint::new(Axis::Rotary, [0.11, 0.25, 2.7, 1.0], [0.2, 0.2, 0.2, 0.0]);
        for mechanism in MECHANISMS {
            check_mechanism(*mechanism, &arm, MECHANISMS, &recording).unwrap();
        }
    }
}
