//! CCXT: unified orders and trades as JSON, of whatever exchange.
//!
//! Source: the CCXT manual, *Order structure* and *Trade structure*.

use std::path::Path;

use super::super::{FindingKind, OrderWords, PaperFill, PaperOrder, PaperStatus, TimeColumn, TimeMeaning};
use super::draft::{Draft, Entries};
use super::pair::pair;
use super::row::{Row, side_of};
use super::stamp::Written;
use super::{Format, Stop};
use crate::io::{InputError, Records, json_records};

pub(super) static FORMAT: Format = Format {
    id: "ccxt",
    title: "unified orders and trades of CCXT as JSON",
    known_by: "`id`, `symbol`, `timestamp`, `datetime` and `side` with `amount`",
    claims: |table| table.has_all(&["id", "symbol", "timestamp", "datetime", "side", "amount"]),
    read,
    tables: &[],
};

/// Times are milliseconds.
const MILLISECONDS: Written = Written::Count(1_000_000);

fn read(tables: &[&Records], draft: &mut Draft<'_>) -> Result<(), InputError> {
    draft.clock(TimeColumn::DecidedAt, "timestamp of the order", TimeMeaning::Accepted);
    draft.clock(TimeColumn::EndedAt, "lastTradeTimestamp, or else lastUpdateTimestamp", TimeMeaning::Updated);
    let trades = tables.iter().any(|table| table.has("takerOrMaker") || table.has("trades"));
    let (source, meaning) = match trades {
        true => ("timestamp of the trade", TimeMeaning::Executed),
        false => ("lastTradeTimestamp, or else lastUpdateTimestamp", TimeMeaning::Updated),
    };
    draft.clock(TimeColumn::FilledAt, source, meaning);
    for table in tables {
        draft.each(table, |row, entries| {
            let is_order = row.text_of(&["status", "remaining", "filled", "trades"]).is_some();
            if is_order || row.text_of(&["takerOrMaker", "order"]).is_none() {
                order(row, entries)
            } else {
                trade(row, None, entries)
            }
        })?;
    }
    Ok(())
}

fn order(row: &mut Row<'_>, entries: &mut Entries) -> Result<(), Stop> {
    let mut order = row.order(row.need("id")?, row.need("symbol")?, row.need_side("side")?);
    order.client_id = row.owned("clientOrderId");
    order.quantity = row.quantity("amount")?;
    order.kind = row.text("type").map(OrderWords::of_word);
    if row.is_true("postOnly") && order.kind == Some(OrderWords::Limit) {
        order.kind = Some(OrderWords::PostOnly);
    }
    let price = row.price_above_zero("price")?;
    order.limit_price = price.filter(|_| order.kind != Some(OrderWords::Market));
    order.stop_price = match row.price_above_zero("triggerPrice")? {
        Some(trigger) => Some(trigger),
        None => row.price_above_zero("stopPrice")?,
    };
    order.time_in_force = row.text("timeInForce").map(str::to_lowercase);
    order.decided_at = row.time("timestamp", MILLISECONDS)?;
    order.status = row.text("status").map(PaperStatus::of_word);
    let last = row.time_of(&["lastTradeTimestamp", "lastUpdateTimestamp"], MILLISECONDS)?;
    order.ended_at = last.filter(|_| order.status.as_ref().is_some_and(PaperStatus::is_final));
    order.filled = row.quantity("filled")?;
    // A closed order has ended, and only one that filled is closed.
    if order.status == Some(PaperStatus::Filled) && order.filled.is_none() {
        order.filled = order.quantity;
    }
    order.average_price = row.price_above_zero("average")?;
    let of_order = order.average_price.is_none() && order.filled.is_some_and(|filled| filled.0 > 0);
    if let Some(price) = price.filter(|_| of_order) {
        row.note_cell(FindingKind::PriceOfOrder, "average", "no average is stated; the fill has the price of the order");
        order.average_price = Some(price);
    }
    let symbol = order.symbol.clone();
    let stated = PaperOrder { ended_at: last.or(order.decided_at), ..order.clone() };
    let fill = entries.total(&stated, pair(&symbol).1);
    if let Some(fill) = fill {
        charge(row, fill)?;
    }
    if let Some(trades) = row.text("trades").filter(|trades| *trades != "[]") {
        let trades = json_records(Path::new("trades"), trades).map_err(|_| row.unread("trades", "expected an array"))?;
        for record in trades.iter() {
            let mut inner = Entries::default();
            if row.within(record, "trades", |row| trade(row, Some(&order), &mut inner))?.is_some() {
                entries.fills.append(&mut inner.fills);
            }
        }
    }
    entries.orders.push(order);
    Ok(())
}

/// A trade, which may stand within the order it belongs to and then need not repeat what that says.
fn trade(row: &mut Row<'_>, order: Option<&PaperOrder>, entries: &mut Entries) -> Result<(), Stop> {
    let symbol = match order {
        Some(order) => row.owned("symbol").unwrap_or_else(|| order.symbol.clone()),
        None => row.need("symbol")?.to_owned(),
    };
    let (at, quantity) = (row.need_time("timestamp", MILLISECONDS)?, row.need_quantity("amount")?);
    let mut fill = PaperFill::new(&symbol, at, quantity, row.need_price("price")?, row.place());
    fill.id = row.owned("id");
    fill.order_id = row.owned("order").or_else(|| order.map(|order| order.id.clone()));
    fill.side = row.text("side").and_then(side_of).or(order.map(|order| order.side));
    fill.liquidity = row.liquidity("takerOrMaker");
    fill.currency = pair(&symbol).1.map(str::to_owned);
    charge(row, &mut fill)?;
    entries.fills.push(fill);
    Ok(())
}

/// The fee, or the one of the list of fees; of several in different currencies the others are noted.
fn charge(row: &mut Row<'_>, fill: &mut PaperFill) -> Result<(), Stop> {
    let symbol = fill.symbol.clone();
    let base = pair(&symbol).0;
    if let Some(amount) = row.cash("fee.cost")? {
        row.charge(fill, amount, row.text("fee.currency"), base);
        return Ok(());
    }
    let Some(fees) = row.text("fees").filter(|fees| *fees != "[]") else { return Ok(()) };
    let fees = json_records(Path::new("fees"), fees).map_err(|_| row.unread("fees", "expected an array of fees"))?;
    for (k, fee) in fees.iter().enumerate() {
        let read = row.within(fee, "fees", |fee| Ok((fee.cash("cost")?, fee.text("currency").map(str::to_owned))))?;
        let Some((Some(amount), currency)) = read else { continue };
        if k == 0 {
            row.charge(fill, amount, currency.as_deref(), base);
        } else {
            let currency = currency.unwrap_or_default();
            row.note(FindingKind::FeeInOtherCurrency, format!("a further fee of {amount} {currency} is in no sum"));
        }
    }
    Ok(())
}
