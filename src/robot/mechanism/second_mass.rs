//! A second mass beside the coordinate: the motor behind a gap, the link behind a spring.

use crate::robot::Motion;

/// What pulls at one mass is held up by an effort on the other against it that is no smaller and no larger than by this factor.
const HELD: f64 = 1.25;

/// What holds the second mass to the coordinate during a step, linear in what their velocities change by: the effort on the
/// second mass is `effort + rate (change of the coordinate's velocity - change of its own)`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Coupling {
    /// Effort were neither velocity to change [N m].
    pub effort: f64,
    /// What a change of velocity adds [N m s/rad].
    pub rate: f64,
}

/// What else acts on the second mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Load {
    /// Its inertia [kg m^2].
    pub inertia: f64,
    /// Effort on it [N m].
    pub effort: f64,
    /// Damping of it against the ground [N m s/rad].
    pub damping: f64,
    /// Largest effort its dry friction can hold against [N m].
    pub dry_friction: f64,
}

/// A mass that a law moves beside the coordinate that the plant moves.
///
/// Both are advanced by the same implicit step: the mass is eliminated from it (a Schur complement), which leaves an effort
/// and an inertia for the plant to add to its own, and is moved once it is known what the plant made of them. So no coupling
/// is too stiff, and one without give makes both move as one.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SecondMass {
    /// Where it is and how fast it moves, as of the start of the step under way.
    pub motion: Motion,
    step: f64,
    first: f64,
    change: f64,
    gain: f64,
}

impl SecondMass {
    /// One that starts like this.
    pub(super) fn starting(motion: Motion) -> Self {
        Self { motion, ..Self::default() }
    }

    /// Ends the step under way, now that the coordinate moves with `velocity` [rad/s].
    pub(super) fn arrive(&mut self, velocity: f64) {
        let change = self.change + self.gain * (velocity - self.first);
        self.motion.position += self.step * (self.motion.velocity + 0.5 * change);
        self.motion.velocity += change;
    }

    /// Begins a step of `step` [s]: gives the effort [N m] and the inertia [kg m^2] that the coordinate, moving with
    /// `velocity` [rad/s], is to have beside its own.
    pub(super) fn couple(&mut self, step: f64, velocity: f64, load: Load, coupling: Coupling) -> (f64, f64) {
        let own = load.inertia + 0.5 * step * load.damping;
        let all = own + step * coupling.rate;
        let mut effort = load.effort - load.damping * self.motion.velocity;
        // The change of the coordinate's velocity in the step before is the best guess of that in this one.
        let guess = if self.step > 0.0 { velocity - self.first } else { 0.0 };
        (self.step, self.first) = (step, velocity);
        if load.dry_friction > 0.0 {
            let free = self.motion.velocity + step * (effort + coupling.effort + coupling.rate * guess) / all;
            if free.abs() <= step * load.dry_friction / all {
                (self.change, self.gain) = (-self.motion.velocity, 0.0);
                return (-coupling.effort - coupling.rate * self.motion.velocity, step * coupling.rate);
            }
            effort -= load.dry_friction * free.signum();
        }
        self.change = step * (effort + coupling.effort) / all;
        self.gain = step * coupling.rate / all;
        ((effort * step * coupling.rate - coupling.effort * own) / all, step * coupling.rate * own / all)
    }
}

/// Effort with which the coordinate pulls at the second mass where both move as one: their inertias add up to
/// 1, that of the second is `share`, `on_first` and `on_second` act on them [N m].
pub(super) fn as_one(share: f64, on_first: f64, on_second: f64) -> f64 {
    share * on_first - (1.0 - share) * on_second
}

/// Whether one of two efforts [N m] holds the other up, so that what they act on rests by itself.
#[inline]
pub(super) fn holds(one: f64, other: f64) -> bool {
    one * other < 0.0 && (1.0 / HELD..=HELD).contains(&(one / other).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A coupling without give makes both masses move as one, and the two impulses add up.
    #[test]
    fn a_rigid_coupling_makes_one_mass_of_two() {
        let (first, step) = (0.3, 1e-3);
        let load = Load { inertia: 0.2, effort: 0.7, damping: 0.0, dry_friction: 0.0 };
        let mut mass = SecondMass::default();
        let (effort, inertia) = mass.couple(step, 0.0, load, Coupling { effort: 0.0, rate: 1e12 });
        let velocity = step * (0.5 + effort) / (first + inertia);
        mass.arrive(velocity);
        assert!((velocity - step * 1.2 / 0.5).abs() < 1e-12);
        assert!((mass.motion.velocity - velocity).abs() < 1e-12);
    }

    #[test]
    fn what_holds_up_pulls_the_other_way_with_about_as_much() {
        assert!(holds(1.0, -1.0) && holds(-0.9, 1.0) && holds(1.2, -1.0));
        assert!(![(1.0, 1.0), (1.5, -1.0), (0.5, -1.0), (0.0, -1.0), (0.0, 0.0)].iter().any(|(a, b)| holds(*a, *b)));
    }

    #[test]
    fn dry_friction_holds_the_mass_and_the_coordinate_leans_on_it() {
        let load = Load { inertia: 0.2, effort: 0.7, damping: 0.0, dry_friction: 1.0 };
        let mut mass = SecondMass::default();
        let (effort, inertia) = mass.couple(1e-3, 0.0, load, Coupling { effort: 0.2, rate: 100.0 });
        mass.arrive(0.001);
        assert_eq!((mass.motion.position, mass.motion.velocity), (0.0, 0.0));
        assert_eq!((effort, inertia), (-0.2, 0.1));
    }
}
