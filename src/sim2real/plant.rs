//! Known physics, with a place for what is not known.

use std::borrow::Cow;

use super::{Parameter, Recording, Site, Thetas, Tick};

/// A named quantity, one value a row.
pub type Covariate = (&'static str, Vec<f64>);

/// What makes a plant's clock tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Clock {
    /// Rows are samples of a signal; steps of integration are at most this long [s].
    Sampled {
        /// Longest step of integration [s].
        longest_step: f64,
    },
    /// Rows are messages, each answered by one observation.
    Event,
}

impl Clock {
    /// In how many steps an interval of `seconds` [s] is integrated; at least one.
    #[must_use]
    pub fn substeps(self, seconds: f64) -> usize {
        match self {
            Self::Sampled { longest_step } if seconds <= longest_step => 1,
            // The small allowance keeps a row of exactly one step, up to rounding, from being cut in two.
            Self::Sampled { longest_step } => ((seconds / longest_step - 1e-6).ceil() as usize).max(1),
            Self::Event => 1,
        }
    }
}

/// What is sent to a plant.
pub trait Command: Clone + PartialEq + Send + Sync + 'static {
    /// How a delay acts on it: a signal that holds needs a line of its past, a message only a later arrival.
    type Line: DelayLine<Self> + 'static;
}

/// The memory of a delay, for one lane.
pub trait DelayLine<C>: Clone + Default + Send {
    /// Replaces `command`, sent during `tick`, by what arrives then through a delay of `seconds` [s].
    fn pass(&mut self, tick: Tick, seconds: f64, command: &mut C);

    /// A line on which there was nothing before the first command, where a line may know of what was before.
    #[must_use]
    fn at_rest() -> Self {
        Self::default()
    }
}

/// What a plant lets one see: a row of channels.
pub trait Observation: Clone + Default + Send + 'static {
    /// Value of channel `k`, in the order of [`Plant::channels`].
    fn channel(&self, k: usize) -> f64;
}

/// What drives a plant while a recording is followed.
pub trait Stimulus<P: Plant>: Send + Sync {
    /// The command of row `row`, in force from its time on.
    fn command(&self, row: usize) -> P::Command;
    /// The same during the part of the row about `share` of the way to the next: another where a signal does not hold.
    fn command_within(&self, row: usize, _share: f64) -> P::Command {
        self.command(row)
    }
    /// What the plant meets in row `row`, given the command as it arrives: the same for the same command.
    fn input(&self, row: usize, arriving: &P::Command) -> P::Input;
    /// The commands, one a row, where a command is one number; none elsewhere.
    fn commands(&self) -> Option<&[f64]> {
        None
    }
    /// The same stimulus with other commands, where a command is one number: what an experiment would send.
    fn commanded(&self, _commands: Vec<f64>) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }
}

/// A channel a plant can be observed through.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channel {
    /// Name, as written in a twin and a recording.
    pub name: Cow<'static, str>,
    /// Unit.
    pub unit: Cow<'static, str>,
    /// Whether it has no noise but the rounding of what it tells: what a rule charges, or a count.
    pub exact: bool,
}

impl Channel {
    /// A channel of that name and unit.
    #[must_use]
    pub const fn new(name: &'static str, unit: &'static str) -> Self {
        Self { name: Cow::Borrowed(name), unit: Cow::Borrowed(unit), exact: false }
    }

    /// The same without noise.
    #[must_use]
    pub const fn exact(mut self) -> Self {
        self.exact = true;
        self
    }
}

/// Known physics: a stateless description, from which [`Dynamics`] are made for the lanes of a run.
///
/// # Contract
/// - A lane's result never depends on how many lanes run beside it.
/// - Same parameters, commands and effects, same bits.
/// - An effect's default does nothing.
///
/// [`check_plant`](super::check_plant) runs it.
pub trait Plant: Send + Sync + Sized + Clone + 'static {
    /// What is sent to it.
    type Command: Command;
    /// What else it meets: nothing, or the book an order finds.
    type Input: Clone + Send + Sync;
    /// What it remembers.
    type State: Clone + Send;
    /// Where missing physics acts on it; the default does nothing.
    type Effect: Default + Clone + Send;
    /// What can be seen of it.
    type Observation: Observation;
    /// Its running part.
    type Dynamics: Dynamics<Self>;
    /// What drives it while a recording is followed.
    type Stimulus: Stimulus<Self> + Clone + Send + Sync;

    /// Name, as a twin's `model`.
    fn name(&self) -> &'static str;
    /// What makes its clock tick.
    fn clock(&self) -> Clock;
    /// The channels it can be observed through, in the order of [`Observation::channel`].
    fn channels(&self) -> &[Channel];
    /// Its parameters, with the values it has today.
    fn parameters(&self) -> Vec<Parameter>;
    /// Typical sizes of what drives it and what is seen of it in `recordings`, by which fits choose where to begin.
    fn typical(&self, recordings: &[Recording<Self::Stimulus>]) -> Typical;
    /// The parameters of its state in row `row` of `recording`, with values estimated from the rows around it.
    fn initial_parameters(&self, recording: &Recording<Self::Stimulus>, row: usize) -> Vec<Parameter>;
    /// Standard deviation of the rounding of a measured channel, in its unit; 0 where none is known.
    fn resolution(&self, _recording: &Recording<Self::Stimulus>, _channel: &str) -> f64 {
        0.0
    }
    /// The least that a channel of messages scatters whatever explains it, as the messages themselves show it, in its unit; 0 where
    /// that is not known.
    fn scatter(&self, _recording: &Recording<Self::Stimulus>, _channel: &str) -> f64 {
        0.0
    }
    /// How many commands a recording of messages holds; of samples of a signal it is as many as there are rows.
    fn sent(&self, recording: &Recording<Self::Stimulus>) -> usize {
        recording.time.len()
    }
    /// What a residual may depend on when something is missing, row by row.
    fn covariates(&self, _recording: &Recording<Self::Stimulus>) -> Vec<Covariate> {
        Vec::new()
    }
    /// Whether no law of any registry depends on that covariate: what depends on it is none of them.
    fn no_law_knows(&self, _covariate: &str) -> bool {
        false
    }
    /// What was left out or is peculiar about `recording`, in words a report can show.
    fn notes(&self, _recording: &Recording<Self::Stimulus>) -> Vec<String> {
        Vec::new()
    }
    /// What `recording` says against values of its own [`initial_parameters`](Self::initial_parameters), in words a summary can show; none
    /// where they may be what they stand for.
    fn contradicts(&self, _recording: &Recording<Self::Stimulus>, _initial: &[f64]) -> Option<String> {
        None
    }
    /// What a recording shows that no mechanism has in common: recordings of their own, each with channels of its own, which are
    /// diagnosed one by one. None where it shows but one thing.
    fn aspects(&self, _recording: &Recording<Self::Stimulus>) -> Vec<Recording<Self::Stimulus>> {
        Vec::new()
    }
    /// Whether mechanisms of that site may change anything of what a recording driven by `stimulus` shows.
    fn concerns(&self, _site: Site, _stimulus: &Self::Stimulus) -> bool {
        true
    }
    /// Whether mechanisms of that site have something to act on: equations that do not say what moves have no place for
    /// friction.
    fn open_to(&self, _site: Site) -> bool {
        true
    }
    /// The unit a parameter has here, where mechanisms declare one in general terms.
    fn unit(&self, declared: &str) -> String {
        declared.to_owned()
    }
    /// The running part, one lane a point of `thetas` (in the order of [`Plant::parameters`]).
    fn dynamics(&self, thetas: &Thetas) -> Self::Dynamics;
}

/// The running part of a plant over all lanes; it owns the lanes' parameters, not their states.
pub trait Dynamics<P: Plant>: Send {
    /// The states at the start; `initial` is in the order of [`Plant::initial_parameters`].
    fn initial(&self, initial: &Thetas) -> Vec<P::State>;
    /// Advances every lane by one tick. All slices have one entry a lane.
    fn advance(
        &self,
        tick: Tick,
        states: &mut [P::State],
        inputs: &[P::Input],
        commands: &[P::Command],
        effects: &[P::Effect],
    );
    /// What is seen of every lane.
    fn observe(&self, states: &[P::State], observations: &mut [P::Observation]);
}

/// Typical sizes in a recording: fits begin at fractions of these.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Typical {
    /// Of the command, in its unit.
    pub command: f64,
    /// Of what the command does to the plant (a torque [N m]; for orders a cost [bps]).
    pub effort: f64,
    /// Of the first channel's excursions, in its unit.
    pub output: f64,
    /// Of the first channel's rate of change [its unit/s].
    pub rate: f64,
    /// Lowest and highest value of the first channel, in its unit.
    pub range: [f64; 2],
    /// Smallest step the first channel takes, in its unit; 0 where it takes none.
    pub resolution: f64,
    /// Duration of the longest recording [s].
    pub duration: f64,
    /// The delay of commands that the recordings' own time stamps show [s], where they show it.
    pub delay: Option<f64>,
    /// The same where delays differ: their median, and its standard deviation [s].
    pub delays: Option<[f64; 2]>,
    /// The largest number of which all that was done of commands is a multiple, in their unit, where there is one.
    pub quantum: Option<f64>,
    /// The age of what commands were decided on that the recordings themselves show [s], where they show it.
    pub age: Option<f64>,
}

impl Default for Typical {
    fn default() -> Self {
        Self {
            command: 1.0,
            effort: 1.0,
            output: 1.0,
            rate: 1.0,
            range: [-1.0, 1.0],
            resolution: 0.01,
            duration: 20.0,
            delay: None,
            delays: None,
            quantum: None,
            age: None,
        }
    }
}
