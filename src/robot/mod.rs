//! Robots: plants that move, and what their simulators tend to leave out.

mod joint;
pub mod mechanism;
mod mover;
#[cfg(feature = "io")]
mod twin;

pub use joint::{Axis, Commands, Joint, JointDynamics, Posture, Torque};
pub use mechanism::MECHANISMS;
pub use mover::{Motion, Mover, Push};
#[cfg(feature = "io")]
pub use twin::{joint_assembly, joint_recordings};
