//! How far what decays exponentially has come after a step.

use crate::sim2real::LaneChange;

/// `1 - exp(-step / time_constant)` over lanes, kept while the step stays the same: an exponential costs more than
/// all the rest of most laws.
#[derive(Debug, Clone, Default)]
pub(super) struct Decay {
    step: f64,
    gained: Vec<f64>,
}

impl Decay {
    /// The part of the way to its end that each lane goes in `step` [s]; all of it where the time constant is 0, nothing where
    /// it is infinite.
    pub(super) fn over(&mut self, step: f64, time_constant: &[f64]) -> &[f64] {
        if self.gained.is_empty() || self.step.to_bits() != step.to_bits() {
            self.step = step;
            self.gained.clear();
            self.gained.extend(time_constant.iter().map(|tau| gained(step, *tau)));
        }
        &self.gained
    }

    /// Follows a change of the time constants [s], which has been made: what is kept here is no lane's own.
    pub(super) fn change(&mut self, change: &LaneChange<'_>, time_constant: &[f64]) {
        if let Some(lane) = change.retuned()
            && let Some(own) = self.gained.get_mut(lane)
        {
            *own = gained(self.step, time_constant[lane]);
        }
    }
}

/// The part of the way that a lane goes in `step` [s].
pub(super) fn gained(step: f64, time_constant: f64) -> f64 {
    if time_constant > 0.0 { -(-step / time_constant).exp_m1() } else { 1.0 }
}
