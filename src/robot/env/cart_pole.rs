//! `trueup/CartPole-v0`: a pole is kept upright on a cart that is pushed to and fro.

use super::cart_pole_lanes::{CartPoleLanes, Start, started};
use super::cart_pole_wires::{LONGEST_DELAY, Wires};
use super::draws::{LaneParameters, Randomization, copy_episode};
use super::setting::{Model, Setting, twin_options};
use super::simulated::{Simulated, Task, Timing, described, start_of};
use crate::rl::{
    About, Actions, BoxSpace, EnvError, Episode, Episodes, InfoChannel, Occasion, OptionAbout, OptionKind, Options, Out,
    Space, StreamName, VecEnv, Which, alike,
};
use crate::robot::{CART_POLE_MECHANISMS, CartPole, CartPoleView, Integration};
use crate::sim2real::randomize::Redraw;
use crate::sim2real::{Assembly, Observation, Parameter, Simulator};

pub(super) const ID: &str = "trueup/CartPole-v0";
pub(super) const TITLE: &str = "keep a pole upright on a cart by pushing the cart left or right";

/// Gymnasium's values, in the order of [`CartPole`]'s parameters; the gain is its force [N].
const NOMINAL: [f64; 7] = [1.0, 0.1, 0.5, 9.8, 0.0, 0.0, 10.0];
/// Gymnasium's step [s].
const STEP: f64 = 0.02;
/// Names the stream of states at the start.
pub(super) const START: StreamName = StreamName::new("start");

/// Where an episode ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Thresholds {
    /// Farthest the cart may be from the middle [m].
    pub position: f64,
    /// Farthest the pole may lean [rad].
    pub angle: f64,
}

/// Gymnasium's, 12 degrees as it has them.
const THRESHOLDS: Thresholds = Thresholds { position: 2.4, angle: 12.0 * 2.0 * std::f64::consts::PI / 360.0 };

/// The task, with or without mechanisms.
#[derive(Debug, Clone, Copy)]
struct Balance {
    thresholds: Thresholds,
    sutton_barto: bool,
}

impl Balance {
    fn reward(self, terminated: bool) -> f64 {
        match (self.sutton_barto, terminated) {
            (false, _) => 1.0,
            (true, false) => 0.0,
            (true, true) => -1.0,
        }
    }
}

impl Task for Balance {
    type Plant = CartPole;

    fn begin(&mut self, _: usize, episode: Episode, start: &[f64]) -> [f64; 4] {
        started(episode, start_between(start))
    }

    fn check(&self, start: &[f64]) -> Result<(), EnvError> {
        check_start(start)
    }

    fn act(&mut self, _: usize, _: &[f64; 4], action: f64, _: f64) -> f64 {
        if action > 0.5 { 1.0 } else { -1.0 }
    }

    fn judge(&mut self, _: usize, state: &[f64; 4], _: f64) -> (f64, bool) {
        let over = state[0].abs() > self.thresholds.position || state[2].abs() > self.thresholds.angle;
        (self.reward(over), over)
    }

    fn observe(&self, _: usize, seen: &CartPoleView, _: f64, row: &mut [f32]) {
        row.iter_mut().enumerate().for_each(|(k, value)| *value = seen.channel(k) as f32);
    }

    fn info(&self, _: usize, channel: usize, state: &[f64; 4], _: f64) -> f64 {
        state[channel]
    }

    fn copy(&mut self, _: Option<&Self>, _: usize, _: usize) {}
}

/// Holds the options at reset to make sense together.
fn check_start(start: &[f64]) -> Result<(), EnvError> {
    match start {
        [low, high, ..] if low > high => Err(EnvError::Option {
            name: "low".into(),
            value: low.to_string(),
            must: format!("no larger than `high`, which is {high}"),
            remedy: "set both: low = -0.1, high = 0.1".into(),
        }),
        _ => Ok(()),
    }
}

fn start_between(start: &[f64]) -> Start {
    Start { low: start[0], high: start[1] }
}

fn about() -> About {
    let Thresholds { position, angle } = THRESHOLDS;
    let bounds = [
        ("position", "m", -2.0 * position, 2.0 * position),
        ("velocity", "m/s", f64::NEG_INFINITY, f64::INFINITY),
        ("angle", "rad", -2.0 * angle, 2.0 * angle),
        ("angular_velocity", "rad/s", f64::NEG_INFINITY, f64::INFINITY),
    ];
    let components = bounds.map(|(name, unit, low, high)| (name, unit, low as f32, high as f32));
    let action = Space::Discrete { n: 2, name: "push".into() };
    let mut about = About::new(ID, TITLE, BoxSpace::of(&components), action);
    about.info = bounds.map(|(name, unit, ..)| InfoChannel::new(format!("true_{name}"), unit)).to_vec();
    let switch = OptionKind::Switch { nominal: false };
    let sutton = "rewards of Sutton and Barto: 0 a step, and -1 for the one in which it falls, instead of 1 a step";
    let max = OptionKind::Whole { nominal: 500, lower: 1, upper: 1_000_000_000 };
    let bound =
        |name: &str, nominal, meaning: &str| OptionAbout::number(Occasion::Reset, name, "", [nominal, -10.0, 10.0], meaning);
    about.options = vec![
        OptionAbout::new(Occasion::Make, "sutton_barto_reward", "", switch, sutton),
        OptionAbout::new(Occasion::Make, "max_steps", "", max, "after how many steps an episode is truncated"),
        bound("low", -0.05, "least value of each component of the state at the start"),
        bound("high", 0.05, "largest value of each component of the state at the start"),
    ];
    about.options.extend(twin_options("cart_pole", "that of Gymnasium, by Euler's method at 0.02 s"));
    about
}

/// Makes it.
///
/// # Errors
/// Options there are not or that have values they cannot have.
pub(super) fn make(lanes: usize, options: &Options) -> Result<Box<dyn VecEnv>, EnvError> {
    let about = about();
    options.check(ID, &about.options, Occasion::Make)?;
    let plant = CartPole::new(NOMINAL, [0.0; 7]).integrated(Integration::Euler { step: STEP });
    let own = (Assembly::new(plant.clone(), CART_POLE_MECHANISMS), plant);
    let channels = "command = { column = \"u\" }\nposition = { column = \"x\" }\nangle = { column = \"q\" }";
    let model = Model { name: "cart_pole", channels };
    #[cfg(feature = "io")]
    let setting = Setting::of(options, &about, &model, own, crate::robot::cart_pole_assembly)?;
    #[cfg(not(feature = "io"))]
    let setting = Setting::of(options, &about, &model, own)?;
    cart_pole_env(lanes, setting.assembly, setting.randomization, options)
}

/// `trueup/CartPole-v0` of an assembly, as a diagnosis may have given it, with what is randomized of it: `lanes` lanes. Where the
/// assembly is integrated by Euler's method at 0.02 s and has no mechanisms but a delay of the command and white noise, it is
/// stepped by code that is written for that; whatever else there is, by its laws.
///
/// # Errors
/// No lane, options there are not or that have values they cannot have, an assembly with a controller.
pub fn cart_pole_env(
    lanes: usize,
    assembly: Assembly<CartPole>,
    randomization: Option<Randomization>,
    options: &Options,
) -> Result<Box<dyn VecEnv>, EnvError> {
    let setting = Setting { assembly, randomization };
    let mut about = about();
    options.check(ID, &about.options, Occasion::Make)?;
    let task = Balance { thresholds: THRESHOLDS, sutton_barto: options.switch(&about.options, "sutton_barto_reward")? };
    about.reward_range = if task.sutton_barto { (-1.0, 0.0) } else { (1.0, 1.0) };
    let max_steps = options.number(&about.options, "max_steps")? as u32;
    let timing = Timing { seconds: STEP, max_steps };
    if lanes == 0 {
        return Err(EnvError::NoLanes);
    }
    if setting.assembly.mechanisms().next().is_some() || setting.randomization.is_some() {
        widen(&mut about);
    } else {
        // What is observed is true.
        about.info.clear();
    }
    match wires(&setting) {
        Some(wires) => Ok(Box::new(Fast::new(lanes, about, task, setting, wires, timing))),
        None => {
            let Setting { assembly, randomization } = setting;
            Ok(Box::new(Simulated::new(task, about, &assembly, randomization, timing, (lanes, &[0.0; 4]))?))
        }
    }
}

/// A sensor may report what the state cannot be.
fn widen(about: &mut About) {
    about.observation.low.fill(f32::NEG_INFINITY);
    about.observation.high.fill(f32::INFINITY);
}

/// Where the parameters of its mechanisms are, if [`CartPoleLanes`] can run the setting: by Euler's method, with no mechanisms but a
/// delay of the command and white noise, and nothing drawn within episodes.
fn wires<'a>(setting: &'a Setting<CartPole>) -> Option<Wires> {
    let Setting { assembly, randomization } = setting;
    let by_euler = assembly.clock().substeps(STEP) == 1 && assembly.own().len() == NOMINAL.len();
    let mut wires = Wires::default();
    let mut at = assembly.own().len();
    for (mechanism, form, parameters) in assembly.mechanisms() {
        match mechanism.about().name {
            "command_delay" if wires.delay.is_none() && form == 0 => wires.delay = Some(at),
            "noise" if wires.noise.is_none() && form == 0 => wires.noise = Some(at),
            _ => return None,
        }
        at += parameters.len();
    }
    let longest = |k: usize| -> f64 {
        let nominal = assembly.parameters()[k].nominal;
        let drawn = randomization.iter().flat_map(|r| r.places.iter().zip(r.randomizer.randomized()));
        drawn.filter(|(place, _)| **place == k).map(|(_, one)| one.support()[1]).fold(nominal, f64::max)
    };
    let fits = wires.delay.is_none_or(|k| longest(k) <= LONGEST_DELAY * STEP);
    let once =
        |r: &'a Randomization| r.randomizer.randomized().iter().all(|one| matches!(one.at, Redraw::Startup | Redraw::Reset));
    (by_euler && fits && randomization.as_ref().is_none_or(once)).then_some(wires)
}

/// The environment on [`CartPoleLanes`].
#[derive(Clone)]
struct Fast {
    about: About,
    task: Balance,
    lanes: CartPoleLanes,
    parameters: LaneParameters,
    episodes: Episodes,
    wires: Wires,
    /// The lanes that are being reset, and the episodes they begin.
    due: Vec<u32>,
    begun: Vec<Episode>,
}

impl Fast {
    fn new(count: usize, about: About, task: Balance, setting: Setting<CartPole>, wires: Wires, timing: Timing) -> Self {
        let Setting { assembly, randomization } = setting;
        let all: &[Parameter] = assembly.parameters();
        let values: Vec<f64> = all.iter().map(|p| p.nominal).collect();
        let places = randomization.as_ref().map(|r| r.places.clone()).unwrap_or_default();
        let parameters = LaneParameters::new(all, randomization, count);
        let about = described(about, &parameters, timing, |unit| assembly.unit(unit));
        let differs = |place: usize| places.contains(&place);
        let lanes = CartPoleLanes::new(count, &values, differs, wires, (timing.seconds, timing.max_steps), task.thresholds);
        let episodes = Episodes::new(count);
        Self { about, task, lanes, parameters, episodes, wires, due: Vec::new(), begun: Vec::new() }
    }
}

impl VecEnv for Fast {
    fn about(&self) -> &About {
        &self.about
    }

    fn lanes(&self) -> usize {
        self.lanes.count()
    }

    fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        let (start, level) = start_of(&self.about, options)?;
        check_start(&start)?;
        let Self { lanes, parameters, episodes, due, begun, .. } = self;
        which.list(lanes.count(), due);
        begun.clear();
        begun.extend(due.iter().map(|lane| {
            let lane = *lane as usize;
            episodes.begin_lane(lane, seeds.map(|seeds| seeds[lane]))
        }));
        if parameters.any() {
            parameters.begin_all(due, begun, level);
            due.iter().for_each(|lane| lanes.retune(*lane as usize, parameters.whole(*lane as usize)));
        }
        lanes.begin(due, begun, start_between(&start), observations);
        Ok(())
    }

    fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        self.lanes.step(actions.discrete(), out);
        if self.task.sutton_barto {
            let rewards = out.rewards.iter_mut().zip(&*out.terminated);
            rewards.for_each(|(reward, terminated)| *reward = self.task.reward(*terminated));
        } else {
            out.rewards.fill(1.0);
        }
        Ok(())
    }

    fn info(&self, channel: usize, values: &mut [f64]) {
        self.lanes.tell(channel, values);
    }

    fn privileged(&self, parameter: usize, values: &mut [f64]) {
        self.parameters.tell(parameter, values);
    }

    fn copy_lane(&mut self, from: usize, to: usize) {
        self.lanes.copy(None, from, to);
        self.parameters.copy(None, from, to);
        copy_episode(&mut self.episodes, None, from, to);
    }

    fn copy_lane_from(&mut self, other: &dyn VecEnv, from: usize, to: usize) -> Result<(), EnvError> {
        let other = alike(self, other)?;
        if self.wires != other.wires || !self.parameters.same_as(&other.parameters) {
            let why = "it has other mechanisms, or randomizes others".to_owned();
            return Err(EnvError::Unlike { id: ID.into(), why });
        }
        self.lanes.copy(Some(&other.lanes), from, to);
        self.parameters.copy(Some(&other.parameters), from, to);
        copy_episode(&mut self.episodes, Some(&other.episodes), from, to);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::randomize::{Distribution, Level, Randomized, Randomizer, Target};

    /// With a delay, noise, and gravity and the delay drawn at random.
    fn setting() -> Setting<CartPole> {
        let plant = CartPole::new(NOMINAL, [0.0; 7]).integrated(Integration::Euler { step: STEP });
        let mut assembly = Assembly::new(plant, CART_POLE_MECHANISMS);
        for (id, value) in [("command_delay", 0.03), ("noise", 0.01)] {
            let mechanism = CART_POLE_MECHANISMS.iter().find(|row| row.about().name == id).unwrap();
            let mut parameters = mechanism.forms(&Default::default())[0].parameters.clone();
            parameters[0].nominal = value;
            assembly = assembly.with_mechanism(*mechanism, 0, parameters);
        }
        let drawn = |place: usize, target: Target, low: f64, high: f64| Randomized {
            target,
            parameter: assembly.parameters()[place].clone(),
            distribution: Distribution::Uniform { low, high },
            relative: false,
            at: Redraw::Reset,
        };
        let randomized =
            vec![drawn(3, Target::own("gravity"), 9.0, 11.0), drawn(7, Target::of("command_delay", "seconds"), 0.0, 0.1)];
        let randomizer = Randomizer::new(randomized, Vec::new()).unwrap();
        let randomization = Randomization { randomizer, places: vec![3, 7], level: Level::FULL, regime_seconds: 1.0 };
        Setting { assembly, randomization: Some(randomization) }
    }

    #[test]
    fn what_blocks_cannot_do_is_left_to_the_laws() {
        let mut within = setting();
        let randomized = within.randomization.as_ref().unwrap().randomizer.randomized().to_vec();
        let every = randomized.into_iter().map(|one| Randomized { at: Redraw::EverySteps(3), ..one }).collect();
        within.randomization.as_mut().unwrap().randomizer = Randomizer::new(every, Vec::new()).unwrap();
        assert_eq!(wires(&within), None);
        let bias = CART_POLE_MECHANISMS.iter().find(|row| row.about().name == "bias").unwrap();
        let parameters = bias.forms(&Default::default())[0].parameters.clone();
        let assembly = setting().assembly.with_mechanism(*bias, 0, parameters);
        assert_eq!(wires(&Setting { assembly, randomization: None }), None);
        let fine = CartPole::new(NOMINAL, [0.0; 7]);
        let assembly = Assembly::new(fine, CART_POLE_MECHANISMS);
        assert_eq!(wires(&Setting { assembly, randomization: None }), None);
    }
}
