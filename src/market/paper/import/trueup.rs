//! Logs in the form of this program: `orders.*` and `fills.*`, as backtests and imports write them.

use std::collections::HashMap;

use super::super::{Charge, FillOrigin, Liquidity, OrderWords, PaperFill, PaperStatus, TimeColumn, TimeMeaning};
use super::draft::{Draft, Entries};
use super::row::{Row, side_of};
use super::stamp::Written;
use super::{Format, Stop};
use crate::io::{InputError, Records};
use crate::market::Cash;

pub(super) static FORMAT: Format = Format {
    id: "trueup",
    title: "a folder with orders and fills, as `trueup backtest` and `trueup data import` write them",
    known_by: "orders with `order_id`, `decided_at` and `qty`, fills with `order_id`, `filled_at` and `qty`",
    claims: |table| is_orders(table) || is_fills(table),
    read,
    tables: &[],
};

fn is_orders(table: &Records) -> bool {
    table.has_all(&["order_id", "decided_at", "side", "qty"])
}

fn is_fills(table: &Records) -> bool {
    table.has_all(&["order_id", "filled_at", "qty", "price"])
}

fn read(tables: &[&Records], draft: &mut Draft<'_>) -> Result<(), InputError> {
    let (orders, fills): (Vec<&Records>, Vec<&Records>) = tables.iter().partition(|table| is_orders(table));
    for table in &orders {
        clock(draft, table, TimeColumn::DecidedAt, TimeMeaning::Decided);
        clock(draft, table, TimeColumn::SubmittedAt, TimeMeaning::Submitted);
        clock(draft, table, TimeColumn::EndedAt, TimeMeaning::Updated);
        draft.each(table, order)?;
    }
    // Fills of a log that has them on one symbol name none.
    let symbols: HashMap<String, String> =
        draft.log.orders.iter().map(|order| (order.id.clone(), order.symbol.clone())).collect();
    for table in &fills {
        clock(draft, table, TimeColumn::FilledAt, TimeMeaning::Executed);
        draft.each(table, |row, entries| {
            let of_order = || row.text("order_id").and_then(|id| symbols.get(id)).map(String::as_str);
            let symbol = row.text("symbol").or_else(of_order).map(str::to_owned);
            let symbol =
                symbol.ok_or_else(|| row.unread("order_id", "neither the fill nor an order says what was traded"))?;
            fill(row, &symbol, entries)
        })?;
    }
    Ok(())
}

/// What a column is says the one beside it, where the log was imported.
fn clock(draft: &mut Draft<'_>, table: &Records, column: TimeColumn, usual: TimeMeaning) {
    let said = table.iter().find_map(|row| row.get(&format!("{}_is", column.word())));
    let meaning = said.and_then(TimeMeaning::of_word).unwrap_or(usual);
    draft.clock(column, column.word(), meaning);
}

/// The key of the exact texts of a number, where there are any.
fn exact<'k>(row: &Row<'_>, exact: &'k str, plain: &'k str) -> &'k str {
    if row.text(exact).is_some() { exact } else { plain }
}

fn order(row: &mut Row<'_>, entries: &mut Entries) -> Result<(), Stop> {
    let mut order = row.order(row.need("order_id")?, row.need("symbol")?, row.need_side("side")?);
    order.quantity = row.quantity(exact(row, "qty_exact", "qty"))?;
    order.kind = row.text("type").map(OrderWords::of_word);
    order.decided_at = row.time("decided_at", Written::Contract)?;
    order.submitted_at = row.time("submitted_at", Written::Contract)?;
    order.ended_at = row.time("ended_at", Written::Contract)?;
    order.limit_price = row.price(exact(row, "limit_price_exact", "limit_price"))?;
    order.stop_price = row.price(exact(row, "stop_price_exact", "stop_price"))?;
    order.average_price = row.price(exact(row, "average_price_exact", "average_price"))?;
    order.seen_bid = row.price(exact(row, "seen_bid_exact", "seen_bid"))?;
    order.seen_ask = row.price(exact(row, "seen_ask_exact", "seen_ask"))?;
    order.filled = row.quantity(exact(row, "filled_qty_exact", "filled_qty"))?;
    order.status = row.text("status").map(PaperStatus::of_word);
    order.time_in_force = row.owned("time_in_force");
    order.client_id = row.owned("client_order_id");
    order.replaced_by = row.owned("replaced_by");
    order.parent = row.owned("parent");
    order.strategy = row.owned("strategy");
    order.tag = row.owned("tag");
    entries.orders.push(order);
    Ok(())
}

fn fill(row: &mut Row<'_>, symbol: &str, entries: &mut Entries) -> Result<(), Stop> {
    let quantity = row.need_quantity(exact(row, "qty_exact", "qty"))?;
    let price = row.need_price(exact(row, "price_exact", "price"))?;
    let mut fill = PaperFill::new(symbol, row.need_time("filled_at", Written::Contract)?, quantity, price, row.place());
    fill.order_id = row.owned("order_id");
    fill.id = row.owned("fill_id");
    fill.side = row.text("side").and_then(side_of);
    fill.currency = row.owned("currency");
    fill.liquidity = row.text("liquidity").and_then(Liquidity::of_word);
    fill.fee = row.cash(exact(row, "fee_exact", "fee"))?;
    if row.has_key("fee_charged") {
        let amount = row.cash(exact(row, "fee_charged_exact", "fee_charged"))?;
        fill.charged = amount.map(|amount| Charge { amount, currency: row.owned("fee_currency") });
    } else {
        fill.fee = fill.fee.map(nearest_nano);
        fill.charged = fill.fee.map(|amount| Charge { amount, currency: None });
    }
    if row.text("origin") == Some(FillOrigin::OrderTotal.word()) {
        fill.origin = FillOrigin::OrderTotal;
    }
    entries.fills.push(fill);
    Ok(())
}

/// A fee as a backtest charges it, in whole 1e-9: what its table holds beyond that are the last bits of a floating-point number.
fn nearest_nano(fee: Cash) -> Cash {
    const NANO: i128 = 1_000_000_000;
    let half = if fee.0 < 0 { -NANO / 2 } else { NANO / 2 };
    Cash(fee.0.saturating_add(half) / NANO * NANO)
}
