//! A limit to how fast an action may change.

use super::layer::{ActionsMut, Layer, copy_row, neutral, refused};
use crate::rl::{About, EnvError, Episodes, Space, Which};

/// Lets each component of an action change by so much a step at the most, from that of the step before. An episode begins with the
/// action nearest to 0.
#[derive(Debug, Clone)]
pub struct RateLimit {
    most: Rate,
    step: Vec<f32>,
    neutral: Vec<f32>,
    last: Vec<f32>,
}

#[derive(Debug, Clone)]
enum Rate {
    /// In the unit of the action.
    PerStep(Vec<f32>),
    /// In the unit of the action over seconds.
    PerSecond(Vec<f32>),
}

impl RateLimit {
    /// The largest change a step of each component, in its unit; one value stands for all.
    #[must_use]
    pub fn per_step(most: &[f32]) -> Self {
        Self::of(Rate::PerStep(most.to_vec()))
    }

    /// The largest change a second of each component, in its unit over seconds; one value stands for all.
    #[must_use]
    pub fn per_second(most: &[f32]) -> Self {
        Self::of(Rate::PerSecond(most.to_vec()))
    }

    fn of(most: Rate) -> Self {
        Self { most, step: Vec::new(), neutral: Vec::new(), last: Vec::new() }
    }
}

impl Layer for RateLimit {
    const NAME: &'static str = "a rate limit";
    const SHAPES: bool = true;

    fn prepare(&mut self, about: &mut About, lanes: usize) -> Result<(), EnvError> {
        let Space::Box(space) = &about.action else {
            return Err(refused::<Self>(about, "its actions are choices", "leave it out: choices have no rate"));
        };
        let most = match (&self.most, about.seconds_a_step) {
            (Rate::PerStep(most), _) => most.clone(),
            (Rate::PerSecond(most), Some(seconds)) => most.iter().map(|rate| rate * seconds as f32).collect(),
            (Rate::PerSecond(_), None) => {
                return Err(refused::<Self>(about, "its steps are not equally long", "give the limit a step"));
            }
        };
        self.step = if let [one] = most.as_slice() { vec![*one; space.size()] } else { most };
        if self.step.len() != space.size() {
            let why = format!("{} limits for {} components", self.step.len(), space.size());
            return Err(refused::<Self>(about, why, "give one a component, or one for all"));
        }
        if let Some(bad) = self.step.iter().find(|limit| limit.is_nan() || **limit <= 0.0) {
            return Err(refused::<Self>(about, format!("a limit is {bad}"), "give limits above 0"));
        }
        self.neutral = neutral(&space.low, &space.high);
        self.last = self.neutral.repeat(lanes);
        Ok(())
    }

    fn begin(&mut self, which: Which<'_>, _: &Episodes, _: &mut [f32]) {
        let size = self.neutral.len();
        for (lane, row) in self.last.chunks_exact_mut(size.max(1)).enumerate() {
            if which.has(lane) {
                row.copy_from_slice(&self.neutral);
            }
        }
    }

    fn shape(&mut self, actions: &mut ActionsMut<'_>) {
        let size = self.step.len().max(1);
        for (row, last) in actions.continuous().chunks_exact_mut(size).zip(self.last.chunks_exact_mut(size)) {
            for ((value, last), step) in row.iter_mut().zip(last).zip(&self.step) {
                *last = value.max(*last - step).min(*last + step);
                *value = *last;
            }
        }
    }

    fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        copy_row(&mut self.last, other.map(|other| other.last.as_slice()), self.step.len(), from, to);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Wrap;
    use super::*;
    use crate::rl::walk::{Push, Walk, acting};

    #[test]
    fn an_action_changes_by_no_more_than_the_limit() {
        let limited = Walk::new(2).with(RateLimit::per_step(&[0.5])).unwrap();
        let acted = acting(limited, &[[1.0, -0.25], [1.0, 1.0], [1.0, 1.0], [-1.0, 0.0]]);
        assert_eq!(acted, [[0.5, -0.25], [1.0, 0.25], [1.0, 0.75], [0.5, 0.25]]);
        // A step takes 0.05 s.
        let limited = Walk::new(1).with(RateLimit::per_second(&[10.0])).unwrap();
        assert_eq!(acting(limited, &[[1.0], [1.0]]), [[0.5], [1.0]]);
    }

    #[test]
    fn what_is_no_limit_is_refused() {
        let refused = |limit: RateLimit| Walk::new(1).with(limit).unwrap_err().to_string();
        assert!(refused(RateLimit::per_step(&[0.0])).contains("a limit is 0"));
        assert!(refused(RateLimit::per_step(&[f32::NAN])).contains("a limit is NaN"));
        assert!(refused(RateLimit::per_step(&[1.0, 1.0])).contains("2 limits for 1 components"));
        assert!(Push::new(1).with(RateLimit::per_step(&[1.0])).unwrap_err().to_string().contains("choices"));
        assert!(Push::new(1).with(RateLimit::per_second(&[1.0])).is_err());
    }
}
