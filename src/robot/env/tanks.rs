//! `trueup/Tanks-v0`: the level of the lower of two tanks is held where it is wanted.

use super::draws::Randomization;
use super::set_point::{Course, SetPoint};
use super::setting::{Model, Setting, twin_options};
use super::simulated::{Simulated, Task, Timing};
use crate::rl::{
    About, BoxSpace, EnvError, Episode, InfoChannel, Occasion, OptionAbout, OptionKind, Options, Space, StreamName, VecEnv,
};
use crate::robot::{Level, Levels, TANKS_MECHANISMS, Tanks};
use crate::sim2real::{Assembly, Observation, Simulator};

pub(super) const ID: &str = "trueup/Tanks-v0";
pub(super) const TITLE: &str = "hold the level of the lower of two tanks at a set point by the pump of the upper";

/// Outflow of the upper tank, inflow and outflow of the lower [V^0.5/s], gain of the pump [V/s per V]: full command holds the lower
/// level at 9 V, and it settles within minutes, as the benchmark's do (Schoukens & Noël, IFAC-PapersOnLine 50 (2017), section 3).
const NOMINAL: [f64; 4] = [0.06, 0.06, 0.05, 0.03];
/// Duration of a step, as the benchmark is sampled [s].
const STEP: f64 = 4.0;
/// Steps of integration in it.
const SUBSTEPS: f64 = 8.0;
/// Set points of servos move within seconds, those of tanks so many times slower.
const SLOWER: f64 = 200.0;
/// Names the stream of states at the start.
const START: StreamName = StreamName::new("start");

/// One lane of the task.
#[derive(Debug, Clone, Copy)]
struct Lane {
    set_point: SetPoint,
    wanted: f64,
    action: f64,
    effort: f64,
}

/// The task.
#[derive(Debug, Clone)]
struct Hold {
    lanes: Vec<Lane>,
    /// Lowest and highest set point.
    between: [f64; 2],
    range: f64,
    effort_weight: f64,
}

impl Hold {
    fn wanted(&self, share: f64) -> f64 {
        let [low, high] = self.between;
        low + 0.5 * (share + 1.0) * (high - low)
    }
}

impl Task for Hold {
    type Plant = Tanks;

    fn begin(&mut self, lane: usize, episode: Episode, start: &[f64]) -> Levels {
        let mut set_point = SetPoint::begin(Course::Steps, 1.0, episode);
        let wanted = self.wanted(set_point.at(0.0).0);
        self.lanes[lane] = Lane { set_point, wanted, action: 0.0, effort: 0.0 };
        let mut draws = episode.stream(START);
        [draws.between(0.0, start[0]), draws.between(0.0, start[0])]
    }

    fn act(&mut self, lane: usize, _: &Levels, action: f64, share: f64) -> f64 {
        let own = &mut self.lanes[lane];
        own.effort += share * action * action;
        own.action = action;
        self.range * action
    }

    fn judge(&mut self, lane: usize, state: &Levels, seconds: f64) -> (f64, bool) {
        let wanted = self.lanes[lane].set_point.at(seconds / SLOWER).0;
        let wanted = self.wanted(wanted);
        let own = &mut self.lanes[lane];
        own.wanted = wanted;
        let effort = std::mem::take(&mut own.effort);
        let error = wanted - state[1];
        (-(error * error + self.effort_weight * effort), false)
    }

    fn observe(&self, lane: usize, seen: &Level, _: f64, row: &mut [f32]) {
        let (own, level) = (&self.lanes[lane], seen.channel(0));
        row.copy_from_slice(&[level, own.wanted - level, own.action].map(|value| value as f32));
    }

    fn info(&self, lane: usize, channel: usize, state: &Levels, arriving: f64) -> f64 {
        [state[0], state[1], self.lanes[lane].wanted, arriving][channel]
    }

    fn copy(&mut self, other: Option<&Self>, from: usize, to: usize) {
        self.lanes[to] = other.map_or_else(|| self.lanes[from], |other| other.lanes[from]);
    }
}

/// What it is, for levels in `unit`.
fn about(unit: &str) -> About {
    let all = f32::INFINITY;
    let seen = BoxSpace::of(&[("level", unit, -all, all), ("error", unit, -all, all), ("last_action", "", 0.0, 1.0)]);
    let mut about = About::new(ID, TITLE, seen, Space::Box(BoxSpace::of(&[("pump", "", 0.0, 1.0)])));
    about.reward_range = (f64::NEG_INFINITY, 0.0);
    let channel = |name: &str| InfoChannel::new(name, unit);
    about.info = ["upper_level", "lower_level", "set_point"].map(channel).to_vec();
    about.info.push(InfoChannel::new("arriving_command", "unit of the command"));
    let number = |at: Occasion, name: &str, unit: &str, bounds: [f64; 3], meaning: &str| {
        OptionAbout::number(at, name, unit, bounds, meaning)
    };
    let max = OptionKind::Whole { nominal: 500, lower: 1, upper: 1_000_000_000 };
    let level = "unit of the level";
    about.options = vec![
        number(Occasion::Make, "lowest", level, [2.0, 0.0, 1e9], "lowest set point"),
        number(Occasion::Make, "highest", level, [8.0, 0.0, 1e9], "highest set point"),
        number(Occasion::Make, "range", "unit of the command", [5.0, 1e-9, 1e9], "the command of an action of 1"),
        number(Occasion::Make, "effort_weight", "", [0.01, 0.0, 1e6], "what the square of an action costs"),
        OptionAbout::new(Occasion::Make, "max_steps", "", max, "after how many steps an episode is truncated"),
        number(Occasion::Reset, "fullest", level, [6.0, 0.0, 1e9], "highest level of either tank at the start"),
    ];
    about.options.extend(twin_options("tanks", "the environment's own"));
    about
}

/// Makes it.
///
/// # Errors
/// Options there are not or that have values they cannot have.
pub(super) fn make(lanes: usize, options: &Options) -> Result<Box<dyn VecEnv>, EnvError> {
    let about = about("V");
    options.check(ID, &about.options, Occasion::Make)?;
    let plant = Tanks::new("V", NOMINAL, [0.0; 4], STEP / SUBSTEPS);
    let mut own = Assembly::new(plant.clone(), TANKS_MECHANISMS);
    // The rims of both tanks; a half of what runs over the upper one falls into the lower.
    if let Some(overflow) = TANKS_MECHANISMS.iter().find(|row| row.about().name == "overflow") {
        let mut parameters = overflow.forms(&Default::default())[2].parameters.clone();
        parameters.iter_mut().zip([10.0, 0.5, 10.0]).for_each(|(parameter, value)| parameter.nominal = value);
        own = own.with_mechanism(*overflow, 2, parameters);
    }
    let model = Model { name: "tanks", channels: "command = { column = \"u\" }\nlevel = { column = \"y\", unit = \"V\" }" };
    #[cfg(feature = "io")]
    let setting = Setting::of(options, &about, &model, (own, plant), |file| crate::robot::tanks_assembly(file, &[]))?;
    #[cfg(not(feature = "io"))]
    let setting = Setting::of(options, &about, &model, (own, plant))?;
    tanks_env(lanes, setting.assembly, setting.randomization, options)
}

/// `trueup/Tanks-v0` of an assembly, as a diagnosis may have given it, with what is randomized of it: `lanes` lanes.
///
/// The reward of a step is `-(e^2 + effort_weight u^2)`, with the error `e` of the true lower level at its end and the action `u`.
///
/// # Errors
/// No lane, options there are not or that have values they cannot have, an assembly with a controller.
pub fn tanks_env(
    lanes: usize,
    assembly: Assembly<Tanks>,
    randomization: Option<Randomization>,
    options: &Options,
) -> Result<Box<dyn VecEnv>, EnvError> {
    let unit = assembly.channels().first().map_or_else(String::new, |channel| channel.unit.to_string());
    let about = about(&unit);
    let known = &about.options;
    options.check(ID, known, Occasion::Make)?;
    let number = |name: &str| options.number(known, name);
    let between = [number("lowest")?, number("highest")?];
    if between[0] > between[1] {
        return Err(EnvError::Option {
            name: "lowest".into(),
            value: between[0].to_string(),
            must: format!("no larger than `highest`, which is {}", between[1]),
            remedy: "set both: lowest = 2.0, highest = 8.0".into(),
        });
    }
    let lane =
        Lane { set_point: SetPoint::begin(Course::Steps, 1.0, Episode::default()), wanted: 0.0, action: 0.0, effort: 0.0 };
    let task = Hold { lanes: vec![lane; lanes], between, range: number("range")?, effort_weight: number("effort_weight")? };
    let timing = Timing { seconds: STEP, max_steps: number("max_steps")? as u32 };
    Ok(Box::new(Simulated::new(task, about, &assembly, randomization, timing, (lanes, &[0.0; 2]))?))
}
