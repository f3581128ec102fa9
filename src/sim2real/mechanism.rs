//! The noun that carries the project: a piece of physics that may be missing from a simulator.
//!
//! A mechanism is written once, in a file of its own, and listed once, in its domain's registry. Those that act on
//! commands or observations of any plant live here; those of a plant live with it.

mod actuator_lag;
mod bias;
mod command_delay;
mod dead_zone;
mod decay;
mod drift;
mod dropout;
mod eccentricity;
mod gain_error;
mod noise;
mod observation_delay;
mod of_readings;
mod quantization;
mod rate_limit;
mod rectification;
mod sampling_lead;
mod saturation;
mod scale;
mod thermal_derating;
mod velocity_filter;
#[cfg(test)]
pub(super) mod wire;

use std::fmt;

use dyn_clone::DynClone;
use serde::{Deserialize, Serialize};

use super::{LaneChange, Parameter, Plant, Seed, Thetas, Tick, Ticks, Typical};

pub use actuator_lag::ActuatorLag;
pub use bias::Bias;
pub use command_delay::{CommandDelay, HeldLine};
pub use dead_zone::DeadZone;
pub use drift::Drift;
pub use dropout::Dropout;
pub use eccentricity::Eccentricity;
pub use gain_error::GainError;
pub use noise::Noise;
pub use observation_delay::ObservationDelay;
pub use of_readings::rate_of_the_first;
pub use quantization::Quantization;
pub use rate_limit::RateLimit;
pub use rectification::Rectification;
pub use sampling_lead::SamplingLead;
pub use saturation::Saturation;
pub use scale::Scale;
pub use thermal_derating::ThermalDerating;
pub use velocity_filter::VelocityFilter;

/// Where a mechanism acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Site {
    /// On what is sent, on its way to the plant.
    Command,
    /// Inside the plant.
    Plant,
    /// On what is reported, on its way back.
    Observation,
}

impl fmt::Display for Site {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Command => "command",
            Self::Plant => "plant",
            Self::Observation => "observation",
        })
    }
}

/// What a measured channel shows of its sensor, whatever simulator it is held against.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Signs {
    /// The part of the samples that repeat the one before to the last bit, where none should.
    pub repeated: f64,
    /// Mean number of repeats in a row.
    pub run: f64,
    /// The steps in which the first channel is counted, in its unit, where they are no smaller than the noise; 0 elsewhere.
    pub step: f64,
}

/// One way to state a mechanism: a law and the parameters it has.
#[derive(Debug, Clone, PartialEq)]
pub struct Form {
    /// What tells this form from the others of its mechanism ("bps"); empty where there is one only.
    pub name: &'static str,
    /// Its parameters; their nominal values do nothing.
    pub parameters: Vec<Parameter>,
}

impl Form {
    /// The only form of a mechanism.
    #[must_use]
    pub fn only(parameters: Vec<Parameter>) -> Vec<Self> {
        vec![Self { name: "", parameters }]
    }
}

/// What the documentation, the command line and reports say of a mechanism.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct About {
    /// Id, as in a twin.
    pub name: &'static str,
    /// Where it acts.
    pub site: Site,
    /// What a report calls it, within a sentence ("Coulomb friction").
    pub title: &'static str,
    /// The law, in one line.
    pub law: &'static str,
    /// Where the law comes from.
    pub source: &'static str,
    /// What a person who reads that it is missing may do about it.
    pub remedy: &'static str,
    /// Ids of simpler mechanisms it contains as special cases.
    pub contains: &'static [&'static str],
}

/// A piece of physics: a stateless description, from which the running [`Law`] is made.
///
/// # Contract
/// - At the nominal values of its parameters it changes no bit of the output.
/// - At each start it changes something, on a plant that is moved enough.
/// - No two of its forms have parameters of the same names: a twin tells by them which form it means.
/// - Its law acts at its site only, and a lane's result never depends on the lanes beside it.
///
/// [`check_mechanism`](super::check_mechanism) runs it.
pub trait Mechanism<P: Plant>: Send + Sync {
    /// Its id, site, law and source.
    fn about(&self) -> About;
    /// Its forms, the plainest first, with starts that suit what is `typical` of the recording.
    fn forms(&self, typical: &Typical) -> Vec<Form>;
    /// The forms as a diagnosis seeks them: with bounds as narrow as what is `typical` of the recordings lets a law be told by.
    fn sought(&self, typical: &Typical) -> Vec<Form> {
        self.forms(typical)
    }
    /// Whether a form could act at all on the given plant and what drives it: a fraction of a quoted spread needs
    /// quotes.
    fn applies(&self, _form: usize, _plant: &P, _stimulus: &P::Stimulus) -> bool {
        true
    }
    /// Where form `form` acts, where that is not where the mechanism is listed: play in a transmission may be told of the
    /// command or of the motion.
    fn site(&self, _form: usize) -> Site {
        self.about().site
    }
    /// Whether following a recording can tell of form `form`. Noise cannot be followed, only recognized.
    fn followed(&self, _form: usize) -> bool {
        true
    }
    /// What is left of form `form` where nothing random may happen, if it cannot be followed: its mean, or nothing.
    fn mean(&self, _form: usize, _thetas: &Thetas) -> Option<Box<dyn Law<P>>> {
        None
    }
    /// The form and the values of its parameters that are meant where a document names it and says no more.
    fn customary(&self) -> Option<(usize, Vec<f64>)> {
        None
    }
    /// Whether form `form` only rounds what is reported: tried as it is once everything else is fitted, for what jumps has
    /// no gradient to follow.
    fn finishing(&self, _form: usize) -> bool {
        false
    }
    /// Whether form `form` is a wider law of which a plainer form is one case: tried only in the place of that, where it does best. Its
    /// first parameters are those of that form, in their order.
    fn general(&self, _form: usize) -> bool {
        false
    }
    /// Whether its law is another one at another time, whatever the plant does meanwhile.
    fn ages(&self) -> bool {
        false
    }
    /// Whether its law is met less often by itself than others are: one that leaves out what others of its kind begin with, so that what
    /// these are off by looks like it.
    fn seldom(&self) -> bool {
        false
    }
    /// Whether it does not do quite the same to one command as to the next, as messages of a bus are not equally late: it pushes what adds up
    /// by chance, and no recording tells by how much.
    fn unsteady(&self) -> bool {
        false
    }
    /// Whether it is a matter of how a recording was made, and nothing that a simulator leaves out: it is fitted where the recordings ask
    /// for it, and never named.
    fn of_the_record(&self) -> bool {
        false
    }
    /// Whether it is a curve of any shape, which stands for no law: what is named has to explain more than it does, unless it
    /// [contains](About::contains) that. It is never named.
    fn nameless(&self) -> bool {
        false
    }
    /// The channel by which alone form `form` tells itself from a plainer one, so that recordings without it cannot tell of it.
    fn told_by(&self, _form: usize) -> Option<usize> {
        None
    }
    /// Mechanisms of which one has to be there for form `form` to differ from a plainer one: it is tried beside these alone. None where it
    /// differs by itself.
    fn beside(&self, _form: usize) -> &'static [&'static str] {
        &[]
    }
    /// Values of form `form`'s parameters where the measured channels themselves show `signs` of it.
    fn recognized(&self, _form: usize, _signs: &Signs) -> Option<Vec<f64>> {
        None
    }
    /// For how long what it did before matters to what it does [s]: a run that starts in the middle of a recording sees
    /// the commands of as long a time before. Of signals this concerns laws that shape commands alone; the state has the rest.
    fn memory(&self) -> f64 {
        1.0
    }
    /// The running part of form `form` over the lanes of `thetas`, which holds that form's parameters and no others.
    fn law(&self, form: usize, thetas: &Thetas, seed: Seed) -> Box<dyn Law<P>>;
}

/// What a law meets inside the plant.
#[derive(Debug)]
pub struct Scene<'a, P: Plant> {
    /// The running plant, which knows the parameters of every lane.
    pub dynamics: &'a P::Dynamics,
    /// States, one a lane.
    pub states: &'a [P::State],
    /// What the plant meets beside commands, one a lane.
    pub inputs: &'a [P::Input],
    /// Commands as they arrive, one a lane.
    pub commands: &'a [P::Command],
}

/// The running part of a mechanism over all lanes, and the owner of its memory. It acts through one of its methods.
///
/// A copy goes on from the same memory by itself: so a run can be forked.
///
/// The lanes of an environment are runs of their own, each with its own clock, draws and beginnings: there the methods that end in
/// `_each` are called, and [`change`](Law::change). What a lane does there depends on its own past alone.
pub trait Law<P: Plant>: DynClone + Send {
    /// Shapes the commands on their way to the plant, one a lane.
    fn shape(&mut self, _tick: Tick, _commands: &mut [P::Command]) {}
    /// Adds to what acts inside the plant, one effect a lane.
    fn act(&mut self, _tick: Tick, _scene: &Scene<'_, P>, _effects: &mut [P::Effect]) {}
    /// Whether it acts inside the plant after all laws that do not, as one that moves elsewhere what these have added. It
    /// [`prepare`](Law::prepare)s what they are to see.
    fn late(&self) -> bool {
        false
    }
    /// What comes before all laws act inside the plant; asked of those alone that are [`late`](Law::late).
    fn prepare(&mut self, _scene: &Scene<'_, P>, _effects: &mut [P::Effect]) {}
    /// Distorts the observations on their way back, one a lane.
    fn sense(&mut self, _time: f64, _observations: &mut [P::Observation]) {}
    /// As [`shape`](Law::shape), where every lane has its own clock. Laws to which more matters than the length of a tick have their
    /// own, as for the other two.
    fn shape_each(&mut self, ticks: Ticks<'_>, commands: &mut [P::Command]) {
        self.shape(ticks.lane(0), commands);
    }
    /// As [`act`](Law::act), where every lane has its own clock.
    fn act_each(&mut self, ticks: Ticks<'_>, scene: &Scene<'_, P>, effects: &mut [P::Effect]) {
        self.act(ticks.lane(0), scene, effects);
    }
    /// As [`sense`](Law::sense), where every lane has its own clock, and draws of its own.
    fn sense_each(&mut self, times: &[f64], observations: &mut [P::Observation]) {
        self.sense(times.first().copied().unwrap_or_default(), observations);
    }
    /// Changes one lane: shows `change` all that is kept by lanes. Every law implements it, be it of a robot or of a market; one that
    /// keeps nothing by lanes needs nothing. The dynamics of a market's plant, `execution`, have no parameters that could change.
    fn change(&mut self, _change: &LaneChange<'_>) {}
    /// A quantity of its own that a sensor may show, in lane `lane`, such as the heat of a winding; none where it has none.
    fn told(&self, _lane: usize) -> Option<f64> {
        None
    }
}

dyn_clone::clone_trait_object!(<P: Plant> Law<P>);
