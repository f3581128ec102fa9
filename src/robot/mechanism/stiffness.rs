//! A spring towards position 0: a cable, a bellows, a return spring.

use crate::robot::{Joint, JointEffect, JointState, Torque};
use crate::sim2real::{About, Form, Law, Mechanism, Parameter, Seed, Site, Thetas, Tick, Typical};

/// `-rate q`.
///
/// Source: Hooke, *De potentia restitutiva* (1678).
#[derive(Debug, Clone, Copy)]
pub struct Stiffness;

impl Mechanism<Joint> for Stiffness {
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
        Form::only(vec![Parameter::new("rate", "N m/rad", 0.0).within(0.0, f64::INFINITY).starting_at(&starts)])
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Joint>> {
        Box::new(Spring(thetas.row(0).to_vec()))
    }
}

struct Spring(Vec<f64>);

impl Law<Joint> for Spring {
    fn act(&mut self, _: Tick, _: &[JointState], _: &[()], _: &[Torque], effects: &mut [JointEffect]) {
        effects.iter_mut().zip(&self.0).for_each(|(effect, rate)| effect.stiffness += rate);
    }
}
