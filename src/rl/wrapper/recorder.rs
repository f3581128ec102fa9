//! Episodes as they were, kept as columns.

use super::layer::Layer;
use crate::rl::{About, Actions, EnvError, Episode, Episodes, Out, Space, Which};

/// Keeps every episode, until they are [taken](Self::take): what was observed, done, rewarded and ended, as seen where this layer is.
///
/// An episode that is reset before its end is kept too, as truncated at its last step. One of no step is not kept.
#[derive(Debug, Clone)]
pub struct Recorder {
    size: usize,
    discrete: bool,
    lanes: Vec<Recorded>,
    ended: Vec<Recorded>,
}

/// An episode that was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// The lane it was in.
    pub lane: usize,
    /// Seed of the lane, and number of the episode.
    pub episode: Episode,
    /// What was observed, shape (steps + 1, size), row after row: first at the reset.
    pub observations: Vec<f32>,
    /// What was done, shape (steps, size of an action).
    pub actions: RecordedActions,
    /// Rewards, one a step.
    pub rewards: Vec<f64>,
    /// Whether the episode terminated, one a step.
    pub terminated: Vec<bool>,
    /// Whether it was cut off, one a step.
    pub truncated: Vec<bool>,
    over: bool,
}

/// Actions of an episode, row after row.
#[derive(Debug, Clone, PartialEq)]
pub enum RecordedActions {
    /// Real numbers.
    Continuous(Vec<f32>),
    /// Choices.
    Discrete(Vec<i64>),
}

impl Recorded {
    fn begin(lane: usize, episode: Episode, observation: &[f32], discrete: bool) -> Self {
        let actions = if discrete { RecordedActions::Discrete(Vec::new()) } else { RecordedActions::Continuous(Vec::new()) };
        let (rewards, terminated, truncated) = (Vec::new(), Vec::new(), Vec::new());
        Self { lane, episode, observations: observation.to_vec(), actions, rewards, terminated, truncated, over: false }
    }

    /// Number of steps.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.rewards.len()
    }
}

impl Recorder {
    /// Keeps episodes.
    #[must_use]
    pub fn new() -> Self {
        Self { size: 0, discrete: false, lanes: Vec::new(), ended: Vec::new() }
    }

    /// The episodes that have ended since they were last taken, in the order in which they ended.
    pub fn take(&mut self) -> Vec<Recorded> {
        std::mem::take(&mut self.ended)
    }

    /// The episodes that are under way and have a step, cut off where they are. They begin anew at the next reset.
    pub fn take_unfinished(&mut self) -> Vec<Recorded> {
        let mut taken = Vec::new();
        for one in &mut self.lanes {
            cut(one);
            if !one.over && one.steps() > 0 {
                taken.push(Recorded { over: true, ..one.clone() });
            }
            one.over = true;
        }
        taken
    }
}

impl Default for Recorder {
    fn default() -> Self {
        Self::new()
    }
}

/// Marks the last step of an episode that is not over as cut off.
fn cut(one: &mut Recorded) {
    if let (false, Some(last)) = (one.over, one.truncated.last_mut()) {
        *last = true;
    }
}

impl Layer for Recorder {
    const NAME: &'static str = "a recorder";

    fn prepare(&mut self, about: &mut About, lanes: usize) -> Result<(), EnvError> {
        self.size = about.observation.size();
        self.discrete = !matches!(about.action, Space::Box(_));
        let none = |lane| Recorded { over: true, ..Recorded::begin(lane, Episode::default(), &[], self.discrete) };
        self.lanes = (0..lanes).map(none).collect();
        Ok(())
    }

    fn begin(&mut self, which: Which<'_>, episodes: &Episodes, observations: &mut [f32]) {
        for lane in which.iter(self.lanes.len()) {
            let row = &observations[lane * self.size..][..self.size];
            let new = Recorded::begin(lane, episodes.lane(lane), row, self.discrete);
            let mut old = std::mem::replace(&mut self.lanes[lane], new);
            if !old.over && old.steps() > 0 {
                cut(&mut old);
                self.ended.push(Recorded { over: true, ..old });
            }
        }
    }

    fn sense(&mut self, given: Actions<'_>, out: &mut Out<'_>) {
        let action = given.len() / self.lanes.len().max(1);
        for (lane, one) in self.lanes.iter_mut().enumerate() {
            if one.over {
                continue;
            }
            one.observations.extend_from_slice(&out.observations[lane * self.size..][..self.size]);
            match (&mut one.actions, given) {
                (RecordedActions::Continuous(kept), given) => {
                    kept.extend_from_slice(given.lanes(lane, 1, action).continuous())
                }
                (RecordedActions::Discrete(kept), given) => kept.extend_from_slice(given.lanes(lane, 1, action).discrete()),
            }
            one.rewards.push(out.rewards[lane]);
            one.terminated.push(out.terminated[lane]);
            one.truncated.push(out.truncated[lane]);
            if out.terminated[lane] || out.truncated[lane] {
                one.over = true;
                self.ended.push(one.clone());
            }
        }
    }

    fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        let source = other.map_or_else(|| self.lanes[from].clone(), |other| other.lanes[from].clone());
        self.lanes[to] = Recorded { lane: to, ..source };
    }
}

#[cfg(test)]
mod tests {
    use super::super::{TimeLimit, Wrap};
    use super::*;
    use crate::rl::walk::{Push, Walk};
    use crate::rl::{Autoreset, AutoresetMode, Buffers, Options, VecEnv};

    #[test]
    fn episodes_are_kept_as_they_were_and_a_lane_that_is_over_adds_nothing() {
        let recorder = Push::new(2).with(Recorder::new()).unwrap();
        let mut env = Autoreset::new(recorder, AutoresetMode::NextStep);
        let mut buffers = Buffers::of(env.env());
        env.reset(Which::All, Some(&[5, 6]), &Options::new(), &mut buffers.observations).unwrap();
        for step in 0..5 {
            // Up all the time; and down twice, then up.
            env.step(Actions::Discrete(&[1, i64::from(step > 1)]), &mut buffers.out()).unwrap();
        }
        let ended = env.env_mut().layer_mut().take();
        assert_eq!(ended.len(), 1);
        let one = &ended[0];
        assert_eq!((one.lane, one.episode, one.steps()), (0, Episode { seed: 5, number: 0 }, 3));
        assert_eq!(one.observations, [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(one.actions, RecordedActions::Discrete(vec![1, 1, 1]));
        assert_eq!(one.rewards, [1.0, 2.0, 3.0]);
        assert_eq!((one.terminated.as_slice(), one.truncated.as_slice()), (&[false, false, true][..], &[false; 3][..]));
        // What is under way: one step of the next episode, and five of the other lane.
        let cut = env.env_mut().layer_mut().take_unfinished();
        assert_eq!(cut.iter().map(|one| (one.episode.number, one.steps())).collect::<Vec<_>>(), [(1, 1), (0, 5)]);
        assert_eq!(cut[1].observations, [0.0, -1.0, -2.0, -1.0, 0.0, 1.0]);
        assert_eq!(cut[1].truncated, [false, false, false, false, true]);
        assert!(env.env_mut().layer_mut().take().is_empty() && env.env_mut().layer_mut().take_unfinished().is_empty());
    }

    #[test]
    fn an_episode_that_is_reset_before_its_end_is_kept_as_cut_off() {
        let mut env = Walk::new(1).with(TimeLimit::new(9)).unwrap().with(Recorder::new()).unwrap();
        let mut buffers = Buffers::of(&env);
        env.reset(Which::All, Some(&[5]), &Options::new(), &mut buffers.observations).unwrap();
        env.reset(Which::All, None, &Options::new(), &mut buffers.observations).unwrap();
        env.step(Actions::Continuous(&[0.5]), &mut buffers.out()).unwrap();
        env.step(Actions::Continuous(&[0.25]), &mut buffers.out()).unwrap();
        env.reset(Which::All, Some(&[7]), &Options::new(), &mut buffers.observations).unwrap();
        let ended = env.layer_mut().take();
        assert_eq!(ended.len(), 1);
        assert_eq!((ended[0].episode, ended[0].steps()), (Episode { seed: 5, number: 1 }, 2));
        assert_eq!(ended[0].actions, RecordedActions::Continuous(vec![0.5, 0.25]));
        assert_eq!(ended[0].truncated, [false, true]);
    }
}
