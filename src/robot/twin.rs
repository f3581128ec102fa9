//! Twins of robots: what a simulator is told today, and the recordings it is held to. What is the same for every plant that
//! is sampled stands here, the rest in a file for each.

mod cart_pole;
mod equations;
mod joint;
#[cfg(test)]
mod randomized;
mod tanks;
mod unread;

use std::path::Path;

use super::Commands;
use crate::io::{
    ChannelEntry, ControllerEntry, ControllerKind, InputError, Need, Quantity, TIME_COLUMN, TrajectoryTable, TwinFile,
    hint_among, listed_mechanism, read_trajectory, unit_told,
};
use crate::sim2real::{Assembly, Measured, Parameter, Pid, Plant, Recording, Registry};

pub use cart_pole::{cart_pole_assembly, cart_pole_recordings};
pub use equations::{equations_assembly, equations_recordings};
pub use joint::{joint_assembly, joint_recordings};
pub use tanks::{tanks_assembly, tanks_recordings};
pub use unread::unread_columns;

/// Rows a recording needs at the least: fewer say nothing about noise, let alone about what is missing.
const FEWEST_ROWS: usize = 100;
/// Longest median distance of rows of what moves [s]: a servo that is sampled more slowly than this cannot be followed, and
/// a time in milliseconds looks like it.
const LONGEST_SPACING: f64 = 0.5;
/// A distance of rows this many times the median is a gap, over which no motion can be followed.
const GAP: f64 = 1_000.0;
/// Positions, velocities and commands are less than this in any unit of theirs.
const LARGEST: f64 = 1e9;

/// What a parameter of a plant must be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Must {
    BePositive,
    NotBeNegative,
    NotBeZero,
}

/// A parameter that a plant has.
#[derive(Debug, Clone)]
struct Wanted {
    name: &'static str,
    unit: String,
    must: Option<Must>,
    /// The value, known exactly, where the twin does not say.
    default: Option<f64>,
}

/// Values and relative uncertainties of the parameters `wanted` of the twin, in their order; `plant` is what it is in a
/// sentence ("a joint").
fn parameters<const N: usize>(
    twin: &TwinFile,
    plant: &str,
    wanted: &[Wanted; N],
) -> Result<([f64; N], [f64; N]), InputError> {
    let known = wanted.each_ref().map(|wanted| wanted.name);
    if let Some(unknown) = twin.parameters.keys().find(|name| !known.contains(&name.as_str())) {
        let error = twin.error(&["parameters", unknown], format!("{plant} has no parameter `{unknown}`"));
        return Err(error.maybe_hint(hint_among(unknown, &known)));
    }
    let (mut values, mut uncertainty) = ([0.0; N], [0.0; N]);
    for (k, wanted) in wanted.iter().enumerate() {
        let quantity = parameter(twin, wanted)?;
        (values[k], uncertainty[k]) = (quantity.value, quantity.uncertainty);
    }
    Ok((values, uncertainty))
}

fn parameter(twin: &TwinFile, wanted: &Wanted) -> Result<Quantity, InputError> {
    let Wanted { name, unit, must, default } = wanted;
    let Some(quantity) = twin.parameters.get(*name) else {
        let exactly = |value| Quantity { value, unit: None, uncertainty: 0.0 };
        return default.map(exactly).ok_or_else(|| {
            twin.error(&["parameters"], format!("the parameter `{name}` is missing"))
                .hint(format!("{name} = {{ value = ..., unit = \"{unit}\", uncertainty = 0.2 }}"))
        });
    };
    twin.check_unit(&["parameters", name], quantity.unit.as_deref(), unit)?;
    let wrong = match must {
        Some(Must::BePositive) if quantity.value <= 0.0 => "above 0",
        Some(Must::NotBeNegative) if quantity.value < 0.0 => "of at least 0",
        Some(Must::NotBeZero) if quantity.value == 0.0 => "other than 0",
        _ => return Ok(quantity.clone()),
    };
    let error = twin.error(&["parameters", name], format!("expected a value of `{name}` {wrong}"));
    Err(error.found(quantity.value).hint(unit_told(unit)))
}

/// The plant with the mechanisms that the twin lists.
pub(super) fn assembly<P: Plant>(twin: &TwinFile, plant: P, registry: Registry<P>) -> Result<Assembly<P>, InputError>
where
    P::Command: AsMut<f64>,
{
    let mut assembly = Assembly::new(plant.clone(), registry);
    if let Some(controller) = &twin.controller {
        assembly = assembly.controlled_by(pid(controller));
    }
    for (index, entry) in twin.mechanisms.iter().enumerate() {
        let (mechanism, form, parameters) = listed_mechanism(twin.document(), index, entry, &plant, registry)?;
        assembly = assembly.with_mechanism(mechanism, form, parameters);
    }
    Ok(assembly)
}

/// The controller of a twin.
fn pid(entry: &ControllerEntry) -> Pid {
    let parameter = |(key, quantity): (&'static str, &Quantity)| {
        let unit = quantity.unit.clone().unwrap_or_default();
        let parameter = Parameter::named(key, unit, quantity.value).known_to(quantity.std());
        // A limit below 0 is none.
        if key == "limit" { parameter.within(1e-3 * quantity.value, f64::INFINITY) } else { parameter }
    };
    let ControllerKind::Pid = entry.kind;
    let mut pid = Pid::new(entry.parameters().into_iter().map(parameter));
    (pid.period, pid.derivative) = (entry.period, entry.derivative);
    pid
}

/// Holds the twin to be of the model `name`.
fn check_model(twin: &TwinFile, name: &str) -> Result<(), InputError> {
    if twin.model == name {
        return Ok(());
    }
    Err(twin.error(&["twin", "model"], format!("expected the model \"{name}\"")).found_text(&twin.model))
}

/// Refuses a step of integration for a plant that has its own.
fn check_no_step(twin: &TwinFile) -> Result<(), InputError> {
    match twin.step {
        None => Ok(()),
        Some(step) => Err(twin
            .error(&["twin", "step"], format!("`{}` is integrated at 1 ms and finer", twin.model))
            .found(step)
            .hint("leave `step` out: it is for models whose rows may be seconds apart")),
    }
}

/// Holds the twin's channels to be among `known`; `plant` is what it is in a sentence ("a joint").
fn check_channels(twin: &TwinFile, plant: &str, known: &[&str]) -> Result<(), InputError> {
    match twin.channels.keys().find(|name| !known.contains(&name.as_str())) {
        None => Ok(()),
        Some(unknown) => {
            let error = twin.error(&["channels", unknown], format!("{plant} has no channel `{unknown}`"));
            Err(error.maybe_hint(hint_among(unknown, known)))
        }
    }
}

fn channel<'a>(twin: &'a TwinFile, name: &str) -> Result<&'a ChannelEntry, InputError> {
    twin.channels.get(name).ok_or_else(|| {
        twin.error(&["channels"], format!("the channel `{name}` is missing"))
            .hint(format!("{name} = {{ column = \"...\" }} says which column of a recording it is"))
    })
}

/// A channel that is seen: its name, the unit of its samples, its column.
#[derive(Debug, Clone)]
struct Seen {
    name: String,
    unit: String,
    column: String,
}

/// The channels of `units`, which are names and units, that the twin names, each held to its unit.
fn seen(twin: &TwinFile, units: &[(&str, &str)]) -> Result<Vec<Seen>, InputError> {
    let mut seen = Vec::new();
    for (name, unit) in units {
        let Some(entry) = twin.channels.get(*name) else { continue };
        twin.check_unit(&["channels", name, "unit"], entry.unit.as_deref(), unit)?;
        seen.push(Seen { name: (*name).to_owned(), unit: (*unit).to_owned(), column: entry.column.clone() });
    }
    Ok(seen)
}

/// What a recording is read for.
#[derive(Debug, Clone)]
struct Columns {
    /// What drives the plant, in every row: what it is called, and its column.
    driving: Vec<(String, String)>,
    /// What is seen of it.
    seen: Vec<Seen>,
    /// Longest median distance of rows [s], where there is one that cannot be.
    longest_spacing: Option<f64>,
}

/// A recording as it was read.
#[derive(Debug)]
struct Samples {
    name: String,
    time: Vec<f64>,
    driving: Vec<Vec<f64>>,
    measured: Vec<Measured>,
}

impl Samples {
    /// The recording of a plant that nothing drives but its command.
    fn commanded(mut self) -> Recording<Commands> {
        let commands = if self.driving.is_empty() { Vec::new() } else { self.driving.swap_remove(0) };
        Recording { name: self.name, stimulus: Commands(commands), measured: self.measured, time: self.time }
    }
}

/// Reads the recording at `path`.
///
/// # Errors
/// What [`read_trajectory`] refuses; a recording too short to tell anything; times and values that cannot be.
fn read(path: &Path, columns: &Columns) -> Result<Samples, InputError> {
    let driving = columns.driving.iter().map(|(role, column)| (role.as_str(), column.as_str(), Need::EveryRow));
    let seen = columns.seen.iter().map(|seen| (seen.name.as_str(), seen.column.as_str(), Need::SomeRows));
    let roles: Vec<(&str, &str, Need)> = driving.chain(seen).collect();
    let table = read_trajectory(path, &roles)?;
    if table.time.len() < FEWEST_ROWS {
        return Err(InputError::new(table.table.path(), format!("expected at least {FEWEST_ROWS} rows"))
            .found(table.time.len())
            .hint("record for longer: a diagnosis fits on one stretch and proves on another"));
    }
    check_spacing(&table, columns.longest_spacing)?;
    for (role, column, _) in &roles {
        let values = table.column(role).unwrap_or_default();
        if let Some(row) = values.iter().position(|v| v.is_some_and(|v| v.abs() > LARGEST)) {
            let found = values[row].unwrap_or_default();
            return Err(table
                .table
                .error(column, row, format!("expected a {role} below {LARGEST:e} in size"))
                .found(found)
                .hint(
                    "a value that stands for a lost sample should be an empty cell; otherwise check the unit of the column",
                ));
        }
    }
    let measured = |seen: &Seen| {
        let samples = table.column(&seen.name)?.to_vec();
        Some(Measured { channel: seen.name.clone(), unit: seen.unit.clone(), samples })
    };
    Ok(Samples {
        name: recording_name(path),
        driving: columns.driving.iter().map(|(role, _)| table.complete(role).unwrap_or_default()).collect(),
        measured: columns.seen.iter().filter_map(measured).collect(),
        time: table.time,
    })
}

/// What the recording at `path` is called.
fn recording_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// Refuses times that no motion can be followed in.
fn check_spacing(table: &TrajectoryTable, longest: Option<f64>) -> Result<(), InputError> {
    let mut spacings: Vec<f64> = table.time.windows(2).map(|w| w[1] - w[0]).collect();
    let widest = spacings.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map(|(row, width)| (row, *width));
    spacings.sort_by(f64::total_cmp);
    let median = spacings[spacings.len() / 2];
    if let Some(longest) = longest.filter(|longest| median > *longest) {
        return Err(InputError::new(table.table.path(), format!("expected rows at most {longest} s apart"))
            .in_column(TIME_COLUMN)
            .found(median)
            .hint("`t` is in seconds: divide milliseconds by 1000, and take the recording's start off an epoch"));
    }
    match widest {
        Some((row, width)) if width > (GAP * median).max(longest.unwrap_or(0.0)) => {
            let message = format!("expected no gap, found one of {width} s where rows are {median} s apart");
            Err(table
                .table
                .error(TIME_COLUMN, row + 1, message)
                .hint("cut the recording there and give its parts one by one"))
        }
        _ => Ok(()),
    }
}

/// Median distance of the rows of all `times` [s]; none where there are no two rows.
fn median_spacing<'a>(times: impl Iterator<Item = &'a [f64]>) -> Option<f64> {
    let mut spacings: Vec<f64> = times.flat_map(|time| time.windows(2).map(|w| w[1] - w[0])).collect();
    spacings.sort_by(f64::total_cmp);
    spacings.get(spacings.len() / 2).copied()
}
