//! The core: what a simulator and a recording have to do with each other, whatever they are of. It knows no joint and
//! no order.
//!
//! ```text
//! Recording -> identify -> diagnose (where, name, model, prove) -> Diagnosis -> trued twin
//! ```

mod any_twin;
mod assembly;
mod check;
mod check_lanes;
mod controller;
pub mod diagnose;
mod elementary;
mod follow;
pub mod identify;
mod lane;
mod lane_run;
pub mod mechanism;
pub(crate) mod normal_draw;
mod parameter;
mod plant;
pub mod randomize;
mod recording;
pub mod regime;
mod residual;
mod run;
mod seed;
mod simulator;
pub(crate) mod split_mix;
mod time;

pub use assembly::{Assembly, Registry};
pub use check::{Violation, check_mechanism, check_plant};
pub use check_lanes::check_lanes;
pub use controller::{Controller, DerivativeOf, Feedback, Pid};
pub use lane::{LaneChange, LaneDraws, LaneImage};
pub(crate) use lane_run::law_parameters;
pub use lane_run::{LaneDynamics, LaneRun, LoopIsClosed};
pub use mechanism::{About, Form, Law, Mechanism, Scene, Signs, Site};
pub use parameter::{Parameter, Thetas};
pub use plant::{Channel, Clock, Command, Covariate, DelayLine, Dynamics, Observation, Plant, Stimulus, Typical};
pub use recording::{Measured, Part, Recording, Simulated, Trajectory};
pub use residual::ChannelWeight;
pub use run::Run;
pub use seed::{Draws, Seed};
pub use simulator::{Candidate, Simulator, Twin};
pub use split_mix::SplitMix64;
pub use time::{NotAnInstant, Tick, Ticks, Timestamp, written_instant};
