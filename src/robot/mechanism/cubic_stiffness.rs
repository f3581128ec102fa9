//! A spring that gets harder: a bellows, a rubber bush, a cable near its end.

use crate::robot::Mover;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `-rate q^3`; in the form `bent`, `-bent_rate q^3 - fifth_rate q^5`: none hardens quite with the cube.
///
/// Source: Duffing, *Erzwungene Schwingungen bei veränderlicher Eigenfrequenz* (1918); with a quintic term: Kovacic & Brennan (eds.),
/// *The Duffing Equation* (2011).
#[derive(Debug, Clone, Copy)]
pub struct CubicStiffness;

impl<P: Mover> Mechanism<P> for CubicStiffness {
    fn about(&self) -> About {
        About {
            name: "cubic_stiffness",
            site: Site::Plant,
            title: "a hardening spring",
            law: "inertia a = ... - rate q^3; bent: ... - bent_rate q^3 - fifth_rate q^5",
            source: "Duffing, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz (1918); Kovacic & Brennan (eds.), The Duffing Equation (2011)",
            remedy: "look for a bellows, bush or cable that tightens; add its rate to the simulator",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let starts = [0.05, 0.5].map(|fraction| fraction * typical.effort / typical.output.powi(3).max(1e-12));
        let rate =
            |name| Parameter::new(name, "N m/rad^3", 0.0).within(0.0, f64::INFINITY).starting_at(&starts).proportional();
        let fifth = Parameter::new("fifth_rate", "N m/rad^5", 0.0)
            .starting_at(&[0.02 * typical.effort / typical.output.powi(5).max(1e-12)])
            .proportional();
        vec![
            Form { name: "cube", parameters: vec![rate("rate")] },
            Form { name: "bent", parameters: vec![rate("bent_rate"), fifth] },
        ]
    }

    fn general(&self, form: usize) -> bool {
        form == 1
    }

    /// Springs that harden have a rate at rest too; and what is straight hardens a little.
    fn seldom(&self) -> bool {
        true
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let rates = thetas.row(0).to_vec();
        if form == 0 { Box::new(Spring(rates)) } else { Box::new(BentSpring { rates, fifths: thetas.row(1).to_vec() }) }
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
            let square = P::motion(state).midway(tick.step).powi(2);
            P::push(effect).stiffness += rate * square;
        }
    }
}

#[derive(Clone)]
struct BentSpring {
    rates: Vec<f64>,
    fifths: Vec<f64>,
}

impl<P: Mover> Law<P> for BentSpring {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.rates);
        change.parameter(1, &mut self.fifths);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let lanes = effects.iter_mut().zip(scene.states).zip(self.rates.iter().zip(&self.fifths));
        for ((effect, state), (rate, fifth)) in lanes {
            let square = P::motion(state).midway(tick.step).powi(2);
            P::push(effect).stiffness += (rate + fifth * square) * square;
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

    /// Energy of the bent form: what is lifted against it comes back as speed.
    #[test]
    fn the_bent_form_keeps_the_energy_of_its_closed_form() {
        let (inertia, rate, fifth, amplitude) = (0.1, 5.0, -3.0, 0.7_f64);
        let energy = |q: f64| 0.25 * rate * q.powi(4) + fifth * q.powi(6) / 6.0;
        let trial = Trial { parameters: [inertia, 0.0, 0.0, 1.0], position: amplitude, velocity: 0.0, step: 1e-3 };
        let motion = trial.follow(&CubicStiffness, 1, &[rate, fifth], &vec![0.0; 20_000]);
        let fastest = motion.iter().map(|m| m.velocity.abs()).fold(0.0, f64::max);
        let expected = (2.0 * energy(amplitude) / inertia).sqrt();
        assert!((fastest / expected - 1.0).abs() < 1e-3, "{fastest} rad/s, expected {expected} rad/s");
    }
}
