//! An actuator that weakens as it warms.

use super::decay::Decay;
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Plant, Seed, Site, Thetas, Tick, Typical};

/// `dh/dt = strength u^2 - h / time_constant`, `u -> max(0, 1 - h) u`: magnets weaken with the heat that currents leave in the
/// windings. In the form `reciprocal`, with `reciprocal_strength`, `u -> u / (1 + h)`: copper's resistance grows, and a voltage
/// drives less current.
///
/// `h` is the part of the gain that is lost (to first order, in the second form): a pure number, 0 at the recording's first
/// row, where the actuator is taken to be at the temperature its gain is known for. `strength` [1/(command^2 s)] is how
/// much is lost in the first second at a command of 1; a command that holds for long loses `strength time_constant u^2`.
/// An infinite time constant never cools. The heat is that of the command as it reaches this law.
///
/// A winding sheds its heat into a housing, which warms in turn: in the forms `linear_two_bodies` and `reciprocal_two_bodies`,
/// `dh/dt = strength u^2 - (h - g) / time_constant` and `dg/dt = (housing_share (h - g) - g) / housing_time_constant`, with
/// `housing_share` the thermal resistance from housing to air in units of that from winding to housing. Catalogues of motors give
/// both time constants and both resistances.
///
/// Heat is solved exactly over a tick for a command that holds (with a housing to second order); the gain is that of the mean of
/// the heat at its ends.
///
/// Source: Joule heat into one lumped capacity, Trujillo & Cutkosky, "Thermally constrained motor operation for a climbing
/// robot", ICRA 2009; what it does to magnets and copper, Hendershot & Miller, *Design of Brushless Permanent-Magnet
/// Machines* (2010).
#[derive(Debug, Clone, Copy)]
pub struct ThermalDerating;

impl<P: Plant> Mechanism<P> for ThermalDerating
where
    P::Command: AsMut<f64>,
{
    fn about(&self) -> About {
        About {
            name: "thermal_derating",
            site: Site::Command,
            title: "an actuator that weakens as it warms",
            law: "dh/dt = strength u^2 - h / time_constant; linear: u -> max(0, 1 - h) u; reciprocal: u -> u / (1 + h); two_bodies: cools by (h - g) / time_constant, dg/dt = (housing_share (h - g) - g) / housing_time_constant",
            source: "Trujillo & Cutkosky, ICRA 2009; Hendershot & Miller, Design of Brushless PM Machines (2010)",
            remedy: "measure the torque of a warm actuator; cool it, rest it, or let the simulator's gain fall with the heat",
            contains: &[],
        }
    }

    fn forms(&self, typical: &Typical) -> Vec<Form> {
        let duration = if typical.duration > 0.0 { typical.duration } else { 1.0 };
        let heat = typical.command * typical.command * duration;
        let strengths = [0.5, 2.0].map(|lost| if heat > 0.0 { lost / heat } else { lost });
        let times = [0.15, 0.6].map(|part| part * duration);
        // The shortest that a winding has; below, the gain would fall within a swing.
        let time = Parameter::new("time_constant", "s", f64::INFINITY).within(0.1, f64::INFINITY).starting_at(&times);
        let winding = |strength| {
            let strength = Parameter::new(strength, "1/(command^2 s)", 0.0).within(0.0, f64::INFINITY);
            vec![strength.starting_at(&strengths), time.clone()]
        };
        let housing = [
            Parameter::new("housing_time_constant", "s", f64::INFINITY)
                .within(SHORTEST_OF_HOUSINGS, f64::INFINITY)
                .starting_at(&[duration.max(SHORTEST_OF_HOUSINGS)]),
            Parameter::new("housing_share", "", 0.0).within(0.0, MOST_INSULATED).starting_at(&[0.5]),
        ];
        let two_bodies = |strength| winding(strength).into_iter().chain(housing.clone()).collect();
        vec![
            Form { name: "linear", parameters: winding("strength") },
            Form { name: "reciprocal", parameters: winding("reciprocal_strength") },
            Form { name: "linear_two_bodies", parameters: two_bodies("strength") },
            Form { name: "reciprocal_two_bodies", parameters: two_bodies("reciprocal_strength") },
        ]
    }

    fn general(&self, form: usize) -> bool {
        form >= TWO_BODIES
    }

    /// What weakens within a part of a second and recovers as soon is not warm: windings of the smallest motors take seconds.
    fn sought(&self, typical: &Typical) -> Vec<Form> {
        let mut forms = Mechanism::<P>::forms(self, typical);
        for time in forms.iter_mut().flat_map(|form| &mut form.parameters).filter(|p| p.name == "time_constant") {
            time.lower = SHORTEST;
            time.starts.iter_mut().for_each(|start| *start = start.max(SHORTEST));
        }
        forms
    }

    /// An actuator that has warmed stays warm: a run from anywhere needs all commands before.
    fn memory(&self) -> f64 {
        f64::INFINITY
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<P>> {
        let heat = Heat {
            strength: thetas.row(0).to_vec(),
            time_constant: thetas.row(1).to_vec(),
            lost: vec![0.0; thetas.lanes()],
            decay: Decay::default(),
            housing: (form >= TWO_BODIES).then(|| Housing::of(thetas)),
        };
        if form.is_multiple_of(2) { Box::new(Magnets(heat)) } else { Box::new(Copper(heat)) }
    }
}

/// The forms from this one on have a housing.
const TWO_BODIES: usize = 2;
/// The shortest time constant of a winding that is sought [s].
const SHORTEST: f64 = 0.5;
/// The shortest of a housing [s]: one that follows its winding at once makes a winding of another resistance, which no recording tells
/// apart.
const SHORTEST_OF_HOUSINGS: f64 = 5.0;
/// The largest resistance from housing to air, in units of that from winding to housing.
const MOST_INSULATED: f64 = 20.0;

#[derive(Clone)]
struct Heat {
    strength: Vec<f64>,
    time_constant: Vec<f64>,
    /// `h` at the start of the tick.
    lost: Vec<f64>,
    decay: Decay,
    housing: Option<Housing>,
}

impl Heat {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.strength);
        change.parameter(1, &mut self.time_constant);
        change.memory(&mut self.lost);
        self.decay.change(change, &self.time_constant);
        if let Some(housing) = &mut self.housing {
            housing.change(change);
        }
    }

    /// Takes up what the commands leave in the tick, and gives each the gain that the mean heat over the tick leaves it.
    fn pass<C: AsMut<f64>>(&mut self, tick: Tick, commands: &mut [C], gain: impl Fn(f64) -> f64) {
        let gained = self.decay.over(tick.step, &self.time_constant);
        let parameters = self.strength.iter().zip(&self.time_constant).zip(gained);
        let lanes = commands.iter_mut().zip(&mut self.lost).zip(parameters).enumerate();
        for (lane, ((command, lost), ((strength, tau), gained))) in lanes {
            let u = command.as_mut();
            let seconds = if tau.is_finite() { tau * gained } else { tick.step };
            let start = *lost;
            let housing = self.housing.as_mut().map_or(0.0, |housing| housing.midway(lane, start, tick.step));
            *lost += strength * *u * *u * seconds - (start - housing) * gained;
            let mean = 0.5 * (start + *lost);
            if let Some(housing) = &mut self.housing {
                housing.warm(lane, mean, tick.step);
            }
            *u *= gain(mean);
        }
    }
}

/// What a winding sheds its heat into.
#[derive(Clone)]
struct Housing {
    /// How much of the winding's heat it comes to have.
    part: Vec<f64>,
    /// Time constant with which it comes to that [s].
    settling: Vec<f64>,
    /// `g` at the start of the tick.
    heat: Vec<f64>,
    decay: Decay,
}

impl Housing {
    fn of(thetas: &Thetas) -> Self {
        let times = thetas.row(2).iter().zip(thetas.row(3));
        Self {
            part: thetas.row(3).iter().map(|share| share / (1.0 + share)).collect(),
            settling: times.map(|(time, share)| time / (1.0 + share)).collect(),
            heat: vec![0.0; thetas.lanes()],
            decay: Decay::default(),
        }
    }

    fn change(&mut self, change: &LaneChange<'_>) {
        change.derived(&mut self.part, |values| values[3] / (1.0 + values[3]));
        change.derived(&mut self.settling, |values| values[2] / (1.0 + values[3]));
        change.memory(&mut self.heat);
        self.decay.change(change, &self.settling);
    }

    /// `g` in the middle of a tick that the winding starts with heat `winding`.
    fn midway(&mut self, lane: usize, winding: f64, step: f64) -> f64 {
        let gained = self.decay.over(step, &self.settling)[lane];
        let half = gained / (1.0 + (1.0 - gained).sqrt());
        self.heat[lane] + (self.part[lane] * winding - self.heat[lane]) * half
    }

    /// Goes on by a tick over which the winding has heat `winding` on average.
    fn warm(&mut self, lane: usize, winding: f64, step: f64) {
        let gained = self.decay.over(step, &self.settling)[lane];
        self.heat[lane] += (self.part[lane] * winding - self.heat[lane]) * gained;
    }
}

#[derive(Clone)]
struct Magnets(Heat);

impl<P: Plant> Law<P> for Magnets
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        self.0.change(change);
    }

    /// The part of the gain that the heat takes.
    fn told(&self, lane: usize) -> Option<f64> {
        self.0.lost.get(lane).copied()
    }

    fn shape(&mut self, tick: Tick, commands: &mut [P::Command]) {
        self.0.pass(tick, commands, |heat| (1.0 - heat).max(0.0));
    }
}

#[derive(Clone)]
struct Copper(Heat);

impl<P: Plant> Law<P> for Copper
where
    P::Command: AsMut<f64>,
{
    fn change(&mut self, change: &LaneChange<'_>) {
        self.0.change(change);
    }

    /// The part of the gain that the heat takes.
    fn told(&self, lane: usize) -> Option<f64> {
        self.0.lost.get(lane).copied()
    }

    fn shape(&mut self, tick: Tick, commands: &mut [P::Command]) {
        self.0.pass(tick, commands, |heat| 1.0 / (1.0 + heat));
    }
}

#[cfg(test)]
mod tests {
    use super::super::wire::{Wire, shaped};
    use super::*;

    const STRENGTH: f64 = 0.01;
    const TAU: f64 = 5.0;

    /// Two seconds at full command, three at half of it: within each the heat is an exponential towards its own end.
    fn heat(t: f64) -> f64 {
        let towards = |from: f64, end: f64, t: f64| end + (from - end) * (-t / TAU).exp();
        let (full, half) = (STRENGTH * TAU * 4.0, STRENGTH * TAU);
        if t < 2.0 { towards(0.0, full, t) } else { towards(towards(0.0, full, 2.0), half, t - 2.0) }
    }

    #[test]
    fn the_gain_falls_as_the_exponential_of_the_heat() {
        let step = 1e-3;
        let commands: Vec<f64> = (0..5_000).map(|i| if i < 2_000 { 2.0 } else { -1.0 }).collect();
        let lane: &[f64] = &[STRENGTH, TAU];
        let linear = &shaped(&ThermalDerating, 0, &[lane], step, &commands)[0];
        let reciprocal = &shaped(&ThermalDerating, 1, &[lane], step, &commands)[0];
        for (i, u) in commands.iter().enumerate() {
            let h = heat((i as f64 + 0.5) * step);
            assert!((linear[i] - u * (1.0 - h)).abs() < 1e-8, "row {i}");
            assert!((reciprocal[i] - u / (1.0 + h)).abs() < 1e-8, "row {i}");
        }
    }

    #[test]
    fn long_after_the_loss_is_strength_times_time_constant_times_the_square() {
        let out = shaped(&ThermalDerating, 0, &[&[0.02, 3.0], &[0.2, 30.0]], 0.01, &vec![2.0; 20_000]);
        assert!((out[0][19_999] / 2.0 - (1.0 - 0.02 * 3.0 * 4.0)).abs() < 1e-12);
        // More than there is cannot be lost: an actuator does not pull against its command.
        assert_eq!(out[1][19_999], 0.0);
    }

    #[test]
    fn without_cooling_the_loss_is_all_heat_there_was_and_steps_of_any_length_agree() {
        let seconds = 7.0;
        for count in [70, 7_000] {
            let step = seconds / count as f64;
            let out = shaped(&ThermalDerating, 0, &[&[STRENGTH, f64::INFINITY], &[STRENGTH, 1e12]], step, &vec![1.0; count]);
            let middle = seconds - 0.5 * step;
            assert!((out[0][count - 1] - (1.0 - STRENGTH * middle)).abs() < 1e-12);
            assert!((out[1][count - 1] - out[0][count - 1]).abs() < 1e-10);
        }
    }

    /// Integrated by Heun's method in steps a hundredth as long.
    #[test]
    fn a_housing_warms_after_its_winding_and_warms_it() {
        let (step, fine) = (0.05, 100);
        let [strength, tau, settling, share] = [0.05, 1.5, 6.0, 2.0];
        let commands: Vec<f64> = (0..600).map(|i| if i < 300 { 2.0 } else { -0.5 }).collect();
        let lanes: [&[f64]; 3] =
            [&[strength, tau, settling, share], &[strength, tau, settling, 0.0], &[strength, tau, f64::INFINITY, 3.0]];
        let out = shaped(&ThermalDerating, 3, &lanes, step, &commands);
        let slope = |[h, g]: [f64; 2], u: f64| [strength * u * u - (h - g) / tau, (share * (h - g) - g) / settling];
        let mut heat = [0.0; 2];
        for (i, u) in commands.iter().enumerate() {
            let start = heat[0];
            for _ in 0..fine {
                let dt = step / f64::from(fine);
                let first = slope(heat, *u);
                let second = slope([heat[0] + dt * first[0], heat[1] + dt * first[1]], *u);
                heat = [0, 1].map(|k| heat[k] + 0.5 * dt * (first[k] + second[k]));
            }
            let right = u / (1.0 + 0.5 * (start + heat[0]));
            assert!((out[0][i] - right).abs() < 2e-5 * u.abs(), "row {i}: {}, not {right}", out[0][i]);
        }
        let alone = &shaped(&ThermalDerating, 1, &[&[strength, tau]], step, &commands)[0];
        assert!(alone == &out[1] && alone == &out[2], "what nothing is shed into stays cold");
    }

    #[test]
    fn what_recovers_at_once_is_not_sought_as_warm() {
        for duration in [0.3, 20.0] {
            let sought = Mechanism::<Wire>::sought(&ThermalDerating, &Typical { duration, ..Typical::default() });
            let times = sought.iter().flat_map(|f| &f.parameters).filter(|p| p.unit == "s");
            assert!(times.into_iter().all(|p| p.lower >= 0.5 && p.starts.iter().all(|s| *s >= p.lower)));
        }
    }
}
