//! Dry friction that is stronger in slow motion than in fast: a joint that sticks and slips.

use super::coulomb_friction::{hardly_giving, presliding_angle};
use super::drawn::{Drawn, moved, soft};
use crate::robot::{Mover, Push};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// Dry friction of `torque + excess exp(-(v / stribeck_velocity)^2)`; in the form `tustin`,
/// `torque + excess exp(-|v| / tustin_velocity)`. In the form `presliding` it gives before it slips: the first of these times `w` with
/// `w' = (v - |v| w / 2 - v |w| / 2) / presliding_angle`, which is the sense of motion once it slips.
///
/// Source: Stribeck, "Die wesentlichen Eigenschaften der Gleit- und Rollenlager", VDI-Zeitschrift 46 (1902); the
/// exponentials are Bo & Pavelescu's, Wear 82 (1982), and Tustin's, Journal of the IEE 94 (1947), as in Armstrong-Hélouvry,
/// Dupont & Canudas de Wit, Automatica 30 (1994), section 2; presliding: Canudas de Wit, Olsson, Åström & Lischinsky, "A new model for
/// control of systems with friction", IEEE Transactions on Automatic Control 40 (1995), with bristles that bend as far at any level,
/// come back elastically and are not damped.
#[derive(Debug, Clone, Copy)]
pub struct StribeckFriction;

impl<P: Mover> Mechanism<P> for StribeckFriction {
    fn about(&self) -> About {
        About {
            name: "stribeck_friction",
            site: Site::Plant,
            title: "Stribeck friction",
            law: "inertia a = ... - (torque + excess exp(-(v / stribeck_velocity)^2)) sign(v); holds as much at rest",
            source: "Stribeck (1902); Bo & Pavelescu, Wear 82 (1982); Tustin, Journal of the IEE 94 (1947)",
            remedy: "add friction that falls with speed to the joint, keep out of slow motion, or compensate it there",
            contains: &["coulomb_friction"],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let parameters = |velocity| {
            let torques = |name, fractions: &[f64]| {
                let starts: Vec<f64> = fractions.iter().map(|fraction| fraction * typical.effort).collect();
                Parameter::new(name, "N m", 0.0).within(0.0, f64::INFINITY).starting_at(&starts)
            };
            let rate = typical.rate.max(1e-9);
            let velocities = [0.03, 0.15, 0.5].map(|fraction| fraction * rate);
            vec![
                torques("torque", &[0.05, 0.2]),
                torques("excess", &[0.1]),
                Parameter::new(velocity, "rad/s", rate).within(1e-3 * rate.min(1.0), f64::INFINITY).starting_at(&velocities),
            ]
        };
        let presliding = parameters("stribeck_velocity").into_iter().chain([presliding_angle(typical)]).collect();
        vec![
            Form { name: "gaussian", parameters: parameters("stribeck_velocity") },
            Form { name: "tustin", parameters: parameters("tustin_velocity") },
            Form { name: "presliding", parameters: presliding },
        ]
    }

    /// A friction that gives over more than a small part of the motion goes by another name.
    fn sought(&self, typical: &Typical) -> Vec<Form> {
        hardly_giving(Mechanism::<P>::forms(self, typical), typical)
    }

    fn general(&self, form: usize) -> bool {
        form == 2
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let friction = Friction {
            torque: thetas.row(0).to_vec(),
            excess: thetas.row(1).to_vec(),
            fading: thetas.row(2).iter().map(|velocity| 1.0 / velocity).collect(),
        };
        match form {
            0 => Box::new(Gaussian(friction)),
            1 => Box::new(Tustin(friction)),
            _ => {
                let none = vec![0.0; thetas.lanes()];
                Box::new(Presliding { drawn: Drawn::new(thetas.row(3)), level: none.clone(), fall: none, friction })
            }
        }
    }
}

#[derive(Clone)]
struct Friction {
    torque: Vec<f64>,
    excess: Vec<f64>,
    /// One over the velocity [s/rad].
    fading: Vec<f64>,
}

impl Friction {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.torque);
        change.parameter(1, &mut self.excess);
        change.derived(&mut self.fading, |values| 1.0 / values[2]);
    }

    /// `fading` gives the part of the excess that is left at a speed in units of its parameter, and minus its derivative.
    fn add<P: Mover>(
        &self,
        tick: Tick,
        scene: &Scene<'_, P>,
        effects: &mut [P::Effect],
        fading: impl Fn(f64) -> (f64, f64),
    ) {
        let parameters = self.torque.iter().zip(&self.excess).zip(&self.fading);
        let lanes = effects.iter_mut().zip(scene.states).zip(parameters).enumerate();
        for (lane, ((effect, state), ((torque, excess), per_velocity))) in lanes {
            let push = P::push(effect);
            let (left, fall) = fading((P::motion(state).velocity + push.ahead).abs() * per_velocity);
            let inertia = || P::inertia(scene.dynamics, lane, state);
            rub(push, torque + excess * left, excess * per_velocity * fall, inertia, tick.step);
        }
    }
}

/// Adds dry `friction` [N m] that falls by `fall` [N m s/rad] with speed, to a coordinate of `inertia` [kg m^2].
#[inline]
pub(super) fn rub(push: &mut Push, friction: f64, fall: f64, inertia: impl FnOnce() -> f64, step: f64) {
    push.dry_friction += friction;
    // Friction of another mass takes nothing off this one's.
    if push.ahead == 0.0 {
        push.inertia -= falling(fall, inertia(), step);
    }
}

/// Inertia that dry friction seems to take off which falls by `fall` [N m s/rad] with speed.
///
/// Dry friction is that of the start of a step; that it falls on the way counts like an inertia that is not there: with it
/// the friction is that of the middle of the step, to second order. A fall too steep for the step to follow counts for less.
#[inline]
fn falling(fall: f64, inertia: f64, step: f64) -> f64 {
    (0.5 * step * fall).min(0.25 * inertia)
}

/// What is left of an excess at a speed in units of the velocity over which it fades, and minus its derivative.
#[inline]
fn gaussian(ratio: f64) -> (f64, f64) {
    let left = (-ratio * ratio).exp();
    (left, 2.0 * ratio * left)
}

#[derive(Clone)]
struct Gaussian(Friction);

impl<P: Mover> Law<P> for Gaussian {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.0.change(change);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        self.0.add(tick, scene, effects, gaussian);
    }
}

#[derive(Clone)]
struct Tustin(Friction);

impl<P: Mover> Law<P> for Tustin {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.0.change(change);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        self.0.add(tick, scene, effects, |ratio| {
            let left = (-ratio).exp();
            (left, left)
        });
    }
}

#[derive(Clone)]
struct Presliding {
    friction: Friction,
    drawn: Drawn,
    /// Friction once it slips, at the speed of each lane [N m], ...
    level: Vec<f64>,
    /// ... and how fast it falls with speed [N m s/rad].
    fall: Vec<f64>,
}

impl<P: Mover> Law<P> for Presliding {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.friction.change(change);
        self.drawn.change(3, change);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let Friction { torque, excess, fading } = &self.friction;
        for (lane, (level, fall)) in self.level.iter_mut().zip(&mut self.fall).enumerate() {
            let (left, falls) = gaussian(P::motion(&scene.states[lane]).velocity.abs() * fading[lane]);
            *level = torque[lane] + excess[lane] * left;
            *fall = excess[lane] * fading[lane] * falls;
        }
        self.drawn.pull(tick, scene, effects, &self.level, |_, level, way| moved(level, way, soft));
        for (lane, (effect, fall)) in effects.iter_mut().zip(&self.fall).enumerate() {
            let along = self.drawn.level(lane) * P::motion(&scene.states[lane]).velocity.signum();
            let inertia = P::inertia(scene.dynamics, lane, &scene.states[lane]);
            P::push(effect).inertia -= along * falling(*fall, inertia, tick.step);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;

    /// In steady motion the drive balances viscous and dry friction, which falls as the motion gets faster.
    #[test]
    fn a_steady_motion_meets_the_friction_of_its_speed_on_a_falling_curve() {
        let (torque, excess, scale) = (0.1, 0.2, 0.4);
        for form in [0, 1, 2] {
            for speed in [0.2_f64, 0.6, 1.5] {
                let fading = if form == 1 { (-speed / scale).exp() } else { (-(speed / scale).powi(2)).exp() };
                let level = torque + excess * fading;
                // Viscous friction steep enough that the motion is stable on the falling part.
                let viscous = 1.0;
                let drive = level + viscous * speed;
                let trial = Trial { parameters: [0.1, viscous, 0.0, 1.0], position: 0.0, velocity: speed, step: 1e-3 };
                let parameters = [torque, excess, scale, 0.01];
                let parameters = &parameters[..if form == 2 { 4 } else { 3 }];
                let motion = trial.follow(&StribeckFriction, form, parameters, &vec![drive; 4_000]);
                assert!((motion[3_999].velocity - speed).abs() < 1e-6, "{form} {speed}: {}", motion[3_999].velocity);
            }
        }
    }

    /// What holds is `torque + excess`; once it slides, less than that keeps it going.
    #[test]
    fn it_takes_more_to_break_away_than_to_keep_going() {
        let trial = Trial { parameters: [0.1, 0.01, 0.0, 1.0], position: 0.0, velocity: 0.0, step: 1e-3 };
        let drive: Vec<f64> = (0..3_000)
            .map(|k| {
                if k < 1_000 {
                    0.29
                } else if k < 1_300 {
                    0.5
                } else {
                    0.15
                }
            })
            .collect();
        let motion = trial.follow(&StribeckFriction, 0, &[0.1, 0.2, 0.1], &drive);
        assert!(motion[..1_000].iter().all(|m| m.position == 0.0));
        assert!(motion[2_999].velocity > 0.5);
    }

    /// Held by less than it takes to break away it gives as a spring whose level is that of rest; with next to no way to give it
    /// moves as what does not.
    #[test]
    fn it_gives_before_it_slips() {
        let trial = Trial { parameters: [0.1, 0.05, 0.0, 1.0], position: 0.3, velocity: 0.0, step: 1e-3 };
        let ramp: Vec<f64> = (0..60_000).map(|k| 0.15 * f64::from(k) / 60_000.0).collect();
        let held = trial.follow(&StribeckFriction, 2, &[0.1, 0.2, 0.4, 0.05], &ramp)[59_999].position;
        let way = 0.05 * 2.0_f64.ln();
        assert!((held - 0.3 - way).abs() < 1e-4, "{held}, {}", 0.3 + way);
        let commands: Vec<f64> = (0..6_000).map(|k| 0.8 * (4.0 * f64::from(k) * 1e-3).sin()).collect();
        let sliding = trial.follow(&StribeckFriction, 0, &[0.1, 0.2, 0.4], &commands);
        let bending = trial.follow(&StribeckFriction, 2, &[0.1, 0.2, 0.4, 1e-9], &commands);
        let worst = sliding.iter().zip(&bending).map(|(a, b)| (a.position - b.position).abs()).fold(0.0, f64::max);
        assert!(worst < 5e-3, "{worst} rad");
    }
}
