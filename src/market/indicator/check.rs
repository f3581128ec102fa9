//! The contract of indicators as a function.

use crate::sim2real::Violation;

use super::Indicator;

/// Runs the contract of [`Indicator`] on `indicator`, fresh, over `inputs`, all of which it should take, and on `refused`,
/// none of which it should.
///
/// # Errors
/// The first line of the contract that is broken.
pub fn check_indicator<I>(name: &str, indicator: &I, inputs: &[I::Input], refused: &[I::Input]) -> Result<(), Violation>
where
    I: Indicator + Clone + PartialEq,
{
    let fail = |row: usize, what: &str| Err(Violation { subject: name.to_owned(), what: format!("input {row}: {what}") });
    let mut subject = indicator.clone();
    let mut values = Vec::with_capacity(inputs.len());
    let mut ready = false;
    for (row, input) in inputs.iter().enumerate() {
        if subject.value().is_some() && !subject.is_ready() {
            return fail(row, "there is a value before it is ready");
        }
        let value = subject.update(*input);
        if value != subject.value() {
            return fail(row, "the value is not what the update gave");
        }
        if ready && !subject.is_ready() {
            return fail(row, "it is not ready any more");
        }
        ready = subject.is_ready();
        values.push(value);
        let before = subject.clone();
        for bad in refused {
            if subject.update(*bad).is_some() {
                return fail(row, "an input it should refuse after it was taken");
            }
            if subject != before {
                return fail(row, "an input it refused after it left a trace");
            }
        }
    }
    if !ready {
        return fail(inputs.len(), "it never becomes ready");
    }
    subject.reset();
    if subject.is_ready() || subject.value().is_some() {
        return fail(inputs.len(), "a reset leaves a value");
    }
    for (row, (input, value)) in inputs.iter().zip(&values).enumerate() {
        if subject.update(*input) != *value {
            return fail(row, "after a reset it gives another value");
        }
    }
    Ok(())
}
