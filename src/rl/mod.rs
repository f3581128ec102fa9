//! Environments for reinforcement learning: what they are, how they are stepped, and what stands between learner and environment.
//!
//! It knows no joint and no order: environments are in `robot::env` and `market::env`.
//!
//! # Example
//! An environment of one's own, in four lanes, with a late and noisy sensor:
//!
//! ```
//! use trueup::rl::wrapper::{Latency, ObservationLatency, ObservationNoise};
//! use trueup::rl::{
//!     About, Actions, AutoresetMode, BoxSpace, Buffers, Checked, Each, Env, EnvError, Episode, Occasion, Options, Space, Step,
//!     StreamName, TimeLimit, Which, Wrap, check_env,
//! };
//!
//! /// A point that is pushed: it should be kept near 0.
//! #[derive(Clone)]
//! struct Point {
//!     about: About,
//!     position: f32,
//! }
//!
//! impl Env for Point {
//!     fn about(&self) -> &About {
//!         &self.about
//!     }
//!
//!     fn reset(&mut self, episode: Episode, options: &Options, observation: &mut [f32]) -> Result<(), EnvError> {
//!         options.check(&self.about.id, &self.about.options, Occasion::Reset)?;
//!         self.position = episode.stream(StreamName::new("start")).between(-1.0, 1.0) as f32;
//!         observation[0] = self.position;
//!         Ok(())
//!     }
//!
//!     fn step(&mut self, action: Actions<'_>, observation: &mut [f32]) -> Result<Step, EnvError> {
//!         self.position = (self.position + 0.1 * action.continuous()[0]).clamp(-2.0, 2.0);
//!         observation[0] = self.position;
//!         Ok(Step { reward: -f64::from(self.position.abs()), ..Step::default() })
//!     }
//! }
//!
//! let observation = BoxSpace::of(&[("position", "m", -2.0, 2.0)]);
//! let action = Space::Box(BoxSpace::of(&[("push", "m", -1.0, 1.0)]));
//! let point = Point { about: About::new("mine/Point-v0", "Stay near 0", observation, action), position: 0.0 };
//! assert!(check_env(|lanes| Ok(Box::new(Each::new(point.clone(), lanes)?)), 100)?.passed());
//!
//! let env = Each::new(point, 4)?
//!     .with(ObservationNoise::new(&[0.01]))?
//!     .with(ObservationLatency::new(Latency::steps(1)))?
//!     .with(TimeLimit::new(200))?;
//! let mut env = Checked::new(env, AutoresetMode::NextStep)?;
//! let mut buffers = Buffers::of(env.env());
//! env.reset(Which::All, Some(&[7, 8, 9, 10]), &Options::new(), &mut buffers.observations)?;
//! for _ in 0..100 {
//!     let actions: Vec<f32> = buffers.observations.iter().map(|position| (-5.0 * position).clamp(-1.0, 1.0)).collect();
//!     env.step(Actions::Continuous(&actions), &mut buffers.out())?;
//! }
//! assert!(buffers.rewards.iter().all(|reward| *reward > -0.1));
//! # Ok::<(), EnvError>(())
//! ```

mod about;
mod autoreset;
mod bits32;
mod check;
mod checked;
mod env;
mod episodes;
mod error;
mod options;
mod registry;
mod space;
mod stream;
mod threads;
mod vector;
#[cfg(test)]
mod walk;
pub mod wrapper;

pub use crate::sim2real::SplitMix64;
pub use about::{About, InfoChannel};
pub use autoreset::{Autoreset, AutoresetMode, Finals, Kept};
pub use bits32::{choices_of_32_bits, rewards_of_32_bits};
pub use check::{EnvReport, Finding, Rule, check_env};
pub use checked::Checked;
pub use env::{Each, Env, Step};
pub use episodes::Episodes;
pub use error::EnvError;
pub use options::{Occasion, OptionAbout, OptionKind, OptionValue, Options};
pub use registry::{EnvEntry, EnvRegistry, Made};
pub use space::{Actions, BoxSpace, Space};
pub use stream::{Episode, StreamName};
pub use threads::Threads;
pub use vector::{Buffers, Out, VecEnv, Which, alike};
pub use wrapper::{TimeLimit, Wrap, Wrapped};
