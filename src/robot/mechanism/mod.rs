//! What simulators of robots tend to leave out: one file each, one row each in the registries of the plants they act on.

mod constant_load;
mod coulomb_friction;
mod overflow;
mod quadratic_drag;
mod stiffness;

pub use constant_load::ConstantLoad;
pub use coulomb_friction::CoulombFriction;
pub use overflow::Overflow;
pub use quadratic_drag::QuadraticDrag;
pub use stiffness::Stiffness;

use super::{CartPole, Joint, Tanks};
use crate::sim2real::Registry;
use crate::sim2real::mechanism::{ActuatorLag, Bias, CommandDelay, DeadZone, Saturation};

/// The rows of a plant's registry. The same generic rows stand in each, and Rust has no generic statics: written out, every
/// new mechanism would have to be listed once a plant.
macro_rules! rows {
    // A plant with a coordinate that moves, and what it has beside that.
    (motion $($own:expr),*) => {
        rows!(signals &ConstantLoad, &CoulombFriction, &QuadraticDrag, &Stiffness $(, $own)*)
    };
    // Any plant whose commands and observations are signals, with its own rows between theirs.
    (signals $($own:expr),*) => {
        &[
            &CommandDelay { longest: 0.5, starts: &[0.004, 0.02, 0.08], smooth: true },
            &DeadZone,
            &Saturation,
            &ActuatorLag,
            $($own,)*
            &Bias,
        ]
    };
}

/// The joint's registry.
pub static MECHANISMS: Registry<Joint> = rows!(motion);

/// The registry of a cart with a pole: mechanisms of motion act on the cart.
pub static CART_POLE_MECHANISMS: Registry<CartPole> = rows!(motion);

/// The registry of two tanks.
pub static TANKS_MECHANISMS: Registry<Tanks> = rows!(signals & Overflow);

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
