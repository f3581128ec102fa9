//! An inertia that goes with the position in whatever way: what a law of another kind has to beat.

use crate::robot::Mover;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Scene, Seed, Site, Thetas, Tick, Typical};

/// `inertia (1 + f(q)) a + inertia f'(q) v^2 / 2 = ...`, as Lagrange's equation has it, with `f = sine sin q + cosine cos q +
/// second_sine sin 2q + second_cosine cos 2q`; in the form `along`, of a linear axis, `f = slope q + bend q^2`. Less than a twentieth of
/// the inertia is never left.
///
/// It is no law and stands for none, and so no diagnosis names it; a twin may have it where a linkage moves its load nearer to the axis
/// and away from it.
///
/// Source: the inertia matrix that depends on the posture, Spong, Hutchinson & Vidyasagar, *Robot Modeling and Control* (2006),
/// section 7.2.
#[derive(Debug, Clone, Copy)]
pub struct InertiaCurve;

/// The part of the inertia that is always left.
const LEAST: f64 = 0.05;

impl<P: Mover> Mechanism<P> for InertiaCurve {
    fn about(&self) -> About {
        About {
            name: "inertia_curve",
            site: Site::Plant,
            title: "an inertia that goes with the position",
            law: "inertia (1 + f(q)) a + inertia f'(q) v^2 / 2 = ..., f a sine of a turn and one of half a turn, or a parabola",
            source: "Spong, Hutchinson & Vidyasagar, Robot Modeling and Control (2006), 7.2",
            remedy: "model the linkage that moves the load nearer to the axis and away from it",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let part = |name, unit| Parameter::new(name, unit, 0.0).starting_at(&[0.1]).proportional();
        let turn = [("sine", ""), ("cosine", ""), ("second_sine", ""), ("second_cosine", "")];
        let along = [("slope", "1/rad"), ("bend", "1/rad^2")];
        vec![
            Form { name: "turn", parameters: turn.map(|(name, unit)| part(name, unit)).to_vec() },
            Form { name: "along", parameters: along.map(|(name, unit)| part(name, unit)).to_vec() },
        ]
    }

    fn nameless(&self) -> bool {
        true
    }

    fn applies(&self, form: usize, plant: &P, _stimulus: &P::Stimulus) -> bool {
        (Plant::unit(plant, "rad") == "rad") == (form == 0)
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let curve = |lane: usize| -> Curve {
            let values: Vec<f64> = (0..thetas.parameters()).map(|k| thetas.row(k)[lane]).collect();
            Curve::of(form, &values)
        };
        Box::new(Curves { form, curves: (0..thetas.lanes()).map(curve).collect() })
    }
}

/// The curve of one lane.
#[derive(Debug, Clone, Copy)]
enum Curve {
    /// Sine and cosine of a turn, and of half a turn.
    Turn([f64; 4]),
    /// Slope [1/rad] and bend [1/rad^2].
    Along([f64; 2]),
}

impl Curve {
    fn of(form: usize, values: &[f64]) -> Self {
        match *values {
            [sine, cosine, second_sine, second_cosine] if form == 0 => {
                Self::Turn([sine, cosine, second_sine, second_cosine])
            }
            [slope, bend, ..] => Self::Along([slope, bend]),
            _ => Self::Along([0.0; 2]),
        }
    }

    /// By what part the inertia is greater at `position`, and how that changes with it [1/rad].
    fn at(&self, position: f64) -> (f64, f64) {
        let (part, slope) = match *self {
            Self::Turn([sine, cosine, second_sine, second_cosine]) => {
                let ((s, c), (s2, c2)) = (position.sin_cos(), (2.0 * position).sin_cos());
                let part = sine * s + cosine * c + second_sine * s2 + second_cosine * c2;
                (part, sine * c - cosine * s + 2.0 * (second_sine * c2 - second_cosine * s2))
            }
            Self::Along([slope, bend]) => (position * (slope + bend * position), slope + 2.0 * bend * position),
        };
        if part < LEAST - 1.0 { (LEAST - 1.0, 0.0) } else { (part, slope) }
    }
}

#[derive(Clone)]
struct Curves {
    form: usize,
    curves: Vec<Curve>,
}

impl<P: Mover> Law<P> for Curves {
    fn change(&mut self, change: &LaneChange<'_>) {
        let form = self.form;
        change.derived(&mut self.curves, |values| Curve::of(form, values));
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        for (lane, ((effect, state), curve)) in effects.iter_mut().zip(scene.states).zip(&self.curves).enumerate() {
            let motion = P::motion(state);
            let inertia = P::inertia(scene.dynamics, lane, state);
            let (part, slope) = curve.at(motion.midway(tick.step));
            let push = P::push(effect);
            push.inertia += inertia * part;
            // The square of the velocity in the middle of the step, along its tangent at the beginning.
            let bent = inertia * slope * motion.velocity;
            push.damping += bent;
            push.effort += 0.5 * bent * motion.velocity;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;

    /// What coasts keeps its kinetic energy, however its inertia changes on the way.
    #[test]
    fn energy_is_kept() {
        let trial = Trial { parameters: [0.1, 0.0, 0.0, 1.0], position: 0.3, velocity: 2.0, step: 1e-3 };
        let values = [0.3, -0.2, 0.1, 0.15];
        let motion = trial.follow(&InertiaCurve, 0, &values, &[0.0; 2_001]);
        let energy = |k: usize| (1.0 + Curve::of(0, &values).at(motion[k].position).0) * motion[k].velocity.powi(2);
        let worst = (0..2_000).map(|k| (energy(k) / energy(0) - 1.0).abs()).fold(0.0, f64::max);
        let slowest = motion.iter().map(|m| m.velocity).fold(f64::INFINITY, f64::min);
        assert!(worst < 1e-5 && slowest < 1.8, "{worst}, {slowest} rad/s");
    }

    #[test]
    fn an_inertia_never_vanishes() {
        let curve = Curve::of(1, &[-0.5, 0.0]);
        assert_eq!(curve.at(1.0), (-0.5, -0.5));
        assert_eq!(curve.at(4.0), (LEAST - 1.0, 0.0));
    }
}
