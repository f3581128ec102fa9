//! **trueup** reconciles a simulation with the actual: where a simulation and a real recording differ, it locates the
//! mismatch, says what physics was left out, models it, and shows the fit improve on data it has not seen.
//!
//! One core ([`sim2real`]) serves two thin domains, [`market`] and [`robot`]. Files are read and written by `io` alone,
//! results are shown by [`report`], and [`conceal`] makes recordings in which an effect is hidden, sharing no code with
//! what has to find it.
//!
//! # Example
//! A real arm has dry friction that its simulator does not know of:
//!
//! ```
//! use trueup::robot::{Axis, Commands, Joint, MECHANISMS};
//! use trueup::sim2real::diagnose::{Verdict, diagnose};
//! use trueup::sim2real::{Assembly, Measured, Recording, Seed};
//!
//! // The real arm, integrated by steps of 0.1 ms; an encoder reads it every 10 ms.
//! let time: Vec<f64> = (0..1_000).map(|row| f64::from(row) * 0.01).collect();
//! let commands: Vec<f64> = time.iter().map(|t| 2.0 * (1.3 * t).sin() + (4.1 * t).cos()).collect();
//! let (mut position, mut velocity) = (0.0_f64, 0.0_f64);
//! let mut samples = Vec::new();
//! for command in &commands {
//!     samples.push(Some((position / 1e-3).round() * 1e-3));
//!     for _ in 0..100 {
//!         let torque = command - 0.22 * velocity - 2.6 * position.sin();
//!         let free: f64 = velocity + 1e-4 * torque / 0.12;
//!         velocity = free.signum() * (free.abs() - 1e-4 * 0.3 / 0.12).max(0.0); // dry friction of 0.3 N m
//!         position += 1e-4 * velocity;
//!     }
//! }
//! let position = Measured { channel: "position".into(), unit: "rad".into(), samples };
//! let recording = [Recording { name: "arm".into(), time, stimulus: Commands(commands), measured: vec![position] }];
//!
//! // Its simulator: inertia, viscous friction, gravity torque and gain, the first three known to 20 %.
//! let arm = Joint::new(Axis::Rotary, [0.11, 0.25, 2.7, 1.0], [0.2, 0.2, 0.2, 0.0]);
//! let outcome = diagnose(&Assembly::new(arm, MECHANISMS), &recording, &[], Seed(0), &|_, _, _| {});
//!
//! let diagnosis = outcome.diagnosis;
//! assert_eq!(diagnosis.verdict, Verdict::Named);
//! // What needs no fit to be seen comes first: the steps of the encoder.
//! let [quantization, friction] = diagnosis.effects.as_slice() else { panic!("two effects") };
//! assert_eq!((quantization.mechanism.as_str(), friction.mechanism.as_str()), ("quantization", "coulomb_friction"));
//! let torque = &friction.parameters["torque"];
//! assert!((torque.value - 0.3).abs() < 0.02);
//! assert!(diagnosis.fit[0].trued_rmse < 0.1 * diagnosis.fit[0].recalibrated_rmse);
//! ```

#![deny(missing_docs)]
#![forbid(unsafe_code)]

#[cfg(feature = "cli")]
pub mod cli;
pub mod conceal;
#[cfg(feature = "io")]
pub mod io;
pub mod market;
pub mod proof;
pub mod report;
pub mod rl;
pub mod robot;
pub mod sim2real;
#[path = "../strategies/mod.rs"]
pub mod strategies;
