//! A restoring torque that remembers where it came from: bending cables, rubber, presliding in gears.

use super::coulomb_friction::PRESLIDING;
use super::drawn::{Drawn, moved, sharp, soft};
use crate::robot::Mover;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Scene, Seed, Site, Thetas, Tick, Typical};

/// `-torque w` with `w' = (v - sigma |v| |w|^(n-1) w + (sigma - 1) v |w|^n) / yield_angle`, `sigma = 1/2`: elastic while it
/// comes back, and yielding at a level of `torque` after about `yield_angle`; `n = 1` in the form `soft`, `n = 2`, with a sharper
/// knee, in the form `sharp`, where the angle is `sharp_yield_angle`. In the form `bouc_wen` `n` (`exponent`) and `sigma` are
/// parameters too, and the angle is `elastic_angle`: with `sigma` above 1/2 it comes back more stiffly than it yielded, and with
/// `n` below 1 it begins to yield at once, as what consists of many parts does, the weakest of which slip first. In the form
/// `two_loops` such a part is told apart: beside the loop of `torque` and `wide_angle` another, soft as that, yields at a level of
/// `early_torque` after about `early_part` of that angle.
///
/// Source: Bouc (1967) and Wen, "Method for random vibration of hysteretic systems", ASCE Journal of the Engineering Mechanics
/// Division 102 (1976), normalized as by Ikhouane & Rodellar, *Systems with Hysteresis* (2007), section 2;
/// elements in parallel: Iwan, "A distributed-element model for hysteresis and its steady-state dynamic response", ASME Journal of Applied
/// Mechanics 33 (1966).
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
            Form { name: "bouc_wen", parameters: parameters("elastic_angle").into_iter().chain(shape()).collect() },
            Form { name: "two_loops", parameters: parameters("wide_angle").into_iter().chain(early(typical)).collect() },
        ]
    }

    /// What slips after a small part of the motion is dry friction.
    fn sought(&self, typical: &Typical) -> Vec<Form> {
        let mut forms = Mechanism::<P>::forms(self, typical);
        for parameter in forms.iter_mut().flat_map(|form| &mut form.parameters) {
            if parameter.name.ends_with("_angle") {
                parameter.lower = PRESLIDING * typical.output;
                parameter.starts.retain(|start| *start >= parameter.lower);
            }
        }
        forms
    }

    fn general(&self, form: usize) -> bool {
        form >= 2
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let loops = Loops { torque: thetas.row(0).to_vec(), drawn: Drawn::new(thetas.row(1)) };
        match form {
            0 => Box::new(Soft(loops)),
            1 => Box::new(Sharp(loops)),
            3 => Box::new(TwoLoops::of(loops, thetas)),
            _ => Box::new(BoucWen { loops, exponent: thetas.row(2).to_vec(), sigma: thetas.row(3).to_vec() }),
        }
    }
}

/// What the form `bouc_wen` has beside a torque and an angle.
fn shape() -> [Parameter; 2] {
    let bound = "below 1/2 it gives more than it took: Ikhouane & Rodellar (2007), section 2";
    [
        Parameter::new("exponent", "", 1.0).within(0.2, 5.0).starting_at(&[1.5]),
        Parameter::new("sigma", "", 0.5).within(0.5, 3.0).starting_at(&[1.0]).from_source(bound),
    ]
}

/// What of `two_loops` yields before the rest.
fn early(typical: &Typical) -> [Parameter; 2] {
    let torque = Parameter::new("early_torque", "N m", 0.0).within(0.0, f64::INFINITY);
    let part = Parameter::new("early_part", "", 0.2).within(1e-3, 1.0);
    [torque.starting_at(&[0.05 * typical.effort]).proportional(), part.starting_at(&[0.1])]
}

#[derive(Clone)]
struct Loops {
    torque: Vec<f64>,
    drawn: Drawn,
}

impl Loops {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.torque);
        self.drawn.change(1, change);
    }

    fn pull_softly<P: Mover>(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        self.drawn.pull(tick, scene, effects, &self.torque, |_, level, way| moved(level, way, soft));
    }
}

#[derive(Clone)]
struct Soft(Loops);

impl<P: Mover> Law<P> for Soft {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.0.change(change);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        self.0.pull_softly(tick, scene, effects);
    }
}

#[derive(Clone)]
struct TwoLoops {
    wide: Loops,
    early: Loops,
}

impl TwoLoops {
    /// Beside the `wide` loops those that yield at a part of their angles.
    fn of(wide: Loops, thetas: &Thetas) -> Self {
        let angles: Vec<f64> = thetas.row(1).iter().zip(thetas.row(3)).map(|(wide, part)| wide * part).collect();
        Self { wide, early: Loops { torque: thetas.row(2).to_vec(), drawn: Drawn::new(&angles) } }
    }
}

impl<P: Mover> Law<P> for TwoLoops {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.wide.change(change);
        change.parameter(2, &mut self.early.torque);
        self.early.drawn.change_by(|values| values[1] * values[3], change);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        self.wide.pull_softly(tick, scene, effects);
        self.early.pull_softly(tick, scene, effects);
    }
}

#[derive(Clone)]
struct Sharp(Loops);

impl<P: Mover> Law<P> for Sharp {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.0.change(change);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let Loops { torque, drawn } = &mut self.0;
        drawn.pull(tick, scene, effects, torque, |_, level, way| moved(level, way, sharp));
    }
}

#[derive(Clone)]
struct BoucWen {
    loops: Loops,
    exponent: Vec<f64>,
    sigma: Vec<f64>,
}

impl<P: Mover> Law<P> for BoucWen {
    fn change(&mut self, change: &LaneChange<'_>) {
        self.loops.change(change);
        change.parameter(2, &mut self.exponent);
        change.parameter(3, &mut self.sigma);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let (exponent, sigma) = (&self.exponent, &self.sigma);
        let Loops { torque, drawn } = &mut self.loops;
        drawn.pull(tick, scene, effects, torque, |lane, level, way| bent(level, way, exponent[lane], sigma[lane]));
    }
}

/// Longest way of one stride of [`bent`], and the level from which on it slides as an exponential: by then the law is linear.
const STRIDE: f64 = 0.05;
const NEARLY: f64 = 0.9;

/// The level after a way in units of the yield angle, for any exponent and `sigma`: by the midpoint rule, and split where the
/// level is 0, for a small exponent bends sharply there.
///
/// Along its way the level grows by `1 - |w|^n` where it is loaded, and by `1 + (2 sigma - 1) |w|^n` where it comes back.
#[inline]
fn bent(level: f64, way: f64, exponent: f64, sigma: f64) -> f64 {
    let rate = |along: f64| 1.0 + if along < 0.0 { 2.0 * sigma - 1.0 } else { -1.0 } * along.abs().powf(exponent);
    let (sense, mut left) = (way.signum(), way.abs());
    // What comes back is below 0 along the way it goes.
    let mut along = sense * level;
    while left > 0.0 {
        let stride = left.min(STRIDE);
        let middle = along + 0.5 * stride * rate(along);
        if along < 0.0 {
            let back = stride * rate(middle.min(0.0));
            (along, left) =
                if along + back <= 0.0 { (along + back, left - stride) } else { (0.0, left + along / rate(0.5 * along)) };
        } else if along < NEARLY {
            (along, left) = ((along + stride * rate(middle.min(1.0))).min(1.0), left - stride);
        } else {
            let short = (1.0 - along).max(f64::MIN_POSITIVE);
            (along, left) = (1.0 - short * (-left * rate(along) / short).exp(), 0.0);
        }
    }
    sense * along
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;

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

    /// For any exponent and sigma it is the law within some thousandths, however far it is drawn at once; it never leaves its level,
    /// and takes no time for a way without end.
    #[test]
    fn strides_follow_the_law() {
        for (n, sigma) in [(0.2_f64, 0.5), (0.35, 1.0), (1.0, 0.5), (1.0, 1.0), (1.7, 2.2), (2.0, 0.5), (5.0, 3.0)] {
            let rate = |w: f64, v: f64| {
                let power = w.abs().powf(n);
                v - sigma * v.abs() * power * w.signum() + (sigma - 1.0) * v * power
            };
            for (start, way) in [(0.0, 0.7), (0.5, 0.003), (0.5, 0.3), (0.9, -2.5), (-0.3, 0.2), (-0.99, 4.0), (0.4, -0.4)] {
                let (mut w, h): (f64, f64) = (start, way / 100_000.0);
                for _ in 0..100_000 {
                    let half = w + 0.5 * h.abs() * rate(w, h.signum());
                    w += h.abs() * rate(half, h.signum());
                }
                let ours = bent(start, way, n, sigma);
                assert!((ours - w).abs() < 3e-3 && ours.abs() <= 1.0, "{n}, {sigma}, {start} by {way}: {ours}, {w}");
                if sigma == 0.5 && (n == 1.0 || n == 2.0) {
                    let closed = if n == 1.0 { moved(start, way, soft) } else { moved(start, way, sharp) };
                    assert!((ours - closed).abs() < 1e-3, "{n}, {start} by {way}: {ours}, {closed}");
                }
            }
            assert!((bent(0.3, -1e9, n, sigma) + 1.0).abs() < 1e-12, "{n}, {sigma}");
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
