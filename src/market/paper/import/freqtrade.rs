//! freqtrade: the database of a bot (`tradesv3.sqlite`, dry-run or live), in its schemas of 2021 and since.
//!
//! Source: `freqtrade/persistence/trade_model.py`, classes `Order` and `Trade`.

use std::collections::HashMap;

use super::super::{FindingKind, OrderWords, PaperFill, PaperOrder, PaperStatus, TimeColumn, TimeMeaning};
use super::draft::{Draft, Entries};
use super::pair::pair;
use super::row::{Row, side_of};
use super::settings::worth;
use super::stamp::Written;
use super::{Format, Stop};
use crate::io::{InputError, Record, Records};
use crate::market::{Cash, Price, Side};

pub(super) static FORMAT: Format = Format {
    id: "freqtrade",
    title: "the database of a freqtrade bot, or its tables of orders and trades as CSV",
    known_by: "tables of orders with `ft_order_side` and `ft_pair`, and of trades with `open_rate` and `stake_amount`",
    claims: |table| is_orders(table) || is_trades(table),
    read,
    tables: &["orders", "trades"],
};

fn is_orders(table: &Records) -> bool {
    table.has_all(&["ft_order_side", "ft_pair", "order_id", "ft_trade_id"])
}

fn is_trades(table: &Records) -> bool {
    table.has_all(&["open_rate", "stake_amount", "pair", "is_open"])
}

/// What the trade of an order says of it.
#[derive(Default)]
struct Trade {
    strategy: Option<String>,
    /// Tags of entry and exit.
    tags: [Option<String>; 2],
    /// Rates of the fees of entry and exit [fraction].
    rates: [Option<Price>; 2],
    /// What they came to, where the trade says, and in which currency.
    costs: [Option<(Cash, Option<String>)>; 2],
    short: bool,
    /// How many orders of entry and of exit were filled.
    filled: [usize; 2],
}

fn read(tables: &[&Records], draft: &mut Draft<'_>) -> Result<(), InputError> {
    draft.clock(TimeColumn::DecidedAt, "order_date", TimeMeaning::Submitted);
    draft.clock(TimeColumn::EndedAt, "order_filled_date, or else order_update_date", TimeMeaning::Polled);
    draft.clock(TimeColumn::FilledAt, "order_filled_date, or else order_update_date", TimeMeaning::Polled);
    let database = tables.iter().any(|table| table.table().is_some());
    let (read, passed_over): (Vec<&Records>, Vec<&Records>) =
        tables.iter().partition(|table| table.table().is_some() || !database);
    for table in passed_over {
        let message = format!("{} is passed over: it was exported from a database that is read", table.name());
        draft.note(FindingKind::PassedOver, message);
    }
    let mut trades = HashMap::new();
    for table in read.iter().filter(|table| is_trades(table)) {
        draft.each(table, |row, _| {
            trades.insert(row.need("id")?.to_owned(), trade(row)?);
            Ok(())
        })?;
    }
    let orders: Vec<&&Records> = read.iter().filter(|table| is_orders(table)).collect();
    for row in orders.iter().flat_map(|table| table.iter()) {
        if let Some(trade) = row.get("ft_trade_id").and_then(|id| trades.get_mut(id)).filter(|_| was_filled(row)) {
            trade.filled[leg(row.get("ft_order_side"), trade.short)] += 1;
        }
    }
    for table in &orders {
        survivorship(table, draft);
        draft.each(table, |row, entries| order(row, &trades, entries))?;
    }
    Ok(())
}

/// 0 for an order that enters a trade, 1 for one that leaves it.
fn leg(side: Option<&str>, short: bool) -> usize {
    let enters = if short { "sell" } else { "buy" };
    usize::from(side.is_none_or(|side| !side.eq_ignore_ascii_case(enters)))
}

fn was_filled(row: Record<'_>) -> bool {
    let filled = row.get("filled").and_then(|text| text.parse::<f64>().ok());
    filled.map_or(row.get("status") == Some("closed"), |filled| filled > 0.0)
}

fn trade(row: &mut Row<'_>) -> Result<Trade, Stop> {
    let mut cost = |cost: &str, currency: &str| -> Result<Option<(Cash, Option<String>)>, Stop> {
        Ok(row.cash(cost)?.map(|amount| (amount, row.owned(currency))))
    };
    let costs = [cost("fee_open_cost", "fee_open_currency")?, cost("fee_close_cost", "fee_close_currency")?];
    Ok(Trade {
        strategy: row.owned("strategy"),
        tags: [&["enter_tag", "buy_tag"], &["exit_reason", "sell_reason"]].map(|keys| row.text_of(keys).map(str::to_owned)),
        rates: [row.price("fee_open")?, row.price("fee_close")?],
        costs,
        short: row.is_true("is_short"),
        filled: [0, 0],
    })
}

/// The bot deletes a trade whose entry never filled, with its order: the numbers of what is left have gaps then.
fn survivorship(table: &Records, draft: &mut Draft<'_>) {
    let ids: Vec<i64> = table.iter().filter_map(|row| row.get("id")?.parse().ok()).collect();
    let last = ids.iter().copied().max().unwrap_or_default();
    let missing = last.saturating_sub(ids.len() as i64);
    let message = "freqtrade deletes entries that never filled with their trades; what is left of entries has filled";
    let message = match missing {
        missing if missing > 0 => format!("{message}; of {last} orders {missing} are not there"),
        _ => format!("{message}; by the numbers of the orders none is missing"),
    };
    draft.note(FindingKind::Survivorship, message);
}

fn order(row: &mut Row<'_>, trades: &HashMap<String, Trade>, entries: &mut Entries) -> Result<(), Stop> {
    let of_leg = row.need("ft_order_side")?;
    let side = row.text("side").and_then(side_of).or_else(|| side_of(of_leg));
    let side = side.ok_or_else(|| row.unread("side", "expected a side, buy or sell"))?;
    let mut order = row.order(row.need("order_id")?, row.need("ft_pair")?, side);
    terms(row, &mut order)?;
    let trade = row.text("ft_trade_id").and_then(|id| trades.get(id));
    let leg = leg(Some(of_leg), trade.is_some_and(|trade| trade.short));
    order.strategy = trade.and_then(|trade| trade.strategy.clone());
    order.tag = row.owned("ft_order_tag").or_else(|| trade.and_then(|trade| trade.tags.get(leg).cloned().flatten()));
    outcome(row, &mut order)?;
    let polled = row.time("order_filled_date", Written::Utc)?;
    let last = match polled {
        Some(polled) => Some(polled),
        None => row.time("order_update_date", Written::Utc)?,
    };
    order.ended_at = last.filter(|_| order.status.as_ref().is_some_and(PaperStatus::is_final));
    let stated = PaperOrder { ended_at: last, ..order.clone() };
    let quote = pair(&order.symbol).1.map(str::to_owned);
    if let Some(fill) = entries.total(&stated, quote.as_deref()) {
        charge(row, fill, trade, leg, order.side)?;
    }
    entries.orders.push(order);
    Ok(())
}

/// What was asked for.
fn terms(row: &mut Row<'_>, order: &mut PaperOrder) -> Result<(), Stop> {
    // What the exchange was asked for, after its precision; `ft_amount` is what the bot reckoned.
    order.quantity = row.quantity(if row.text("amount").is_some() { "amount" } else { "ft_amount" })?;
    order.kind = row.text("order_type").map(OrderWords::of_word);
    // The price of a market order is what the bot saw.
    order.limit_price = match order.kind {
        Some(OrderWords::Market) => None,
        _ => row.price_above_zero("price")?,
    };
    order.stop_price = row.price_above_zero("stop_price")?;
    order.decided_at = row.time("order_date", Written::Utc)?;
    Ok(())
}

/// What became of it.
fn outcome(row: &mut Row<'_>, order: &mut PaperOrder) -> Result<(), Stop> {
    order.status = row.text("status").map(PaperStatus::of_word);
    order.filled = row.quantity("filled")?;
    let closed = order.status == Some(PaperStatus::Filled);
    if order.filled.is_none() && closed {
        row.note_cell(FindingKind::Note, "filled", "the order is closed and says not how much was filled: all of it counts");
        order.filled = order.quantity;
    }
    order.average_price = row.price_above_zero("average")?;
    if order.average_price.is_none() && order.filled.is_some_and(|filled| filled.0 > 0) {
        let column = if row.text("ft_price").is_some() && row.text("price").is_none() { "ft_price" } else { "price" };
        order.average_price = row.price_above_zero(column)?;
        row.note_cell(FindingKind::PriceOfOrder, column, "no average is stated; the fill has the price of the order");
    }
    Ok(())
}

/// The fee is kept with the trade: of the one order of a leg what it came to, of one of several its share by the rate.
fn charge(row: &mut Row<'_>, fill: &mut PaperFill, trade: Option<&Trade>, leg: usize, side: Side) -> Result<(), Stop> {
    let symbol = fill.symbol.clone();
    let base = pair(&symbol).0;
    if let Some(amount) = row.cash("ft_fee_base")?.filter(|amount| amount.0 != 0 && side == Side::Buy) {
        row.charge(fill, amount, base, base);
        return Ok(());
    }
    let Some(trade) = trade else { return Ok(()) };
    let only = trade.filled.get(leg) == Some(&1);
    if let Some((amount, currency)) = trade.costs.get(leg).and_then(Option::as_ref).filter(|_| only) {
        row.charge(fill, *amount, currency.as_deref(), base);
    } else if let Some(rate) = trade.rates.get(leg).copied().flatten() {
        let amount = worth(fill.price * fill.quantity, rate);
        let amount = amount.ok_or_else(|| row.unread("order_id", "the fee is beyond what is held"))?;
        row.note(FindingKind::FeeFromRate, format!("{rate} of what the fill came to"));
        let quote = fill.currency.clone();
        row.charge(fill, amount, quote.as_deref(), base);
    }
    Ok(())
}
