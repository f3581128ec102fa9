//! How far what decays exponentially has come after a step.

use crate::sim2real::LaneChange;

/// Steps that are kept: times in decimals are apart by a few numbers that differ in their last bits, and come again and again.
const KEPT: usize = 4;

/// `1 - exp(-step / time_constant)` over lanes, kept for the last few steps that differ: an exponential costs more than all the rest of
/// most laws.
#[derive(Debug, Clone, Default)]
pub(super) struct Decay {
    kept: Vec<(f64, Vec<f64>)>,
    /// Where the next step goes that is not among them.
    next: usize,
}

impl Decay {
    /// The part of the way to its end that each lane goes in `step` [s]; all of it where the time constant is 0, nothing where
    /// it is infinite.
    pub(super) fn over(&mut self, step: f64, time_constant: &[f64]) -> &[f64] {
        let known = self.kept.iter().position(|(own, _)| own.to_bits() == step.to_bits());
        let place = known.unwrap_or_else(|| {
            let place = self.next;
            self.next = (place + 1) % KEPT;
            if place == self.kept.len() {
                self.kept.push((step, Vec::with_capacity(time_constant.len())));
            }
            let (own, all) = &mut self.kept[place];
            *own = step;
            all.clear();
            all.extend(time_constant.iter().map(|tau| gained(step, *tau)));
            place
        });
        &self.kept[place].1
    }

    /// Follows a change of the time constants [s], which has been made: what is kept here is no lane's own.
    pub(super) fn change(&mut self, change: &LaneChange<'_>, time_constant: &[f64]) {
        if let Some(lane) = change.retuned() {
            for (step, all) in &mut self.kept {
                if let Some(own) = all.get_mut(lane) {
                    *own = gained(*step, time_constant[lane]);
                }
            }
        }
    }
}

/// The part of the way that a lane goes in `step` [s].
pub(super) fn gained(step: f64, time_constant: f64) -> f64 {
    if time_constant > 0.0 { -(-step / time_constant).exp_m1() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_that_come_again_are_known_and_as_they_were() {
        let mut decay = Decay::default();
        let constants = [0.02, 0.0, f64::INFINITY];
        for k in 0..60_u32 {
            let step = 4e-3 + f64::from(k * k % 7) * 1e-16;
            assert_eq!(decay.over(step, &constants), constants.map(|tau| gained(step, tau)));
        }
        assert_eq!(decay.kept.len(), KEPT);
    }
}
