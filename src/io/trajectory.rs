//! Trajectories: recordings in one file, a row a sample.

use std::path::Path;

use super::check::{Increase, check_increasing};
use super::error::InputError;
use super::table::Table;

/// The column of a trajectory's time [s].
pub const TIME_COLUMN: &str = "t";

/// What a trajectory must have of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// A value in every row, as of a command: it drives the simulation.
    EveryRow,
    /// A value in some rows: lost samples are left out.
    SomeRows,
    /// Nothing: the column may be missing.
    Nothing,
}

/// A trajectory as it was read.
#[derive(Debug)]
pub struct TrajectoryTable {
    /// Time of each row [s]: finite and strictly increasing, at least two rows.
    pub time: Vec<f64>,
    columns: Vec<(String, Vec<Option<f64>>)>,
    /// The table, for errors about its cells.
    pub table: Table,
}

impl TrajectoryTable {
    /// The column in that role, where it is there: one entry a row, `None` where the sample was lost.
    #[must_use]
    pub fn column(&self, role: &str) -> Option<&[Option<f64>]> {
        self.columns.iter().find(|(name, _)| name == role).map(|(_, values)| values.as_slice())
    }

    /// The column in that role, where it is there and complete.
    #[must_use]
    pub fn complete(&self, role: &str) -> Option<Vec<f64>> {
        self.column(role)?.iter().copied().collect()
    }
}

/// Reads a trajectory: its time, and `columns` as their role, their name in the file and what is needed of them.
///
/// # Errors
/// As [`Table::read`]; a column that is missing or not numeric; a time or command with a hole; times that do not
/// strictly increase; fewer than two rows; a needed column without any value.
pub fn read_trajectory(path: impl AsRef<Path>, columns: &[(&str, &str, Need)]) -> Result<TrajectoryTable, InputError> {
    let table = Table::read(path)?;
    if !table.has(TIME_COLUMN) {
        // Not a hint about the nearest name alone: users of other tools call it `time`, and its unit counts.
        return Err(table.floats(TIME_COLUMN).err().map_or_else(
            || InputError::new(table.path(), "there is no time"),
            |error| {
                let names = error.hint.clone().unwrap_or_default();
                error.hint(format!("a trajectory has its time in seconds in the column `{TIME_COLUMN}`; {names}"))
            },
        ));
    }
    let time = table.floats_complete(TIME_COLUMN)?;
    if time.len() < 2 {
        return Err(InputError::new(table.path(), "expected at least 2 rows")
            .found(time.len())
            .hint("one sample says nothing about what happens between samples"));
    }
    check_increasing(&table, TIME_COLUMN, &time, Increase::Strictly)?;
    let mut read = Vec::new();
    for (role, column, need) in columns {
        let values = match need {
            Need::Nothing if !table.has(column) => continue,
            Need::EveryRow => table.floats_complete(column)?.into_iter().map(Some).collect(),
            Need::SomeRows | Need::Nothing => table.floats(column)?,
        };
        if *need == Need::SomeRows && values.iter().all(Option::is_none) {
            return Err(InputError::new(table.path(), "expected at least one number, found none")
                .in_column(*column)
                .hint("every sample is lost: name another column, or leave the channel out"));
        }
        read.push(((*role).to_owned(), values));
    }
    Ok(TrajectoryTable { time, columns: read, table })
}
