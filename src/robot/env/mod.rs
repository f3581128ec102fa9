//! Environments of robots: tasks of plants that move, with any mechanisms on.
//!
//! Each is a row of [`ENVIRONMENTS`]. Where nothing else is asked for, they are stepped in blocks of lanes by code that is written
//! for the task alone; with mechanisms, by [`LaneRun`](crate::sim2real::LaneRun), which runs any assembly.

mod cart_pole;
mod cart_pole_lanes;
mod cart_pole_motion;
mod cart_pole_wires;
mod draws;
mod pendulum;
mod pendulum_lanes;
mod row;
mod servo;
mod set_point;
mod setting;
mod simulated;
mod tanks;

pub use cart_pole::cart_pole_env;
pub use draws::Randomization;
pub use pendulum::pendulum_env;
pub use servo::servo_env;
pub use tanks::tanks_env;

use crate::rl::{EnvEntry, EnvRegistry};

/// The environments of robots.
pub static ENVIRONMENTS: EnvRegistry = &[
    EnvEntry { id: cart_pole::ID, about: cart_pole::TITLE, make: cart_pole::make },
    EnvEntry { id: pendulum::ID, about: pendulum::TITLE, make: pendulum::make },
    EnvEntry { id: servo::ID, about: servo::TITLE, make: servo::make },
    EnvEntry { id: tanks::ID, about: tanks::TITLE, make: tanks::make },
];
