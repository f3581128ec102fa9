//! Exponential smoothing of actions.

use super::layer::{ActionsMut, Layer, copy_row, neutral, refused};
use crate::rl::{About, EnvError, Episodes, Space, Which};

/// Hands on y + weight (action - y), where y is what it handed on a step before: a first-order lag. An episode begins with the action
/// nearest to 0.
#[derive(Debug, Clone)]
pub struct Smoothing {
    by: By,
    weight: f32,
    neutral: Vec<f32>,
    smooth: Vec<f32>,
}

#[derive(Debug, Clone, Copy)]
enum By {
    Weight(f32),
    TimeConstant(f64),
}

impl Smoothing {
    /// With this weight of the newest action, above 0 and up to 1, which changes nothing.
    #[must_use]
    pub fn by_weight(weight: f32) -> Self {
        Self::of(By::Weight(weight))
    }

    /// With this time constant [s], in which 1 - 1/e of a change is passed on: weight = 1 - exp(-step / time constant).
    #[must_use]
    pub fn by_time_constant(seconds: f64) -> Self {
        Self::of(By::TimeConstant(seconds))
    }

    fn of(by: By) -> Self {
        Self { by, weight: 1.0, neutral: Vec::new(), smooth: Vec::new() }
    }
}

impl Layer for Smoothing {
    const NAME: &'static str = "smoothing of actions";
    const SHAPES: bool = true;

    fn prepare(&mut self, about: &mut About, lanes: usize) -> Result<(), EnvError> {
        let Space::Box(space) = &about.action else {
            return Err(refused::<Self>(about, "its actions are choices", "leave it out: choices cannot be averaged"));
        };
        self.weight = match (self.by, about.seconds_a_step) {
            (By::Weight(weight), _) if weight > 0.0 && weight <= 1.0 => weight,
            (By::Weight(weight), _) => {
                return Err(refused::<Self>(about, format!("the weight is {weight}"), "give one above 0, and up to 1"));
            }
            (By::TimeConstant(_), None) => {
                return Err(refused::<Self>(about, "its steps are not equally long", "give a weight"));
            }
            (By::TimeConstant(constant), Some(seconds)) if constant > 0.0 && constant.is_finite() => {
                -(-seconds / constant).exp_m1() as f32
            }
            (By::TimeConstant(constant), _) => {
                return Err(refused::<Self>(about, format!("the time constant is {constant} s"), "give one above 0"));
            }
        };
        self.neutral = neutral(&space.low, &space.high);
        self.smooth = self.neutral.repeat(lanes);
        Ok(())
    }

    fn begin(&mut self, which: Which<'_>, _: &Episodes, _: &mut [f32]) {
        for (lane, row) in self.smooth.chunks_exact_mut(self.neutral.len().max(1)).enumerate() {
            if which.has(lane) {
                row.copy_from_slice(&self.neutral);
            }
        }
    }

    fn shape(&mut self, actions: &mut ActionsMut<'_>) {
        for (value, smooth) in actions.continuous().iter_mut().zip(&mut self.smooth) {
            // Of this form, which ends at the action itself with a weight of 1, and never beyond it.
            *smooth = self.weight * *value + (1.0 - self.weight) * *smooth;
            *value = *smooth;
        }
    }

    fn copy_lane(&mut self, other: Option<&Self>, from: usize, to: usize) {
        copy_row(&mut self.smooth, other.map(|other| other.smooth.as_slice()), self.neutral.len(), from, to);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Wrap;
    use super::*;
    use crate::rl::walk::{Push, Walk, acting};

    #[test]
    fn a_step_is_followed_by_a_first_order_lag() {
        let smoothed = Walk::new(2).with(Smoothing::by_weight(0.5)).unwrap();
        let acted = acting(smoothed, &[[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(acted, [[0.5, 0.0], [0.75, 0.5], [0.375, 0.75]]);
        let same = Walk::new(1).with(Smoothing::by_weight(1.0)).unwrap();
        assert_eq!(acting(same, &[[0.3], [-1.0]]), [[0.3], [-1.0]]);
        // After one time constant of four steps of 0.05 s, 1 - 1/e of a step is passed on.
        let slow = Walk::new(1).with(Smoothing::by_time_constant(0.2)).unwrap();
        let last = acting(slow, &[[1.0]; 4])[3][0];
        assert!((f64::from(last) - (1.0 - (-1.0_f64).exp())).abs() < 1e-6, "{last}");
    }

    #[test]
    fn what_is_no_weight_is_refused() {
        let refused = |smoothing: Smoothing| Walk::new(1).with(smoothing).unwrap_err().to_string();
        assert!(refused(Smoothing::by_weight(0.0)).contains("the weight is 0"));
        assert!(refused(Smoothing::by_weight(f32::NAN)).contains("the weight is NaN"));
        assert!(refused(Smoothing::by_time_constant(0.0)).contains("the time constant is 0 s"));
        assert!(Push::new(1).with(Smoothing::by_weight(0.5)).unwrap_err().to_string().contains("choices"));
    }
}
