//! A spring towards position 0: a cable, a bellows, a return spring.

use crate::robot::Mover;
use crate::sim2real::{About, Form, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `-rate q`.
///
/// Source: Hooke, *De potentia restitutiva* (1678).
#[derive(Debug, Clone, Copy)]
pub struct Stiffness;

impl<P: Mover> Mechanism<P> for Stiffness {
    fn about(&self) -> About {
        About {
            name: "stiffness",
            site: Site::Plant,
            title: "a spring",
            law: "inertia a = ... - rate q",
            source: "Hooke, De potentia restitutiva (1678)",
            remedy: "look for a cable, hose or return spring; add its rate to the simulator",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.05, 0.3].map(|fraction| fraction * typical.effort / typical.output.max(1e-12));
        Form::only(vec![
            Parameter::new("rate", "N m/rad", 0.0).within(0.0, f64::INFINITY).starting_at(&starts).proportional(),
        ])
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        Box::new(Spring(thetas.row(0).to_vec()))
    }
}

struct Spring(Vec<f64>);

impl<P: Mover> Law<P> for Spring {
    fn act(&mut self, _: Tick, _: &Scene<'_, P>, effects: &mut [P::Effect]) {
        effects.iter_mut().zip(&self.0).for_each(|(effect, rate)| P::push(effect).stiffness += rate);
    }
}
