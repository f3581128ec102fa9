//! A spring towards position 0: a cable, a bellows, a return spring.

use crate::robot::Mover;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `-rate q`; in the form `bent`, `-bent_rate q - third_rate q^3`: no spring is quite straight, and one that bends is one
/// spring, not two. Beside gravity that is fitted, the straight form takes on what bends, too: `q^3` is about `6 (q - sin q)`, so that
/// its rate is about `bent_rate + 6 third_rate`, however small the swing.
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
            law: "inertia a = ... - rate q; bent: ... - bent_rate q - third_rate q^3",
            source: "Hooke, De potentia restitutiva (1678)",
            remedy: "look for a cable, hose or return spring; add its rate to the simulator",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.05, 0.3].map(|fraction| fraction * typical.effort / typical.output.max(1e-12));
        let rate =
            |name| Parameter::new(name, "N m/rad", 0.0).within(0.0, f64::INFINITY).starting_at(&starts).proportional();
        // One that softens gives way far out: its sign is solved for, not tried.
        let third = Parameter::new("third_rate", "N m/rad^3", 0.0)
            .starting_at(&[0.02 * typical.effort / typical.output.powi(3).max(1e-12)])
            .proportional();
        vec![
            Form { name: "straight", parameters: vec![rate("rate")] },
            Form { name: "bent", parameters: vec![rate("bent_rate"), third] },
        ]
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let rates = thetas.row(0).to_vec();
        if form == 0 { Box::new(Spring(rates)) } else { Box::new(BentSpring { rates, thirds: thetas.row(1).to_vec() }) }
    }
}

#[derive(Clone)]
struct BentSpring {
    rates: Vec<f64>,
    thirds: Vec<f64>,
}

impl<P: Mover> Law<P> for BentSpring {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.rates);
        change.parameter(1, &mut self.thirds);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let lanes = effects.iter_mut().zip(scene.states).zip(self.rates.iter().zip(&self.thirds));
        for ((effect, state), (rate, third)) in lanes {
            let motion = P::motion(state);
            // Springs act from where the coordinate is in the middle of the step.
            let midway = motion.midway(tick.step);
            P::push(effect).stiffness += rate + third * midway * midway;
        }
    }
}

#[derive(Clone)]
struct Spring(Vec<f64>);

impl<P: Mover> Law<P> for Spring {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn act(&mut self, _: Tick, _: &Scene<'_, P>, effects: &mut [P::Effect]) {
        effects.iter_mut().zip(&self.0).for_each(|(effect, rate)| P::push(effect).stiffness += rate);
    }
}
