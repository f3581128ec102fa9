//! A limit of time.

use super::layer::{Layer, copy_row, refused};
use crate::rl::{About, Actions, EnvError, Episodes, Out, Which};

/// Truncates an episode after so many steps, as Gymnasium's wrapper of this name does: also one that terminates in that step.
#[derive(Debug, Clone)]
pub struct TimeLimit {
    steps: u32,
    taken: Vec<u32>,
}

impl TimeLimit {
    /// Truncates after `steps` steps.
    #[must_use]
    pub fn new(steps: u32) -> Self {
        Self { steps, taken: Vec::new() }
    }
}

impl Layer for TimeLimit {
    const NAME: &'static str = "a time limit";

    fn prepare(&mut self, about: &mut About, lanes: usize) -> Result<(), EnvError> {
        if self.steps == 0 {
            return Err(refused::<Self>(about, "it is 0 steps", "give at least one"));
        }
        about.max_steps = Some(about.max_steps.map_or(self.steps, |steps| steps.min(self.steps)));
        self.taken = vec![0; lanes];
        Ok(())
    }

    fn begin(&mut self, which: Which<'_>, _: &Episodes, _: &mut [f32]) {
        which.iter(self.taken.len()).for_each(|lane| self.taken[lane] = 0);
    }

    fn sense(&mut self, _: Actions<'_>, out: &mut Out<'_>) {
        for (taken, truncated) in self.taken.iter_mut().zip(&mut *out.truncated) {
            *taken = taken.saturating_add(1);
            *truncated |= *taken >= self.steps;
        }
    }

    fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        copy_row(&mut self.taken, other.map(|other| other.taken.as_slice()), 1, from, to);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Wrap;
    use super::*;
    use crate::rl::walk::Walk;
    use crate::rl::{Buffers, Options, VecEnv};

    #[test]
    fn each_lane_is_cut_off_by_its_own_count() {
        let mut env = Walk::new(2).with(TimeLimit::new(3)).unwrap();
        assert_eq!(env.about().max_steps, Some(3));
        let mut buffers = Buffers::of(&env);
        env.reset(Which::All, Some(&[1, 2]), &Options::new(), &mut buffers.observations).unwrap();
        let mut seen = Vec::new();
        for step in 0..5 {
            env.step(Actions::Continuous(&[0.0, 0.0]), &mut buffers.out()).unwrap();
            seen.push(buffers.truncated.clone());
            if step == 1 {
                env.reset(Which::Mask(&[false, true]), None, &Options::new(), &mut buffers.observations).unwrap();
            }
        }
        assert_eq!(seen, [[false, false], [false, false], [true, false], [true, false], [true, true]]);
        assert_eq!(buffers.terminated, [false, false]);
    }

    #[test]
    fn the_shorter_limit_is_the_environments_and_none_is_refused() {
        let env = Walk::new(1).with(TimeLimit::new(3)).unwrap().with(TimeLimit::new(9)).unwrap();
        assert_eq!(env.about().max_steps, Some(3));
        let error = Walk::new(1).with(TimeLimit::new(0)).unwrap_err().to_string();
        assert_eq!(error, "a time limit cannot be put around `test/Walk-v0`: it is 0 steps\nhint: give at least one");
    }
}
