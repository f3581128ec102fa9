//! What moves: the coordinate of a plant on which mechanisms of motion act, whatever the plant is.

use crate::sim2real::{Plant, Scene};

/// Where a coordinate is and how fast it moves.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// Position [rad].
    pub position: f64,
    /// Velocity [rad/s].
    pub velocity: f64,
}

impl Motion {
    /// Where the coordinate is in the middle of a step of `step` [s]: springs and whatever else depends on the place act from there.
    #[must_use]
    pub fn midway(&self, step: f64) -> f64 {
        self.position + 0.5 * step * self.velocity
    }
}

/// What mechanisms add to a coordinate that moves; the default adds nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Push {
    /// Effort: a torque [N m], or a force.
    pub effort: f64,
    /// Spring rate towards position 0 [N m/rad].
    pub stiffness: f64,
    /// Damping [N m s/rad].
    pub damping: f64,
    /// Largest effort dry friction can hold against [N m].
    pub dry_friction: f64,
    /// The same of friction that creeps while it holds, as contacts of rigid-body engines do [N m].
    pub creeping_friction: f64,
    /// Inertia beside the plant's own [kg m^2].
    pub inertia: f64,
    /// How much faster than the coordinate that mass moves on which dry friction rubs, where it is another one [rad/s].
    pub ahead: f64,
}

impl Push {
    /// Takes away all dry friction, and gives how much it can hold against [N m].
    pub(super) fn without_dry_friction(&mut self) -> f64 {
        std::mem::take(&mut self.dry_friction) + std::mem::take(&mut self.creeping_friction)
    }
}

/// A plant with a coordinate that mechanisms of motion can act on.
///
/// Units are those of a joint; [`Plant::unit`] says what they are elsewhere. The coordinate obeys
/// `(inertia + push.inertia) a = drive + external - damping terms + push`.
pub trait Mover: Plant {
    /// How the coordinate moves.
    fn motion(state: &Self::State) -> Motion;
    /// Where a push goes.
    fn push(effect: &mut Self::Effect) -> &mut Push;
    /// Inertia of the coordinate in lane `lane` [kg m^2].
    fn inertia(dynamics: &Self::Dynamics, lane: usize, state: &Self::State) -> f64;
    /// Effort that its command drives lane `lane` with [N m].
    fn drive(scene: &Scene<'_, Self>, lane: usize) -> f64;
    /// Effort of everything else the plant knows of but damping, as gravity, were the coordinate of lane
    /// `lane` at `position` [N m].
    fn external(scene: &Scene<'_, Self>, lane: usize, position: f64) -> f64;
    /// Damping the plant knows of [N m s/rad]; 0 where it has none of its own.
    fn damping(_dynamics: &Self::Dynamics, _lane: usize, _state: &Self::State) -> f64 {
        0.0
    }
}

/// Velocity after a step that starts with `velocity` and would end with `free`, where dry friction takes up to `held` of it.
///
/// Friction is against the motion until that stops. For what is left of the step it holds the joint, or is against the new
/// motion: a turn within a step is as exact as a step without one.
#[inline]
pub(super) fn rubbed(velocity: f64, free: f64, held: f64) -> f64 {
    let on = if velocity > 0.0 { (free - held).max(0.0) } else { (free + held).min(0.0) };
    if velocity != 0.0 && on != 0.0 {
        return on;
    }
    let change = free - velocity;
    let stops = if velocity == 0.0 { 0.0 } else { velocity.abs() / (held - velocity.signum() * change) };
    (1.0 - stops) * change.signum() * (change.abs() - held).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decelerated at 3 and then accelerated at 1, as where friction of 1 helps and then hinders an effort of 2.
    #[test]
    fn a_turn_within_a_step_is_exact() {
        let (step, effort, friction) = (0.1, -2.0, 1.0);
        let after = |velocity: f64| rubbed(velocity, velocity + step * effort, step * friction);
        for velocity in [0.0, 0.03, 0.15, 0.29] {
            let turn = velocity / 3.0;
            assert!((after(velocity) + (step - turn)).abs() < 1e-12, "{velocity}");
        }
        assert!((after(0.5) - 0.2).abs() < 1e-12 && (after(-0.5) + 0.6).abs() < 1e-12);
        // What friction can hold stops, and stays.
        assert_eq!(rubbed(0.01, -0.01, 0.05), 0.0);
        assert_eq!(rubbed(0.0, 0.05, 0.05), 0.0);
    }
}
