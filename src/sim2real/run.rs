//! A plant and its mechanisms under way: all lanes, one step at a time.

use std::fmt;

use super::{Dynamics, Feedback, Law, Plant, Scene, Tick, Ticks};

/// A running assembly: all lanes, one step at a time.
pub struct Run<P: Plant> {
    pub(super) controller: Option<Box<dyn Feedback<P>>>,
    pub(super) dynamics: P::Dynamics,
    pub(super) command_laws: Vec<Box<dyn Law<P>>>,
    pub(super) plant_laws: Vec<Box<dyn Law<P>>>,
    /// Numbers of the plant laws in the order in which they act, ...
    pub(super) turns: Vec<usize>,
    /// ... of which the last so many are late.
    pub(super) late: usize,
    pub(super) observation_laws: Vec<Box<dyn Law<P>>>,
    pub(super) states: Vec<P::State>,
    pub(super) effects: Vec<P::Effect>,
    pub(super) commands: Vec<P::Command>,
    pub(super) inputs: Vec<P::Input>,
    pub(super) observations: Vec<P::Observation>,
}

impl<P: Plant> Clone for Run<P>
where
    P::Dynamics: Clone,
{
    fn clone(&self) -> Self {
        let Self { controller, dynamics, command_laws, plant_laws, observation_laws, .. } = self;
        let Self { turns, late, states, effects, commands, inputs, observations, .. } = self;
        Self {
            controller: controller.clone(),
            dynamics: dynamics.clone(),
            command_laws: command_laws.clone(),
            plant_laws: plant_laws.clone(),
            turns: turns.clone(),
            late: *late,
            observation_laws: observation_laws.clone(),
            states: states.clone(),
            effects: effects.clone(),
            commands: commands.clone(),
            inputs: inputs.clone(),
            observations: observations.clone(),
        }
    }
}

impl<P: Plant> fmt::Debug for Run<P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Run").field("lanes", &self.states.len()).finish_non_exhaustive()
    }
}

impl<P: Plant> Run<P> {
    /// Sends one command to every lane and gives it as it arrives, one a lane. Where there is a controller, the command is its
    /// set point, and it acts on what was last observed.
    pub fn send(&mut self, tick: Tick, command: &P::Command) -> &mut [P::Command] {
        self.commands.clear();
        self.commands.resize(self.states.len(), command.clone());
        if let Some(controller) = &mut self.controller {
            controller.act(tick.time, &self.observations, &mut self.commands);
        }
        self.shape(tick)
    }

    /// The same before the plant moves, where a controller can see no more than what was measured: its first channel, if at
    /// all.
    pub(super) fn send_before(&mut self, tick: Tick, command: &P::Command, measured: Option<f64>) {
        self.commands.clear();
        self.commands.resize(self.states.len(), command.clone());
        match (&mut self.controller, measured) {
            (Some(controller), Some(measured)) => controller.act_on_measured(tick.time, measured, &mut self.commands),
            // What it gave is not known.
            (Some(_), None) => return,
            (None, _) => {}
        }
        self.shape(tick);
    }

    /// Whether a controller has to see the plant at `time` [s].
    pub(super) fn watched(&self, time: f64) -> bool {
        self.controller.as_ref().is_some_and(|controller| controller.due(time))
    }

    /// Whether commands arrive as they were sent, at once.
    #[must_use]
    pub fn leaves_commands(&self) -> bool {
        self.controller.is_none() && self.command_laws.is_empty()
    }

    /// Whether it is the plant and nothing else: no controller, and no law at any site.
    #[must_use]
    pub fn is_bare(&self) -> bool {
        self.leaves_commands() && self.plant_laws.is_empty() && self.observation_laws.is_empty()
    }

    /// Shapes the commands on their way.
    fn shape(&mut self, tick: Tick) -> &mut [P::Command] {
        for law in &mut self.command_laws {
            law.shape(tick, &mut self.commands);
        }
        &mut self.commands
    }

    /// Puts commands that were sent earlier, and have been on their way since, before the plant: one a lane. Where several
    /// messages are under way at once, the last sent need not be the next to arrive.
    pub fn deliver(&mut self, arriving: &[P::Command]) {
        self.commands.clear();
        self.commands.extend_from_slice(arriving);
    }

    /// Lets the commands last sent or delivered act on the plant, which meets `input` of each lane's command.
    pub fn advance(&mut self, tick: Tick, input: impl Fn(&P::Command) -> P::Input) {
        self.advance_seen(tick, input, |_, _| {});
    }

    /// As [`advance`](Self::advance), and shows `seen` the effects after each plant law, with the law's number among the
    /// plant laws: what it adds is the difference to what was there before.
    pub fn advance_seen(
        &mut self,
        tick: Tick,
        input: impl Fn(&P::Command) -> P::Input,
        mut seen: impl FnMut(usize, &[P::Effect]),
    ) {
        self.meet(input);
        self.prepare();
        for k in &self.turns {
            let scene =
                Scene { dynamics: &self.dynamics, states: &self.states, inputs: &self.inputs, commands: &self.commands };
            self.plant_laws[*k].act(tick, &scene, &mut self.effects);
            seen(*k, &self.effects);
        }
        self.dynamics.advance(tick, &mut self.states, &self.inputs, &self.commands, &self.effects);
    }

    /// Empties the effects, but for what late laws prepare.
    fn prepare(&mut self) {
        self.effects.fill(P::Effect::default());
        for k in &self.turns[self.turns.len() - self.late..] {
            let scene =
                Scene { dynamics: &self.dynamics, states: &self.states, inputs: &self.inputs, commands: &self.commands };
            self.plant_laws[*k].prepare(&scene, &mut self.effects);
        }
    }

    /// What each lane meets. Parameters by which lanes differ seldom change what arrives, and looking up what it meets takes longer than
    /// comparing.
    fn meet(&mut self, input: impl Fn(&P::Command) -> P::Input) {
        self.inputs.clear();
        if size_of::<P::Input>() == 0 {
            self.inputs.extend(self.commands.iter().map(input));
            return;
        }
        for (lane, command) in self.commands.iter().enumerate() {
            let same = lane.checked_sub(1).filter(|before| self.commands[*before] == *command);
            self.inputs.push(same.map_or_else(|| input(command), |before| self.inputs[before].clone()));
        }
    }

    /// As [`advance`](Self::advance), where every lane has its own clock and the inputs are there.
    pub(super) fn advance_each(&mut self, ticks: Ticks<'_>) {
        self.prepare();
        for k in &self.turns {
            let scene =
                Scene { dynamics: &self.dynamics, states: &self.states, inputs: &self.inputs, commands: &self.commands };
            self.plant_laws[*k].act_each(ticks, &scene, &mut self.effects);
        }
        self.dynamics.advance(ticks.lane(0), &mut self.states, &self.inputs, &self.commands, &self.effects);
    }

    /// What is reported of every lane at `time` [s].
    pub fn observe(&mut self, time: f64) -> &[P::Observation] {
        self.observe_seen(time, |_, _| {})
    }

    /// As [`observe`](Self::observe), and shows `seen` the observations after each law of them, with the law's number among
    /// these.
    pub fn observe_seen(&mut self, time: f64, mut seen: impl FnMut(usize, &[P::Observation])) -> &[P::Observation] {
        self.dynamics.observe(&self.states, &mut self.observations);
        for (k, law) in self.observation_laws.iter_mut().enumerate() {
            law.sense(time, &mut self.observations);
            seen(k, &self.observations);
        }
        &self.observations
    }

    /// Puts all lanes where the first is; what laws remember stays theirs.
    pub fn rejoin(&mut self) {
        if let Some((first, others)) = self.states.split_first_mut() {
            others.iter_mut().for_each(|state| state.clone_from(first));
        }
        if let Some(controller) = &mut self.controller {
            controller.rejoin();
            if let Some((first, others)) = self.observations.split_first_mut() {
                others.iter_mut().for_each(|observation| observation.clone_from(first));
            }
        }
    }

    /// The states, one a lane.
    #[must_use]
    pub fn states(&self) -> &[P::State] {
        &self.states
    }
}
