//! A restoring torque that remembers where it came from: bending cables, rubber, presliding in gears.

use super::coulomb_friction::PRESLIDING;
use crate::robot::Mover;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `-torque w` with `w' = (v - sigma |v| |w|^(n-1) w + (sigma - 1) v |w|^n) / yield_angle`, `sigma = 1/2`: elastic while it
/// comes back, and yielding at a level of `torque` after about `yield_angle`; `n = 1` in the form `soft`, `n = 2`, with a sharper
/// knee, in the form `sharp`, where the angle is `sharp_yield_angle`.
///
/// Source: Bouc (1967) and Wen, "Method for random vibration of hysteretic systems", ASCE Journal of the Engineering Mechanics
/// Division 102 (1976), normalized as by Ikhouane & Rodellar, *Systems with Hysteresis* (2007), section 2.
#[derive(Debug, Clone, Copy)]
pub struct Hysteresis;

impl<P: Mover> Mechanism<P> for Hysteresis {
    fn about(&self) -> About {
        About {
            name: "hysteresis",
            site: Site::Plant,
            title: "hysteresis",
            law: "inertia a = ... - torque w; w' = (v - |v| |w|^(n-1) w / 2 - v |w|^n / 2) / yield_angle",
            source: "Bouc (1967); Wen (1976); Ikhouane & Rodellar, Systems with Hysteresis (2007), section 2",
            remedy: "look for cables and seals that bend before they slip, or add the loop to the simulator",
            // Without way to yield, and with no end of it.
            contains: &["coulomb_friction", "stiffness"],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let parameters = |angle| {
            let torques = [0.1].map(|fraction| fraction * typical.effort);
            let output = typical.output.max(1e-9);
            let angles = [0.07, 0.2, 0.8].map(|fraction| fraction * output);
            vec![
                Parameter::new("torque", "N m", 0.0).within(0.0, f64::INFINITY).starting_at(&torques).proportional(),
                Parameter::new(angle, "rad", output).within(1e-4 * output.min(1.0), f64::INFINITY).starting_at(&angles),
            ]
        };
        vec![
            Form { name: "soft", parameters: parameters("yield_angle") },
            Form { name: "sharp", parameters: parameters("sharp_yield_angle") },
        ]
    }

    /// What slips after a small part of the motion is dry friction.
    fn sought(&self, typical: &Typical) -> Vec<Form> {
        let mut forms = Mechanism::<P>::forms(self, typical);
        for parameter in forms.iter_mut().flat_map(|form| &mut form.parameters) {
            if parameter.name.ends_with("yield_angle") {
                parameter.lower = PRESLIDING * typical.output;
                parameter.starts.retain(|start| *start >= parameter.lower);
            }
        }
        forms
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let loops =
            Loops { torque: thetas.row(0).to_vec(), angle: thetas.row(1).to_vec(), memory: vec![None; thetas.lanes()] };
        if form == 0 { Box::new(Soft(loops)) } else { Box::new(Sharp(loops)) }
    }
}

/// Where a lane was in the middle of its last step [rad], and how far its loop was drawn, from -1 to 1.
#[derive(Debug, Clone, Copy)]
struct Drawn {
    position: f64,
    level: f64,
}

#[derive(Clone)]
struct Loops {
    torque: Vec<f64>,
    angle: Vec<f64>,
    memory: Vec<Option<Drawn>>,
}

impl Loops {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.torque);
        change.parameter(1, &mut self.angle);
        change.memory(&mut self.memory);
    }

    /// `drawn` gives the level after loading from a level of at least 0 by a way in units of the yield angle.
    fn pull<P: Mover>(
        &mut self,
        tick: Tick,
        scene: &Scene<'_, P>,
        effects: &mut [P::Effect],
        loaded: impl Fn(f64, f64) -> f64,
    ) {
        let parameters = self.torque.iter().zip(&self.angle).zip(&mut self.memory);
        let lanes = effects.iter_mut().zip(scene.states).zip(parameters).enumerate();
        for (lane, ((effect, state), ((torque, angle), memory))) in lanes {
            if *torque <= 0.0 {
                continue;
            }
            let motion = P::motion(state);
            let midway = motion.position + 0.5 * tick.step * motion.velocity;
            // It must not be stiffer than a step can follow: by then it is dry friction in all but name.
            let least = torque * tick.step * tick.step / P::inertia(scene.dynamics, lane, state);
            let drawn = memory.get_or_insert(Drawn { position: motion.position, level: 0.0 });
            drawn.level = moved(drawn.level, (midway - drawn.position) / angle.max(least), &loaded);
            drawn.position = midway;
            P::push(effect).effort -= torque * drawn.level;
        }
    }
}

/// The level after a way in units of the yield angle: elastic back to 0, and from there on loading.
#[inline]
fn moved(level: f64, way: f64, loaded: impl Fn(f64, f64) -> f64) -> f64 {
    let back = if level * way < 0.0 { way.abs().min(level.abs()) } else { 0.0 };
    let level = level + way.signum() * back;
    let further = way.abs() - back;
    if further > 0.0 { way.signum() * loaded(level.abs(), further) } else { level }
}

#[derive(Clone)]
struct Soft(Loops);

impl<P: Mover> Law<P> for Soft {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.0.change(change);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        // dw = (1 - w) dx, exactly.
        self.0.pull(tick, scene, effects, |level, way| 1.0 - (1.0 - level) * (-way).exp());
    }
}

#[derive(Clone)]
struct Sharp(Loops);

/// `dw = (1 - w^2) dx`, exactly: `tanh(artanh(level) + way)`, by one exponential.
#[inline]
fn sharp(level: f64, way: f64) -> f64 {
    let left = (-2.0 * way).exp();
    let (sum, difference) = (1.0 + left, 1.0 - left);
    (level * sum + difference) / (sum + level * difference)
}

impl<P: Mover> Law<P> for Sharp {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.0.change(change);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        self.0.pull(tick, scene, effects, sharp);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;

    fn soft(level: f64, way: f64) -> f64 {
        1.0 - (1.0 - level) * (-way).exp()
    }

    /// The law in Ikhouane & Rodellar's words, by fine steps, against what is done in one.
    #[test]
    fn one_step_is_the_integral_of_the_law() {
        for n in [1, 2] {
            let rate = |w: f64, v: f64| v - 0.5 * v.abs() * w.abs().powi(n - 1) * w - 0.5 * v * w.abs().powi(n);
            for (start, way) in [(0.0, 0.7), (0.5, 0.3), (0.9, -2.5), (-0.3, 0.2), (-0.99, 4.0), (0.4, -0.4)] {
                let (mut w, h): (f64, f64) = (start, way / 100_000.0);
                for _ in 0..100_000 {
                    let half = w + 0.5 * h.abs() * rate(w, h.signum());
                    w += h.abs() * rate(half, h.signum());
                }
                let ours = if n == 1 { moved(start, way, soft) } else { moved(start, way, sharp) };
                assert!((ours - w).abs() < 1e-8, "n = {n}, {start} by {way}: {ours}, {w}");
            }
        }
    }

    /// Drawn to and fro by far more than the yield angle, the loop spans both levels and has the area of a parallelogram
    /// with rounded corners.
    #[test]
    fn the_loop_has_its_limits_and_its_area() {
        for (n, lost) in [(1, 1.0), (2, std::f64::consts::LN_2)] {
            let draw = |w, way| if n == 1 { moved(w, way, soft) } else { moved(w, way, sharp) };
            let (half, count) = (20.0, 100_000);
            let way = 2.0 * half / f64::from(count);
            let mut w = 1.0;
            let mut area = 0.0;
            for sense in [-1.0, 1.0] {
                for _ in 0..count {
                    let next = draw(w, sense * way);
                    assert!(next.abs() <= 1.0);
                    area += 0.5 * (w + next) * sense * way;
                    w = next;
                }
                assert!((w - sense).abs() < 1e-12);
            }
            // Each flank loses, against 2 * way, half an angle on the elastic line and `lost` in the knee.
            let expected = 2.0 * (2.0 * half - 1.0 - 0.5 - lost);
            assert!((area - expected).abs() < 1e-4, "n = {n}: {area}, {expected}");
        }
    }

    /// Drawn slowly to half its level it gives by the closed form; drawn by more than its level it slides, and takes `torque`
    /// from the drive.
    #[test]
    fn it_is_a_spring_at_first_and_friction_in_the_end() {
        let trial = Trial { parameters: [0.1, 0.05, 0.0, 1.0], position: 0.3, velocity: 0.0, step: 1e-3 };
        let ramp: Vec<f64> = (0..60_000).map(|k| 0.1 * f64::from(k) / 60_000.0).collect();
        for (form, way) in [(0, std::f64::consts::LN_2), (1, 0.5_f64.atanh())] {
            let held = trial.follow(&Hysteresis, form, &[0.2, 0.05], &ramp)[59_999].position;
            assert!((held - 0.3 - 0.05 * way).abs() < 5e-5, "{held}, {}", 0.3 + 0.05 * way);
            let slides = trial.follow(&Hysteresis, form, &[0.2, 0.05], &vec![0.5; 60_000])[59_999];
            assert!((slides.velocity - 0.3 / 0.05).abs() < 1e-6, "{}", slides.velocity);
        }
    }

    /// With hardly any way to yield it is dry friction: a joint pushed back and forth moves as one with that.
    #[test]
    fn without_way_to_yield_it_is_dry_friction() {
        let trial = Trial { parameters: [0.1, 0.1, 0.0, 1.0], position: 0.0, velocity: 0.0, step: 1e-3 };
        let commands: Vec<f64> = (0..6_000).map(|k| 0.8 * (4.0 * f64::from(k) * 1e-3).sin()).collect();
        let dry = trial.follow(&crate::robot::mechanism::CoulombFriction, 0, &[0.2], &commands);
        for form in [0, 1] {
            let yielding = trial.follow(&Hysteresis, form, &[0.2, 1e-9], &commands);
            let worst = dry.iter().zip(&yielding).map(|(a, b)| (a.position - b.position).abs()).fold(0.0, f64::max);
            assert!(worst < 2e-3, "form {form}: {worst} rad");
        }
    }
}
