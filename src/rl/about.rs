//! What an environment is: its id, its spaces, what it gives out and what can be set of it.

use super::{BoxSpace, OptionAbout, Space};

/// One value a lane that an environment tells beside observation and reward.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InfoChannel {
    /// Its name.
    pub name: String,
    /// Its unit; empty for a pure number.
    pub unit: String,
}

impl InfoChannel {
    /// A channel.
    #[must_use]
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }
}

/// What an environment is. It does not change over its life.
#[derive(Debug, Clone, PartialEq)]
pub struct About {
    /// Its id, as `trueup/CartPole-v0`.
    pub id: String,
    /// What has to be done in it, in one line.
    pub title: String,
    /// What is observed of a lane.
    pub observation: BoxSpace,
    /// What can be done in a lane.
    pub action: Space,
    /// Smallest and largest reward of a step.
    pub reward_range: (f64, f64),
    /// Duration of a step [s]; none where steps are not equally long.
    pub seconds_a_step: Option<f64>,
    /// After how many steps an episode is truncated at the latest; none where it has no such end.
    pub max_steps: Option<u32>,
    /// What is told beside observation and reward, in the order of channels.
    pub info: Vec<InfoChannel>,
    /// Parameters of which each lane has a value of its own that it does not observe (those drawn at random), which a critic may be
    /// shown in training.
    pub privileged: Vec<InfoChannel>,
    /// What can be set when it is made and when it is reset.
    pub options: Vec<OptionAbout>,
}

impl About {
    /// An environment without info, options or end.
    #[must_use]
    pub fn new(id: &str, title: &str, observation: BoxSpace, action: Space) -> Self {
        Self {
            id: id.into(),
            title: title.into(),
            observation,
            action,
            reward_range: (f64::NEG_INFINITY, f64::INFINITY),
            seconds_a_step: None,
            max_steps: None,
            info: Vec::new(),
            privileged: Vec::new(),
            options: Vec::new(),
        }
    }

    /// The number of the info channel called `name`.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.info.iter().position(|channel| channel.name == name)
    }
}
