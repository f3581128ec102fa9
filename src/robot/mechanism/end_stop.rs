//! A mechanical stop at the end of the way.

use super::spring::{Contact, RoundWall, Wall};
use crate::robot::{Mover, Push};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// Part of the range of a motion that may lie beyond a stop.
const REACH: f64 = 0.35;

/// Beyond `upper`, `-(stiffness (q - upper) + damping v)`, never pulling back; likewise below `lower`; or both. The damping
/// is `2 damping_ratio sqrt(stiffness inertia)`. In the forms `upper_round`, `lower_round` and `both_round` it is
/// `-contact_stiffness (q - upper)^1.5 (1 + dissipation v)`: what bears on a round or a rough stop bears on more of it the deeper it
/// goes, and less of a faster blow is given back.
///
/// Source: Kelvin and Voigt's body as a contact, as in Gilardi & Sharf, "Literature survey of contact dynamics modelling",
/// Mechanism and Machine Theory 37 (2002), section 3; round: Hunt & Crossley, "Coefficient of restitution interpreted as damping in
/// vibroimpact", Journal of Applied Mechanics 42 (1975).
#[derive(Debug, Clone, Copy)]
pub struct EndStop;

impl<P: Mover> Mechanism<P> for EndStop {
    fn about(&self) -> About {
        About {
            name: "end_stop",
            site: Site::Plant,
            title: "an end stop",
            law: "inertia a = ... - stiffness (q - upper) - damping v beyond upper; likewise below lower; \
                  round: - contact_stiffness (q - upper)^1.5 (1 + dissipation v)",
            source: "Gilardi & Sharf, Mechanism and Machine Theory 37 (2002), section 3; \
                     Hunt & Crossley, Journal of Applied Mechanics 42 (1975)",
            remedy: "keep the motion off the stop, or give the joint of the simulator its limits",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let [lowest, highest] = typical.range;
        let span = (highest - lowest).max(1e-9);
        let within = |fractions: &[f64], end: f64, inwards: f64| -> Vec<f64> {
            fractions.iter().map(|fraction| end + inwards * fraction * span).collect()
        };
        let upper =
            |fractions: &[f64]| Parameter::new("upper", "rad", highest).starting_at(&within(fractions, highest, -1.0));
        let lower = |fractions: &[f64]| Parameter::new("lower", "rad", lowest).starting_at(&within(fractions, lowest, 1.0));
        let stiffness = || {
            let starts = [10.0, 100.0, 1000.0].map(|factor| factor * typical.effort / span);
            Parameter::new("stiffness", "N m/rad", 0.0).within(0.0, f64::INFINITY).starting_at(&starts)
        };
        let ratio = || Parameter::new("damping_ratio", "", 0.0).within(0.0, 10.0).starting_at(&[0.5]);
        // As deep under a typical effort as those springs.
        let contact = || {
            let starts = [10.0, 100.0, 1000.0].map(|factor: f64| typical.effort * (factor / span).powf(1.5));
            Parameter::new("contact_stiffness", "N m/rad^1.5", 0.0).within(0.0, f64::INFINITY).starting_at(&starts)
        };
        let dissipation = || {
            let start = 0.3 / typical.rate.max(1e-9);
            Parameter::new("dissipation", "s/rad", 0.0).within(0.0, f64::INFINITY).starting_at(&[start])
        };
        let (one, two) = ([0.01, 0.05, 0.15], [0.01, 0.1]);
        vec![
            Form { name: "upper", parameters: vec![upper(&one), stiffness(), ratio()] },
            Form { name: "lower", parameters: vec![lower(&one), stiffness(), ratio()] },
            Form { name: "both", parameters: vec![lower(&two), upper(&two), stiffness(), ratio()] },
            Form { name: "upper_round", parameters: vec![upper(&one), contact(), dissipation()] },
            Form { name: "lower_round", parameters: vec![lower(&one), contact(), dissipation()] },
            Form { name: "both_round", parameters: vec![lower(&two), upper(&two), contact(), dissipation()] },
        ]
    }

    /// A stop is free over most of the way: one that is leaned on throughout is a load and a spring.
    fn sought(&self, typical: &Typical) -> Vec<Form> {
        let [lowest, highest] = typical.range;
        let reach = REACH * (highest - lowest);
        let mut forms = Mechanism::<P>::forms(self, typical);
        for parameter in forms.iter_mut().flat_map(|form| &mut form.parameters) {
            match parameter.name.as_ref() {
                "upper" => parameter.lower = highest - reach,
                "lower" => parameter.upper = lowest + reach,
                _ => {}
            }
        }
        forms
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let sides = SIDES[form % SIDES.len()];
        let never = |value| vec![value; thetas.lanes()];
        let (lower, upper) = match sides {
            Sides::Upper => (never(f64::NEG_INFINITY), thetas.row(0).to_vec()),
            Sides::Lower => (thetas.row(0).to_vec(), never(f64::INFINITY)),
            Sides::Both => (thetas.row(0).to_vec(), thetas.row(1).to_vec()),
        };
        let [stiffness, loss] = [0, 1].map(|k| thetas.row(sides.count() + k).to_vec());
        Box::new(Stops { sides, round: form >= SIDES.len(), lower, upper, stiffness, loss })
    }
}

/// The ends at which there is a stop, in the order of forms.
const SIDES: [Sides; 3] = [Sides::Upper, Sides::Lower, Sides::Both];

#[derive(Debug, Clone, Copy)]
enum Sides {
    Upper,
    Lower,
    Both,
}

impl Sides {
    fn count(self) -> usize {
        if matches!(self, Self::Both) { 2 } else { 1 }
    }
}

#[derive(Clone)]
struct Stops {
    sides: Sides,
    /// Whether they are [`RoundWall`]s.
    round: bool,
    lower: Vec<f64>,
    upper: Vec<f64>,
    stiffness: Vec<f64>,
    /// Damping ratio, or dissipation of round ones.
    loss: Vec<f64>,
}

impl Stops {
    #[inline]
    fn meet(&self, lane: usize, inertia: f64, depth: f64, rate: f64, step: f64) -> Option<Contact> {
        let (stiffness, loss) = (self.stiffness[lane], self.loss[lane]);
        if self.round {
            RoundWall { stiffness, dissipation: loss, inertia }.meet(depth, rate, step)
        } else {
            Wall { stiffness, damping_ratio: loss, inertia }.meet(depth, rate, step)
        }
    }
}

impl<P: Mover> Law<P> for Stops {
    fn change(&mut self, change: &LaneChange<'_>) {
        let sides = self.sides;
        change.derived(&mut self.lower, |values| match sides {
            Sides::Upper => f64::NEG_INFINITY,
            Sides::Lower | Sides::Both => values[0],
        });
        change.derived(&mut self.upper, |values| match sides {
            Sides::Upper => values[0],
            Sides::Lower => f64::INFINITY,
            Sides::Both => values[1],
        });
        change.parameter(sides.count(), &mut self.stiffness);
        change.parameter(sides.count() + 1, &mut self.loss);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let limits = self.lower.iter().zip(&self.upper);
        for (lane, ((effect, state), (lower, upper))) in effects.iter_mut().zip(scene.states).zip(limits).enumerate() {
            let motion = P::motion(state);
            let end = motion.position + tick.step * motion.velocity;
            let (least, most) = (motion.position.min(end), motion.position.max(end));
            if most <= *upper && least >= *lower {
                continue;
            }
            let inertia = P::inertia(scene.dynamics, lane, state);
            let push = P::push(effect);
            push_off(push, self.meet(lane, inertia, motion.position - upper, motion.velocity, tick.step), -1.0);
            push_off(push, self.meet(lane, inertia, lower - motion.position, -motion.velocity, tick.step), 1.0);
        }
    }
}

fn push_off(push: &mut Push, contact: Option<Contact>, off: f64) {
    if let Some(contact) = contact {
        push.effort += off * contact.effort;
        push.damping += contact.damping;
        push.inertia += contact.inertia;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;

    /// Under a constant drive it comes to rest where the stop's spring balances it, whatever the stiffness and the side.
    #[test]
    fn it_rests_where_the_stop_balances_the_drive() {
        let trial = Trial { parameters: [0.1, 0.2, 0.0, 1.0], position: 0.0, velocity: 0.0, step: 1e-3 };
        for stiffness in [50.0, 2e3, 1e5, 1e7] {
            for (form, values, drive) in [
                (0, vec![0.5, stiffness, 0.3], 1.5),
                (1, vec![-0.5, stiffness, 0.3], -1.5),
                (2, vec![-0.5, 0.5, stiffness, 0.3], -1.5),
            ] {
                let motion = trial.follow(&EndStop, form, &values, &vec![drive; 20_000]);
                let expected = f64::signum(drive) * (0.5 + 1.5 / stiffness);
                let rest = motion[19_999];
                assert!((rest.position - expected).abs() < 1e-7, "{stiffness}: {} not {expected}", rest.position);
                assert!(
                    motion
                        .iter()
                        .all(|m| m.position.abs() < 0.5 + 2.0 * (0.1 / stiffness).sqrt() * 6.0 + 2.0 * 1.5 / stiffness)
                );
            }
        }
    }

    /// So it does on a round stop, whose effort is that of its depth to the power of 1.5.
    #[test]
    fn it_rests_where_a_round_stop_balances_the_drive() {
        let trial = Trial { parameters: [0.1, 0.2, 0.0, 1.0], position: 0.0, velocity: 0.0, step: 1e-3 };
        for stiffness in [100.0, 1e4, 1e6] {
            for (form, values, drive) in [
                (3, vec![0.5, stiffness, 0.3], 1.5),
                (4, vec![-0.5, stiffness, 0.3], -1.5),
                (5, vec![-0.5, 0.5, stiffness, 0.3], -1.5),
            ] {
                let rest = trial.follow(&EndStop, form, &values, &vec![drive; 20_000])[19_999];
                let expected = f64::signum(drive) * (0.5 + (1.5 / stiffness).powf(2.0 / 3.0));
                assert!((rest.position - expected).abs() < 1e-7, "{stiffness}: {} not {expected}", rest.position);
            }
        }
    }

    /// A round stop gives back all of a slow blow, and less of a fast one, as fine steps of the same contact have it.
    #[test]
    fn a_round_stop_gives_back_less_of_a_faster_blow() {
        let trial = |velocity| Trial { parameters: [0.1, 0.0, 0.0, 1.0], position: 0.0, velocity, step: 1e-3 };
        let mut given_back = f64::INFINITY;
        for (speed, dissipation) in [(0.5, 0.0), (0.5, 0.3), (1.0, 0.3), (2.0, 0.3)] {
            let motion = trial(speed).follow(&EndStop, 3, &[0.25, 1_000.0, dissipation], &vec![0.0; 800]);
            let off = -motion[799].velocity / speed;
            let expected = -fine(speed, |x, v| -1e4 * x * x.max(0.0).sqrt() * (1.0 + dissipation * v)) / speed;
            assert!((off - expected).abs() < 0.01 && off < given_back, "{speed}: {off}, expected {expected}");
            given_back = off;
        }
    }

    /// Without damping it bounces off as fast as it came; with damping, as fine steps of the same contact have it.
    #[test]
    fn it_bounces_off_as_the_closed_form_has_it() {
        let trial = Trial { parameters: [0.1, 0.0, 0.0, 1.0], position: 0.0, velocity: 1.0, step: 1e-3 };
        for ratio in [0.0_f64, 0.1, 0.3, 0.6] {
            let motion = trial.follow(&EndStop, 0, &[0.25, 400.0, ratio], &vec![0.0; 600]);
            let expected = bounce(ratio);
            let off = -motion[599].velocity;
            assert!((off - expected).abs() < 0.01, "{ratio}: {off}, expected {expected}");
        }
    }

    /// Speed after the contact of a body of unit mass and speed with a wall of unit frequency, by fine steps.
    fn bounce(ratio: f64) -> f64 {
        -fine(1.0, |x, v| -x - 2.0 * ratio * v)
    }

    /// Velocity of a body that comes into a wall at `speed` when that lets it go; `acceleration` is by depth and velocity.
    fn fine(speed: f64, acceleration: impl Fn(f64, f64) -> f64) -> f64 {
        let (mut x, mut v, h) = (0.0, speed, 1e-5);
        loop {
            let (half_x, half_v) = (x + 0.5 * h * v, v + 0.5 * h * acceleration(x, v));
            (x, v) = (x + h * half_v, v + h * acceleration(half_x, half_v));
            if acceleration(x, v) >= 0.0 && v < 0.0 {
                return v;
            }
        }
    }

    /// The motion after the impact moves evenly with where the stop is.
    #[test]
    fn the_stop_has_a_derivative() {
        let trial = Trial { parameters: [0.1, 0.2, 0.0, 1.0], position: 0.0, velocity: 0.0, step: 1e-3 };
        let drive: Vec<f64> = (0..2_000).map(|k| 1.5 * (3.0 * f64::from(k) * 1e-3).sin()).collect();
        for (form, stiffness) in [(0, 500.0), (3, 5e3)] {
            let at = |upper: f64| trial.follow(&EndStop, form, &[upper, stiffness, 0.3], &drive)[1_999].position;
            let wide = (at(0.31) - at(0.29)) / 0.02;
            for k in 0..20 {
                let upper = 0.3 + f64::from(k) * 1.3e-4;
                let narrow = (at(upper + 2e-5) - at(upper - 2e-5)) / 4e-5;
                assert!((narrow - wide).abs() < 0.15 * wide.abs(), "{form}, {upper}: {narrow}, {wide} over a wider step");
            }
        }
    }
}
