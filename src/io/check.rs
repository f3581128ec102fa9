//! What columns are held to beyond their type.

use std::fmt::Display;

use super::error::{InputError, Place};
use super::table::Table;

/// How a column increases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Increase {
    /// Each value is greater than the one before.
    Strictly,
    /// No value is less than the one before.
    OrStays,
}

/// Holds a complete column of `table`, read as `values`, to increase from row to row.
///
/// # Errors
/// The first row that does not, with its value and the one before.
pub fn check_increasing<T: PartialOrd + Display>(
    table: &Table,
    column: &str,
    values: &[T],
    increase: Increase,
) -> Result<(), InputError> {
    for (row, pair) in values.windows(2).enumerate() {
        let [before, value] = pair else { continue };
        let holds = match increase {
            Increase::Strictly => value > before,
            Increase::OrStays => value >= before,
        };
        if holds {
            continue;
        }
        return Err(not_increasing(table, column, row + 1, value, (before, table.place(row)), increase));
    }
    Ok(())
}

/// The error of `value`, in a row of a column that should increase, after `before` and its place.
#[must_use]
pub fn not_increasing<T: PartialOrd + Display>(
    table: &Table,
    column: &str,
    row: usize,
    value: &T,
    (before, before_at): (&T, Place),
    increase: Increase,
) -> InputError {
    let (than, hint) = match (value == before, increase) {
        (true, _) => ("more than", "two rows have the same value: drop one, or write the column with more digits"),
        (false, Increase::Strictly) => ("more than", "sort the rows by this column; was a second recording appended?"),
        (false, Increase::OrStays) => ("at least", "sort the rows by this column; was a second recording appended?"),
    };
    let place = match before_at {
        Place::Row(row) => format!(" of row {row}"),
        _ => String::new(),
    };
    table.error(column, row, format!("expected {than} the {before}{place}")).found(value).hint(hint)
}

/// Holds the values of a column to be greater than 0; holes pass.
///
/// # Errors
/// The first row with another value.
pub fn check_positive(table: &Table, column: &str, values: &[Option<f64>]) -> Result<(), InputError> {
    check_each(table, column, values, "a number greater than 0", |v| v > 0.0)
}

/// Holds the values of a column to be 0 or greater; holes pass.
///
/// # Errors
/// The first row with another value.
pub fn check_not_negative(table: &Table, column: &str, values: &[Option<f64>]) -> Result<(), InputError> {
    check_each(table, column, values, "a number that is not negative", |v| v >= 0.0)
}

fn check_each(
    table: &Table,
    column: &str,
    values: &[Option<f64>],
    expected: &str,
    holds: impl Fn(f64) -> bool,
) -> Result<(), InputError> {
    let broken = values.iter().enumerate().find_map(|(row, value)| value.filter(|v| !holds(*v)).map(|v| (row, v)));
    match broken {
        None => Ok(()),
        Some((row, value)) => Err(table
            .error(column, row, format!("expected {expected}"))
            .found(value)
            .hint("correct the value or drop the row; is another column meant?")),
    }
}
