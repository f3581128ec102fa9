//! Twins of the model `joint`.

use std::path::PathBuf;

use super::{
    Columns, LONGEST_SPACING, Must, Wanted, channel, check_channels, check_model, check_no_step, parameters, read, seen,
};
use crate::io::{InputError, TwinFile};
use crate::robot::{Axis, Commands, Joint, MECHANISMS};
use crate::sim2real::{Assembly, Recording};

/// The joint a twin describes, with what it models already.
///
/// # Errors
/// A twin of another model; parameters that are missing, unknown, of another unit or without meaning (an inertia of 0);
/// mechanisms the registry does not know.
pub fn joint_assembly(twin: &TwinFile) -> Result<Assembly<Joint>, InputError> {
    check_model(twin, "joint")?;
    check_no_step(twin)?;
    let axis = axis(twin)?;
    let wanted = Joint::parameter_names(axis).map(|(name, unit)| {
        // A joint that nothing weighs on, or that is driven by torques, need not say so.
        let (must, default) = match name {
            "inertia" => (Some(Must::BePositive), None),
            "viscous_friction" => (Some(Must::NotBeNegative), None),
            "gain" => (Some(Must::NotBeZero), Some(1.0)),
            _ => (None, Some(0.0)),
        };
        Wanted { name, unit: unit.to_owned(), must, default }
    });
    let (values, uncertainty) = parameters(twin, "a joint", &wanted)?;
    super::assembly(twin, Joint::new(axis, values, uncertainty), MECHANISMS)
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

/// The recordings at `paths`, their columns as the twin's channels say.
///
/// # Errors
/// Channels that are missing, unknown or of another unit, and what
/// [`read_trajectory`](crate::io::read_trajectory) refuses; a recording too short to tell anything.
pub fn joint_recordings(twin: &TwinFile, paths: &[PathBuf]) -> Result<Vec<Recording<Commands>>, InputError> {
    check_channels(twin, "a joint", &["command", "position", "velocity"])?;
    let units = match axis(twin)? {
        Axis::Rotary => [("position", "rad"), ("velocity", "rad/s")],
        Axis::Linear => [("position", "m"), ("velocity", "m/s")],
    };
    let command = ("command".to_owned(), channel(twin, "command")?.column.clone());
    let columns = Columns { driving: vec![command], seen: seen(twin, &units)?, longest_spacing: Some(LONGEST_SPACING) };
    paths.iter().map(|path| Ok(read(path, &columns)?.commanded())).collect()
}
