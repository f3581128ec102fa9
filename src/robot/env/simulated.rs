//! Environments of a plant with any mechanisms: lanes of an assembly, and a task that says what is asked of them.

use super::draws::{LaneParameters, Randomization, copy_episode};
use crate::rl::{
    About, Actions, EnvError, Episode, Episodes, InfoChannel, Occasion, OptionAbout, Options, Out, VecEnv, Which, alike,
};
use crate::robot::Signal;
use crate::sim2real::{Assembly, LaneDynamics, LaneRun, Plant, Simulator, Ticks};

/// What is asked of a plant, and what is told of it. It keeps what it remembers lane by lane.
pub(super) trait Task: Clone + Send + 'static {
    /// What moves.
    type Plant: Plant<Command = Signal, Input = ()>;

    /// Holds the options at reset to make sense together.
    ///
    /// # Errors
    /// Options that do not.
    fn check(&self, _start: &[f64]) -> Result<(), EnvError> {
        Ok(())
    }
    /// The state in which lane `lane` begins `episode`, with the options in the order of `About`'s, and all parameters.
    fn begin(&mut self, lane: usize, episode: Episode, start: &[f64]) -> <Self::Plant as Plant>::State;
    /// The command that `action` stands for, in force for `share` of the step that begins in `state`.
    fn act(&mut self, lane: usize, state: &<Self::Plant as Plant>::State, action: f64, share: f64) -> f64;
    /// The reward of the step that ends in `state` after `seconds` [s] of the episode, and whether that is its end.
    fn judge(&mut self, lane: usize, state: &<Self::Plant as Plant>::State, seconds: f64) -> (f64, bool);
    /// What is observed: `seen` is what the plant's sensors report, `told` what the law does that the task asks for.
    fn observe(&self, lane: usize, seen: &<Self::Plant as Plant>::Observation, told: f64, row: &mut [f32]);
    /// The value of info channel `channel`.
    fn info(&self, lane: usize, channel: usize, state: &<Self::Plant as Plant>::State, arriving: f64) -> f64;
    /// The mechanism whose own quantity is observed, if any.
    fn asks(&self) -> Option<&'static str> {
        None
    }
    /// Makes lane `to` a copy of lane `from` of `other`, or of its own where there is none.
    fn copy(&mut self, other: Option<&Self>, from: usize, to: usize);
}

/// How long things take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Timing {
    /// Duration of a step of the environment [s].
    pub seconds: f64,
    /// After how many an episode is truncated.
    pub max_steps: u32,
}

/// A plant with mechanisms, what is randomized of them, and a task.
#[derive(Clone)]
pub(super) struct Simulated<T: Task>
where
    <T::Plant as Plant>::Dynamics: LaneDynamics<T::Plant>,
{
    about: About,
    task: T,
    run: LaneRun<T::Plant>,
    parameters: LaneParameters,
    episodes: Episodes,
    timing: Timing,
    /// Steps of integration in each step.
    substeps: usize,
    steps: Vec<u32>,
    /// Where each lane whose episode is over was at its end; it stays there.
    ends: Vec<Option<<T::Plant as Plant>::State>>,
    times: Vec<f64>,
    commands: Vec<Signal>,
    /// The commands as they last arrived, 0 before the first.
    arriving: Vec<f64>,
    /// A run of one lane, in which lanes begin.
    first: LaneRun<T::Plant>,
}

/// How much of what is randomized is: an option at reset of whatever randomizes.
const LEVEL: &str = "level";

impl<T: Task> Simulated<T>
where
    <T::Plant as Plant>::Dynamics: LaneDynamics<T::Plant>,
{
    /// `lanes` lanes of `assembly`. `initial` is any state of the plant, in the order of its initial parameters.
    pub fn new(
        task: T,
        about: About,
        assembly: &Assembly<T::Plant>,
        randomization: Option<Randomization>,
        timing: Timing,
        (lanes, initial): (usize, &[f64]),
    ) -> Result<Self, EnvError> {
        if lanes == 0 {
            return Err(EnvError::NoLanes);
        }
        let failed = |why| EnvError::Failed { lane: 0, why: Box::new(why) };
        let run = LaneRun::new(assembly, lanes, initial).map_err(failed)?;
        let first = LaneRun::new(assembly, 1, initial).map_err(failed)?;
        let ends = run.states().iter().cloned().map(Some).collect();
        let parameters = LaneParameters::new(assembly.parameters(), randomization, lanes);
        Ok(Self {
            about: described(about, &parameters, timing, |unit| assembly.unit(unit)),
            task,
            run,
            parameters,
            episodes: Episodes::new(lanes),
            timing,
            substeps: assembly.clock().substeps(timing.seconds),
            steps: vec![0; lanes],
            ends,
            times: vec![0.0; lanes],
            commands: vec![Signal(0.0); lanes],
            arriving: vec![0.0; lanes],
            first,
        })
    }

    fn told(&self, lane: usize) -> f64 {
        self.task.asks().and_then(|id| self.run.told(id, lane)).unwrap_or_default()
    }

    /// Steps all lanes, which have `parts` actions each, one after the other; `action` gives that of a part and a lane.
    fn advance(&mut self, parts: usize, action: impl Fn(usize, usize) -> f64, out: &mut Out<'_>) {
        let lanes = self.steps.len();
        let (step, substeps) = (self.timing.seconds / self.substeps as f64, self.substeps);
        for part in 0..substeps {
            if (part * parts).is_multiple_of(substeps) {
                let given = part * parts / substeps;
                for lane in 0..lanes {
                    let state = &self.run.states()[lane];
                    self.commands[lane] = Signal(self.task.act(lane, state, action(given, lane), 1.0 / parts as f64));
                }
            }
            let times = self.times.iter_mut().zip(&self.steps);
            times.for_each(|(time, done)| *time = (*done as usize * substeps + part) as f64 * step);
            self.run.step(Ticks { step, times: &self.times }, &self.commands);
        }
        self.arriving.iter_mut().zip(self.run.arriving()).for_each(|(own, signal)| *own = signal.0);
        for (lane, done) in self.steps.iter_mut().enumerate() {
            *done = done.saturating_add(1);
            self.times[lane] = (*done as usize * substeps) as f64 * step;
            if let Some(end) = &self.ends[lane] {
                self.run.hold(lane, end.clone());
            }
        }
        self.draw();
        self.run.observe(&self.times);
        self.tell(out);
    }

    /// Draws what is due.
    fn draw(&mut self) {
        if !self.parameters.within() {
            return;
        }
        for lane in 0..self.steps.len() {
            let (episode, steps, seconds) = (self.episodes.lane(lane), u64::from(self.steps[lane]), self.times[lane]);
            if self.ends[lane].is_none()
                && let Some(values) = self.parameters.go_on(lane, episode, seconds, steps, self.timing.seconds)
            {
                self.run.retune(lane, values);
            }
        }
    }

    /// Writes what came of a step.
    fn tell(&mut self, out: &mut Out<'_>) {
        let size = self.about.observation.size();
        for lane in 0..self.steps.len() {
            if self.ends[lane].is_some() {
                continue;
            }
            let state = &self.run.states()[lane];
            let (reward, terminated) = self.task.judge(lane, state, self.times[lane]);
            let truncated = self.steps[lane] >= self.timing.max_steps;
            (out.rewards[lane], out.terminated[lane], out.truncated[lane]) = (reward, terminated, truncated);
            self.ends[lane] = (terminated || truncated).then(|| state.clone());
            let told = self.told(lane);
            let row = &mut out.observations[lane * size..][..size];
            self.task.observe(lane, &self.run.observations()[lane], told, row);
        }
    }
}

/// `about` with what is randomized: its parameters, the option of how much, the regime each lane is in.
pub(super) fn described(
    mut about: About,
    parameters: &LaneParameters,
    timing: Timing,
    unit: impl Fn(&str) -> String,
) -> About {
    about.privileged = parameters.channels(unit);
    (about.seconds_a_step, about.max_steps) = (Some(timing.seconds), Some(timing.max_steps));
    if parameters.any() {
        let meaning = "how much is randomized of what is declared, from nothing (0) to all (1)";
        about.options.push(OptionAbout::number(Occasion::Reset, LEVEL, "", [1.0, 0.0, 1.0], meaning));
    }
    if parameters.regimes() > 0 {
        about.info.push(InfoChannel::new("regime", ""));
    }
    about
}

/// The values of the options at reset, in the order of `about`'s, and the level of randomization.
pub(super) fn start_of(about: &About, options: &Options) -> Result<(Vec<f64>, f64), EnvError> {
    options.check(&about.id, &about.options, Occasion::Reset)?;
    let numbers = about.options.iter().filter(|one| one.at == Occasion::Reset && one.name != LEVEL);
    let start = numbers.map(|one| options.number(&about.options, &one.name)).collect::<Result<_, _>>()?;
    let level = if about.options.iter().any(|one| one.name == LEVEL) { options.number(&about.options, LEVEL)? } else { 1.0 };
    Ok((start, level))
}

impl<T: Task> VecEnv for Simulated<T>
where
    <T::Plant as Plant>::Dynamics: LaneDynamics<T::Plant>,
{
    fn about(&self) -> &About {
        &self.about
    }

    fn lanes(&self) -> usize {
        self.steps.len()
    }

    fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        let (start, level) = start_of(&self.about, options)?;
        self.task.check(&start)?;
        let size = self.about.observation.size();
        for lane in which.iter(self.steps.len()) {
            let episode = self.episodes.begin_lane(lane, seeds.map(|seeds| seeds[lane]));
            let values = self.parameters.begin(lane, episode, level);
            let state = self.task.begin(lane, episode, &start);
            self.first.begin(0, values, state, episode.seed());
            self.first.observe(&[0.0]);
            self.run.adopt(&mut self.first, 0, lane);
            (self.steps[lane], self.ends[lane], self.times[lane]) = (0, None, 0.0);
            self.arriving[lane] = 0.0;
            let told = self.told(lane);
            let row = &mut observations[lane * size..][..size];
            self.task.observe(lane, &self.run.observations()[lane], told, row);
        }
        Ok(())
    }

    fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        match actions {
            Actions::Continuous(values) => self.advance(1, |_, lane| f64::from(values[lane]), out),
            Actions::Discrete(values) => self.advance(1, |_, lane| values[lane] as f64, out),
        }
        Ok(())
    }

    fn parts(&self) -> usize {
        self.substeps
    }

    fn step_in_parts(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        let (lanes, parts) = (self.steps.len(), self.substeps);
        match actions {
            Actions::Continuous(values) => {
                self.advance(parts, |part, lane| f64::from(values[part * lanes + lane]), out);
            }
            Actions::Discrete(values) => self.advance(parts, |part, lane| values[part * lanes + lane] as f64, out),
        }
        Ok(())
    }

    fn info(&self, channel: usize, values: &mut [f64]) {
        let regime = self.parameters.regimes() > 0 && channel + 1 == self.about.info.len();
        let states = self.run.states();
        for (lane, value) in values.iter_mut().enumerate() {
            *value = match regime {
                true => self.parameters.regime(lane),
                false => self.task.info(lane, channel, &states[lane], self.arriving[lane]),
            };
        }
    }

    fn privileged(&self, parameter: usize, values: &mut [f64]) {
        self.parameters.tell(parameter, values);
    }

    fn copy_lane(&mut self, from: usize, to: usize) {
        self.run.copy(from, to);
        self.task.copy(None, from, to);
        self.parameters.copy(None, from, to);
        copy_episode(&mut self.episodes, None, from, to);
        self.ends[to] = self.ends[from].clone();
        (self.steps[to], self.times[to], self.arriving[to]) = (self.steps[from], self.times[from], self.arriving[from]);
    }

    fn copy_lane_from(&mut self, other: &dyn VecEnv, from: usize, to: usize) -> Result<(), EnvError> {
        let other = alike(self, other)?;
        if !self.run.kind().eq(other.run.kind()) || !self.parameters.same_as(&other.parameters) {
            let why = "it has other mechanisms, or randomizes others".to_owned();
            return Err(EnvError::Unlike { id: self.about.id.clone(), why });
        }
        self.run.copy_from(&other.run, from, to);
        self.task.copy(Some(&other.task), from, to);
        self.parameters.copy(Some(&other.parameters), from, to);
        copy_episode(&mut self.episodes, Some(&other.episodes), from, to);
        self.ends[to] = other.ends[from].clone();
        (self.steps[to], self.times[to], self.arriving[to]) = (other.steps[from], other.times[from], other.arriving[from]);
        Ok(())
    }
}
