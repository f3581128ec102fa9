//! Alpaca: orders as `GET /v2/orders` gives them, fills as `GET /v2/account/activities` does.
//!
//! Source: Alpaca's reference of its trading API, *Orders* and *Account Activities*.

use std::path::Path;

use super::super::{FindingKind, OrderWords, PaperFill, PaperOrder, PaperStatus, TimeColumn, TimeMeaning};
use super::draft::{Draft, Entries};
use super::pair::pair;
use super::row::{Row, side_of};
use super::stamp::Written;
use super::{Format, Stop};
use crate::io::{InputError, Records, json_records};

pub(super) static FORMAT: Format = Format {
    id: "alpaca",
    title: "Alpaca's orders and activities as JSON: arrays, pages or newline JSON",
    known_by: "orders with `client_order_id`, `filled_qty` and `submitted_at`, activities with `activity_type`",
    claims: |table| is_orders(table) || is_activities(table),
    read,
    tables: &[],
};

fn is_orders(table: &Records) -> bool {
    table.has_all(&["id", "client_order_id", "filled_qty", "submitted_at", "symbol"])
}

fn is_activities(table: &Records) -> bool {
    table.has("activity_type")
}

/// All amounts are in dollars, but for pairs of crypto.
const CURRENCY: &str = "USD";

fn read(tables: &[&Records], draft: &mut Draft<'_>) -> Result<(), InputError> {
    draft.clock(TimeColumn::DecidedAt, "created_at, or submitted_at where that is earlier", TimeMeaning::Accepted);
    draft.clock(TimeColumn::SubmittedAt, "submitted_at", TimeMeaning::Accepted);
    draft.clock(TimeColumn::EndedAt, "filled_at, canceled_at, expired_at, failed_at or replaced_at", TimeMeaning::Executed);
    let activities = tables.iter().any(|table| is_activities(table));
    let (source, meaning) = match activities {
        true => ("transaction_time", TimeMeaning::Executed),
        false => ("filled_at", TimeMeaning::Updated),
    };
    draft.clock(TimeColumn::FilledAt, source, meaning);
    for table in tables {
        draft.each(table, |row, entries| match row.text("activity_type") {
            Some("FILL") => activity(row, entries),
            Some(other) => {
                row.note(FindingKind::PassedOver, format!("an activity of type {other} is no fill"));
                Ok(())
            }
            None => {
                let order = order(row, None)?;
                let legs = row.text("legs").filter(|legs| *legs != "[]");
                let id = order.id.clone();
                add(row, order, entries)?;
                legs.map_or(Ok(()), |legs| add_legs(row, legs, &id, entries))
            }
        })?;
    }
    Ok(())
}

fn currency(symbol: &str) -> &str {
    pair(symbol).1.unwrap_or(CURRENCY)
}

/// Adds an order, and the fill that stands for its executions. Of one that works still and was filled in part no end is known:
/// its record changed no earlier than that.
fn add(row: &mut Row<'_>, order: PaperOrder, entries: &mut Entries) -> Result<(), Stop> {
    let last = order.ended_at.or(row.time("updated_at", Written::Rfc3339)?);
    entries.total(&PaperOrder { ended_at: last, ..order.clone() }, Some(currency(&order.symbol)));
    entries.orders.push(order);
    Ok(())
}

fn order(row: &mut Row<'_>, parent: Option<&str>) -> Result<PaperOrder, Stop> {
    let mut order = row.order(row.need("id")?, row.need("symbol")?, row.need_side("side")?);
    order.client_id = row.owned("client_order_id");
    order.quantity = row.quantity("qty")?;
    if order.quantity.is_none() {
        let amount = row.text("notional").unwrap_or("an unknown amount");
        row.note(FindingKind::Notional, format!("order {:?} was for {amount} {CURRENCY}", order.id));
    }
    order.kind = row.text_of(&["type", "order_type"]).map(OrderWords::of_word);
    order.limit_price = row.price_above_zero("limit_price")?;
    order.stop_price = row.price_above_zero("stop_price")?;
    order.time_in_force = row.owned("time_in_force");
    order.kind = order.kind.map(|kind| at_auction(kind, order.time_in_force.as_deref()));
    let (created, submitted) = (row.time("created_at", Written::Rfc3339)?, row.time("submitted_at", Written::Rfc3339)?);
    order.submitted_at = submitted;
    order.decided_at = [created, submitted].into_iter().flatten().min();
    if let Some((created, submitted)) = created.zip(submitted).filter(|(created, submitted)| submitted < created) {
        let early = created.seconds_since(submitted) * 1e3;
        let message = format!("`submitted_at` is {early:.3} ms before `created_at`; the earlier counts as the first time");
        row.note(FindingKind::TimesOutOfOrder, message);
    }
    let ends = ["filled_at", "canceled_at", "expired_at", "failed_at", "replaced_at"];
    order.ended_at = row.time_of(&ends, Written::Rfc3339)?;
    order.status = row.text("status").map(PaperStatus::of_word);
    order.filled = row.quantity("filled_qty")?;
    order.average_price = row.price_above_zero("filled_avg_price")?;
    order.replaced_by = row.owned("replaced_by");
    order.parent = row.owned("replaces").or_else(|| parent.map(str::to_owned));
    Ok(order)
}

/// Orders for an auction are market or limit orders that are in force for that alone.
fn at_auction(kind: OrderWords, time_in_force: Option<&str>) -> OrderWords {
    match (time_in_force, kind) {
        (Some("opg"), OrderWords::Market) => OrderWords::MarketOnOpen,
        (Some("opg"), OrderWords::Limit) => OrderWords::LimitOnOpen,
        (Some("cls"), OrderWords::Market) => OrderWords::MarketOnClose,
        (Some("cls"), OrderWords::Limit) => OrderWords::LimitOnClose,
        (_, kind) => kind,
    }
}

/// The orders of a bracket, which stand within the one they belong to.
fn add_legs(row: &mut Row<'_>, legs: &str, parent: &str, entries: &mut Entries) -> Result<(), Stop> {
    let legs = json_records(Path::new("legs"), legs).map_err(|_| row.unread("legs", "expected an array of orders"))?;
    for leg in legs.iter() {
        row.within(leg, "legs", |leg| {
            let order = order(leg, Some(parent))?;
            add(leg, order, entries)
        })?;
    }
    Ok(())
}

fn activity(row: &mut Row<'_>, entries: &mut Entries) -> Result<(), Stop> {
    let symbol = row.need("symbol")?;
    let (at, quantity) = (row.need_time("transaction_time", Written::Rfc3339)?, row.need_quantity("qty")?);
    let mut fill = PaperFill::new(symbol, at, quantity, row.need_price("price")?, row.place());
    fill.id = row.owned("id");
    fill.order_id = row.owned("order_id");
    fill.side = row.text("side").and_then(side_of);
    fill.currency = Some(currency(symbol).to_owned());
    entries.fills.push(fill);
    Ok(())
}
