//! A spring that gets harder: a bellows, a rubber bush, a cable near its end.

use crate::robot::Mover;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `-rate q^3`.
///
/// Source: Duffing, *Erzwungene Schwingungen bei veränderlicher Eigenfrequenz* (1918).
#[derive(Debug, Clone, Copy)]
pub struct CubicStiffness;

impl<P: Mover> Mechanism<P> for CubicStiffness {
    fn about(&self) -> About {
        About {
            name: "cubic_stiffness",
            site: Site::Plant,
            title: "a hardening spring",
            law: "inertia a = ... - rate q^3",
            source: "Duffing, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz (1918)",
            remedy: "look for a bellows, bush or cable that tightens; add its rate to the simulator",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.05, 0.5].map(|fraction| fraction * typical.effort / typical.output.powi(3).max(1e-12));
        Form::only(vec![
            Parameter::new("rate", "N m/rad^3", 0.0).within(0.0, f64::INFINITY).starting_at(&starts).proportional(),
        ])
    }

    /// Springs that harden have a rate at rest too; and what is straight hardens a little.
    fn seldom(&self) -> bool {
        true
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        Box::new(Spring(thetas.row(0).to_vec()))
    }
}

#[derive(Clone)]
struct Spring(Vec<f64>);

impl<P: Mover> Law<P> for Spring {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.0);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        for ((effect, state), rate) in effects.iter_mut().zip(scene.states).zip(&self.0) {
            let motion = P::motion(state);
            // Springs act from where the coordinate is in the middle of the step.
            let midway = motion.position + 0.5 * tick.step * motion.velocity;
            P::push(effect).stiffness += rate * midway * midway;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;

    /// Period of `I a = -rate q^3` from `amplitude`: `sqrt(I / rate) / amplitude Gamma(1/4)^2 / sqrt(pi)`.
    #[test]
    fn the_period_is_that_of_the_closed_form() {
        let (inertia, rate, amplitude) = (0.1, 5.0, 0.7);
        let gamma: f64 = 3.625_609_908_221_908;
        let period = f64::sqrt(inertia / rate) / amplitude * gamma * gamma / std::f64::consts::PI.sqrt();
        let trial = Trial { parameters: [inertia, 0.0, 0.0, 1.0], position: amplitude, velocity: 0.0, step: 1e-3 };
        let motion = trial.follow(&CubicStiffness, 0, &[rate], &vec![0.0; 20_000]);
        let upward: Vec<f64> = (1..motion.len())
            .filter(|k| motion[k - 1].position < 0.0 && motion[*k].position >= 0.0)
            .map(|k| (k as f64 - motion[k].position / (motion[k].position - motion[k - 1].position)) * 1e-3)
            .collect();
        let measured = (upward[upward.len() - 1] - upward[0]) / (upward.len() - 1) as f64;
        assert!((measured / period - 1.0).abs() < 1e-4, "{measured} s, expected {period} s");
        let highest = motion[10_000..].iter().map(|m| m.position).fold(0.0, f64::max);
        assert!((highest - amplitude).abs() < 1e-4, "{highest}");
    }
}
