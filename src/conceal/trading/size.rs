//! How large an effect is: what it changes in what a log shows, over the noise there.

use super::case::Assumed;
use super::effect::{Effect, Foreign};
use super::executed::Outcome;
use super::floor::Scene;

/// Where an effect shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Channel {
    /// Costs of fills.
    Cost,
    /// Fees.
    Fee,
    /// The part filled.
    Filled,
    /// What was seen when orders were decided.
    Seen,
    /// The recorded mid after fills.
    Mid,
}

/// What the part filled is taken to be known to.
const FILLED: f64 = 0.02;

impl Channel {
    /// Where `effect` shows in a market that does or does not react.
    pub fn of(effect: &Effect, reacts: bool) -> Self {
        match effect {
            Effect::Displacement { .. } if reacts => Self::Mid,
            Effect::Toxic { .. } | Effect::Foreign(Foreign::Followers { .. }) => Self::Mid,
            Effect::Fee(_) | Effect::Foreign(Foreign::Turnover { .. }) => Self::Fee,
            Effect::Cap { .. } | Effect::Lots { .. } | Effect::Queue { .. } => Self::Filled,
            Effect::Foreign(Foreign::LastLook { .. }) => Self::Filled,
            Effect::Age { .. } => Self::Seen,
            _ => Self::Cost,
        }
    }

    /// What the channel shows of each order: costs, fees and what was seen in bps of the mid at the decision; none where there is
    /// nothing to be shown.
    pub fn shows(self, scene: &Scene<'_>, outcome: &Outcome) -> Vec<Option<f64>> {
        let orders = scene.orders.iter().zip(&outcome.executions);
        let one = |(order, execution): (&super::client::Intent, &super::executed::Execution)| {
            let mid = execution.decided.mid();
            match self {
                Self::Cost if order.rests.is_some() => None,
                Self::Cost => {
                    let assumed = match scene.price {
                        Assumed::Touch => execution.decided.touch(order.buys) as f64,
                        Assumed::Mid => mid,
                    };
                    Some(order.sign() * (execution.price()? - assumed) / mid * 1e4)
                }
                Self::Fee => Some(execution.fee / (execution.filled() * execution.price()? * super::climate::TICK) * 1e4),
                Self::Filled => Some(execution.filled() / order.quantity),
                Self::Seen => Some((execution.seen.mid() - mid) / mid * 1e4),
                Self::Mid => Some(execution.kick),
            }
        };
        orders.map(one).collect()
    }

    /// Standard deviation of its noise, of which the recorded mid's is given.
    pub fn noise(self, scene: &Scene<'_>, mid: f64) -> f64 {
        match self {
            Self::Cost | Self::Fee | Self::Seen => scene.noise,
            Self::Filled => FILLED,
            Self::Mid => mid,
        }
    }
}

/// Root mean square of the differences of what is there both times; with `about_mean` what is constant does not count.
pub(super) fn difference(with: &[Option<f64>], without: &[Option<f64>], about_mean: bool) -> f64 {
    let moved: Vec<f64> = with.iter().zip(without).filter_map(|(with, without)| Some((*with)? - (*without)?)).collect();
    let count = moved.len().max(1) as f64;
    let mean = if about_mean { moved.iter().sum::<f64>() / count } else { 0.0 };
    (moved.iter().map(|change| (change - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// The strength at which `size` is `target`, as near as a few steps come and `range` allows.
pub(super) fn strength(target: f64, range: (f64, f64), size: impl Fn(f64) -> f64) -> f64 {
    let mut at = (range.0 * range.1).sqrt();
    for _ in 0..12 {
        let found = size(at).max(1e-6);
        if (found / target).ln().abs() < 0.03 {
            break;
        }
        // Less than a proportional effect would ask for: what grows as the square of its strength would overshoot.
        let next = (at * (target / found).powf(0.7).clamp(0.05, 20.0)).clamp(range.0, range.1);
        if next == at {
            break;
        }
        at = next;
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strength_is_found_for_roots_and_squares() {
        for power in [0.5, 1.0, 1.5, 2.0] {
            let found = strength(3.0, (1e-3, 1e3), |s| 2.0 * s.powf(power));
            assert!((2.0 * found.powf(power) / 3.0).ln().abs() < 0.04, "{power}: {found}");
        }
        assert_eq!(strength(3.0, (1e-3, 0.5), |s| s), 0.5);
    }

    #[test]
    fn differences_are_of_what_is_there_both_times() {
        let with = [Some(3.0), None, Some(5.0), Some(9.0)];
        let without = [Some(1.0), Some(7.0), Some(1.0), None];
        assert!((difference(&with, &without, false) - 10.0_f64.sqrt()).abs() < 1e-12);
        assert!((difference(&with, &without, true) - 1.0).abs() < 1e-12);
    }
}
