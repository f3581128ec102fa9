//! An order log taken apart: a part a symbol, with the orders that count.

use std::collections::{BTreeMap, HashMap};

use crate::io::{InputError, Table, TimeFormat};
use crate::sim2real::Timestamp;

/// The orders of one symbol in a log, and their fills: rows of its tables.
#[derive(Debug)]
pub(super) struct SymbolPart {
    pub symbol: String,
    pub orders: Table,
    pub fills: Table,
}

/// A log by symbol.
#[derive(Debug)]
pub(super) struct SplitLog {
    /// A part a symbol, in the order of symbols; those without orders that count are not there.
    pub parts: Vec<SymbolPart>,
    /// Orders that do not count because they were decided outside the time that does.
    pub outside: usize,
}

/// Takes a log apart; of its orders those count that were decided from the first to the last instant of `span`.
///
/// # Errors
/// Missing columns and cells; ids of several orders of one symbol; where fills do not name their symbol, an id that orders of
/// several have.
pub(super) fn split(
    orders: &Table,
    fills: &Table,
    time: &TimeFormat,
    span: Option<(Timestamp, Timestamp)>,
) -> Result<SplitLog, InputError> {
    let by_symbol = orders.split_by("symbol")?;
    if by_symbol.len() == 1 && span.is_none() {
        // What is wrong with its rows is for whoever reads them to say.
        let whole = |(symbol, _)| SymbolPart { symbol, orders: orders.clone(), fills: fills.clone() };
        return Ok(SplitLog { parts: by_symbol.into_iter().map(whole).collect(), outside: 0 });
    }
    let counts: Vec<bool> = match span {
        Some((first, last)) => orders.times("decided_at", time)?.iter().map(|at| (first..=last).contains(at)).collect(),
        None => vec![true; orders.rows()],
    };
    let symbols = orders.texts_complete("symbol")?;
    let owners = owners(orders, fills, &symbols)?;
    let mut rows_of_fills: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    // A fill of no order there is goes to some part, where it is refused with its place.
    let any = counts.iter().position(|counts| *counts).unwrap_or(0);
    for (row, owner) in owners.into_iter().enumerate() {
        let order = owner.unwrap_or(any);
        if counts[order] {
            rows_of_fills.entry(symbols[order].as_str()).or_default().push(row);
        }
    }
    let outside = counts.iter().filter(|counts| !**counts).count();
    let part = |symbol: &String| {
        let own = orders.filtered(|row| symbols[row] == *symbol && counts[row]);
        let fills = fills.chosen(rows_of_fills.get(symbol.as_str()).map(Vec::as_slice).unwrap_or_default());
        SymbolPart { symbol: symbol.clone(), orders: own, fills }
    };
    Ok(SplitLog { parts: by_symbol.keys().map(part).filter(|part| part.orders.rows() > 0).collect(), outside })
}

/// The row of the order that each fill belongs to; none where there is no such order. Ids are those of a symbol where fills name
/// theirs, because exchanges count by symbol, and else of the whole log.
fn owners(orders: &Table, fills: &Table, symbols: &[String]) -> Result<Vec<Option<usize>>, InputError> {
    let ids = orders.texts_complete("order_id")?;
    let named = if fills.has("symbol") { Some(fills.texts_complete("symbol")?) } else { None };
    let mut rows: HashMap<(&str, &str), usize> = HashMap::with_capacity(ids.len());
    for (row, id) in ids.iter().enumerate() {
        let symbol = if named.is_some() { symbols[row].as_str() } else { "" };
        let Some(first) = rows.insert((symbol, id), row) else { continue };
        let error = |message: String, hint: &str| Err(orders.error("order_id", row, message).found_text(id).hint(hint));
        if symbols[first] != symbols[row] {
            let message = format!("an order of `{}` has this id too, and fills do not name their symbol", symbols[first]);
            return error(message, "add a column `symbol` to the fills");
        }
        let message = format!("the id is that of data row {} too", first + 1);
        return error(
            message,
            "each order has an id of its own; are rows doubled, or days put together that count from 1 again?",
        );
    }
    let owner = |(row, id): (usize, &String)| {
        let symbol = named.as_ref().map_or("", |named| named[row].as_str());
        rows.get(&(symbol, id.as_str())).copied()
    };
    Ok(fills.texts_complete("order_id")?.iter().enumerate().map(owner).collect())
}
