//! What bends before it slips: how far it is drawn, from -1 to 1, remembers where it came from.

use crate::robot::Mover;
use crate::sim2real::{LaneChange, Scene, Tick};

/// Where a lane was in the middle of its last step [rad], and how far its loop was drawn.
#[derive(Debug, Clone, Copy)]
struct Place {
    position: f64,
    level: f64,
}

/// Loops that yield after an angle [rad], one a lane.
#[derive(Debug, Clone)]
pub(super) struct Drawn {
    angle: Vec<f64>,
    memory: Vec<Option<Place>>,
}

impl Drawn {
    /// Loops that have not been drawn yet, with the angles of their lanes.
    pub fn new(angle: &[f64]) -> Self {
        Self { angle: angle.to_vec(), memory: vec![None; angle.len()] }
    }

    /// Changes one lane, of whose parameters the angle is number `parameter`.
    pub fn change(&mut self, parameter: usize, change: &LaneChange<'_>) {
        self.change_by(|values| values[parameter], change);
    }

    /// Changes one lane, whose angle follows from its parameters.
    pub fn change_by(&mut self, angle: impl FnOnce(&[f64]) -> f64, change: &LaneChange<'_>) {
        change.derived(&mut self.angle, angle);
        change.memory(&mut self.memory);
    }

    /// How far the loop of a lane is drawn; 0 where it never was.
    pub fn level(&self, lane: usize) -> f64 {
        self.memory[lane].map_or(0.0, |drawn| drawn.level)
    }

    /// Pulls each lane back by its torque [N m] times how far it is drawn; `drawn_by` gives that after a way in units of the yield angle.
    pub fn pull<P: Mover>(
        &mut self,
        tick: Tick,
        scene: &Scene<'_, P>,
        effects: &mut [P::Effect],
        torque: &[f64],
        drawn_by: impl Fn(usize, f64, f64) -> f64,
    ) {
        let parameters = torque.iter().zip(&self.angle).zip(&mut self.memory);
        let lanes = effects.iter_mut().zip(scene.states).zip(parameters).enumerate();
        for (lane, ((effect, state), ((torque, angle), memory))) in lanes {
            if *torque <= 0.0 {
                continue;
            }
            let motion = P::motion(state);
            let midway = motion.midway(tick.step);
            // It must not be stiffer than a step can follow: by then it is dry friction in all but name.
            let least = torque * tick.step * tick.step / P::inertia(scene.dynamics, lane, state);
            let drawn = memory.get_or_insert(Place { position: motion.position, level: 0.0 });
            drawn.level = drawn_by(lane, drawn.level, (midway - drawn.position) / angle.max(least));
            drawn.position = midway;
            P::push(effect).effort -= torque * drawn.level;
        }
    }
}

/// The level after a way in units of the yield angle: elastic back to 0, and from there on loading, which `loaded` does from a
/// level of at least 0.
#[inline]
pub(super) fn moved(level: f64, way: f64, loaded: impl Fn(f64, f64) -> f64) -> f64 {
    let back = if level * way < 0.0 { way.abs().min(level.abs()) } else { 0.0 };
    let level = level + way.signum() * back;
    let further = way.abs() - back;
    if further > 0.0 { way.signum() * loaded(level.abs(), further) } else { level }
}

/// `dw = (1 - w) dx`, exactly.
#[inline]
pub(super) fn soft(level: f64, way: f64) -> f64 {
    1.0 - (1.0 - level) * (-way).exp()
}

/// `dw = (1 - w^2) dx`, exactly: `tanh(artanh(level) + way)`, by one exponential.
#[inline]
pub(super) fn sharp(level: f64, way: f64) -> f64 {
    let left = (-2.0 * way).exp();
    let (sum, difference) = (1.0 + left, 1.0 - left);
    (level * sum + difference) / (sum + level * difference)
}
