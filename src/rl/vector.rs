//! The environment as learners step it: lanes side by side, one for a single environment.

use std::any::Any;

use dyn_clone::DynClone;

use super::{About, Actions, EnvError, Options};

/// Environments of one kind stepped together, each in a lane of its own.
///
/// Drivers ([`Checked`](super::Checked), [`Autoreset`](super::Autoreset)) and wrappers are written once, on this trait. A clone is
/// a snapshot: it goes on with the same bits.
///
/// # Contract
/// [`check_env`](super::check_env) runs it on any environment.
/// - The bits of a lane depend on its seed, its episode, its options and its actions alone: not on how many lanes there are, on
///   its place among them, or on threads.
/// - A lane given a seed at reset begins its episode 0; without one, it goes on to its next episode with the seed it had, which is
///   0 for a lane that never had one ([`Checked`](super::Checked) asks for one).
/// - [`reset`](Self::reset) touches the lanes of `which`, and nothing of any other.
/// - [`step`](Self::step) steps every lane. One whose episode is over stays as it is or moves on in any way that is finite, and
///   disturbs no other: whoever steps it does not look at what it gives out.
/// - If an error is given, no lane has moved, but for [`EnvError::Failed`].
/// - Callers give buffers and actions of the right length and kind, and actions within the action space.
/// - Nothing is allocated in `step`.
pub trait VecEnv: Any + Send + DynClone {
    /// What the environment is.
    fn about(&self) -> &About;

    /// Number of lanes, at least 1.
    fn lanes(&self) -> usize;

    /// Begins an episode in the lanes of `which`, with the seeds in their places of `seeds`, one a lane, and writes what is observed
    /// to their rows of `observations`, shape (lanes, size).
    ///
    /// # Errors
    /// An option there is not or that has a value it cannot have; what else an environment cannot begin with.
    fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError>;

    /// Takes a step in every lane by its row of `actions`, shape (lanes, size), and writes what comes of it.
    ///
    /// # Errors
    /// [`EnvError::Failed`] if the environment itself fails.
    fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError>;

    /// Into how many equal parts a step can be split, each with an action of its own; 1 if it cannot.
    fn parts(&self) -> usize {
        1
    }

    /// As [`step`](Self::step), with actions for each part of the step, part after part: shape (parts, lanes, size).
    ///
    /// # Errors
    /// As `step`.
    fn step_in_parts(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        self.step(actions, out)
    }

    /// The value of info channel number `channel`, one a lane. After a step that ends an episode it is that of its end.
    fn info(&self, _channel: usize, _values: &mut [f64]) {}

    /// The value of privileged parameter number `parameter`, one a lane.
    fn privileged(&self, _parameter: usize, _values: &mut [f64]) {}

    /// Makes lane `to` a copy of lane `from`, which goes on with the same bits.
    fn copy_lane(&mut self, from: usize, to: usize);

    /// Makes lane `to` a copy of lane `from` of `other`: an environment of the same kind, of any number of lanes.
    ///
    /// # Errors
    /// [`EnvError::Unlike`] if `other` is of another kind.
    fn copy_lane_from(&mut self, other: &dyn VecEnv, from: usize, to: usize) -> Result<(), EnvError>;
}

dyn_clone::clone_trait_object!(VecEnv);

impl std::fmt::Debug for dyn VecEnv {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("VecEnv").field("id", &self.about().id).field("lanes", &self.lanes()).finish_non_exhaustive()
    }
}

/// `other` as the kind `E` that `this` is, for [`VecEnv::copy_lane_from`].
///
/// # Errors
/// [`EnvError::Unlike`] if it is of another kind.
pub fn alike<'a, E: VecEnv>(this: &E, other: &'a dyn VecEnv) -> Result<&'a E, EnvError> {
    let unlike = |why| Err(EnvError::Unlike { id: this.about().id.clone(), why });
    match (unboxed(other) as &dyn Any).downcast_ref::<E>() {
        Some(other) if other.about().id != this.about().id => unlike(format!("it is `{}`", other.about().id)),
        Some(other) if sizes(other.about()) != sizes(this.about()) => {
            unlike("its observations, actions or info are of another size".into())
        }
        Some(other) => Ok(other),
        None => unlike(format!("it is `{}`, or has other wrappers", other.about().id)),
    }
}

fn sizes(about: &About) -> [usize; 4] {
    [about.observation.size(), about.action.size(), about.info.len(), about.privileged.len()]
}

/// What is within boxes.
fn unboxed(mut other: &dyn VecEnv) -> &dyn VecEnv {
    while let Some(inner) = (other as &dyn Any).downcast_ref::<Box<dyn VecEnv>>() {
        other = &**inner;
    }
    other
}

impl VecEnv for Box<dyn VecEnv> {
    fn about(&self) -> &About {
        (**self).about()
    }

    fn lanes(&self) -> usize {
        (**self).lanes()
    }

    fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        (**self).reset(which, seeds, options, observations)
    }

    fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        (**self).step(actions, out)
    }

    fn parts(&self) -> usize {
        (**self).parts()
    }

    fn step_in_parts(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        (**self).step_in_parts(actions, out)
    }

    fn info(&self, channel: usize, values: &mut [f64]) {
        (**self).info(channel, values);
    }

    fn privileged(&self, parameter: usize, values: &mut [f64]) {
        (**self).privileged(parameter, values);
    }

    fn copy_lane(&mut self, from: usize, to: usize) {
        (**self).copy_lane(from, to);
    }

    fn copy_lane_from(&mut self, other: &dyn VecEnv, from: usize, to: usize) -> Result<(), EnvError> {
        (**self).copy_lane_from(unboxed(other), from, to)
    }
}

/// Some of the lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which<'a> {
    /// All of them.
    All,
    /// Those that are true, of one a lane.
    Mask(&'a [bool]),
}

impl<'a> Which<'a> {
    /// Whether `lane` is among them.
    #[must_use]
    #[inline]
    pub fn has(self, lane: usize) -> bool {
        match self {
            Self::All => true,
            Self::Mask(mask) => mask[lane],
        }
    }

    /// Their numbers, of `lanes` lanes.
    pub fn iter(self, lanes: usize) -> impl Iterator<Item = usize> + use<'a> {
        // Eight at a time: of most masks most are false.
        (0..lanes).step_by(8).flat_map(move |first| {
            let mut word = self.word(first, lanes);
            std::iter::from_fn(move || {
                let lane = first + word.trailing_zeros() as usize / 8;
                let some = word != 0;
                word &= word.wrapping_sub(1);
                some.then_some(lane)
            })
        })
    }

    /// Writes their numbers, of `lanes` lanes, into `list`, whatever there was in it: for what does better without a branch a lane.
    pub fn list(self, lanes: usize, list: &mut Vec<u32>) {
        match self {
            Self::All => {
                list.clear();
                list.extend(0..lanes as u32);
            }
            Self::Mask(mask) => {
                // A number that is not among them is written over by the next.
                list.resize(lanes + 1, 0);
                let mut count = 0;
                for (lane, among) in mask[..lanes].iter().enumerate() {
                    list[count] = lane as u32;
                    count += usize::from(*among);
                }
                list.truncate(count);
            }
        }
    }

    /// Whether each of eight lanes from lane `first` on is among them: a byte a lane, the first in the lowest.
    fn word(self, first: usize, lanes: usize) -> u64 {
        let count = (lanes - first).min(8);
        match self {
            Self::All => 0x0101_0101_0101_0101 >> (8 * (8 - count)),
            Self::Mask(mask) => {
                let bytes: &[u8] = bytemuck::cast_slice(&mask[first..first + count]);
                match bytes.first_chunk() {
                    Some(eight) => u64::from_le_bytes(*eight),
                    None => bytes.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte)),
                }
            }
        }
    }

    /// Whether any is among them.
    #[must_use]
    pub fn any(self) -> bool {
        match self {
            Self::All => true,
            Self::Mask(mask) => mask.contains(&true),
        }
    }

    /// The same of `count` lanes from lane `first`, numbered from 0.
    #[must_use]
    pub fn part(self, first: usize, count: usize) -> Which<'a> {
        match self {
            Self::All => Which::All,
            Self::Mask(mask) => Which::Mask(&mask[first..first + count]),
        }
    }
}

/// Where a step writes what comes of it.
#[derive(Debug)]
pub struct Out<'a> {
    /// What is observed, shape (lanes, size), row after row.
    pub observations: &'a mut [f32],
    /// Rewards, one a lane.
    pub rewards: &'a mut [f64],
    /// Whether an episode ended in a state from which nothing follows, one a lane.
    pub terminated: &'a mut [bool],
    /// Whether an episode was cut off, as by a limit of time, one a lane.
    pub truncated: &'a mut [bool],
}

impl<'a> Out<'a> {
    /// The same for a shorter time.
    pub fn again(&mut self) -> Out<'_> {
        Out {
            observations: self.observations,
            rewards: self.rewards,
            terminated: self.terminated,
            truncated: self.truncated,
        }
    }

    /// The first `lanes` lanes and all others, for observations of `size` numbers.
    ///
    /// # Panics
    /// If there are not as many lanes: an error of the calling code, not of any input.
    #[must_use]
    pub fn split(self, lanes: usize, size: usize) -> (Out<'a>, Out<'a>) {
        let (observations, observations_after) = self.observations.split_at_mut(lanes * size);
        let (rewards, rewards_after) = self.rewards.split_at_mut(lanes);
        let (terminated, terminated_after) = self.terminated.split_at_mut(lanes);
        let (truncated, truncated_after) = self.truncated.split_at_mut(lanes);
        let after = Out {
            observations: observations_after,
            rewards: rewards_after,
            terminated: terminated_after,
            truncated: truncated_after,
        };
        (Out { observations, rewards, terminated, truncated }, after)
    }
}

/// Buffers for what comes of steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Buffers {
    /// Shape (lanes, size), row after row.
    pub observations: Vec<f32>,
    /// One a lane.
    pub rewards: Vec<f64>,
    /// One a lane.
    pub terminated: Vec<bool>,
    /// One a lane.
    pub truncated: Vec<bool>,
}

impl Buffers {
    /// Buffers for so many lanes, with observations of `size` numbers.
    #[must_use]
    pub fn new(lanes: usize, size: usize) -> Self {
        Self {
            observations: vec![0.0; lanes * size],
            rewards: vec![0.0; lanes],
            terminated: vec![false; lanes],
            truncated: vec![false; lanes],
        }
    }

    /// Buffers for all that `env` gives out.
    #[must_use]
    pub fn of(env: &dyn VecEnv) -> Self {
        Self::new(env.lanes(), env.about().observation.size())
    }

    /// Where a step may write.
    pub fn out(&mut self) -> Out<'_> {
        Out {
            observations: &mut self.observations,
            rewards: &mut self.rewards,
            terminated: &mut self.terminated,
            truncated: &mut self.truncated,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_of_a_mask_are_those_that_are_true() {
        let mut list = vec![7; 3];
        for lanes in 0..30 {
            assert!(Which::All.iter(lanes).eq(0..lanes));
            Which::All.list(lanes, &mut list);
            assert!(list.iter().map(|lane| *lane as usize).eq(0..lanes));
            for pattern in [0, u64::MAX, 0x8040_2010_0804_0201, 0x0101_0101_0101_0101, 0xdead_beef_1234_5678] {
                let mask: Vec<bool> = (0..lanes).map(|lane| pattern >> lane & 1 == 1).collect();
                let which = Which::Mask(&mask);
                assert!(which.iter(lanes).eq((0..lanes).filter(|lane| mask[*lane])), "{mask:?}");
                which.list(lanes, &mut list);
                assert!(list.iter().map(|lane| *lane as usize).eq(which.iter(lanes)), "{mask:?}");
            }
        }
    }
}
