//! An effort that goes with the velocity in whatever way: what a law of another kind has to beat.

use crate::robot::Mover;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `-torque(v)`, a line through `far_below` at `-reach`, `below` at `-reach / 3`, 0 at rest, `above` at `reach / 3` and `far_above` at
/// `reach`, which goes on straight beyond.
///
/// It is no law and stands for none, and so no diagnosis names it; a twin may have it as the table of a friction that was measured.
///
/// Source: friction as a static map of velocity, Armstrong-Hélouvry, Dupont & Canudas de Wit, "A survey of models, analysis tools and
/// compensation methods for the control of machines with friction", Automatica 30 (1994), section 2.
#[derive(Debug, Clone, Copy)]
pub struct VelocityCurve;

/// Where the line is bent, in units of its reach: at rest it is 0.
const KNOTS: [f64; 5] = [-1.0, -1.0 / 3.0, 0.0, 1.0 / 3.0, 1.0];

impl<P: Mover> Mechanism<P> for VelocityCurve {
    fn about(&self) -> About {
        About {
            name: "velocity_curve",
            site: Site::Plant,
            title: "an effort that goes with the velocity",
            law: "inertia a = ... - torque(v), a line through five points",
            source: "Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994), 2",
            remedy: "measure the effort that it takes to move at a constant velocity, in both directions",
            // Of those that depend on load or on the past besides, most of what they do.
            contains: &["coulomb_friction", "stribeck_friction", "load_friction", "quadratic_drag", "hysteresis"],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.05, 0.2].map(|fraction| fraction * typical.effort);
        let torque = |name| Parameter::new(name, "N m", 0.0).starting_at(&starts).proportional();
        let rate = typical.rate.max(1e-9);
        let reach = Parameter::new("reach", "rad/s", rate).within(1e-9 * rate.min(1.0), f64::INFINITY).known_to(0.0);
        Form::only(vec![torque("far_below"), torque("below"), torque("above"), torque("far_above"), reach])
    }

    fn nameless(&self) -> bool {
        true
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let curve = |lane: usize| Curve::through([0, 1, 2, 3, 4].map(|k| thetas.row(k)[lane]));
        Box::new(Curves((0..thetas.lanes()).map(curve).collect()))
    }
}

/// The curve of one lane.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Curve {
    /// Efforts at the knots [N m].
    efforts: [f64; 5],
    /// The velocity at which the last of them is met [rad/s].
    reach: f64,
}

impl Curve {
    fn through([far_below, below, above, far_above, reach]: [f64; 5]) -> Self {
        Self { efforts: [far_below, below, 0.0, above, far_above], reach }
    }

    /// The effort at `velocity`, and how it changes with that.
    fn at(&self, velocity: f64) -> (f64, f64) {
        let x = velocity / self.reach;
        let piece = KNOTS[1..4].iter().filter(|knot| x >= **knot).count();
        let slope = (self.efforts[piece + 1] - self.efforts[piece]) / (KNOTS[piece + 1] - KNOTS[piece]);
        (self.efforts[piece] + slope * (x - KNOTS[piece]), slope / self.reach)
    }
}

#[derive(Clone)]
struct Curves(Vec<Curve>);

impl<P: Mover> Law<P> for Curves {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.derived(&mut self.0, |values| Curve::through([0, 1, 2, 3, 4].map(|k| values[k])));
    }

    fn act(&mut self, _: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        for ((effect, state), curve) in effects.iter_mut().zip(scene.states).zip(&self.0) {
            let velocity = P::motion(state).velocity;
            let (effort, slope) = curve.at(velocity);
            // Along the line it is on, the effort is that of the middle of the step.
            let push = P::push(effect);
            push.damping += slope;
            push.effort -= effort - slope * velocity;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;

    #[test]
    fn it_goes_through_its_points_and_on() {
        let curve = Curve::through([-4.0, -1.0, 0.5, 3.0, 6.0]);
        let points =
            [(-8.0, -5.5), (-6.0, -4.0), (-2.0, -1.0), (-1.0, -0.5), (0.0, 0.0), (2.0, 0.5), (4.0, 1.75), (6.0, 3.0)];
        for (velocity, effort) in points {
            assert!((curve.at(velocity).0 - effort).abs() < 1e-12, "{velocity}: {}", curve.at(velocity).0);
        }
    }

    /// Where it rises evenly above rest alone, what moves upwards coasts down as with a viscous friction, and what moves downwards goes on.
    #[test]
    fn one_direction_may_be_braked_alone() {
        for (velocity, expected) in [(1.5, 1.5 * (-2.0_f64).exp()), (-1.5, -1.5)] {
            let trial = Trial { parameters: [0.1, 0.0, 0.0, 1.0], position: 0.0, velocity, step: 1e-3 };
            let motion = trial.follow(&VelocityCurve, 0, &[0.0, 0.0, 0.2, 0.6, 3.0], &[0.0; 1_001]);
            assert!((motion[1_000].velocity - expected).abs() < 1e-5, "{} not {expected}", motion[1_000].velocity);
        }
    }
}
