//! Dry friction: the same against slow motion as against fast, and enough to hold the joint where it is.

use super::Hysteresis;
use crate::robot::Mover;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `-torque sign(v)` in motion; at rest, whatever holds the joint, up to `torque`.
///
/// In the form `creeping`, it creeps while it holds, as contacts of rigid-body engines do
/// ([`Push::creeping_friction`](crate::robot::Push)); in the form `smooth` it is `-smooth_torque tanh(v / velocity)` and holds
/// nothing; in the form `presliding` it gives before it slips, and is `presliding_torque w` with `w' = (v - |v| w / 2 - v |w| / 2) /
/// presliding_angle`, elastic while it comes back: what bends further before it slips is a [`Hysteresis`].
///
/// Source: Coulomb, *Théorie des machines simples* (1785); Armstrong-Hélouvry, Dupont & Canudas de Wit, "A survey of
/// models, analysis tools and compensation methods for the control of machines with friction", Automatica 30 (1994);
/// creeping: Todorov, "Convex and analytically invertible dynamics with contacts and constraints", ICRA 2014; smooth:
/// Andersson, Söderberg & Björklund, "Friction models for sliding dry, boundary and mixed lubricated contacts", Tribology
/// International 40 (2007); presliding: Dahl, "Solid friction damping of mechanical vibrations", AIAA Journal 14 (1976), with the
/// unloading of Wen (1976), as of a [`Hysteresis`] that is soft.
#[derive(Debug, Clone, Copy)]
pub struct CoulombFriction;

/// Angles below this [rad] are none.
const LEAST_ANGLE: f64 = 1e-12;
/// The part of the usual motion over which dry friction gives at the most before it slips.
pub(super) const PRESLIDING: f64 = 0.05;
/// The part of the usual velocity over which it is turned round at the most.
const CORNER: f64 = 0.1;

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
        let torque = |name| Parameter::new(name, "N m", 0.0).within(0.0, f64::INFINITY).starting_at(&starts);
        let rate = typical.rate.max(1e-9);
        let velocity = Parameter::new("velocity", "rad/s", rate)
            .within(1e-4 * rate.min(1.0), f64::INFINITY)
            .starting_at(&[0.02, 0.2].map(|fraction| fraction * rate));
        vec![
            Form { name: "dry", parameters: vec![torque("torque")] },
            Form { name: "creeping", parameters: vec![torque("creeping_torque")] },
            Form { name: "smooth", parameters: vec![torque("smooth_torque"), velocity] },
            Form { name: "presliding", parameters: vec![torque("presliding_torque"), presliding_angle(typical)] },
        ]
    }

    /// A friction that gives over more than a small part of the motion, or that grows with velocity over more than a small part of what
    /// is usual, goes by another name.
    fn sought(&self, typical: &Typical) -> Vec<Form> {
        let mut forms = hardly_giving(Mechanism::<P>::forms(self, typical), typical);
        for parameter in forms.iter_mut().flat_map(|form| &mut form.parameters).filter(|p| p.name == "velocity") {
            parameter.upper = (CORNER * typical.rate).max(parameter.lower);
            parameter.nominal = (0.2 * parameter.upper).max(parameter.lower);
            parameter.starts = vec![parameter.nominal];
        }
        forms
    }

    fn law(&self, form: usize, thetas: &Thetas, seed: Seed) -> Box<dyn Law<P>> {
        let torque = thetas.row(0).to_vec();
        match form {
            0 => Box::new(Dry(torque)),
            1 => Box::new(Creeping(torque)),
            3 => Hysteresis.law(0, thetas, seed),
            _ => Box::new(Smooth { torque, velocity: thetas.row(1).to_vec() }),
        }
    }
}

/// The angle over which dry friction gives before it slips [rad].
pub(super) fn presliding_angle(typical: &Typical) -> Parameter {
    let output = typical.output.max(1e-9);
    Parameter::new("presliding_angle", "rad", 0.05 * output).within(LEAST_ANGLE, f64::INFINITY).starting_at(&[0.01 * output])
}

/// `forms` in which dry friction gives over no more than a small part of the motion.
pub(super) fn hardly_giving(mut forms: Vec<Form>, typical: &Typical) -> Vec<Form> {
    for angle in forms.iter_mut().flat_map(|form| &mut form.parameters).filter(|p| p.name == "presliding_angle") {
        (angle.lower, angle.upper) = (1e-4 * typical.output.min(1.0), PRESLIDING * typical.output);
    }
    forms
}

#[derive(Clone)]
struct Dry(Vec<f64>);

impl<P: Mover> Law<P> for Dry {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn act(&mut self, _: Tick, _: &Scene<'_, P>, effects: &mut [P::Effect]) {
        effects.iter_mut().zip(&self.0).for_each(|(effect, torque)| P::push(effect).dry_friction += torque);
    }
}

#[derive(Clone)]
struct Creeping(Vec<f64>);

impl<P: Mover> Law<P> for Creeping {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn act(&mut self, _: Tick, _: &Scene<'_, P>, effects: &mut [P::Effect]) {
        effects.iter_mut().zip(&self.0).for_each(|(effect, torque)| P::push(effect).creeping_friction += torque);
    }
}

#[derive(Clone)]
struct Smooth {
    torque: Vec<f64>,
    velocity: Vec<f64>,
}

impl<P: Mover> Law<P> for Smooth {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.torque);
        change.parameter(1, &mut self.velocity);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let parameters = self.torque.iter().zip(&self.velocity);
        let lanes = effects.iter_mut().zip(scene.states).zip(parameters).enumerate();
        for (lane, ((effect, state), (torque, scale))) in lanes {
            let velocity = P::motion(state).velocity;
            let level = (velocity / scale).tanh();
            let (friction, tangent) = (torque * level, torque / scale * (1.0 - level * level));
            // Along the tangent the friction is that of the middle of the step, to second order; along the line to the
            // origin no step can overshoot rest. So the one in fast motion and the other in slow.
            let within = tick.step * friction.abs();
            let fast = (velocity.abs() * P::inertia(scene.dynamics, lane, state) - within).max(0.0).min(within);
            let slope = if fast < within {
                let chord = if velocity == 0.0 { tangent } else { friction / velocity };
                chord + (tangent - chord) * fast / within
            } else {
                tangent
            };
            let push = P::push(effect);
            push.damping += slope;
            push.effort -= friction - slope * velocity;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;
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

    /// In free motion every form takes what friction takes: `torque` a radian.
    #[test]
    fn energy_is_lost_by_torque_times_way() {
        let trial = Trial { parameters: [0.1, 0.0, 0.0, 1.0], position: 0.0, velocity: 3.0, step: 1e-3 };
        for (form, values) in [(0, vec![0.2]), (1, vec![0.2]), (2, vec![0.2, 0.01])] {
            let motion = trial.follow(&CoulombFriction, form, &values, &[0.0; 1_001]);
            let lost = 0.05 * (9.0 - motion[1_000].velocity.powi(2));
            assert!((lost / motion[1_000].position / 0.2 - 1.0).abs() < 1e-3, "form {form}");
        }
    }

    /// What creeps while it holds a push below its torque settles at the velocity of `clip(share (inertia rate v + push))`,
    /// and what is smooth at `velocity atanh(push / torque)`.
    #[test]
    fn what_does_not_hold_creeps_as_its_form_has_it() {
        let trial = Trial { parameters: [0.1, 0.0, 0.0, 1.0], position: 0.0, velocity: 0.0, step: 1e-3 };
        let creep = 0.1 * (1.0 - 0.9) / (0.9 * 0.1 * 105.0);
        for (form, values, expected) in
            [(0, vec![0.2], 0.0), (1, vec![0.2], creep), (2, vec![0.2, 0.03], 0.03 * 0.5_f64.atanh())]
        {
            let motion = trial.follow(&CoulombFriction, form, &values, &[0.1; 3_000]);
            assert!((motion[2_999].velocity - expected).abs() < 1e-6, "form {form}: {}", motion[2_999].velocity);
        }
    }

    #[test]
    fn what_grows_with_velocity_is_not_sought_as_dry() {
        let typical = Typical { rate: 3.0, ..Typical::default() };
        let sought = Mechanism::<Joint>::sought(&CoulombFriction, &typical);
        let velocity = sought.iter().flat_map(|f| &f.parameters).find(|p| p.name == "velocity").unwrap();
        assert!(velocity.upper < typical.rate / 5.0 && velocity.starts.iter().all(|s| *s < velocity.upper));
    }
}
