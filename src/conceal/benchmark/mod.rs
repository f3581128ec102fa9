//! The blind benchmark: joints of every kind, each with something concealed in it, or with nothing.
//!
//! [`draw`] makes case `index` of a seed: an arm, two recordings of it, a twin that is off by some per cent, and the
//! [`Label`] that tells what was concealed. Motion is integrated by fourth-order Runge-Kutta at 0.1 ms or finer; what acts
//! in a `Driver`, a `Load` and a `Sensor` has other functional forms than any registry, and a part of it no registry at all.

mod arm;
mod draw;
mod driver;
mod effect;
mod excitation;
mod label;
mod load;
mod motion;
mod recipe;
mod refit;
mod scene;
mod sensor;
mod size;
mod truth;

pub use arm::Arm;
pub use draw::{Case, draw};
pub use label::Label;

#[cfg(test)]
mod tests;
