//! Equations as a user gives them, and what is wrong with them.

use std::collections::{BTreeSet, HashMap, HashSet};

use super::expression::{Expression, is_name, reserved};
use super::program::Program;
use crate::sim2real::{Channel, Parameter};

/// A plant as equations, in the names of its states, inputs and parameters.
///
/// Expressions are arithmetic with `+ - * / ^`, parentheses, the functions `sin cos tan asin acos atan sinh cosh tanh exp
/// ln log10 sqrt abs floor sign step` of one number (`step(x)` is 1 where `x > 0`, 0 elsewhere), `min max atan2 hypot` of
/// two, `pi`, and the time `t` [s].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EquationSystem {
    /// What the plant remembers.
    pub states: Vec<StateVariable>,
    /// What drives it: the first is the command, on which mechanisms of commands act; the others are taken as measured.
    pub inputs: Vec<InputVariable>,
    /// Its parameters, with their values as they are today.
    pub parameters: Vec<Parameter>,
    /// Names for expressions that others use: name and expression, in any order.
    pub definitions: Vec<(String, String)>,
    /// What follows from state and inputs: of each state its derivative [unit of the state/s], or its value in the next row.
    pub rates: Vec<(String, String)>,
    /// Whether `rates` are values in the next row, and not derivatives.
    pub discrete: bool,
    /// What is seen of it, in the order of its channels: depends on states and parameters.
    pub outputs: Vec<OutputVariable>,
    /// Where mechanisms of motion act, if anywhere.
    pub attach: Option<Attachment>,
}

/// A state of an [`EquationSystem`].
#[derive(Debug, Clone, PartialEq)]
pub struct StateVariable {
    /// Name.
    pub name: String,
    /// Unit; empty where none is known.
    pub unit: String,
    /// Its value where a recording starts, as far as measurements do not tell.
    pub initial: f64,
    /// Standard deviation of `initial`, in its unit; 0 for known exactly, none for unknown.
    pub std: Option<f64>,
}

/// An input of an [`EquationSystem`].
#[derive(Debug, Clone, PartialEq)]
pub struct InputVariable {
    /// Name.
    pub name: String,
    /// Unit; empty where none is known.
    pub unit: String,
    /// Whether it goes straight from row to row; else it holds.
    pub interpolated: bool,
}

/// An output of an [`EquationSystem`].
#[derive(Debug, Clone, PartialEq)]
pub struct OutputVariable {
    /// Name of the channel.
    pub name: String,
    /// Unit; empty where none is known.
    pub unit: String,
    /// Its expression.
    pub expression: String,
}

/// Where mechanisms of motion act: on a state that is a position, and on one that is its derivative.
#[derive(Debug, Clone, PartialEq)]
pub struct Attachment {
    /// The state that is a position.
    pub position: String,
    /// The state that is its velocity: efforts are added to its derivative, divided by the inertia.
    pub velocity: String,
    /// Inertia, an expression of parameters.
    pub inertia: String,
}

/// What is wrong with equations.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct EquationError {
    /// Where: the field of the system as a document calls it, then the name (`derivatives`, `v`).
    pub place: Vec<String>,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub hint: Option<String>,
    /// A word that is none of these names, where that is what is wrong.
    pub unknown: Option<(String, Vec<String>)>,
}

impl EquationError {
    fn at(place: &[&str], message: impl Into<String>) -> Self {
        let place = place.iter().map(|key| (*key).to_owned()).collect();
        Self { place, message: message.into(), hint: None, unknown: None }
    }

    fn hint(self, hint: impl Into<String>) -> Self {
        Self { hint: Some(hint.into()), ..self }
    }

    fn unknown<'a>(self, word: &str, known: impl IntoIterator<Item = &'a String>) -> Self {
        Self { unknown: Some((word.to_owned(), known.into_iter().cloned().collect())), ..self }
    }
}

/// Equations made ready to be run.
#[derive(Debug)]
pub(super) struct Model {
    pub system: EquationSystem,
    pub channels: Vec<Channel>,
    /// What follows from state and inputs, in the order of the states.
    pub rates: Program,
    /// What is seen, in the order of the channels.
    pub seen: Program,
    pub moving: Option<Moving>,
    /// Of each state, the channel that shows it as it is, and whether that is its own or one it is the derivative of.
    pub shown: Vec<Option<Shown>>,
}

/// Where mechanisms of motion act, by number of the states.
#[derive(Debug)]
pub(super) struct Moving {
    pub position: usize,
    pub velocity: usize,
    /// Inertia, from the parameters.
    pub inertia: Program,
}

/// How a state can be read off a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shown {
    /// It is this channel.
    Value(usize),
    /// It is the rate of change of this channel.
    Rate(usize),
}

impl Model {
    /// Slot of the time in `rates`: after the parameters.
    pub fn time_slot(&self) -> usize {
        self.system.parameters.len()
    }

    /// Slot of input `k` in `rates`.
    pub fn input_slot(&self, k: usize) -> usize {
        self.time_slot() + 1 + k
    }

    /// Slot of state `k` in `rates`.
    pub fn state_slot(&self, k: usize) -> usize {
        self.input_slot(self.system.inputs.len()) + k
    }

    /// Slot of state `k` in `seen`.
    pub fn seen_slot(&self, k: usize) -> usize {
        self.system.parameters.len() + k
    }

    /// Makes `system` ready.
    pub fn new(mut system: EquationSystem) -> Result<Self, EquationError> {
        check_names(&system)?;
        // What moves stands first among the states, which by themselves do not know which they are.
        if let Some(attach) = &system.attach {
            system.states.sort_by_key(|s| (s.name != attach.position, s.name != attach.velocity));
        }
        let section = if system.discrete { "next" } else { "derivatives" };
        let state_names: Vec<String> = system.states.iter().map(|s| s.name.clone()).collect();
        let input_names: Vec<String> = system.inputs.iter().map(|i| i.name.clone()).collect();
        let parameters: Vec<String> = system.parameters.iter().map(|p| p.name.clone().into_owned()).collect();
        if let Some((name, _)) = system.rates.iter().find(|(name, _)| !state_names.contains(name)) {
            let error = EquationError::at(&[section, name], format!("there is no state `{name}`"));
            return Err(error.unknown(name, &state_names));
        }
        let mut rates = Vec::new();
        for name in &state_names {
            let Some((_, text)) = system.rates.iter().find(|(own, _)| own == name) else {
                let error = EquationError::at(&[section], format!("the state `{name}` has no equation"));
                return Err(error.hint(format!("{name} = \"...\" in [{section}] says how it goes on")));
            };
            rates.push((name.as_str(), parse(&[section, name], text)?));
        }
        let definitions = definitions(&system)?;
        let all: Vec<String> = [String::from("t")].into_iter().chain(input_names).chain(state_names.clone()).collect();
        let rate_program = compile(section, &parameters, &all, &definitions, &rates)?;
        let mut outputs = Vec::new();
        for output in &system.outputs {
            outputs.push((output.name.as_str(), parse(&["outputs", &output.name], &output.expression)?));
        }
        let seen = check_seen(&system, &definitions, &outputs)
            .and_then(|used| compile("outputs", &parameters, &state_names, &used, &outputs))?;
        let moving = system.attach.as_ref().map(|a| moving(a, &system, &rates, &parameters, &definitions)).transpose()?;
        let shown = state_names.iter().map(|name| shown(name, &rates, &outputs)).collect();
        let channel = |output: &OutputVariable| Channel {
            name: output.name.clone().into(),
            unit: output.unit.clone().into(),
            exact: false,
        };
        let channels = system.outputs.iter().map(channel).collect();
        Ok(Self { channels, rates: rate_program, seen, moving, shown, system })
    }
}

/// Most names that a system may have: more is no plant that anybody writes down, and would take long to make ready.
const MOST_NAMES: usize = 1_000;

/// Holds names to be names, each to stand for one thing, and the system to have something to follow.
fn check_names(system: &EquationSystem) -> Result<(), EquationError> {
    let states = system.states.iter().map(|s| ("states", s.name.as_str()));
    let inputs = system.inputs.iter().map(|i| ("inputs", i.name.as_str()));
    let parameters = system.parameters.iter().map(|p| ("parameters", p.name.as_ref()));
    let definitions = system.definitions.iter().map(|(name, _)| ("definitions", name.as_str()));
    let all: Vec<(&str, &str)> = states.chain(inputs).chain(parameters).chain(definitions).collect();
    if let Some((section, name)) = all.get(MOST_NAMES) {
        let message = format!("expected at most {MOST_NAMES} names of states, inputs, parameters and definitions");
        let error = EquationError::at(&[section, name], format!("{message}, found {}", all.len()));
        return Err(error.hint("join definitions that are used once"));
    }
    for (k, (section, name)) in all.iter().enumerate() {
        if !is_name(name) {
            let error = EquationError::at(&[section, name], format!("`{name}` cannot stand in an expression"));
            return Err(error.hint("names are letters, digits and `_`, and do not begin with a digit"));
        }
        if reserved(name) {
            let error = EquationError::at(&[section, name], format!("`{name}` has a meaning of its own in expressions"));
            return Err(error.hint("it is a function, a constant or the time: choose another name"));
        }
        if let Some((first, _)) = all[..k].iter().find(|(_, other)| other == name) {
            let error = EquationError::at(&[section, name], format!("`{name}` stands in [{first}] too"));
            return Err(error.hint("a name stands for one thing: rename one of the two"));
        }
    }
    let missing = |section: &str, hint: &str| {
        Err(EquationError::at(&[section], format!("expected at least one of [{section}]")).hint(hint))
    };
    if system.states.is_empty() {
        return missing("states", "x = { initial = 0.0, unit = \"m\" }");
    }
    if system.inputs.is_empty() {
        return missing("inputs", "u = { column = \"...\" } says which column drives the plant");
    }
    if system.outputs.is_empty() {
        return missing("outputs", "y = { expression = \"x\", column = \"...\" } says what a recording shows");
    }
    Ok(())
}

fn parse(place: &[&str], text: &str) -> Result<Expression, EquationError> {
    Expression::parse(text).map_err(|error| EquationError::at(place, error.message).hint(error.hint))
}

/// The definitions in an order in which each uses only those before it.
fn definitions(system: &EquationSystem) -> Result<Vec<(String, Expression)>, EquationError> {
    let mut parsed = Vec::new();
    for (name, text) in &system.definitions {
        parsed.push((name.clone(), parse(&["definitions", name], text)?));
    }
    let numbers: HashMap<&str, usize> = parsed.iter().enumerate().map(|(k, (name, _))| (name.as_str(), k)).collect();
    // Of each, the definitions that it waits for.
    let mut needs: Vec<HashSet<usize>> = parsed
        .iter()
        .map(|(_, expression)| expression.names().into_iter().filter_map(|name| numbers.get(name).copied()).collect())
        .collect();
    let mut waiting: BTreeSet<usize> = (0..parsed.len()).collect();
    let mut ordered = Vec::new();
    while let Some(first) = waiting.first() {
        let Some(next) = waiting.iter().copied().find(|k| needs[*k].is_empty()) else {
            let names: Vec<&str> = waiting.iter().map(|k| parsed[*k].0.as_str()).collect();
            let circle = names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
            let error =
                EquationError::at(&["definitions", &parsed[*first].0], format!("{circle} are defined by one another"));
            return Err(error.hint("a definition may use those that do not need it; what remembers is a state"));
        };
        waiting.remove(&next);
        for needed in &mut needs {
            needed.remove(&next);
        }
        ordered.push(parsed[next].clone());
    }
    Ok(ordered)
}

/// A program of `expressions`, which are names and expressions of `section`.
fn compile(
    section: &str,
    fixed: &[String],
    varying: &[String],
    definitions: &[(String, Expression)],
    expressions: &[(&str, Expression)],
) -> Result<Program, EquationError> {
    let all = || fixed.iter().chain(varying).chain(definitions.iter().map(|(name, _)| name));
    let known: HashSet<&str> = all().map(String::as_str).collect();
    let in_definitions = definitions.iter().map(|(name, expression)| ("definitions", name.as_str(), expression));
    let in_section = expressions.iter().map(|(name, expression)| (section, *name, expression));
    for (section, own, expression) in in_definitions.chain(in_section) {
        if let Some(unknown) = expression.names().into_iter().find(|name| !known.contains(name)) {
            let error = EquationError::at(&[section, own], format!("nothing is called `{unknown}`"));
            return Err(error.unknown(unknown, all()));
        }
    }
    let bodies: Vec<&Expression> = expressions.iter().map(|(_, expression)| expression).collect();
    Program::compile(fixed, varying, definitions, &bodies)
        .map_err(|unknown| EquationError::at(&[section], format!("nothing is called `{unknown}`")))
}

/// Holds outputs to be seen without regard to inputs and time; gives the definitions they use.
fn check_seen(
    system: &EquationSystem,
    definitions: &[(String, Expression)],
    outputs: &[(&str, Expression)],
) -> Result<Vec<(String, Expression)>, EquationError> {
    // What outputs may not use: inputs, the time, and the definitions that these drive.
    let mut driven: HashSet<&str> = system.inputs.iter().map(|input| input.name.as_str()).chain(["t"]).collect();
    for (name, expression) in definitions {
        if expression.names().iter().any(|own| driven.contains(own)) {
            driven.insert(name);
        }
    }
    for (name, expression) in outputs {
        if let Some(found) = expression.names().into_iter().find(|own| driven.contains(own)) {
            let error = EquationError::at(&["outputs", name], format!("an output cannot depend on `{found}`"));
            return Err(error.hint("a row is observed before its inputs have acted: outputs are of states and parameters"));
        }
    }
    Ok(definitions.iter().filter(|(name, _)| !driven.contains(name.as_str())).cloned().collect())
}

fn moving(
    attach: &Attachment,
    system: &EquationSystem,
    rates: &[(&str, Expression)],
    parameters: &[String],
    definitions: &[(String, Expression)],
) -> Result<Moving, EquationError> {
    if system.discrete {
        let error = EquationError::at(&["attach"], "there is no effort in equations from row to row");
        return Err(error.hint("give derivatives instead of [next], or leave [attach] out"));
    }
    let names: Vec<String> = system.states.iter().map(|s| s.name.clone()).collect();
    let state = |key: &str, name: &str| {
        names
            .iter()
            .position(|own| own == name)
            .ok_or_else(|| EquationError::at(&["attach", key], format!("there is no state `{name}`")).unknown(name, &names))
    };
    let (position, velocity) = (state("position", &attach.position)?, state("velocity", &attach.velocity)?);
    if rates[position].1 != Expression::Name(attach.velocity.clone()) {
        let message = format!("the derivative of `{}` is not `{}`", attach.position, attach.velocity);
        let hint = format!("{} = \"{}\" in [derivatives]: mechanisms act on velocities", attach.position, attach.velocity);
        return Err(EquationError::at(&["attach", "velocity"], message).hint(hint));
    }
    let inertia = parse(&["attach", "inertia"], &attach.inertia)?;
    // Of the definitions, those that depend on parameters alone.
    let mut lasting: Vec<(String, Expression)> = Vec::new();
    let mut known: HashSet<&str> = parameters.iter().map(String::as_str).collect();
    for (name, expression) in definitions {
        if expression.names().iter().all(|own| known.contains(own)) {
            known.insert(name);
            lasting.push((name.clone(), expression.clone()));
        }
    }
    let inertia = compile("attach", parameters, &[], &lasting, &[("inertia", inertia)])
        .map_err(|error| error.hint("the inertia is an expression of parameters"))?;
    Ok(Moving { position, velocity, inertia })
}

/// The channel that shows the state `name`, or the one it is the rate of.
fn shown(name: &str, rates: &[(&str, Expression)], outputs: &[(&str, Expression)]) -> Option<Shown> {
    let is = |expression: &Expression, name: &str| matches!(expression, Expression::Name(own) if own == name);
    let channel = |name: &str| outputs.iter().position(|(_, expression)| is(expression, name));
    if let Some(own) = channel(name) {
        return Some(Shown::Value(own));
    }
    rates.iter().filter(|(_, rate)| is(rate, name)).find_map(|(integral, _)| channel(integral)).map(Shown::Rate)
}
