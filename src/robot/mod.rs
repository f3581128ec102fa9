//! Robots: plants that move, and what their simulators tend to leave out.

mod joint;
pub mod mechanism;

pub use joint::{Commands, Joint, JointEffect, JointState, Posture, Torque};
pub use mechanism::MECHANISMS;
