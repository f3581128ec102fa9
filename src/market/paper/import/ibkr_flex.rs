//! Interactive Brokers: Flex queries of trades and of trade confirmations, as XML.
//!
//! Source: Interactive Brokers, *Flex Query reference*, sections *Trades* and *Trade Confirmations*.

use std::collections::HashSet;

use super::super::{FindingKind, OrderWords, PaperFill, PaperFinding, PaperOrder, PaperStatus, TimeColumn, TimeMeaning};
use super::draft::{Draft, Entries, join_orders, order_of_fill};
use super::row::{Row, side_of};
use super::stamp::Written;
use super::{Format, Stop};
use crate::io::{InputError, Records};
use crate::market::{Cash, Quantity, Side};
use crate::sim2real::Timestamp;

pub(super) static FORMAT: Format = Format {
    id: "ibkr_flex",
    title: "a Flex query of Interactive Brokers as XML, with trades or trade confirmations",
    known_by: "elements `Order`, `Trade` or `TradeConfirm` with `buySell` and `levelOfDetail`",
    claims: |table| {
        let named = table.table().is_some_and(|name| ["Order", "Trade", "TradeConfirm"].contains(&name));
        named && table.has_all(&["buySell", "levelOfDetail"])
    },
    read,
    tables: &[],
};

fn read(tables: &[&Records], draft: &mut Draft<'_>) -> Result<(), InputError> {
    draft.clock(TimeColumn::DecidedAt, "orderTime", TimeMeaning::Accepted);
    draft.clock(TimeColumn::EndedAt, "dateTime of the order", TimeMeaning::Executed);
    draft.clock(TimeColumn::FilledAt, "dateTime", TimeMeaning::Executed);
    let mut busts = Vec::new();
    let mut stated = Vec::new();
    for table in tables {
        draft.each(table, |row, entries| match row.text("levelOfDetail") {
            _ if passed_over(row) => Ok(()),
            Some("ORDER") => order(row, entries),
            Some("EXECUTION") if is_bust(row) => {
                busts.push(execution(row)?.0);
                Ok(())
            }
            Some("EXECUTION") => {
                let (fill, order) = execution(row)?;
                stated.extend(order);
                entries.fills.push(fill);
                Ok(())
            }
            _ => {
                let level = row.text("levelOfDetail").unwrap_or("no level of detail");
                row.note(FindingKind::PassedOver, format!("a row of {level} is neither an order nor an execution"));
                Ok(())
            }
        })?;
    }
    take_back(draft, busts);
    if !draft.log.orders.is_empty() {
        draft.note(FindingKind::Note, "rows of orders state what was filled of them, not how much was ordered");
    }
    // Orders of which there are executions only are what these say of them.
    let known: HashSet<String> = draft.log.orders.iter().map(|order| order.id.clone()).collect();
    stated.retain(|order: &PaperOrder| !known.contains(&order.id));
    let of_executions = join_orders(stated, &draft.log.fills);
    if !of_executions.is_empty() {
        let message =
            format!("{} orders are known by their executions alone: not how much was ordered", of_executions.len());
        draft.note(FindingKind::Note, message);
    }
    draft.log.orders.extend(of_executions);
    draft.note(FindingKind::Survivorship, "a Flex query of trades has no orders that never filled");
    Ok(())
}

/// What the broker booked without an order of the trader: expiries, assignments, its own exchange of currencies.
fn passed_over(row: &mut Row<'_>) -> bool {
    let booked = row.text("transactionType").is_some_and(|kind| kind.eq_ignore_ascii_case("BookTrade"));
    let exchanged = row.text("notes").is_some_and(|notes| notes.split(';').any(|code| code == "AFx"));
    let why = match (booked, exchanged) {
        (true, _) => "a book trade: an expiry, an exercise or a transfer, not an order",
        (_, true) => "an exchange of currencies that the broker made, not an order",
        _ => return false,
    };
    row.note(FindingKind::PassedOver, why);
    true
}

/// Whether an execution takes back another.
fn is_bust(row: &Row<'_>) -> bool {
    let cancelled = row.text("buySell").is_some_and(|side| side.contains("Ca."));
    cancelled || row.text("transactionType").is_some_and(|kind| kind == "TradeCancel")
}

/// The size of a quantity, which is negative for what is sold and for what is taken back.
fn size(row: &mut Row<'_>) -> Result<Quantity, Stop> {
    let quantity = row.quantity("quantity")?.map(Quantity::abs).filter(|quantity| quantity.0 > 0);
    quantity.ok_or_else(|| row.unread("quantity", "expected a quantity other than 0"))
}

fn kind(row: &Row<'_>) -> Option<OrderWords> {
    // An order that was changed has all of its kinds, the last of which filled.
    row.text("orderType").and_then(|kinds| kinds.split(';').next_back()).map(OrderWords::of_word)
}

fn symbol<'a>(row: &Row<'a>) -> Result<&'a str, Stop> {
    row.need("symbol")
}

fn multiplier(row: &mut Row<'_>) {
    let one = row.text("multiplier").is_none_or(|text| text.parse::<Quantity>().is_ok_and(|value| value.0 == 1_000_000_000));
    if !one {
        row.note_cell(FindingKind::Multiplier, "multiplier", "the quantity is in contracts of more than one unit");
    }
}

fn side(row: &Row<'_>) -> Result<Side, Stop> {
    let word = row.need("buySell")?.trim_end_matches("(Ca.)");
    side_of(word).ok_or_else(|| row.unread("buySell", "expected BUY or SELL"))
}

fn order(row: &mut Row<'_>, entries: &mut Entries) -> Result<(), Stop> {
    let id = row.text_of(&["ibOrderID", "orderID"]).ok_or_else(|| row.unread("orderID", "expected an id of the order"))?;
    let mut order = row.order(id, symbol(row)?, side(row)?);
    order.client_id = row.owned("orderReference");
    order.kind = kind(row);
    order.decided_at = row.time("orderTime", Written::Digits)?;
    order.ended_at = time(row)?;
    order.filled = Some(size(row)?);
    order.average_price = Some(row.need_price(if row.text("tradePrice").is_some() { "tradePrice" } else { "price" })?);
    order.status = Some(PaperStatus::Filled);
    multiplier(row);
    let currency = row.owned("currency");
    if let Some(fill) = entries.total(&order, currency.as_deref()) {
        fee(row, fill)?;
    }
    entries.orders.push(order);
    Ok(())
}

/// A fill, and its order as far as the fill states it.
fn execution(row: &mut Row<'_>) -> Result<(PaperFill, Option<PaperOrder>), Stop> {
    let at = time(row)?.ok_or_else(|| row.unread("dateTime", "expected a time"))?;
    let price = row.need_price(if row.text("tradePrice").is_some() { "tradePrice" } else { "price" })?;
    let mut fill = PaperFill::new(symbol(row)?, at, size(row)?, price, row.place());
    fill.id = row.text_of(&["ibExecID", "execID", "tradeID", "transactionID"]).map(str::to_owned);
    fill.order_id = row.text_of(&["ibOrderID", "orderID"]).map(str::to_owned);
    fill.side = Some(side(row)?);
    fill.currency = row.owned("currency");
    fee(row, &mut fill)?;
    multiplier(row);
    if row.text("transactionType") == Some("TradeCorrect") {
        row.note(FindingKind::Correction, format!("fill {:?} is a correction", fill.id.as_deref().unwrap_or_default()));
    }
    let order = order_of_fill(&fill).map(|order| (order, row.time("orderTime", Written::Digits)));
    let order = match order {
        Some((mut order, decided)) => {
            (order.decided_at, order.kind, order.ended_at) = (decided?, kind(row), Some(at));
            order.client_id = row.owned("orderReference");
            Some(order)
        }
        None => None,
    };
    Ok((fill, order))
}

fn time(row: &mut Row<'_>) -> Result<Option<Timestamp>, Stop> {
    row.time("dateTime", Written::Digits)
}

/// Commissions are negative where they were paid.
fn fee(row: &mut Row<'_>, fill: &mut PaperFill) -> Result<(), Stop> {
    let key = if row.text("ibCommission").is_some() { "ibCommission" } else { "commission" };
    if let Some(Cash(amount)) = row.cash(key)? {
        let paid = Cash(amount.checked_neg().ok_or_else(|| row.unread(key, "the amount is beyond what is held"))?);
        let currency = row.text_of(&["ibCommissionCurrency", "commissionCurrency"]);
        row.charge(fill, paid, currency, None);
    }
    Ok(())
}

/// Takes fills back that the broker did: those of the same order, quantity and price.
fn take_back(draft: &mut Draft<'_>, busts: Vec<PaperFill>) {
    for bust in busts {
        let same = |fill: &PaperFill| {
            let ids = fill.order_id == bust.order_id && fill.symbol == bust.symbol;
            ids && (fill.quantity, fill.price) == (bust.quantity, bust.price)
        };
        let at = draft.log.fills.iter().position(same);
        let message = match at.map(|at| draft.log.fills.remove(at)) {
            Some(fill) => format!("the fill of {} is taken back", fill.place),
            None => "a fill is taken back that is not in the log".to_owned(),
        };
        let finding = PaperFinding::at(FindingKind::Bust, bust.place, message);
        draft.log.findings.add(finding);
    }
}
