//! Drag that grows with the square of the speed: air, water, a fan.

use crate::robot::Mover;
use crate::sim2real::{About, Form, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `-coefficient |v| v`, taken as a damping of `coefficient |v|` so that no step can overshoot it.
///
/// Source: Rayleigh's drag equation (1876), as in Fossen, *Handbook of Marine Craft Hydrodynamics* (2011), section 6.4.
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
        Form::only(vec![
            Parameter::new("coefficient", "N m s^2/rad^2", 0.0)
                .within(0.0, f64::INFINITY)
                .starting_at(&starts)
                .proportional(),
        ])
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        Box::new(Drag(thetas.row(0).to_vec()))
    }
}

struct Drag(Vec<f64>);

impl<P: Mover> Law<P> for Drag {
    fn act(&mut self, _: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        for ((effect, state), coefficient) in effects.iter_mut().zip(scene.states).zip(&self.0) {
            P::push(effect).damping += coefficient * P::motion(state).velocity.abs();
        }
    }
}
