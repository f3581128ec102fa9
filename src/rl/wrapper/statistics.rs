//! What episodes came to.

use super::layer::{Layer, copy_row};
use super::moments::Moments;
use crate::rl::{About, Actions, EnvError, Episodes, InfoChannel, Out, Which};

/// Tells the return and length of the episode each lane is in, or has just ended, by info channels `episode_return` and
/// `episode_length` [steps]; counts ended episodes; and keeps running moments of what was observed, for learners that normalize.
#[derive(Debug, Clone)]
pub struct EpisodeStatistics {
    returns: Vec<f64>,
    lengths: Vec<u32>,
    /// Whether an episode is over, and another step of its lane is none.
    over: Vec<bool>,
    totals: EpisodeTotals,
    observing: bool,
    observations: Moments,
}

/// Ended episodes over all lanes.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeTotals {
    /// Of returns.
    pub returns: Moments,
    /// Of lengths [steps].
    pub lengths: Moments,
}

impl Default for EpisodeTotals {
    fn default() -> Self {
        Self { returns: Moments::new(1), lengths: Moments::new(1) }
    }
}

impl EpisodeTotals {
    /// Adds those of `other`, as of another thread.
    pub fn merge(&mut self, other: &Self) {
        self.returns.merge(&other.returns);
        self.lengths.merge(&other.lengths);
    }
}

impl EpisodeStatistics {
    /// Of episodes alone.
    #[must_use]
    pub fn new() -> Self {
        Self {
            returns: Vec::new(),
            lengths: Vec::new(),
            over: Vec::new(),
            totals: EpisodeTotals::default(),
            observing: false,
            observations: Moments::new(0),
        }
    }

    /// The same, and of all that is observed.
    #[must_use]
    pub fn observing(self) -> Self {
        Self { observing: true, ..self }
    }

    /// Episodes that have ended.
    #[must_use]
    pub fn totals(&self) -> &EpisodeTotals {
        &self.totals
    }

    /// Moments of what was observed, with that at resets, if they are kept.
    #[must_use]
    pub fn observations(&self) -> &Moments {
        &self.observations
    }
}

impl Default for EpisodeStatistics {
    fn default() -> Self {
        Self::new()
    }
}

impl Layer for EpisodeStatistics {
    const NAME: &'static str = "statistics of episodes";

    fn prepare(&mut self, about: &mut About, lanes: usize) -> Result<(), EnvError> {
        about.info.push(InfoChannel::new("episode_return", ""));
        about.info.push(InfoChannel::new("episode_length", "steps"));
        self.observations = Moments::new(about.observation.size());
        self.returns = vec![0.0; lanes];
        self.lengths = vec![0; lanes];
        self.over = vec![true; lanes];
        Ok(())
    }

    fn begin(&mut self, which: Which<'_>, _: &Episodes, observations: &mut [f32]) {
        for lane in which.iter(self.over.len()) {
            (self.returns[lane], self.lengths[lane], self.over[lane]) = (0.0, 0, false);
        }
        if self.observing {
            self.observations.add_rows(observations, |lane| which.has(lane));
        }
    }

    fn sense(&mut self, _: Actions<'_>, out: &mut Out<'_>) {
        if self.observing {
            self.observations.add_rows(out.observations, |lane| !self.over[lane]);
        }
        for lane in 0..self.over.len() {
            if self.over[lane] {
                continue;
            }
            self.returns[lane] += out.rewards[lane];
            self.lengths[lane] = self.lengths[lane].saturating_add(1);
            if out.terminated[lane] || out.truncated[lane] {
                self.over[lane] = true;
                self.totals.returns.add(&[self.returns[lane]]);
                self.totals.lengths.add(&[self.lengths[lane].into()]);
            }
        }
    }

    fn info(&self, channel: usize, values: &mut [f64]) {
        match channel {
            0 => values.copy_from_slice(&self.returns),
            _ => values.iter_mut().zip(&self.lengths).for_each(|(value, length)| *value = (*length).into()),
        }
    }

    fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        copy_row(&mut self.returns, other.map(|other| other.returns.as_slice()), 1, from, to);
        copy_row(&mut self.lengths, other.map(|other| other.lengths.as_slice()), 1, from, to);
        copy_row(&mut self.over, other.map(|other| other.over.as_slice()), 1, from, to);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Wrap;
    use super::*;
    use crate::rl::walk::Push;
    use crate::rl::{Buffers, Options, VecEnv};

    #[test]
    fn an_episode_is_counted_once_with_its_return_and_length() {
        let mut env = Push::new(2).with(EpisodeStatistics::new().observing()).unwrap();
        let mut buffers = Buffers::of(&env);
        env.reset(Which::All, Some(&[1, 2]), &Options::new(), &mut buffers.observations).unwrap();
        // Lane 0 counts up to 3 and ends; lane 1 goes up and down.
        for step in 0..6 {
            env.step(Actions::Discrete(&[1, i64::from(step % 2 == 0)]), &mut buffers.out()).unwrap();
        }
        let told = |env: &dyn VecEnv, name: &str| {
            let mut values = vec![0.0; env.lanes()];
            env.info(env.about().channel(name).unwrap(), &mut values);
            values
        };
        assert_eq!(told(&env, "episode_return"), [6.0, 3.0]);
        assert_eq!(told(&env, "episode_length"), [3.0, 6.0]);
        // The channel of the environment within is where it was.
        assert_eq!(told(&env, "taken"), [3.0, 6.0]);
        let totals = env.layer().totals();
        assert_eq!((totals.returns.count(), totals.returns.mean(), totals.lengths.mean()), (1, &[6.0][..], &[3.0][..]));
        // Two first observations, three steps of lane 0, six of lane 1.
        assert_eq!(env.layer().observations().count(), 11);
        assert!((env.layer().observations().mean()[0] - 9.0 / 11.0).abs() < 1e-12);
        env.reset(Which::Mask(&[true, false]), None, &Options::new(), &mut buffers.observations).unwrap();
        assert_eq!(told(&env, "episode_length"), [0.0, 6.0]);
        let mut merged = env.layer().totals().clone();
        merged.merge(env.layer().totals());
        assert_eq!((merged.returns.count(), merged.returns.mean()), (2, &[6.0][..]));
    }
}
