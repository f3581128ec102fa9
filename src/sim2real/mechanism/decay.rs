//! How far what decays exponentially has come after a step.

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
            let gained = time_constant.iter().map(|tau| if *tau > 0.0 { -(-step / tau).exp_m1() } else { 1.0 });
            self.gained.extend(gained);
        }
        &self.gained
    }
}
