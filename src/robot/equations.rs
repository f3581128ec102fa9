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
    Channel, Clock, Covariate, Dynamics, Observation, Parameter, Plant, Recording, Site, Thetas, Tick, Typical,
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
        // What a typical command pushes with, at the initial state.
        let system = self.system();
        let nominal: Vec<f64> = system.parameters.iter().map(|p| p.nominal).collect();
        let dynamics = self.dynamics(&Thetas::single(&nominal));
        let mut state: Vec<f64> = system.states.iter().map(|s| s.initial).collect();
        state[moving.velocity] = 0.0;
        let effort = Self::drive(&dynamics, 0, &state, &Signal(typical.command)).abs();
        let effort = if effort.is_finite() && effort > 0.0 { effort } else { typical.effort };
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

    fn drive(dynamics: &EquationsDynamics, lane: usize, state: &Vec<f64>, command: &Signal) -> f64 {
        dynamics.effort(lane, state, command.0, None) - dynamics.effort(lane, state, 0.0, None)
    }

    fn external(dynamics: &EquationsDynamics, lane: usize, state: &Vec<f64>, position: f64) -> f64 {
        dynamics.effort(lane, state, 0.0, Some(position))
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

    /// Effort on what moves, in a lane in that state, or at rest at another position; inputs beside the command are taken
    /// for 0.
    fn effort(&self, lane: usize, state: &[f64], command: f64, position: Option<f64>) -> f64 {
        let Some(moving) = &self.model.moving else { return 0.0 };
        let mut alone = self.alone.take();
        if alone.is_empty() {
            alone = (0..self.inertia.len()).map(|lane| self.memory(lane)).collect();
        }
        let memory = &mut alone[lane];
        memory.slot_mut(self.model.input_slot(0))[0] = command;
        state.iter().enumerate().for_each(|(k, value)| memory.slot_mut(self.model.state_slot(k))[0] = *value);
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
mod tests {
    use super::*;
    use crate::robot::{Axis, Commands, EQUATIONS_MECHANISMS, Joint, MECHANISMS};
    use crate::sim2real::{Assembly, Measured, Seed, Simulator, Twin, check_mechanism, check_plant};
    use differential_equations::prelude::*;

    fn state(name: &str, unit: &str, initial: f64) -> StateVariable {
        StateVariable { name: name.into(), unit: unit.into(), initial, std: None }
    }

    /// Time that grows with the square of what is read would be minutes here.
    #[test]
    fn large_systems_are_made_ready_in_time_and_larger_ones_refused() {
        let long = |k: usize| (0..150).map(|n| format!("{k}.{n}*x")).collect::<Vec<_>>().join(" + ");
        let chain = |k: usize| format!("d{}", k + 1);
        for text in [&long as &dyn Fn(usize) -> String, &chain] {
            let mut definitions: Vec<(String, String)> = (0..900).map(|k| (format!("d{k}"), text(k))).collect();
            definitions.push(("d900".into(), "2*x".into()));
            let mut system = duffing();
            system.definitions.extend(definitions);
            assert!(Equations::new(system.clone(), 1e-3).is_ok());
            system.definitions.extend((901..1_200).map(|k| (format!("d{k}"), "x".into())));
            let error = Equations::new(system, 1e-3).unwrap_err();
            assert!(error.message.contains("at most 1000 names"), "{error}");
        }
    }

    /// A mass on a spring that hardens: Duffing's oscillator.
    fn duffing() -> EquationSystem {
        let parameter = |(name, value): (&'static str, f64)| Parameter::new(name, "", value).known_to(0.1 * value);
        EquationSystem {
            states: vec![state("v", "m/s", 0.0), state("x", "m", 0.0)],
            inputs: vec![InputVariable { name: "u".into(), unit: "V".into(), interpolated: false }],
            parameters: [("d", 0.4), ("k", 9.0), ("k3", 20.0), ("m", 0.7)].map(parameter).to_vec(),
            definitions: vec![("spring".into(), "k*x + hard".into()), ("hard".into(), "k3*x^3".into())],
            rates: vec![("x".into(), "v".into()), ("v".into(), "(u - d*v - spring)/m".into())],
            outputs: vec![OutputVariable { name: "y".into(), unit: "m".into(), expression: "x".into() }],
            attach: Some(Attachment { position: "x".into(), velocity: "v".into(), inertia: "m".into() }),
            discrete: false,
        }
    }

    fn recording(rows: usize, interpolated: bool) -> Recording<Driving> {
        let time: Vec<f64> = (0..rows).map(|i| i as f64 * 0.02).collect();
        let commands: Vec<f64> = time.iter().map(|t| 3.0 * (2.0 * t).sin() + (5.0 * t).cos()).collect();
        let samples = time.iter().map(|t| Some(0.3 * (2.0 * t).sin())).collect();
        let measured = vec![Measured { channel: "y".into(), unit: "m".into(), samples }];
        Recording { name: "duffing".into(), stimulus: Driving::new(&time, &[(commands, interpolated)]), measured, time }
    }

    fn follow(system: EquationSystem, step: f64, theta: &[f64], recording: &Recording<Driving>) -> Vec<f64> {
        let assembly = Assembly::new(Equations::new(system, step).unwrap(), EQUATIONS_MECHANISMS);
        assembly.rollout(&Thetas::single(theta), recording, 0..recording.len(), Seed(0)).remove(0).remove(0).samples
    }

    #[test]
    fn the_plant_and_every_row_of_its_registry_keep_their_contracts() {
        let plant = Equations::new(duffing(), 5e-3).unwrap();
        check_plant(&plant, EQUATIONS_MECHANISMS, &recording(500, false)).unwrap();
        for mechanism in EQUATIONS_MECHANISMS {
            check_mechanism(*mechanism, &plant, EQUATIONS_MECHANISMS, &recording(500, false)).unwrap();
        }
    }

    struct Oscillator {
        recording: Recording<Driving>,
        interpolated: bool,
    }

    impl ODE<f64, [f64; 2]> for Oscillator {
        fn diff(&self, t: f64, y: &[f64; 2], dydt: &mut [f64; 2]) {
            let commands = self.recording.stimulus.as_ref();
            let row = ((t / 0.02).floor() as usize).min(commands.len() - 2);
            let share = if self.interpolated { t / 0.02 - row as f64 } else { 0.0 };
            let u = commands[row] + share * (commands[row + 1] - commands[row]);
            *dydt = [y[1], (u - 0.4 * y[1] - 9.0 * y[0] - 20.0 * y[0].powi(3)) / 0.7];
        }
    }

    /// Row by row, so that the solver meets no step of the command within one call.
    #[test]
    fn follows_the_equations_as_an_ode_solver_does() {
        for (interpolated, tolerance) in [(false, 1e-8), (true, 1e-5)] {
            let recording = recording(300, interpolated);
            let ours = follow(duffing(), 2.5e-3, &[0.4, 9.0, 20.0, 0.7, 0.1, 0.0], &recording);
            let ode = Oscillator { recording, interpolated };
            let mut y = [0.1, 0.0];
            for (row, ours) in ours.iter().enumerate().take(299) {
                assert!((ours - y[0]).abs() < tolerance, "row {row}: {ours} instead of {}", y[0]);
                let (from, to) = (row as f64 * 0.02 + 1e-12, (row + 1) as f64 * 0.02 - 1e-12);
                let method = ExplicitRungeKutta::dop853().rtol(1e-11).atol(1e-12);
                y = *IVP::ode(&ode, from, to, y).method(method).solve().unwrap().y.last().unwrap();
            }
        }
    }

    /// The joint's own equation, written down, with the joint's mechanisms: another integrator of the same physics.
    #[test]
    fn mechanisms_of_motion_act_as_on_a_joint() {
        let mut system = duffing();
        system.rates[1].1 = "(u - d*v - k*sin(x))/m".into();
        (system.states[0].unit, system.states[1].unit) = ("rad/s".into(), "rad".into());
        let plant = Equations::new(system, 1e-4).unwrap();
        let joint = Joint::new(Axis::Rotary, [0.7, 0.4, 9.0, 1.0], [0.1; 4]);
        let ours = recording(500, false);
        let stimulus = Commands(ours.stimulus.as_ref().to_vec());
        let theirs = Recording { name: String::new(), stimulus, measured: vec![], time: ours.time.clone() };
        for (name, value) in [("coulomb_friction", 0.8), ("quadratic_drag", 0.5), ("stiffness", 2.0), ("constant_load", 0.7)]
        {
            let of_joint = MECHANISMS.iter().find(|m| m.about().name == name).unwrap();
            let of_ours = EQUATIONS_MECHANISMS.iter().find(|m| m.about().name == name).unwrap();
            let form = |forms: Vec<crate::sim2real::Form>| forms[0].parameters.clone();
            let joint = Assembly::new(joint.clone(), MECHANISMS).with_mechanism(
                *of_joint,
                0,
                form(of_joint.forms(&Typical::default())),
            );
            let written = Assembly::new(plant.clone(), EQUATIONS_MECHANISMS).with_mechanism(
                *of_ours,
                0,
                form(of_ours.forms(&Typical::default())),
            );
            let joint = joint.stepping(1e-4).rollout(
                &Thetas::single(&[0.7, 0.4, 9.0, 1.0, value, 0.3, 0.0]),
                &theirs,
                0..500,
                Seed(0),
            );
            let thetas = Thetas::single(&[0.4, 9.0, 20.0, 0.7, value, 0.3, 0.0]);
            let written = written.rollout(&thetas, &ours, 0..500, Seed(0));
            let worst =
                joint[0][0].samples.iter().zip(&written[0][0].samples).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-4, "{name}: {worst} rad");
        }
    }

    /// A push below the friction moves nothing, to the bit; one above does.
    #[test]
    fn what_is_stuck_stays_stuck() {
        let mut system = duffing();
        system.rates[1].1 = "(u - d*v)/m".into();
        let friction = EQUATIONS_MECHANISMS.iter().find(|m| m.about().name == "coulomb_friction").unwrap();
        let parameters = friction.forms(&Typical::default())[0].parameters.clone();
        let plant = Equations::new(system, 5e-3).unwrap();
        let assembly = Assembly::new(plant, EQUATIONS_MECHANISMS).with_mechanism(*friction, 0, parameters);
        let recording = recording(400, false);
        let lanes = [[0.4, 9.0, 20.0, 0.7, 4.5, 0.123, 0.0], [0.4, 9.0, 20.0, 0.7, 0.5, 0.123, 0.0]];
        let both = assembly.rollout(&Thetas::from_lanes(&lanes), &recording, 0..400, Seed(0));
        assert!(both[0][0].samples.iter().all(|x| *x == 0.123));
        assert!(both[1][0].samples[100] > 0.2);
    }

    #[test]
    fn equations_from_row_to_row_take_one_step_a_row() {
        let mut system = duffing();
        (system.discrete, system.attach) = (true, None);
        system.rates = vec![("x".into(), "0.5*x + u".into()), ("v".into(), "x".into())];
        system.outputs[0].expression = "x - v".into();
        let recording = recording(100, false);
        let ours = follow(system, 1e-3, &[0.4, 9.0, 20.0, 0.7, 0.0, 2.0], &recording);
        let (mut x, mut v) = (2.0, 0.0);
        for (row, ours) in ours.iter().enumerate() {
            assert_eq!(*ours, x - v);
            (x, v) = (0.5 * x + recording.stimulus.as_ref()[row], x);
        }
    }

    /// A second input, measured, is taken as it is, straight from row to row where it is said to.
    #[test]
    fn other_inputs_are_taken_as_measured() {
        let mut system = duffing();
        system.inputs.push(InputVariable { name: "w".into(), unit: String::new(), interpolated: true });
        (system.attach, system.rates) = (None, vec![("x".into(), "w".into()), ("v".into(), "t*0 + 1".into())]);
        let time: Vec<f64> = (0..100).map(|i| f64::from(i) * 0.1).collect();
        let columns = [(vec![0.0; 100], false), (time.clone(), true)];
        let recording = Recording { name: String::new(), stimulus: Driving::new(&time, &columns), measured: vec![], time };
        let ours = follow(system, 0.05, &[0.4, 9.0, 20.0, 0.7, 0.0, 0.0], &recording);
        for (x, t) in ours.iter().zip(&recording.time) {
            assert!((x - 0.5 * t * t).abs() < 1e-12);
        }
    }

    #[test]
    fn what_cannot_be_is_told_with_its_place() {
        let told = |change: &dyn Fn(&mut EquationSystem)| {
            let mut system = duffing();
            change(&mut system);
            let error = Equations::new(system, 1e-3).unwrap_err();
            let unknown = error.unknown.map(|(word, _)| format!(" ({word})")).unwrap_or_default();
            format!("{}: {}{unknown}\n  hint: {}", error.place.join("."), error.message, error.hint.unwrap_or_default())
        };
        let changes: [&dyn Fn(&mut EquationSystem); 17] = [
            &|s| s.states[0].name = "sin".into(),
            &|s| s.states[0].name = "2x".into(),
            &|s| s.parameters[0].name = "x".into(),
            &|s| s.states.clear(),
            &|s| s.inputs.clear(),
            &|s| s.outputs.clear(),
            &|s| s.rates.truncate(1),
            &|s| s.rates[0].0 = "y".into(),
            &|s| s.rates[1].1 = "(u - dd*v)/m".into(),
            &|s| s.rates[1].1 = "(u - d*v/m".into(),
            &|s| s.definitions[1].1 = "spring*x".into(),
            &|s| s.definitions[1].1 = "q*x".into(),
            &|s| s.outputs[0].expression = "x + u".into(),
            &|s| s.attach.as_mut().unwrap().position = "q".into(),
            &|s| s.attach.as_mut().unwrap().velocity = "x".into(),
            &|s| s.attach.as_mut().unwrap().inertia = "m*x".into(),
            &|s| s.discrete = true,
        ];
        insta::assert_snapshot!(changes.map(told).join("\n"));
    }

    #[test]
    fn what_is_not_finite_at_the_start_is_found() {
        let of = |rate: &str, output: &str| {
            let mut system = duffing();
            system.rates[1].1 = rate.into();
            system.outputs[0].expression = output.into();
            Equations::new(system, 1e-3).unwrap().not_finite_at_start(&[1.0])
        };
        assert_eq!(of("u/x", "x").as_deref(), Some("v"));
        assert_eq!(of("u", "sqrt(x - 1)").as_deref(), Some("y"));
        assert_eq!(of("u", "x"), None);
    }

    #[test]
    fn units_of_mechanisms_follow_from_what_moves() {
        let of = |position: &str, velocity: &str, declared: &str| {
            let mut system = duffing();
            (system.states[0].unit, system.states[1].unit) = (velocity.into(), position.into());
            Equations::new(system, 1e-3).unwrap().unit(declared)
        };
        assert_eq!(of("m", "m/s", "N m"), "N");
        assert_eq!(of("rad", "rad/s", "N m s/rad"), "N m s/rad");
        assert_eq!(of("V", "V/s", "N m"), "V/s/s");
        assert_eq!(of("V", "", "N m/rad"), "(V/s/s)/V");
        assert_eq!(of("V", "V/s", "command"), "V");
    }
}
