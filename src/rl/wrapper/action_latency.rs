//! Actions that arrive late.

use super::delay_line::{DelayLine, FixedLine};
use super::latency::{Latency, Redraw, Steps};
use super::layer::{copy_row, neutral};
use crate::rl::{About, Actions, EnvError, Episodes, Options, Out, Space, SplitMix64, StreamName, VecEnv, Which, alike};

/// The environment acts by the last action sent of those that have arrived.
///
/// Where the environment can split its steps ([`VecEnv::parts`]), an action is replaced within a step, at the part that is nearest
/// to its arrival; otherwise at the step that is nearest, so that the mean latency is kept where it is drawn. Before the first
/// action has arrived, the one nearest to 0 is in force, or choice 0.
#[derive(Debug, Clone)]
pub struct ActionLatency<E> {
    env: E,
    name: StreamName,
    about: About,
    episodes: Episodes,
    parts: usize,
    steps: Steps,
    streams: Vec<SplitMix64>,
    /// The latency [parts] of the episode each lane is in.
    episode: Vec<u64>,
    line: Line,
}

#[derive(Debug, Clone)]
enum Line {
    Continuous(Way<f32>),
    Discrete(Way<i64>),
}

/// The messages, and what arrives of them: shape (parts, lanes, size).
#[derive(Debug, Clone)]
enum Way<T> {
    Fixed { line: FixedLine<T>, first: Vec<T>, arriving: Vec<T> },
    Drawn { line: DelayLine<T>, first: Vec<T>, arriving: Vec<T> },
}

impl<T: Copy + Default> Way<T> {
    fn new(lanes: usize, parts: usize, steps: &Steps, first: Vec<T>) -> Self {
        let size = first.len();
        let fixed = steps.fixed().map(|delay| in_parts(delay, parts));
        match fixed.filter(|delay| delay % parts as u64 == 0) {
            Some(delay) => {
                let line = FixedLine::new(lanes, size, delay as usize / parts);
                Self::Fixed { line, first, arriving: vec![T::default(); lanes * size] }
            }
            None => {
                let line = DelayLine::new(lanes, size, steps.longest());
                Self::Drawn { line, first, arriving: vec![T::default(); parts * lanes * size] }
            }
        }
    }

    fn begin(&mut self, lane: usize) {
        match self {
            Self::Fixed { line, first, .. } => line.begin(lane, first),
            Self::Drawn { line, first, .. } => line.begin(lane, first),
        }
    }

    /// Sends `actions`, each lane's with a latency [parts] of its own; whether the step has to be split.
    fn send(&mut self, actions: &[T], parts: usize, mut latency: impl FnMut(usize) -> u64) -> bool {
        match self {
            Self::Fixed { line, arriving, .. } => {
                arriving.copy_from_slice(actions);
                line.exchange(arriving);
                false
            }
            Self::Drawn { line, first, arriving } => {
                let size = first.len();
                for (lane, row) in actions.chunks_exact(size).enumerate() {
                    let now = line.sent(lane) * parts as u64;
                    line.send(lane, row, now + latency(lane));
                    for part in 0..parts {
                        let place = (part * actions.len()) + lane * size;
                        arriving[place..][..size].copy_from_slice(line.newest(lane, now + part as u64));
                    }
                }
                parts > 1
            }
        }
    }

    fn arriving(&self) -> &[T] {
        match self {
            Self::Fixed { arriving, .. } | Self::Drawn { arriving, .. } => arriving,
        }
    }

    fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        match (self, other) {
            (Self::Fixed { line, .. }, Some(Self::Fixed { line: other, .. })) => line.copy_lane(Some(other), from, to),
            (Self::Fixed { line, .. }, _) => line.copy_lane(None, from, to),
            (Self::Drawn { line, .. }, Some(Self::Drawn { line: other, .. })) => line.copy_lane(Some(other), from, to),
            (Self::Drawn { line, .. }, _) => line.copy_lane(None, from, to),
        }
    }
}

/// A latency [steps] to the nearest part.
fn in_parts(steps: f64, parts: usize) -> u64 {
    (steps * parts as f64 + 0.5) as u64
}

impl<E: VecEnv> ActionLatency<E> {
    /// Actions for `env` are under way so long.
    ///
    /// # Errors
    /// [`EnvError::Wrapper`] if the latency cannot be.
    pub fn new(env: E, latency: Latency) -> Result<Self, EnvError> {
        let about = env.about().clone();
        let refuse = |[why, remedy]: [String; 2]| EnvError::Wrapper {
            wrapper: "a latency of actions",
            id: about.id.clone(),
            why,
            remedy,
        };
        let steps = latency.within(&about).map_err(refuse)?;
        let (lanes, parts) = (env.lanes(), env.parts());
        let line = match &about.action {
            Space::Box(space) => Line::Continuous(Way::new(lanes, parts, &steps, neutral(&space.low, &space.high))),
            space => Line::Discrete(Way::new(lanes, parts, &steps, vec![0; space.size()])),
        };
        Ok(Self {
            name: StreamName::new("action_latency"),
            episodes: Episodes::new(lanes),
            streams: vec![SplitMix64::default(); lanes],
            episode: vec![0; lanes],
            env,
            about,
            parts,
            steps,
            line,
        })
    }

    /// The same with draws from the stream of this name, to tell two of them apart.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        Self { name: StreamName::new(name), ..self }
    }

    /// The environment within.
    #[must_use]
    pub fn env(&self) -> &E {
        &self.env
    }

    /// The environment within, for what it can be set to.
    pub fn env_mut(&mut self) -> &mut E {
        &mut self.env
    }

    fn copy(&mut self, other: Option<&Self>, from: usize, to: usize) {
        copy_row(&mut self.streams, other.map(|other| other.streams.as_slice()), 1, from, to);
        copy_row(&mut self.episode, other.map(|other| other.episode.as_slice()), 1, from, to);
        match other {
            Some(other) => self.episodes.copy_lane_from(&other.episodes, from, to),
            None => self.episodes.copy_lane(from, to),
        }
        match (&mut self.line, other.map(|other| &other.line)) {
            (Line::Continuous(line), Some(Line::Continuous(other))) => line.copy_lane(Some(other), from, to),
            (Line::Continuous(line), _) => line.copy_lane(None, from, to),
            (Line::Discrete(line), Some(Line::Discrete(other))) => line.copy_lane(Some(other), from, to),
            (Line::Discrete(line), _) => line.copy_lane(None, from, to),
        }
    }
}

impl<E: VecEnv + Clone> VecEnv for ActionLatency<E> {
    fn about(&self) -> &About {
        &self.about
    }

    fn lanes(&self) -> usize {
        self.env.lanes()
    }

    fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        self.env.reset(which, seeds, options, observations)?;
        self.episodes.begin(which, seeds);
        for lane in which.iter(self.env.lanes()) {
            self.streams[lane] = self.episodes.lane(lane).stream(self.name);
            self.episode[lane] = in_parts(self.steps.draw(&mut self.streams[lane]), self.parts);
            match &mut self.line {
                Line::Continuous(line) => line.begin(lane),
                Line::Discrete(line) => line.begin(lane),
            }
        }
        Ok(())
    }

    fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        let Self { steps, streams, episode, parts, .. } = self;
        let latency = |lane: usize| match steps.redraw {
            Redraw::Message => in_parts(steps.draw(&mut streams[lane]), *parts),
            Redraw::Episode => episode[lane],
        };
        let (arriving, split) = match &mut self.line {
            Line::Continuous(line) => {
                let split = line.send(actions.continuous(), *parts, latency);
                (Actions::Continuous(line.arriving()), split)
            }
            Line::Discrete(line) => {
                let split = line.send(actions.discrete(), *parts, latency);
                (Actions::Discrete(line.arriving()), split)
            }
        };
        if split { self.env.step_in_parts(arriving, out) } else { self.env.step(arriving, out) }
    }

    fn info(&self, channel: usize, values: &mut [f64]) {
        self.env.info(channel, values);
    }

    fn privileged(&self, parameter: usize, values: &mut [f64]) {
        self.env.privileged(parameter, values);
    }

    fn copy_lane(&mut self, from: usize, to: usize) {
        if from != to {
            self.env.copy_lane(from, to);
            self.copy(None, from, to);
        }
    }

    fn copy_lane_from(&mut self, other: &dyn VecEnv, from: usize, to: usize) -> Result<(), EnvError> {
        let other = alike(self, other)?;
        if self.steps != other.steps || self.parts != other.parts {
            let why = "a latency of actions is set otherwise".into();
            return Err(EnvError::Unlike { id: self.about.id.clone(), why });
        }
        self.env.copy_lane_from(&other.env, from, to)?;
        self.copy(Some(other), from, to);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rl::walk::{Push, Walk, acting};
    use crate::rl::{Buffers, TimeLimit, Wrap};

    #[test]
    fn a_fixed_latency_hands_on_what_was_sent_so_many_steps_ago() {
        let late = |latency| ActionLatency::new(Walk::new(2), latency).unwrap();
        let actions = [[0.1, -0.1], [0.2, -0.2], [0.3, -0.3]];
        assert_eq!(acting(late(Latency::steps(0)), &actions), actions);
        assert_eq!(acting(late(Latency::steps(2)), &actions), [[0.0, 0.0], [0.0, 0.0], [0.1, -0.1]]);
        // A step takes 0.05 s, and cannot be split here: 1.4 steps are 1, and 1.6 steps are 2.
        assert_eq!(acting(late(Latency::seconds(0.07, 0.0)), &actions), [[0.0, 0.0], [0.1, -0.1], [0.2, -0.2]]);
        assert_eq!(acting(late(Latency::seconds(0.08, 0.0)), &actions), [[0.0, 0.0], [0.0, 0.0], [0.1, -0.1]]);
    }

    #[test]
    fn where_a_step_can_be_split_the_old_action_holds_for_a_part_of_it() {
        // Five parts of 0.01 s; what is told is the mean over the parts.
        let late = |seconds| ActionLatency::new(Walk::in_parts(1, 5), Latency::seconds(seconds, 0.0)).unwrap();
        let means = |seconds: f64, actions: &[[f32; 1]]| -> Vec<f32> { acting(late(seconds), actions).concat() };
        let close = |found: Vec<f32>, expected: &[f32]| {
            assert_eq!(found.len(), expected.len());
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?} {expected:?}");
        };
        close(means(0.02, &[[1.0], [1.0], [0.0]]), &[0.6, 1.0, 0.4]);
        close(means(0.07, &[[1.0], [1.0], [0.0], [0.0]]), &[0.0, 0.6, 1.0, 0.4]);
        close(means(0.05, &[[1.0], [0.5], [0.0]]), &[0.0, 1.0, 0.5]);
        // 0.024 s is nearest to two parts, 0.026 s to three.
        close(means(0.024, &[[1.0]]), &[0.6]);
        close(means(0.026, &[[1.0]]), &[0.4]);
    }

    #[test]
    fn jitter_keeps_the_mean_and_the_order_of_sending() {
        // From 0.2 to 1.0 steps: a step is late by 0 or 1, by 0.6 in the mean over messages.
        let mut env = ActionLatency::new(Walk::new(1), Latency::seconds(0.03, 0.02)).unwrap();
        let mut buffers = Buffers::of(&env);
        env.reset(Which::All, Some(&[9]), &Options::new(), &mut buffers.observations).unwrap();
        let (mut late, mut last) = (0, 0);
        for step in 1..=10_000_u32 {
            let action = f64::from(step) / 1e5;
            env.step(Actions::Continuous(&[action as f32]), &mut buffers.out()).unwrap();
            let mut acted = [0.0];
            env.info(0, &mut acted);
            let number = (acted[0] * 1e5).round() as u32;
            assert!(number >= last && step - number <= 1);
            (late, last) = (late + (step - number), number);
        }
        // Probability 5/8 that a draw from 0.2 to 1.0 is at least 0.5; four standard deviations of the binomial.
        assert!((f64::from(late) / 1e4 - 0.625).abs() < 4.0 * (0.625_f64 * 0.375 / 1e4).sqrt(), "{late}");
    }

    #[test]
    fn choices_are_late_too() {
        let push = Push::new(1).with(TimeLimit::new(9)).unwrap();
        let mut env = ActionLatency::new(push, Latency::steps(1)).unwrap();
        let mut buffers = Buffers::of(&env);
        env.reset(Which::All, Some(&[9]), &Options::new(), &mut buffers.observations).unwrap();
        let counts: Vec<f32> = [1, 1, 1]
            .iter()
            .map(|way| {
                env.step(Actions::Discrete(&[*way]), &mut buffers.out()).unwrap();
                buffers.observations[0]
            })
            .collect();
        assert_eq!(counts, [-1.0, 0.0, 1.0]);
        let other = |steps| ActionLatency::new(Push::new(1), Latency::steps(steps)).unwrap();
        assert!(other(1).copy_lane_from(&other(2), 0, 0).unwrap_err().to_string().contains("set otherwise"));
        assert!(ActionLatency::new(Push::new(1), Latency::seconds(0.1, 0.0)).unwrap_err().to_string().contains("in steps"));
    }
}
