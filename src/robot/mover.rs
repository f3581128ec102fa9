//! What moves: the coordinate of a plant on which mechanisms of motion act, whatever the plant is.

use crate::sim2real::Plant;

/// Where a coordinate is and how fast it moves.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// Position [rad].
    pub position: f64,
    /// Velocity [rad/s].
    pub velocity: f64,
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
    /// Effort that `command` drives it with [N m].
    fn drive(dynamics: &Self::Dynamics, lane: usize, state: &Self::State, command: &Self::Command) -> f64;
    /// Effort of everything else the plant knows of but damping, as gravity, were the coordinate at `position` [N m].
    fn external(dynamics: &Self::Dynamics, lane: usize, state: &Self::State, position: f64) -> f64;
    /// Damping the plant knows of [N m s/rad]; 0 where it has none of its own.
    fn damping(_dynamics: &Self::Dynamics, _lane: usize, _state: &Self::State) -> f64 {
        0.0
    }
}
