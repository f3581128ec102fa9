//! Twins of the model `tanks`.

use std::path::PathBuf;

use super::{Columns, Must, Wanted, channel, check_channels, check_model, median_spacing, parameters, read, seen};
use crate::io::{InputError, TwinFile};
use crate::robot::{Commands, TANKS_MECHANISMS, Tanks};
use crate::sim2real::{Assembly, Recording};

/// Steps of integration between two rows, where the twin does not say how long a step is: tanks that are sampled as
/// often as their levels need change little from row to row.
const STEPS: f64 = 8.0;

/// The tanks a twin describes, with what it models already; `recordings` are those it is held to, whose distance of rows
/// says how finely it has to be integrated.
///
/// # Errors
/// As [`joint_assembly`](super::joint_assembly).
pub fn tanks_assembly(twin: &TwinFile, recordings: &[Recording<Commands>]) -> Result<Assembly<Tanks>, InputError> {
    check_model(twin, "tanks")?;
    let unit = level_unit(twin)?;
    let wanted = Tanks::parameter_names(unit).map(|(name, unit)| {
        let must = if name == "pump_gain" { Must::NotBeZero } else { Must::BePositive };
        Wanted { name, unit, must: Some(must), default: None }
    });
    let (values, uncertainty) = parameters(twin, "a twin of tanks", &wanted)?;
    let spacing = median_spacing(recordings.iter().map(|r| r.time.as_slice())).unwrap_or(1.0);
    let longest_step = twin.step.unwrap_or(spacing / STEPS);
    super::assembly(twin, Tanks::new(unit, values, uncertainty, longest_step), TANKS_MECHANISMS)
}

/// The unit of levels, as the twin gives it: that of the sensor.
fn level_unit(twin: &TwinFile) -> Result<&str, InputError> {
    let level = channel(twin, "level")?;
    level.unit.as_deref().map(str::trim).filter(|unit| !unit.is_empty()).ok_or_else(|| {
        twin.error(&["channels", "level"], "the unit of the level is missing")
            .hint("level = { column = \"...\", unit = \"V\" }, or \"m\": the parameters' units follow from it")
    })
}

/// The recordings at `paths`, their columns as the twin's channels say: the pump's command, and the lower level.
///
/// # Errors
/// As [`joint_recordings`](super::joint_recordings).
pub fn tanks_recordings(twin: &TwinFile, paths: &[PathBuf]) -> Result<Vec<Recording<Commands>>, InputError> {
    check_channels(twin, "a twin of tanks", &["command", "level"])?;
    let command = ("command".to_owned(), channel(twin, "command")?.column.clone());
    let seen = seen(twin, &[("level", level_unit(twin)?)])?;
    let columns = Columns { driving: vec![command], seen, longest_spacing: None };
    paths.iter().map(|path| Ok(read(path, &columns)?.commanded())).collect()
}
