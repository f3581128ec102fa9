//! NautilusTrader: the reports of orders and fills of a backtest or a live node, as CSV.
//!
//! Source: `nautilus_trader.analysis.reporter.ReportProvider`, version 1.221.

use std::collections::HashMap;

use super::super::{FindingKind, OrderWords, PaperFill, PaperStatus, TimeColumn, TimeMeaning};
use super::draft::{Draft, Entries};
use super::row::{Row, side_of};
use super::stamp::Written;
use super::{Format, Stop};
use crate::io::{InputError, Place, Records};
use crate::market::Cash;

pub(super) static FORMAT: Format = Format {
    id: "nautilus",
    title: "the CSV reports of NautilusTrader: orders, fills and order fills",
    known_by: "`client_order_id` and `instrument_id` with `ts_init` and `filled_qty`, or with `ts_event` and `last_px`",
    claims: |table| is_orders(table) || is_fills(table),
    read,
    tables: &[],
};

fn is_orders(table: &Records) -> bool {
    table.has_all(&["client_order_id", "instrument_id", "filled_qty", "ts_init", "ts_last"])
}

fn is_fills(table: &Records) -> bool {
    table.has_all(&["client_order_id", "instrument_id", "last_qty", "last_px", "ts_event"])
}

fn read(tables: &[&Records], draft: &mut Draft<'_>) -> Result<(), InputError> {
    draft.clock(TimeColumn::DecidedAt, "ts_init", TimeMeaning::Decided);
    draft.clock(TimeColumn::EndedAt, "ts_last", TimeMeaning::Updated);
    let executions = tables.iter().any(|table| is_fills(table));
    let (source, meaning) = if executions { ("ts_event", TimeMeaning::Executed) } else { ("ts_last", TimeMeaning::Updated) };
    draft.clock(TimeColumn::FilledAt, source, meaning);
    if !executions {
        draft.note(FindingKind::Note, "there is no report of fills: each order has one fill, at its average price");
    }
    one_run(tables)?;
    for table in tables {
        draft.each(table, if is_orders(table) { order } else { fill })?;
    }
    Ok(())
}

/// Every run numbers its orders from 1: the reports of two have the same ids for other orders.
fn one_run(tables: &[&Records]) -> Result<(), InputError> {
    let mut first: HashMap<&str, &Records> = HashMap::new();
    for table in tables.iter().filter(|table| is_fills(table)) {
        for row in table.iter() {
            let Some(id) = row.get("client_order_id") else { continue };
            let known = first.entry(id).or_insert(table);
            if known.path() != table.path() {
                let message = format!("order {id} is filled in {} too: these are the reports of two runs", known.name());
                return Err(InputError::new(table.path(), message)
                    .at(Place::Row(row.row()))
                    .hint("name the files of one run, not their folder"));
            }
        }
    }
    Ok(())
}

fn order(row: &mut Row<'_>, entries: &mut Entries) -> Result<(), Stop> {
    let mut order = row.order(row.need("client_order_id")?, row.need("instrument_id")?, row.need_side("side")?);
    order.client_id = row.owned("venue_order_id");
    order.quantity = row.quantity("quantity")?;
    if row.is_true("is_quote_quantity") {
        row.note_cell(FindingKind::Notional, "quantity", "the order was for an amount in the quote currency");
        order.quantity = None;
    }
    order.kind = row.text("type").map(OrderWords::of_word);
    if row.is_true("is_post_only") && order.kind == Some(OrderWords::Limit) {
        order.kind = Some(OrderWords::PostOnly);
    }
    order.limit_price = row.price_above_zero("price")?;
    order.stop_price = row.price_above_zero("trigger_price")?;
    order.time_in_force = row.text("time_in_force").map(str::to_lowercase);
    order.decided_at = row.time("ts_init", Written::Contract)?;
    order.status = row.text("status").map(PaperStatus::of_word);
    let last = row.time("ts_last", Written::Contract)?;
    order.ended_at = last.filter(|_| order.status.as_ref().is_some_and(PaperStatus::is_final));
    order.filled = row.quantity("filled_qty")?;
    order.average_price = row.price_above_zero("avg_px")?;
    order.parent = row.owned("parent_order_id");
    order.strategy = row.owned("strategy_id");
    order.tag = row.owned("tags");
    // Of an order that is still open the last change was its last fill, or came after it.
    let stated = super::super::PaperOrder { ended_at: last, ..order.clone() };
    let fees = row.text("commissions").map(|text| text.trim_matches(['[', ']', '\'', '"'])).map(str::to_owned);
    if let Some(fill) = entries.total(&stated, None) {
        fill.liquidity = row.liquidity("liquidity_side");
        if let Some(fee) = fees.filter(|fee| !fee.is_empty() && !fee.contains(',')) {
            charge(row, "commissions", &fee, fill)?;
        }
    }
    entries.orders.push(order);
    Ok(())
}

fn fill(row: &mut Row<'_>, entries: &mut Entries) -> Result<(), Stop> {
    let (at, quantity) = (row.need_time("ts_event", Written::Contract)?, row.need_quantity("last_qty")?);
    let mut fill = PaperFill::new(row.need("instrument_id")?, at, quantity, row.need_price("last_px")?, row.place());
    fill.id = row.owned("trade_id");
    fill.order_id = row.owned("client_order_id");
    fill.side = row.text("order_side").and_then(side_of);
    fill.currency = row.owned("currency");
    fill.liquidity = row.liquidity("liquidity_side");
    if let Some(fee) = row.text("commission") {
        charge(row, "commission", fee, &mut fill)?;
    }
    entries.fills.push(fill);
    Ok(())
}

/// A commission is a number and its currency, as `5.56286400 USDT`.
fn charge(row: &mut Row<'_>, key: &str, text: &str, fill: &mut PaperFill) -> Result<(), Stop> {
    let parts = text.split_once(' ').and_then(|(amount, currency)| Some((amount.parse::<Cash>().ok()?, currency.trim())));
    let (amount, currency) = parts.ok_or_else(|| row.unread(key, "expected an amount and its currency, as `5.56 USDT`"))?;
    if fill.currency.is_none() {
        fill.currency = Some(currency.to_owned());
    }
    row.charge(fill, amount, Some(currency), None);
    Ok(())
}
