//! Whether a run's data have what its mechanisms need: without it they would do nothing, unnoticed.

use crate::io::{InputError, RunFile};
use crate::sim2real::Assembly;

use super::mechanism::{Lack, needs};
use super::{Execution, History, Instrument};

/// Holds the mechanisms of `venue`, that of `run`, to have the data they need for every
/// instrument.
///
/// # Errors
/// A mechanism, and the instrument that lacks what it needs.
pub(super) fn check(
    run: &RunFile,
    venue: &Assembly<Execution>,
    instruments: &[Instrument],
    histories: &[History],
) -> Result<(), InputError> {
    for (mechanism, form, _) in venue.mechanisms() {
        let id = mechanism.about().name;
        let lacking = |(instrument, history): (&Instrument, &History)| {
            let lack = needs(id, form).iter().find_map(|need| need.lacking(instrument, history))?;
            Some((instrument.symbol.clone(), lack))
        };
        let Some((symbol, Lack { what, hint })) = instruments.iter().zip(histories).find_map(lacking) else { continue };
        let message = format!("`{id}` needs {what}, and there are none of `{symbol}`");
        let own = run.mechanisms.iter().position(|entry| entry.name == id).map(|index| index.to_string());
        let error = match &own {
            Some(index) => run.error(&["mechanism", index, "name"], message),
            None => run.error(&["execution", "twin"], message),
        };
        return Err(error.hint(hint));
    }
    Ok(())
}
