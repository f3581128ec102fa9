//! Robots: plants that move, and what their simulators tend to leave out.

mod cart_pole;
mod cart_pole_lane;
pub mod env;
mod equations;
mod estimate;
mod joint;
pub mod mechanism;
mod mover;
mod pendulum;
mod preset;
mod runge_kutta;
mod signal;
mod sine;
mod tanks;
#[cfg(feature = "io")]
mod twin;

pub use cart_pole::{CartPole, CartPoleDynamics, CartPoleView, Integration};
pub use env::ENVIRONMENTS;
pub use equations::{
    Attachment, Driving, EquationError, EquationSystem, Equations, EquationsDynamics, InputVariable, Measurements,
    OutputVariable, Outputs, StateVariable,
};
pub use joint::{Axis, Joint, JointDynamics, Posture};
pub use mechanism::{CART_POLE_MECHANISMS, EQUATIONS_MECHANISMS, MECHANISMS, PENDULUM_MECHANISMS, TANKS_MECHANISMS};
pub use mover::{Motion, Mover, Push};
pub use pendulum::{Pendulum, PendulumDynamics};
pub use preset::presets as robot_presets;
pub use signal::{Commands, Signal};
pub use tanks::{Level, Levels, Rims, Tanks, TanksDynamics};
#[cfg(feature = "io")]
use twin::assembly as twin_assembly;
#[cfg(feature = "io")]
pub use twin::{
    cart_pole_assembly, cart_pole_recordings, equations_assembly, equations_recordings, joint_assembly, joint_recordings,
    tanks_assembly, tanks_recordings, unread_columns,
};
