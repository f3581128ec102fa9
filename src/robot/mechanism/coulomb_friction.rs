//! Dry friction: the same against slow motion as against fast, and enough to hold the joint where it is.

use crate::robot::Mover;
use crate::sim2real::{About, Form, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `-torque sign(v)` in motion; at rest, whatever holds the joint, up to `torque`.
///
/// Source: Coulomb, *Théorie des machines simples* (1785); Armstrong-Hélouvry, Dupont & Canudas de Wit, "A survey of
/// models, analysis tools and compensation methods for the control of machines with friction", Automatica 30 (1994).
#[derive(Debug, Clone, Copy)]
pub struct CoulombFriction;

impl<P: Mover> Mechanism<P> for CoulombFriction {
    fn about(&self) -> About {
        About {
            name: "coulomb_friction",
            site: Site::Plant,
            title: "Coulomb friction",
            law: "inertia a = ... - torque sign(v); holds up to torque at rest",
            source: "Coulomb (1785); Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994)",
            remedy: "add dry friction to the joint, and compensate it in the controller",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.03, 0.15, 0.4].map(|fraction| fraction * typical.effort);
        Form::only(vec![Parameter::new("torque", "N m", 0.0).within(0.0, f64::INFINITY).starting_at(&starts)])
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        Box::new(Friction(thetas.row(0).to_vec()))
    }
}

struct Friction(Vec<f64>);

impl<P: Mover> Law<P> for Friction {
    fn act(&mut self, _: Tick, _: &Scene<'_, P>, effects: &mut [P::Effect]) {
        effects.iter_mut().zip(&self.0).for_each(|(effect, torque)| P::push(effect).dry_friction += torque);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{Axis, Commands, Joint, MECHANISMS};
    use crate::sim2real::{Assembly, Recording, Seed, Simulator};

    /// A push below the friction torque moves nothing, however long it lasts; one above does, and when it ends the joint
    /// stops and stays to the bit.
    #[test]
    fn a_stuck_joint_stays_stuck() {
        let time: Vec<f64> = (0..3_000).map(|i| f64::from(i) * 1e-3).collect();
        let push = |t: &f64| {
            if *t < 1.0 {
                0.19
            } else if *t < 1.5 {
                0.5
            } else {
                -0.19
            }
        };
        let recording =
            Recording { name: "push".into(), stimulus: Commands(time.iter().map(push).collect()), measured: vec![], time };
        let arm = Joint::new(Axis::Rotary, [0.11, 0.05, 0.0, 1.0], [0.0; 4]);
        let form = Mechanism::<Joint>::forms(&CoulombFriction, &Typical::default())[0].parameters.clone();
        let stuck = Assembly::new(arm, MECHANISMS).with_mechanism(&CoulombFriction, 0, form);
        let thetas = Thetas::single(&[0.11, 0.05, 0.0, 1.0, 0.2, 0.3, 0.0]);
        let position = &stuck.rollout(&thetas, &recording, 0..3_000, Seed(0))[0][0].samples;
        assert!(position[..1_000].iter().all(|q| *q == 0.3));
        assert!(position[1_500] > 0.4);
        assert_eq!(position[2_900], position[2_999]);
    }
}
