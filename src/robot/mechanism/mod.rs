//! What simulators of robots tend to leave out: one file each, one row each in the registries of the plants they act on.

mod backlash;
mod cogging;
mod compliance;
mod constant_load;
mod coulomb_friction;
mod cubic_stiffness;
mod drawn;
mod end_stop;
mod hysteresis;
mod inertia_curve;
mod load_friction;
mod overflow;
mod payload_change;
mod quadratic_drag;
mod second_mass;
mod spring;
mod stiffness;
mod stribeck_friction;
#[cfg(test)]
mod trial;
mod velocity_curve;

pub use backlash::Backlash;
pub use cogging::Cogging;
pub use compliance::Compliance;
pub use constant_load::ConstantLoad;
pub use coulomb_friction::CoulombFriction;
pub use cubic_stiffness::CubicStiffness;
pub use end_stop::EndStop;
pub use hysteresis::Hysteresis;
pub use inertia_curve::InertiaCurve;
pub use load_friction::LoadFriction;
pub use overflow::Overflow;
pub use payload_change::PayloadChange;
pub use quadratic_drag::QuadraticDrag;
pub use stiffness::Stiffness;
pub use stribeck_friction::StribeckFriction;
pub use velocity_curve::VelocityCurve;

use super::{CartPole, Equations, Joint, Pendulum, Tanks};
use crate::sim2real::Registry;
use crate::sim2real::mechanism::{
    ActuatorLag, Bias, CommandDelay, DeadZone, Drift, Dropout, Eccentricity, GainError, Noise, ObservationDelay,
    Quantization, RateLimit, Rectification, SamplingLead, Saturation, Scale, ThermalDerating, VelocityFilter,
    rate_of_the_first,
};

/// The rows of a plant's registry: its delays and lags, which of its channels are rates of others, and its own rows. The same generic
/// rows stand in each, and Rust has no generic statics: written out, every new mechanism would have to be listed once a
/// plant.
macro_rules! rows {
    // A plant that is sampled by the millisecond, and has rates.
    (servo, rates $rates:expr) => {
        rows!(
            motion, delays OF_SERVOS, lags LAGS_OF_SERVOS, rates $rates,
            of_rates [&SamplingLead { rates: $rates }, &VelocityFilter { rates: $rates }]
        )
    };
    // A plant with a coordinate that moves, and what there is of its rates alone.
    (motion, delays $delays:expr, lags $lags:expr, rates $rates:expr, of_rates [$($of_rates:expr),*]) => {
        rows!(
            signals, delays $delays, lags $lags, rates $rates,
            plant [
                &Backlash, &ConstantLoad, &CoulombFriction, &StribeckFriction, &LoadFriction, &QuadraticDrag, &Stiffness,
                &CubicStiffness, &Cogging, &PayloadChange, &EndStop, &Compliance, &Hysteresis, &VelocityCurve,
                &InertiaCurve
            ],
            sensor [
                &Rectification { rate: rate_of_the_first($rates) }, &Eccentricity { rate: rate_of_the_first($rates) }
                $(, $of_rates)*
            ]
        )
    };
    // Any plant whose commands and observations are signals.
    (
        signals, delays $delays:expr, lags $lags:expr, rates $rates:expr, plant [$($own:expr),*], sensor [$($read:expr),*]
    ) => {
        &[
            &CommandDelay { longest: $delays.0, starts: $delays.1, holds: true },
            &DeadZone,
            &Saturation,
            &ActuatorLag { longest: $lags.0, starts: $lags.1 },
            &RateLimit,
            &ThermalDerating,
            &GainError,
            $($own,)*
            &Bias,
            &Drift { rate: rate_of_the_first($rates) },
            &Scale { rate: rate_of_the_first($rates) },
            &Quantization,
            $($read,)*
            &ObservationDelay { longest: $delays.0, starts: $delays.1, rates: $rates },
            &Dropout,
            &Noise,
        ]
    };
}

/// Longest delay [s], and where fits of delays begin [s].
type Delays = (f64, &'static [f64]);
/// Of what is sampled by the millisecond.
const OF_SERVOS: Delays = (0.5, &[0.004, 0.02, 0.08]);
/// Of what is sampled by the second.
const OF_PROCESSES: Delays = (120.0, &[1.0, 4.0, 16.0]);

/// Of what may be either.
const OF_ANYTHING: Delays = (120.0, &[0.004, 0.02, 0.08, 1.0, 4.0]);

/// The same of lags: time constants rather than dead times.
const LAGS_OF_SERVOS: Delays = (2.0, &[0.01, 0.05]);
const LAGS_OF_PROCESSES: Delays = (480.0, &[2.0, 10.0, 40.0]);
const LAGS_OF_ANYTHING: Delays = (480.0, &[0.01, 0.05, 1.0, 10.0]);

/// Which channels are rates of others: of one coordinate, and of a cart and a pole.
const OF_ONE: &[(usize, usize)] = &[(0, 1)];
const OF_TWO: &[(usize, usize)] = &[(0, 1), (2, 3)];

/// The joint's registry.
pub static MECHANISMS: Registry<Joint> = rows!(servo, rates OF_ONE);

/// The registry of a cart with a pole: mechanisms of motion act on the cart.
pub static CART_POLE_MECHANISMS: Registry<CartPole> = rows!(servo, rates OF_TWO);

/// The registry of a pendulum.
pub static PENDULUM_MECHANISMS: Registry<Pendulum> = rows!(servo, rates OF_ONE);

/// The registry of two tanks: levels are not below 0, and no encoder turns with them.
pub static TANKS_MECHANISMS: Registry<Tanks> =
    rows!(signals, delays OF_PROCESSES, lags LAGS_OF_PROCESSES, rates &[], plant [&Overflow], sensor []);

/// The registry of equations, which may be of anything; mechanisms of motion act where the equations say what moves.
pub static EQUATIONS_MECHANISMS: Registry<Equations> =
    rows!(motion, delays OF_ANYTHING, lags LAGS_OF_ANYTHING, rates &[], of_rates []);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{Axis, Commands};
    use crate::sim2real::{
        Assembly, Measured, Mechanism, Recording, Seed, Simulator, Thetas, Twin, check_lanes, check_mechanism,
    };

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
            check_lanes(*mechanism, &arm, MECHANISMS, &recording).unwrap();
        }
    }

    #[test]
    fn only_what_turns_can_be_eccentric() {
        let disc = Eccentricity { rate: None };
        let applies = |axis| disc.applies(0, &Joint::new(axis, [1.0; 4], [0.0; 4]), &Commands::default());
        assert!(applies(Axis::Rotary) && !applies(Axis::Linear));
    }

    #[test]
    fn what_only_a_velocity_tells_is_tried_where_one_is_measured() {
        let samples = || (0..100).map(|i| Some((0.1 * f64::from(i)).sin())).collect();
        let channel =
            |channel: &str, unit: &str| Measured { channel: channel.into(), unit: unit.into(), samples: samples() };
        let mut recording = Recording {
            name: "swing".into(),
            time: (0..100).map(|i| f64::from(i) * 4e-3).collect(),
            stimulus: Commands(vec![1.0; 100]),
            measured: vec![channel("position", "rad")],
        };
        let twin = Assembly::new(Joint::new(Axis::Rotary, [1.0; 4], [0.2; 4]), MECHANISMS);
        let of_rates = |recording: &Recording<Commands>| {
            let candidates = twin.candidates(std::slice::from_ref(recording));
            let own = candidates.iter().filter(|c| c.about.name == "velocity_filter" || c.form.name.ends_with("with_rate"));
            own.count()
        };
        assert_eq!(of_rates(&recording), 0);
        recording.measured.push(channel("velocity", "rad/s"));
        assert_eq!(of_rates(&recording), 10);
        // A column without a sample is none.
        recording.measured[1].samples.fill(None);
        assert_eq!(of_rates(&recording), 0);
    }

    /// A shaft with dry friction of its motor differs from one with friction of its link where there is friction: found, or modelled.
    #[test]
    fn what_differs_beside_friction_alone_is_sought_at_once_where_friction_is_modelled() {
        let recording = Recording {
            name: "swing".into(),
            time: (0..100).map(|i| f64::from(i) * 4e-3).collect(),
            stimulus: Commands(vec![1.0; 100]),
            measured: vec![],
        };
        let twin = Assembly::new(Joint::new(Axis::Rotary, [1.0; 4], [0.2; 4]), MECHANISMS);
        let beside = |twin: &Assembly<Joint>| {
            let candidates = twin.candidates(std::slice::from_ref(&recording));
            candidates.iter().find(|c| c.form.name == "on_link_motor_friction").map(|c| c.beside)
        };
        assert!(beside(&twin).is_some_and(|others| others.contains(&"load_friction")));
        let stiff = Mechanism::<Joint>::forms(&Stiffness, &Default::default())[0].parameters.clone();
        let twin = twin.with_mechanism(&Stiffness, 0, stiff);
        assert!(beside(&twin).is_some_and(|others| !others.is_empty()));
        let rubbing = Mechanism::<Joint>::forms(&LoadFriction, &Default::default())[0].parameters.clone();
        assert_eq!(beside(&twin.with_mechanism(&LoadFriction, 0, rubbing)), Some::<&[&str]>(&[]));
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
