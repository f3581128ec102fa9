//! hummingbot: the database of a strategy, and the table of trades it appends to beside it.
//!
//! Source: `hummingbot/model/order.py`, `order_status.py`, `trade_fill.py`, `decimal_type_decorator.py` and
//! `hummingbot/core/data_type/trade_fee.py`.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::super::{FindingKind, OrderWords, PaperFill, PaperOrder, PaperStatus, TimeColumn, TimeMeaning};
use super::draft::{Draft, Entries, join_orders, order_of_fill};
use super::row::{Row, side_of};
use super::settings::worth;
use super::stamp::Written;
use super::{Format, Stop};
use crate::io::{InputError, Records, json_records};
use crate::market::{Cash, Price, Quantity, Side};
use crate::sim2real::Timestamp;

pub(super) static FORMAT: Format = Format {
    id: "hummingbot",
    title: "the database of a hummingbot strategy, or its trades_*.csv",
    known_by: "tables `Order` with `creation_timestamp` and `last_status`, `TradeFill` with `trade_fee`; CSV with the columns of `TradeFill`",
    claims: |table| is_orders(table) || is_fills(table) || is_status(table),
    read,
    tables: &["Order", "OrderStatus", "TradeFill"],
};

fn is_orders(table: &Records) -> bool {
    table.has_all(&["id", "creation_timestamp", "last_status", "base_asset", "quote_asset"])
}

fn is_fills(table: &Records) -> bool {
    table.has_all(&["trade_type", "trade_fee", "exchange_trade_id", "base_asset", "quote_asset"])
}

fn is_status(table: &Records) -> bool {
    table.table().is_some() && table.has_all(&["order_id", "timestamp", "status"])
}

/// Times are milliseconds.
const MILLISECONDS: Written = Written::Count(1_000_000);

fn read(tables: &[&Records], draft: &mut Draft<'_>) -> Result<(), InputError> {
    let of = |is: fn(&Records) -> bool| tables.iter().copied().filter(move |table| is(table));
    draft.clock(TimeColumn::EndedAt, "last_update_timestamp", TimeMeaning::Updated);
    draft.clock(TimeColumn::FilledAt, "timestamp of TradeFill", TimeMeaning::Reported);
    // Orders have no side of their own: their events and their fills have.
    let mut sides: HashMap<String, Side> = HashMap::new();
    for table in of(is_status) {
        for row in table.iter() {
            sides.extend(
                row.get("order_id").zip(row.get("status").and_then(side_of_event)).map(|(id, side)| (id.to_owned(), side)),
            );
        }
    }
    for table in of(is_fills) {
        for row in table.iter() {
            sides.extend(
                row.get("order_id").zip(row.get("trade_type").and_then(side_of)).map(|(id, side)| (id.to_owned(), side)),
            );
        }
    }
    for table in of(is_orders) {
        draft.clock(TimeColumn::DecidedAt, "creation_timestamp", TimeMeaning::Submitted);
        draft.each(table, |row, entries| order(row, &sides, entries))?;
    }
    let mut stated = Vec::new();
    for table in of(is_fills) {
        draft.each(table, |row, entries| {
            let fill = fill(row)?;
            stated.extend(order_of(row, &fill));
            entries.fills.push(fill);
            Ok(())
        })?;
    }
    of_fills(draft, stated);
    Ok(())
}

/// Adds the orders that only their fills tell of.
fn of_fills(draft: &mut Draft<'_>, mut stated: Vec<PaperOrder>) {
    let known: HashSet<String> = draft.log.orders.iter().map(|order| order.id.clone()).collect();
    stated.retain(|order| !known.contains(&order.id));
    let stated = join_orders(stated, &draft.log.fills);
    if !stated.is_empty() {
        draft.clock(TimeColumn::DecidedAt, "timestamp less age", TimeMeaning::Submitted);
        let message = format!(
            "{} orders are known by their fills alone: not how much was ordered, and when only by `age`",
            stated.len()
        );
        draft.note(FindingKind::Note, message);
        draft.note(FindingKind::Survivorship, "a table of trades has no orders that never filled");
        draft.log.orders.extend(stated);
    }
}

fn side_of_event(event: &str) -> Option<Side> {
    ["Buy", "Sell"].into_iter().find(|word| event.starts_with(word)).and_then(side_of)
}

/// Whether a cell of a database is an integer of millionths, as `SqliteDecimal(6)` stores it; older bots stored a number with a
/// point, and tables of text have one.
fn is_millionths(row: &Row<'_>, key: &str) -> bool {
    row.is_of_database() && row.text(key).is_some_and(|text| text.bytes().all(|b| b.is_ascii_digit() || b == b'-'))
}

/// A count of millionths in units of 1e-9.
fn nano(row: &Row<'_>, key: &str) -> Result<i64, Stop> {
    let count: Option<i64> = row.text(key).and_then(|text| text.parse().ok());
    count.and_then(|count| count.checked_mul(1_000)).ok_or_else(|| row.unread(key, "the number is beyond what is held"))
}

fn price(row: &mut Row<'_>, key: &str) -> Result<Option<Price>, Stop> {
    let price = if is_millionths(row, key) { Some(Price(nano(row, key)?)) } else { row.price(key)? };
    Ok(price.filter(|price| price.0 != 0))
}

fn quantity(row: &mut Row<'_>, key: &str) -> Result<Option<Quantity>, Stop> {
    if is_millionths(row, key) { nano(row, key).map(|nano| Some(Quantity(nano))) } else { row.quantity(key) }
}

fn order(row: &mut Row<'_>, sides: &HashMap<String, Side>, entries: &mut Entries) -> Result<(), Stop> {
    let (id, status) = (row.need("id")?, row.need("last_status")?);
    let of_id =
        || ["buy", "sell"].into_iter().find(|side| id.to_lowercase().starts_with(&format!("{side}-"))).and_then(side_of);
    let side = side_of_event(status).or_else(|| sides.get(id).copied()).or_else(of_id);
    let side = side.ok_or_else(|| row.unread("id", "neither events nor fills nor the id say whether it buys or sells"))?;
    let mut order = row.order(id, row.need("symbol")?, side);
    order.client_id = row.text_of(&["exchange_order_id", "exchange_trade_id"]).map(str::to_owned);
    order.quantity = quantity(row, "amount")?;
    order.kind = row.text("order_type").map(OrderWords::of_word);
    order.limit_price = price(row, "price")?.filter(|_| order.kind != Some(OrderWords::Market));
    order.decided_at = row.time("creation_timestamp", MILLISECONDS)?;
    order.status = Some(status_of(status));
    let last = row.time("last_update_timestamp", MILLISECONDS)?;
    order.ended_at = last.filter(|_| order.status.as_ref().is_some_and(PaperStatus::is_final));
    order.strategy = row.owned("strategy");
    order.tag = row.owned("config_file_path");
    entries.orders.push(order);
    Ok(())
}

/// The status that an event leaves an order in. `OrderFilled` is one fill, perhaps not of all.
fn status_of(event: &str) -> PaperStatus {
    match event {
        "BuyOrderCreated" | "SellOrderCreated" | "OrderFilled" => PaperStatus::Open,
        "BuyOrderCompleted" | "SellOrderCompleted" => PaperStatus::Filled,
        "OrderCancelled" => PaperStatus::Cancelled,
        "OrderFailure" => PaperStatus::Rejected,
        "OrderExpired" => PaperStatus::Expired,
        other => PaperStatus::of_word(other),
    }
}

fn fill(row: &mut Row<'_>) -> Result<PaperFill, Stop> {
    let traded = quantity(row, "amount")?.filter(|quantity| quantity.0 > 0);
    let traded = traded.ok_or_else(|| row.unread("amount", "expected a quantity above 0"))?;
    let price = price(row, "price")?.filter(|price| price.0 > 0);
    let price = price.ok_or_else(|| row.unread("price", "expected a price above 0"))?;
    let at = row.need_time("timestamp", MILLISECONDS)?;
    let mut fill = PaperFill::new(row.need("symbol")?, at, traded, price, row.place());
    fill.id = row.owned("exchange_trade_id");
    fill.order_id = row.owned("order_id");
    fill.side = Some(row.need_side("trade_type")?);
    fill.currency = row.owned("quote_asset");
    if let Some(fee) = row.text("trade_fee") {
        charge(row, fee, &mut fill)?;
    }
    Ok(fill)
}

/// What a fill says of its order: it was made `age` before the fill, in whole seconds, or "n/a".
fn order_of(row: &mut Row<'_>, fill: &PaperFill) -> Option<PaperOrder> {
    let mut order = order_of_fill(fill)?;
    order.kind = row.text("order_type").map(OrderWords::of_word);
    order.strategy = row.owned("strategy");
    order.tag = row.owned("config_file_path");
    order.ended_at = Some(fill.filled_at);
    order.decided_at = row.text("age").and_then(age).and_then(|age| {
        let nanos = age.checked_mul(Timestamp::NANOS)?;
        fill.filled_at.0.checked_sub(nanos).map(Timestamp)
    });
    if order.decided_at.is_none() && row.text("age").is_some() {
        row.note_cell(FindingKind::Note, "age", "it does not say when the order was made");
    }
    Some(order)
}

/// Whole seconds, or hours, minutes and seconds.
fn age(text: &str) -> Option<i64> {
    let parts: Option<Vec<i64>> = text.split(':').map(|part| part.trim().parse::<u32>().ok().map(i64::from)).collect();
    match parts?.as_slice() {
        [seconds] => Some(*seconds),
        [hours, minutes, seconds] => Some(hours * 3_600 + minutes * 60 + seconds),
        _ => None,
    }
}

/// A fee is a part of what was paid, and flat amounts beside: `{"percent": "0.001", "percent_token": null, "flat_fees": [...]}`. The
/// part counts in the quote currency, whatever token it is taken in.
fn charge(row: &mut Row<'_>, text: &str, fill: &mut PaperFill) -> Result<(), Stop> {
    let refuse = |row: &Row<'_>| row.unread("trade_fee", "expected a fee as JSON");
    // Some versions write the texts of Python, with single quotes.
    let json = if text.contains('"') { text.to_owned() } else { text.replace('\'', "\"").replace("None", "null") };
    let fees = json_records(Path::new("trade_fee"), &json).map_err(|_| refuse(row))?;
    let fee = fees.iter().next().ok_or_else(|| refuse(row))?;
    let percent = fee.get("percent").map(str::parse::<Price>).transpose().map_err(|_| refuse(row))?;
    let mut charges: Vec<(Cash, Option<String>)> = Vec::new();
    if let Some(rate) = percent.filter(|rate| rate.0 != 0) {
        let amount = worth(fill.price * fill.quantity, rate).ok_or_else(|| refuse(row))?;
        let token = fee.get("percent_token").map(|token| format!(", taken in {token}")).unwrap_or_default();
        row.note(FindingKind::FeeFromRate, format!("{rate} of what the fill came to{token}"));
        charges.push((amount, fill.currency.clone()));
    }
    let flat = fee.get("flat_fees").filter(|flat| *flat != "[]");
    if let Some(flat) = flat {
        let flat = json_records(Path::new("flat_fees"), flat).map_err(|_| refuse(row))?;
        for fee in flat.iter() {
            let amount = fee.get("amount").and_then(|amount| amount.parse::<Cash>().ok()).ok_or_else(|| refuse(row))?;
            charges.push((amount, fee.get("token").map(str::to_owned)));
        }
        if !flat.unread().is_empty() {
            row.note_cell(FindingKind::Note, "trade_fee", "flat fees of an old form are not read");
        }
    }
    let base = row.owned("base_asset");
    let first = if charges.is_empty() { (Cash::ZERO, fill.currency.clone()) } else { charges.remove(0) };
    row.charge(fill, first.0, first.1.as_deref(), base.as_deref());
    for (amount, currency) in charges {
        let currency = currency.unwrap_or_default();
        row.note(FindingKind::FeeInOtherCurrency, format!("a further fee of {amount} {currency} is in no sum"));
    }
    Ok(())
}
