//! All that identification, diagnosis and reports see of a simulator.

use std::ops::Range;

use super::{About, Channel, Clock, Covariate, Form, Measured, Parameter, Recording, Seed, Signs, Thetas, Trajectory};

/// Something that follows a recording and says what it would have measured.
///
/// An [`Assembly`](super::Assembly) of a plant and its mechanisms is one; a simulator written elsewhere needs only
/// these methods to be identified.
///
/// # Contract
/// [`Simulator::rollout`] gives one trajectory a lane, each with every channel of [`Simulator::channels`] and one
/// sample for each row followed; a lane's bits depend on neither the lanes beside it nor the thread.
pub trait Simulator: Send + Sync {
    /// What drives it.
    type Stimulus: Clone + Send + Sync + 'static;
    /// Name.
    fn name(&self) -> String;
    /// The channels it simulates.
    fn channels(&self) -> &[Channel];
    /// Its parameters: the plant's, then those of each mechanism in turn.
    fn parameters(&self) -> &[Parameter];
    /// What makes its clock tick.
    fn clock(&self) -> Clock;
    /// Parameters of the state in row `row` of `recording`: they belong to the recording and are estimated beside the
    /// simulator's own.
    fn initial_parameters(&self, recording: &Recording<Self::Stimulus>, row: usize) -> Vec<Parameter>;
    /// Standard deviation of the rounding of a measured channel, in its unit; 0 where none is known.
    fn resolution(&self, recording: &Recording<Self::Stimulus>, channel: &str) -> f64;
    /// The least that a channel of messages scatters whatever explains it, as the messages themselves show it, in its unit; 0 where
    /// that is not known. Of samples of a signal their differences tell.
    fn scatter(&self, _recording: &Recording<Self::Stimulus>, _channel: &str) -> f64 {
        0.0
    }
    /// Whether commands are set points that a controller holds, which remembers what was before.
    fn in_closed_loop(&self) -> bool {
        false
    }
    /// How many commands a recording of messages holds; of samples of a signal it is as many as there are rows.
    fn sent(&self, recording: &Recording<Self::Stimulus>) -> usize {
        recording.time.len()
    }
    /// What a residual may depend on when something is missing, row by row: the remainder is tested against each.
    fn covariates(&self, recording: &Recording<Self::Stimulus>) -> Vec<Covariate>;
    /// Whether no law of any registry depends on that covariate: what depends on it is none of them.
    fn no_law_knows(&self, _covariate: &str) -> bool {
        false
    }
    /// What was left out or is peculiar about `recording`, in words a report can show.
    fn notes(&self, recording: &Recording<Self::Stimulus>) -> Vec<String>;
    /// What `recording` says against values of its own [`initial_parameters`](Self::initial_parameters), in words a summary can show; none
    /// where they may be what they stand for.
    fn contradicts(&self, _recording: &Recording<Self::Stimulus>, _initial: &[f64]) -> Option<String> {
        None
    }
    /// What a recording shows that nothing a twin could lack has in common: recordings of their own, each with channels of its own,
    /// as many of every recording. None where it shows but one thing.
    fn aspects(&self, _recording: &Recording<Self::Stimulus>) -> Vec<Recording<Self::Stimulus>> {
        Vec::new()
    }
    /// The unit a parameter has here, where mechanisms declare one in general terms.
    fn unit(&self, declared: &str) -> String;
    /// Follows `rows` of `recording` over all lanes of `thetas`: [`Simulator::parameters`] first, then
    /// [`Simulator::initial_parameters`] of the first of these rows.
    fn rollout(
        &self,
        thetas: &Thetas,
        recording: &Recording<Self::Stimulus>,
        rows: Range<usize>,
        seed: Seed,
    ) -> Vec<Trajectory>;
    /// As [`rollout`](Self::rollout), of no more channels than what `recording` is compared with needs: those that it does not
    /// measure may be left out, for each takes room and time.
    fn rollout_measured(
        &self,
        thetas: &Thetas,
        recording: &Recording<Self::Stimulus>,
        rows: Range<usize>,
        seed: Seed,
    ) -> Vec<Trajectory> {
        self.rollout(thetas, recording, rows, seed)
    }
    /// As [`rollout`](Self::rollout), but every `every` rows all lanes go on from the state of the first: what parts them
    /// then, they did since. None where states cannot be handed over.
    fn rollout_rejoined(
        &self,
        _thetas: &Thetas,
        _recording: &Recording<Self::Stimulus>,
        _rows: Range<usize>,
        _every: usize,
        _seed: Seed,
    ) -> Option<Vec<Trajectory>> {
        None
    }
    /// The commands of a recording, one a row, where a command is one number; none elsewhere.
    fn commands(&self, _recording: &Recording<Self::Stimulus>) -> Option<Vec<f64>> {
        None
    }
    /// A recording yet to be made, of a system driven as that of `recording` is but by `commands`, each from its `time` [s]
    /// on; nothing is measured in it. None where a command is not one number.
    fn excited(
        &self,
        _recording: &Recording<Self::Stimulus>,
        _time: Vec<f64>,
        _commands: Vec<f64>,
    ) -> Option<Recording<Self::Stimulus>> {
        None
    }
    /// `recording` with other samples: simulated ones, say, in the place of those that were measured.
    fn resampled(&self, recording: &Recording<Self::Stimulus>, measured: Vec<Measured>) -> Recording<Self::Stimulus> {
        Recording { measured, ..recording.clone() }
    }
}

/// A mechanism a twin could be given: what diagnosis needs to know of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Its id, site and law.
    pub about: About,
    /// Which of its forms.
    pub form: Form,
    /// Number of that form.
    pub form_index: usize,
    /// Whether it only rounds what is reported, and is tried as it is when everything else is fitted.
    pub finishing: bool,
    /// Whether it is a wider law of which a plainer form is one case, and is tried only in the place of that.
    pub general: bool,
    /// Mechanisms beside one of which alone it is tried; none where it differs from a plainer form by itself.
    pub beside: &'static [&'static str],
    /// Whether its law is another one at another time, whatever the plant does meanwhile.
    pub ages: bool,
    /// Whether its law is met less often by itself than others are.
    pub seldom: bool,
    /// Whether it does not do quite the same to one command as to the next.
    pub unsteady: bool,
    /// Lowest and highest value that each of its parameters may have at all, beyond what goes by its name.
    pub bounds: Vec<[f64; 2]>,
}

impl Candidate {
    /// The only `form` of a mechanism, of which nothing more is to be said: tried by itself, within the bounds its parameters have.
    #[must_use]
    pub fn new(about: About, form: Form) -> Self {
        let bounds = form.parameters.iter().map(|parameter| [parameter.lower, parameter.upper]).collect();
        Self {
            about,
            form,
            form_index: 0,
            finishing: false,
            general: false,
            beside: &[],
            ages: false,
            seldom: false,
            unsteady: false,
            bounds,
        }
    }
}

/// A simulator that can be given mechanisms it lacks.
pub trait Twin: Simulator + Clone + 'static {
    /// The forms of all mechanisms it could be given and does not model yet, as far as `recordings` can tell of them.
    fn candidates(&self, recordings: &[Recording<Self::Stimulus>]) -> Vec<Candidate>;
    /// The same of mechanisms that are a [matter of the record](super::Mechanism::of_the_record), which are no candidates.
    fn of_the_record(&self, _recordings: &[Recording<Self::Stimulus>]) -> Vec<Candidate> {
        Vec::new()
    }
    /// The same of those that [stand for no law](super::Mechanism::nameless), which are no candidates either.
    fn nameless(&self, _recordings: &[Recording<Self::Stimulus>]) -> Vec<Candidate> {
        Vec::new()
    }
    /// The twin with one more mechanism, whose parameters follow those it has.
    #[must_use]
    fn with(&self, candidate: &Candidate) -> Self;
    /// The twin integrated in steps of at most `seconds` [s]; a twin that has no such choice stays as it is.
    #[must_use]
    fn stepping(&self, _seconds: f64) -> Self {
        self.clone()
    }
    /// The twin as it is followed: without what is random, which no recording can be followed in.
    #[must_use]
    fn quiet(&self) -> Self {
        self.clone()
    }
    /// The twin with what only rounds, or without: where something is fitted, for a staircase has no slope to follow. Without, steps
    /// are known as they are given.
    #[must_use]
    fn rounding(&self, _rounds: bool) -> Self {
        self.clone()
    }
    /// The mechanisms that `signs` show by themselves, their parameters' nominal values as shown.
    fn recognized(&self, _signs: &Signs) -> Vec<Candidate> {
        Vec::new()
    }
    /// Ids of the mechanisms it models.
    fn modelled(&self) -> Vec<&'static str>;
}
