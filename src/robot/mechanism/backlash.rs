//! Play in the transmission: gears that do not touch while they turn round.

use super::second_mass::{Coupling, Load, SecondMass, as_one, holds};
use super::spring::Wall;
use crate::robot::{Motion, Mover};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// In the form `play`, what arrives of a command follows it at half of `width`: a command that turns round has no effect
/// until it has come back by `width`.
///
/// In the form `gap`, a motor with `motor_share` of the inertia, driven by the command and damped by the joint's viscous
/// friction, moves the link only where it touches it, at either end of `gap`; in the form `gap_friction` the motor has dry
/// friction of its own as well. The touch is stiff: 160 Hz for motor and link against each other, and critically damped. In
/// the form `gap_spring` it gives: by `stiffness`, with a damper of `damping_ratio` times the critical damping of the two. At first
/// the motor touches the link on the side that carries the load, or is in the middle of the gap where the link rests and the motor does
/// not hold it up.
///
/// Source: Tao & Kokotović, *Adaptive Control of Systems with Actuator and Sensor Nonlinearities* (1996), chapter 2 (play);
/// Nordin & Gutman, "Controlling mechanical systems with backlash: a survey", Automatica 38 (2002), section 2 (gap).
#[derive(Debug, Clone, Copy)]
pub struct Backlash;

/// Natural frequency of motor and link against each other while they touch [rad/s]: 160 Hz, above what position sensors
/// see, below what makes a bounce of one step.
const TOUCH: f64 = 1_000.0;
/// A link that takes longer than this [s] to come as far as the gap is wide rests.
const RESTS: f64 = 0.1;
/// Damping of the touch over critical damping: gears rattle, but do not ring.
const TOUCH_DAMPING: f64 = 1.0;

impl<P: Mover> Mechanism<P> for Backlash
where
    P::Command: AsMut<f64>,
{
    fn about(&self) -> About {
        About {
            name: "backlash",
            site: Site::Command,
            title: "backlash",
            law: "play: u follows the command at half of width; gap: motor and link, apart by up to gap, push where they touch",
            source: "Tao & Kokotović (1996), ch. 2; Nordin & Gutman, Automatica 38 (2002), section 2",
            remedy: "preload or replace the gears, or model motor and link with the gap between them",
            // A touch that gives, without a gap, is a shaft.
            contains: &["compliance"],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let widths = [0.05, 0.2, 0.5].map(|fraction| fraction * typical.command);
        let gaps = [0.01, 0.05, 0.2, 0.5].map(|fraction| fraction * typical.output);
        let gap = || Parameter::new("gap", "rad", 0.0).within(0.0, f64::INFINITY).starting_at(&gaps);
        let share = || Parameter::new("motor_share", "", 0.5).within(0.05, 0.95).starting_at(&[0.3, 0.55, 0.8]);
        let friction =
            Parameter::new("motor_friction", "N m", 0.0).within(0.0, f64::INFINITY).starting_at(&[0.1 * typical.effort]);
        // What bends by a part of the smallest gap under the usual effort, and by as much as the middle one.
        let firm = [300.0, 30.0].map(|factor| factor * typical.effort / typical.output.max(1e-12));
        let stiffness = Parameter::new("stiffness", "N m/rad", 10.0 * firm[0]).within(0.0, f64::INFINITY).starting_at(&firm);
        let ratio = Parameter::new("damping_ratio", "", 1.0).within(0.0, 5.0).starting_at(&[0.3]);
        let width = Parameter::new("width", "command", 0.0).within(0.0, f64::INFINITY).starting_at(&widths);
        vec![
            Form { name: "play", parameters: vec![width] },
            Form { name: "gap", parameters: vec![gap(), share()] },
            Form { name: "gap_friction", parameters: vec![gap(), share(), friction] },
            Form { name: "gap_spring", parameters: vec![gap(), share(), stiffness, ratio] },
        ]
    }

    fn site(&self, form: usize) -> Site {
        if form == 0 { Site::Command } else { Site::Plant }
    }

    /// Play remembers the last turn of the command that was wide enough to cross it.
    fn memory(&self) -> f64 {
        5.0
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let row = thetas.row(0).to_vec();
        if form == 0 {
            return Box::new(Play { width: row, follower: vec![None; thetas.lanes()] });
        }
        let friction = if form == 2 { thetas.row(2).to_vec() } else { vec![0.0; thetas.lanes()] };
        let spring = (form == 3).then(|| (thetas.row(2).to_vec(), thetas.row(3).to_vec()));
        let motor = vec![None; thetas.lanes()];
        Box::new(Gap { gap: row, share: thetas.row(1).to_vec(), rubs: form == 2, friction, spring, motor })
    }
}

#[derive(Clone)]
struct Play {
    width: Vec<f64>,
    follower: Vec<Option<f64>>,
}

impl<P: Mover> Law<P> for Play
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.width);
        change.memory(&mut self.follower);
    }

    fn shape(&mut self, _: Tick, commands: &mut [P::Command]) {
        for ((command, width), follower) in commands.iter_mut().zip(&self.width).zip(&mut self.follower) {
            let u = command.as_mut();
            if *width > 0.0 {
                let half = 0.5 * width;
                *u = follower.unwrap_or(*u).max(*u - half).min(*u + half);
                *follower = Some(*u);
            }
        }
    }
}

#[derive(Clone)]
struct Gap {
    gap: Vec<f64>,
    share: Vec<f64>,
    /// Whether the third parameter is the motor's friction.
    rubs: bool,
    friction: Vec<f64>,
    /// Stiffness and damping ratio of the touch, where it gives.
    spring: Option<(Vec<f64>, Vec<f64>)>,
    motor: Vec<Option<SecondMass>>,
}

impl<P: Mover> Law<P> for Gap {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.gap);
        change.parameter(1, &mut self.share);
        if self.rubs {
            change.parameter(2, &mut self.friction);
        }
        if let Some((stiffness, ratio)) = &mut self.spring {
            change.parameter(2, stiffness);
            change.parameter(3, ratio);
        }
        change.memory(&mut self.motor);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let parameters = self.gap.iter().zip(&self.share).zip(&self.friction).zip(&mut self.motor);
        let lanes = effects.iter_mut().zip(scene.states).zip(parameters).enumerate();
        for (lane, ((effect, state), (((gap, share), friction), motor))) in lanes {
            if *gap <= 0.0 {
                continue;
            }
            let link = P::motion(state);
            let inertia = P::inertia(scene.dynamics, lane, state);
            let drive = P::drive(scene, lane);
            let damping = P::damping(scene.dynamics, lane, state);
            let reduced = share * (1.0 - share) * inertia;
            let (stiffness, damping_ratio) = match &self.spring {
                Some((stiffness, ratio)) => (stiffness[lane].max(1e-9), ratio[lane]),
                None => (TOUCH * TOUCH * reduced, TOUCH_DAMPING),
            };
            let wall = Wall { stiffness, damping_ratio, inertia: reduced };
            let motor = match motor {
                Some(motor) => {
                    motor.arrive(link.velocity);
                    motor
                }
                None => {
                    let external = P::external(scene, lane, link.position);
                    let load = -as_one(*share, external, drive);
                    let leans = load != 0.0 && leans(link.velocity, *gap, [drive, external]);
                    let away = if leans { load / wall.stiffness + load.signum() * 0.5 * gap } else { 0.0 };
                    motor.insert(SecondMass::starting(Motion { position: link.position + away, ..link }))
                }
            };
            let coupling = touch(&wall, motor.motion, link, 0.5 * gap, tick.step);
            let load = Load { inertia: share * inertia, effort: drive, damping, dry_friction: *friction };
            let (effort, added) = motor.couple(tick.step, link.velocity, load, coupling);
            let push = P::push(effect);
            push.effort += effort - drive;
            push.inertia += added - share * inertia;
            push.damping -= damping;
        }
    }
}

/// Whether the motor leans at first on the side that carries the load: where the link moves, or rests because the motor holds it up. What
/// rests for another reason has left the motor somewhere in the gap, and the middle is nearest to wherever that is.
#[inline]
fn leans(velocity: f64, gap: f64, [drive, external]: [f64; 2]) -> bool {
    holds(drive, external) || velocity.abs() * RESTS > gap
}

/// How motor and link touch in a step of `step` [s], free to move by `half` [rad] either way.
fn touch(wall: &Wall, motor: Motion, link: Motion, half: f64, step: f64) -> Coupling {
    let (apart, rate) = (motor.position - link.position, motor.velocity - link.velocity);
    let ahead = wall.meet(apart - half, rate, step).map(|contact| (contact, 1.0));
    let touching = ahead.or_else(|| wall.meet(-half - apart, -rate, step).map(|contact| (contact, -1.0)));
    touching.map_or_else(Coupling::default, |(contact, side)| Coupling {
        effort: -side * contact.effort - contact.damping * rate,
        rate: 0.5 * contact.damping + contact.inertia / step,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Joint;
    use crate::robot::Signal;
    use crate::robot::mechanism::trial::Trial;

    /// A triangle of amplitude A leaves play of width w as one of amplitude A - w / 2, late by w / 2 on every flank.
    #[test]
    fn play_comes_back_by_its_width_before_it_moves() {
        let (thetas, tick) = (Thetas::single(&[0.4]), Tick { index: 0, time: 0.0, step: 1e-3 });
        let mut law: Box<dyn Law<Joint>> = Backlash.law(0, &thetas, Seed(0));
        let mut passed = Vec::new();
        for k in 0..4_000 {
            let phase = f64::from(k) / 1_000.0;
            let u = 1.0 - ((phase + 1.0).rem_euclid(4.0) - 2.0).abs();
            let mut commands = [Signal(u)];
            law.shape(tick, &mut commands);
            passed.push((u, commands[0].0));
        }
        for (u, y) in &passed[500..1_000] {
            assert!((y - (u - 0.2)).abs() < 1e-12);
        }
        assert!(passed[1_001..1_399].iter().all(|(_, y)| (y - 0.8).abs() < 2e-3));
        for (u, y) in &passed[1_401..3_000] {
            assert!((y - (u + 0.2)).abs() < 2e-3);
        }
    }

    const TRIAL: Trial = Trial { parameters: [0.1, 0.0, 0.0, 1.0], position: 0.0, velocity: 0.0, step: 1e-3 };

    /// A drive that turns round moves the motor alone until it has crossed the gap: the time that takes is known.
    #[test]
    fn the_link_waits_until_the_motor_has_crossed_the_gap() {
        let (gap, share, drive) = (0.05, 0.4, 0.2);
        // Under way it leans on the one side and pushes; then the drive turns round.
        let commands: Vec<f64> = (0..1_000).map(|k| if k < 300 { drive } else { -drive }).collect();
        let trial = Trial { velocity: 0.5, ..TRIAL };
        let motion = trial.follow(&Backlash, 1, &[gap, share], &commands);
        // Pushed together, both have the drive over the whole inertia.
        let gained = motion[300].velocity - 0.5;
        assert!((gained / (drive / 0.1 * 0.3) - 1.0).abs() < 1e-3, "{gained}");
        let free = (2.0 * gap * share * 0.1 / drive).sqrt();
        let still = 300 + (free / 1e-3) as usize;
        let coasting = motion[310].velocity;
        assert!(motion[310..still - 1].iter().all(|m| (m.velocity - coasting).abs() < 1e-12));
        assert!(motion[still + 4].velocity < coasting - 0.05, "no touch {} s after the turn", free + 4e-3);
    }

    /// A link that rests and is not held up by its motor has it in the middle of the gap, of which it has half to cross.
    #[test]
    fn a_motor_that_holds_nothing_up_begins_in_the_middle() {
        let (gap, share, drive) = (0.05, 0.4, 0.2);
        let motion = TRIAL.follow(&Backlash, 1, &[gap, share], &[drive; 300]);
        let first = motion.iter().position(|m| m.velocity > 1e-6).unwrap();
        let free = (gap * share * 0.1 / drive).sqrt();
        assert!((first as f64 * 1e-3 - free).abs() < 3e-3, "{first} ms, {free} s");
        // One that holds a weight up touches it.
        let weight = 2.0;
        let held = Trial { parameters: [0.1, 0.0, weight, 1.0], position: std::f64::consts::FRAC_PI_2, ..TRIAL };
        let motion = held.follow(&Backlash, 1, &[gap, share], &[weight; 300]);
        assert!(motion.iter().all(|m| (m.position - held.position).abs() < 2e-3), "{:?}", motion[299]);
    }

    /// What is shared in contacts is shared by the masses: no momentum is lost or made.
    #[test]
    fn momentum_is_that_of_the_drive() {
        let (gap, share, friction) = (vec![0.03], vec![0.4], vec![0.0]);
        let mut law = Gap { gap, share, rubs: false, friction, spring: None, motor: vec![None] };
        let (inertia, step) = (0.1, 1e-3);
        let joint = Joint::new(crate::robot::Axis::Rotary, TRIAL.parameters, [0.0; 4]);
        let dynamics = crate::sim2real::Plant::dynamics(&joint, &Thetas::single(&TRIAL.parameters));
        let mut states = [Motion { position: 0.0, velocity: 0.0 }];
        let mut impulse = 0.0;
        for k in 0..3_000 {
            let tick = Tick { index: k, time: k as f64 * step, step };
            let commands = [Signal(0.3 * (11.0 * tick.time).sin())];
            let mut effects = [crate::robot::Push::default()];
            let scene = Scene { dynamics: &dynamics, states: &states, inputs: &[()], commands: &commands };
            Law::<Joint>::act(&mut law, tick, &scene, &mut effects);
            let motor = law.motor[0].unwrap_or_default().motion;
            let momentum = inertia * (0.6 * states[0].velocity + 0.4 * motor.velocity);
            assert!((momentum - impulse).abs() < 1e-12, "{k}: {momentum} not {impulse}");
            assert!((motor.position - states[0].position).abs() < 0.015 + 2e-3);
            crate::sim2real::Dynamics::advance(&dynamics, tick, &mut states, &[()], &commands, &effects);
            impulse += step * commands[0].0;
        }
    }

    /// The smaller the gap, the more it is the joint without one.
    #[test]
    fn a_gap_that_closes_leaves_the_joint_as_it_was() {
        let trial = Trial { parameters: [0.11, 0.25, 2.7, 1.0], position: 0.3, velocity: 0.0, step: 1e-3 };
        let commands: Vec<f64> = (0..5_000).map(|k| 2.0 * (3.0 * f64::from(k) * 1e-3).sin()).collect();
        for form in [1, 2] {
            let at = |gap: f64| trial.follow(&Backlash, form, &[gap, 0.4, 0.0][..=form], &commands);
            let plain = at(0.0);
            for (gap, most) in [(1e-9, 2e-4), (1e-3, 5e-3)] {
                let worst = at(gap).iter().zip(&plain).map(|(a, b)| (a.position - b.position).abs()).fold(0.0, f64::max);
                assert!(worst < most, "form {form}, gap {gap}: {worst} rad");
            }
        }
    }
}
