//! Cells of texts, as numbers.

use super::time_format::as_integer;

/// What is wrong with a cell, and the remedy.
pub(super) type Wrong = (&'static str, &'static str);
/// Of an infinity.
pub(super) const INFINITE: Wrong = ("expected a finite number", "leave the cell empty where a sample was lost");
const NO_NUMBER: Wrong = ("expected a number", "leave the cell empty where a sample was lost");
/// Of a fraction.
pub(super) const NO_INTEGER: Wrong = ("expected an integer", "round the column, or write it without a fraction");

/// The number a cell holds; none where it is empty or NaN.
pub(super) fn number(text: &str) -> Result<Option<f64>, Wrong> {
    let text = text.trim();
    if text.is_empty() {
        return Ok(None);
    }
    match text.parse::<f64>() {
        Ok(value) if value.is_nan() => Ok(None),
        Ok(value) if value.is_infinite() => Err(INFINITE),
        Ok(value) => Ok(Some(value)),
        Err(_) => Err(NO_NUMBER),
    }
}

/// The integer a cell holds, also one written as `1.0`; none where it is empty or NaN.
pub(super) fn integer(text: &str) -> Result<Option<i64>, Wrong> {
    match text.trim().parse::<i64>() {
        Ok(value) => Ok(Some(value)),
        Err(_) => match number(text) {
            Ok(None) => Ok(None),
            Ok(Some(value)) => as_integer(value).map(Some).ok_or(NO_INTEGER),
            Err(_) => Err(NO_INTEGER),
        },
    }
}
