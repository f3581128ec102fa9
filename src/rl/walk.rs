//! Two small environments that the tests of this room step.

use super::{
    About, Actions, BoxSpace, Each, Env, EnvError, Episode, Episodes, InfoChannel, Occasion, OptionAbout, Options, Out,
    Space, SplitMix64, Step, StreamName, VecEnv, Which, alike,
};

const NOISE: StreamName = StreamName::new("noise");

/// A point that is pushed to and fro and shaken, with 1 as the largest push, lanes side by side: struct of arrays.
#[derive(Debug, Clone)]
pub struct Walk {
    about: About,
    parts: usize,
    positions: Vec<f32>,
    taken: Vec<u32>,
    acted: Vec<f32>,
    streams: Vec<SplitMix64>,
    episodes: Episodes,
}

impl Walk {
    pub fn new(lanes: usize) -> Self {
        Self::in_parts(lanes, 1)
    }

    /// One whose steps can be split.
    pub fn in_parts(lanes: usize, parts: usize) -> Self {
        let observation = BoxSpace::of(&[("position", "m", -10.0, 10.0), ("steps", "", 0.0, f32::INFINITY)]);
        let action = Space::Box(BoxSpace::of(&[("push", "N", -1.0, 1.0)]));
        let mut about = About::new("test/Walk-v0", "Stay near 0", observation, action);
        about.reward_range = (-100.0, 0.0);
        about.seconds_a_step = Some(0.05);
        about.info = vec![InfoChannel::new("acted", "N")];
        about.privileged = vec![InfoChannel::new("seed", "")];
        about.options = vec![OptionAbout::number(Occasion::Reset, "start", "m", [0.0, -1.0, 1.0], "where it begins")];
        Self {
            about,
            parts,
            positions: vec![0.0; lanes],
            taken: vec![0; lanes],
            acted: vec![0.0; lanes],
            streams: vec![SplitMix64::default(); lanes],
            episodes: Episodes::new(lanes),
        }
    }

    fn observe(&self, lane: usize, observations: &mut [f32]) {
        observations[2 * lane] = self.positions[lane];
        observations[2 * lane + 1] = self.taken[lane] as f32;
    }

    fn copy(&mut self, other: &Self, from: usize, to: usize) {
        self.positions[to] = other.positions[from];
        self.taken[to] = other.taken[from];
        self.acted[to] = other.acted[from];
        self.streams[to] = other.streams[from];
        self.episodes.copy_lane_from(&other.episodes, from, to);
    }
}

impl VecEnv for Walk {
    fn about(&self) -> &About {
        &self.about
    }

    fn lanes(&self) -> usize {
        self.positions.len()
    }

    fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        options.check(&self.about.id, &self.about.options, Occasion::Reset)?;
        let start = options.number(&self.about.options, "start")? as f32;
        self.episodes.begin(which, seeds);
        for lane in which.iter(self.lanes()) {
            self.streams[lane] = self.episodes.lane(lane).stream(NOISE);
            let drawn = self.streams[lane].between(-0.05, 0.05) as f32;
            self.positions[lane] = if options.get("start").is_some() { start } else { drawn };
            (self.taken[lane], self.acted[lane]) = (0, 0.0);
            self.observe(lane, observations);
        }
        Ok(())
    }

    fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        for (lane, push) in actions.continuous().iter().enumerate() {
            let shaken = self.streams[lane].between(-0.01, 0.01) as f32;
            self.positions[lane] = (self.positions[lane] + 0.1 * push + shaken).clamp(-10.0, 10.0);
            self.acted[lane] = *push;
            self.taken[lane] += 1;
            self.observe(lane, out.observations);
            out.rewards[lane] = -f64::from(self.positions[lane]).powi(2);
            out.terminated[lane] = self.positions[lane].abs() > 5.0;
            out.truncated[lane] = false;
        }
        Ok(())
    }

    fn parts(&self) -> usize {
        self.parts
    }

    fn step_in_parts(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        let lanes = self.lanes();
        let mean: Vec<f32> = (0..lanes)
            .map(|lane| actions.continuous().iter().skip(lane).step_by(lanes).sum::<f32>() / self.parts as f32)
            .collect();
        self.step(Actions::Continuous(&mean), out)
    }

    fn info(&self, _: usize, values: &mut [f64]) {
        values.iter_mut().zip(&self.acted).for_each(|(value, acted)| *value = (*acted).into());
    }

    fn privileged(&self, _: usize, values: &mut [f64]) {
        values.iter_mut().enumerate().for_each(|(lane, value)| *value = self.episodes.lane(lane).seed as f64);
    }

    fn copy_lane(&mut self, from: usize, to: usize) {
        let source = self.clone();
        self.copy(&source, from, to);
    }

    fn copy_lane_from(&mut self, other: &dyn VecEnv, from: usize, to: usize) -> Result<(), EnvError> {
        let other = alike(self, other)?;
        self.copy(other, from, to);
        Ok(())
    }
}

/// What each lane was last pushed by within `env`.
pub fn acted(env: &dyn VecEnv) -> Vec<f32> {
    let mut values = vec![0.0; env.lanes()];
    env.info(0, &mut values);
    values.iter().map(|value| *value as f32).collect()
}

/// What each lane is pushed by within `env` as it is given these actions, step after step.
pub fn acting<const N: usize>(mut env: impl VecEnv, actions: &[[f32; N]]) -> Vec<Vec<f32>> {
    let mut buffers = super::Buffers::of(&env);
    let seeds: Vec<u64> = (0..N as u64).collect();
    env.reset(Which::All, Some(&seeds), &Options::new(), &mut buffers.observations).unwrap();
    actions
        .iter()
        .map(|row| {
            env.step(Actions::Continuous(row), &mut buffers.out()).unwrap();
            acted(&env)
        })
        .collect()
}

/// A counter that is pushed up or down, ends at 3 or -3, and fails at its step number `fails`.
#[derive(Debug, Clone)]
pub struct Push {
    about: About,
    count: i64,
    taken: u32,
    pub fails: Option<u32>,
}

impl Push {
    pub fn alone() -> Self {
        let observation = BoxSpace::of(&[("count", "", -3.0, 3.0)]);
        let action = Space::Discrete { n: 2, name: "way".into() };
        let mut about = About::new("test/Push-v0", "Count up", observation, action);
        about.info = vec![InfoChannel::new("taken", "")];
        Self { about, count: 0, taken: 0, fails: None }
    }

    pub fn new(lanes: usize) -> Each<Self> {
        Each::new(Self::alone(), lanes).unwrap()
    }
}

impl Env for Push {
    fn about(&self) -> &About {
        &self.about
    }

    fn reset(&mut self, _: Episode, options: &Options, observation: &mut [f32]) -> Result<(), EnvError> {
        options.check(&self.about.id, &self.about.options, Occasion::Reset)?;
        (self.count, self.taken) = (0, 0);
        observation[0] = 0.0;
        Ok(())
    }

    fn step(&mut self, action: Actions<'_>, observation: &mut [f32]) -> Result<Step, EnvError> {
        if self.fails == Some(self.taken) {
            return Err(EnvError::Failed { lane: 0, why: "the counter is stuck\nhint: oil it".into() });
        }
        self.count += 2 * action.discrete()[0] - 1;
        self.taken += 1;
        observation[0] = self.count as f32;
        Ok(Step { reward: self.count as f64, terminated: self.count.abs() == 3, truncated: false })
    }

    fn info(&self, _: usize) -> f64 {
        self.taken.into()
    }
}
