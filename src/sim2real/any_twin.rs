//! Twins of any kind behind one type: identification and the steps of a diagnosis are thousands of lines, which compilers then go
//! through once, and not once for each kind of twin. A step asks little of a twin but to follow recordings, beside which a call
//! through a table costs nothing.

use std::any::Any;
use std::ops::Range;
use std::sync::Arc;

use super::{
    Candidate, Channel, Clock, Covariate, Measured, Parameter, Recording, Seed, Signs, Simulator, Thetas, Trajectory, Twin,
};

/// A twin, whatever its kind.
#[derive(Clone)]
pub(in crate::sim2real) struct AnyTwin(Arc<dyn Methods>);

/// What drives a recording, whatever its kind: the recording itself.
#[derive(Clone)]
pub(in crate::sim2real) struct AnyStimulus(Arc<dyn Any + Send + Sync>);

/// Recordings of one kind as those of any. They are not to be changed, for what was measured is kept twice, but
/// [`resampled`](Simulator::resampled).
pub(in crate::sim2real) fn any_recordings<S: Clone + Send + Sync + 'static>(
    all: &[Recording<S>],
) -> Vec<Recording<AnyStimulus>> {
    all.iter().cloned().map(any_recording).collect()
}

/// The same of one.
pub(in crate::sim2real) fn any_recording<S: Clone + Send + Sync + 'static>(own: Recording<S>) -> Recording<AnyStimulus> {
    let (name, time, measured) = (own.name.clone(), own.time.clone(), own.measured.clone());
    Recording { name, time, measured, stimulus: AnyStimulus(Arc::new(own)) }
}

impl AnyTwin {
    /// A twin of one kind as one of any.
    pub fn new<T: Twin>(twin: T) -> Self {
        Self(Arc::new(Kind(twin)))
    }

    /// The twin as one of its kind: `like` where it is of another, which no method makes it.
    pub fn of_its_kind<T: Twin>(&self, like: &T) -> T {
        self.0.any().downcast_ref::<T>().unwrap_or(like).clone()
    }
}

/// A kind of twin.
struct Kind<T>(T);

impl<T: Twin> Kind<T> {
    /// The recording that `recording` was made of.
    ///
    /// # Panics
    /// If it is of another kind: an error of this module, not of any input.
    #[expect(clippy::expect_used, reason = "recordings reach a twin through the function that made them for it")]
    fn own<'a>(&self, recording: &'a Recording<AnyStimulus>) -> &'a Recording<T::Stimulus> {
        recording.stimulus.0.downcast_ref().expect("a recording of the twin's kind")
    }

    fn all(&self, recordings: &[Recording<AnyStimulus>]) -> Vec<Recording<T::Stimulus>> {
        recordings.iter().map(|recording| self.own(recording).clone()).collect()
    }
}

/// What makes a twin of a simulator, for a table of methods.
trait Methods: Simulator<Stimulus = AnyStimulus> {
    fn any(&self) -> &dyn Any;
    fn candidates(&self, recordings: &[Recording<AnyStimulus>]) -> Vec<Candidate>;
    fn of_the_record(&self, recordings: &[Recording<AnyStimulus>]) -> Vec<Candidate>;
    fn nameless(&self, recordings: &[Recording<AnyStimulus>]) -> Vec<Candidate>;
    fn with(&self, candidate: &Candidate) -> AnyTwin;
    fn stepping(&self, seconds: f64) -> AnyTwin;
    fn quiet(&self) -> AnyTwin;
    fn rounding(&self, rounds: bool) -> AnyTwin;
    fn recognized(&self, signs: &Signs) -> Vec<Candidate>;
    fn modelled(&self) -> Vec<&'static str>;
}

impl<T: Twin> Simulator for Kind<T> {
    type Stimulus = AnyStimulus;

    fn name(&self) -> String {
        self.0.name()
    }

    fn channels(&self) -> &[Channel] {
        self.0.channels()
    }

    fn parameters(&self) -> &[Parameter] {
        self.0.parameters()
    }

    fn clock(&self) -> Clock {
        self.0.clock()
    }

    fn initial_parameters(&self, recording: &Recording<AnyStimulus>, row: usize) -> Vec<Parameter> {
        self.0.initial_parameters(self.own(recording), row)
    }

    fn resolution(&self, recording: &Recording<AnyStimulus>, channel: &str) -> f64 {
        self.0.resolution(self.own(recording), channel)
    }

    fn sent(&self, recording: &Recording<AnyStimulus>) -> usize {
        self.0.sent(self.own(recording))
    }

    fn scatter(&self, recording: &Recording<AnyStimulus>, channel: &str) -> f64 {
        self.0.scatter(self.own(recording), channel)
    }

    fn in_closed_loop(&self) -> bool {
        self.0.in_closed_loop()
    }

    fn covariates(&self, recording: &Recording<AnyStimulus>) -> Vec<Covariate> {
        self.0.covariates(self.own(recording))
    }

    fn notes(&self, recording: &Recording<AnyStimulus>) -> Vec<String> {
        self.0.notes(self.own(recording))
    }

    fn no_law_knows(&self, covariate: &str) -> bool {
        self.0.no_law_knows(covariate)
    }

    fn contradicts(&self, recording: &Recording<AnyStimulus>, initial: &[f64]) -> Option<String> {
        self.0.contradicts(self.own(recording), initial)
    }

    fn unit(&self, declared: &str) -> String {
        self.0.unit(declared)
    }

    fn rollout(
        &self,
        thetas: &Thetas,
        recording: &Recording<AnyStimulus>,
        rows: Range<usize>,
        seed: Seed,
    ) -> Vec<Trajectory> {
        self.0.rollout(thetas, self.own(recording), rows, seed)
    }

    fn rollout_measured(
        &self,
        thetas: &Thetas,
        recording: &Recording<AnyStimulus>,
        rows: Range<usize>,
        seed: Seed,
    ) -> Vec<Trajectory> {
        self.0.rollout_measured(thetas, self.own(recording), rows, seed)
    }

    fn rollout_rejoined(
        &self,
        thetas: &Thetas,
        recording: &Recording<AnyStimulus>,
        rows: Range<usize>,
        every: usize,
        seed: Seed,
    ) -> Option<Vec<Trajectory>> {
        self.0.rollout_rejoined(thetas, self.own(recording), rows, every, seed)
    }

    fn commands(&self, recording: &Recording<AnyStimulus>) -> Option<Vec<f64>> {
        self.0.commands(self.own(recording))
    }

    fn excited(&self, like: &Recording<AnyStimulus>, time: Vec<f64>, commands: Vec<f64>) -> Option<Recording<AnyStimulus>> {
        self.0.excited(self.own(like), time, commands).map(any_recording)
    }

    fn resampled(&self, recording: &Recording<AnyStimulus>, measured: Vec<Measured>) -> Recording<AnyStimulus> {
        any_recording(self.0.resampled(self.own(recording), measured))
    }
}

impl<T: Twin> Methods for Kind<T> {
    fn any(&self) -> &dyn Any {
        &self.0
    }

    fn candidates(&self, recordings: &[Recording<AnyStimulus>]) -> Vec<Candidate> {
        self.0.candidates(&self.all(recordings))
    }

    fn of_the_record(&self, recordings: &[Recording<AnyStimulus>]) -> Vec<Candidate> {
        self.0.of_the_record(&self.all(recordings))
    }

    fn nameless(&self, recordings: &[Recording<AnyStimulus>]) -> Vec<Candidate> {
        self.0.nameless(&self.all(recordings))
    }

    fn with(&self, candidate: &Candidate) -> AnyTwin {
        AnyTwin::new(self.0.with(candidate))
    }

    fn stepping(&self, seconds: f64) -> AnyTwin {
        AnyTwin::new(self.0.stepping(seconds))
    }

    fn quiet(&self) -> AnyTwin {
        AnyTwin::new(self.0.quiet())
    }

    fn rounding(&self, rounds: bool) -> AnyTwin {
        AnyTwin::new(self.0.rounding(rounds))
    }

    fn recognized(&self, signs: &Signs) -> Vec<Candidate> {
        self.0.recognized(signs)
    }

    fn modelled(&self) -> Vec<&'static str> {
        self.0.modelled()
    }
}

impl Simulator for AnyTwin {
    type Stimulus = AnyStimulus;

    fn name(&self) -> String {
        self.0.name()
    }

    fn channels(&self) -> &[Channel] {
        self.0.channels()
    }

    fn parameters(&self) -> &[Parameter] {
        self.0.parameters()
    }

    fn clock(&self) -> Clock {
        self.0.clock()
    }

    fn initial_parameters(&self, recording: &Recording<AnyStimulus>, row: usize) -> Vec<Parameter> {
        self.0.initial_parameters(recording, row)
    }

    fn resolution(&self, recording: &Recording<AnyStimulus>, channel: &str) -> f64 {
        self.0.resolution(recording, channel)
    }

    fn sent(&self, recording: &Recording<AnyStimulus>) -> usize {
        self.0.sent(recording)
    }

    fn scatter(&self, recording: &Recording<AnyStimulus>, channel: &str) -> f64 {
        self.0.scatter(recording, channel)
    }

    fn in_closed_loop(&self) -> bool {
        self.0.in_closed_loop()
    }

    fn covariates(&self, recording: &Recording<AnyStimulus>) -> Vec<Covariate> {
        self.0.covariates(recording)
    }

    fn notes(&self, recording: &Recording<AnyStimulus>) -> Vec<String> {
        self.0.notes(recording)
    }

    fn no_law_knows(&self, covariate: &str) -> bool {
        self.0.no_law_knows(covariate)
    }

    fn contradicts(&self, recording: &Recording<AnyStimulus>, initial: &[f64]) -> Option<String> {
        self.0.contradicts(recording, initial)
    }

    fn unit(&self, declared: &str) -> String {
        self.0.unit(declared)
    }

    fn rollout(
        &self,
        thetas: &Thetas,
        recording: &Recording<AnyStimulus>,
        rows: Range<usize>,
        seed: Seed,
    ) -> Vec<Trajectory> {
        self.0.rollout(thetas, recording, rows, seed)
    }

    fn rollout_measured(
        &self,
        thetas: &Thetas,
        recording: &Recording<AnyStimulus>,
        rows: Range<usize>,
        seed: Seed,
    ) -> Vec<Trajectory> {
        self.0.rollout_measured(thetas, recording, rows, seed)
    }

    fn rollout_rejoined(
        &self,
        thetas: &Thetas,
        recording: &Recording<AnyStimulus>,
        rows: Range<usize>,
        every: usize,
        seed: Seed,
    ) -> Option<Vec<Trajectory>> {
        self.0.rollout_rejoined(thetas, recording, rows, every, seed)
    }

    fn commands(&self, recording: &Recording<AnyStimulus>) -> Option<Vec<f64>> {
        self.0.commands(recording)
    }

    fn excited(
        &self,
        recording: &Recording<AnyStimulus>,
        time: Vec<f64>,
        commands: Vec<f64>,
    ) -> Option<Recording<AnyStimulus>> {
        self.0.excited(recording, time, commands)
    }

    fn resampled(&self, recording: &Recording<AnyStimulus>, measured: Vec<Measured>) -> Recording<AnyStimulus> {
        self.0.resampled(recording, measured)
    }
}

impl Twin for AnyTwin {
    fn candidates(&self, recordings: &[Recording<AnyStimulus>]) -> Vec<Candidate> {
        self.0.candidates(recordings)
    }

    fn of_the_record(&self, recordings: &[Recording<AnyStimulus>]) -> Vec<Candidate> {
        self.0.of_the_record(recordings)
    }

    fn nameless(&self, recordings: &[Recording<AnyStimulus>]) -> Vec<Candidate> {
        self.0.nameless(recordings)
    }

    fn with(&self, candidate: &Candidate) -> Self {
        self.0.with(candidate)
    }

    fn stepping(&self, seconds: f64) -> Self {
        self.0.stepping(seconds)
    }

    fn quiet(&self) -> Self {
        self.0.quiet()
    }

    fn rounding(&self, rounds: bool) -> Self {
        self.0.rounding(rounds)
    }

    fn recognized(&self, signs: &Signs) -> Vec<Candidate> {
        self.0.recognized(signs)
    }

    fn modelled(&self) -> Vec<&'static str> {
        self.0.modelled()
    }
}
