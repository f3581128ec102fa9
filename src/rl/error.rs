//! What can go wrong with an environment.

use std::error::Error;

/// Why an environment cannot be made, reset, stepped or copied.
///
/// All but [`Failed`](Self::Failed) are found before anything moves, so that all lanes are as they were.
#[derive(Debug, thiserror::Error)]
pub enum EnvError {
    /// A component of an action is no number, or is out of its space.
    #[error(
        "lane {lane}: action `{component}` is {value}, which is not within [{low}, {high}]\nhint: clip or scale actions to the action space before the step, or wrap the environment so that it clips them"
    )]
    Action {
        /// Lane.
        lane: usize,
        /// Name of the component.
        component: String,
        /// What was given.
        value: f64,
        /// Smallest value.
        low: f64,
        /// Largest value.
        high: f64,
    },
    /// Choices were given where real numbers are asked for, or the other way round.
    #[error("actions are {found}, and `{id}` takes {expected}\nhint: give actions of the environment's action space")]
    ActionKind {
        /// The environment.
        id: String,
        /// What it takes.
        expected: &'static str,
        /// What was given.
        found: &'static str,
    },
    /// A buffer is too long or too short.
    #[error(
        "{what}: {found} numbers, where {expected} are asked for ({lanes} lanes of {size})\nhint: give one row a lane, row after row"
    )]
    Length {
        /// Which buffer.
        what: &'static str,
        /// Its length.
        found: usize,
        /// What its length should be.
        expected: usize,
        /// Number of lanes.
        lanes: usize,
        /// Numbers a lane.
        size: usize,
    },
    /// A step before the first reset.
    #[error(
        "lane {lane} has not been reset, and cannot take a step\nhint: call reset before the first step, and after an environment has failed"
    )]
    NotReset {
        /// Lane.
        lane: usize,
    },
    /// A step after the end of an episode, where lanes are not reset automatically.
    #[error(
        "the episode of lane {lane} is over, and it cannot take a step\nhint: reset it (with a mask, to leave the others under way), or let lanes be reset automatically"
    )]
    Over {
        /// Lane.
        lane: usize,
    },
    /// Anything after the environment was closed.
    #[error("the environment is closed\nhint: make a new one")]
    Closed,
    /// A lane's first reset gives it no seed.
    #[error(
        "lane {lane} has never been given a seed\nhint: give one a lane at the first reset; from one seed s, lane i is given s + i"
    )]
    Unseeded {
        /// Lane.
        lane: usize,
    },
    /// A mask selects no lane.
    #[error("the mask selects none of the {lanes} lanes\nhint: select at least one, or do not reset")]
    NoLane {
        /// Number of lanes.
        lanes: usize,
    },
    /// There is no such lane.
    #[error("there is no lane {lane}: the environment has {lanes}\nhint: lanes are numbered from 0")]
    Lane {
        /// What was asked for.
        lane: usize,
        /// Number of lanes.
        lanes: usize,
    },
    /// There is no such channel of info.
    #[error(
        "there is no info channel {channel}: the environment has {channels}\nhint: channels are numbered from 0, in the order in which the environment lists them"
    )]
    Channel {
        /// What was asked for.
        channel: usize,
        /// Number of channels.
        channels: usize,
    },
    /// An environment without a lane.
    #[error("an environment of 0 lanes has nothing to do\nhint: ask for at least one")]
    NoLanes,
    /// There is no such option.
    #[error("`{id}` has no option `{name}`\nhint: {remedy}")]
    UnknownOption {
        /// The environment.
        id: String,
        /// What was asked for.
        name: String,
        /// The nearest name, or all names.
        remedy: String,
    },
    /// An option has a value it cannot have.
    #[error("option `{name}` is {value}, and must be {must}\nhint: {remedy}")]
    Option {
        /// Name of the option.
        name: String,
        /// What was given.
        value: String,
        /// What it must be.
        must: String,
        /// What to do.
        remedy: String,
    },
    /// A lane of another kind of environment cannot be copied here.
    #[error(
        "a lane of another environment cannot be copied into `{id}`: {why}\nhint: copy between an environment and its clones, or vectors made alike"
    )]
    Unlike {
        /// The environment.
        id: String,
        /// In what they differ.
        why: String,
    },
    /// A wrapper does not go with the environment it is put around.
    #[error("{wrapper} cannot be put around `{id}`: {why}\nhint: {remedy}")]
    Wrapper {
        /// The wrapper.
        wrapper: &'static str,
        /// The environment.
        id: String,
        /// Why not.
        why: String,
        /// What to do.
        remedy: String,
    },
    /// The environment itself failed in the midst of a step or a reset. With one lane, its state is as it was; with more, others
    /// may have moved, and all must be reset.
    #[error("lane {lane}: {why}")]
    Failed {
        /// Lane.
        lane: usize,
        /// What went wrong, with its hint.
        #[source]
        why: Box<dyn Error + Send + Sync>,
    },
}

impl EnvError {
    /// The same of lane `lane`, for one that was found where lanes are not known or are numbered from another.
    #[must_use]
    pub fn moved(mut self, by: usize) -> Self {
        match &mut self {
            Self::Action { lane, .. }
            | Self::NotReset { lane }
            | Self::Over { lane }
            | Self::Unseeded { lane }
            | Self::Lane { lane, .. }
            | Self::Failed { lane, .. } => *lane += by,
            _ => {}
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_lane_component_value_and_range_and_ends_in_a_hint() {
        let error = EnvError::Action { lane: 1, component: "force".into(), value: f64::NAN, low: -1.0, high: 1.0 }.moved(2);
        let text = error.to_string();
        assert!(text.starts_with("lane 3: action `force` is NaN, which is not within [-1, 1]\nhint: "), "{text}");
        let failed = EnvError::Failed { lane: 0, why: "the feed has no quote\nhint: begin later".into() }.moved(4);
        assert_eq!(failed.to_string(), "lane 4: the feed has no quote\nhint: begin later");
        assert!(matches!(EnvError::Closed.moved(1), EnvError::Closed));
    }
}
