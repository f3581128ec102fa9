//! Dry friction of gears, which grows with the load they carry.

use super::coulomb_friction::{hardly_giving, presliding_angle};
use super::drawn::{Drawn, moved, soft};
use super::stribeck_friction::rub;
use crate::robot::Mover;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// Dry friction of `torque + load |drive - external|`, where `drive` is the motor's effort and `external` that of gravity;
/// in the form `stribeck`, `torque + load |drive - external| + exp(-(v / stribeck_velocity)^2) (excess + load_excess |drive -
/// external|)`; in the form `directional`, `torque + |motor_load drive - external_load external|`, as where gears pass a
/// load on more easily one way than the other. In the form `presliding` the gears give before they slip: the first of these times `w`
/// with `w' = (v - |v| w / 2 - v |w| / 2) / presliding_angle`.
///
/// Source: Duclusaud, Passault, Padois & Ly, "Extended friction models for the physics simulation of servo actuators",
/// arXiv 2410.08650 (2024): models M3 and M4, and the direction of M5 (there with Stribeck's effect); presliding: Dahl, "Solid friction
/// damping of mechanical vibrations", AIAA Journal 14 (1976), with the unloading of Wen (1976).
#[derive(Debug, Clone, Copy)]
pub struct LoadFriction;

impl<P: Mover> Mechanism<P> for LoadFriction {
    fn about(&self) -> About {
        About {
            name: "load_friction",
            site: Site::Plant,
            title: "load-dependent friction",
            law: "inertia a = ... - (torque + load |drive - external|) sign(v); holds as much at rest",
            source: "Duclusaud, Passault, Padois & Ly, arXiv 2410.08650 (2024), models M3 to M5",
            remedy: "give the gears friction that grows with the load, and identify it at several loads",
            contains: &["coulomb_friction", "stribeck_friction"],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let torques = |name, fraction: f64| {
            Parameter::new(name, "N m", 0.0).within(0.0, f64::INFINITY).starting_at(&[fraction * typical.effort])
        };
        // At a share of 1 no load could move the gears.
        let loads = |name, starts: &[f64]| Parameter::new(name, "", 0.0).within(0.0, 1.0).starting_at(starts);
        let rate = typical.rate.max(1e-9);
        let velocity = Parameter::new("stribeck_velocity", "rad/s", rate)
            .within(1e-3 * rate.min(1.0), f64::INFINITY)
            .starting_at(&[0.05, 0.3].map(|fraction| fraction * rate));
        vec![
            Form { name: "even", parameters: vec![torques("torque", 0.05), loads("load", &[0.05, 0.2])] },
            Form {
                name: "stribeck",
                parameters: vec![
                    torques("torque", 0.05),
                    loads("load", &[0.1]),
                    torques("excess", 0.05),
                    loads("load_excess", &[0.1]),
                    velocity,
                ],
            },
            Form {
                name: "directional",
                parameters: vec![
                    torques("torque", 0.05),
                    loads("motor_load", &[0.05, 0.2]),
                    loads("external_load", &[0.05, 0.2]),
                ],
            },
            Form {
                name: "presliding",
                parameters: vec![torques("torque", 0.05), loads("load", &[0.05, 0.2]), presliding_angle(typical)],
            },
        ]
    }

    fn sought(&self, typical: &Typical) -> Vec<Form> {
        hardly_giving(Mechanism::<P>::forms(self, typical), typical)
    }

    fn general(&self, form: usize) -> bool {
        form == 3
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let row = |k| thetas.row(k).to_vec();
        match form {
            0 => Box::new(OneShare(Gears { torque: row(0), motor: row(1), external: row(1) })),
            1 => Box::new(StribeckGears {
                sliding: Gears { torque: row(0), motor: row(1), external: row(1) },
                sticking: Gears { torque: row(2), motor: row(3), external: row(3) },
                velocity: row(4),
            }),
            2 => Box::new(Gears { torque: row(0), motor: row(1), external: row(2) }),
            _ => Box::new(GivingGears {
                gears: Gears { torque: row(0), motor: row(1), external: row(1) },
                drawn: Drawn::new(thetas.row(2)),
                level: vec![0.0; thetas.lanes()],
            }),
        }
    }
}

#[derive(Clone)]
struct Gears {
    torque: Vec<f64>,
    motor: Vec<f64>,
    external: Vec<f64>,
}

impl Gears {
    /// Changes a lane, whose torque, motor's and external share are the parameters of these numbers.
    fn change_of(&mut self, change: &LaneChange<'_>, [torque, motor, external]: [usize; 3]) {
        change.parameter(torque, &mut self.torque);
        change.parameter(motor, &mut self.motor);
        change.parameter(external, &mut self.external);
    }

    /// Friction in lane `lane` under these efforts of motor and gravity [N m].
    #[inline]
    fn friction(&self, lane: usize, drive: f64, external: f64) -> f64 {
        self.torque[lane] + (self.motor[lane] * drive - self.external[lane] * external).abs()
    }
}

/// Efforts of motor and gravity, in the middle of the step [N m].
#[inline]
fn efforts<P: Mover>(tick: Tick, scene: &Scene<'_, P>, lane: usize, state: &P::State) -> (f64, f64) {
    let motion = P::motion(state);
    let midway = motion.midway(tick.step);
    let external = P::external(scene, lane, midway);
    (P::drive(scene, lane), external)
}

impl<P: Mover> Law<P> for Gears {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.change_of(change, [0, 1, 2]);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        for (lane, (effect, state)) in effects.iter_mut().zip(scene.states).enumerate() {
            let (drive, external) = efforts(tick, scene, lane, state);
            P::push(effect).dry_friction += self.friction(lane, drive, external);
        }
    }
}

/// Gears with one share for motor and gravity.
#[derive(Clone)]
struct OneShare(Gears);

impl<P: Mover> Law<P> for OneShare {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.0.change_of(change, [0, 1, 1]);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        self.0.act(tick, scene, effects);
    }
}

#[derive(Clone)]
struct StribeckGears {
    sliding: Gears,
    sticking: Gears,
    velocity: Vec<f64>,
}

impl<P: Mover> Law<P> for StribeckGears {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.sliding.change_of(change, [0, 1, 1]);
        self.sticking.change_of(change, [2, 3, 3]);
        change.parameter(4, &mut self.velocity);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        for (lane, (effect, state)) in effects.iter_mut().zip(scene.states).enumerate() {
            let (drive, external) = efforts(tick, scene, lane, state);
            let scale = self.velocity[lane];
            let push = P::push(effect);
            let ratio = (P::motion(state).velocity + push.ahead).abs() / scale;
            let sticking = (-ratio * ratio).exp() * self.sticking.friction(lane, drive, external);
            let friction = self.sliding.friction(lane, drive, external) + sticking;
            let inertia = || P::inertia(scene.dynamics, lane, state);
            rub(push, friction, 2.0 * ratio / scale * sticking, inertia, tick.step);
        }
    }
}

/// Gears that give before they slip.
#[derive(Clone)]
struct GivingGears {
    gears: Gears,
    drawn: Drawn,
    /// Friction once they slip, under the load of each lane [N m].
    level: Vec<f64>,
}

impl<P: Mover> Law<P> for GivingGears {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.gears.change_of(change, [0, 1, 1]);
        self.drawn.change(2, change);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        for (lane, (level, state)) in self.level.iter_mut().zip(scene.states).enumerate() {
            let (drive, external) = efforts(tick, scene, lane, state);
            *level = self.gears.friction(lane, drive, external);
        }
        self.drawn.pull(tick, scene, effects, &self.level, |_, level, way| moved(level, way, soft));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;

    /// On a linear axis, or a joint that nothing weighs on, it takes a share of the drive: `a = drive (1 - load) / inertia`.
    #[test]
    fn without_gravity_it_takes_a_share_of_the_drive() {
        let trial = Trial { parameters: [0.1, 0.0, 0.0, 1.0], position: 0.0, velocity: 0.0, step: 1e-3 };
        for (form, values) in
            [(0, vec![0.0, 0.2]), (1, vec![0.0, 0.2, 0.0, 0.0, 1.0]), (2, vec![0.0, 0.2, 0.7]), (3, vec![0.0, 0.2, 1e-9])]
        {
            let motion = trial.follow(&LoadFriction, form, &values, &[0.5; 1_001]);
            // What gives moves a step farther before it slips.
            let slack = if form == 3 { 0.5 * 0.2 / 0.1 * 3e-3 } else { 1e-9 };
            assert!((motion[1_000].velocity - 0.5 * 0.8 / 0.1).abs() < slack, "form {form}");
        }
    }

    /// A weight held at right angles: the least drive that lifts it and the greatest that lets it sink, as the law has them.
    #[test]
    fn it_holds_a_weight_between_the_two_drives_of_the_law() {
        let (weight, torque) = (2.0, 0.1);
        let gravity = -weight;
        for (form, values, motor, external) in [
            (0, vec![torque, 0.1], 0.1, 0.1),
            (1, vec![0.06, 0.07, 0.04, 0.03, 0.2], 0.1, 0.1),
            (2, vec![torque, 0.05, 0.2], 0.05, 0.2),
        ] {
            // drive + gravity = +-(torque + motor drive - external gravity), the drive being upward.
            let lifts = (torque - external * gravity - gravity) / (1.0 - motor);
            let sinks = (-torque + external * gravity - gravity) / (1.0 + motor);
            let trial = Trial {
                parameters: [0.1, 0.0, weight, 1.0],
                position: std::f64::consts::FRAC_PI_2,
                velocity: 0.0,
                step: 1e-3,
            };
            for (drive, way) in [(lifts + 0.01, 1.0), (lifts - 0.01, 0.0), (sinks + 0.01, 0.0), (sinks - 0.01, -1.0)] {
                let motion = trial.follow(&LoadFriction, form, &values, &[drive; 200]);
                let moved = motion[199].position - trial.position;
                assert!(if way == 0.0 { moved == 0.0 } else { moved * way > 1e-5 }, "form {form}, {drive}: {moved}");
            }
        }
    }

    /// Pushed by less than what moves them, gears give as far as the law has it, and come back when they are let go.
    #[test]
    fn gears_give_before_they_slip() {
        let trial = Trial { parameters: [0.1, 0.05, 0.0, 1.0], position: 0.3, velocity: 0.0, step: 1e-3 };
        let ramp: Vec<f64> = (0..60_000).map(|k| 0.1 * f64::from(k) / 60_000.0).collect();
        let held = trial.follow(&LoadFriction, 3, &[0.15, 0.5, 0.05], &ramp)[59_999].position;
        // 0.1 against 0.15 + 0.5 x 0.1.
        let way = 0.05 * 2.0_f64.ln();
        assert!((held - 0.3 - way).abs() < 1e-4, "{held}, {}", 0.3 + way);
    }
}
