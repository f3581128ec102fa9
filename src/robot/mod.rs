//! Robots: plants that move, and what their simulators tend to leave out.

mod joint;
pub mod mechanism;
#[cfg(feature = "io")]
mod twin;

pub use joint::{Axis, Commands, Joint, JointDynamics, JointEffect, JointState, Posture, Torque};
pub use mechanism::MECHANISMS;
#[cfg(feature = "io")]
pub use twin::{joint_assembly, joint_recordings};
