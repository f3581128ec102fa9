//! An environment played with random actions, each lane by itself, and all that came of it.

use crate::rl::{
    About, Actions, BoxSpace, Buffers, EnvError, Episode, Options, Space, SplitMix64, StreamName, VecEnv, Which,
};

/// What came of one step, or of a reset, in a lane: numbers by their bits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Observation, reward, whether terminated and truncated, info, privileged parameters.
    bits: Vec<u64>,
    pub over: bool,
    /// Whether it is the first of an episode.
    pub first: bool,
}

/// An environment under way.
#[derive(Clone)]
pub struct Play {
    pub env: Box<dyn VecEnv>,
    pub buffers: Buffers,
    /// Where each lane's actions come from.
    actors: Vec<SplitMix64>,
    over: Vec<bool>,
    /// All that came of each lane.
    pub rows: Vec<Vec<Row>>,
    about: About,
    /// What buffers hold before they are written.
    stale: Stale,
}

/// What buffers hold before they are written: what is not written shows as a difference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stale {
    High,
    Low,
}

const ACTOR: StreamName = StreamName::new("actor");

impl Play {
    /// Begins with these seeds, one a lane, by which actions are drawn too.
    pub fn begin(env: Box<dyn VecEnv>, seeds: &[u64], stale: Stale) -> Result<Self, EnvError> {
        let about = env.about().clone();
        let actors = seeds.iter().map(|seed| Episode { seed: *seed, number: 0 }.stream(ACTOR)).collect();
        let lanes = seeds.len();
        let buffers = Buffers::new(lanes, about.observation.size());
        let mut play = Self { env, buffers, actors, over: vec![false; lanes], rows: vec![Vec::new(); lanes], about, stale };
        play.soil();
        play.reset(Which::All, Some(seeds))?;
        Ok(play)
    }

    /// Makes lane `to` act as lane `from` of `other` does.
    pub fn act_as(&mut self, to: usize, other: &Self, from: usize) {
        (self.actors[to], self.over[to]) = (other.actors[from], other.over[from]);
        self.rows[to].clone_from(&other.rows[from]);
    }

    /// Resets lanes and notes what is observed.
    pub fn reset(&mut self, which: Which<'_>, seeds: Option<&[u64]>) -> Result<(), EnvError> {
        self.env.reset(which, seeds, &Options::new(), &mut self.buffers.observations)?;
        for lane in which.iter(self.rows.len()) {
            self.over[lane] = false;
            (self.buffers.rewards[lane], self.buffers.terminated[lane], self.buffers.truncated[lane]) = (0.0, false, false);
        }
        self.note(which, true);
        Ok(())
    }

    /// Takes so many steps, and resets lanes whose episodes are over after each.
    pub fn run(&mut self, steps: usize) -> Result<(), EnvError> {
        for _ in 0..steps {
            self.step()?;
            self.reset_over()?;
        }
        Ok(())
    }

    /// Resets lanes whose episodes are over.
    pub fn reset_over(&mut self) -> Result<(), EnvError> {
        if self.over.contains(&true) {
            let over = self.over.clone();
            self.reset(Which::Mask(&over), None)?;
        }
        Ok(())
    }

    /// Takes a step; lanes that were over before it are not noted.
    pub fn step(&mut self) -> Result<(), EnvError> {
        let size = self.about.action.size();
        let (mut continuous, mut discrete) = (Vec::new(), Vec::new());
        // A lane that is over uses up none of its actions.
        for (lane, actor) in self.actors.iter_mut().enumerate() {
            let before = *actor;
            for k in 0..size {
                match &self.about.action {
                    Space::Box(space) => continuous.push(drawn(space, k, actor)),
                    Space::Discrete { n, .. } => discrete.push(chosen(*n, actor)),
                    Space::MultiDiscrete { n, .. } => discrete.push(chosen(n[k], actor)),
                }
            }
            if self.over[lane] {
                *actor = before;
            }
        }
        let actions = match &self.about.action {
            Space::Box(_) => Actions::Continuous(&continuous),
            Space::Discrete { .. } | Space::MultiDiscrete { .. } => Actions::Discrete(&discrete),
        };
        self.soil();
        let under_way: Vec<bool> = self.over.iter().map(|over| !over).collect();
        self.env.step(actions, &mut self.buffers.out())?;
        for lane in Which::Mask(&under_way).iter(under_way.len()) {
            self.over[lane] = self.buffers.terminated[lane] || self.buffers.truncated[lane];
        }
        self.note(Which::Mask(&under_way), false);
        Ok(())
    }

    /// Leaves in all buffers what no environment would write.
    fn soil(&mut self) {
        let high = self.stale == Stale::High;
        self.buffers.observations.fill(if high { f32::NAN } else { -12_345.0 });
        self.buffers.rewards.fill(if high { f64::NAN } else { -12_345.0 });
        self.buffers.terminated.fill(high);
        self.buffers.truncated.fill(high);
    }

    fn note(&mut self, which: Which<'_>, first: bool) {
        let (lanes, size) = (self.rows.len(), self.about.observation.size());
        let stale = if self.stale == Stale::High { f64::NAN } else { -12_345.0 };
        let mut columns = Vec::new();
        for channel in 0..self.about.info.len() {
            columns.push(vec![stale; lanes]);
            self.env.info(channel, &mut columns[channel]);
        }
        for parameter in 0..self.about.privileged.len() {
            columns.push(vec![stale; lanes]);
            let last = columns.len() - 1;
            self.env.privileged(parameter, &mut columns[last]);
        }
        for lane in which.iter(lanes) {
            let buffers = &self.buffers;
            let row = &buffers.observations[lane * size..][..size];
            let mut bits: Vec<u64> = row.iter().map(|value| value.to_bits().into()).collect();
            bits.push(buffers.rewards[lane].to_bits());
            bits.extend([buffers.terminated[lane], buffers.truncated[lane]].map(u64::from));
            bits.extend(columns.iter().map(|column| column[lane].to_bits()));
            self.rows[lane].push(Row { bits, over: self.over[lane], first });
        }
    }
}

/// An action of component `k`, evenly drawn from the space, or from -10 to 10 where it has no bounds.
fn drawn(space: &BoxSpace, k: usize, actor: &mut SplitMix64) -> f32 {
    let (low, high) = (space.low[k].max(-10.0), space.high[k].min(10.0));
    let (low, high) = if low <= high { (low, high) } else { (space.low[k], space.high[k]) };
    let value = actor.between(low.into(), high.into()) as f32;
    // Now and then an end, which is an action too.
    let ends = [low, high];
    let choice = actor.bits() % 16;
    ends.get(choice as usize).copied().unwrap_or(value).clamp(low, high)
}

fn chosen(n: usize, actor: &mut SplitMix64) -> i64 {
    (actor.uniform() * n as f64) as i64
}

/// Where the rows of two lanes first differ, in words; none where one is as far as the other goes.
pub fn difference(about: &About, one: &[Row], other: &[Row]) -> Option<String> {
    let row = (0..one.len().min(other.len())).find(|row| one[*row] != other[*row])?;
    let (left, right) = (&one[row].bits, &other[row].bits);
    let at = left.iter().zip(right).position(|(a, b)| a != b);
    let steps = one[..=row].iter().filter(|row| !row.first).count();
    let when = if one[row].first { format!("at a reset after {steps} steps") } else { format!("at step {steps}") };
    let Some(at) = at else { return Some(format!("{when}, whether the episode is over")) };
    let size = about.observation.size();
    let single = |bits: u64| f32::from_bits(bits as u32);
    Some(match at.checked_sub(size) {
        None => format!("{when}, `{}` is {} or {}", about.observation.names[at], single(left[at]), single(right[at])),
        Some(0) => format!("{when}, the reward is {} or {}", f64::from_bits(left[at]), f64::from_bits(right[at])),
        Some(flag @ 1..=2) => {
            format!("{when}, `{}` is {} or {}", ["terminated", "truncated"][flag - 1], left[at], right[at])
        }
        Some(beyond) => {
            let channel = about.info.iter().chain(&about.privileged).nth(beyond - 3).map_or("info", |c| c.name.as_str());
            format!("{when}, `{channel}` is {} or {}", f64::from_bits(left[at]), f64::from_bits(right[at]))
        }
    })
}
