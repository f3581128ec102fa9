//! Drag that grows with the square of the speed: air, water, a fan.

use crate::robot::{Mover, Push};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `-coefficient |v| v`, taken as a damping so that no step can overshoot it; in the form `power`,
/// `-unit_torque |v|^power sign(v)`, where `unit_torque` is that at 1 rad/s.
///
/// Source: Rayleigh's drag equation (1876), as in Fossen, *Handbook of Marine Craft Hydrodynamics* (2011), section 6.4; other
/// powers as the coefficient of drag changes with Reynolds number: Hoerner, *Fluid-Dynamic Drag* (1965).
#[derive(Debug, Clone, Copy)]
pub struct QuadraticDrag;

impl<P: Mover> Mechanism<P> for QuadraticDrag {
    fn about(&self) -> About {
        About {
            name: "quadratic_drag",
            site: Site::Plant,
            title: "quadratic drag",
            law: "inertia a = ... - coefficient |v| v",
            source: "Rayleigh's drag equation (1876); Fossen, Handbook of Marine Craft Hydrodynamics (2011), 6.4",
            remedy: "add drag to the simulator, or keep to speeds at which it does not matter",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.05, 0.5].map(|fraction| fraction * typical.effort / (typical.rate * typical.rate).max(1e-12));
        let drag =
            |name, unit| Parameter::new(name, unit, 0.0).within(0.0, f64::INFINITY).starting_at(&starts).proportional();
        // A power of 1 is viscous friction, which the plant has.
        let power = Parameter::new("power", "", 2.0).within(1.0, 4.0).starting_at(&[1.5, 3.0]);
        vec![
            Form { name: "square", parameters: vec![drag("coefficient", "N m s^2/rad^2")] },
            Form { name: "power", parameters: vec![drag("unit_torque", "N m"), power] },
        ]
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let coefficient = thetas.row(0).to_vec();
        if form == 0 {
            return Box::new(Drag(coefficient));
        }
        Box::new(PowerDrag { coefficient, beyond_linear: thetas.row(1).iter().map(|power| power - 1.0).collect() })
    }
}

#[derive(Clone)]
struct Drag(Vec<f64>);

impl<P: Mover> Law<P> for Drag {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        for ((effect, state), coefficient) in effects.iter_mut().zip(scene.states).zip(&self.0) {
            drag(P::push(effect), coefficient * P::motion(state).velocity.abs(), 1.0, tick.step);
        }
    }
}

#[derive(Clone)]
struct PowerDrag {
    coefficient: Vec<f64>,
    /// The power less 1.
    beyond_linear: Vec<f64>,
}

impl<P: Mover> Law<P> for PowerDrag {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.coefficient);
        change.derived(&mut self.beyond_linear, |values| values[1] - 1.0);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let parameters = self.coefficient.iter().zip(&self.beyond_linear);
        for ((effect, state), (coefficient, beyond)) in effects.iter_mut().zip(scene.states).zip(parameters) {
            if *coefficient > 0.0 {
                let damping = coefficient * P::motion(state).velocity.abs().powf(*beyond);
                drag(P::push(effect), damping, *beyond, tick.step);
            }
        }
    }
}

/// Drag of `damping` [N m s/rad] at the start of a step of `step` [s], which grows with the `beyond`-th power of the speed.
///
/// A damping meets the mean of the velocities before and after the step; that it also grows or falls on the way counts like
/// an inertia against the change of velocity: with it the drag is that of the middle of the step, to second order.
#[inline]
fn drag(push: &mut Push, damping: f64, beyond: f64, step: f64) {
    push.damping += damping;
    push.inertia += 0.5 * step * beyond * damping;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;

    /// Coasting down: `v = v0 (1 + (p - 1) c v0^(p - 1) t / I)^(-1 / (p - 1))`.
    #[test]
    fn it_coasts_down_as_the_closed_form_has_it() {
        let trial = Trial { parameters: [0.1, 0.0, 0.0, 1.0], position: 0.0, velocity: 4.0, step: 1e-3 };
        for (form, values, power) in [(0, vec![0.05], 2.0), (1, vec![0.05, 1.5], 1.5), (1, vec![0.05, 2.6], 2.6)] {
            let motion = trial.follow(&QuadraticDrag, form, &values, &[0.0; 2_001]);
            let beyond: f64 = power - 1.0;
            let expected = 4.0 * (1.0 + beyond * 0.05 * 4.0_f64.powf(beyond) * 2.0 / 0.1).powf(-1.0 / beyond);
            assert!((motion[2_000].velocity / expected - 1.0).abs() < 2e-6, "{power}: {}", motion[2_000].velocity);
        }
    }
}
