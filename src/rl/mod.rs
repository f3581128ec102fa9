//! Environments for reinforcement learning: what they are, how they are stepped, and what stands between learner and environment.
//!
//! It knows no joint and no order: environments are in `robot::env` and `market::env`.

mod about;
mod env;
mod episodes;
mod error;
mod options;
mod registry;
mod space;
mod stream;
mod threads;
mod vector;

pub use about::{About, InfoChannel};
pub use env::{Each, Env, Step};
pub use episodes::Episodes;
pub use error::EnvError;
pub use options::{Occasion, OptionAbout, OptionKind, OptionValue, Options};
pub use registry::{EnvEntry, EnvRegistry};
pub use space::{Actions, BoxSpace, Space};
pub use stream::{Episode, Stream, StreamName};
pub use threads::Threads;
pub use vector::{Buffers, Out, VecEnv, Which, alike};
