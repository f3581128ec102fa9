//! A run as the twin of how its orders are executed: what it assumes of them, and what it says once that was fitted.

use crate::io::{AssumedPrice, DataEntry, FeedKind, InputError, RunFile, TwinFile};

use super::listed::{self, Besides};
use super::{Latencies, Latency, PriceAssumption, Reference, Strain};

/// The latencies of a run that mechanisms can say: the mechanism, the keys of `[latency]`, and what they come to [s].
struct Known {
    id: &'static str,
    keys: Vec<&'static str>,
    seconds: f64,
}

/// The price that `run` assumes for orders of `symbol`: that of its `[assumptions]`, or else what its venue starts from. Orders
/// meet quotes or the displayed book where there are any, else the next bar, else the last trade.
///
/// # Errors
/// As [`venue_reference`].
pub(super) fn assumed_price(run: &RunFile, symbol: &str) -> Result<PriceAssumption, InputError> {
    if let Some(assumptions) = &run.assumptions {
        return Ok(assumption(assumptions.price));
    }
    let has = |kinds: &[FeedKind]| run.data.iter().any(|data| data.symbol == symbol && kinds.contains(&data.kind));
    Ok(match () {
        () if has(&[FeedKind::Quotes, FeedKind::Book]) => match venue_reference(run)? {
            Reference::Mid => PriceAssumption::Mid,
            Reference::Touch => PriceAssumption::Touch,
        },
        () if has(&[FeedKind::Bars]) => PriceAssumption::NextOpen,
        () => PriceAssumption::Last,
    })
}

/// The assumption a document's word stands for.
pub(super) fn assumption(price: AssumedPrice) -> PriceAssumption {
    match price {
        AssumedPrice::Mid => PriceAssumption::Mid,
        AssumedPrice::Touch => PriceAssumption::Touch,
        AssumedPrice::Last => PriceAssumption::Last,
        AssumedPrice::BarClose => PriceAssumption::BarClose,
        AssumedPrice::NextOpen => PriceAssumption::NextOpen,
    }
}

/// The price that the mechanisms of `run` start from where there are quotes: as it says, or as a twin that it brings was trued, or
/// what suits them.
fn venue_reference(run: &RunFile) -> Result<Reference, InputError> {
    match price(run)? {
        Some(AssumedPrice::Mid) => Ok(Reference::Mid),
        Some(AssumedPrice::Touch) => Ok(Reference::Touch),
        _ => Ok(Reference::suiting(&listed::assembly(run.listed(), run.assumed(), &[])?)),
    }
}

/// The price that `run` asks for: in `[run]`, or where mechanisms come with a twin, or it is one, that of the twin, beyond which
/// its mechanisms were found. None where nothing is said.
///
/// # Errors
/// Another price in `[run]` than the twin's.
pub(super) fn price(run: &RunFile) -> Result<Option<AssumedPrice>, InputError> {
    let brought = run.twin.as_deref().map(price_of_twin).transpose()?.flatten();
    let assumed = run.assumptions.as_ref().map(|assumptions| assumptions.price).or(brought);
    match (run.run.price, assumed) {
        (Some(own), Some(other)) if own != other => {
            let message = format!("the run starts from the price \"{}\", its twin from \"{}\"", own.word(), other.word());
            let error = run.error(&["run", "price"], message);
            Err(error
                .hint("mechanisms act beyond the price they were found with: drop the key, or have the twin trued with it"))
        }
        (own, other) => Ok(own.or(other)),
    }
}

/// The price that `twin` assumes, where it is one that orders of a run can meet.
fn price_of_twin(twin: &TwinFile) -> Result<Option<AssumedPrice>, InputError> {
    if let Some(assumptions) = &twin.assumptions {
        return Ok(Some(assumptions.price));
    }
    let Some(run) = &twin.run else { return Ok(None) };
    let quoted = run.data.iter().any(|data| matches!(data.kind, FeedKind::Quotes | FeedKind::Book));
    if !quoted {
        return Ok(None);
    }
    venue_reference(run).map(|reference| match reference {
        Reference::Mid => Some(AssumedPrice::Mid),
        Reference::Touch => Some(AssumedPrice::Touch),
    })
}

/// What mechanisms of the twin have on top of what is listed: the latencies of the run, which delay orders and data as
/// `command_delay` and `stale_quotes` do.
///
/// # Errors
/// A latency that is not constant.
pub(super) fn besides(run: &RunFile) -> Result<Vec<Besides>, InputError> {
    Ok(known(run)?.into_iter().map(|known| (known.id, known.seconds)).collect())
}

fn known(run: &RunFile) -> Result<Vec<Known>, InputError> {
    let latencies: Latencies = run.latency()?;
    let constant = |key: &'static str, latency: &Latency| match latency {
        Latency::Constant { seconds } => Ok((*seconds > 0.0).then_some((key, *seconds))),
        other => Err(run
            .error(&["latency", key], format!("a diagnosis knows constant latencies alone, and this is {other}"))
            .hint("give seconds, or drop the key: then the delay is found")),
    };
    let (order, compute) = (constant("order", &latencies.order)?, constant("compute", &latencies.compute)?);
    let feed = constant("feed", &latencies.feed)?;
    let of = |id, parts: &[Option<(&'static str, f64)>]| {
        let there = parts.iter().flatten();
        Known { id, keys: there.clone().map(|(key, _)| *key).collect(), seconds: there.map(|(_, seconds)| seconds).sum() }
    };
    let all: Vec<Known> = [of("command_delay", &[order, compute]), of("stale_quotes", &[feed])]
        .into_iter()
        .filter(|known| !known.keys.is_empty())
        .collect();
    if !all.is_empty() && latencies.strain != Strain::default() {
        let error =
            run.error(&["latency", "strain"], "a diagnosis knows constant latencies alone, and these grow with the load");
        return Err(error.hint("drop the key for the diagnosis"));
    }
    Ok(all)
}

/// Makes the document of `twin`, whose mechanisms were fitted, run as it was trued: what mechanisms say now is said by nothing
/// else, and they start from the price that they were fitted beyond. A twin that is no run stays as it is.
///
/// # Errors
/// What [`execution_assembly`](super::execution_assembly) refuses of the run.
pub fn settle_trued_run(twin: &mut TwinFile) -> Result<(), InputError> {
    let Some(run) = &mut twin.run else { return Ok(()) };
    let before = venue_reference(run)?;
    let of_latency = known(run)?.into_iter().flat_map(|known| known.keys);
    twin.superseded.extend(of_latency.map(|key| ["latency", key]));
    if run.twin.take().is_some() {
        twin.superseded.push(["execution", "twin"]);
        run.execution.twin = None;
    }
    run.mechanisms.clone_from(&twin.mechanisms);
    if let (Some(own), Some(fitted)) = (&mut run.assumptions, &twin.assumptions) {
        for (key, was, is) in [
            ("commission_bps", own.commission_bps, fitted.commission_bps),
            ("commission_per_share", own.commission_per_share, fitted.commission_per_share),
        ] {
            if was.is_some() && is.is_none() {
                twin.superseded.push(["assumptions", key]);
            }
        }
        *own = *fitted;
    }
    let quoted = |data: &DataEntry| matches!(data.kind, FeedKind::Quotes | FeedKind::Book);
    let says = run.run.price.is_some() || run.assumptions.is_some();
    if !says && run.data.iter().any(quoted) && venue_reference(run)? != before {
        run.run.price = Some(match before {
            Reference::Mid => AssumedPrice::Mid,
            Reference::Touch => AssumedPrice::Touch,
        });
    }
    Ok(())
}
