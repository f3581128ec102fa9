//! A plant and its mechanisms, put together and run.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use super::follow::{Collected, Said};
use super::run::Run;
use super::{
    About, Candidate, Channel, Clock, Controller, Covariate, Dynamics, Form, Measured, Mechanism, Parameter, Plant,
    Recording, Seed, Signs, Simulator, Site, Stimulus, Thetas, Trajectory, Twin, Typical,
};

/// The mechanisms a domain knows: one row each.
pub type Registry<P> = &'static [&'static dyn Mechanism<P>];

/// A mechanism in use: which one, in which form.
struct Part<P: Plant> {
    mechanism: &'static dyn Mechanism<P>,
    form: usize,
    /// Whether it stays out of rollouts.
    silent: bool,
}

impl<P: Plant> Clone for Part<P> {
    fn clone(&self) -> Self {
        Self { mechanism: self.mechanism, form: self.form, silent: self.silent }
    }
}

/// A plant with its mechanisms: the simulator of a recording, the venue of a backtest, the joint of an environment.
#[derive(Clone)]
pub struct Assembly<P: Plant> {
    plant: Arc<P>,
    registry: Registry<P>,
    /// What closes the loop, where it is closed.
    controller: Option<Arc<dyn Controller<P>>>,
    parts: Vec<Part<P>>,
    parameters: Vec<Parameter>,
    excluded: Vec<String>,
    /// Longest step of integration [s], where it is not the plant's own.
    step: Option<f64>,
    /// Whether what is random stays out of rollouts.
    quiet: bool,
}

impl<P: Plant> fmt::Debug for Assembly<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Assembly").field("plant", &self.plant.name()).field("mechanisms", &self.modelled()).finish()
    }
}

impl<P: Plant> Assembly<P> {
    /// A plant with no mechanisms yet, which may be given those of `registry`.
    #[must_use]
    pub fn new(plant: P, registry: Registry<P>) -> Self {
        Self {
            parameters: plant.parameters(),
            plant: Arc::new(plant),
            registry,
            controller: None,
            parts: Vec::new(),
            excluded: Vec::new(),
            step: None,
            quiet: false,
        }
    }

    /// The plant.
    #[must_use]
    pub fn plant(&self) -> &P {
        &self.plant
    }

    /// The mechanisms it may be given.
    #[must_use]
    pub fn registry(&self) -> Registry<P> {
        self.registry
    }

    /// The same assembly, which is not to be given the mechanisms of these ids: what a diagnosis says when it does not know
    /// them tells whether it can be trusted not to name something else instead.
    #[must_use]
    pub fn excluding(mut self, ids: &[String]) -> Self {
        self.excluded.extend_from_slice(ids);
        self
    }

    /// Closes the loop: commands are set points of the first channel from now on. The controller's parameters follow the
    /// plant's, whatever mechanisms there are.
    #[must_use]
    pub fn controlled_by(mut self, controller: impl Controller<P> + 'static) -> Self {
        let at = self.plant.parameters().len();
        let old = self.own().len() - at;
        self.parameters.splice(at..at + old, controller.parameters());
        self.controller = Some(Arc::new(controller));
        self
    }

    /// The parameters of the plant and its controller, before those of mechanisms.
    #[must_use]
    pub fn own(&self) -> &[Parameter] {
        let controller = self.controller.as_ref().map_or(0, |c| c.parameters().len());
        &self.parameters[..self.plant.parameters().len() + controller]
    }

    /// Adds a mechanism in one of its forms, with the values its parameters have today.
    #[must_use]
    pub fn with_mechanism(mut self, mechanism: &'static dyn Mechanism<P>, form: usize, parameters: Vec<Parameter>) -> Self {
        self.parts.push(Part { mechanism, form, silent: false });
        self.parameters.extend(parameters);
        self
    }

    /// The mechanisms it has, in the order in which their parameters follow the plant's, each with the number of its
    /// form and these parameters.
    pub fn mechanisms(&self) -> impl Iterator<Item = (&'static dyn Mechanism<P>, usize, &[Parameter])> {
        let mut at = self.own().len();
        self.parts.iter().map(move |part| {
            let start = at;
            at += part.mechanism.forms(&Default::default())[part.form].parameters.len();
            (part.mechanism, part.form, &self.parameters[start..at])
        })
    }

    /// The same assembly with other values of its parameters, in their order.
    #[must_use]
    pub fn with_values(mut self, values: &[f64]) -> Self {
        for (parameter, value) in self.parameters.iter_mut().zip(values) {
            parameter.nominal = *value;
        }
        self
    }

    /// A run over the lanes of `thetas`, from the states `initial` describes.
    #[must_use]
    pub fn run(&self, thetas: &Thetas, initial: &Thetas, seed: Seed) -> Run<P> {
        let lanes = thetas.lanes();
        let plant = self.plant.parameters().len();
        let dynamics = self.plant.dynamics(&thetas.block(0, plant));
        let mut at = self.own().len();
        let mut run = Run {
            controller: self.controller.as_ref().map(|c| c.feedback(&thetas.block(plant, at - plant))),
            states: dynamics.initial(initial),
            dynamics,
            command_laws: Vec::new(),
            plant_laws: Vec::new(),
            turns: Vec::new(),
            late: 0,
            observation_laws: Vec::new(),
            effects: vec![P::Effect::default(); lanes],
            commands: Vec::with_capacity(lanes),
            inputs: Vec::with_capacity(lanes),
            observations: vec![P::Observation::default(); lanes],
        };
        for part in &self.parts {
            let about = part.mechanism.about();
            let count = part.mechanism.forms(&Default::default())[part.form].parameters.len();
            let own = thetas.block(at, count);
            at += count;
            if part.silent {
                continue;
            }
            let law = match self.quiet && !part.mechanism.followed(part.form) {
                true => part.mechanism.mean(part.form, &own),
                false => Some(part.mechanism.law(part.form, &own, seed.child(about.name))),
            };
            let Some(law) = law else { continue };
            match part.mechanism.site(part.form) {
                Site::Command => run.command_laws.push(law),
                Site::Plant => run.plant_laws.push(law),
                Site::Observation => run.observation_laws.push(law),
            }
        }
        let (late, early): (Vec<usize>, Vec<usize>) = (0..run.plant_laws.len()).partition(|k| run.plant_laws[*k].late());
        (run.turns, run.late) = ([early, late.clone()].concat(), late.len());
        run
    }
}

impl<P: Plant> Simulator for Assembly<P> {
    type Stimulus = P::Stimulus;

    fn name(&self) -> String {
        self.plant.name().to_owned()
    }

    fn channels(&self) -> &[Channel] {
        self.plant.channels()
    }

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn clock(&self) -> Clock {
        match (self.plant.clock(), self.step) {
            // A plant of no longest step is not integrated: it goes from row to row.
            (Clock::Sampled { longest_step: own }, Some(longest_step)) if own.is_finite() => Clock::Sampled { longest_step },
            (clock, _) => clock,
        }
    }

    fn initial_parameters(&self, recording: &Recording<P::Stimulus>, row: usize) -> Vec<Parameter> {
        self.plant.initial_parameters(recording, row)
    }

    fn resolution(&self, recording: &Recording<P::Stimulus>, channel: &str) -> f64 {
        self.plant.resolution(recording, channel)
    }

    fn sent(&self, recording: &Recording<P::Stimulus>) -> usize {
        self.plant.sent(recording)
    }

    fn scatter(&self, recording: &Recording<P::Stimulus>, channel: &str) -> f64 {
        self.plant.scatter(recording, channel)
    }

    fn in_closed_loop(&self) -> bool {
        self.controller.is_some()
    }

    fn covariates(&self, recording: &Recording<P::Stimulus>) -> Vec<Covariate> {
        self.plant.covariates(recording)
    }

    fn no_law_knows(&self, covariate: &str) -> bool {
        self.plant.no_law_knows(covariate)
    }

    fn contradicts(&self, recording: &Recording<P::Stimulus>, initial: &[f64]) -> Option<String> {
        self.plant.contradicts(recording, initial)
    }

    fn aspects(&self, recording: &Recording<P::Stimulus>) -> Vec<Recording<P::Stimulus>> {
        self.plant.aspects(recording)
    }

    fn notes(&self, recording: &Recording<P::Stimulus>) -> Vec<String> {
        self.plant.notes(recording)
    }

    fn unit(&self, declared: &str) -> String {
        self.plant.unit(declared)
    }

    fn rollout(
        &self,
        thetas: &Thetas,
        recording: &Recording<P::Stimulus>,
        rows: Range<usize>,
        seed: Seed,
    ) -> Vec<Trajectory> {
        self.follow(thetas, recording, rows, Said::all(self.channels()), seed)
    }

    fn rollout_measured(
        &self,
        thetas: &Thetas,
        recording: &Recording<P::Stimulus>,
        rows: Range<usize>,
        seed: Seed,
    ) -> Vec<Trajectory> {
        self.follow(thetas, recording, rows, Said::measured(self.channels(), recording), seed)
    }

    fn rollout_rejoined(
        &self,
        thetas: &Thetas,
        recording: &Recording<P::Stimulus>,
        rows: Range<usize>,
        every: usize,
        seed: Seed,
    ) -> Option<Vec<Trajectory>> {
        Some(self.follow(thetas, recording, rows, Said::all(self.channels()).rejoined(every), seed))
    }

    fn commands(&self, recording: &Recording<P::Stimulus>) -> Option<Vec<f64>> {
        recording.stimulus.commands().map(<[f64]>::to_vec)
    }

    fn excited(
        &self,
        recording: &Recording<P::Stimulus>,
        time: Vec<f64>,
        commands: Vec<f64>,
    ) -> Option<Recording<P::Stimulus>> {
        let lost = |m: &Measured| Measured { samples: vec![None; time.len()], ..m.clone() };
        Some(Recording {
            name: "next experiment".into(),
            stimulus: recording.stimulus.commanded(commands)?,
            measured: recording.measured.iter().map(lost).collect(),
            time,
        })
    }
}

impl<P: Plant> Assembly<P> {
    /// What is typical of the recordings: of commands, what a controller gave.
    fn typical(&self, recordings: &[Recording<P::Stimulus>]) -> Typical {
        let typical = self.plant.typical(recordings);
        let (Some(controller), Some(channel)) = (&self.controller, self.channels().first()) else { return typical };
        let given = recordings.iter().flat_map(|recording| controller.given(recording, &channel.name));
        let (sum, count) = given.fold((0.0, 0), |(sum, count), u| (sum + u * u, count + 1));
        let command = (sum / f64::from(count.max(1))).sqrt();
        if command <= 0.0 || !command.is_finite() {
            return typical;
        }
        // Efforts are told in proportion to commands.
        let effort = if typical.command > 0.0 { typical.effort * command / typical.command } else { typical.effort };
        Typical { command, effort, ..typical }
    }

    /// The forms of all mechanisms of this `kind` that it does not model, as far as `recordings` can tell of them.
    fn unmodelled(
        &self,
        recordings: &[Recording<P::Stimulus>],
        kind: impl Fn(&'static dyn Mechanism<P>) -> bool,
    ) -> Vec<Candidate> {
        let typical = self.typical(recordings);
        let modelled = self.modelled();
        let mut candidates = Vec::new();
        for mechanism in self.registry.iter().filter(|mechanism| kind(**mechanism)) {
            let about = mechanism.about();
            if modelled.contains(&about.name) || self.excluded.iter().any(|id| id == about.name) {
                continue;
            }
            let widest = mechanism.forms(&typical);
            for (form_index, form) in mechanism.sought(&typical).into_iter().enumerate() {
                let applies = |stimulus| {
                    self.plant.concerns(about.site, stimulus) && mechanism.applies(form_index, &self.plant, stimulus)
                };
                let told = |channel: usize| measured(recordings, self.channels().get(channel));
                let known =
                    recordings.iter().all(|r| applies(&r.stimulus)) && mechanism.told_by(form_index).is_none_or(told);
                if known && self.plant.open_to(mechanism.site(form_index)) && mechanism.followed(form_index) {
                    // Beside what is modelled already it differs from the first.
                    let others = mechanism.beside(form_index);
                    let beside = if others.iter().any(|other| modelled.contains(other)) { &[] } else { others };
                    let widest = &widest[form_index].parameters;
                    let bounds = widest.iter().map(|parameter| [parameter.lower, parameter.upper]).collect();
                    let plain = candidate(*mechanism, form, form_index);
                    let (finishing, general) = (mechanism.finishing(form_index), mechanism.general(form_index));
                    candidates.push(Candidate { finishing, general, beside, bounds, ..plain });
                }
            }
        }
        candidates
    }

    /// Follows `rows`, and gives what is to be `said` of them.
    fn follow(
        &self,
        thetas: &Thetas,
        recording: &Recording<P::Stimulus>,
        rows: Range<usize>,
        said: Said<'_>,
        seed: Seed,
    ) -> Vec<Trajectory> {
        let own = self.parameters.len();
        let mut run = self.run(&thetas.block(0, own), &thetas.block(own, thetas.parameters() - own), seed);
        // What acts in a plant that moves has left its traces in the state; an order finds no other state than the laws' own.
        let events = self.clock() == Clock::Event;
        let lasting = self.parts.iter().filter(|part| events || part.mechanism.site(part.form) == Site::Command);
        let memory = lasting.map(|part| part.mechanism.memory()).fold(0.0, f64::max);
        let memory = memory + self.controller.as_ref().map_or(0.0, |controller| controller.memory());
        let mut out = Collected::new(said, thetas.lanes(), rows.len());
        match self.clock() {
            Clock::Event => out.follow_events(&mut run, recording, rows, memory),
            clock => out.follow_samples(&mut run, recording, rows, clock, memory),
        }
        out.trajectories()
    }
}

/// Whether any of the recordings has samples of the channel.
fn measured<S>(recordings: &[Recording<S>], channel: Option<&Channel>) -> bool {
    let own =
        |r: &Recording<S>| channel.and_then(|c| r.channel(&c.name)).is_some_and(|m| m.samples.iter().any(Option::is_some));
    recordings.iter().any(own)
}

/// `form` of `mechanism`, number `form_index` of its forms, tried by itself.
fn candidate<P: Plant>(mechanism: &dyn Mechanism<P>, form: Form, form_index: usize) -> Candidate {
    let (ages, seldom, unsteady) = (mechanism.ages(), mechanism.seldom(), mechanism.unsteady());
    Candidate { form_index, ages, seldom, unsteady, ..Candidate::new(mechanism.about(), form) }
}

impl<P: Plant> Twin for Assembly<P> {
    fn candidates(&self, recordings: &[Recording<P::Stimulus>]) -> Vec<Candidate> {
        self.unmodelled(recordings, |mechanism| !mechanism.of_the_record() && !mechanism.nameless())
    }

    fn of_the_record(&self, recordings: &[Recording<P::Stimulus>]) -> Vec<Candidate> {
        self.unmodelled(recordings, |mechanism| mechanism.of_the_record())
    }

    fn nameless(&self, recordings: &[Recording<P::Stimulus>]) -> Vec<Candidate> {
        self.unmodelled(recordings, |mechanism| mechanism.nameless())
    }

    fn with(&self, candidate: &Candidate) -> Self {
        let row = self.registry.iter().find(|m| m.about().name == candidate.about.name);
        match row {
            Some(mechanism) => {
                self.clone().with_mechanism(*mechanism, candidate.form_index, candidate.form.parameters.clone())
            }
            // A candidate of another registry has nothing to act on here.
            None => self.clone(),
        }
    }

    fn stepping(&self, seconds: f64) -> Self {
        Self { step: Some(seconds), ..self.clone() }
    }

    fn quiet(&self) -> Self {
        Self { quiet: true, ..self.clone() }
    }

    fn rounding(&self, rounds: bool) -> Self {
        let mut twin = self.clone();
        let mut at = self.own().len();
        for part in &mut twin.parts {
            let count = part.mechanism.forms(&Default::default())[part.form].parameters.len();
            if part.mechanism.finishing(part.form) {
                part.silent = !rounds;
                let steps = twin.parameters[at..at + count].iter_mut();
                steps.filter(|_| !rounds).for_each(|step| step.prior = Some(0.0));
            }
            at += count;
        }
        twin
    }

    fn recognized(&self, signs: &Signs) -> Vec<Candidate> {
        let modelled = self.modelled();
        let unknown = |about: &About| !modelled.contains(&about.name) && !self.excluded.iter().any(|id| id == about.name);
        let mut found = Vec::new();
        for mechanism in self.registry.iter().filter(|m| unknown(&m.about())) {
            for (form_index, mut form) in mechanism.forms(&Default::default()).into_iter().enumerate() {
                let Some(values) = mechanism.recognized(form_index, signs) else { continue };
                form.parameters.iter_mut().zip(values).for_each(|(parameter, value)| parameter.nominal = value);
                found.push(candidate(*mechanism, form, form_index));
            }
        }
        found
    }

    fn modelled(&self) -> Vec<&'static str> {
        self.parts.iter().map(|p| p.mechanism.about().name).collect()
    }
}
