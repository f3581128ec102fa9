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
use crate::sim2real::mechanism::{
    ActuatorLag, Bias, CommandDelay, DeadZone, Drift, Dropout, Eccentricity, GainError, Noise, ObservationDelay,
    Quantization, RateLimit, Rectification, Saturation, Scale, ThermalDerating,
};

/// The joint's registry.
pub static MECHANISMS: Registry<Joint> = &[
    &CommandDelay { longest: 0.5, starts: &[0.004, 0.02, 0.08], smooth: true },
    &DeadZone,
    &Saturation,
    &ActuatorLag,
    &RateLimit,
    &ThermalDerating,
    &GainError,
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
    &Drift,
    &Scale,
    &Quantization,
    &Rectification,
    &Eccentricity,
    // The rate of a joint's position is its velocity.
    &ObservationDelay { longest: 0.5, starts: &[0.004, 0.02, 0.08], rates: &[(0, 1)] },
    &Dropout,
    &Noise,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{Axis, Commands};
    use crate::sim2real::{Assembly, Measured, Mechanism, Recording, Seed, Simulator, Thetas, check_mechanism};

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

    #[test]
    fn only_what_turns_can_be_eccentric() {
        let applies = |axis| Eccentricity.applies(0, &Joint::new(axis, [1.0; 4], [0.0; 4]), &Commands::default());
        assert!(applies(Axis::Rotary) && !applies(Axis::Linear));
    }

    /// A run that starts in the middle of a recording, from the state the whole had there, is as warm as the whole.
    #[test]
    fn heat_is_not_lost_between_windows() {
        let time: Vec<f64> = (0..3_000).map(|i| f64::from(i) * 4e-3).collect();
        let stimulus = Commands(time.iter().map(|t| 1.0 + (3.0 * t).sin()).collect());
        let recording = Recording { name: "push".into(), stimulus, measured: vec![], time };
        let plant = Joint::new(Axis::Rotary, [0.1, 0.5, 0.0, 1.0], [0.0; 4]);
        let form = Mechanism::<Joint>::forms(&ThermalDerating, &Default::default())[0].parameters.clone();
        let warm = Assembly::new(plant, MECHANISMS).with_mechanism(&ThermalDerating, 0, form);
        let follow = |initial: [f64; 2], rows| {
            let thetas = Thetas::single(&[0.1, 0.5, 0.0, 1.0, 0.02, 30.0, initial[0], initial[1]]);
            warm.rollout(&thetas, &recording, rows, Seed(0)).remove(0)
        };
        let whole = follow([0.0, 0.0], 0..3_000);
        let middle = follow([whole[0].samples[2_000], whole[1].samples[2_000]], 2_000..3_000);
        let apart = middle[0].samples.iter().zip(&whole[0].samples[2_000..]).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-9);
    }
}
