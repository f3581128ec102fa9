//! A load taken up, or put down, while the recording ran.

use crate::robot::Mover;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Ticks, Typical};

/// From `time` on, inertia and gravity are greater by `fraction` of what they were; in the form `apart`, inertia by
/// `inertia_fraction` and gravity by `gravity_fraction`, as where a rotor's inertia, which nothing weighs, is part of the
/// joint's. Velocity does not jump: the load moves with the joint when it is taken up.
///
/// Source: Newton's second law for a body whose parameters change at once; the parameters are those of Atkeson, An &
/// Hollerbach, "Estimation of inertial parameters of manipulator loads and links", International Journal of Robotics
/// Research 5 (1986).
#[derive(Debug, Clone, Copy)]
pub struct PayloadChange;

/// Most starts for the time of the change.
const TIMES: f64 = 60.0;

impl<P: Mover> Mechanism<P> for PayloadChange {
    fn about(&self) -> About {
        About {
            name: "payload_change",
            site: Site::Plant,
            title: "a change of payload",
            law: "from time on: inertia (1 + fraction) a = ... + gravity (1 + fraction)",
            source: "Atkeson, An & Hollerbach, International Journal of Robotics Research 5 (1986)",
            remedy: "look at what the arm took up or put down at that time, and tell the simulator of it",
            contains: &[],
        }
    }

    fn ages(&self) -> bool {
        true
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let spacing = (typical.duration / TIMES).max(1.0);
        let count = ((typical.duration / spacing).ceil() as usize).clamp(2, TIMES as usize);
        let times: Vec<f64> = (1..count).map(|k| k as f64 * spacing).collect();
        let time = || Parameter::new("time", "s", 0.0).within(0.0, f64::INFINITY).starting_at(&times).in_time();
        let fraction =
            |name, least| Parameter::new(name, "", 0.0).within(least, f64::INFINITY).starting_at(&[0.2]).proportional();
        vec![
            Form { name: "together", parameters: vec![time(), fraction("fraction", -0.9)] },
            Form {
                name: "apart",
                parameters: vec![
                    time(),
                    fraction("inertia_fraction", -0.9),
                    // A load on the other side of the axis lifts.
                    fraction("gravity_fraction", -2.0),
                ],
            },
        ]
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let last = if form == 0 { 1 } else { 2 };
        Box::new(Payload {
            time: thetas.row(0).to_vec(),
            inertia: thetas.row(1).to_vec(),
            gravity: thetas.row(last).to_vec(),
            last,
        })
    }
}

#[derive(Clone)]
struct Payload {
    time: Vec<f64>,
    inertia: Vec<f64>,
    gravity: Vec<f64>,
    /// Which parameter is that of gravity.
    last: usize,
}

impl Payload {
    /// What is different in lane `lane` during `tick`.
    fn load<P: Mover>(&self, lane: usize, tick: Tick, scene: &Scene<'_, P>, effect: &mut P::Effect) {
        let (end, time, inertia, gravity) = (tick.time + tick.step, self.time[lane], self.inertia[lane], self.gravity[lane]);
        if end <= time {
            return;
        }
        // In the tick in which it happens, for what is left of it: what the whole tick then amounts to is the same as
        // that of its two parts, `(1 - left) torque / inertia + left (torque after) / (inertia after)`.
        let left = ((end - time) / tick.step).min(1.0);
        let share = left / (1.0 + inertia * (1.0 - left));
        let state = &scene.states[lane];
        let motion = P::motion(state);
        let midway = motion.midway(tick.step);
        let push = P::push(effect);
        push.inertia += share * inertia * P::inertia(scene.dynamics, lane, state);
        if gravity != 0.0 {
            push.effort += share * gravity * P::external(scene, lane, midway);
        }
    }
}

impl<P: Mover> Law<P> for Payload {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.time);
        change.parameter(1, &mut self.inertia);
        change.parameter(self.last, &mut self.gravity);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        effects.iter_mut().enumerate().for_each(|(lane, effect)| self.load(lane, tick, scene, effect));
    }

    fn act_each(&mut self, ticks: Ticks<'_>, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        effects.iter_mut().enumerate().for_each(|(lane, effect)| self.load(lane, ticks.lane(lane), scene, effect));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;

    const BEFORE: [f64; 4] = [0.11, 0.25, 2.7, 1.0];

    fn drive(k: i32) -> f64 {
        (4.0 * f64::from(k) * 1e-3).sin()
    }

    /// Before the change it is the joint as it was, to the bit; after it, the joint with the other parameters started from
    /// the motion of that moment, whether the change falls on a tick or within one.
    #[test]
    fn before_and_after_are_two_joints() {
        let commands: Vec<f64> = (0..2_000).map(drive).collect();
        let trial = Trial { parameters: BEFORE, position: 0.3, velocity: 0.0, step: 1e-3 };
        let plain = trial.follow(&PayloadChange, 1, &[0.0, 0.0, 0.0], &commands);
        let after = [0.11 * 1.3, 0.25, 2.7 * 0.6, 1.0];
        for (time, tolerance) in [(1.0, 1e-12), (1.0004, 2e-6)] {
            let motion = trial.follow(&PayloadChange, 1, &[time, 0.3, -0.4], &commands);
            assert_eq!(motion[..=1_000], plain[..=1_000]);
            let first = time as usize * 1_000 + usize::from(time > 1.0);
            let since =
                Trial { parameters: after, position: motion[first].position, velocity: motion[first].velocity, step: 1e-3 };
            let expected = since.follow(&PayloadChange, 1, &[0.0, 0.0, 0.0], &commands[first..]);
            let worst =
                motion[first..].iter().zip(&expected).map(|(a, b)| (a.position - b.position).abs()).fold(0.0, f64::max);
            assert!(worst < tolerance, "{worst}");
        }
        let together = trial.follow(&PayloadChange, 0, &[1.0, 0.3], &commands);
        assert_eq!(together, trial.follow(&PayloadChange, 1, &[1.0, 0.3, 0.3], &commands));
    }

    /// The output moves evenly with the time of the change: derivatives by finite differences are what they should be.
    #[test]
    fn the_time_has_a_derivative() {
        let commands: Vec<f64> = (0..2_000).map(drive).collect();
        let trial = Trial { parameters: BEFORE, position: 0.3, velocity: 0.0, step: 1e-3 };
        let at = |time: f64| trial.follow(&PayloadChange, 0, &[time, 0.3], &commands)[1_999].position;
        let wide = (at(1.006) - at(0.998)) / 8e-3;
        for k in 0..10 {
            let time = 1.0 + f64::from(k) * 3.7e-4;
            let narrow = (at(time + 1e-5) - at(time - 1e-5)) / 2e-5;
            assert!((narrow / wide - 1.0).abs() < 0.05, "{time}: {narrow}, {wide} over a wider step");
        }
    }
}
