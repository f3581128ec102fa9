//! Environments by their ids.

use super::{About, EnvError, Options, VecEnv};

/// An environment that was made, or why it could not be.
pub type Made = Result<Box<dyn VecEnv>, EnvError>;

/// An environment that can be made by its id: a row of a domain's slice `ENVIRONMENTS`.
#[derive(Debug, Clone, Copy)]
pub struct EnvEntry {
    /// Its id, as `trueup/CartPole-v0`.
    pub id: &'static str,
    /// What has to be done in it, in one line.
    pub about: &'static str,
    /// Makes one of so many lanes with these options, those of [`Occasion::Make`](super::Occasion::Make).
    pub make: fn(lanes: usize, options: &Options) -> Made,
}

/// Environments by their ids.
pub type EnvRegistry = &'static [EnvEntry];

impl EnvEntry {
    /// What the environment is, with nominal options.
    ///
    /// # Errors
    /// What it cannot be made for.
    pub fn describe(&self) -> Result<About, EnvError> {
        Ok((self.make)(1, &Options::new())?.about().clone())
    }
}
