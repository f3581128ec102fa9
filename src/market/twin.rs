//! Execution twins: what a backtest assumes of every order, and the logs it is held to.

use std::path::PathBuf;

use crate::io::{Assumptions, Document, InputError, TwinFile, listed_mechanism};
use crate::sim2real::{Assembly, Plant, Recording};

use super::listed::{self, Listed};
use super::mechanism::needs;
use super::run_as_twin::besides;
use super::{Execution, LogReader, MECHANISMS, OrderLog};

/// The plant of an execution twin with what it models already, and the logs in `folders`.
///
/// # Errors
/// What [`execution_assembly`], [`execution_logs`] and [`check_needs`] refuse.
pub fn execution_twin(
    twin: &TwinFile,
    folders: &[PathBuf],
) -> Result<(Assembly<Execution>, Vec<Recording<OrderLog>>), InputError> {
    let assembly = execution_assembly(twin)?;
    let recordings = execution_logs(twin, folders)?;
    check_needs(twin, &recordings)?;
    Ok((assembly, recordings))
}

/// Holds the logs to have the data that the mechanisms of `twin` need.
///
/// # Errors
/// A mechanism for which a log lacks the data, and what the registry does not know.
pub fn check_needs(twin: &TwinFile, recordings: &[Recording<OrderLog>]) -> Result<(), InputError> {
    for (document, index, entry) in listed_of(twin) {
        let (mechanism, form, _) = listed_mechanism(document, index, entry, &Execution, MECHANISMS)?;
        // What a diagnosis would not propose may well be modelled: a constant spread stands beside quotes.
        let needs = needs(mechanism.about().name, form);
        let lacking = |log: &&Recording<OrderLog>| needs.iter().any(|need| !need.is_known_in(&log.stimulus));
        if let Some(log) = recordings.iter().find(lacking) {
            let message = format!("the log {} lacks the data `{}` needs in this form", log.name, entry.name);
            return Err(document.error(&["mechanism", &index.to_string(), "name"], message).hint(
                "a fraction of the spread and a walk need quotes, an impact the average_daily_volume, a slippage the daily_volatility, a cap volumes",
            ));
        }
    }
    Ok(())
}

/// The plant of an execution twin with what it models already. A run models what stands between its orders and their fills: its
/// mechanisms, those of a twin that it brings, and its latencies.
///
/// # Errors
/// A twin of another model; one without `[assumptions]`, with parameters the plant does not have, or with mechanisms, keys, units
/// or values the registry does not know; a run whose latencies are not constant.
pub fn execution_assembly(twin: &TwinFile) -> Result<Assembly<Execution>, InputError> {
    let name = Execution.name();
    if twin.model != name {
        return Err(twin.error(&["twin", "model"], format!("expected the model \"{name}\"")).found_text(&twin.model));
    }
    if let Some(parameter) = twin.parameters.keys().next() {
        return Err(twin
            .error(&["parameters", parameter], format!("`{name}` has no parameter `{parameter}`"))
            .hint("what stands between decision and fill is said by [[mechanism]] sections"));
    }
    let besides = match (&twin.run, &twin.assumptions) {
        (Some(run), _) => besides(run)?,
        (None, Some(_)) => Vec::new(),
        (None, None) => return Err(no_assumptions(twin)),
    };
    listed::assembly(listed_of(twin).into_iter(), assumed_of(twin).into_iter(), &besides)
}

/// All mechanisms that stand between decision and fill: those of the twin, and of one that it brings as a run.
fn listed_of(twin: &TwinFile) -> Vec<Listed<'_>> {
    let brought = twin.run.as_ref().and_then(|run| run.twin.as_deref());
    let all = [Some(twin), brought].into_iter().flatten();
    all.flat_map(|twin| twin.mechanisms.iter().enumerate().map(|(index, entry)| (twin.document(), index, entry))).collect()
}

/// All commissions that are assumed.
fn assumed_of(twin: &TwinFile) -> Vec<(&Document, &Assumptions)> {
    let brought = twin.run.as_ref().and_then(|run| run.twin.as_deref());
    let all = [Some(twin), brought].into_iter().flatten();
    all.filter_map(|twin| Some((twin.document(), twin.assumptions.as_ref()?))).collect()
}

/// The logs in `folders`, as [`LogReader::read_all`] reads them: a recording a symbol.
///
/// # Errors
/// What [`LogReader`] refuses.
pub fn execution_logs(twin: &TwinFile, folders: &[PathBuf]) -> Result<Vec<Recording<OrderLog>>, InputError> {
    LogReader::of(twin)?.read_all(folders)
}

/// The error of a twin that does not say what is assumed.
pub(super) fn no_assumptions(twin: &TwinFile) -> InputError {
    twin.error(&["twin"], "the section [assumptions] is missing")
        .hint("say which price the backtest fills at: price = \"mid\", \"touch\", \"last\", \"bar_close\" or \"next_open\"")
}
