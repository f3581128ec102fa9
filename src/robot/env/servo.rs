//! `trueup/Servo-v0`: a servo follows a set point.

use super::draws::Randomization;
use super::set_point::{COURSES, Course, SetPoint};
use super::setting::{Model, Setting, twin_options};
use super::simulated::{Simulated, Task, Timing};
use crate::rl::{
    About, BoxSpace, EnvError, Episode, InfoChannel, Occasion, OptionAbout, OptionKind, Options, Space, StreamName, VecEnv,
};
use crate::robot::{Axis, Joint, MECHANISMS, Motion, Posture};
use crate::sim2real::{Assembly, Observation, Simulator};

pub(super) const ID: &str = "trueup/Servo-v0";
pub(super) const TITLE: &str = "follow a set point with a servo that has friction, backlash, delay, heat and an encoder";

/// Inertia [kg m^2], viscous friction [N m s/rad], gravity torque [N m] and gain [N m per unit]: of the size of a robot arm's elbow.
const NOMINAL: [f64; 4] = [0.02, 0.05, 0.3, 1.5];
/// Duration of a step [s], 20 of integration.
const STEP: f64 = 0.02;
/// Names the stream of states at the start.
const START: StreamName = StreamName::new("start");

/// The mechanisms of the servo where nothing else is asked for: id, number of the form, values of its parameters.
const OWN: [(&str, usize, &[f64]); 6] = [
    // Dry, a thirtieth of the largest torque [N m].
    ("coulomb_friction", 0, &[0.05]),
    // Half a degree of play; 30 % of the inertia is the motor's.
    ("backlash", 1, &[0.009, 0.3]),
    // A frame on a bus and a tick of the drive [s].
    ("command_delay", 0, &[0.004]),
    // At full command a half of the torque is lost in the end, over half a minute.
    ("thermal_derating", 0, &[0.017, 30.0]),
    // 4096 steps a turn [rad].
    ("quantization", 0, &[std::f64::consts::TAU / 4096.0]),
    ("noise", 0, &[5e-4]),
];

/// What is paid beside the error.
#[derive(Debug, Clone, Copy)]
struct Weights {
    effort: f64,
    change: f64,
}

/// One lane of the task.
#[derive(Debug, Clone, Copy)]
struct Lane {
    set_point: SetPoint,
    /// Where the set point is now, and how fast it moves.
    wanted: (f64, f64),
    /// The last action.
    action: f64,
    /// The mean of the squared actions of the step under way, and the sum of their squared changes.
    paid: (f64, f64),
}

/// The task.
#[derive(Debug, Clone)]
struct Follow {
    lanes: Vec<Lane>,
    course: Course,
    reach: f64,
    range: f64,
    weights: Weights,
    /// Whether the heat is observed.
    heat: bool,
}

impl Task for Follow {
    type Plant = Joint;

    fn begin(&mut self, lane: usize, episode: Episode, start: &[f64]) -> Motion {
        let mut set_point = SetPoint::begin(self.course, self.reach, episode);
        let wanted = set_point.at(0.0);
        self.lanes[lane] = Lane { set_point, wanted, action: 0.0, paid: (0.0, 0.0) };
        let position = episode.stream(START).between(-start[0], start[0]);
        Motion { position, velocity: 0.0 }
    }

    fn act(&mut self, lane: usize, _: &Motion, action: f64, share: f64) -> f64 {
        let own = &mut self.lanes[lane];
        own.paid.0 += share * action * action;
        own.paid.1 += (action - own.action).powi(2);
        own.action = action;
        self.range * action
    }

    fn judge(&mut self, lane: usize, state: &Motion, seconds: f64) -> (f64, bool) {
        let own = &mut self.lanes[lane];
        own.wanted = own.set_point.at(seconds);
        let (effort, change) = std::mem::take(&mut own.paid);
        let error = own.wanted.0 - state.position;
        (-(error * error + self.weights.effort * effort + self.weights.change * change), false)
    }

    fn observe(&self, lane: usize, seen: &Posture, told: f64, row: &mut [f32]) {
        let own = &self.lanes[lane];
        let (position, velocity) = (seen.channel(0), seen.channel(1));
        let values = [position, velocity, own.wanted.0 - position, own.wanted.1, own.action, told];
        row.iter_mut().zip(values).for_each(|(to, value)| *to = value as f32);
    }

    fn info(&self, lane: usize, channel: usize, state: &Motion, arriving: f64) -> f64 {
        match channel {
            0 => state.position,
            1 => state.velocity,
            2 => self.lanes[lane].wanted.0,
            _ => arriving,
        }
    }

    fn asks(&self) -> Option<&'static str> {
        self.heat.then_some("thermal_derating")
    }

    fn copy(&mut self, other: Option<&Self>, from: usize, to: usize) {
        self.lanes[to] = other.map_or_else(|| self.lanes[from], |other| other.lanes[from]);
    }
}

fn options() -> Vec<OptionAbout> {
    let number = |name: &str, unit: &str, bounds: [f64; 3], meaning: &str| {
        OptionAbout::number(Occasion::Make, name, unit, bounds, meaning)
    };
    let switch = |name: &str, nominal: bool, meaning: &str| {
        OptionAbout::new(Occasion::Make, name, "", OptionKind::Switch { nominal }, meaning)
    };
    let of = COURSES.map(|(name, _)| name.to_owned()).to_vec();
    let courses = OptionKind::Choice { nominal: "mixed".into(), of };
    let max = OptionKind::Whole { nominal: 500, lower: 1, upper: 1_000_000_000 };
    let furthest = "largest distance from 0 at the start";
    let mut options = vec![
        OptionAbout::new(Occasion::Make, "set_point", "", courses, "whether the set point steps, moves in sines, or either"),
        number("reach", "rad", [1.0, 0.0, 1e3], "farthest the set point is from 0"),
        number("range", "unit of the command", [1.0, 1e-9, 1e9], "the command of an action of 1"),
        number("effort_weight", "", [0.01, 0.0, 1e6], "what the square of an action costs, beside the square of the error"),
        number("change_weight", "", [0.01, 0.0, 1e6], "what the square of an action's change costs"),
        number("step", "s", [STEP, 1e-3, 1.0], "duration of a step"),
        OptionAbout::new(Occasion::Make, "max_steps", "", max, "after how many steps an episode is truncated"),
        switch("mechanisms", true, "friction, backlash, delay, heat and sensor of its own, where no twin is given"),
        switch("sense_heat", false, "whether the part of the torque that heat takes is observed"),
        OptionAbout::number(Occasion::Reset, "furthest", "rad", [0.5, 0.0, 1e3], furthest),
    ];
    options.extend(twin_options("joint", "the servo's own"));
    options
}

/// What it is, for an axis whose position and velocity have these units.
fn about([position, velocity]: [&str; 2], heat: bool) -> About {
    let all = f32::INFINITY;
    let mut seen = BoxSpace::of(&[
        ("position", position, -all, all),
        ("velocity", velocity, -all, all),
        ("error", position, -all, all),
        ("set_point_rate", velocity, -all, all),
        ("last_action", "", -1.0, 1.0),
    ]);
    if heat {
        seen = seen.and("heat", "", 0.0, all);
    }
    let mut about = About::new(ID, TITLE, seen, Space::Box(BoxSpace::of(&[("command", "", -1.0, 1.0)])));
    about.reward_range = (f64::NEG_INFINITY, 0.0);
    about.info = vec![
        InfoChannel::new("true_position", position),
        InfoChannel::new("true_velocity", velocity),
        InfoChannel::new("set_point", position),
        InfoChannel::new("arriving_command", "unit of the command"),
    ];
    about.options = options();
    about
}

/// The servo with its own mechanisms.
fn own(plant: &Joint, with: bool) -> Assembly<Joint> {
    let mut assembly = Assembly::new(plant.clone(), MECHANISMS);
    for (id, form, values) in OWN.iter().filter(|_| with) {
        if let Some(mechanism) = MECHANISMS.iter().find(|row| row.about().name == *id) {
            let mut parameters = mechanism.forms(&Default::default())[*form].parameters.clone();
            parameters.iter_mut().zip(*values).for_each(|(parameter, value)| parameter.nominal = *value);
            assembly = assembly.with_mechanism(*mechanism, *form, parameters);
        }
    }
    assembly
}

/// Makes it.
///
/// # Errors
/// Options there are not or that have values they cannot have.
pub(super) fn make(lanes: usize, options: &Options) -> Result<Box<dyn VecEnv>, EnvError> {
    let general = about(["rad", "rad/s"], false);
    let known = &general.options;
    options.check(ID, known, Occasion::Make)?;
    let plant = Joint::new(Axis::Rotary, NOMINAL, [0.0; 4]);
    let own = (own(&plant, options.switch(known, "mechanisms")?), plant);
    let model =
        Model { name: "joint", channels: "command = { column = \"u\" }\nposition = { column = \"q\", unit = \"rad\" }" };
    #[cfg(feature = "io")]
    let setting = Setting::of(options, &general, &model, own, crate::robot::joint_assembly)?;
    #[cfg(not(feature = "io"))]
    let setting = Setting::of(options, &general, &model, own)?;
    servo_env(lanes, setting.assembly, setting.randomization, options)
}

/// `trueup/Servo-v0` of a joint, as a diagnosis may have given it, with what is randomized of it: `lanes` lanes.
///
/// The reward of a step is `-(e^2 + effort_weight u^2 + change_weight d^2)`, with the error `e` of the true position at its end, the
/// action `u` and its change `d`, all in their units.
///
/// # Errors
/// No lane, options there are not or that have values they cannot have, an assembly with a controller.
pub fn servo_env(
    lanes: usize,
    assembly: Assembly<Joint>,
    randomization: Option<Randomization>,
    options: &Options,
) -> Result<Box<dyn VecEnv>, EnvError> {
    let general = about(["rad", "rad/s"], false);
    let known = &general.options;
    options.check(ID, known, Occasion::Make)?;
    let number = |name: &str| options.number(known, name);
    let heat = options.switch(known, "sense_heat")?;
    if heat && !assembly.mechanisms().any(|(mechanism, ..)| mechanism.about().name == "thermal_derating") {
        return Err(EnvError::Option {
            name: "sense_heat".into(),
            value: "true".into(),
            must: "false where nothing gets warm".into(),
            remedy: "list the mechanism `thermal_derating`".into(),
        });
    }
    let name = options.text(known, "set_point")?;
    let course = COURSES.iter().find(|(own, _)| *own == name).map_or(Course::Mixed, |(_, course)| *course);
    let lane = Lane {
        set_point: SetPoint::begin(Course::Steps, 0.0, Episode::default()),
        wanted: (0.0, 0.0),
        action: 0.0,
        paid: (0.0, 0.0),
    };
    let task = Follow {
        lanes: vec![lane; lanes],
        course,
        reach: number("reach")?,
        range: number("range")?,
        weights: Weights { effort: number("effort_weight")?, change: number("change_weight")? },
        heat,
    };
    let timing = Timing { seconds: number("step")?, max_steps: number("max_steps")? as u32 };
    let units: Vec<String> = assembly.channels().iter().map(|channel| channel.unit.to_string()).collect();
    let about = about([&units[0], &units[1]], heat);
    Ok(Box::new(Simulated::new(task, about, &assembly, randomization, timing, (lanes, &[0.0; 2]))?))
}
