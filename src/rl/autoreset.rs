//! What happens when a lane's episode is over: the three ways of Gymnasium's `AutoresetMode` (version 1.1 and later).

use super::{Actions, EnvError, Options, Out, VecEnv, Which, alike};

/// When a lane whose episode is over is reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AutoresetMode {
    /// At the next step, which does nothing else in that lane: its action is not used, its reward is 0, and what is observed is the
    /// first observation of the new episode. The step that ends an episode gives its last observation.
    #[default]
    NextStep,
    /// In the step that ends it: rewards and flags are those of the end, what is observed is the first observation of the new episode,
    /// and the last of the old is among the [`Finals`].
    SameStep,
    /// Never: the caller resets it, with a mask, before its next step.
    Disabled,
}

/// What was observed and told last in the lanes whose episodes ended in this step, where they have begun the next in the same step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finals<'a> {
    /// Whether the episode ended, one a lane; the rows of others hold nothing of meaning.
    pub ended: &'a [bool],
    /// What was observed last, shape (lanes, size).
    pub observations: &'a [f32],
    /// Info at the end, shape (channels, lanes); nothing where it is [not kept](Autoreset::keep).
    pub info: &'a [f64],
}

/// What of episodes that end is kept in [`AutoresetMode::SameStep`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kept {
    /// What was observed last, and info.
    #[default]
    All,
    /// What was observed last.
    Observations,
    /// Nothing: there are no [`Finals`].
    Nothing,
}

/// Steps lanes and resets those whose episodes are over. It trusts its caller, as [`VecEnv`] does: [`Checked`](super::Checked)
/// does not.
///
/// Automatic resets give neither seed nor options: a lane goes on to its next episode.
#[derive(Debug, Clone)]
pub struct Autoreset<E> {
    env: E,
    mode: AutoresetMode,
    over: Vec<bool>,
    ended: bool,
    observations: Vec<f32>,
    info: Vec<f64>,
}

impl<E: VecEnv> Autoreset<E> {
    /// Drives `env` in this way.
    #[must_use]
    pub fn new(env: E, mode: AutoresetMode) -> Self {
        let lanes = env.lanes();
        let (rows, channels) = match mode {
            AutoresetMode::SameStep => (lanes * env.about().observation.size(), lanes * env.about().info.len()),
            AutoresetMode::NextStep | AutoresetMode::Disabled => (0, 0),
        };
        Self { env, mode, over: vec![false; lanes], ended: false, observations: vec![0.0; rows], info: vec![0.0; channels] }
    }

    /// What of the episodes that end is kept as [`Finals`]: everything from the beginning. To ask for info, or to keep observations,
    /// takes longer than many a step.
    pub fn keep(&mut self, kept: Kept) {
        let (lanes, about) = (self.over.len(), self.env.about());
        let same = self.mode == AutoresetMode::SameStep;
        let size = if same && kept != Kept::Nothing { about.observation.size() } else { 0 };
        let channels = if same && kept == Kept::All { about.info.len() } else { 0 };
        if same && [self.observations.len(), self.info.len()] != [lanes * size, lanes * channels] {
            self.observations.resize(lanes * size, 0.0);
            self.info.resize(lanes * channels, 0.0);
            // Of ends before nothing is known from here on.
            self.ended = false;
        }
    }

    /// The environment.
    #[must_use]
    pub fn env(&self) -> &E {
        &self.env
    }

    /// The environment, to be changed: lanes must be reset through this driver.
    pub fn env_mut(&mut self) -> &mut E {
        &mut self.env
    }

    /// When lanes are reset.
    #[must_use]
    pub fn mode(&self) -> AutoresetMode {
        self.mode
    }

    /// Whether the episode of each lane is over and it has not been reset since.
    #[must_use]
    pub fn over(&self) -> &[bool] {
        &self.over
    }

    /// What was last of the episodes that ended in the step before, in [`AutoresetMode::SameStep`]; none where none did, or nothing is kept.
    #[must_use]
    pub fn finals(&self) -> Option<Finals<'_>> {
        let kept = !self.observations.is_empty();
        (kept && self.ended).then_some(Finals { ended: &self.over, observations: &self.observations, info: &self.info })
    }

    /// As [`VecEnv::reset`].
    ///
    /// # Errors
    /// As there.
    pub fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        self.env.reset(which, seeds, options, observations)?;
        match which {
            Which::All => self.over.fill(false),
            Which::Mask(mask) => self.over.iter_mut().zip(mask).for_each(|(over, reset)| *over &= !reset),
        }
        self.ended = self.mode != AutoresetMode::SameStep && self.over.contains(&true);
        Ok(())
    }

    /// As [`VecEnv::step`], with resets.
    ///
    /// # Errors
    /// As there, and as for resets.
    pub fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        self.env.step(actions, out)?;
        match self.mode {
            AutoresetMode::NextStep => {
                // Whether any was over before this step.
                if self.ended {
                    self.env.reset(Which::Mask(&self.over), None, &Options::new(), out.observations)?;
                    for lane in Which::Mask(&self.over).iter(self.over.len()) {
                        (out.rewards[lane], out.terminated[lane], out.truncated[lane]) = (0.0, false, false);
                    }
                }
                self.note_ends(out);
            }
            AutoresetMode::SameStep => {
                self.note_ends(out);
                if self.ended {
                    if !self.observations.is_empty() {
                        self.keep_finals(out);
                    }
                    self.env.reset(Which::Mask(&self.over), None, &Options::new(), out.observations)?;
                }
            }
            AutoresetMode::Disabled => self.note_ends(out),
        }
        Ok(())
    }

    fn note_ends(&mut self, out: &Out<'_>) {
        let mut ended = false;
        for ((over, terminated), truncated) in self.over.iter_mut().zip(&*out.terminated).zip(&*out.truncated) {
            *over = *terminated | *truncated;
            ended |= *over;
        }
        self.ended = ended;
    }

    fn keep_finals(&mut self, out: &Out<'_>) {
        let (lanes, size) = (self.over.len(), self.env.about().observation.size());
        for lane in Which::Mask(&self.over).iter(lanes) {
            self.observations[lane * size..][..size].copy_from_slice(&out.observations[lane * size..][..size]);
        }
        for (channel, values) in self.info.chunks_exact_mut(lanes).enumerate() {
            self.env.info(channel, values);
        }
    }

    /// Makes lane `to` a copy of lane `from`.
    pub fn copy_lane(&mut self, from: usize, to: usize) {
        self.env.copy_lane(from, to);
        self.over[to] = self.over[from];
        self.ended |= self.over[to];
    }

    /// Makes lane `to` a copy of lane `from` of `other`.
    ///
    /// # Errors
    /// [`EnvError::Unlike`] if `other` is of another kind.
    pub fn copy_lane_from(&mut self, other: &Self, from: usize, to: usize) -> Result<(), EnvError> {
        alike(&self.env, &other.env)?;
        self.env.copy_lane_from(&other.env, from, to)?;
        self.over[to] = other.over[from];
        self.ended |= self.over[to];
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rl::walk::Push;
    use crate::rl::{Buffers, Each};

    /// Two lanes that begin together: lane 0 counts up and ends at its third step, lane 1 goes to and fro.
    fn driven(mode: AutoresetMode) -> (Autoreset<Each<Push>>, Buffers) {
        let mut env = Autoreset::new(Push::new(2), mode);
        let mut buffers = Buffers::of(env.env());
        env.reset(Which::All, Some(&[1, 2]), &Options::new(), &mut buffers.observations).unwrap();
        (env, buffers)
    }

    fn step(env: &mut Autoreset<Each<Push>>, buffers: &mut Buffers, number: usize) -> (f32, f64, bool, bool) {
        env.step(Actions::Discrete(&[1, [1, 0][number % 2]]), &mut buffers.out()).unwrap();
        // What happens in lane 0 is nothing to lane 1.
        assert_eq!(buffers.observations[1], [1.0, 0.0][number % 2]);
        assert!(!buffers.terminated[1]);
        (buffers.observations[0], buffers.rewards[0], buffers.terminated[0], buffers.truncated[0])
    }

    #[test]
    fn at_the_next_step_a_lane_is_reset_and_does_nothing_else() {
        let (mut env, mut buffers) = driven(AutoresetMode::NextStep);
        let seen: Vec<_> = (0..5).map(|number| step(&mut env, &mut buffers, number)).collect();
        let none = |observation, reward| (observation, reward, false, false);
        assert_eq!(seen, [none(1.0, 1.0), none(2.0, 2.0), (3.0, 3.0, true, false), none(0.0, 0.0), none(1.0, 1.0)]);
        assert_eq!(env.finals(), None);
    }

    #[test]
    fn in_the_same_step_a_lane_ends_and_begins_and_what_was_last_is_kept() {
        let (mut env, mut buffers) = driven(AutoresetMode::SameStep);
        let mut seen = Vec::new();
        for number in 0..4 {
            seen.push(step(&mut env, &mut buffers, number));
            match env.finals() {
                Some(finals) => {
                    assert_eq!((number, finals.ended), (2, &[true, false][..]));
                    assert_eq!((finals.observations[0], finals.info[0]), (3.0, 3.0));
                }
                None => assert_ne!(number, 2),
            }
        }
        let none = |observation, reward| (observation, reward, false, false);
        assert_eq!(seen, [none(1.0, 1.0), none(2.0, 2.0), (0.0, 3.0, true, false), none(1.0, 1.0)]);
        // Info is that of the episode that has begun.
        let mut taken = [0.0; 2];
        env.env().info(0, &mut taken);
        assert_eq!(taken, [1.0, 4.0]);
    }

    #[test]
    fn info_of_the_end_is_kept_or_not_as_is_asked_and_changes_nothing_else() {
        let (mut env, mut buffers) = driven(AutoresetMode::SameStep);
        let (mut other, mut others) = (env.clone(), buffers.clone());
        other.keep(Kept::Observations);
        let (mut none, mut nones) = (env.clone(), buffers.clone());
        none.keep(Kept::Nothing);
        for number in 0..3 {
            let all = step(&mut env, &mut buffers, number);
            assert_eq!(all, step(&mut other, &mut others, number));
            assert_eq!(all, step(&mut none, &mut nones, number));
        }
        assert_eq!((buffers, none.finals(), none.over()), (nones, None, env.over()));
        let (with, without) = (env.finals().unwrap(), other.finals().unwrap());
        assert_eq!((with.ended, with.observations[0]), (without.ended, without.observations[0]));
        assert_eq!((with.info, without.info), (&[3.0, 3.0][..], &[][..]));
        other.keep(Kept::All);
        (3..6).for_each(|number| {
            step(&mut other, &mut others, number);
        });
        assert_eq!(other.finals().unwrap().info[0], 3.0);
    }

    #[test]
    fn without_resets_a_lane_waits_for_its_mask() {
        let (mut env, mut buffers) = driven(AutoresetMode::Disabled);
        (0..3).for_each(|number| {
            step(&mut env, &mut buffers, number);
        });
        assert_eq!(env.over(), [true, false]);
        let before = buffers.observations[1];
        env.reset(Which::Mask(&[true, false]), None, &Options::new(), &mut buffers.observations).unwrap();
        assert_eq!((env.over(), buffers.observations[0], buffers.observations[1]), (&[false, false][..], 0.0, before));
        assert_eq!(step(&mut env, &mut buffers, 3), (1.0, 1.0, false, false));
    }

    #[test]
    fn a_reset_of_one_lane_leaves_the_automatic_reset_of_another() {
        let mut env = Autoreset::new(Push::new(2), AutoresetMode::NextStep);
        let mut buffers = Buffers::of(env.env());
        env.reset(Which::All, Some(&[1, 2]), &Options::new(), &mut buffers.observations).unwrap();
        (0..3).for_each(|_| env.step(Actions::Discrete(&[1, 1]), &mut buffers.out()).unwrap());
        env.reset(Which::Mask(&[false, true]), None, &Options::new(), &mut buffers.observations).unwrap();
        assert_eq!(env.over(), [true, false]);
        env.step(Actions::Discrete(&[1, 1]), &mut buffers.out()).unwrap();
        assert_eq!((buffers.observations.as_slice(), buffers.rewards.as_slice()), (&[0.0, 1.0][..], &[0.0, 1.0][..]));
    }

    #[test]
    fn a_copied_lane_is_over_if_its_source_is() {
        let (mut env, mut buffers) = driven(AutoresetMode::NextStep);
        (0..3).for_each(|number| {
            step(&mut env, &mut buffers, number);
        });
        let snapshot = env.clone();
        env.copy_lane(0, 1);
        assert_eq!(env.over(), [true, true]);
        env.copy_lane_from(&snapshot, 1, 0).unwrap();
        assert_eq!(env.over(), [false, true]);
    }
}
