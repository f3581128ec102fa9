//! A load that never goes away: a tilted axis, a spring balancer, a cable's pull.

use crate::robot::Mover;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `torque += torque_0`.
///
/// Source: the offset of Janot, Gautier & Brunot, "Data set and reference models of EMPS" (2019), equation 1.
#[derive(Debug, Clone, Copy)]
pub struct ConstantLoad;

impl<P: Mover> Mechanism<P> for ConstantLoad {
    fn about(&self) -> About {
        About {
            name: "constant_load",
            site: Site::Plant,
            title: "a constant load",
            law: "inertia a = ... + torque",
            source: "offset of Janot, Gautier & Brunot, Data set and reference models of EMPS (2019), eq. 1",
            remedy: "level the axis, check the balancer and the zero of the current sensor, or add the load",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.05, -0.05].map(|fraction| fraction * typical.effort);
        Form::only(vec![Parameter::new("torque", "N m", 0.0).starting_at(&starts).proportional()])
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        Box::new(Load(thetas.row(0).to_vec()))
    }
}

#[derive(Clone)]
struct Load(Vec<f64>);

impl<P: Mover> Law<P> for Load {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn act(&mut self, _: Tick, _: &Scene<'_, P>, effects: &mut [P::Effect]) {
        effects.iter_mut().zip(&self.0).for_each(|(effect, torque)| P::push(effect).effort += torque);
    }
}
