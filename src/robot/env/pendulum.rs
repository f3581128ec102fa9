//! `trueup/Pendulum-v0`: a rod on a hinge is swung up and kept upright.

use super::draws::{Randomization, copy_episode};
use super::pendulum_lanes::{PendulumLanes, Rates, observed, reward};
use super::setting::{Model, Setting, twin_options};
use super::simulated::{Simulated, Task, Timing, start_of};
use crate::rl::{
    About, Actions, BoxSpace, EnvError, Episode, Episodes, InfoChannel, Occasion, OptionAbout, OptionKind, Options, Out,
    Space, StreamName, VecEnv, Which, alike,
};
use crate::robot::{Motion, PENDULUM_MECHANISMS, Pendulum, Posture};
use crate::sim2real::{Assembly, Observation, Simulator};

pub(super) const ID: &str = "trueup/Pendulum-v0";
pub(super) const TITLE: &str = "swing a rod up and keep it upright by a torque that is too weak to lift it";

/// Gymnasium's step [s], top speed [rad/s] and largest torque [N m].
const STEP: f64 = 0.05;
const TOP_SPEED: f64 = 8.0;
const TORQUE: f64 = 2.0;
/// One over the inertia of a rod of 1 kg and 1 m [1/(kg m^2)].
const PER_TORQUE: f32 = 3.0;
/// Names the stream of states at the start.
const START: StreamName = StreamName::new("start");

/// The task, with or without mechanisms: what each lane's step under way costs.
#[derive(Debug, Clone)]
struct SwingUp {
    rewards: Vec<f64>,
}

impl Task for SwingUp {
    type Plant = Pendulum;

    fn begin(&mut self, _: usize, episode: Episode, start: &[f64]) -> Motion {
        let [position, velocity] = started(episode, start);
        Motion { position, velocity }
    }

    fn act(&mut self, lane: usize, state: &Motion, action: f64, _: f64) -> f64 {
        self.rewards[lane] = reward(state.position, state.velocity, action);
        // Of single precision, as `Rates` has it.
        f64::from(PER_TORQUE * action as f32) / f64::from(PER_TORQUE)
    }

    fn judge(&mut self, lane: usize, _: &Motion, _: f64) -> (f64, bool) {
        (self.rewards[lane], false)
    }

    fn observe(&self, _: usize, seen: &Posture, _: f64, row: &mut [f32]) {
        row.copy_from_slice(&observed([seen.channel(0), seen.channel(1)]));
    }

    fn info(&self, _: usize, channel: usize, state: &Motion, _: f64) -> f64 {
        if channel == 0 { state.position } else { state.velocity }
    }

    fn copy(&mut self, other: Option<&Self>, from: usize, to: usize) {
        self.rewards[to] = other.map_or_else(|| self.rewards[from], |other| other.rewards[from]);
    }
}

/// Angle and angular velocity at the start.
fn started(episode: Episode, start: &[f64]) -> [f64; 2] {
    let mut draws = episode.stream(START);
    std::array::from_fn(|k| draws.between(-start[k], start[k]))
}

fn about() -> About {
    let (one, top, torque) = (1.0, TOP_SPEED as f32, TORQUE as f32);
    let seen = BoxSpace::of(&[("cosine", "", -one, one), ("sine", "", -one, one), ("angular_velocity", "rad/s", -top, top)]);
    let action = Space::Box(BoxSpace::of(&[("torque", "N m", -torque, torque)]));
    let mut about = About::new(ID, TITLE, seen, action);
    let pi = std::f64::consts::PI;
    about.reward_range = (-(pi * pi + 0.1 * TOP_SPEED * TOP_SPEED + 0.001 * TORQUE * TORQUE), 0.0);
    about.info = vec![InfoChannel::new("true_angle", "rad"), InfoChannel::new("true_angular_velocity", "rad/s")];
    let max = OptionKind::Whole { nominal: 200, lower: 1, upper: 1_000_000_000 };
    let widest = |name: &str, unit: &str, nominal: f64, top: f64, meaning: &str| {
        OptionAbout::number(Occasion::Reset, name, unit, [nominal, 0.0, top], meaning)
    };
    about.options = vec![
        OptionAbout::number(Occasion::Make, "g", "m/s^2", [10.0, 0.0, 1e3], "gravity"),
        OptionAbout::new(Occasion::Make, "max_steps", "", max, "after how many steps an episode is truncated"),
        widest("x_init", "rad", pi, 1e3, "largest angle from upright at the start"),
        widest("y_init", "rad/s", 1.0, TOP_SPEED, "largest angular velocity at the start"),
    ];
    about.options.extend(twin_options("pendulum", "that of Gymnasium"));
    about
}

/// Makes it.
///
/// # Errors
/// Options there are not or that have values they cannot have.
pub(super) fn make(lanes: usize, options: &Options) -> Result<Box<dyn VecEnv>, EnvError> {
    let about = about();
    options.check(ID, &about.options, Occasion::Make)?;
    let gravity = options.number(&about.options, "g")?;
    let plant = Pendulum::new([1.0, 1.0, gravity, 0.0, 1.0], [0.0; 5], STEP, TOP_SPEED);
    let own = (Assembly::new(plant.clone(), PENDULUM_MECHANISMS), plant);
    let model = Model { name: "pendulum", channels: "command = { column = \"u\" }\nangle = { column = \"q\" }" };
    #[cfg(feature = "io")]
    let setting = Setting::of(options, &about, &model, own, |file| {
        let error =
            file.error(&["twin"], "no recording is diagnosed as a pendulum, so that a twin cannot tell its parameters");
        Err(error.hint("leave [twin] and [parameters] out, set `g`, or randomize its parameters"))
    })?;
    #[cfg(not(feature = "io"))]
    let setting = Setting::of(options, &about, &model, own)?;
    pendulum_env(lanes, setting.assembly, setting.randomization, options)
}

/// `trueup/Pendulum-v0` of an assembly, with what is randomized of it: `lanes` lanes. Without either, and with the step and the top
/// speed of Gymnasium, it is stepped by code that is written for that.
///
/// # Errors
/// No lane, options there are not or that have values they cannot have, an assembly with a controller.
pub fn pendulum_env(
    lanes: usize,
    assembly: Assembly<Pendulum>,
    randomization: Option<Randomization>,
    options: &Options,
) -> Result<Box<dyn VecEnv>, EnvError> {
    let mut about = about();
    options.check(ID, &about.options, Occasion::Make)?;
    if lanes == 0 {
        return Err(EnvError::NoLanes);
    }
    let max_steps = options.number(&about.options, "max_steps")? as u32;
    let timing = Timing { seconds: STEP, max_steps };
    let values: Vec<f64> = assembly.parameters().iter().map(|p| p.nominal).collect();
    let gymnasiums = Pendulum::new(std::array::from_fn(|k| values[k]), [0.0; 5], STEP, TOP_SPEED);
    let plain = *assembly.plant() == gymnasiums && values[3] == 0.0 && values[4] == 1.0;
    if plain && randomization.is_none() && assembly.mechanisms().next().is_none() {
        (about.seconds_a_step, about.max_steps) = (Some(STEP), Some(max_steps));
        let [mass, length, gravity] = [values[0], values[1], values[2]];
        let torque = (f64::from(PER_TORQUE) / (mass * length * length)) as f32;
        let rates = Rates { gravity: 1.5 * gravity / length, torque, step: STEP, top_speed: TOP_SPEED };
        return Ok(Box::new(Fast { about, lanes: PendulumLanes::new(lanes, rates), episodes: Episodes::new(lanes) }));
    }
    // A sensor may report what the state cannot be.
    (about.observation.low[2], about.observation.high[2]) = (f32::NEG_INFINITY, f32::INFINITY);
    let task = SwingUp { rewards: vec![0.0; lanes] };
    Ok(Box::new(Simulated::new(task, about, &assembly, randomization, timing, (lanes, &[0.0; 2]))?))
}

/// The environment on [`PendulumLanes`].
#[derive(Clone)]
struct Fast {
    about: About,
    lanes: PendulumLanes,
    episodes: Episodes,
}

impl VecEnv for Fast {
    fn about(&self) -> &About {
        &self.about
    }

    fn lanes(&self) -> usize {
        self.lanes.steps.len()
    }

    fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        let (start, _) = start_of(&self.about, options)?;
        for lane in which.iter(self.lanes()) {
            let episode = self.episodes.begin_lane(lane, seeds.map(|seeds| seeds[lane]));
            let seen = self.lanes.begin(lane, started(episode, &start));
            observations[3 * lane..][..3].copy_from_slice(&seen);
        }
        Ok(())
    }

    fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        self.lanes.step(actions.continuous(), out.observations, out.rewards);
        out.terminated.fill(false);
        let max = self.about.max_steps.unwrap_or(u32::MAX);
        out.truncated.iter_mut().zip(&self.lanes.steps).for_each(|(truncated, steps)| *truncated = *steps >= max);
        Ok(())
    }

    fn info(&self, channel: usize, values: &mut [f64]) {
        values.iter_mut().enumerate().for_each(|(lane, value)| *value = self.lanes.state(lane)[channel]);
    }

    fn copy_lane(&mut self, from: usize, to: usize) {
        self.lanes.copy_state(to, self.lanes.state(from), self.lanes.steps[from]);
        copy_episode(&mut self.episodes, None, from, to);
    }

    fn copy_lane_from(&mut self, other: &dyn VecEnv, from: usize, to: usize) -> Result<(), EnvError> {
        let other = alike(self, other)?;
        self.lanes.copy_state(to, other.lanes.state(from), other.lanes.steps[from]);
        copy_episode(&mut self.episodes, Some(&other.episodes), from, to);
        Ok(())
    }
}
