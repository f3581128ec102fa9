//! Twins of the model `equations`.

use std::path::PathBuf;

use super::{Columns, Seen, check_model, median_spacing, read};
use crate::io::{InputError, TwinFile, hint_among};
use crate::robot::{
    Attachment, Driving, EQUATIONS_MECHANISMS, EquationError, EquationSystem, Equations, InputVariable, OutputVariable,
    StateVariable,
};
use crate::sim2real::{Assembly, Parameter, Recording};

/// Steps of integration between two rows, where the twin does not say how long a step is. An oscillation that is sampled
/// ten times a period is then right to a part in 10^5 a period.
const STEPS: f64 = 4.0;
/// Longest step [s] where mechanisms of motion act: friction that creeps relaxes within some 10 ms.
const LONGEST_MOVING: f64 = 5e-3;

/// The equations of a twin, with what it models already; `recordings` are those it is held to, whose distance of rows says
/// how finely it is integrated where the twin does not.
///
/// # Errors
/// A twin of another model; what [`Equations::new`] refuses; units that clash; equations that give no finite number where
/// they start; mechanisms the registry does not know.
pub fn equations_assembly(twin: &TwinFile, recordings: &[Recording<Driving>]) -> Result<Assembly<Equations>, InputError> {
    check_model(twin, "equations")?;
    let system = system(twin);
    check_units(twin, &system)?;
    if let (true, Some(step)) = (system.discrete, twin.step) {
        let error = twin.error(&["twin", "step"], "equations from row to row are not integrated").found(step);
        return Err(error.hint("leave `step` out, or give [derivatives] instead of [next]"));
    }
    let spacing = median_spacing(recordings.iter().map(|r| r.time.as_slice())).unwrap_or(STEPS * LONGEST_MOVING);
    let longest = if system.attach.is_some() { LONGEST_MOVING } else { f64::INFINITY };
    let step = twin.step.unwrap_or((spacing / STEPS).min(longest));
    let equations = Equations::new(system, step).map_err(|error| explained(twin, error))?;
    check_start(twin, &equations, recordings)?;
    super::assembly(twin, equations, EQUATIONS_MECHANISMS)
}

fn system(twin: &TwinFile) -> EquationSystem {
    let sections = &twin.equations;
    let unit = |unit: &Option<String>| unit.clone().unwrap_or_default();
    let parameter = |(name, quantity): (&String, &crate::io::Quantity)| {
        Parameter::named(name.clone(), unit(&quantity.unit), quantity.value).known_to(quantity.std())
    };
    let mut inputs: Vec<_> = sections.inputs.iter().collect();
    inputs.sort_by_key(|(_, entry)| !entry.command);
    let input = |(name, entry): &(String, crate::io::InputEntry)| InputVariable {
        name: name.clone(),
        unit: unit(&entry.unit),
        interpolated: entry.interpolated,
    };
    let state = |(name, entry): &(String, crate::io::StateEntry)| StateVariable {
        name: name.clone(),
        unit: unit(&entry.unit),
        initial: entry.initial,
        std: entry.std,
    };
    let output = |(name, entry): &(String, crate::io::OutputEntry)| OutputVariable {
        name: name.clone(),
        unit: unit(&entry.unit),
        expression: entry.expression.clone(),
    };
    let discrete = !sections.next.is_empty();
    EquationSystem {
        states: sections.states.iter().map(state).collect(),
        inputs: inputs.into_iter().map(input).collect(),
        parameters: twin.parameters.iter().map(parameter).collect(),
        definitions: sections.definitions.clone(),
        rates: if discrete { sections.next.clone() } else { sections.derivatives.clone() },
        discrete,
        outputs: sections.outputs.iter().map(output).collect(),
        attach: sections.attach.as_ref().map(|attach| Attachment {
            position: attach.position.clone(),
            velocity: attach.velocity.clone(),
            inertia: attach.inertia.clone(),
        }),
    }
}

/// Holds states that are said to be the same, or one the derivative of the other, to have units that are too.
fn check_units(twin: &TwinFile, system: &EquationSystem) -> Result<(), InputError> {
    let of = |name: &str| system.states.iter().find(|s| s.name == name.trim()).map(|s| s.unit.as_str());
    let given = |unit: Option<&str>| unit.filter(|unit| !unit.is_empty()).map(str::to_owned);
    if !system.discrete {
        for (name, rate) in &system.rates {
            if let (Some(own), Some(rate)) = (given(of(name)), given(of(rate))) {
                twin.check_unit(&["derivatives", name], Some(&rate), &format!("{own}/s"))?;
            }
        }
    }
    for output in &system.outputs {
        if let (Some(own), Some(state)) = (given(Some(&output.unit)), given(of(&output.expression))) {
            twin.check_unit(&["outputs", &output.name, "unit"], Some(&own), &state)?;
        }
    }
    Ok(())
}

/// Holds the equations to give finite numbers where they start.
fn check_start(twin: &TwinFile, equations: &Equations, recordings: &[Recording<Driving>]) -> Result<(), InputError> {
    let inputs = recordings.first().map_or_else(Vec::new, |recording| recording.stimulus.first_row());
    let Some(name) = equations.not_finite_at_start(&inputs) else { return Ok(()) };
    let section = match () {
        () if !equations.system().states.iter().any(|s| s.name == name) => "outputs",
        () if equations.system().discrete => "next",
        () => "derivatives",
    };
    Err(twin
        .error(&[section, &name], format!("`{name}` is no finite number where the twin starts"))
        .hint("does it divide by 0, or take the root of less? See the initial values of [states] and [parameters]"))
}

/// The error with its place in the document.
fn explained(twin: &TwinFile, error: EquationError) -> InputError {
    let keys: Vec<&str> = error.place.iter().map(String::as_str).collect();
    let hint = error.unknown.as_ref().and_then(|(word, known)| hint_among(word, known));
    twin.error(&keys, error.message).maybe_hint(error.hint).maybe_hint(hint)
}

/// The recordings at `paths`, their columns as the twin's inputs and outputs say.
///
/// # Errors
/// Channels, which equations do not have, and what [`read_trajectory`](crate::io::read_trajectory) refuses; a recording too
/// short to tell anything.
pub fn equations_recordings(twin: &TwinFile, paths: &[PathBuf]) -> Result<Vec<Recording<Driving>>, InputError> {
    if let Some(name) = twin.channels.keys().next() {
        let error = twin.error(&["channels", name], "equations have no section [channels]");
        return Err(error.hint("name the columns in [inputs] and [outputs]"));
    }
    let sections = &twin.equations;
    let mut inputs: Vec<_> = sections.inputs.iter().collect();
    inputs.sort_by_key(|(_, entry)| !entry.command);
    let seen = |(name, entry): &(String, crate::io::OutputEntry)| Seen {
        name: name.clone(),
        unit: entry.unit.clone().unwrap_or_default(),
        column: entry.column.clone(),
    };
    let columns = Columns {
        driving: inputs.iter().map(|(name, entry)| (name.clone(), entry.column.clone())).collect(),
        seen: sections.outputs.iter().map(seen).collect(),
        longest_spacing: None,
    };
    let one = |path: &PathBuf| {
        let samples = read(path, &columns)?;
        let driving: Vec<(Vec<f64>, bool)> =
            samples.driving.into_iter().zip(&inputs).map(|(values, (_, entry))| (values, entry.interpolated)).collect();
        let stimulus = Driving::new(&samples.time, &driving);
        Ok(Recording { name: samples.name, stimulus, measured: samples.measured, time: samples.time })
    };
    paths.iter().map(one).collect()
}
