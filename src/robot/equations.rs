//! `equations`: a plant as its user writes it down.

mod expression;
mod program;
mod solver;
mod stimulus;
mod system;

use std::cell::Cell;
use std::fmt;
use std::sync::Arc;

use super::estimate::{Estimate, local, motion, rounding, typical};
use super::joint::Axis;
use super::mover::{Motion, Mover, Push};
use super::signal::Signal;
use crate::sim2real::{
    Channel, Clock, Covariate, Dynamics, Observation, Parameter, Plant, Recording, Scene, Site, Stimulus, Thetas, Tick,
    Typical,
};
use program::Memory;
use solver::{Acting, Work};
use system::{Model, Shown};

pub use stimulus::{Driving, Measurements};
pub use system::{Attachment, EquationError, EquationSystem, InputVariable, OutputVariable, StateVariable};

/// A plant of equations: derivatives of its states, or their values in the next row, and what is seen of them.
///
/// Derivatives are integrated by the classical Runge-Kutta method; dry friction that mechanisms add stops the coordinate
/// where its velocity changes sign, and holds it to the bit.
#[derive(Debug, Clone)]
pub struct Equations {
    model: Arc<Model>,
    longest_step: f64,
}

/// What is seen of equations: a value a channel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outputs(Vec<f64>);

impl AsMut<[f64]> for Outputs {
    fn as_mut(&mut self) -> &mut [f64] {
        &mut self.0
    }
}

impl Observation for Outputs {
    fn channel(&self, k: usize) -> f64 {
        self.0[k]
    }
}

impl Equations {
    /// A plant of the given equations, integrated in steps of at most `longest_step` [s], unless they go from row to row.
    ///
    /// # Errors
    /// Names that are unknown, taken or stand for two things; expressions that are none; states without an equation;
    /// definitions that need one another; an attachment that is no position and its velocity; a system without states,
    /// inputs or outputs.
    pub fn new(system: EquationSystem, longest_step: f64) -> Result<Self, EquationError> {
        Ok(Self { model: Arc::new(Model::new(system)?), longest_step })
    }

    /// The equations.
    #[must_use]
    pub fn system(&self) -> &EquationSystem {
        &self.model.system
    }

    /// What is not a finite number where the system starts, with the given values of its inputs: of a state its equation, or
    /// an output.
    #[must_use]
    pub fn not_finite_at_start(&self, inputs: &[f64]) -> Option<String> {
        let system = self.system();
        let nominal: Vec<f64> = system.parameters.iter().map(|p| p.nominal).collect();
        let dynamics = self.dynamics(&Thetas::single(&nominal));
        let states = vec![system.states.iter().map(|s| s.initial).collect::<Vec<f64>>()];
        let mut memory = dynamics.memory(0);
        states[0].iter().enumerate().for_each(|(k, value)| memory.slot_mut(self.model.state_slot(k))[0] = *value);
        inputs.iter().enumerate().for_each(|(k, value)| memory.slot_mut(self.model.input_slot(k))[0] = *value);
        self.model.rates.run(&mut memory);
        let rates = (0..system.states.len()).map(|k| self.model.rates.output(&memory, k)[0]);
        if let Some((state, _)) = system.states.iter().zip(rates).find(|(_, rate)| !rate.is_finite()) {
            return Some(state.name.clone());
        }
        let mut seen = [Outputs::default()];
        dynamics.observe(&states, &mut seen);
        system.outputs.iter().zip(&seen[0].0).find(|(_, value)| !value.is_finite()).map(|(output, _)| output.name.clone())
    }

    /// Value and rate of a state in row `row`, where a channel shows it or what it is the rate of.
    fn shown(&self, state: usize, recording: &Recording<Driving>, row: usize) -> Option<(f64, f64)> {
        let channel = |k: usize| local(recording, &self.model.channels[k].name, "", row);
        match self.model.shown[state]? {
            Shown::Value(k) => {
                let wide = 0.3 * self.spread(recording, k);
                channel(k).map(|Estimate { value, .. }| (value, wide))
            }
            Shown::Rate(k) => channel(k).map(|Estimate { rate, rate_std, .. }| (rate, rate_std)),
        }
    }

    /// Root mean square of a channel about its mean.
    fn spread(&self, recording: &Recording<Driving>, k: usize) -> f64 {
        typical(std::slice::from_ref(recording), &self.model.channels[k].name, "", 1.0).output
    }

    /// Units of position, velocity, inertia, where mechanisms of motion act.
    fn moving_units(&self) -> Option<[String; 3]> {
        let system = self.system();
        let attach = system.attach.as_ref()?;
        let of = |name: &str| system.states.iter().find(|s| s.name == name).map(|s| s.unit.clone()).unwrap_or_default();
        let position = of(&attach.position);
        let velocity = Some(of(&attach.velocity)).filter(|unit| !unit.is_empty());
        let velocity = velocity.unwrap_or_else(|| format!("{position}/s"));
        let inertia = system.parameters.iter().find(|p| p.name == attach.inertia.trim());
        let number = attach.inertia.trim().parse::<f64>().is_ok();
        let composed = if number { String::new() } else { format!("({})", attach.inertia.trim()) };
        Some([position, velocity, inertia.map_or(composed, |p| p.unit.clone().into_owned())])
    }
}

impl Plant for Equations {
    type Command = Signal;
    type Input = Measurements;
    type State = Vec<f64>;
    type Effect = Push;
    type Observation = Outputs;
    type Dynamics = EquationsDynamics;
    type Stimulus = Driving;

    fn name(&self) -> &'static str {
        "equations"
    }

    fn clock(&self) -> Clock {
        // Equations from row to row are not integrated, however far the rows are apart.
        Clock::Sampled { longest_step: if self.system().discrete { f64::INFINITY } else { self.longest_step } }
    }

    fn channels(&self) -> &[Channel] {
        &self.model.channels
    }

    fn parameters(&self) -> Vec<Parameter> {
        self.system().parameters.clone()
    }

    fn open_to(&self, site: Site) -> bool {
        site != Site::Plant || self.model.moving.is_some()
    }

    fn typical(&self, recordings: &[Recording<Driving>]) -> Typical {
        let rate = self.model.shown.iter().zip(&self.model.system.states).find(|(shown, _)| **shown == Some(Shown::Rate(0)));
        let rate = rate.map_or("", |(_, state)| state.name.as_str());
        let typical = typical(recordings, &self.model.channels[0].name, rate, 1.0);
        let Some(moving) = &self.model.moving else { return typical };
        // What a typical command pushes with, at the initial state and where recordings start.
        let system = self.system();
        let nominal: Vec<f64> = system.parameters.iter().map(|p| p.nominal).collect();
        let dynamics = self.dynamics(&Thetas::single(&nominal));
        let mut state: Vec<f64> = system.states.iter().map(|s| s.initial).collect();
        state[moving.velocity] = 0.0;
        let pushed = |recording: &Recording<Driving>| {
            let command = Signal(typical.command);
            let inputs = [recording.stimulus.input(0, &command)];
            let (states, commands) = (std::slice::from_ref(&state), [command]);
            Self::drive(&Scene { dynamics: &dynamics, states, inputs: &inputs, commands: &commands }, 0).abs()
        };
        let effort = recordings.iter().map(pushed).filter(|effort| effort.is_finite()).fold(0.0, f64::max);
        let effort = if effort > 0.0 { effort } else { typical.effort };
        Typical { effort, ..typical }
    }

    /// As measured, where a channel shows a state or what it is the rate of; else as the equations' user has it.
    fn initial_parameters(&self, recording: &Recording<Driving>, row: usize) -> Vec<Parameter> {
        let system = self.system();
        let scale = self.spread(recording, 0);
        let initial = |(k, state): (usize, &StateVariable)| {
            let name = format!("initial {}", state.name);
            let parameter = |value| Parameter::named(name, state.unit.clone(), value);
            // What is known of where a recording starts says nothing of a row in its midst.
            match (state.std.filter(|_| row == 0), self.shown(k, recording, row)) {
                (Some(std), _) => parameter(state.initial).known_to(std),
                (None, Some((value, std))) => parameter(value).known_to(std.max(1e-9)),
                (None, None) => parameter(state.initial).known_to((state.initial.abs() + scale).max(1e-9)),
            }
        };
        system.states.iter().enumerate().map(initial).collect()
    }

    fn covariates(&self, recording: &Recording<Driving>) -> Vec<Covariate> {
        let seen = motion(recording, &self.model.channels[0].name, "");
        vec![
            ("command", recording.stimulus.as_ref().to_vec()),
            ("output", seen.iter().map(|e| e.value).collect()),
            ("rate of the output", seen.iter().map(|e| e.rate).collect()),
        ]
    }

    fn resolution(&self, recording: &Recording<Driving>, channel: &str) -> f64 {
        recording.channel(channel).map_or(0.0, rounding)
    }

    fn unit(&self, declared: &str) -> String {
        let output = &self.model.channels[0].unit;
        let command = match self.system().inputs[0].unit.as_str() {
            "" => "unit of the command",
            unit => unit,
        };
        match declared {
            "output" => return output.to_string(),
            "output/s" => return format!("{output}/s"),
            "1/output^2" => return format!("1/{output}^2"),
            "command" => return command.to_owned(),
            "command/s" => return format!("{command}/s"),
            _ => {}
        }
        match self.moving_units() {
            None => declared.to_owned(),
            Some([position, ..]) if position == "rad" => declared.to_owned(),
            Some([position, ..]) if position == "m" => Axis::Linear.unit(declared),
            Some([position, velocity, inertia]) => {
                let effort = if inertia.is_empty() { format!("{velocity}/s") } else { format!("{inertia} {velocity}/s") };
                let per = declared.contains('/');
                let effort = if per { format!("({effort})") } else { effort };
                declared.replace("kg m^2", &inertia).replace("N m", &effort).replace("rad", &position)
            }
        }
    }

    fn dynamics(&self, thetas: &Thetas) -> EquationsDynamics {
        let lanes = thetas.lanes();
        let rows: Vec<Vec<f64>> = (0..thetas.parameters()).map(|k| thetas.row(k).to_vec()).collect();
        let given = || rows.iter().map(Vec::as_slice);
        let model = Arc::clone(&self.model);
        let inertia = model
            .moving
            .as_ref()
            .map_or_else(Vec::new, |moving| moving.inertia.output(&moving.inertia.memory(lanes, given()), 0).to_vec());
        let work = Work::new(&model, model.rates.memory(lanes, given()), lanes);
        let seen = model.seen.memory(lanes, given());
        EquationsDynamics { inertia, work: Cell::new(work), seen: Cell::new(seen), alone: Cell::default(), rows, model }
    }
}

impl Mover for Equations {
    fn motion(state: &Vec<f64>) -> Motion {
        // Position and velocity stand first where there are any.
        Motion { position: state.first().copied().unwrap_or(0.0), velocity: state.get(1).copied().unwrap_or(0.0) }
    }

    fn push(effect: &mut Push) -> &mut Push {
        effect
    }

    fn inertia(dynamics: &EquationsDynamics, lane: usize, _: &Vec<f64>) -> f64 {
        dynamics.inertia.get(lane).copied().unwrap_or(1.0)
    }

    fn drive(scene: &Scene<'_, Self>, lane: usize) -> f64 {
        let effort = |command| scene.dynamics.effort(scene, lane, command, None);
        effort(scene.commands[lane].0) - effort(0.0)
    }

    fn external(scene: &Scene<'_, Self>, lane: usize, position: f64) -> f64 {
        scene.dynamics.effort(scene, lane, 0.0, Some(position))
    }
}

/// The running equations: their parameters, lane by lane, and room to work in.
pub struct EquationsDynamics {
    model: Arc<Model>,
    rows: Vec<Vec<f64>>,
    inertia: Vec<f64>,
    work: Cell<Work>,
    seen: Cell<Memory>,
    /// Room for each lane by itself, made when a mechanism first asks for it.
    alone: Cell<Vec<Memory>>,
}

impl fmt::Debug for EquationsDynamics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("EquationsDynamics").field("rows", &self.rows).finish_non_exhaustive()
    }
}

impl EquationsDynamics {
    /// Room for lane `lane` by itself.
    fn memory(&self, lane: usize) -> Memory {
        self.model.rates.memory(1, self.rows.iter().map(|row| &row[lane..=lane]))
    }

    /// Effort of `command` on what moves in lane `lane`, as it is or at rest at another position; inputs beside the command are those
    /// of the row's start.
    fn effort(&self, scene: &Scene<'_, Equations>, lane: usize, command: f64, position: Option<f64>) -> f64 {
        let Some(moving) = &self.model.moving else { return 0.0 };
        let mut alone = self.alone.take();
        if alone.is_empty() {
            alone = (0..self.inertia.len()).map(|lane| self.memory(lane)).collect();
        }
        let memory = &mut alone[lane];
        memory.slot_mut(self.model.input_slot(0))[0] = command;
        for k in 1..self.model.system.inputs.len() {
            memory.slot_mut(self.model.input_slot(k))[0] = scene.inputs[lane].begun(k - 1);
        }
        let state = scene.states[lane].iter().enumerate();
        state.for_each(|(k, value)| memory.slot_mut(self.model.state_slot(k))[0] = *value);
        if let Some(position) = position {
            memory.slot_mut(self.model.state_slot(moving.position))[0] = position;
            memory.slot_mut(self.model.state_slot(moving.velocity))[0] = 0.0;
        }
        self.model.rates.run(memory);
        let effort = self.inertia[lane] * self.model.rates.output(memory, moving.velocity)[0];
        self.alone.set(alone);
        effort
    }
}

impl Dynamics<Equations> for EquationsDynamics {
    fn initial(&self, initial: &Thetas) -> Vec<Vec<f64>> {
        (0..initial.lanes()).map(|lane| (0..initial.parameters()).map(|k| initial.row(k)[lane]).collect()).collect()
    }

    fn advance(&self, tick: Tick, states: &mut [Vec<f64>], inputs: &[Measurements], commands: &[Signal], effects: &[Push]) {
        let mut work = self.work.take();
        let acting = Acting { model: &self.model, tick, inputs, commands, effects, inertia: &self.inertia };
        work.advance(&acting, states);
        self.work.set(work);
    }

    fn observe(&self, states: &[Vec<f64>], observations: &mut [Outputs]) {
        let mut seen = self.seen.take();
        for (i, state) in states.iter().enumerate() {
            state.iter().enumerate().for_each(|(k, value)| seen.slot_mut(self.model.seen_slot(k))[i] = *value);
        }
        self.model.seen.run(&mut seen);
        for (i, observation) in observations.iter_mut().enumerate() {
            observation.0.resize(self.model.channels.len(), 0.0);
            observation.0.iter_mut().enumerate().for_each(|(k, y)| *y = self.model.seen.output(&seen, k)[i]);
        }
        self.seen.set(seen);
    }
}

#[cfg(test)]
mod tests;
