//! Joint twins: what a simulator of a joint is told today, and the recordings it is held to.

use std::path::PathBuf;

use super::{Axis, Commands, Joint, MECHANISMS};
use crate::io::{
    ChannelEntry, InputError, Need, Quantity, TIME_COLUMN, TrajectoryTable, TwinFile, hint_among, listed_mechanism,
    read_trajectory,
};
use crate::sim2real::{Assembly, Measured, Recording};

/// Rows a recording needs at the least: fewer say nothing about noise, let alone about what is missing.
const FEWEST_ROWS: usize = 100;
/// Longest median distance of rows [s]: a servo that is sampled more slowly than this cannot be followed, and a time in
/// milliseconds looks like it.
const LONGEST_SPACING: f64 = 0.5;
/// A distance of rows this many times the median is a gap, over which no motion can be followed.
const GAP: f64 = 1_000.0;
/// Positions, velocities and commands are less than this in any unit of theirs.
const LARGEST: f64 = 1e9;

/// The joint a twin describes, with what it models already.
///
/// # Errors
/// A twin of another model; parameters that are missing, unknown, of another unit or without meaning (an inertia of 0);
/// mechanisms the registry does not know.
pub fn joint_assembly(twin: &TwinFile) -> Result<Assembly<Joint>, InputError> {
    if twin.model != "joint" {
        return Err(twin.error(&["twin", "model"], "expected the model \"joint\"").found_text(&twin.model));
    }
    let axis = axis(twin)?;
    let names = Joint::parameter_names(axis);
    let known: Vec<&str> = names.iter().map(|(name, _)| *name).collect();
    if let Some(unknown) = twin.parameters.keys().find(|name| !known.contains(&name.as_str())) {
        let error = twin.error(&["parameters", unknown], format!("a joint has no parameter `{unknown}`"));
        return Err(error.maybe_hint(hint_among(unknown, &known)));
    }
    let mut values = [0.0; 4];
    let mut uncertainty = [0.0; 4];
    for (k, (name, unit)) in names.into_iter().enumerate() {
        let quantity = parameter(twin, name, unit)?;
        (values[k], uncertainty[k]) = (quantity.value, quantity.uncertainty);
    }
    let joint = Joint::new(axis, values, uncertainty);
    let mut assembly = Assembly::new(joint.clone(), MECHANISMS);
    for (index, entry) in twin.mechanisms.iter().enumerate() {
        let (mechanism, form, parameters) = listed_mechanism(twin.document(), index, entry, &joint, MECHANISMS)?;
        assembly = assembly.with_mechanism(mechanism, form, parameters);
    }
    Ok(assembly)
}

/// A parameter of the twin. A joint that nothing weighs on, or that is driven by torques, need not say so.
fn parameter(twin: &TwinFile, name: &str, unit: &str) -> Result<Quantity, InputError> {
    let default = match name {
        "gravity_torque" => Some(0.0),
        "gain" => Some(1.0),
        _ => None,
    };
    let Some(quantity) = twin.parameters.get(name) else {
        let exactly = |value| Quantity { value, unit: None, uncertainty: 0.0 };
        return default.map(exactly).ok_or_else(|| {
            twin.error(&["parameters"], format!("the parameter `{name}` is missing"))
                .hint(format!("{name} = {{ value = ..., unit = \"{unit}\", uncertainty = 0.2 }}"))
        });
    };
    twin.check_unit(&["parameters", name], quantity.unit.as_deref(), unit)?;
    let wrong = match name {
        "inertia" if quantity.value <= 0.0 => Some("expected an inertia above 0"),
        "viscous_friction" if quantity.value < 0.0 => Some("expected a viscous friction of at least 0"),
        "gain" if quantity.value == 0.0 => Some("expected a gain other than 0"),
        _ => None,
    };
    match wrong {
        Some(what) => {
            Err(twin.error(&["parameters", name], what).found(quantity.value).hint(format!("its unit is [{unit}]")))
        }
        None => Ok(quantity.clone()),
    }
}

/// Whether the joint turns or slides: as the unit of its position says.
fn axis(twin: &TwinFile) -> Result<Axis, InputError> {
    let position = channel(twin, "position")?;
    match position.unit.as_deref().map(str::trim) {
        None | Some("rad") => Ok(Axis::Rotary),
        Some("m") => Ok(Axis::Linear),
        Some(other) => Err(twin
            .error(&["channels", "position", "unit"], "expected a position in rad or in m")
            .found_text(other)
            .hint("convert the column; 1 deg = 0.017453292519943295 rad, 1 mm = 0.001 m")),
    }
}

fn channel<'a>(twin: &'a TwinFile, name: &str) -> Result<&'a ChannelEntry, InputError> {
    twin.channels.get(name).ok_or_else(|| {
        twin.error(&["channels"], format!("the channel `{name}` is missing"))
            .hint(format!("{name} = {{ column = \"...\" }} says which column of a recording it is"))
    })
}

/// The recordings at `paths`, their columns as the twin's channels say.
///
/// # Errors
/// Channels that are missing, unknown or of another unit, and what
/// [`read_trajectory`] refuses; a recording too short to tell anything.
pub fn joint_recordings(twin: &TwinFile, paths: &[PathBuf]) -> Result<Vec<Recording<Commands>>, InputError> {
    let known = ["command", "position", "velocity"];
    if let Some(unknown) = twin.channels.keys().find(|name| !known.contains(&name.as_str())) {
        let error = twin.error(&["channels", unknown], format!("a joint has no channel `{unknown}`"));
        return Err(error.maybe_hint(hint_among(unknown, &known)));
    }
    let units = match axis(twin)? {
        Axis::Rotary => ["rad", "rad/s"],
        Axis::Linear => ["m", "m/s"],
    };
    if let Some(velocity) = twin.channels.get("velocity") {
        twin.check_unit(&["channels", "velocity", "unit"], velocity.unit.as_deref(), units[1])?;
    }
    paths.iter().map(|path| recording(twin, path, units)).collect()
}

fn recording(twin: &TwinFile, path: &PathBuf, units: [&str; 2]) -> Result<Recording<Commands>, InputError> {
    let (command, position) = (channel(twin, "command")?, channel(twin, "position")?);
    let mut columns =
        vec![("command", command.column.as_str(), Need::EveryRow), ("position", position.column.as_str(), Need::SomeRows)];
    if let Some(velocity) = twin.channels.get("velocity") {
        columns.push(("velocity", velocity.column.as_str(), Need::SomeRows));
    }
    let table = read_trajectory(path, &columns)?;
    if table.time.len() < FEWEST_ROWS {
        return Err(InputError::new(table.table.path(), format!("expected at least {FEWEST_ROWS} rows"))
            .found(table.time.len())
            .hint("record for longer: a diagnosis fits on one stretch and proves on another"));
    }
    check_spacing(&table)?;
    for (role, column, _) in &columns {
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
    let measured = ["position", "velocity"]
        .into_iter()
        .zip(units)
        .filter_map(|(name, unit)| {
            let samples = table.column(name)?.to_vec();
            Some(Measured { channel: name.to_owned(), unit: unit.to_owned(), samples })
        })
        .collect();
    Ok(Recording {
        name: path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned()),
        stimulus: Commands(table.complete("command").unwrap_or_default()),
        measured,
        time: table.time,
    })
}

/// Refuses times that no motion of a joint can be followed in.
fn check_spacing(table: &TrajectoryTable) -> Result<(), InputError> {
    let mut spacings: Vec<f64> = table.time.windows(2).map(|w| w[1] - w[0]).collect();
    let widest = spacings.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).map(|(row, width)| (row, *width));
    spacings.sort_by(f64::total_cmp);
    let median = spacings[spacings.len() / 2];
    if median > LONGEST_SPACING {
        return Err(InputError::new(table.table.path(), format!("expected rows at most {LONGEST_SPACING} s apart"))
            .in_column(TIME_COLUMN)
            .found(median)
            .hint("`t` is in seconds: divide milliseconds by 1000, and take the recording's start off an epoch"));
    }
    match widest {
        Some((row, width)) if width > (GAP * median).max(LONGEST_SPACING) => {
            let message = format!("expected no gap, found one of {width} s where rows are {median} s apart");
            Err(table
                .table
                .error(TIME_COLUMN, row + 1, message)
                .hint("cut the recording there and give its parts one by one"))
        }
        _ => Ok(()),
    }
}
