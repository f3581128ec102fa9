//! A transmission that gives: a harmonic drive, a long shaft, a belt.

use super::second_mass::{Coupling, Load, SecondMass, as_one, holds};
use super::spring::spring_inertia;
use crate::robot::{Motion, Mover};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// Motor and link, held together by a spring that gives by `compliance` and by a damper of `damping_ratio` times the
/// critical damping of the two against each other. The motor is driven and has the joint's viscous friction, gravity pulls
/// at the link. In the form `on_motor` the encoder is on the motor and the link has `link_share` of the inertia; in the form
/// `on_link` the encoder is on the link and the motor has `motor_share`. Dry friction that other laws add is that of the mass with the
/// encoder; in the form `on_link_motor_friction`, where the motor has `rubbing_motor_share`, it is the motor's, as that of a gear is, and
/// what creeps there holds (friction that is an effort, as that of a form `smooth` or `presliding`, stays where it is). In the forms that
/// end in `_hardening` the spring gets stiffer as it twists, and is twice as stiff at `hardening_twist`: torque
/// (1 + (twist / hardening_twist)^2). At first the spring is bent as it is where both move as one, or straight where they rest and
/// neither holds the other.
///
/// Source: Spong, "Modeling and control of elastic joint robots", ASCE Journal of Dynamic Systems, Measurement, and Control
/// 109 (1987); De Luca & Book, "Robots with flexible elements", *Springer Handbook of Robotics* (2016), section 11.1; a cubic
/// stiffness of harmonic drives, Tuttle & Seering, IEEE Transactions on Robotics and Automation 12 (1996).
#[derive(Debug, Clone, Copy)]
pub struct Compliance;

/// Number of the form whose dry friction is the motor's.
const MOTOR_FRICTION: usize = 4;

/// What moves by less than this part of the swing that a shaft makes when it is let go rests.
const RESTS: f64 = 0.1;
/// Twists below this [rad] are none.
const LEAST_TWIST: f64 = 1e-12;

/// The most damping, of the critical, of a shaft, a belt or a gear that counts as elastic: that of metal and rubber is a fraction of this.
const SWINGS: f64 = 0.5;

impl<P: Mover> Mechanism<P> for Compliance {
    fn about(&self) -> About {
        About {
            name: "compliance",
            site: Site::Plant,
            title: "a compliant transmission",
            law: "motor and link apart, torque between them: deflection / compliance + damping times its rate",
            source: "Spong, Journal of Dynamic Systems, Measurement, and Control 109 (1987)",
            remedy: "model motor and link as two masses with a spring between them, or keep below their resonance",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let parameters = |share, hardening: bool| {
            // Deflections under the usual effort, as fractions of the usual motion.
            let starts = [0.005, 0.03, 0.2].map(|fraction| fraction * typical.output / typical.effort.max(1e-12));
            let twist = Parameter::new("hardening_twist", "rad", f64::INFINITY)
                .within(LEAST_TWIST, f64::INFINITY)
                .starting_at(&[0.1 * typical.output]);
            let linear = [
                Parameter::new("compliance", "rad/(N m)", 0.0).within(0.0, f64::INFINITY).starting_at(&starts),
                Parameter::new(share, "", 0.5).within(0.02, 0.98).starting_at(&[0.3, 0.8]),
                Parameter::new("damping_ratio", "", 0.0).within(0.0, 5.0).starting_at(&[0.05]),
            ];
            linear.into_iter().chain(hardening.then_some(twist)).collect()
        };
        vec![
            Form { name: "on_motor", parameters: parameters("link_share", false) },
            Form { name: "on_link", parameters: parameters("motor_share", false) },
            Form { name: "on_motor_hardening", parameters: parameters("link_share", true) },
            Form { name: "on_link_hardening", parameters: parameters("motor_share", true) },
            Form { name: "on_link_motor_friction", parameters: parameters("rubbing_motor_share", false) },
        ]
    }

    fn beside(&self, form: usize) -> &'static [&'static str] {
        if form == MOTOR_FRICTION { &["coulomb_friction", "stribeck_friction", "load_friction"] } else { &[] }
    }

    /// A transmission that gives swings, as metal and belts do; what creeps back is not elastic.
    fn sought(&self, typical: &Typical) -> Vec<Form> {
        let mut forms = Mechanism::<P>::forms(self, typical);
        for ratio in forms.iter_mut().flat_map(|form| &mut form.parameters).filter(|p| p.name == "damping_ratio") {
            ratio.upper = SWINGS;
        }
        forms
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let hardens = matches!(form, 2 | 3);
        let shaft = Shaft {
            compliance: thetas.row(0).to_vec(),
            share: thetas.row(1).to_vec(),
            damping_ratio: thetas.row(2).to_vec(),
            hardening_twist: if hardens { thetas.row(3).to_vec() } else { vec![f64::INFINITY; thetas.lanes()] },
            motor_friction: form == MOTOR_FRICTION,
            second: vec![None; thetas.lanes()],
            elastic: vec![Elastic::UNKNOWN; thetas.lanes()],
        };
        if matches!(form, 0 | 2) { Box::new(OnMotor(shaft)) } else { Box::new(OnLink(shaft)) }
    }
}

#[derive(Clone)]
struct Shaft {
    compliance: Vec<f64>,
    /// Of the inertia, that of the mass without an encoder.
    share: Vec<f64>,
    damping_ratio: Vec<f64>,
    /// Where it is twice as stiff; infinite where it is as stiff everywhere.
    hardening_twist: Vec<f64>,
    /// Whether dry friction is that of the mass without an encoder.
    motor_friction: bool,
    second: Vec<Option<SecondMass>>,
    /// What was last made of these.
    elastic: Vec<Elastic>,
}

/// What of a lane's shaft stays as long as the inertia does: roots and quotients.
#[derive(Debug, Clone, Copy)]
struct Elastic {
    /// Inertia of both masses [kg m^2].
    whole: f64,
    stiffness: f64,
    /// Inertia with which both masses swing against each other [kg m^2].
    reduced: f64,
    damping: f64,
}

impl Elastic {
    const UNKNOWN: Self = Self { whole: f64::NAN, stiffness: 0.0, reduced: 0.0, damping: 0.0 };

    fn new(compliance: f64, share: f64, damping_ratio: f64, whole: f64) -> Self {
        let (stiffness, reduced) = (1.0 / compliance, share * (1.0 - share) * whole);
        Self { whole, stiffness, reduced, damping: 2.0 * damping_ratio * (stiffness * reduced).sqrt() }
    }

    /// What holds the masses together that are bent against each other by `bend` [rad] and, at `rate` [rad/s], ever more so, in a
    /// step of `step` [s], by a spring that is `harder` by this share for it.
    fn coupling(&self, bend: f64, rate: f64, harder: f64, step: f64) -> Coupling {
        let tangent = self.stiffness * (1.0 + 3.0 * harder);
        Coupling {
            effort: self.stiffness * (1.0 + harder) * bend + self.damping * rate,
            rate: 0.5 * self.damping + spring_inertia(tangent, self.reduced, step) / step,
        }
    }
}

/// What acts on the mass without an encoder, and what the plant takes to act on the one with it.
struct Sides {
    /// On the mass without an encoder, were it there [N m].
    second: f64,
    /// What the plant lets act on the one with an encoder, and does not act there [N m].
    misplaced: f64,
    /// Damping of the mass without an encoder, which the plant lets act on the other [N m s/rad].
    damping: f64,
}

impl Shaft {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.compliance);
        change.parameter(1, &mut self.share);
        change.parameter(2, &mut self.damping_ratio);
        change.derived(&mut self.hardening_twist, |values| values.get(3).copied().unwrap_or(f64::INFINITY));
        change.memory(&mut self.second);
        self.elastic.fill(Elastic::UNKNOWN);
    }

    /// One step of all lanes; `sides` says for a lane and its state where the mass without an encoder is in the middle of
    /// the step what acts on which mass, `at_rest` what acts on the first and the second were they one.
    fn turn<P: Mover>(
        &mut self,
        tick: Tick,
        scene: &Scene<'_, P>,
        effects: &mut [P::Effect],
        sides: impl Fn(usize, &P::State, f64) -> Sides,
        at_rest: impl Fn(usize, &P::State) -> (f64, f64),
    ) {
        for (lane, (effect, state)) in effects.iter_mut().zip(scene.states).enumerate() {
            let compliance = self.compliance[lane];
            if compliance <= 0.0 {
                continue;
            }
            let (first, whole, share) = (P::motion(state), P::inertia(scene.dynamics, lane, state), self.share[lane]);
            if self.elastic[lane].whole != whole {
                self.elastic[lane] = Elastic::new(compliance, share, self.damping_ratio[lane], whole);
            }
            let elastic = self.elastic[lane];
            let second = match &mut self.second[lane] {
                Some(second) => {
                    if !self.motor_friction {
                        second.arrive(first.velocity);
                    }
                    second
                }
                None => {
                    let efforts = at_rest(lane, state);
                    let together = twist(as_one(share, efforts.0, efforts.1) * compliance, self.hardening_twist[lane]);
                    let swing = together * (elastic.stiffness / elastic.reduced).sqrt();
                    let bent = if begins_bent(first.velocity, swing, efforts) { together } else { 0.0 };
                    self.second[lane].insert(SecondMass::starting(Motion { position: first.position - bent, ..first }))
                }
            };
            let half = 0.5 * tick.step;
            let midway = second.motion.position + half * second.motion.velocity;
            let rate = first.velocity - second.motion.velocity;
            let bend = first.position + half * first.velocity - midway;
            let harder = (bend / self.hardening_twist[lane]).powi(2);
            let coupling = elastic.coupling(bend, rate, harder, tick.step);
            let sides = sides(lane, state, midway);
            let push = P::push(effect);
            let dry_friction = if self.motor_friction { push.without_dry_friction() } else { 0.0 };
            let load = Load { inertia: share * whole, effort: sides.second, damping: sides.damping, dry_friction };
            let (effort, inertia) = second.couple(tick.step, first.velocity, load, coupling);
            push.effort += effort - sides.misplaced;
            push.inertia += inertia - share * whole;
            push.damping -= sides.damping;
        }
    }
}

impl Shaft {
    /// Ends the step before where dry friction is the second mass's, for its laws to see how fast that moves.
    fn show<P: Mover>(&mut self, states: &[P::State], effects: &mut [P::Effect]) {
        let lanes = self.second.iter_mut().zip(&self.compliance).zip(states).zip(effects);
        for (((second, compliance), state), effect) in lanes {
            if let Some(second) = second.as_mut().filter(|_| *compliance > 0.0) {
                let velocity = P::motion(state).velocity;
                second.arrive(velocity);
                P::push(effect).ahead = second.motion.velocity - velocity;
            }
        }
    }
}

/// Whether the shaft is bent at first as it is where both masses move as one, which starts them without a swing: where they move, by more
/// than a part of what `swing` they would begin otherwise [rad/s], or where one of them rests because the other holds it. What rests
/// for another reason has not been pulled at by its motor yet, nor has it pulled: the shaft is straight.
#[inline]
fn begins_bent(velocity: f64, swing: f64, (on_first, on_second): (f64, f64)) -> bool {
    velocity.abs() > RESTS * swing.abs() || holds(on_first, on_second)
}

/// The twist of a hardening spring under what would twist it by `linear` if it did not harden, by Newton's method.
fn twist(linear: f64, doubling: f64) -> f64 {
    (0..20).fold(linear, |x, _| {
        let harder = (x / doubling).powi(2);
        x - (x * (1.0 + harder) - linear) / (1.0 + 3.0 * harder)
    })
}

#[derive(Clone)]
struct OnMotor(Shaft);

impl<P: Mover> Law<P> for OnMotor {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.0.change(change);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let sides = |lane, state: &P::State, link: f64| {
            let motor = P::motion(state);
            let midway = motor.midway(tick.step);
            Sides { second: P::external(scene, lane, link), misplaced: P::external(scene, lane, midway), damping: 0.0 }
        };
        self.0.turn(tick, scene, effects, sides, |lane, state| {
            let external = P::external(scene, lane, P::motion(state).position);
            (P::drive(scene, lane), external)
        });
    }
}

#[derive(Clone)]
struct OnLink(Shaft);

impl<P: Mover> Law<P> for OnLink {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.0.change(change);
    }

    fn late(&self) -> bool {
        self.0.motor_friction
    }

    fn prepare(&mut self, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        self.0.show::<P>(scene.states, effects);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let sides = |lane, state: &P::State, _| {
            let effort = P::drive(scene, lane);
            Sides { second: effort, misplaced: effort, damping: P::damping(scene.dynamics, lane, state) }
        };
        self.0.turn(tick, scene, effects, sides, |lane, state| {
            (P::external(scene, lane, P::motion(state).position), P::drive(scene, lane))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Joint;
    use crate::robot::mechanism::trial::Trial;

    /// Free of damping and gravity the two masses swing against each other with `sqrt(stiffness / reduced inertia)`, about a
    /// centre that moves as the drive has it.
    #[test]
    fn the_resonance_is_that_of_two_masses() {
        let (inertia, share, stiffness) = (0.1, 0.3, 60.0);
        for (form, seen) in [(0, share), (1, 1.0 - share)] {
            let trial = Trial { parameters: [inertia, 0.0, 0.0, 1.0], position: 0.0, velocity: 0.0, step: 1e-3 };
            let share = if form == 0 { share } else { 1.0 - seen };
            // A kick of one row at a start without bend, and then nothing.
            let mut commands = vec![0.0; 4_000];
            commands[1] = 5.0;
            let motion = trial.follow(&Compliance, form, &[1.0 / stiffness, share, 0.0], &commands);
            let mean = 5.0 * 1e-3 / inertia;
            let swing: Vec<f64> = motion.iter().map(|m| m.velocity - mean).collect();
            let upward: Vec<f64> = (3..swing.len())
                .filter(|k| swing[k - 1] < 0.0 && swing[*k] >= 0.0)
                .map(|k| (k as f64 - swing[k] / (swing[k] - swing[k - 1])) * 1e-3)
                .collect();
            let period = (upward[upward.len() - 1] - upward[0]) / (upward.len() - 1) as f64;
            let expected = std::f64::consts::TAU * (share * (1.0 - share) * inertia / stiffness).sqrt();
            assert!((period / expected - 1.0).abs() < 1e-4, "form {form}: {period} s, expected {expected} s");
        }
    }

    /// A weight bends the shaft by `compliance` times its torque: the motor holds further up than the link.
    #[test]
    fn a_weight_bends_the_shaft() {
        let (weight, compliance) = (2.0, 0.02);
        let trial = Trial { parameters: [0.1, 0.5, weight, 1.0], position: 0.9, velocity: 0.0, step: 1e-3 };
        let drive: f64 = 1.2;
        let commands = vec![drive; 30_000];
        let link = (drive / weight).asin();
        let on_link = trial.follow(&Compliance, 1, &[compliance, 0.5, 0.3], &commands)[29_999].position;
        assert!((on_link - link).abs() < 1e-9, "{on_link}, {link}");
        let on_motor = trial.follow(&Compliance, 0, &[compliance, 0.5, 0.3], &commands)[29_999].position;
        assert!((on_motor - link - compliance * drive).abs() < 1e-9, "{on_motor}");
    }

    /// The stiffer the shaft, the more it is the joint without one, and no stiffness is too much.
    #[test]
    fn a_stiff_shaft_is_none() {
        let trial = Trial { parameters: [0.11, 0.25, 2.7, 1.0], position: 0.3, velocity: 0.0, step: 1e-3 };
        let commands: Vec<f64> = (0..5_000).map(|k| 2.0 * (3.0 * f64::from(k) * 1e-3).sin()).collect();
        for form in [0, 1] {
            let at = |compliance: f64| trial.follow(&Compliance, form, &[compliance, 0.6, 0.05], &commands);
            let plain = at(0.0);
            for compliance in [1e-9, 1e-6, 1e-4] {
                let stiff = at(compliance);
                let worst = stiff.iter().zip(&plain).map(|(a, b)| (a.position - b.position).abs()).fold(0.0, f64::max);
                assert!(worst < 2e-6 + 6.0 * compliance, "form {form}, {compliance}: {worst} rad");
            }
        }
    }

    /// A link that is let go falls with its own inertia alone until the shaft has bent; one that its motor holds up stays.
    #[test]
    fn what_is_let_go_begins_with_a_straight_shaft() {
        let (weight, inertia, share) = (2.0, 0.1, 0.4);
        let at = |drive: f64, velocity: f64| {
            let trial = Trial { parameters: [inertia, 0.0, weight, 1.0], position: 0.9, velocity, step: 1e-4 };
            let motion = trial.follow(&Compliance, 1, &[0.05, share, 0.0], &[drive; 20]);
            (motion[19].velocity - velocity) / (19.0 * 1e-4)
        };
        let pull = weight * 0.9_f64.sin();
        let alone = -pull / ((1.0 - share) * inertia);
        assert!((at(0.0, 0.0) / alone - 1.0).abs() < 0.02, "{}", at(0.0, 0.0));
        assert!(at(pull, 0.0).abs() < 1e-6 * alone.abs(), "{}", at(pull, 0.0));
        // What moves has been pulled at before: both move as one.
        assert!((at(0.0, 9.0) / (-pull / inertia) - 1.0).abs() < 0.05, "{}", at(0.0, 9.0));
    }

    #[test]
    fn what_creeps_is_not_sought_as_elastic() {
        let sought = Mechanism::<Joint>::sought(&Compliance, &Typical::default());
        let ratios: Vec<&Parameter> =
            sought.iter().flat_map(|f| &f.parameters).filter(|p| p.name == "damping_ratio").collect();
        assert!(ratios.len() == 5 && ratios.iter().all(|p| p.upper < 1.0 && p.starts.iter().all(|s| *s < p.upper)));
    }
}
