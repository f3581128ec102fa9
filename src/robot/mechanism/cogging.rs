//! A torque that comes back many times a turn: the motor's teeth, a pole pitch, a gear's teeth.

use std::f64::consts::TAU;

use crate::robot::Mover;
use crate::robot::sine::{BLOCK, sines};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Scene, Seed, Site, Thetas, Tick, Typical};

/// `sine sin(counts q) + cosine cos(counts q)`; in the form `per_length`, of a linear axis, with `wave_number` for
/// `counts`. In the forms that end in `_harmonics` there is a wave of half the length too, `second_sine sin(2 counts q) + second_cosine
/// cos(2 counts q)`.
///
/// Source: Hanselman, *Brushless Permanent Magnet Motor Design* (2003), chapter 4: cogging repeats with the least common
/// multiple of slots and poles; 4 to 200 times a turn in motors as they are built, times the ratio of a gear behind them.
#[derive(Debug, Clone, Copy)]
pub struct Cogging;

/// Counts a turn at which fits begin: each whole one up to 24, which the motion of a turn or less can tell from its
/// neighbours; above, those of usual slots and poles.
const COUNTS: [f64; 41] = [
    4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0, 20.0, 21.0, 22.0, 23.0, 24.0,
    26.0, 28.0, 30.0, 32.0, 36.0, 40.0, 42.0, 48.0, 50.0, 54.0, 60.0, 64.0, 72.0, 80.0, 84.0, 96.0, 100.0, 120.0, 144.0,
    200.0,
];
/// Waves on the way an axis goes at which fits begin: up to this many.
const WAVES: u32 = 40;

impl<P: Mover> Mechanism<P> for Cogging {
    fn about(&self) -> About {
        About {
            name: "cogging",
            site: Site::Plant,
            title: "cogging",
            law: "inertia a = ... + sine sin(counts q) + cosine cos(counts q)",
            source: "Hanselman, Brushless Permanent Magnet Motor Design (2003), ch. 4",
            remedy: "feed the torque of the motor's teeth forward by position, or add it to the simulator",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let amplitude = |name| Parameter::new(name, "N m", 0.0).starting_at(&[0.05 * typical.effort]).proportional();
        let waves = TAU / (typical.range[1] - typical.range[0]).max(1e-9);
        let numbers: Vec<f64> = (2..=WAVES).map(|n| f64::from(n) * waves).collect();
        let number = Parameter::new("wave_number", "1/rad", waves).within(0.5 * waves.min(1.0), f64::INFINITY);
        let counts = Parameter::new("counts", "", 3.5).within(3.0, f64::INFINITY).starting_at(&COUNTS);
        let number = number.starting_at(&numbers);
        let waves = |number: &Parameter| vec![amplitude("sine"), amplitude("cosine"), number.clone()];
        let harmonics = |number: &Parameter| -> Vec<Parameter> {
            let second = ["second_sine", "second_cosine"].map(amplitude);
            waves(number).into_iter().chain(second).collect()
        };
        vec![
            Form { name: "per_turn", parameters: waves(&counts) },
            Form { name: "per_length", parameters: waves(&number) },
            Form { name: "per_turn_harmonics", parameters: harmonics(&counts) },
            Form { name: "per_length_harmonics", parameters: harmonics(&number) },
        ]
    }

    fn general(&self, form: usize) -> bool {
        form >= 2
    }

    fn applies(&self, form: usize, plant: &P, _stimulus: &P::Stimulus) -> bool {
        let turns = Plant::unit(plant, "rad") == "rad";
        turns == form.is_multiple_of(2)
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let values = |lane: usize| -> Vec<f64> { (0..thetas.parameters()).map(|k| thetas.row(k)[lane]).collect() };
        let lanes: Vec<Vec<f64>> = (0..thetas.lanes()).map(values).collect();
        let teeth = Teeth(lanes.iter().map(|values| Wave::first(values)).collect());
        if form < 2 {
            return Box::new(teeth);
        }
        let halves = Teeth(lanes.iter().map(|values| Wave::second(values)).collect());
        Box::new(Harmonics { teeth, halves })
    }
}

/// `sine sin(number q) + cosine cos(number q)` as one sine, which takes half the time of two.
#[derive(Debug, Clone, Copy)]
struct Wave {
    amplitude: f64,
    phase: f64,
    number: f64,
}

impl Wave {
    fn new(sine: f64, cosine: f64, number: f64) -> Self {
        Self { amplitude: sine.hypot(cosine), phase: cosine.atan2(sine), number }
    }

    /// That of the teeth, of all parameters of a lane.
    fn first(values: &[f64]) -> Self {
        Self::new(values[0], values[1], values[2])
    }

    /// The one half as long.
    fn second(values: &[f64]) -> Self {
        Self::new(values[3], values[4], 2.0 * values[2])
    }
}

/// One wave a lane.
#[derive(Clone)]
struct Teeth(Vec<Wave>);

impl Teeth {
    fn push<P: Mover>(&self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        let blocks = self.0.chunks(BLOCK).zip(scene.states.chunks(BLOCK)).zip(effects.chunks_mut(BLOCK));
        for ((waves, states), effects) in blocks.filter(|((waves, _), _)| waves.iter().any(|w| w.amplitude > 0.0)) {
            let mut sine = [0.0; BLOCK];
            for ((angle, wave), state) in sine.iter_mut().zip(waves).zip(states) {
                *angle = wave.number * P::motion(state).midway(tick.step) + wave.phase;
            }
            sines(&mut sine[..waves.len()]);
            for ((effect, wave), sine) in effects.iter_mut().zip(waves).zip(sine).filter(|((_, w), _)| w.amplitude > 0.0) {
                P::push(effect).effort += wave.amplitude * sine;
            }
        }
    }
}

impl<P: Mover> Law<P> for Teeth {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.derived(&mut self.0, Wave::first);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        self.push(tick, scene, effects);
    }
}

/// Teeth with a wave of half their length besides.
#[derive(Clone)]
struct Harmonics {
    teeth: Teeth,
    halves: Teeth,
}

impl<P: Mover> Law<P> for Harmonics {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.derived(&mut self.teeth.0, Wave::first);
        change.derived(&mut self.halves.0, Wave::second);
    }

    fn act(&mut self, tick: Tick, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        self.teeth.push(tick, scene, effects);
        self.halves.push(tick, scene, effects);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::mechanism::trial::Trial;
    use crate::robot::{Axis, Commands, Joint};

    /// At rest under a constant drive, the teeth balance it: `drive + sine sin(n q) + cosine cos(n q) = 0` where it is
    /// stable.
    #[test]
    fn it_rests_where_the_teeth_balance_the_drive() {
        let trial = Trial { parameters: [0.1, 1.0, 0.0, 1.0], position: 0.02, velocity: 0.0, step: 1e-3 };
        let (sine, cosine, counts, drive) = (-0.3, 0.2, 12.0, 0.1);
        let rest = trial.follow(&Cogging, 0, &[sine, cosine, counts], &vec![drive; 20_000])[19_999].position;
        // As one wave: amplitude sin(n q + phase).
        let amplitude = f64::hypot(sine, cosine);
        let phase = cosine.atan2(sine);
        let stable = (std::f64::consts::PI - (-drive / amplitude).asin() - phase) / counts;
        let turns = ((rest - stable) / (TAU / counts)).round();
        assert!((rest - stable - turns * TAU / counts).abs() < 1e-9, "{rest}, {stable}");
    }

    /// Energy is kept: half the inertia times velocity squared, and the potential of the teeth.
    #[test]
    fn it_is_a_potential() {
        let trial = Trial { parameters: [0.1, 0.0, 0.0, 1.0], position: 0.1, velocity: 2.0, step: 1e-3 };
        let (sine, cosine, counts) = (0.05, -0.02, 24.0);
        for (form, second) in [(0, [0.0, 0.0]), (2, [-0.02, 0.03])] {
            let parameters = [sine, cosine, counts, second[0], second[1]];
            let motion = trial.follow(&Cogging, form, &parameters[..if form == 0 { 3 } else { 5 }], &vec![0.0; 5_000]);
            let energy = |m: &crate::robot::Motion| {
                let (s, c) = (counts * m.position).sin_cos();
                let (s2, c2) = (2.0 * counts * m.position).sin_cos();
                let waves = sine * c - cosine * s + 0.5 * (second[0] * c2 - second[1] * s2);
                0.05 * m.velocity * m.velocity + waves / counts
            };
            let first = energy(&motion[0]);
            assert!(motion.iter().all(|m| (energy(m) / first - 1.0).abs() < 1e-3), "form {form}");
            let fastest = motion.iter().map(|m| m.velocity).fold(0.0, f64::max);
            assert!(fastest > 2.005, "{fastest}");
        }
    }

    #[test]
    fn what_turns_has_counts_and_what_slides_a_wave_number() {
        for (axis, form) in [(Axis::Rotary, 0), (Axis::Linear, 1)] {
            let joint = Joint::new(axis, [1.0; 4], [0.1; 4]);
            for other in 0..4 {
                let applies = Mechanism::<Joint>::applies(&Cogging, other, &joint, &Commands::default());
                assert_eq!(applies, form == other % 2, "form {other}");
            }
        }
    }
}
