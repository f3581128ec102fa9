//! What mechanisms need of a run's data: without it they would do nothing, unnoticed.

use crate::io::{InputError, MechanismEntry, RunFile};

use super::{History, Instrument};

/// Holds the mechanisms of `run` to have the data they need for every instrument.
///
/// # Errors
/// A mechanism, and the instrument that lacks what it needs.
pub(super) fn check(run: &RunFile, instruments: &[Instrument], histories: &[History]) -> Result<(), InputError> {
    for (index, entry) in run.mechanisms.iter().enumerate() {
        let mut pairs = instruments.iter().zip(histories);
        let lacking = pairs.find_map(|(i, history)| Some((i, lacks(entry, i, history)?)));
        let Some((instrument, (what, hint))) = lacking else { continue };
        let message = format!("`{}` needs {what}, and there are none of `{}`", entry.name, instrument.symbol);
        return Err(run.error(&["mechanism", &index.to_string(), "name"], message).hint(hint));
    }
    Ok(())
}

/// What `entry` needs that is not there, and the remedy.
fn lacks(entry: &MechanismEntry, instrument: &Instrument, history: &History) -> Option<(&'static str, &'static str)> {
    let of_the_spread = entry.name == "half_spread" && entry.parameter("fraction").is_some();
    match entry.name.as_str() {
        _ if of_the_spread && history.quotes().is_empty() => {
            Some(("quotes for a fraction of the spread", "add [[data]] with quotes, or give half_spread as bps"))
        }
        "book_walk" if history.quotes().is_empty() => {
            Some(("quotes", "add [[data]] with quotes, or give half_spread as bps"))
        }
        "book_walk" if !displays_sizes(history) => {
            Some(("sizes in the quotes", "add the columns bid_size and ask_size, or drop the mechanism"))
        }
        "sqrt_impact" | "linear_impact" if !knows_daily_volume(instrument, history) => Some((
            "volumes",
            "add average_daily_volume to [[instrument]], or bars with volumes: days that are over are averaged",
        )),
        "participation_cap" if history.quotes().is_empty() && !has_volumes(history) => {
            Some(("volumes", "add [[data]] with bars that know volumes, or with quotes that know sizes"))
        }
        "participation_cap" if !history.quotes().is_empty() && !displays_sizes(history) => {
            Some(("sizes in the quotes", "add the columns bid_size and ask_size, or drop the mechanism"))
        }
        _ => None,
    }
}

fn displays_sizes(history: &History) -> bool {
    let quotes = history.quotes().all();
    let known = |k| quotes.get(k).is_some_and(|q| q.bids.iter().chain(q.asks).any(|level| level.size.is_finite()));
    (0..quotes.len()).any(known)
}

fn has_volumes(history: &History) -> bool {
    history.bars().iter().any(|bar| bar.volume > 0.0)
}

fn knows_daily_volume(instrument: &Instrument, history: &History) -> bool {
    instrument.average_daily_volume.is_some() || has_volumes(history)
}
