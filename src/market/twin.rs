//! Execution twins: what a backtest assumes of every order, and the logs it is held to.

use std::path::PathBuf;
use std::sync::Arc;

use crate::io::{DEFAULT_UNCERTAINTY, InputError, MarketFiles, TwinFile, listed_mechanism};
use crate::sim2real::{Assembly, Mechanism, Plant, Recording};

use super::log_folder::{LogSettings, read_log};
use super::mechanism::{Commission, needs};
use super::tape_file::{TapeFiles, read_tape};
use super::{Execution, Instrument, MECHANISMS, OrderLog, PriceAssumption};

/// The plant of an execution twin with what it models already, and the logs in `folders`.
///
/// # Errors
/// A twin of another model; one without `[assumptions]` or instruments, with parameters the plant does not have, or with
/// mechanisms, keys, units or values the registry does not know; a mechanism for which a log lacks the data; and what
/// [`read_log`] refuses.
pub fn execution_twin(
    twin: &TwinFile,
    folders: &[PathBuf],
) -> Result<(Assembly<Execution>, Vec<Recording<OrderLog>>), InputError> {
    let assembly = execution_assembly(twin)?;
    let recordings = execution_logs(twin, folders)?;
    for (index, entry) in twin.mechanisms.iter().enumerate() {
        let (mechanism, form, _) = listed_mechanism(twin.document(), index, entry, &Execution, MECHANISMS)?;
        // What a diagnosis would not propose may well be modelled: a constant spread stands beside quotes.
        let needs = needs(mechanism.about().name, form);
        let lacking = |log: &&Recording<OrderLog>| needs.iter().any(|need| !need.is_known_in(&log.stimulus));
        if let Some(log) = recordings.iter().find(lacking) {
            let message = format!("the log {} lacks the data `{}` needs in this form", log.name, entry.name);
            return Err(twin.error(&["mechanism", &index.to_string(), "name"], message).hint(
                "a fraction of the spread and a walk need quotes, an impact the average_daily_volume, a slippage the daily_volatility, a cap volumes",
            ));
        }
    }
    Ok((assembly, recordings))
}

/// The plant of an execution twin with what it models already.
///
/// # Errors
/// As [`execution_twin`], without what concerns logs.
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
    let mut assembly = Assembly::new(Execution, MECHANISMS);
    for (index, entry) in twin.mechanisms.iter().enumerate() {
        let (mechanism, form, parameters) = listed_mechanism(twin.document(), index, entry, &Execution, MECHANISMS)?;
        assembly = assembly.with_mechanism(mechanism, form, parameters);
    }
    let Some(assumptions) = &twin.assumptions else { return Err(no_assumptions(twin)) };
    let commissions =
        [("commission_bps", assumptions.commission_bps), ("commission_per_share", assumptions.commission_per_share)];
    for (form, (key, value)) in commissions.into_iter().enumerate() {
        let Some(value) = value.filter(|value| *value != 0.0) else { continue };
        if twin.mechanisms.iter().any(|entry| entry.name == "commission") {
            return Err(twin
                .error(&["assumptions", key], "there is a commission among the mechanisms too")
                .hint("say it once"));
        }
        let mut parameters = Mechanism::<Execution>::forms(&Commission, &Default::default()).swap_remove(form).parameters;
        for parameter in &mut parameters {
            parameter.nominal = value;
            parameter.prior = Some(DEFAULT_UNCERTAINTY * value.abs());
        }
        assembly = assembly.with_mechanism(&Commission, form, parameters);
    }
    Ok(assembly)
}

/// The logs in `folders`, beside the tape the twin names or, where it names none, those beside the orders.
///
/// # Errors
/// A twin without `[assumptions]` or instruments, and what [`read_log`] refuses.
pub fn execution_logs(twin: &TwinFile, folders: &[PathBuf]) -> Result<Vec<Recording<OrderLog>>, InputError> {
    let Some(assumptions) = &twin.assumptions else { return Err(no_assumptions(twin)) };
    let word = assumptions.price.word();
    let Some(price) = PriceAssumption::of_word(word) else {
        return Err(twin.error(&["assumptions", "price"], "expected a price").found_text(word));
    };
    if twin.instruments.is_empty() {
        return Err(twin
            .error(&["twin"], "the twin declares no [[instrument]]")
            .hint("add [[instrument]] with symbol and tick_size, and average_daily_volume where it is known"));
    }
    let instruments: Vec<Instrument> = twin.instruments.iter().map(Instrument::from).collect();
    let unnamed = MarketFiles::default();
    let market = twin.market.as_ref().unwrap_or(&unnamed);
    let files =
        TapeFiles { quotes: market.quotes.as_deref(), trades: market.trades.as_deref(), bars: market.bars.as_deref() };
    let tape = if files == TapeFiles::default() { None } else { Some(Arc::new(read_tape(files, &market.format)?)) };
    let settings = LogSettings { instruments: &instruments, price, market, tape };
    folders.iter().map(|folder| read_log(folder, &settings)).collect()
}

fn no_assumptions(twin: &TwinFile) -> InputError {
    twin.error(&["twin"], "the section [assumptions] is missing")
        .hint("say which price the backtest fills at: price = \"mid\", \"touch\", \"last\", \"bar_close\" or \"next_open\"")
}
