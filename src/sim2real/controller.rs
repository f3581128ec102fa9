//! What closes a loop: real servos are recorded with a controller running, and the command that is recorded is its set point.

use dyn_clone::DynClone;
use serde::{Deserialize, Serialize};

use super::{Observation, Parameter, Plant, Recording, Stimulus, Thetas};

/// A controller: a description, from which the running [`Feedback`] is made.
///
/// The command of a recording is then the set point of the plant's first channel. The controller sees what the sensor
/// reports (after mechanisms of observations), and what it gives is the command on its way to the plant (before mechanisms of
/// commands).
pub trait Controller<P: Plant>: Send + Sync {
    /// Its parameters.
    fn parameters(&self) -> Vec<Parameter>;
    /// For how long what it saw before matters to what it gives [s].
    fn memory(&self) -> f64;
    /// The running part over the lanes of `thetas`, in the order of [`Controller::parameters`].
    fn feedback(&self, thetas: &Thetas) -> Box<dyn Feedback<P>>;
    /// What it gave in the recording at each row, as far as set points and samples of the first channel tell: what fits of
    /// mechanisms of commands begin with.
    fn given(&self, recording: &Recording<P::Stimulus>, channel: &str) -> Vec<f64>;
}

/// A running controller over all lanes.
///
/// # Contract
/// What it gives at a time depends on what it was shown up to that time, lane by lane.
pub trait Feedback<P: Plant>: DynClone + Send {
    /// Whether it acts at `time` [s]; else it gives what it gave before.
    fn due(&self, time: f64) -> bool;
    /// Replaces set points by what it gives at `time` [s] on seeing `observations`; one of each a lane.
    fn act(&mut self, time: f64, observations: &[P::Observation], commands: &mut [P::Command]);
    /// The same where the first channel reads `measured` in every lane: before a run starts, nothing has been simulated.
    fn act_on_measured(&mut self, time: f64, measured: f64, commands: &mut [P::Command]);
    /// All lanes go on from what the first remembers.
    fn rejoin(&mut self);
}

dyn_clone::clone_trait_object!(<P: Plant> Feedback<P>);

/// What a controller's derivative is taken of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DerivativeOf {
    /// The measurement: a jump of the set point is no kick.
    #[default]
    Measurement,
    /// The error.
    Error,
}

/// `u = clip(kp e + ki (integral of e) + kd (derivative), limit)`, with the error `e = set point - y`.
///
/// The integral is the sum over the times at which it acts, and stands still while the output is at its limit and the error
/// would drive it further. The derivative is the difference to when it acted before; the first time there is none.
///
/// Source: Åström & Hägglund, *Advanced PID Control* (2006), chapters 3 (windup: 3.5, conditional integration).
#[derive(Debug, Clone, PartialEq)]
pub struct Pid {
    /// `kp`, then those of `ki`, `kd` and `limit` that there are.
    parameters: Vec<Parameter>,
    /// How often it acts [s]; none for every step of integration.
    pub period: Option<f64>,
    /// What its derivative is taken of.
    pub derivative: DerivativeOf,
}

/// The keys of a PID controller's parameters, and where each is sought among them.
const KEYS: [&str; 4] = ["kp", "ki", "kd", "limit"];

impl Pid {
    /// A controller with the parameters given of `kp`, `ki`, `kd` and `limit`, which keep their units and priors and are
    /// called `controller.kp` and so on; those that are not given have no part in it.
    #[must_use]
    pub fn new(parameters: impl IntoIterator<Item = Parameter>) -> Self {
        let named = |parameter: Parameter| Parameter { name: format!("controller.{}", parameter.name).into(), ..parameter };
        Self {
            parameters: parameters.into_iter().filter(|p| KEYS.contains(&p.name.as_ref())).map(named).collect(),
            period: None,
            derivative: DerivativeOf::default(),
        }
    }

    fn position(&self, key: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.name.strip_prefix("controller.") == Some(key))
    }

    fn loops(&self, thetas: &Thetas) -> Loops {
        let row = |key: &str, otherwise: f64| {
            self.position(key).map_or_else(|| vec![otherwise; thetas.lanes()], |k| thetas.row(k).to_vec())
        };
        let gains = row("kp", 0.0).into_iter().zip(row("ki", 0.0)).zip(row("kd", 0.0)).zip(row("limit", f64::INFINITY));
        let lane = |(((kp, ki), kd), limit)| Loop { kp, ki, kd, limit, integral: 0.0, before: None, given: 0.0 };
        Loops { lanes: gains.map(lane).collect(), period: self.period, next: None, derivative: self.derivative }
    }
}

impl<P: Plant> Controller<P> for Pid
where
    P::Command: AsMut<f64>,
{
    fn parameters(&self) -> Vec<Parameter> {
        self.parameters.clone()
    }

    fn memory(&self) -> f64 {
        // An integral is of all there was; a difference, of the two times before.
        if self.position("ki").is_some() { f64::INFINITY } else { self.period.map_or(0.1, |period| 3.0 * period) }
    }

    fn feedback(&self, thetas: &Thetas) -> Box<dyn Feedback<P>> {
        Box::new(self.loops(thetas))
    }

    fn given(&self, recording: &Recording<P::Stimulus>, channel: &str) -> Vec<f64> {
        let nominal: Vec<f64> = self.parameters.iter().map(|p| p.nominal).collect();
        let mut running = self.loops(&Thetas::single(&nominal));
        let Some(measured) = recording.channel(channel) else { return Vec::new() };
        let seen = recording.time.iter().zip(&measured.samples).enumerate();
        seen.filter_map(|(row, (time, sample))| {
            let mut command = [recording.stimulus.command(row)];
            Feedback::<P>::act_on_measured(&mut running, *time, (*sample)?, &mut command);
            Some(*command[0].as_mut())
        })
        .collect()
    }
}

/// A running PID controller.
#[derive(Clone)]
struct Loops {
    lanes: Vec<Loop>,
    period: Option<f64>,
    /// When it acts next [s]; none before the first time.
    next: Option<f64>,
    derivative: DerivativeOf,
}

#[derive(Clone, Copy)]
struct Loop {
    kp: f64,
    ki: f64,
    kd: f64,
    limit: f64,
    /// Integral of the error, times `ki`.
    integral: f64,
    /// When it acted before [s], on which error, and what its derivative is taken of.
    before: Option<(f64, f64, f64)>,
    given: f64,
}

impl Loop {
    fn act(&mut self, time: f64, set_point: f64, measured: f64, of: DerivativeOf) -> f64 {
        let error = set_point - measured;
        let followed = match of {
            DerivativeOf::Measurement => -measured,
            DerivativeOf::Error => error,
        };
        let mut derivative = 0.0;
        if let Some((since, last, was)) = self.before.filter(|(since, ..)| time > *since) {
            derivative = (followed - was) / (time - since);
            let winding = self.given.abs() >= self.limit && self.given * last > 0.0;
            self.integral += if winding { 0.0 } else { self.ki * last * (time - since) };
        }
        self.before = Some((time, error, followed));
        self.given = (self.kp * error + self.integral + self.kd * derivative).max(-self.limit).min(self.limit);
        self.given
    }
}

impl Loops {
    /// Replaces the set points in `commands`; `measured` is what each lane reads.
    fn replace<C: AsMut<f64>>(&mut self, time: f64, measured: impl Fn(usize) -> f64, commands: &mut [C]) {
        let due = self.is_due(time);
        if due && let Some(period) = self.period {
            let missed = self.next.map_or(0.0, |next| ((time - next) / period + 1e-6).floor());
            self.next = Some(self.next.unwrap_or(time) + (missed + 1.0) * period);
        }
        for (k, (lane, command)) in self.lanes.iter_mut().zip(commands).enumerate() {
            let command = command.as_mut();
            *command = if due { lane.act(time, *command, measured(k), self.derivative) } else { lane.given };
        }
    }

    fn is_due(&self, time: f64) -> bool {
        match (self.period, self.next) {
            // Times that differ by rounding are the same.
            (Some(period), Some(next)) => time >= next - 1e-6 * period,
            _ => true,
        }
    }
}

impl<P: Plant> Feedback<P> for Loops
where
    P::Command: AsMut<f64>,
{
    fn due(&self, time: f64) -> bool {
        self.is_due(time)
    }

    fn act(&mut self, time: f64, observations: &[P::Observation], commands: &mut [P::Command]) {
        self.replace(time, |k| observations[k].channel(0), commands);
    }

    fn act_on_measured(&mut self, time: f64, measured: f64, commands: &mut [P::Command]) {
        self.replace(time, |_| measured, commands);
    }

    fn rejoin(&mut self) {
        if let Some((first, others)) = self.lanes.split_first_mut() {
            for other in others {
                (other.integral, other.before, other.given) = (first.integral, first.before, first.given);
            }
        }
    }
}
