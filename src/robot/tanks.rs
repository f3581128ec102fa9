//! `tanks`: two tanks, the upper of which runs into the lower.

use super::estimate::{local, motion, rounding, typical};
use super::runge_kutta::step;
use super::signal::{Commands, Signal};
use crate::sim2real::{
    Channel, Clock, Covariate, Dynamics, LaneChange, LaneDynamics, Observation, Parameter, Plant, Recording, Thetas, Tick,
    Typical,
};

/// Levels of the two tanks, in the unit of the lower tank's sensor:
///
/// ```text
/// upper' = pump_gain u - upper_outflow sqrt(upper)
/// lower' = lower_inflow sqrt(upper) - lower_outflow sqrt(lower)
/// ```
///
/// What the pump gives is never sucked back: levels are at least 0. Outflows are Torricelli's, so `lower_inflow` over
/// `upper_outflow` is the area of the upper tank over that of the lower. Only the lower level is seen.
///
/// Integrated by classical Runge-Kutta, up to the moment at which the upper tank is full and on from there.
///
/// Source: Schoukens & Noël, "Three benchmarks addressing open challenges in nonlinear system identification",
/// IFAC-PapersOnLine 50 (2017), section 3.
#[derive(Debug, Clone, PartialEq)]
pub struct Tanks {
    channels: Vec<Channel>,
    parameters: Vec<Parameter>,
    longest_step: f64,
}

/// The parameters of the tanks in their order: name and unit, in which `L` is the unit of a level.
const PARAMETERS: [(&str, &str); 4] =
    [("upper_outflow", "L^0.5/s"), ("lower_inflow", "L^0.5/s"), ("lower_outflow", "L^0.5/s"), ("pump_gain", "L/s per unit")];

/// Where what is not known acts on the tanks: at their rims. The default has none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rims {
    /// Height of the upper tank [unit of the level]; infinite where it is never full.
    pub upper: f64,
    /// Part of what runs over the upper rim that falls into the lower tank.
    pub caught: f64,
    /// Height of the lower tank [unit of the level].
    pub lower: f64,
}

impl Default for Rims {
    fn default() -> Self {
        Self { upper: f64::INFINITY, caught: 0.0, lower: f64::INFINITY }
    }
}

/// What is seen of the tanks: the lower level.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Level([f64; 1]);

impl AsMut<[f64]> for Level {
    fn as_mut(&mut self) -> &mut [f64] {
        &mut self.0
    }
}

impl Observation for Level {
    fn channel(&self, k: usize) -> f64 {
        self.0[k]
    }
}

/// Levels of the upper and the lower tank.
pub type Levels = [f64; 2];

impl Tanks {
    /// Tanks with levels in `unit`, and the given outflow of the upper tank, inflow and outflow of the lower tank
    /// [unit^0.5/s] and gain of the pump [unit/s per unit of command], known to the given relative standard deviations.
    /// Steps of integration are at most `longest_step` [s]: an eighth of what passes between samples of tanks is enough.
    #[must_use]
    pub fn new(unit: &str, values: [f64; 4], uncertainty: [f64; 4], longest_step: f64) -> Self {
        let names = Self::parameter_names(unit);
        let parameters = names
            .into_iter()
            .zip(values.iter().zip(uncertainty))
            .map(|((name, unit), (value, uncertainty))| {
                let parameter = Parameter::named(name, unit, *value).known_to((uncertainty * value).abs());
                if name == "pump_gain" { parameter } else { parameter.within(0.0, f64::INFINITY) }
            })
            .collect();
        let channels = vec![Channel { name: "level".into(), unit: unit.to_owned().into(), exact: false }];
        Self { channels, parameters, longest_step }
    }

    /// The names and units of its parameters, in the order of [`Tanks::new`], where levels are in `unit`.
    #[must_use]
    pub fn parameter_names(unit: &str) -> [(&'static str, String); 4] {
        PARAMETERS.map(|(name, general)| (name, general.replace('L', unit)))
    }
}

impl Plant for Tanks {
    type Command = Signal;
    type Input = ();
    type State = Levels;
    type Effect = Rims;
    type Observation = Level;
    type Dynamics = TanksDynamics;
    type Stimulus = Commands;

    fn name(&self) -> &'static str {
        "tanks"
    }

    fn clock(&self) -> Clock {
        Clock::Sampled { longest_step: self.longest_step }
    }

    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.parameters.clone()
    }

    fn typical(&self, recordings: &[Recording<Commands>]) -> Typical {
        typical(recordings, "level", "", self.parameters[3].nominal)
    }

    /// The lower level as measured; of the upper, only that it is about where the lower one would stay as it is.
    fn initial_parameters(&self, recording: &Recording<Commands>, row: usize) -> Vec<Parameter> {
        let lower = local(recording, "level", "", row).unwrap_or_default();
        let [_, inflow, outflow, _] = std::array::from_fn(|k| self.parameters[k].nominal);
        let upper = (lower.value.max(0.0).sqrt() * outflow / inflow + lower.rate / inflow).max(0.0).powi(2);
        let typical = self.typical(std::slice::from_ref(recording));
        let upper = if upper.is_finite() { upper } else { lower.value.max(0.0) };
        let unknown = (0.5 * upper).max(typical.output).max(1e-9);
        vec![
            Parameter::new("initial upper level", "output", upper).within(0.0, f64::INFINITY).known_to(unknown),
            Parameter::new("initial lower level", "output", lower.value.max(0.0))
                .within(0.0, f64::INFINITY)
                .known_to(0.1 * typical.output.max(1e-9)),
        ]
    }

    fn covariates(&self, recording: &Recording<Commands>) -> Vec<Covariate> {
        let level = motion(recording, "level", "");
        vec![
            ("command", recording.stimulus.0.clone()),
            ("level", level.iter().map(|e| e.value).collect()),
            ("rate of the level", level.iter().map(|e| e.rate).collect()),
        ]
    }

    fn resolution(&self, recording: &Recording<Commands>, channel: &str) -> f64 {
        recording.channel(channel).map_or(0.0, rounding)
    }

    fn unit(&self, declared: &str) -> String {
        match declared {
            "output" => self.channels[0].unit.to_string(),
            "output/s" => format!("{}/s", self.channels[0].unit),
            "1/output^2" => format!("1/{}^2", self.channels[0].unit),
            "command" => "unit of the command".to_owned(),
            "command/s" => "units of the command/s".to_owned(),
            other => other.to_owned(),
        }
    }

    fn dynamics(&self, thetas: &Thetas) -> TanksDynamics {
        let values = |lane: usize| std::array::from_fn(|k| thetas.row(k)[lane]);
        TanksDynamics { lanes: (0..thetas.lanes()).map(values).collect() }
    }
}

/// The running tanks: their parameters, lane by lane.
#[derive(Debug, Clone)]
pub struct TanksDynamics {
    lanes: Vec<[f64; 4]>,
}

impl LaneDynamics<Tanks> for TanksDynamics {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.derived(&mut self.lanes, |values| std::array::from_fn(|k| values[k]));
    }
}

impl Dynamics<Tanks> for TanksDynamics {
    fn initial(&self, initial: &Thetas) -> Vec<Levels> {
        initial.row(0).iter().zip(initial.row(1)).map(|(upper, lower)| [*upper, *lower]).collect()
    }

    fn advance(&self, tick: Tick, states: &mut [Levels], _: &[()], commands: &[Signal], effects: &[Rims]) {
        for (((state, command), rims), lane) in states.iter_mut().zip(commands).zip(effects).zip(&self.lanes) {
            let [upper, lower] = flow(*state, tick.step, lane[3] * command.0, rims, lane);
            *state = [upper.max(0.0), lower.max(0.0).min(rims.lower)];
        }
    }

    fn observe(&self, states: &[Levels], observations: &mut [Level]) {
        for (state, observation) in states.iter().zip(observations) {
            observation.0 = [state[1]];
        }
    }
}

/// Levels after `seconds` [s] in which `pumped` [level/s] comes into the upper tank: up to the moment at which it is full,
/// and from then on.
fn flow(levels: Levels, seconds: f64, pumped: f64, rims: &Rims, parameters: &[f64; 4]) -> Levels {
    let [upper_outflow, lower_inflow, lower_outflow, _] = *parameters;
    let below = |[upper, lower]: &Levels| {
        let root = upper.max(0.0).sqrt();
        [pumped - upper_outflow * root, lower_inflow * root - lower_outflow * lower.max(0.0).sqrt()]
    };
    let free = step(levels, seconds, below);
    if free[0] <= rims.upper {
        return free;
    }
    // What leaves the upper tank raises the lower one by the ratio of their areas.
    let caught = rims.caught * lower_inflow / upper_outflow;
    let [start, lower] = levels;
    let filling = if start < rims.upper { seconds * (rims.upper - start) / (free[0] - start) } else { 0.0 };
    let [_, lower] = step([start.min(rims.upper), lower + caught * (start - rims.upper).max(0.0)], filling, below);
    let root = rims.upper.sqrt();
    let inflow = lower_inflow * root + caught * (pumped - upper_outflow * root).max(0.0);
    let [lower] = step([lower], seconds - filling, |[lower]| [inflow - lower_outflow * lower.max(0.0).sqrt()]);
    [rims.upper, lower]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::TANKS_MECHANISMS;
    use crate::sim2real::{Assembly, Measured, Seed, Simulator, check_lanes, check_mechanism, check_plant};

    const VALUES: [f64; 4] = [0.05, 0.045, 0.055, 0.04];

    fn tanks() -> Tanks {
        Tanks::new("V", VALUES, [0.3; 4], 0.5)
    }

    fn filling(rows: usize) -> Recording<Commands> {
        let time: Vec<f64> = (0..rows).map(|i| i as f64 * 4.0).collect();
        let samples = time.iter().map(|t| Some(5.0 + 2.0 * (0.01 * t).sin())).collect();
        let measured = vec![Measured { channel: "level".into(), unit: "V".into(), samples }];
        let commands = (0..rows).map(|i| 3.0 + 2.5 * (i as f64 * 0.05).sin()).collect();
        Recording { name: "filling".into(), stimulus: Commands(commands), measured, time }
    }

    fn rims(height: f64, caught: f64) -> (Assembly<Tanks>, Vec<f64>) {
        let overflow = TANKS_MECHANISMS.iter().find(|m| m.about().name == "overflow").unwrap();
        let form = overflow.forms(&Typical::default()).remove(0).parameters;
        let assembly = Assembly::new(tanks(), TANKS_MECHANISMS).with_mechanism(*overflow, 0, form);
        (assembly, VALUES.into_iter().chain([height, caught, 4.0, 4.0]).collect())
    }

    #[test]
    fn the_plant_and_every_row_of_its_registry_keep_their_contracts() {
        check_plant(&tanks(), TANKS_MECHANISMS, &filling(400)).unwrap();
        // Some mechanisms act on commands below 0 alone.
        let mut recording = filling(400);
        recording.stimulus.0.iter_mut().skip(300).for_each(|u| *u = -*u);
        for mechanism in TANKS_MECHANISMS {
            check_mechanism(*mechanism, &tanks(), TANKS_MECHANISMS, &recording).unwrap();
            check_lanes(*mechanism, &tanks(), TANKS_MECHANISMS, &recording).unwrap();
        }
    }

    /// Euler's method at 1 ms, with and without a rim at which the upper level stays while more comes in than goes out.
    #[test]
    fn follows_the_equations_of_the_benchmark() {
        let recording = filling(300);
        let [k1, k2, k3, k4] = VALUES;
        for (height, caught) in [(f64::INFINITY, 0.0), (9.0, 0.6)] {
            let (assembly, theta) = rims(height, caught);
            let ours = assembly.rollout(&Thetas::single(&theta), &recording, 0..300, Seed(0));
            let (mut upper, mut lower, h, mut worst, mut full) = (4.0_f64, 4.0_f64, 1e-3, 0.0_f64, 0);
            for row in 0..300 {
                worst = worst.max((ours[0][0].samples[row] - lower).abs());
                for _ in 0..4_000 {
                    let flow = k4 * recording.stimulus.0[row] - k1 * upper.sqrt();
                    let over = if upper >= height && flow > 0.0 { flow } else { 0.0 };
                    full += usize::from(over > 0.0);
                    lower += h * (k2 * upper.sqrt() - k3 * lower.sqrt() + caught * k2 / k1 * over);
                    upper = (upper + h * (flow - over)).min(height);
                }
            }
            assert_eq!(full > 10_000, height.is_finite());
            assert!(worst < 2e-3, "{worst} V at a height of {height}");
        }
    }
}
