//! Springs that may be stiffer than a step can follow.

/// Inertia [kg m^2] by which a spring of `stiffness` [N m/rad] on `inertia` [kg m^2] is to seem heavier in a step of `step` [s]
/// that meets it in its middle.
///
/// A twelfth of `step^2 stiffness` takes the error of the period to fourth order (Fox & Goodwin, Proceedings of the Cambridge
/// Philosophical Society 45 (1949)); a quarter is the trapezoidal rule, which no stiffness makes unstable (Newmark, ASCE
/// Journal of the Engineering Mechanics Division 85 (1959)). What is between them here is stable at any stiffness too: that
/// takes more than `1/4 - 1/a`, where `a = step^2 stiffness / inertia`.
pub(super) fn spring_inertia(stiffness: f64, inertia: f64, step: f64) -> f64 {
    let whole = step * step * stiffness;
    whole * (0.25 - inertia / (6.0 * inertia + whole))
}

/// What a body meets of a wall that pushes and never pulls, during one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Contact {
    /// Effort off the wall, but for what the damping does [N m].
    pub effort: f64,
    /// Damping [N m s/rad].
    pub damping: f64,
    /// Inertia that the spring adds for being met in the middle of the step [kg m^2].
    pub inertia: f64,
}

/// A wall: a spring beside a damper.
///
/// Source: Kelvin and Voigt's body as a contact, held to pushing: Gilardi & Sharf, "Literature survey of contact dynamics
/// modelling", Mechanism and Machine Theory 37 (2002), section 3.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wall {
    /// Stiffness [N m/rad].
    pub stiffness: f64,
    /// Damping over critical damping.
    pub damping_ratio: f64,
    /// Inertia that meets it [kg m^2].
    pub inertia: f64,
}

impl Wall {
    /// What a body meets that is `depth` [rad] inside the wall at the start of a step of `step` [s] and gets deeper at
    /// `rate` [rad/s]; nothing where it does not reach the wall.
    ///
    /// Where it enters or leaves within the step, the spring and the damper act for that part of it: so that what comes of
    /// it moves evenly with where the wall is.
    #[inline]
    pub(super) fn meet(&self, depth: f64, rate: f64, step: f64) -> Option<Contact> {
        let dip = Dip::of(depth, rate, step).filter(|_| self.stiffness > 0.0)?;
        let effort = self.stiffness * 0.5 * (dip.low + dip.high) * dip.share;
        let damping = dip.share * 2.0 * self.damping_ratio * (self.stiffness * self.inertia).sqrt();
        let inertia = dip.share * spring_inertia(self.stiffness, self.inertia, step);
        Some(Contact { effort, damping: pushing(damping, effort, rate), inertia })
    }
}

/// A rounded wall: its spring gets stiffer with depth, and what it loses grows with the effort.
///
/// Source: Hunt & Crossley, "Coefficient of restitution interpreted as damping in vibroimpact", Journal of Applied Mechanics 42
/// (1975), with Hertz's exponent of 3/2.
#[derive(Debug, Clone, Copy)]
pub(super) struct RoundWall {
    /// Effort at a depth of 1 rad [N m/rad^1.5].
    pub stiffness: f64,
    /// By what share the effort grows with the speed of going deeper [s/rad].
    pub dissipation: f64,
    /// Inertia that meets it [kg m^2].
    pub inertia: f64,
}

impl RoundWall {
    /// As [`Wall::meet`].
    #[inline]
    pub(super) fn meet(&self, depth: f64, rate: f64, step: f64) -> Option<Contact> {
        let dip = Dip::of(depth, rate, step).filter(|_| self.stiffness > 0.0)?;
        let middle = 0.5 * (dip.low + dip.high);
        let at = |depth: f64| self.stiffness * depth * depth.sqrt();
        // Simpson's rule, within a hundredth of the mean where the wall is entered, and far nearer within it.
        let effort = dip.share * (at(dip.low) + 4.0 * at(middle) + at(dip.high)) / 6.0;
        let tangent = 1.5 * self.stiffness * middle.sqrt();
        let inertia = dip.share * spring_inertia(tangent, self.inertia, step);
        Some(Contact { effort, damping: pushing(self.dissipation * effort, effort, rate), inertia })
    }
}

/// The part of a step that is spent within a wall.
#[derive(Debug, Clone, Copy)]
struct Dip {
    /// The least depth and the greatest [rad].
    low: f64,
    high: f64,
    /// How much of the step it is.
    share: f64,
}

impl Dip {
    #[inline]
    fn of(depth: f64, rate: f64, step: f64) -> Option<Self> {
        let end = depth + step * rate;
        let (low, high) = (depth.min(end), depth.max(end));
        if high <= 0.0 {
            return None;
        }
        Some(if low >= 0.0 { Self { low, high, share: 1.0 } } else { Self { low: 0.0, high, share: high / (high - low) } })
    }
}

/// As much of the `damping` [N m s/rad] beside `effort` [N m] as leaves a wall pushing at `rate` [rad/s].
#[inline]
fn pushing(damping: f64, effort: f64, rate: f64) -> f64 {
    if rate < 0.0 { damping.min(effort / -rate) } else { damping }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The period of a mass on a spring, in steps that meet the spring in their middle, at `angle` [rad] a step.
    fn turned(angle: f64) -> f64 {
        let (stiffness, inertia, step) = (angle * angle, 1.0, 1.0);
        let heavier = inertia + spring_inertia(stiffness, inertia, step);
        // The step's matrix has the trace 2 cos(angle turned).
        (1.0 - 0.5 * step * step * stiffness / heavier).acos()
    }

    #[test]
    fn the_period_is_right_to_fourth_order_and_no_stiffness_is_too_much() {
        for angle in [0.05, 0.1, 0.2, 0.4] {
            let error = (turned(angle) / angle - 1.0).abs();
            assert!(error < 0.02 * angle.powi(4), "{angle}: {error}");
        }
        assert!([1.0, 3.0, 10.0, 1e3, 1e6].iter().all(|angle| turned(*angle).is_finite()));
    }

    #[test]
    fn what_a_wall_does_moves_evenly_with_where_it_is_and_never_pulls() {
        let step = 1e-3;
        let wall = Wall { stiffness: 1e4, damping_ratio: 1.0, inertia: 0.1 };
        let round = RoundWall { stiffness: 1e5, dissipation: 2.0, inertia: 0.1 };
        evenly(|depth, rate| wall.meet(depth, rate, step));
        evenly(|depth, rate| round.meet(depth, rate, step));
    }

    /// Holds a wall of at most 1e4 N m/rad to that, met at 2 rad/s and left as fast.
    fn evenly(meet: impl Fn(f64, f64) -> Option<Contact>) {
        let rate = 2.0;
        let mut before: Option<Contact> = None;
        for k in 0..400 {
            let depth = -3e-3 + f64::from(k) * 1e-5;
            let now = meet(depth, rate).unwrap_or(Contact { effort: 0.0, damping: 0.0, inertia: 0.0 });
            if let Some(before) = before {
                assert!((now.effort - before.effort).abs() <= 1e4 * 1.001e-5);
                assert!((now.damping - before.damping).abs() < 0.01 * 64.0);
            }
            before = Some(now);
            if let Some(leaving) = meet(depth, -rate) {
                assert!(leaving.effort - leaving.damping * rate >= -1e-12);
            }
        }
    }
}
