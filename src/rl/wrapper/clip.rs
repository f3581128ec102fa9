//! Actions clipped to their space.

use super::layer::{ActionsMut, Layer, refused};
use crate::rl::{About, EnvError, Episodes, Space, Which};

/// Takes any real number for an action, and hands on the nearest within the space: a learner whose policy is Gaussian gives what is
/// outside. Without it, such an action is an error.
#[derive(Debug, Clone, Default)]
pub struct ClipActions {
    low: Vec<f32>,
    high: Vec<f32>,
}

impl ClipActions {
    /// Clips.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

impl Layer for ClipActions {
    const NAME: &'static str = "clipping of actions";
    const SHAPES: bool = true;

    fn prepare(&mut self, about: &mut About, _lanes: usize) -> Result<(), EnvError> {
        let Space::Box(space) = &mut about.action else {
            return Err(refused::<Self>(about, "its actions are choices", "leave it out: choices have nothing to clip"));
        };
        self.low = std::mem::replace(&mut space.low, vec![f32::NEG_INFINITY; space.high.len()]);
        self.high = std::mem::replace(&mut space.high, vec![f32::INFINITY; space.low.len()]);
        Ok(())
    }

    fn begin(&mut self, _: Which<'_>, _: &Episodes, _: &mut [f32]) {}

    fn shape(&mut self, actions: &mut ActionsMut<'_>) {
        for row in actions.continuous().chunks_exact_mut(self.low.len().max(1)) {
            for ((value, low), high) in row.iter_mut().zip(&self.low).zip(&self.high) {
                *value = value.max(*low).min(*high);
            }
        }
    }

    fn copy_lane(&mut self, _: Option<&Self>, _: usize, _: usize) {}
}

#[cfg(test)]
mod tests {
    use super::super::Wrap;
    use super::*;
    use crate::rl::walk::{Push, Walk};
    use crate::rl::{Actions, Buffers, Options, VecEnv};

    #[test]
    fn what_is_outside_acts_as_the_nearest_within() {
        let mut plain = Walk::new(3);
        let mut clipped = Walk::new(3).with(ClipActions::new()).unwrap();
        assert_eq!(clipped.about().action.as_box().unwrap().high, [f32::INFINITY]);
        let (mut one, mut other) = (Buffers::of(&plain), Buffers::of(&clipped));
        plain.reset(Which::All, Some(&[1, 2, 3]), &Options::new(), &mut one.observations).unwrap();
        clipped.reset(Which::All, Some(&[1, 2, 3]), &Options::new(), &mut other.observations).unwrap();
        plain.step(Actions::Continuous(&[1.0, -1.0, 0.25]), &mut one.out()).unwrap();
        clipped.step(Actions::Continuous(&[7.0, f32::NEG_INFINITY, 0.25]), &mut other.out()).unwrap();
        assert_eq!(one, other);
    }

    #[test]
    fn choices_have_nothing_to_clip() {
        assert!(Push::new(1).with(ClipActions::new()).unwrap_err().to_string().contains("actions are choices"));
    }
}
