//! One environment alone: the simpler trait, for those whose lanes share nothing, and how it becomes lanes.

use super::{About, Actions, EnvError, Episode, Episodes, Options, Out, VecEnv, Which, alike};

/// What a step gives beside the observation.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Step {
    /// Reward.
    pub reward: f64,
    /// Whether the episode ended in a state from which nothing follows.
    pub terminated: bool,
    /// Whether the episode was cut off.
    pub truncated: bool,
}

/// One environment. [`Each`] makes lanes of it.
///
/// # Contract
/// - All randomness comes from the episode given at reset, so that the same episode and the same actions give the same bits.
/// - It is not stepped before its first reset, nor after the end of an episode.
/// - If an error is given, its state is as it was.
/// - A clone goes on with the same bits.
pub trait Env: Clone + Send + 'static {
    /// What the environment is.
    fn about(&self) -> &About;

    /// Begins `episode` and writes what is observed.
    ///
    /// # Errors
    /// An option there is not or that has a value it cannot have; what else it cannot begin with.
    fn reset(&mut self, episode: Episode, options: &Options, observation: &mut [f32]) -> Result<(), EnvError>;

    /// Takes a step by `action`, a single row, and writes what is observed.
    ///
    /// # Errors
    /// [`EnvError::Failed`] if the environment itself fails.
    fn step(&mut self, action: Actions<'_>, observation: &mut [f32]) -> Result<Step, EnvError>;

    /// The value of info channel number `channel`.
    fn info(&self, _channel: usize) -> f64 {
        f64::NAN
    }

    /// The value of privileged parameter number `parameter`.
    fn privileged(&self, _parameter: usize) -> f64 {
        f64::NAN
    }
}

/// Lanes of environments that share nothing.
#[derive(Debug, Clone)]
pub struct Each<E> {
    lanes: Vec<Lane<E>>,
    episodes: Episodes,
    about: About,
}

#[derive(Debug, Clone)]
struct Lane<E> {
    env: E,
    under_way: bool,
}

impl<E: Env> Each<E> {
    /// So many lanes of copies of `env`.
    ///
    /// # Errors
    /// [`EnvError::NoLanes`].
    pub fn new(env: E, lanes: usize) -> Result<Self, EnvError> {
        if lanes == 0 {
            return Err(EnvError::NoLanes);
        }
        let about = env.about().clone();
        Ok(Self { lanes: vec![Lane { env, under_way: false }; lanes], episodes: Episodes::new(lanes), about })
    }

    /// The environment of `lane`.
    #[must_use]
    pub fn lane(&self, lane: usize) -> &E {
        &self.lanes[lane].env
    }

    /// The environment of `lane`, to be changed: what it then does is the caller's.
    pub fn lane_mut(&mut self, lane: usize) -> &mut E {
        &mut self.lanes[lane].env
    }
}

impl<E: Env> VecEnv for Each<E> {
    fn about(&self) -> &About {
        &self.about
    }

    fn lanes(&self) -> usize {
        self.lanes.len()
    }

    fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        let size = self.about.observation.size();
        for lane in which.iter(self.lanes.len()) {
            let one = &mut self.lanes[lane];
            let episode = self.episodes.upcoming(lane, seeds.map(|seeds| seeds[lane]));
            // Options that are refused are refused by the first lane, before any has moved.
            one.env.reset(episode, options, &mut observations[lane * size..][..size]).map_err(|error| error.moved(lane))?;
            one.under_way = true;
            self.episodes.begin_lane(lane, seeds.map(|seeds| seeds[lane]));
        }
        Ok(())
    }

    fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        let (size, action_size) = (self.about.observation.size(), self.about.action.size());
        for (lane, one) in self.lanes.iter_mut().enumerate() {
            if !one.under_way {
                continue;
            }
            let row = &mut out.observations[lane * size..][..size];
            let step = one.env.step(actions.lanes(lane, 1, action_size), row).map_err(|error| error.moved(lane))?;
            one.under_way = !(step.terminated || step.truncated);
            (out.rewards[lane], out.terminated[lane], out.truncated[lane]) = (step.reward, step.terminated, step.truncated);
        }
        Ok(())
    }

    fn info(&self, channel: usize, values: &mut [f64]) {
        values.iter_mut().zip(&self.lanes).for_each(|(value, lane)| *value = lane.env.info(channel));
    }

    fn privileged(&self, parameter: usize, values: &mut [f64]) {
        values.iter_mut().zip(&self.lanes).for_each(|(value, lane)| *value = lane.env.privileged(parameter));
    }

    fn copy_lane(&mut self, from: usize, to: usize) {
        if from != to {
            self.lanes[to] = self.lanes[from].clone();
            self.episodes.copy_lane(from, to);
        }
    }

    fn copy_lane_from(&mut self, other: &dyn VecEnv, from: usize, to: usize) -> Result<(), EnvError> {
        let other = alike(self, other)?;
        self.lanes[to] = other.lanes[from].clone();
        self.episodes.copy_lane_from(&other.episodes, from, to);
        Ok(())
    }
}
